// How radiosity leaves toward the eye (theory.md T14).
#include "common/direction.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"

// Radiance toward the eye (w = 1: position, mm; w = 0: direction) per radiosity. Interpolated normals may lean away
// from the eye near the silhouette: there the angle is mirrored, which keeps the shade continuous. Positions have
// w = object.
float exit_per_sr(vec4 eye, vec4 position_ws_mm, vec3 normal_ws)
{
    float cosine = min(abs(dot(normal_ws, toward(eye, position_ws_mm.xyz))), 1.0);
    return (1.0 - fresnel_reflectance(medium_eta(position_ws_mm.w), cosine)) *
           medium_exit_scale_per_sr(position_ws_mm.w);
}
