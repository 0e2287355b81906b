// Unit vector from a point toward a light or the eye: at infinity (w = 0, its direction) or at a place (w = 1).
vec3 toward(vec4 target, vec3 position_ws_mm)
{
    return target.w > 0.0 ? normalize(target.xyz - position_ws_mm) : target.xyz;
}
