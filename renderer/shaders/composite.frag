// Pass composite: radiance toward the eye, premultiplied by a = coverage: the mean over four points.
#include "common/exit.glsl"
#include "common/points.glsl"
#include "common/same_surface.glsl"
uniform sampler2D position_mm;
uniform sampler2D surface_exit;
#ifdef HAS_RADIOSITY
uniform sampler2D radiosity;
#endif
#ifdef HAS_SPECULAR
uniform sampler2D specular;
#endif
uniform float pixel_mm;  // size of a pixel; perspective: at distance 1
uniform int width_px, height_px;
layout(location = 0) out vec4 radiance;

#ifdef HAS_RADIOSITY
// Profiles averaged over the samples' footprints overshoot a little (theory.md T34).
vec3 leaving(vec3 radiosity_w_per_mm2)
{
    return max(radiosity_w_per_mm2, vec3(0.0));
}

// At a point that does not lie on its pixel's surface: the neighbours' radiosity, the nearer in space the more, if they
// show the same object: so nothing leaks across a silhouette.
vec3 radiosity_nearby(vec4 position_ws_mm, ivec2 pixel)
{
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

vec3 radiance_of_others(uint others, ivec2 pixel)
{
    vec3 sum = vec3(0.0);
    for (; others != 0u; others &= others - 1u) {
        surface_point point = point_of_pixel(pixel, findLSB(others));
        sum += leaving(radiosity_nearby(point.position_mm, pixel)) * exit_per_sr(eye, point.position_mm, point.normal);
    }
    return 0.25 * sum;
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 exit = texelFetch(surface_exit, pixel, 0);
    radiance = vec4(0.0, 0.0, 0.0, exit.y);
#ifdef HAS_RADIOSITY
    radiance.rgb = leaving(texelFetch(radiosity, pixel, 0).rgb) * exit.x + radiance_of_others(uint(exit.w) & 15u, pixel);
#endif
#ifdef HAS_SPECULAR
    radiance.rgb += texelFetch(specular, pixel, 0).rgb;
#endif
}
