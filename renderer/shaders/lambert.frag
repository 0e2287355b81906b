// Pass lambert: radiosity += total reflectance times the irradiance that enters, of one light's view.
#include "common/light.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform sampler2D position_mm;
uniform sampler2D normal;
layout(location = 0) out vec4 radiosity_w_per_mm2;

// Of the pixel's point that is nearest: it lies on the surface, the pixel's middle may lie under it.
float visibility(vec4 here_mm, ivec2 pixel)
{
    int nearest = 0;
    float least2 = 1e38;
    for (int i = 0; i < 4; i++) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        vec3 step_mm = point_mm.xyz - here_mm.xyz;
        if (point_mm.w == here_mm.w && dot(step_mm, step_mm) < least2) {
            nearest = i;
            least2 = dot(step_mm, step_mm);
        }
    }
    return light_visibility(texelFetch(surface_position_mm, pixel, nearest).xyz,
                            texelFetch(surface_normal, pixel, nearest).xyz);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here_mm = texelFetch(position_mm, pixel, 0);
    vec3 normal_ws = texelFetch(normal, pixel, 0).xyz;
    float cosine = min(dot(normal_ws, toward(light, here_mm.xyz)), 1.0);
    radiosity_w_per_mm2 = vec4(0.0);
    if (here_mm.w > 0.0 && cosine > 0.0) {
        float entering = cosine * (1.0 - fresnel_reflectance(medium_eta(here_mm.w), cosine));
        radiosity_w_per_mm2.rgb = medium_diffuse_reflectance(here_mm.w) * light_irradiance(here_mm.xyz) * entering *
                                  visibility(here_mm, pixel);
    }
}
