// Pass surface_resolve: one surface for each pixel, even where objects are thinner than a pixel: that of the
// first of its points that shows an object, at the middle of all points that show the same; and its depth, 0
// where no object is.
#include "common/same_surface.glsl"
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform vec3 eye_ws_mm, forward_ws;
uniform float near_mm, far_mm;
uniform vec4 eye;        // w = 1: position, mm; w = 0: direction toward the eye
uniform float pixel_mm;  // size of a pixel; perspective: at distance 1
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    position_out_mm = vec4(0.0);
    normal_out = vec4(0.0);
    vec4 first_mm = vec4(0.0), first_normal = vec4(0.0);
    float count = 0.0;
    for (int i = 0; i < 4; i++) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        vec4 point_normal = texelFetch(surface_normal, pixel, i);
        if (point_mm.w == 0.0)
            continue;
        if (count == 0.0) {
            first_mm = point_mm;
            first_normal = point_normal;
        }
        if (is_same_surface(point_mm, point_normal.xyz, first_mm, first_normal.xyz,
                            footprint_mm(eye, pixel_mm, first_mm.xyz))) {
            position_out_mm += vec4(point_mm.xyz - first_mm.xyz, 0.0);
            normal_out += vec4(point_normal.xyz, 0.0);
            count += 1.0;
        }
    }
    if (count > 0.0) {
        position_out_mm = vec4(first_mm.xyz + position_out_mm.xyz / count, first_mm.w);
        normal_out = vec4(normalize(normal_out.xyz), first_normal.w);
    }
    float depth = (dot(position_out_mm.xyz - eye_ws_mm, forward_ws) - near_mm) / (far_mm - near_mm);
    gl_FragDepth = position_out_mm.w > 0.0 ? clamp(depth, 1e-6, 1.0) : 0.0;
}
