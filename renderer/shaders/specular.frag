// Pass specular: radiance += light mirrored at the rough surface (theory.md T19), of one light's view,
// averaged over the pixel's four points.
#include "common/light.glsl"
#include "common/fresnel.glsl"
#include "common/medium.glsl"
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform vec4 eye;   // w = 1: position, mm; w = 0: direction toward the eye
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

vec3 specular_at(vec4 position_ws_mm, vec4 normal_and_roughness)
{
    vec3 normal_ws = normal_and_roughness.xyz;
    vec3 to_light = toward(light, position_ws_mm.xyz), to_eye = toward(eye, position_ws_mm.xyz);
    float cosine_in = dot(normal_ws, to_light), cosine_out = dot(normal_ws, to_eye);
    if (normal_and_roughness.w <= 0.0 || cosine_in <= 0.0 || cosine_out <= 0.0)
        return vec3(0.0);
    vec3 middle = unit_or(to_light + to_eye, normal_ws);
    float reflectance = fresnel_reflectance(medium_eta(position_ws_mm.w), clamp(dot(to_light, middle), 0.0, 1.0));
    float lobe = ggx(normal_and_roughness.w, dot(normal_ws, middle), cosine_in, cosine_out);
    return light_irradiance(position_ws_mm.xyz) * reflectance * lobe *
           light_visibility(position_ws_mm.xyz, normal_ws);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 first_mm = texelFetch(surface_position_mm, pixel, 0);
    vec3 first = first_mm.w > 0.0 ? specular_at(first_mm, texelFetch(surface_normal, pixel, 0)) : vec3(0.0);
    vec3 sum = first;
    for (int i = 1; i < 4; i++) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        if (point_mm == first_mm)
            sum += first;
        else if (point_mm.w > 0.0)
            sum += specular_at(point_mm, texelFetch(surface_normal, pixel, i));
    }
    radiance = vec4(sum / 4.0, 0.0);
}
