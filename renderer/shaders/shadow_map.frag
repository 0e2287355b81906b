// Pass shadow_map: depth of the nearest opaque surface, along the axis of the light's view.
in vec3 position_ws_mm;
in vec2 corner;
uniform vec3 shadow_eye_mm, shadow_forward;
layout(location = 0) out float depth_mm;

void main()
{
    if (dot(corner, corner) > 1.0)
        discard;
    depth_mm = dot(position_ws_mm - shadow_eye_mm, shadow_forward);
}
