// Pass tsm_shadow: what comes of a light to one point of each block of texels of a translucent shadow map, per
// channel.
#include "common/direction.glsl"
uniform vec4 light;         // w = 1: position, mm; w = 0: direction toward the light
#include "common/shadow.glsl"
uniform sampler2D tsm_position_mm;  // from the object's middle; w: 0 where it is not
uniform sampler2D tsm_normal;
uniform vec3 map_centre_mm;
uniform int tsm_block_px;
layout(location = 0) out vec4 left;

// The texel in the middle of the block, or the first that the object covers.
ivec2 texel_of_block(ivec2 first)
{
    ivec2 limit = textureSize(tsm_position_mm, 0) - 1, found = min(first + tsm_block_px / 2, limit);
    for (int i = 0; i < tsm_block_px * tsm_block_px && texelFetch(tsm_position_mm, found, 0).w == 0.0; i++)
        found = min(first + ivec2(i % tsm_block_px, i / tsm_block_px), limit);
    return found;
}

void main()
{
    ivec2 texel = texel_of_block(tsm_block_px * ivec2(gl_FragCoord.xy));
    vec4 here_mm = texelFetch(tsm_position_mm, texel, 0);
    left = vec4(0.0);
    if (here_mm.w > 0.0)
        left.rgb = shadow_left(map_centre_mm + here_mm.xyz, texelFetch(tsm_normal, texel, 0).xyz, gl_FragCoord.xy);
}
