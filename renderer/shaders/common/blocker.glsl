// What passes shadow_map and avsm_list draw: objects and blockers to the clip space of the light. Particles are discs that
// face the light.
#include "common/direction.glsl"
layout(location = 0) in vec3 position_in_mm;  // of a particle its middle
uniform mat4 view_projection;
uniform vec4 light;         // w = 1: position, mm; w = 0: direction toward the light
uniform float particle_mm;  // radius; 0: no particles
out vec3 position_ws_mm;
out vec2 corner;            // of the square about the disc

void main()
{
    position_ws_mm = position_in_mm;
    corner = vec2(0.0);
    if (particle_mm > 0.0) {
        vec3 to_light = toward(light, position_in_mm);
        vec3 aside = abs(to_light.y) < 0.7 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
        vec3 right = normalize(cross(aside, to_light)), up = cross(to_light, right);
        corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
        position_ws_mm += particle_mm * (corner.x * right + corner.y * up);
    }
    gl_Position = view_projection * vec4(position_ws_mm, 1.0);
}
