// R_d from the splat table (theory.md T15): node coordinate from the squared distance, linear between
// nodes. Interpolated by hand: filters of graphics processors have weights of 8 bits.
uniform samplerBuffer profile_table;
uniform int profile_first_node;  // of the band
uniform int profile_last_node;   // counted from there
uniform float profile_inverse_scale2;
uniform float profile_nodes_per_log2;

vec3 profile_per_mm2(float distance2_mm2)
{
    float node = log2(1.0 + distance2_mm2 * profile_inverse_scale2) * profile_nodes_per_log2;
    int below = min(int(node), profile_last_node - 1);
    float part = min(node - float(below), 1.0);
    below += profile_first_node;
    return mix(texelFetch(profile_table, below).rgb, texelFetch(profile_table, below + 1).rgb, part);
}
