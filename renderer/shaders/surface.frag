// Pass surface: position (w: number of the object, from 1) and normal (w = roughness, 0 without gloss): the
// triangle's own where those of its corners cancel.
#include "common/direction.glsl"
centroid in vec3 position_ws_mm;
centroid in vec3 normal_ws;
uniform float roughness;
uniform float object;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    position_out_mm = vec4(position_ws_mm, object);
    vec3 face = unit_or(cross(dFdx(position_ws_mm), dFdy(position_ws_mm)), vec3(0.0, 0.0, 1.0));
    normal_out = vec4(unit_or(normal_ws, gl_FrontFacing ? face : -face), roughness);
}
