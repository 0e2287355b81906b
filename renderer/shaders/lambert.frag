// Pass lambert: radiosity += total reflectance times the irradiance that enters, of one light's view.
#include "common/light.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"
uniform sampler2D position_mm;
uniform sampler2D normal;
#ifdef HAS_SHADOW
uniform sampler2D shadow;  // what blockers leave of the light
#endif
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here_mm = texelFetch(position_mm, pixel, 0);
    vec3 normal_ws = texelFetch(normal, pixel, 0).xyz;
    float cosine = min(dot(normal_ws, toward(light, here_mm.xyz)), 1.0);
    radiosity_w_per_mm2 = vec4(0.0);
    if (here_mm.w > 0.0 && cosine > 0.0) {
        float entering = cosine * (1.0 - fresnel_reflectance(medium_eta(here_mm.w), cosine));
#ifdef HAS_SHADOW
        vec3 visible = texelFetch(shadow, pixel, 0).rgb;
#else
        float visible = light_visibility(here_mm.xyz, normal_ws);
#endif
        radiosity_w_per_mm2.rgb =
            medium_diffuse_reflectance(here_mm.w) * light_irradiance(here_mm.xyz) * entering * visible;
    }
}
