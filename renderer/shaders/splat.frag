// Pass splat: radiosity += flux R_d(distance) for each sample within reach of the band, on its own object
// (theory.md T14).
#include "common/profile.glsl"
uniform sampler2D position_mm;
uniform samplerBuffer light_samples;  // two texels each: position, mm; flux, W
flat in ivec2 samples_of_splat;
flat in vec4 ball_of_splat;
flat in vec4 profile_of_splat;  // reach squared, mm^2; then as in common/profile.glsl
flat in float object_of_splat;
layout(location = 0) out vec4 radiosity_w_per_mm2;  // a: how many samples

void main()
{
    vec4 here = texelFetch(position_mm, ivec2(gl_FragCoord.xy), 0);
    vec3 here_mm = here.xyz;
#ifdef HAS_OBJECT_MEDIA
    if (here.w != object_of_splat + 1.0)
        discard;
#endif
    vec3 from_ball_mm = here_mm - ball_of_splat.xyz;
    if (dot(from_ball_mm, from_ball_mm) > ball_of_splat.w)
        discard;
    vec4 sum = vec4(0.0);
    int first = 2 * samples_of_splat.x, end = first + 2 * samples_of_splat.y;
    for (int i = first; i < end; i += 2) {
        vec3 step_mm = here_mm - texelFetch(light_samples, i).xyz;
        float distance2 = dot(step_mm, step_mm);
        if (distance2 <= profile_of_splat.x)
            sum += vec4(texelFetch(light_samples, i + 1).rgb * profile_per_mm2(distance2, profile_of_splat.yzw), 1.0);
    }
    radiosity_w_per_mm2 = sum;
}
