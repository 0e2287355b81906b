// Pose passes: an object's vertices from where they rest to where the frame has them. Nothing is drawn; what is written
// goes back to the buffers that all other passes draw from.
#include "common/deform.glsl"
layout(location = 0) in vec3 rest_mm;
layout(location = 1) in vec3 rest_normal;
out vec3 position_mm;
out vec3 normal;

void main()
{
    position_mm = rest_mm;
    normal = rest_normal;
    pose(position_mm, normal);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
