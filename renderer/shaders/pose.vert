// Pose passes: an object's vertices from where they rest to where the frame has them. Nothing is drawn; what is written
// goes back to the buffers that all other passes draw from.
#include "common/deform.glsl"
layout(location = 0) in vec3 rest_mm;
layout(location = 1) in vec3 rest_normal;
out vec4 position_mm;
out vec4 normal;

void main()
{
    vec3 posed_mm = rest_mm, posed_normal = rest_normal;
    pose(posed_mm, posed_normal);
    position_mm = vec4(posed_mm, 0.0);
    normal = vec4(posed_normal, 0.0);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
