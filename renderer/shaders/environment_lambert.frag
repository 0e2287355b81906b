// Pass environment_lambert: radiosity += total reflectance times the irradiance that enters from all around.
#include "common/irradiance.glsl"
#include "common/medium.glsl"
uniform sampler2D position_mm;
uniform sampler2D normal;
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float object = texelFetch(position_mm, pixel, 0).w;
    radiosity_w_per_mm2 = vec4(0.0);
    if (object > 0.0)
        radiosity_w_per_mm2.rgb = medium_diffuse_reflectance(object) *
                                  environment_irradiance(texelFetch(normal, pixel, 0).xyz, object);
}
