// Pass capture: mean exit factor per sr, coverage, and the part of the pixel that shows its own surface.
#include "common/exit.glsl"
#include "common/points.glsl"
uniform sampler2D surface_exit;
layout(location = 0) out vec4 capture;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 exit = texelFetch(surface_exit, pixel, 0);
    capture = vec4(exit.xyz, 0.0);
    for (uint others = uint(exit.w) & 15u; others != 0u; others &= others - 1u) {
        surface_point point = point_of_pixel(pixel, findLSB(others));
        capture.x += 0.25 * exit_per_sr(eye, point.position_mm, point.normal);
    }
}
