// Whether two points that a pixel, or two neighbours, show lie on one surface.

// Width of a pixel there. The eye: w = 1: position, mm; w = 0: direction toward it.
float footprint_mm(vec4 eye, float pixel_mm, vec3 position_ws_mm)
{
    return eye.w > 0.0 ? pixel_mm * distance(position_ws_mm, eye.xyz) : pixel_mm;
}

// Of one object, one near the tangent plane of the other and the other way round (at a silhouette a tangent
// plane holds the line of sight), and not farther than a pixel's width of a surface seen at 3 degrees.
bool is_same_surface(vec4 a_mm, vec3 a_normal, vec4 b_mm, vec3 b_normal, float width_mm)
{
    vec3 step_mm = a_mm.xyz - b_mm.xyz;
    float height_mm = max(abs(dot(step_mm, a_normal)), abs(dot(step_mm, b_normal)));
    return a_mm.w == b_mm.w && height_mm <= width_mm && dot(step_mm, step_mm) <= 400.0 * width_mm * width_mm;
}
