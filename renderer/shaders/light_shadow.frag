// Pass light_shadow: what comes of a light to one point of each block of texels of its view, per channel.
#include "common/direction.glsl"
uniform vec4 light;         // w = 1: position, mm; w = 0: direction toward the light
#include "common/shadow.glsl"
uniform sampler2D light_view;
uniform int light_block_px; // side of a block
uniform int light_view_size_px;
layout(location = 0) out vec4 left;

vec4 texel_at(ivec2 texel)
{
    return texelFetch(light_view, clamp(texel, ivec2(0), ivec2(light_view_size_px - 1)), 0);
}

// Toward the nearer of two neighbours: the other one may be of another surface.
vec3 step_mm(ivec2 texel, ivec2 direction, vec3 here_mm)
{
    vec3 ahead = texel_at(texel + direction).xyz - here_mm, behind = here_mm - texel_at(texel - direction).xyz;
    return dot(ahead, ahead) > 0.0 && (dot(ahead, ahead) < dot(behind, behind) || dot(behind, behind) == 0.0) ? ahead : behind;
}

// The texel in the middle of the block, or the first where light enters.
ivec2 texel_of_block(ivec2 first)
{
    ivec2 found = first + light_block_px / 2;
    for (int i = 0; i < light_block_px * light_block_px && texel_at(found).w == 0.0; i++)
        found = first + ivec2(i % light_block_px, i / light_block_px);
    return found;
}

void main()
{
    ivec2 texel = texel_of_block(light_block_px * ivec2(gl_FragCoord.xy));
    vec4 here_mm = texel_at(texel);
    left = vec4(0.0);
    if (here_mm.w == 0.0)
        return;
    vec3 to_light = toward(light, here_mm.xyz);
    vec3 across = cross(step_mm(texel, ivec2(1, 0), here_mm.xyz), step_mm(texel, ivec2(0, 1), here_mm.xyz));
    vec3 normal_ws = unit_or(across, to_light);
    left.rgb = shadow_left(here_mm.xyz, dot(normal_ws, to_light) < 0.0 ? -normal_ws : normal_ws, gl_FragCoord.xy);
}
