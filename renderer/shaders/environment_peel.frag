// Pass environment_peel: the nearest surface behind the last layer's, its normal, and the cosine of its facet to
// the axis; 0 where another axis is to take it.
#include "common/direction.glsl"
in vec3 position_ws_mm;
in vec3 normal_ws;
uniform sampler2D behind;
uniform int axis;
uniform bool is_only_axis;
uniform float object;  // number, from 1
layout(location = 0) out vec4 position_and_object;
layout(location = 1) out vec4 normal_and_cosine;

void main()
{
    if (gl_FragCoord.z <= texelFetch(behind, ivec2(gl_FragCoord.xy), 0).r)
        discard;
    vec3 facet = unit_or(cross(dFdx(position_ws_mm), dFdy(position_ws_mm)), vec3(0.0));
    vec3 size = abs(facet);
    // Ties go to the lowest axis.
    int most = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    position_and_object = vec4(position_ws_mm, object);
    normal_and_cosine = vec4(unit_or(normal_ws, facet), is_only_axis || most == axis ? facet[axis] : 0.0);
}
