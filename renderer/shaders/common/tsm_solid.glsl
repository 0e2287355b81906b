// Whether light came through the material: with layers of depth, along the line from where it entered.
#ifdef HAS_TSM_LAYERS
uniform sampler2DArray tsm_layers;  // along the light, mm: where a ray enters, leaves, enters ...
uniform int map_layer_count;
uniform vec3 map_eye_mm;
uniform float mean_free_path_mm;    // the shortest of the channels

// How far, along the light, a depth is from the material in one column of the map.
float tsm_air_mm(ivec2 texel, float depth_mm)
{
    float nearest_mm = 1e30;
    for (int i = 0; i < map_layer_count; i += 2) {
        float entry_mm = texelFetch(tsm_layers, ivec3(texel, i), 0).r;
        float exit_mm = texelFetch(tsm_layers, ivec3(texel, i + 1), 0).r;
        if (entry_mm >= 1e29)
            break;
        nearest_mm = min(nearest_mm, max(max(entry_mm - depth_mm, depth_mm - exit_mm), 0.0));
    }
    return nearest_mm;
}

// 1 where all of the way is within a mean free path, or two texels, of the material; 0 from twice that on. The
// columns beside a step's own count as well: on steep sides a texel does not tell where the surface is.
float tsm_solid_part(vec3 here_mm, vec3 entry_mm)
{
    const int steps = 6;
    float part = 1.0;
    for (int k = 0; k < steps; k++) {
        vec3 place_mm = mix(here_mm, entry_mm, (float(k) + 0.5) / float(steps));
        vec4 clip = map_view_projection * vec4(place_mm, 1.0);
        vec2 at = (0.5 * clip.xy / clip.w + 0.5) * map_size_px - 0.5;
        if (clip.w <= 0.0 || any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(map_size_px - 1.0))))
            continue;
        float depth_mm = dot(place_mm - map_eye_mm, map_forward);
        float slack_mm = max(mean_free_path_mm, 2.0 * map_texel_mm * (light.w > 0.0 ? depth_mm : 1.0));
        float air_mm = 1e30;
        for (int i = 0; i < 4; i++) {
            ivec2 texel = min(ivec2(at) + ivec2(i & 1, i >> 1), ivec2(map_size_px) - 1);
            air_mm = min(air_mm, tsm_air_mm(texel, depth_mm));
        }
        part = min(part, 1.0 - smoothstep(slack_mm, 2.0 * slack_mm, air_mm));
    }
    return part;
}
#else
float tsm_solid_part(vec3 here_mm, vec3 entry_mm)
{
    return 1.0;
}
#endif
