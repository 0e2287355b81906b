// A translucent shadow map, sampled about a point of the surface: cells of the plane across the light through
// that point (theory.md T32).
uniform sampler2D tsm_position_mm;  // from the object's middle, times w = coverage
uniform sampler2D tsm_normal;       // times coverage
uniform sampler2D tsm_flux;
uniform vec4 light;                 // w = 1: position, mm; w = 0: direction toward the light
uniform mat4 map_view_projection;
uniform vec3 map_right, map_up, map_forward, map_centre_mm;
uniform float map_size_px;          // of the part of the texture that is this map
uniform float map_texture_px;
uniform float map_texel_mm;         // width of a texel; point light: at distance 1
uniform int map_cube_face;          // -1: the map holds all that the light sees of the object
uniform float map_object;           // number of the object, from 1

// Face of the cube about the light that a direction falls on; each direction has exactly one.
int map_face(vec3 d)
{
    vec3 a = abs(d);
    int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    return 2 * axis + (d[axis] < 0.0 ? 1 : 0);
}

// The plane across the light through a point: axes u and v, the way that light goes, how far it has come.
struct map_plane {
    vec3 here_mm, u, v, along;
    float distance_mm;
};

map_plane map_plane_at(vec3 here_mm)
{
    if (light.w == 0.0)
        return map_plane(here_mm, map_right, map_up, map_forward, 0.0);
    vec3 ray = here_mm - light.xyz;
    float distance_mm = length(ray);
    vec3 along = ray / max(distance_mm, 1e-20), right = map_right;
    if (map_cube_face >= 0) { // the same in all six maps
        int face = map_face(along);
        right = face / 2 == 1 ? vec3(1.0, 0.0, 0.0) : face / 2 == 0 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    }
    vec3 u = normalize(right - dot(right, along) * along);
    return map_plane(here_mm, u, cross(along, u), along, distance_mm);
}

// How much deeper a lies than b, along the light.
float map_depth_mm(map_plane plane, vec3 a_mm, vec3 b_mm)
{
    return dot(a_mm - b_mm, plane.along);
}

// Light of a point spreads: how wide the plane's cells are where light enters that is dz_mm less deep, over how wide
// they are in the plane.
float map_spread(map_plane plane, float dz_mm)
{
    return light.w == 0.0 ? 1.0 : clamp(1.0 - dz_mm / plane.distance_mm, 0.1, 10.0);
}

// What is in one cell of it.
struct map_cell {
    vec3 position_mm, normal;  // means of what is covered
    vec3 middle_mm;            // a point of the surface, in the middle where that is covered
    vec3 flux_per_mm2;         // mean over the cell
};

// Where a point falls in the texture, and the level of detail that averages over such a width there: a filtered
// texel is the mean over twice its own width.
vec3 map_place(vec3 place_mm, float width_mm)
{
    vec4 clip = map_view_projection * vec4(place_mm, 1.0);
    vec2 at = (0.5 * clip.xy / clip.w + 0.5) * (map_size_px / map_texture_px);
    float texel_mm = map_texel_mm;
    if (light.w > 0.0) {
        vec3 ray = place_mm - light.xyz;
        float deep = dot(ray, map_forward);
        texel_mm *= deep * sqrt(deep * inversesqrt(dot(ray, ray)));
    }
    return vec3(at, log2(width_mm / texel_mm) - 1.0);
}

// Whether there is light to look up: of a cube's six maps only one is asked for each cell.
bool map_holds(vec3 place_mm)
{
    if (light.w == 0.0)
        return true;
    vec3 ray = place_mm - light.xyz;
    return map_cube_face < 0 || map_face(ray) == map_cube_face;
}

// Flux per mm^2 of the plane for each unit in the map.
float map_flux_scale(map_plane plane, vec3 place_mm)
{
    if (light.w == 0.0)
        return 1.0;
    vec3 ray = place_mm - light.xyz;
    float d2 = dot(ray, ray);
    return plane.distance_mm / (d2 * sqrt(d2));
}

// A cell about offset_mm from the plane's point as this map shows it, whichever of a cube's is asked for it; false
// where no light enters.
bool map_cell_shown(map_plane plane, vec2 offset_mm, float width_mm, out map_cell cell)
{
    vec3 place_mm = plane.here_mm + offset_mm.x * plane.u + offset_mm.y * plane.v;
    if (light.w > 0.0 && dot(place_mm - light.xyz, map_forward) <= 0.0)
        return false;
    vec3 at = map_place(place_mm, width_mm);
    vec4 position = textureLod(tsm_position_mm, at.xy, at.z);
    vec3 normal_sum = textureLod(tsm_normal, at.xy, at.z).xyz;
    float length2 = dot(normal_sum, normal_sum);
    if (position.w < 1e-6 || length2 < 1e-14)
        return false;
    cell.position_mm = map_centre_mm + position.xyz / position.w;
    vec4 middle = textureLod(tsm_position_mm, at.xy, 0.0);
    cell.middle_mm = middle.w > 0.999 ? map_centre_mm + middle.xyz : cell.position_mm;
    cell.normal = normal_sum * inversesqrt(length2);
    cell.flux_per_mm2 = textureLod(tsm_flux, at.xy, at.z).rgb * map_flux_scale(plane, place_mm);
    return true;
}

// The same if this map is asked for it.
bool map_cell_at(map_plane plane, vec2 offset_mm, float width_mm, out map_cell cell)
{
    return map_holds(plane.here_mm + offset_mm.x * plane.u + offset_mm.y * plane.v) &&
           map_cell_shown(plane, offset_mm, width_mm, cell);
}

// The response to a cell is that at the distance of its middle, and depends on how high the point is over the
// surface where light enters. What the cell covers may lie to one side, and nearer: the height must not count as
// if it were as far away. So the normal is shortened by as much.
float map_distance_mm(vec2 offset_mm, float dz_mm)
{
    return sqrt(dot(offset_mm, offset_mm) + dz_mm * dz_mm);
}

vec3 map_normal(map_cell cell, vec3 delta_mm, float distance_mm)
{
    float nearer = length(delta_mm) / max(distance_mm, 1e-20);
    return cell.normal * min(nearer, 1.0);
}
