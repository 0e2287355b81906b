// A pixel's four points: where the eye's rays through them meet the triangles that they show (theory.md T58).
// Needs common/direction.glsl.
uniform usampler2DMS surface_triangle;    // number of the triangle, from 1; 0: none
uniform usamplerBuffer mesh_triangles;    // numbers of the corners; w: number of the object, from 1
uniform samplerBuffer mesh_positions_mm;  // of all vertices
uniform samplerBuffer mesh_normals;
uniform samplerBuffer mesh_roughness;     // of each object; 0: no gloss
uniform vec2 point_places[4];             // from the pixel's corner, in pixels
uniform vec4 eye;                         // w = 1: position, mm; w = 0: direction toward the eye
uniform vec3 ray_corner, ray_right, ray_up;  // perspective: direction of a ray; parallel: where it comes from

struct surface_point {
    vec4 position_mm;  // w: number of the object; 0: none is seen
    vec3 normal;
};

// Moeller and Trumbore 1997. What a pixel shows of a triangle may lie up to a rounding outside of it: where it is seen
// edge on that would be far away, so the nearest corner or edge is taken.
vec2 place_in_triangle(vec3 from_corner, vec3 ray, vec3 side_b, vec3 side_c, out bool is_within)
{
    vec3 p = cross(ray, side_c), q = cross(from_corner, side_b);
    float volume = dot(side_b, p), scale = abs(volume) > 1e-36 ? 1.0 / volume : 0.0;
    vec2 place = scale * vec2(dot(from_corner, p), dot(ray, q));
    float b = clamp(place.x, 0.0, 1.0);
    vec2 nearest = vec2(b, clamp(place.y, 0.0, 1.0 - b));
    is_within = place == nearest && scale != 0.0;
    return nearest;
}

// Where the eye's ray through a place, in pixels, meets a triangle, by its number.
surface_point point_of_triangle(int triangle, vec2 at, out bool is_within)
{
    ivec4 corners = ivec4(texelFetch(mesh_triangles, max(triangle - 1, 0)));
    vec3 corner_mm = texelFetch(mesh_positions_mm, corners.x).xyz;
    vec3 side_b = texelFetch(mesh_positions_mm, corners.y).xyz - corner_mm;
    vec3 side_c = texelFetch(mesh_positions_mm, corners.z).xyz - corner_mm;
    vec3 ray = ray_corner + at.x * ray_right + at.y * ray_up;
    vec2 place = place_in_triangle((eye.w > 0.0 ? eye.xyz : ray) - corner_mm, eye.w > 0.0 ? ray : -eye.xyz, side_b,
                                   side_c, is_within);
    vec3 a = texelFetch(mesh_normals, corners.x).xyz, b = texelFetch(mesh_normals, corners.y).xyz,
         c = texelFetch(mesh_normals, corners.z).xyz;
    vec3 normal = (1.0 - place.x - place.y) * a + place.x * b + place.y * c;
    vec3 face = unit_or(cross(side_b, side_c), vec3(0.0, 0.0, 1.0));  // where the corners' normals cancel
    surface_point point;
    point.position_mm = vec4(corner_mm + place.x * side_b + place.y * side_c, float(corners.w));
    point.normal = unit_or(normal, face);
    if (triangle == 0)
        point = surface_point(vec4(0.0), vec3(0.0));
    return point;
}

float longest_side_mm(int triangle)
{
    ivec4 corners = ivec4(texelFetch(mesh_triangles, max(triangle - 1, 0)));
    vec3 a = texelFetch(mesh_positions_mm, corners.x).xyz, b = texelFetch(mesh_positions_mm, corners.y).xyz,
         c = texelFetch(mesh_positions_mm, corners.z).xyz;
    return max(distance(a, b), max(distance(b, c), distance(c, a)));
}

surface_point point_of_pixel(ivec2 pixel, int i)
{
    bool is_within;
    return point_of_triangle(int(texelFetch(surface_triangle, pixel, i).r), vec2(pixel) + point_places[i], is_within);
}
