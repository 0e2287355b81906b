// Pass tsm_texels: radiosity += the response to every texel of a map (theory.md T30): what the pattern's few
// samples stand for.
#include "common/tsm_map.glsl"
#include "common/tsm_sources.glsl"
uniform sampler2D position_mm;
uniform float map_texel_area;  // mm^2; point light: at distance 1
uniform int first_texel, texel_count;  // of the map, in this draw call
uniform int is_profile;        // 1: the profile of a flat surface at the distance, whatever the normal
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    vec4 here_mm = texelFetch(position_mm, ivec2(gl_FragCoord.xy), 0);
    if (here_mm.w != map_object)
        discard;
    vec3 sum = vec3(0.0);
    int side = int(map_size_px);
    for (int i = first_texel; i < first_texel + texel_count; i++) {
        ivec2 texel = ivec2(i % side, i / side);
        vec3 flux = texelFetch(tsm_flux, texel, 0).rgb;
        if (flux == vec3(0.0))
            continue;
        vec3 entry_mm = map_centre_mm + texelFetch(tsm_position_mm, texel, 0).xyz;
        vec3 delta_mm = here_mm.xyz - entry_mm;
        float distance_mm = length(delta_mm), area = map_texel_area;
        if (light.w > 0.0) {
            vec3 ray = normalize(entry_mm - light.xyz);
            float cosine = dot(ray, map_forward);
            area *= map_cube_face >= 0 && map_face(ray) != map_cube_face ? 0.0 : cosine * cosine * cosine;
        }
        float cosine = dot(texelFetch(tsm_normal, texel, 0).xyz, delta_mm) / max(distance_mm, 1e-20);
        sum += tsm_form_per_mm2(distance_mm, is_profile == 1 ? 0.0 : clamp(cosine, -1.0, 1.0)) * flux * area;
    }
    radiosity_w_per_mm2 = vec4(sum, 0.0);
}
