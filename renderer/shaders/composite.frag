// Pass composite: radiance toward the eye, premultiplied by a = coverage: the mean over four points.
#include "common/exit.glsl"
#ifdef HAS_RADIOSITY
uniform sampler2D radiosity;
#endif
#ifdef HAS_SPECULAR
uniform sampler2D specular;
#endif
uniform int width_px, height_px;
layout(location = 0) out vec4 radiance;

#ifdef HAS_RADIOSITY
// The pixel's own radiosity where the point lies on its surface; else that of the neighbours, the nearer in
// space the more, if they show the same object: so nothing leaks across a silhouette.
vec3 radiosity_at(vec4 position_ws_mm, vec3 normal_ws, ivec2 pixel)
{
    if (is_own(position_ws_mm, normal_ws, pixel))
        return texelFetch(radiosity, pixel, 0).rgb;
    float blur_mm = 0.25 * footprint_mm(eye, pixel_mm, position_ws_mm.xyz);
    vec3 sum = vec3(0.0);
    float weight_sum = 0.0;
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            ivec2 at = clamp(pixel + ivec2(i, j), ivec2(0), ivec2(width_px - 1, height_px - 1));
            vec4 there_mm = texelFetch(position_mm, at, 0);
            vec3 step_mm = there_mm.xyz - position_ws_mm.xyz;
            float part = blur_mm * blur_mm / max(dot(step_mm, step_mm) + blur_mm * blur_mm, 1e-37);
            float weight = there_mm.w == position_ws_mm.w ? part * part : 0.0;
            sum += weight * texelFetch(radiosity, at, 0).rgb;
            weight_sum += weight;
        }
    }
    return weight_sum > 0.0 ? sum / weight_sum : vec3(0.0);
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        if (point_mm.w == 0.0)
            continue;
        sum.a += 1.0;
#ifdef HAS_RADIOSITY
        vec3 normal_ws = texelFetch(surface_normal, pixel, i).xyz;
        // profiles averaged over the samples' footprints overshoot a little (theory.md T34)
        vec3 leaving = max(radiosity_at(point_mm, normal_ws, pixel), vec3(0.0));
        sum.rgb += leaving * exit_per_sr(point_mm, normal_ws);
#endif
    }
    radiance = sum / 4.0;
#ifdef HAS_SPECULAR
    radiance.rgb += texelFetch(specular, pixel, 0).rgb;
#endif
}
