// Pass tsm_global: radiosity += what comes through the volume from one map, at each fragment of its object.
#include "common/tsm_global.glsl"
uniform sampler2D position_mm;
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    vec4 here_mm = texelFetch(position_mm, ivec2(gl_FragCoord.xy), 0);
    if (here_mm.w != map_object)
        discard;
    radiosity_w_per_mm2 = vec4(tsm_global_radiosity(here_mm.xyz), 0.0);
}
