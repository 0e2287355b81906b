// Pass light_view: position, and the share of the light's power that enters through the texel
// (theory.md T13): transmittance times area, or times solid angle for a point light. No cosine:
// irradiance falls with it as the surface grows with it.
#include "common/direction.glsl"
#include "common/fresnel.glsl"
in vec3 position_ws_mm;
in vec3 normal_ws;
uniform vec4 light;         // w = 1: position, mm; w = 0: direction toward the light
uniform vec3 forward_ws;
uniform float texel_area;   // mm^2; point: at distance 1
uniform float object_eta;
layout(location = 0) out vec4 position_and_share;
#ifdef HAS_LIGHT_OBJECT
uniform float object;  // number, from 1
layout(location = 1) out float light_object;
#endif
#ifdef HAS_LIGHT_IRRADIANCE
#ifdef HAS_LIGHT_OBJECT
layout(location = 2) out float light_irradiance;  // that enters, per rgb of the light
#else
layout(location = 1) out float light_irradiance;
#endif
#endif
#ifdef HAS_LIGHT_REST
#if defined(HAS_LIGHT_OBJECT) && defined(HAS_LIGHT_IRRADIANCE)
#define REST_LOCATION 3
#elif defined(HAS_LIGHT_OBJECT) || defined(HAS_LIGHT_IRRADIANCE)
#define REST_LOCATION 2
#else
#define REST_LOCATION 1
#endif
in vec3 rest_mm;
layout(location = REST_LOCATION) out vec4 light_rest;  // where the surface is when the object is at rest
#endif
#ifdef HAS_LIGHT_FRONT
uniform sampler2D light_front;  // what the view before has shown
uniform int light_layer;        // 0: nothing is in front

// Whether the surface is behind that, and can be lit: theory.md T71.
bool is_of_layer()
{
    vec3 front_mm = texelFetch(light_front, ivec2(gl_FragCoord.xy), 0).xyz;
    float scale_mm = light.w > 0.0 ? distance(light.xyz, position_ws_mm) : length(position_ws_mm);
    return gl_FrontFacing && dot(position_ws_mm - front_mm, forward_ws) > 1e-5 * scale_mm;
}
#endif

void main()
{
#ifdef HAS_LIGHT_FRONT
    if (light_layer > 0 && !is_of_layer())
        discard;
#endif
    vec3 to_light = toward(light, position_ws_mm);
    float cosine = clamp(dot(unit_or(normal_ws, to_light), to_light), 0.0, 1.0);
    float axis_cosine = light.w > 0.0 ? -dot(to_light, forward_ws) : 1.0;
    float size = texel_area * axis_cosine * axis_cosine * axis_cosine;
    float share = gl_FrontFacing ? size * (1.0 - fresnel_reflectance(object_eta, cosine)) : 0.0;
    position_and_share = vec4(position_ws_mm, share);
#ifdef HAS_LIGHT_IRRADIANCE
    vec3 step_mm = light.xyz - position_ws_mm;
    float falloff = light.w > 0.0 ? 1.0 / max(dot(step_mm, step_mm), 1e-24) : 1.0;
    light_irradiance =
        gl_FrontFacing ? falloff * cosine * (1.0 - fresnel_reflectance(object_eta, cosine)) : 0.0;
#endif
#ifdef HAS_LIGHT_OBJECT
    light_object = object;
#endif
#ifdef HAS_LIGHT_REST
    light_rest = vec4(rest_mm, 1.0);
#endif
}
