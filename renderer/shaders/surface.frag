// Pass surface: position (w: number of the object, from 1) and normal (w = roughness, 0 without gloss).
centroid in vec3 position_ws_mm;
centroid in vec3 normal_ws;
uniform float roughness;
uniform float object;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    position_out_mm = vec4(position_ws_mm, object);
    normal_out = vec4(normalize(normal_ws), roughness);
}
