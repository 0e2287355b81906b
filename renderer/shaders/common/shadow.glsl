// What blockers leave of a light at a point of a surface: percentage closer soft shadows through a transmittance
// function in each texel of the light's view (theory.md T62 to T68). Needs uniform vec4 light and toward().
uniform sampler2D shadow_depth_mm;  // nearest opaque surface along the axis; 0: none
uniform mat4 shadow_view_projection;
uniform vec3 shadow_eye_mm, shadow_right, shadow_up, shadow_forward;
uniform int shadow_size_px;
uniform float shadow_half_width;    // of the view, mm; point light: at distance 1
uniform vec4 light_cone;            // spot: direction, and the cosine where light ends; else w = -2
uniform float light_cone_inner;     // cosine where it begins to fall
#ifdef HAS_AVSM_RANGES
uniform sampler2D avsm_ranges;      // first and last depth, place of the first node, how many; 0: nothing blocks
uniform samplerBuffer avsm_nodes;   // depth and what is left; behind the last: mean depth of what stays
#endif
#ifdef HAS_SHADOW_TAPS
uniform samplerBuffer shadow_taps;  // in the disc of radius 1
uniform int shadow_tap_count;
uniform float shadow_light_size;    // diameter, mm; parallel light: of its disc at distance 1
uniform float shadow_nearest_blocker_mm;
uniform sampler2D shadow_nearest;
#define TURN_OF_SURFACE 1           // shadow_turn_kind, as enum render_shadow_turn
#define TURN_NONE 2
uniform int shadow_turn_kind;
uniform float shadow_pixel_mm;      // width of a pixel; perspective: w of the distance to
uniform vec4 shadow_pixel_eye_mm;
#endif
// Channels are told apart only where blockers do.
#ifdef HAS_AVSM_COLOUR
#define shade vec3
#else
#define shade float
#endif

// A surface that light falls on, as the light's view sees it: points of the view are eye + z (x right + y up + forward),
// of parallel light eye + x right + y up + z forward.
struct shadow_plane {
    vec2 place;        // x, y
    float depth_mm;    // z
    float texel;       // width of a texel, in units of x and y
    vec3 slope;        // depth of the plane there: parallel: z + slope.xy (xy - place); point: 1/z = slope . (x, y, 1)
    float margin_mm;   // what is nearer to the surface is the surface itself
    vec3 way, right;   // from the light to the surface, and across that, in the view; of a point both of length 1
    float away_mm;     // how far, along the way
};

shadow_plane shadow_plane_at(vec3 position_ws_mm, vec3 normal_ws)
{
    vec3 d = position_ws_mm - shadow_eye_mm;
    vec3 in_view = vec3(dot(d, shadow_right), dot(d, shadow_up), dot(d, shadow_forward));
    vec3 n = vec3(dot(normal_ws, shadow_right), dot(normal_ws, shadow_up), dot(normal_ws, shadow_forward));
    shadow_plane plane;
    plane.depth_mm = max(in_view.z, 1e-20);
    plane.texel = 2.0 * shadow_half_width / float(shadow_size_px);
    float texel_mm = plane.texel, cosine;
    if (light.w == 0.0) {
        plane.place = in_view.xy;
        n.z = min(n.z, -0.05);
        plane.slope = vec3(-n.xy / n.z, 0.0);
        plane.way = vec3(0.0, 0.0, 1.0);
        plane.away_mm = plane.depth_mm;
        cosine = -n.z;
    } else {
        plane.place = in_view.xy / plane.depth_mm;
        float height = min(dot(n, in_view), -0.05 * length(in_view));
        plane.slope = n / height;
        texel_mm *= plane.depth_mm;
        plane.away_mm = length(in_view);
        plane.way = in_view / plane.away_mm;
        cosine = -height / plane.away_mm;
    }
    plane.right = normalize(vec3(plane.way.z, 0.0, -plane.way.x));
    plane.margin_mm = texel_mm * (1.5 + 1.5 * sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine);
    return plane;
}

// How near to the light something must be at a place of the view to block: nearer than the surface, and above it.
float shadow_cut_mm(shadow_plane plane, vec2 place)
{
    float depth_mm;
    if (light.w == 0.0) {
        depth_mm = plane.depth_mm + dot(plane.slope.xy, place - plane.place);
    } else {
        float inverse = dot(plane.slope, vec3(place, 1.0));
        depth_mm = inverse * plane.depth_mm > 1.0 ? 1.0 / inverse : plane.depth_mm;
    }
    return min(depth_mm, plane.depth_mm) - plane.margin_mm;
}

