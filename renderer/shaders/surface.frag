// Pass surface: position (w = 1: here is an object) and normal (w = roughness, 0 without gloss).
centroid in vec3 position_ws_mm;
centroid in vec3 normal_ws;
uniform float roughness;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    position_out_mm = vec4(position_ws_mm, 1.0);
    normal_out = vec4(normalize(normal_ws), roughness);
}
