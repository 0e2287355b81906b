// How radiosity leaves toward the eye (theory.md T14), and which radiosity a point of a pixel has.
#include "common/direction.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"
#include "common/same_surface.glsl"
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform sampler2D position_mm;
uniform sampler2D normal;
uniform vec4 eye;        // w = 1: position, mm; w = 0: direction toward the eye
uniform float pixel_mm;  // size of a pixel; perspective: at distance 1

// Radiance toward the eye per radiosity. Interpolated normals may lean away from the eye near the
// silhouette: there the angle is mirrored, which keeps the shade continuous. Positions have w = object.
float exit_per_sr(vec4 position_ws_mm, vec3 normal_ws)
{
    float cosine = min(abs(dot(normal_ws, toward(eye, position_ws_mm.xyz))), 1.0);
    return (1.0 - fresnel_reflectance(medium_eta(position_ws_mm.w), cosine)) *
           medium_exit_scale_per_sr(position_ws_mm.w);
}

// Whether a point of the pixel lies on the surface that the pixel's radiosity was computed for.
bool is_own(vec4 position_ws_mm, vec3 normal_ws, ivec2 pixel)
{
    return is_same_surface(position_ws_mm, normal_ws, texelFetch(position_mm, pixel, 0),
                           texelFetch(normal, pixel, 0).xyz,
                           footprint_mm(eye, pixel_mm, position_ws_mm.xyz));
}
