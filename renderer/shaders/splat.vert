// Pass splat: a rectangle that holds everything the splat's samples reach, at the depth of the nearest:
// pixels that are nearer, or empty, fail the depth test.
layout(location = 0) in vec4 rectangle;  // left, bottom, right, top in -1..1
layout(location = 1) in float depth;     // 0..1
layout(location = 2) in uvec2 range;     // first sample, how many
layout(location = 3) in float object;    // whose light it is, from 0
layout(location = 4) in vec4 ball;       // middle of the samples, mm; reach from there, squared
layout(location = 5) in vec4 profile;    // reach squared, first node, inverse scale squared, nodes per log2
flat out ivec2 samples_of_splat;
flat out vec4 ball_of_splat;
flat out vec4 profile_of_splat;
flat out float object_of_splat;
uniform vec2 pixel;  // size, of what is 2 wide

void main()
{
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    // light is looked for anywhere in a pixel, not in its middle alone
    gl_Position = vec4(mix(rectangle.xy - pixel, rectangle.zw + pixel, corner), 2.0 * depth - 1.0, 1.0);
    samples_of_splat = ivec2(range);
    ball_of_splat = ball;
    profile_of_splat = profile;
    object_of_splat = object;
}
