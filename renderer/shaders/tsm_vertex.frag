// Pass tsm_vertex: the same as tsm_global for each vertex of a mesh.
#include "common/tsm_global.glsl"
uniform sampler2D tsm_vertices;
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    vec4 here_mm = texelFetch(tsm_vertices, ivec2(gl_FragCoord.xy), 0);
    if (here_mm.w != map_object)
        discard;
    radiosity_w_per_mm2 = vec4(tsm_global_radiosity(here_mm.xyz), 0.0);
}
