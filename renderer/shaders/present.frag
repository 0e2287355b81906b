// The window of --view: pictures of any size stretched over their area, with the sRGB curve. Left of the divider
// one, right of it the other; or the difference of both, right less left, of the channel that differs most.
uniform sampler2D left_picture, right_picture; // tone mapped; radiance for the difference
uniform sampler2D colours;                     // sRGB, from -range to range
uniform bool is_difference;
uniform float range;   // radiance
uniform float divider; // 0 to 1 of the area's width
uniform vec3 area_px;  // its left edge, width and height
layout(location = 0) out vec4 color;

vec4 look_up(sampler2D picture, vec2 place)
{
    ivec2 size = textureSize(picture, 0);
    return texelFetch(picture, min(ivec2(place * vec2(size)), size - 1), 0);
}

vec3 curve(vec3 linear)
{
    vec3 curved = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    return mix(curved, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

vec3 colour_difference(vec2 place)
{
    const vec3 empty = vec3(0.08, 0.09, 0.1);
    vec4 left = look_up(left_picture, place), right = look_up(right_picture, place);
    vec3 difference = right.rgb - left.rgb, size = abs(difference);
    float signed_size = size.r >= size.g && size.r >= size.b ? difference.r
                        : size.g >= size.b                   ? difference.g
                                                             : difference.b;
    float last = float(textureSize(colours, 0).x - 1);
    float at = 0.5 * (clamp(signed_size / range, -1.0, 1.0) + 1.0) * last;
    vec3 colour = texelFetch(colours, ivec2(int(at + 0.5), 0), 0).rgb;
    return mix(empty, colour, max(left.a, right.a));
}

void main()
{
    vec2 place = (gl_FragCoord.xy - vec2(area_px.x, 0.0)) / area_px.yz;
    if (is_difference)
        color = vec4(colour_difference(place), 1.0);
    else if (place.x < divider)
        color = vec4(curve(look_up(left_picture, place).rgb), 1.0);
    else
        color = vec4(curve(look_up(right_picture, place).rgb), 1.0);
}
