// Pass specular: radiance += light mirrored at the rough surface (theory.md T19), of one light's view,
// averaged over the pixel's four points: those that show its surface are shaded once where they are nearly level
// (theory.md T58).
#include "common/light.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"
#include "common/points.glsl"
uniform sampler2D position_mm;
uniform sampler2D normal;
uniform sampler2D surface_exit;
#ifdef HAS_SHADOW
uniform sampler2D shadow;  // what blockers leave of the light, of the pixel's own surface
#endif
layout(location = 0) out vec4 radiance;

// f cosine of GGX with the height-correlated Smith term; alpha: roughness.
float ggx(float alpha, float cosine_normal_half, float cosine_in, float cosine_out)
{
    float a2 = alpha * alpha;
    float d = 1.0 + cosine_normal_half * cosine_normal_half * (a2 - 1.0);
    float distribution = a2 / (3.14159265358979 * d * d);
    float smith_in = cosine_out * sqrt(a2 + (1.0 - a2) * cosine_in * cosine_in);
    float smith_out = cosine_in * sqrt(a2 + (1.0 - a2) * cosine_out * cosine_out);
    return distribution * 0.5 * cosine_in / max(smith_in + smith_out, 1e-30);
}

// Toward the eye for an irradiance of 1 on a facing surface, in full light.
float mirrored(surface_point point, float roughness)
{
    vec4 position_ws_mm = point.position_mm;
    vec3 normal_ws = point.normal;
    vec3 to_light = toward(light, position_ws_mm.xyz), to_eye = toward(eye, position_ws_mm.xyz);
    float cosine_in = dot(normal_ws, to_light), cosine_out = dot(normal_ws, to_eye);
    if (roughness <= 0.0 || cosine_in <= 0.0 || cosine_out <= 0.0)
        return 0.0;
    vec3 middle = unit_or(to_light + to_eye, normal_ws);
    float reflectance = fresnel_reflectance(medium_eta(position_ws_mm.w), clamp(dot(to_light, middle), 0.0, 1.0));
    return reflectance * ggx(roughness, dot(normal_ws, middle), cosine_in, cosine_out);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here_normal = texelFetch(normal, pixel, 0), exit = texelFetch(surface_exit, pixel, 0);
    surface_point point = surface_point(texelFetch(position_mm, pixel, 0), here_normal.xyz);
    uint rest = uint(exit.w);
    // The pixel's surface counts for all the points that show it, unless gloss differs among them.
    float weight = rest < 16u ? exit.z : 0.0, roughness = here_normal.w;
    rest = rest < 16u ? rest : 15u;
    vec3 sum = vec3(0.0);
    while (true) {
#ifdef HAS_SHADOW
        vec3 visible = texelFetch(shadow, pixel, 0).rgb;
#else
        float visible = light_visibility(point.position_mm.xyz, point.normal);
#endif
        sum += weight * mirrored(point, roughness) * light_irradiance(point.position_mm.xyz) * visible;
        if (rest == 0u)
            break;
        point = point_of_pixel(pixel, findLSB(rest));
        roughness = texelFetch(mesh_roughness, max(int(point.position_mm.w) - 1, 0)).r;
        weight = 0.25;
        rest &= rest - 1u;
    }
    radiance = vec4(sum, 0.0);
}
