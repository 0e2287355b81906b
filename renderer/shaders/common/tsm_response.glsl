// The response to a sample of the pattern: looked up in a volume, or with HAS_TSM_SOURCES evaluated. spread: of
// map_spread; the volume knows parallel light alone.
#include "lutgen/tsm.glsl"
uniform dipole_tsm tsm_table;
uniform sampler3D tsm_volume;
uniform samplerBuffer tsm_pattern;  // offset, width and area of each sample
uniform int tsm_sample_count;
uniform vec3 tsm_decay_per_mm;      // sigma_tr
#include "common/tsm_form.glsl"
#ifdef HAS_TSM_SOURCES
uniform samplerBuffer tsm_factors;  // of the depth: a row for each sample
uniform int tsm_factor_nodes;

vec3 tsm_factor(int row, float dz_mm, float scale_mm, float max_mm)
{
    float node = (0.5 + 0.5 * asinh(dz_mm / scale_mm) / asinh(max_mm / scale_mm)) * float(tsm_factor_nodes - 1);
    int below = clamp(int(node), 0, tsm_factor_nodes - 2);
    int first = row * tsm_factor_nodes + below;
    return mix(texelFetch(tsm_factors, first).rgb, texelFetch(tsm_factors, first + 1).rgb, node - float(below));
}

vec3 tsm_response_per_mm2(int sample_index, vec2 offset_mm, float spread, vec3 delta_mm, vec3 normal, float dz_mm)
{
    float cosine = clamp(dot(normal, delta_mm) / max(length(delta_mm), 1e-20), -1.0, 1.0);
    return tsm_form_at(map_distance_mm(spread * offset_mm, dz_mm), cosine) *
           tsm_factor(sample_index, dz_mm, tsm_table.depth_scale_mm, tsm_table.depth_max_mm);
}
#else
vec3 tsm_response_per_mm2(int sample_index, vec2 offset_mm, float spread, vec3 delta_mm, vec3 normal, float dz_mm)
{
    vec3 response = dipole_tsm_response_per_mm2(tsm_volume, tsm_table, sample_index, delta_mm, normal, dz_mm);
    if (spread == 1.0)
        return response;
    float cosine = clamp(dot(normal, delta_mm) / max(length(delta_mm), 1e-20), -1.0, 1.0);
    return response * tsm_form_at(map_distance_mm(spread * offset_mm, dz_mm), cosine) /
           max(tsm_form_at(map_distance_mm(offset_mm, dz_mm), cosine), 1e-30);
}
#endif
