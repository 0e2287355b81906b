// Pass surface: position (w: number of the object, from 1) and normal (w = roughness, 0 without gloss). The
// interpolated w is 1, but in llvmpipe, which takes the depth of the pixel's middle for all its points: there
// it is what the position must be divided by to lie on the surface. Where the normals of a triangle's corners
// cancel, its own is taken.
#include "common/direction.glsl"
sample in vec4 position_ws_mm;
sample in vec3 normal_ws;
uniform float roughness;
uniform float object;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    vec3 position_mm = position_ws_mm.xyz / position_ws_mm.w;
    vec3 face = unit_or(cross(dFdx(position_mm), dFdy(position_mm)), vec3(0.0, 0.0, 1.0));
    position_out_mm = vec4(position_mm, object);
    normal_out = vec4(unit_or(normal_ws, gl_FrontFacing ? face : -face), roughness);
}
