// Splat tables of lutgen: R_d(r), the power that leaves per mm^2 for one unit of power that entered at a
// distance r. GLSL 3.30 or later, any stage. The texture: half or float, no mip maps, not sRGB. Its filter is
// not used: the weights of graphics processors have 8 bits, which is too few for tables of 0.1 %.

// A row's attributes, without their "dipole:".
struct dipole_splat {
    float r_max_mm, scale_mm, power, falloff;
    vec3 scale;
    int row;  // from the top; 0 in a splat1d table
};

// exp(x) - 1 without cancellation: the series up to 0.5.
float dipole_expm1(float x)
{
    if (abs(x) > 0.5)
        return exp(x) - 1.0;
    return x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))));
}

// How far along the row, 0 to 1: (w^power - 1)/(w_max^power - 1), w = 1 + (r/scale)^2.
float dipole_splat_u(dipole_splat table, float w)
{
    float x_max = table.r_max_mm / table.scale_mm;
    float log_w = log(w), log_w_max = log(1.0 + x_max * x_max);
    if (table.power == 0.0)
        return log_w / log_w_max;
    return dipole_expm1(table.power * log_w) / dipole_expm1(table.power * log_w_max);
}

// In 1/mm^2, r_mm >= 0; 0 beyond r_max_mm.
vec3 dipole_splat_rd_per_mm2(sampler2D texels, dipole_splat table, float r_mm)
{
    if (!(r_mm <= table.r_max_mm))
        return vec3(0.0);
    float x = r_mm / table.scale_mm;
    float w = 1.0 + x * x;
    int last = textureSize(texels, 0).x - 2;
    float index = dipole_splat_u(table, w) * float(last + 1);
    int i = min(int(index), last);
    vec3 low = texelFetch(texels, ivec2(i, table.row), 0).rgb;
    vec3 high = texelFetch(texels, ivec2(i + 1, table.row), 0).rgb;
    return mix(low, high, index - float(i)) * table.scale * pow(w, -table.falloff);
}
