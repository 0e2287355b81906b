// Pass tsm_resolve: radiosity += the mean over those of a pixel's points that show the same surface as the pixel's
// own.
#include "common/direction.glsl"
#include "common/points.glsl"
#include "common/same_surface.glsl"
uniform sampler2DMS tsm_surface_radiosity;
uniform sampler2D position_mm;
uniform sampler2D normal;
uniform float pixel_mm;  // size of a pixel; perspective: at distance 1
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here_mm = texelFetch(position_mm, pixel, 0);
    vec3 here_normal = texelFetch(normal, pixel, 0).xyz;
    if (here_mm.w == 0.0)
        discard;
    vec3 sum = vec3(0.0);
    float count = 0.0;
    for (int i = 0; i < 4; i++) {
        vec4 radiosity = texelFetch(tsm_surface_radiosity, pixel, i);
        surface_point point = point_of_pixel(pixel, i);
        if (radiosity.w == here_mm.w && is_same_surface(point.position_mm, point.normal, here_mm, here_normal,
                                                        footprint_mm(eye, pixel_mm, here_mm.xyz))) {
            sum += radiosity.rgb;
            count += 1.0;
        }
    }
    radiosity_w_per_mm2 = vec4(count > 0.0 ? sum / count : vec3(0.0), 0.0);
}
