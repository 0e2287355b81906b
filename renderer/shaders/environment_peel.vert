// Pass environment_peel: object to the clip space of the view along an axis.
layout(location = 0) in vec3 position_in_mm;
layout(location = 1) in vec3 normal_in;
uniform mat4 view_projection;
out vec3 position_ws_mm;
out vec3 normal_ws;

void main()
{
    position_ws_mm = position_in_mm;
    normal_ws = normal_in;
    gl_Position = view_projection * vec4(position_in_mm, 1.0);
}
