// Pass surface_resolve: one surface for each pixel, even where objects are thinner than a pixel: that of the
// first of its points that shows an object, at the middle of all points that show the same; and its depth, 0
// where no object is.
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

vec4 points_mm[4], normals[4];  // w of a point that shows another surface is 0

// The middle of the points that show the surface of the first of them lies below it where it is curved; on
// average their tangent planes pass as far above. At a silhouette, where that is much of a pixel, the point
// nearest to the middle is taken.
void resolve(int first)
{
    vec3 middle_mm = vec3(0.0), middle_normal = vec3(0.0);
    float count = 0.0, width_mm = footprint_mm(eye, pixel_mm, points_mm[first].xyz);
    vec4 first_mm = points_mm[first];
    for (int i = first; i < 4; i++) {
        if (!is_same_surface(points_mm[i], normals[i].xyz, first_mm, normals[first].xyz, width_mm))
            points_mm[i].w = 0.0;
        if (points_mm[i].w == 0.0)
            continue;
        middle_mm += points_mm[i].xyz - first_mm.xyz;
        middle_normal += normals[i].xyz;
        count += 1.0;
    }
    middle_mm = first_mm.xyz + middle_mm / count;
    vec3 rise_mm = vec3(0.0);
    int nearest = first;
    for (int i = first; i < 4; i++) {
        if (points_mm[i].w == 0.0)
            continue;
        rise_mm += dot(points_mm[i].xyz - middle_mm, normals[i].xyz) * normals[i].xyz;
        if (distance(points_mm[i].xyz, middle_mm) < distance(points_mm[nearest].xyz, middle_mm))
            nearest = i;
    }
    rise_mm /= 2.0 * count;
    bool is_flat = length(rise_mm) < 0.05 * width_mm;
    position_out_mm = vec4(is_flat ? middle_mm + rise_mm : points_mm[nearest].xyz, first_mm.w);
    normal_out = vec4(is_flat ? unit_or(middle_normal, normals[first].xyz) : normals[nearest].xyz, normals[first].w);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int first = 4;
    for (int i = 3; i >= 0; i--) {
        points_mm[i] = texelFetch(surface_position_mm, pixel, i);
        normals[i] = texelFetch(surface_normal, pixel, i);
        if (points_mm[i].w > 0.0)
            first = i;
    }
    position_out_mm = vec4(0.0);
    normal_out = vec4(0.0);
    if (first < 4)
        resolve(first);
    float depth = (dot(position_out_mm.xyz - eye_ws_mm, forward_ws) - near_mm) / (far_mm - near_mm);
    gl_FragDepth = position_out_mm.w > 0.0 ? clamp(depth, 1e-6, 1.0) : 0.0;
}