ivec2 shadow_texel(vec2 place)
{
    return ivec2(floor((0.5 * place / shadow_half_width + 0.5) * float(shadow_size_px)));
}

bool shadow_holds(ivec2 texel)
{
    return all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, ivec2(shadow_size_px)));
}

float shadow_opaque_mm(ivec2 texel)
{
    float depth_mm = texelFetch(shadow_depth_mm, texel, 0).r;
    return depth_mm > 0.0 ? depth_mm : 1e30;
}

#ifdef HAS_AVSM_RANGES
float node_depth_mm(vec4 node)
{
    return node.x;
}

shade node_left(vec4 node)
{
#ifdef HAS_AVSM_COLOUR
    return node.yzw;
#else
    return node.y;
#endif
}

// ln(1 - x) without losing digits where x is small.
float log_of_rest(float x)
{
    return x < 0.03 ? -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + 0.25 * x))) : log(max(1.0 - x, 1e-30));
}

// Part of the way where half has stayed: theory.md T60.
float half_part(float alpha)
{
    return alpha < 1e-4 ? 0.5 : alpha < 1.0 ? log_of_rest(0.5 * alpha) / log_of_rest(alpha) : 0.0;
}

// What is left after a part of the way from a to b, of one channel: T62.
float left_between(float a, float b, float part)
{
    return b > 0.0 ? a * exp2(part * log2(b / a)) : part > 0.0 ? 0.0 : a;
}

#ifdef HAS_AVSM_COLOUR
vec3 left_between(vec3 a, vec3 b, float part)
{
    return vec3(left_between(a.x, b.x, part), left_between(a.y, b.y, part), left_between(a.z, b.z, part));
}

vec3 half_part(vec3 alpha)
{
    return vec3(half_part(alpha.x), half_part(alpha.y), half_part(alpha.z));
}
#endif

// Behind a depth.
shade avsm_left(vec4 range, float cut_mm)
{
    int first = int(range.z), count = int(range.w);
    if (count == 0 || cut_mm < range.x)
        return shade(1.0);
    if (cut_mm >= range.y)
        return node_left(texelFetch(avsm_nodes, first + count - 1));
    vec4 a = texelFetch(avsm_nodes, first), b = a;
    for (int i = 1; i < count; i++) {
        b = texelFetch(avsm_nodes, first + i);
        if (node_depth_mm(b) > cut_mm)
            break;
        a = b;
    }
    float part = (cut_mm - node_depth_mm(a)) / max(node_depth_mm(b) - node_depth_mm(a), 1e-30);
    return left_between(node_left(a), node_left(b), clamp(part, 0.0, 1.0));
}

// Add what stays before a depth, and that times where: T64.
void avsm_add_blocked(vec4 range, float cut_mm, inout shade blocked, inout shade moment)
{
    int first = int(range.z), count = int(range.w);
    if (count == 0 || cut_mm <= range.x)
        return;
    if (cut_mm >= range.y) {
        shade stays = 1.0 - node_left(texelFetch(avsm_nodes, first + count - 1));
        blocked += stays;
        moment += stays * node_left(texelFetch(avsm_nodes, first + count));
        return;
    }
    vec4 a = texelFetch(avsm_nodes, first);
    for (int i = 1; i < count && node_depth_mm(a) < cut_mm; i++) {
        vec4 b = texelFetch(avsm_nodes, first + i);
        float end_mm = min(node_depth_mm(b), cut_mm), way_mm = end_mm - node_depth_mm(a);
        shade left = node_left(b);
        if (end_mm < node_depth_mm(b))
            left = left_between(node_left(a), left, way_mm / (node_depth_mm(b) - node_depth_mm(a)));
        shade stays = node_left(a) - left;
        blocked += stays;
        moment += stays * (node_depth_mm(a) + way_mm * half_part(stays / max(node_left(a), shade(1e-30))));
        a = b;
    }
}
#endif

// What all blockers leave at a texel, of those that are in the way.
shade shadow_left_at(ivec2 texel, float cut_mm)
{
    if (!shadow_holds(texel))
        return shade(1.0);
    if (shadow_opaque_mm(texel) < cut_mm)
        return shade(0.0);
#ifdef HAS_AVSM_RANGES
    return avsm_left(texelFetch(avsm_ranges, texel, 0), cut_mm);
#else
    return shade(1.0);
#endif
}

