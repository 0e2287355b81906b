// Pass shadow: what comes of one view's light to the surface of each pixel, per channel.
#include "common/light.glsl"
#include "common/shadow.glsl"
uniform sampler2D position_mm;
uniform sampler2D normal;
layout(location = 0) out vec4 left;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here_mm = texelFetch(position_mm, pixel, 0);
    vec3 normal_ws = texelFetch(normal, pixel, 0).xyz;
    left = vec4(0.0);
    if (here_mm.w > 0.0 && light_irradiance(here_mm.xyz) != vec3(0.0))
        left.rgb = shadow_left(here_mm.xyz, normal_ws, gl_FragCoord.xy);
}
