// Pass light_view: object to the light's clip space.
layout(location = 0) in vec3 position_in_mm;
layout(location = 1) in vec3 normal_in;
uniform mat4 view_projection;
out vec3 position_ws_mm;
out vec3 normal_ws;
#ifdef HAS_LIGHT_REST
layout(location = 2) in vec3 rest_in_mm;
out vec3 rest_mm;
#endif

void main()
{
#ifdef HAS_LIGHT_REST
    rest_mm = rest_in_mm;
#endif
    position_ws_mm = position_in_mm;
    normal_ws = normal_in;
    gl_Position = view_projection * vec4(position_in_mm, 1.0);
}
