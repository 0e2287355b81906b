// The 3D form of the response (theory.md T30), from a medium's sources.
uniform samplerBuffer tsm_sources;  // 128 for each channel: depth, weight/(2 pi), sigma_tr, steepness b
uniform ivec3 tsm_source_counts;

float tsm_lobe(vec4 source, float d2)
{
    float z = abs(source.x), z2 = z * z;
    float held2 = max(d2, z2), d = sqrt(held2);
    float u = max(1.0 - d2 / z2, 0.0);
    float value = z * (source.z + 1.0 / d) * exp(-source.z * d) / held2;
    return source.y * value * (1.0 + source.w * (u - 0.5 * u * u));
}

// In 1/mm^2, at a distance with the cosine between the normal where light entered and the way out.
vec3 tsm_form_per_mm2(float distance_mm, float cosine)
{
    vec3 sum = vec3(0.0);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < tsm_source_counts[c]; k++) {
            vec4 source = texelFetch(tsm_sources, 128 * c + k);
            float d2 = distance_mm * distance_mm + source.x * (source.x + 2.0 * distance_mm * cosine);
            sum[c] += tsm_lobe(source, d2);
        }
    }
    return sum;
}
