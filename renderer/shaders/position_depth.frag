// Pass position_depth: how far the farthest is of a pixel's four points, linear between near (0) and far (1); 0 where
// none shows an object.
uniform usampler2DMS surface_triangle;
uniform sampler2DMS surface_depth;
uniform float near_mm, far_mm;
uniform vec4 eye;  // w = 1: perspective

float linear_depth(float depth)
{
    return eye.w > 0.0 ? depth * near_mm / (far_mm - depth * (far_mm - near_mm)) : depth;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float farthest = 0.0;
    for (int i = 0; i < 4; i++) {
        float depth = texelFetch(surface_triangle, pixel, i).r > 0u ? texelFetch(surface_depth, pixel, i).r : -1.0;
        farthest = max(farthest, depth < 0.0 ? 0.0 : clamp(linear_depth(depth), 1e-6, 1.0));
    }
    gl_FragDepth = farthest;
}
