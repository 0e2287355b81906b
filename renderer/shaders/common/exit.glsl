// How radiosity leaves toward the eye (theory.md T14), and which radiosity a point of a pixel has.
#include "common/direction.glsl"
#include "common/fresnel.glsl"
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform sampler2D position_mm;
uniform sampler2D normal;
uniform vec4 eye;                 // w = 1: position, mm; w = 0: direction toward the eye
uniform float pixel_mm;           // size of a pixel; perspective: at distance 1
uniform float eta;
uniform float exit_scale_per_sr;  // 1 / (pi 2 int (1 - F) mu dmu)

// Radiance toward the eye per radiosity. Interpolated normals may lean away from the eye near the
// silhouette: there the angle is mirrored, which keeps the shade continuous.
float exit_per_sr(vec3 position_ws_mm, vec3 normal_ws)
{
    float cosine = min(abs(dot(normal_ws, toward(eye, position_ws_mm))), 1.0);
    return (1.0 - fresnel_reflectance(eta, cosine)) * exit_scale_per_sr;
}

float footprint_mm(vec3 position_ws_mm)
{
    return eye.w > 0.0 ? pixel_mm * distance(position_ws_mm, eye.xyz) : pixel_mm;
}

// Whether a point of the pixel lies on the surface that the pixel's radiosity was computed for: near the
// tangent plane there, the other way round as well (at a silhouette a tangent plane holds the line of sight),
// and not farther than a pixel's width of a surface seen at 3 degrees.
bool is_own(vec3 position_ws_mm, vec3 normal_ws, ivec2 pixel)
{
    vec3 step_mm = position_ws_mm - texelFetch(position_mm, pixel, 0).xyz;
    float height_mm = max(abs(dot(step_mm, texelFetch(normal, pixel, 0).xyz)), abs(dot(step_mm, normal_ws)));
    float width_mm = footprint_mm(position_ws_mm);
    return height_mm <= width_mm && dot(step_mm, step_mm) <= 400.0 * width_mm * width_mm;
}
