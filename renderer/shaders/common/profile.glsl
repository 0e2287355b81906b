// R_d from the table of bands (theory.md T15, T21): node coordinate from the squared distance, linear between
// nodes. Interpolated by hand: filters of graphics processors have weights of 8 bits.
uniform samplerBuffer profile_table;
uniform int profile_last_node;  // counted from the first

// profile: first node, 1/scale^2 in 1/mm^2, nodes per doubling of 1 + (r/scale)^2.
vec3 profile_per_mm2(float distance2_mm2, vec3 profile)
{
    float node = log2(1.0 + distance2_mm2 * profile.y) * profile.z;
    int below = min(int(node), profile_last_node - 1);
    float part = min(node - float(below), 1.0);
    below += int(profile.x);
    return mix(texelFetch(profile_table, below).rgb, texelFetch(profile_table, below + 1).rgb, part);
}
