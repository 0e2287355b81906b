// The vector as a unit vector; the other one where it is too short to have a direction.
vec3 unit_or(vec3 v, vec3 otherwise)
{
    float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    return largest > 1e-30 ? normalize(v / largest) : otherwise;
}

// Unit vector from a point toward a light or the eye: at infinity (w = 0, its direction) or at a place (w = 1);
// upward where the point is that place.
vec3 toward(vec4 target, vec3 position_ws_mm)
{
    return target.w > 0.0 ? unit_or(target.xyz - position_ws_mm, vec3(0.0, 1.0, 0.0)) : target.xyz;
}