// Over 4 x 4 texels: the edge of a hard shadow is three texels wide.
shade shadow_hard(shadow_plane plane)
{
    vec2 at = (0.5 * plane.place / shadow_half_width + 0.5) * float(shadow_size_px) - 0.5;
    at = clamp(at, vec2(-4.0), vec2(float(shadow_size_px) + 4.0));
    vec2 part = fract(at);
    ivec2 corner = ivec2(floor(at)) - 1;
    vec4 weights_x = vec4(1.0 - part.x, 1.0, 1.0, part.x), weights_y = vec4(1.0 - part.y, 1.0, 1.0, part.y);
    shade sum = shade(0.0);
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 4; i++) {
            ivec2 texel = corner + ivec2(i, j);
            vec2 place = ((vec2(texel) + 0.5) / float(shadow_size_px) * 2.0 - 1.0) * shadow_half_width;
            sum += weights_x[i] * weights_y[j] * shadow_left_at(texel, shadow_cut_mm(plane, place));
        }
    }
    return sum / 9.0;
}

#ifdef HAS_SHADOW_TAPS
// Width of the light seen over an edge, both planes across the way: of a point in units of the distance. T61.
float shadow_width(float receiver_mm, float blocker_mm)
{
    float width = light.w == 0.0 ? receiver_mm - blocker_mm : 1.0 / blocker_mm - 1.0 / receiver_mm;
    return max(width, 0.0) * shadow_light_size;
}

#ifdef HAS_AVSM_COLOUR
vec3 shadow_width(float receiver_mm, vec3 blocker_mm)
{
    return vec3(shadow_width(receiver_mm, blocker_mm.x), shadow_width(receiver_mm, blocker_mm.y),
                shadow_width(receiver_mm, blocker_mm.z));
}
#endif

// Where the way to a place of the light meets the view: offset is on the plane across the way at distance 1.
vec2 shadow_place(shadow_plane plane, vec2 offset)
{
    if (light.w == 0.0)
        return plane.place + offset;
    vec3 v = plane.way + offset.x * plane.right + offset.y * cross(plane.way, plane.right);
    return v.xy / max(v.z, 1e-3);
}

// How deep something is along the way, for each mm along the view's axis.
float shadow_steepness(shadow_plane plane, vec2 place)
{
    return light.w == 0.0 ? 1.0 : max(dot(vec3(place, 1.0), plane.way), 0.1);
}

// How far places of offsets within a radius are from the plane's.
float shadow_reach(shadow_plane plane, float radius)
{
    if (light.w == 0.0)
        return radius;
    return radius * (1.0 + dot(plane.place, plane.place)) / max(1.0 - radius * length(plane.place), 0.1);
}

// How far away the nearest is that may block within a reach, by blocks of texels; 0: nothing can.
float shadow_nearest_mm(shadow_plane plane, float reach)
{
    float cut_mm = plane.away_mm - plane.margin_mm, nearest_mm = cut_mm;
    ivec2 limit = textureSize(shadow_nearest, 0) - 1;
    ivec2 low = clamp(shadow_texel(plane.place - reach) >> 4, ivec2(0), limit);
    ivec2 high = clamp(shadow_texel(plane.place + reach) >> 4, ivec2(0), limit);
    for (int y = low.y; y <= high.y; y++) {
        for (int x = low.x; x <= high.x; x++) {
            float block_mm = texelFetch(shadow_nearest, ivec2(x, y), 0).r;
            nearest_mm = block_mm > 0.0 ? min(nearest_mm, block_mm) : nearest_mm;
        }
    }
    return nearest_mm < cut_mm ? nearest_mm : 0.0;
}

vec2 shadow_tap(int i, vec2 turn)
{
    vec2 tap = texelFetch(shadow_taps, i).xy;
    return vec2(turn.x * tap.x - turn.y * tap.y, turn.y * tap.x + turn.x * tap.y);
}

// Mean depth of what stays, over a disc; false: nothing does.
bool shadow_search(shadow_plane plane, float radius, vec2 turn, out shade mean_mm)
{
    shade blocked = shade(0.0), moment = shade(0.0);
    for (int i = 0; i < shadow_tap_count; i++) {
        vec2 place = shadow_place(plane, radius * shadow_tap(i, turn));
        ivec2 texel = shadow_texel(place);
        if (!shadow_holds(texel))
            continue;
        float cut_mm = shadow_cut_mm(plane, place), opaque_mm = shadow_opaque_mm(texel);
        shade left = shade(1.0), here_moment = shade(0.0);
#ifdef HAS_AVSM_RANGES
        vec4 range = texelFetch(avsm_ranges, texel, 0);
        float end_mm = min(cut_mm, opaque_mm);
        avsm_add_blocked(range, end_mm, blocked, here_moment);
        if (opaque_mm < cut_mm)
            left = avsm_left(range, end_mm);
#endif
        if (opaque_mm < cut_mm) {
            blocked += left;
            here_moment += left * opaque_mm;
        }
        moment += here_moment * shadow_steepness(plane, place);
    }
    mean_mm = moment / max(blocked, shade(1e-20));
    return blocked != shade(0.0);
}

