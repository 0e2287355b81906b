// Pass surface_resolve: one surface for each pixel, even where objects are thinner than a pixel: that of the
// first of its points that shows an object, at the middle of all points that show the same, but no lower than
// any of them; and its depth, 0 where no object is.
#include "common/direction.glsl"
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
    vec4 points_mm[4], normals[4];
    bool is_same[4];
    int first = 4;
    for (int i = 3; i >= 0; i--) {
        points_mm[i] = texelFetch(surface_position_mm, pixel, i);
        normals[i] = texelFetch(surface_normal, pixel, i);
        first = points_mm[i].w > 0.0 ? i : first;
    }
    position_out_mm = vec4(0.0);
    normal_out = vec4(0.0);
    gl_FragDepth = 0.0;
    if (first == 4)
        return;
    vec4 first_mm = points_mm[first], first_normal = normals[first];
    float width_mm = footprint_mm(eye, pixel_mm, first_mm.xyz), count = 0.0;
    vec3 offset_mm = vec3(0.0), normal_sum = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        is_same[i] = is_same_surface(points_mm[i], normals[i].xyz, first_mm, first_normal.xyz, width_mm);
        if (is_same[i]) {
            offset_mm += points_mm[i].xyz - first_mm.xyz;
            normal_sum += normals[i].xyz;
            count += 1.0;
        }
    }
    vec3 normal = unit_or(normal_sum, first_normal.xyz), middle_mm = first_mm.xyz + offset_mm / max(count, 1.0);
    // Where the surface is round, the middle lies under it and would be in its shadow.
    float lift_mm = 0.0;
    for (int i = 0; i < 4; i++)
        lift_mm = is_same[i] ? max(lift_mm, dot(points_mm[i].xyz - middle_mm, normal)) : lift_mm;
    position_out_mm = vec4(middle_mm + lift_mm * normal, first_mm.w);
    normal_out = vec4(normal, first_normal.w);
    float depth = (dot(position_out_mm.xyz - eye_ws_mm, forward_ws) - near_mm) / (far_mm - near_mm);
    gl_FragDepth = clamp(depth, 1e-6, 1.0);
}
