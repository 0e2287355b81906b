// Pass tsm_local: radiosity += the response to 7 x 7 cells about each fragment, of which the five inner samples of
// the pattern leave to it what lies about as deep (theory.md T32, T37).
#include "common/tsm_map.glsl"
#include "common/tsm_form.glsl"
uniform sampler2D position_mm;
uniform samplerBuffer tsm_pattern;
uniform samplerBuffer tsm_kernel;  // of each cell: mean over value in the middle, times area
uniform float inner_mm, local_width_mm;
layout(location = 0) out vec4 radiosity_w_per_mm2;

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
        float dz_mm = map_depth_mm(plane, here_mm.xyz, cell.position_mm);
        float distance_mm = map_distance_mm(offset_mm * map_spread(plane, dz_mm), dz_mm);
        vec3 normal = map_normal(cell, delta_mm, distance_mm);
        float cosine = clamp(dot(normal, delta_mm) / max(length(delta_mm), 1e-20), -1.0, 1.0);
        sum += part * texelFetch(tsm_kernel, i).rgb * tsm_form_at(distance_mm, cosine) * cell.flux_per_mm2;
    }
    radiosity_w_per_mm2 = vec4(sum, 0.0);
}
