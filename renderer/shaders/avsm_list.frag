// Pass avsm: every surface of blockers that let light through, put at the end of one list.
in vec3 position_ws_mm;
in vec2 corner;
uniform vec3 shadow_eye_mm, shadow_forward;
uniform int shadow_size_px, blocker;
uniform uint item_limit;
layout(std430, binding = 0) buffer item_list {
    uint item_count;  // goes on past the limit, to tell how many there are
    uint unused;
    uvec2 items[];    // texel and blocker; depth, below 0 where the light enters
};

void main()
{
    if (dot(corner, corner) > 1.0)
        discard;
    float depth_mm = max(dot(position_ws_mm - shadow_eye_mm, shadow_forward), 1e-30);
    ivec2 texel = ivec2(gl_FragCoord.xy);
    uint place = atomicAdd(item_count, 1u);
    if (place < item_limit)
        items[place] = uvec2(uint(texel.y * shadow_size_px + texel.x) << 10 | uint(blocker),
                             floatBitsToUint(gl_FrontFacing ? -depth_mm : depth_mm));
}
