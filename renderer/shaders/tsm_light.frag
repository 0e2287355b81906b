// Pass tsm_light: what the light sees of one object, all of it times coverage: so means over texels are those of
// what is covered once they are divided by its mean. Other objects are in the way, and cover nothing.
//   position: from the object's middle, mm;  flux: W/mm^2 of the plane across the light, W/sr of a point light,
//   that enters (theory.md T13)
#include "common/direction.glsl"
#include "common/fresnel.glsl"
in vec3 position_ws_mm;
in vec3 normal_ws;
uniform vec4 light;      // w = 1: position, mm; w = 0: direction toward the light
uniform vec3 light_rgb;
uniform vec3 map_centre_mm;
uniform float map_object, object, object_eta;
layout(location = 0) out vec4 position_and_coverage;
layout(location = 1) out vec4 normal_out;
layout(location = 2) out vec4 flux;

void main()
{
    float coverage = object == map_object ? 1.0 : 0.0;
    vec3 normal_unit = normalize(normal_ws);
    float cosine = clamp(dot(normal_unit, toward(light, position_ws_mm)), 0.0, 1.0);
    float entering = gl_FrontFacing ? 1.0 - fresnel_reflectance(object_eta, cosine) : 0.0;
    position_and_coverage = vec4(position_ws_mm - map_centre_mm, 1.0) * coverage;
    normal_out = vec4(normal_unit * coverage, 0.0);
    flux = vec4(light_rgb * entering * coverage, 0.0);
}
