// Volumes of lutgen for translucent shadow maps: what a point receives from the flux that enters the surface
// in one cell of its light's view. GLSL 3.30 or later, any stage. The texture: half or float, linear
// filtering, clamped to its edge, no mip maps, not sRGB; a volume, or with DIPOLE_TSM_STRIP defined the strip
// of the EXR file, its slices side by side. Coordinates end at the centres of the outermost texels, so that
// no slice is filtered into the next.

#ifdef DIPOLE_TSM_STRIP
#define DIPOLE_TSM_SAMPLER sampler2D
#else
#define DIPOLE_TSM_SAMPLER sampler3D
#endif

// The table's attributes, without their "dipole:".
struct dipole_tsm {
    ivec3 size;  // S, T, R
    float depth_scale_mm, depth_max_mm;
    vec3 scale;
    int local_slice, depth_factor_slice;
    float local_width_mm, local_depth_scale_mm, inner_mm;
};

// s and t count texels from the centre of the first.
vec3 dipole_tsm_texel(DIPOLE_TSM_SAMPLER texels, dipole_tsm table, float s, float t, int slice)
{
    vec3 size = vec3(table.size);
#ifdef DIPOLE_TSM_STRIP
    vec2 texel = vec2(float(slice) * size.x + s, t) + 0.5;
    return textureLod(texels, texel / vec2(size.x * size.z, size.y), 0.0).rgb;
#else
    vec3 texel = vec3(s, t, float(slice)) + 0.5;
    return textureLod(texels, texel / size, 0.0).rgb;
#endif
}

// Texels along T; dz_mm within -depth_max_mm to depth_max_mm.
float dipole_tsm_t(dipole_tsm table, float dz_mm)
{
    float end = asinh(table.depth_max_mm / table.depth_scale_mm);
    return (0.5 + 0.5 * asinh(dz_mm / table.depth_scale_mm) / end) * float(table.size.y - 1);
}

// Response to a sample of the pattern, in 1/mm^2: times the flux per mm^2 of its cell and the cell's area_mm2
// it is radiosity. delta_mm: x_out - x_in; normal: unit normal where the light enters, towards the light;
// dz_mm: how much deeper x_out lies, along the light.
vec3 dipole_tsm_response_per_mm2(DIPOLE_TSM_SAMPLER texels, dipole_tsm table, int sample_index, vec3 delta_mm,
                                 vec3 normal, float dz_mm)
{
    if (!(abs(dz_mm) <= table.depth_max_mm))
        return vec3(0.0);
    float distance_mm = length(delta_mm);
    float cosine = distance_mm > 0.0 ? clamp(dot(normal, delta_mm) / distance_mm, -1.0, 1.0) : 0.0;
    float s = (0.5 + 0.5 * cosine) * float(table.size.x - 1);
    return dipole_tsm_texel(texels, table, s, dipole_tsm_t(table, dz_mm), sample_index) * table.scale;
}

// Response to a cell of the local kernel, 0 to 6 each way with x_out in the middle of (3, 3); times the flux
// per mm^2 of the cell it is radiosity. dz_mm: how much deeper x_out lies than the surface in that cell.
vec3 dipole_tsm_local(DIPOLE_TSM_SAMPLER texels, dipole_tsm table, ivec2 cell, float dz_mm)
{
    if (!(abs(dz_mm) <= table.inner_mm))
        return vec3(0.0);
    vec3 kernel_per_mm2 =
        dipole_tsm_texel(texels, table, float(cell.x), float(cell.y), table.local_slice) * table.scale;
    float end = asinh(table.inner_mm / table.local_depth_scale_mm);
    float s = asinh(abs(dz_mm) / table.local_depth_scale_mm) / end * float(table.size.x - 1);
    vec3 factor = dipole_tsm_texel(texels, table, s, dz_mm < 0.0 ? 1.0 : 0.0, table.depth_factor_slice);
    return kernel_per_mm2 * factor * (table.local_width_mm * table.local_width_mm);
}
