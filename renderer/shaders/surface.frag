// Pass surface: position (w: number of the object, from 1) and normal (w = roughness, 0 without gloss).
noperspective sample in vec3 position_over_depth;
noperspective sample in vec3 normal_over_depth;
noperspective sample in float one_over_depth;
uniform float roughness;
uniform float object;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    position_out_mm = vec4(position_over_depth / one_over_depth, object);
    normal_out = vec4(normalize(normal_over_depth), roughness);
}
