// Pass tsm_peel: object to the light's clip space.
layout(location = 0) in vec3 position_in_mm;
uniform mat4 map_view_projection;
uniform vec3 map_eye_mm, map_forward;
out float depth_mm;  // along the map's view

void main()
{
    depth_mm = dot(position_in_mm - map_eye_mm, map_forward);
    gl_Position = map_view_projection * vec4(position_in_mm, 1.0);
}
