// The global response: flux of the pattern's cells, each through its part of the volume (theory.md T32).
#include "common/tsm_map.glsl"
#include "common/tsm_response.glsl"
#include "common/tsm_solid.glsl"

vec3 tsm_global_radiosity(vec3 here_mm)
{
    map_plane plane = map_plane_at(here_mm);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < tsm_sample_count; i++) {
        vec4 place = texelFetch(tsm_pattern, i);
        map_cell cell;
        if (!map_cell_at(plane, place.xy, place.z, cell))
            continue;
        float dz_mm = map_depth_mm(plane, here_mm, cell.position_mm);
        float held_mm = clamp(dz_mm, -tsm_table.depth_max_mm, tsm_table.depth_max_mm);
        vec3 decay = exp(-tsm_decay_per_mm * abs(dz_mm - held_mm)); // deeper than the volume: as a plane wave
        float spread = map_spread(plane, dz_mm);
        vec3 delta_mm = here_mm - cell.position_mm;
        vec3 normal = map_normal(cell, delta_mm, map_distance_mm(spread * place.xy, held_mm));
        vec3 response = tsm_response_per_mm2(i, place.xy, spread, delta_mm, normal, held_mm);
        sum += response * decay * place.w * cell.flux_per_mm2 * tsm_solid_part(here_mm, cell.middle_mm);
    }
    return sum;
}
