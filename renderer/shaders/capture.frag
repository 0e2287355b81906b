// Pass capture: mean exit factor per sr, coverage, and the part of the pixel that shows its own surface.
#include "common/exit.glsl"
layout(location = 0) out vec4 capture;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    capture = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        if (point_mm.w == 0.0)
            continue;
        vec3 normal_ws = texelFetch(surface_normal, pixel, i).xyz;
        capture.x += exit_per_sr(point_mm, normal_ws);
        capture.y += 1.0;
        capture.z += is_own(point_mm, normal_ws, pixel) ? 1.0 : 0.0;
    }
    capture /= 4.0;
}
