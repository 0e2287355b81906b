// Pass tsm_local: radiosity += the response to 7 x 7 cells about each fragment, of which the five inner samples of
// the pattern leave to it what lies about as deep (theory.md T32, T34).
#include "common/tsm_map.glsl"
uniform sampler2D position_mm;
uniform samplerBuffer tsm_pattern;
uniform samplerBuffer tsm_kernel;  // of each cell: mean over value in the middle, times area
uniform float inner_mm, local_width_mm;
layout(location = 0) out vec4 radiosity_w_per_mm2;

#ifdef HAS_TSM_SOURCES
#include "common/tsm_sources.glsl"

vec3 local_form_per_mm2(float distance_mm, float cosine)
{
    return tsm_form_per_mm2(distance_mm, cosine);
}
#else
uniform sampler2D tsm_form;  // R by distance, scale sinh(u asinh(reach/scale)), and cosine
uniform float local_scale_mm, local_reach_mm;

vec3 local_form_per_mm2(float distance_mm, float cosine)
{
    vec2 size = vec2(textureSize(tsm_form, 0));
    float u = asinh(distance_mm / local_scale_mm) / asinh(local_reach_mm / local_scale_mm);
    return textureLod(tsm_form, (vec2(u, 0.5 + 0.5 * cosine) * (size - 1.0) + 0.5) / size, 0.0).rgb;
}
#endif

// lut_tsm_proximity is the same in C.
float proximity(float dz_mm)
{
    float x = min(abs(dz_mm) / inner_mm, 1.0);
    return 1.0 - x * x * x * (x * (6.0 * x - 15.0) + 10.0);
}

// Part of a cell, counted from the middle one, that lies in the inner sample that stands on its corner.
float part_in_middle(ivec2 cell)
{
    ivec2 a = abs(cell);
    int steps = a.x + a.y;
    if (steps == 3)
        return a.x == 0 || a.y == 0 ? 0.75 : 0.875;
    return steps < 3 ? 1.0 : steps == 4 ? 0.125 : 0.0;
}

void main()
{
    vec4 here_mm = texelFetch(position_mm, ivec2(gl_FragCoord.xy), 0);
    if (here_mm.w != map_object)
        discard;
    map_plane plane = map_plane_at(here_mm.xyz);
    float near[5];  // the local part of each inner sample: in the middle, then counter-clockwise from u, v > 0
    for (int i = 0; i < 5; i++) {
        vec4 place = texelFetch(tsm_pattern, i);
        map_cell cell;
        near[i] = map_cell_shown(plane, place.xy, place.z, cell)
                      ? proximity(map_depth_mm(plane, here_mm.xyz, cell.position_mm))
                      : 0.0;
    }
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 49; i++) {
        ivec2 at = ivec2(i % 7, i / 7) - 3;
        vec2 offset_mm = vec2(at) * local_width_mm;
        float beside = 0.5 * (near[at.y >= 0 ? at.x >= 0 ? 1 : 2 : at.x >= 0 ? 4 : 3] +
                              near[at.y > 0 ? at.x > 0 ? 1 : 2 : at.x > 0 ? 4 : 3]);
        float part = mix(beside, near[0], part_in_middle(at));
        map_cell cell;
        if (part == 0.0 || !map_cell_at(plane, offset_mm, local_width_mm, cell))
            continue;
        vec3 delta_mm = here_mm.xyz - cell.position_mm;
        float distance_mm = map_distance_mm(offset_mm, map_depth_mm(plane, here_mm.xyz, cell.position_mm));
        vec3 normal = map_normal(cell, delta_mm, distance_mm);
        float cosine = clamp(dot(normal, delta_mm) / max(length(delta_mm), 1e-20), -1.0, 1.0);
        sum += part * texelFetch(tsm_kernel, i).rgb * local_form_per_mm2(distance_mm, cosine) * cell.flux_per_mm2;
    }
    radiosity_w_per_mm2 = vec4(sum, 0.0);
}
