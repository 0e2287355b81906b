// The 3D form of the response (theory.md T30) by distance and cosine: evaluated, or looked up.
#ifdef HAS_TSM_SOURCES
#include "common/tsm_sources.glsl"

vec3 tsm_form_at(float distance_mm, float cosine)
{
    return tsm_form_per_mm2(distance_mm, cosine);
}
#else
uniform sampler2D tsm_form;  // by distance, scale sinh(u asinh(reach/scale)), and cosine
uniform float form_scale_mm, form_reach_mm;

vec3 tsm_form_at(float distance_mm, float cosine)
{
    vec2 size = vec2(textureSize(tsm_form, 0));
    float u = asinh(distance_mm / form_scale_mm) / asinh(form_reach_mm / form_scale_mm);
    return textureLod(tsm_form, (vec2(u, 0.5 + 0.5 * cosine) * (size - 1.0) + 0.5) / size, 0.0).rgb;
}
#endif
