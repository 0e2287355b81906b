// Pass surface: object to the camera's clip space.
layout(location = 0) in vec3 position_in_mm;
uniform mat4 view_projection;

void main()
{
    gl_Position = view_projection * vec4(position_in_mm, 1.0);
}
