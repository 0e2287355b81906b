// Pass surface: object to the camera's clip space.
layout(location = 0) in vec4 position_in_mm;  // w = 1, which OpenGL adds
layout(location = 1) in vec3 normal_in;
uniform mat4 view_projection;
sample out vec4 position_ws_mm;
sample out vec3 normal_ws;

void main()
{
    position_ws_mm = position_in_mm;
    normal_ws = normal_in;
    gl_Position = view_projection * position_in_mm;
}
