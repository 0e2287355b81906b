// Pass tone_map (theory.md T20): the largest channel m is kept up to 0.6 and bent toward 1 above,
// f(m) = 1 - 0.4 exp(-(m - 0.6) / 0.4); the others are scaled with it, which keeps the hue, and what was
// bent most fades to white. Linear, 0..1; the file format or the window adds the sRGB curve.
uniform sampler2D radiance;
uniform vec3 background;
uniform float exposure;
layout(location = 0) out vec4 display;

void main()
{
    const float knee = 0.6;
    vec4 over = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    vec3 c = clamp(exposure * (over.rgb + (1.0 - over.a) * background), vec3(0.0), vec3(1e30));
    float largest = max(max(c.r, c.g), c.b);
    if (largest > knee) {
        float bent = 1.0 - (1.0 - knee) * exp(-(largest - knee) / (1.0 - knee));
        float fade = 1.0 - 1.0 / (1.0 + 0.15 * (largest - bent));
        c = mix(c * (bent / largest), vec3(bent), fade);
    }
    display = vec4(c, 1.0);
}