shade shadow_filter(shadow_plane plane, shade radius, vec2 turn)
{
    shade sum = shade(0.0);
    for (int i = 0; i < shadow_tap_count; i++) {
        vec2 tap = shadow_tap(i, turn);
#ifdef HAS_AVSM_COLOUR
        for (int c = 0; c < 3; c++) {
            vec2 place = shadow_place(plane, radius[c] * tap);
            sum[c] += shadow_left_at(shadow_texel(place), shadow_cut_mm(plane, place))[c];
        }
#else
        vec2 place = shadow_place(plane, radius * tap);
        sum += shadow_left_at(shadow_texel(place), shadow_cut_mm(plane, place));
#endif
    }
    return sum / float(shadow_tap_count);
}

// The taps' turn, 0 to 1: interleaved gradient noise of the pixel (Jimenez 2014), the same in every frame. For
// comparison one of cells of space, 1 to 2 pixels wide; 0.37 keeps planes at whole numbers of mm off their sides.
float shadow_turn_part(vec2 pixel, vec3 position_ws_mm)
{
    if (shadow_turn_kind == TURN_NONE)
        return 0.0;
    float phase = dot(pixel, vec2(0.06711056, 0.00583715));
    if (shadow_turn_kind == TURN_OF_SURFACE) {
        float pixel_mm = shadow_pixel_mm + shadow_pixel_eye_mm.w * distance(shadow_pixel_eye_mm.xyz, position_ws_mm);
        vec3 cell = mod(floor(position_ws_mm / exp2(ceil(log2(pixel_mm))) + 0.37), 1024.0);
        phase = dot(cell, vec3(0.06711056, 0.0198, 0.00583715));
    }
    return fract(52.9829189 * fract(phase));
}

// What blocks is as near as the nearest of all, at first; then no nearer than the nearest that is as near to the way.
shade shadow_soft(shadow_plane plane, float turn_part)
{
    float least = 1.5 * plane.texel * plane.way.z, radius = 0.0, nearest_mm = shadow_nearest_blocker_mm;
    for (int i = 0; i < 3; i++) {
        if (nearest_mm <= 0.0 || nearest_mm >= plane.away_mm)
            return shade(1.0);
        float width = shadow_width(plane.away_mm, nearest_mm);
        radius = clamp(0.5 * width, least, 2.0 * shadow_half_width);
        nearest_mm = shadow_nearest_mm(plane, min(shadow_reach(plane, radius), 2.0 * shadow_half_width) + plane.texel);
    }
    float angle = 6.28318530718 * turn_part;
    vec2 turn = vec2(cos(angle), sin(angle));
    shade mean_mm;
    if (nearest_mm <= 0.0 || !shadow_search(plane, radius, turn, mean_mm))
        return shade(1.0);
    shade width = 0.5 * shadow_width(plane.away_mm, mean_mm);
    // what stays nowhere in one channel has no depth
    return shadow_filter(plane, clamp(width, shade(least), shade(radius)), turn);
}
#endif

float light_cone_part(vec3 to_light)
{
    float cosine = -dot(to_light, light_cone.xyz);
    return light_cone_inner > light_cone.w ? smoothstep(light_cone.w, light_cone_inner, cosine)
                                           : step(light_cone.w, cosine);
}

// Per channel, 0 to 1; pixel: tells the turn of the taps.
vec3 shadow_left(vec3 position_ws_mm, vec3 normal_ws, vec2 pixel)
{
    vec3 to_light = toward(light, position_ws_mm);
    float part = light_cone.w > -1.5 ? light_cone_part(to_light) : 1.0;
    if (part == 0.0 || dot(to_light, normal_ws) <= 0.0)
        return vec3(0.0);
    shadow_plane plane = shadow_plane_at(position_ws_mm, normal_ws);
#ifdef HAS_SHADOW_TAPS
    if (shadow_light_size > 0.0)
        return part * vec3(shadow_soft(plane, shadow_turn_part(pixel, position_ws_mm)));
#endif
    return part * vec3(shadow_hard(plane));
}
