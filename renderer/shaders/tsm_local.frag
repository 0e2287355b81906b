// Pass tsm_local: radiosity += what 7 x 7 cells about each fragment send out near where it entered (theory.md
// T32).
#include "common/tsm_map.glsl"
#include "common/tsm_response.glsl"
uniform sampler2D position_mm;
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    vec4 here_mm = texelFetch(position_mm, ivec2(gl_FragCoord.xy), 0);
    if (here_mm.w != map_object)
        discard;
    map_plane plane = map_plane_at(here_mm.xyz);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < 7; j++) {
        for (int i = 0; i < 7; i++) {
            map_cell cell;
            vec2 offset_mm = vec2(i - 3, j - 3) * tsm_table.local_width_mm;
            if (!map_cell_at(plane, offset_mm, tsm_table.local_width_mm, cell))
                continue;
            float dz_mm = map_depth_mm(plane, here_mm.xyz, cell.position_mm);
            sum += tsm_local_response(ivec2(i, j), dz_mm) * cell.flux_per_mm2;
        }
    }
    radiosity_w_per_mm2 = vec4(sum, 0.0);
}
