// The window of --view: a picture of any size stretched over it, with the sRGB curve.
uniform sampler2D display;
uniform vec2 window_px;
layout(location = 0) out vec4 color;

void main()
{
    ivec2 size = textureSize(display, 0);
    ivec2 pixel = min(ivec2(gl_FragCoord.xy / window_px * vec2(size)), size - 1);
    vec3 linear = texelFetch(display, pixel, 0).rgb;
    vec3 curved = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    color = vec4(mix(curved, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308))), 1.0);
}
