// Pass surface_resolve: one surface for each pixel, even where objects are thinner than a pixel: that of the
// first of its points that shows an object, at the middle of all points that show the same; and how its points let
// radiosity out.
#include "common/exit.glsl"
#include "common/points.glsl"
#include "common/same_surface.glsl"
uniform float pixel_mm;     // size of a pixel; perspective: at distance 1
uniform float flat_mm;      // how far from a surface light may be looked for (theory.md T14)
uniform float gloss_spread;  // of normals, as part of the roughness, that gloss does not show (theory.md T58)
layout(location = 0) out vec4 position_out_mm;
// x: exit per sr of the points that show this surface, over 4; y: part of the pixel that is covered; z: that shows this
// surface; w: bit i: point i does not; bit 4: gloss differs among those that do.
layout(location = 1) out vec4 exit_out;
#ifdef HAS_NORMAL
layout(location = 2) out vec4 surface_normal;
#endif

vec4 normal_out;  // w: roughness

surface_point points[4];
bool is_shown[4];  // the same surface as the first

// The middle of the points that show the surface of the first of them lies below it where it is curved; on
// average their tangent planes pass as far above. At a silhouette, where that is much of a pixel, and where light
// hardly spreads so far, a place on the triangles is taken: where the ray through the middle of the points meets
// one, else the point nearest to the middle.
void resolve(ivec2 pixel, vec4 first_mm, vec3 first_normal)
{
    vec3 middle_mm = vec3(0.0), middle_normal = vec3(0.0);
    vec2 middle = vec2(0.0);
    float count = 0.0, width_mm = footprint_mm(eye, pixel_mm, first_mm.xyz);
    for (int i = 0; i < 4; i++) {
        is_shown[i] = is_same_surface(points[i].position_mm, points[i].normal, first_mm, first_normal, width_mm);
        if (is_shown[i]) {
            middle_mm += points[i].position_mm.xyz - first_mm.xyz;
            middle_normal += points[i].normal;
            middle += point_places[i];
            count += 1.0;
        }
    }
    middle_mm = first_mm.xyz + middle_mm / count;
    vec3 rise_mm = vec3(0.0), nearest_mm = first_mm.xyz, nearest_normal = first_normal;
    for (int i = 0; i < 4; i++) {
        vec3 point_mm = points[i].position_mm.xyz, normal = points[i].normal;
        if (is_shown[i])
            rise_mm += dot(point_mm - middle_mm, normal) * normal;
        if (is_shown[i] && distance(point_mm, middle_mm) < distance(nearest_mm, middle_mm)) {
            nearest_mm = point_mm;
            nearest_normal = normal;
        }
    }
    rise_mm /= 2.0 * count;
    bool is_flat = length(rise_mm) < 0.05 * width_mm;
    float side_mm = 0.0;
    for (int i = length(rise_mm) > flat_mm ? 0 : 4; i < 4; i++) {
        bool is_within;
        int triangle = int(texelFetch(surface_triangle, pixel, i).r);
        surface_point point = point_of_triangle(triangle, vec2(pixel) + middle / count, is_within);
        if (!is_shown[i])
            continue;
        if (is_within) {
            nearest_mm = point.position_mm.xyz;
            nearest_normal = point.normal;
            side_mm = 1e30;
            break;
        }
        side_mm = max(side_mm, longest_side_mm(triangle));
    }
    // triangles leave a smooth surface by so much less as they are smaller than the pixel
    is_flat = is_flat && length(rise_mm) * side_mm * side_mm < flat_mm * width_mm * width_mm;
    position_out_mm = vec4(is_flat ? middle_mm + rise_mm : nearest_mm, first_mm.w);
    normal_out = vec4(is_flat ? unit_or(middle_normal, first_normal) : nearest_normal,
                      texelFetch(mesh_roughness, int(first_mm.w) - 1).r);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    for (int i = 0; i < 4; i++)
        points[i] = point_of_pixel(pixel, i);
    surface_point first = points[3];
    for (int i = 2; i >= 0; i--) {
        if (points[i].position_mm.w > 0.0)
            first = points[i];
    }
    resolve(pixel, first.position_mm, first.normal);
    exit_out = vec4(0.0);
    float spread2 = 0.0;
    for (int i = 0; i < 4; i++) {
        vec4 point_mm = points[i].position_mm;
        vec3 normal = points[i].normal;
        bool is_own = is_same_surface(point_mm, normal, position_out_mm, normal_out.xyz,
                                      footprint_mm(eye, pixel_mm, point_mm.xyz));
        if (point_mm.w > 0.0)
            exit_out += is_own ? vec4(0.25 * exit_per_sr(eye, point_mm, normal), 0.25, 0.25, 0.0)
                               : vec4(0.0, 0.25, 0.0, float(1 << i));
        vec3 turn = normal - normal_out.xyz;
        if (point_mm.w > 0.0 && is_own)
            spread2 = max(spread2, dot(turn, turn));
    }
    if (spread2 > gloss_spread * gloss_spread * normal_out.w * normal_out.w)
        exit_out.w += 16.0;
#ifdef HAS_NORMAL
    surface_normal = normal_out;
#endif
}
