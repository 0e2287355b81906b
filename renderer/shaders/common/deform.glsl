// What a frame makes of a vertex: as io/deform.c does (theory.md T54, T55, T56).
struct Deform {
    int kind;  // 0: twist, 1: bend, 2: wave
    vec3 origin_mm, axis, toward;
    float rate_rad_per_mm, amplitude_mm, phase_rad;
};
uniform int deform_count;
uniform Deform deforms[4];

float sinc(float x)
{
    return abs(x) < 1e-2 ? 1.0 - x * x / 6.0 : sin(x) / x;
}

float cos_less_one(float x)
{
    float s = sin(0.5 * x);
    return -2.0 * s * s;
}

// What turning about the axis adds to v.
vec3 turn_of(vec3 v, vec3 axis, float angle_rad)
{
    return cos_less_one(angle_rad) * (v - dot(v, axis) * axis) + sin(angle_rad) * cross(axis, v);
}

void twist(Deform d, inout vec3 position_mm, inout vec3 normal)
{
    vec3 radius_mm = position_mm - d.origin_mm;
    float angle_rad = d.rate_rad_per_mm * dot(radius_mm, d.axis);
    vec3 step_mm = turn_of(radius_mm, d.axis, angle_rad);
    position_mm += step_mm;
    normal += turn_of(normal, d.axis, angle_rad);
    normal -= d.rate_rad_per_mm * dot(cross(d.axis, radius_mm + step_mm), normal) * d.axis;
}

void bend(Deform d, inout vec3 position_mm, inout vec3 normal)
{
    vec3 from_mm = position_mm - d.origin_mm;
    float along_mm = dot(from_mm, d.axis), up_mm = dot(from_mm, d.toward);
    float angle_rad = d.rate_rad_per_mm * along_mm, half_sinc = sinc(0.5 * angle_rad);
    position_mm += (along_mm * (sinc(angle_rad) - 1.0) - up_mm * sin(angle_rad)) * d.axis +
                   (0.5 * along_mm * angle_rad * half_sinc * half_sinc + up_mm * cos_less_one(angle_rad)) * d.toward;
    float along = dot(normal, d.axis), up = dot(normal, d.toward), s = sin(angle_rad), c = cos(angle_rad);
    vec3 across = normal - along * d.axis - up * d.toward;
    normal = along * (c * d.axis + s * d.toward) +
             (1.0 - d.rate_rad_per_mm * up_mm) * (up * (c * d.toward - s * d.axis) + across);
}

void wave(Deform d, inout vec3 position_mm, inout vec3 normal)
{
    float angle_rad = d.rate_rad_per_mm * dot(position_mm - d.origin_mm, d.axis) - d.phase_rad;
    position_mm += d.amplitude_mm * sin(angle_rad) * d.toward;
    normal -= d.amplitude_mm * d.rate_rad_per_mm * cos(angle_rad) * dot(normal, d.toward) * d.axis;
}
uniform mat3 motion_rotation;
uniform vec3 motion_shift_mm;

void pose(inout vec3 position_mm, inout vec3 normal)
{
    for (int i = 0; i < deform_count; i++) {
        if (deforms[i].kind == 0)
            twist(deforms[i], position_mm, normal);
        else if (deforms[i].kind == 1)
            bend(deforms[i], position_mm, normal);
        else
            wave(deforms[i], position_mm, normal);
    }
    position_mm = motion_rotation * position_mm + motion_shift_mm;
    normal = motion_rotation * (normal / max(length(normal), 1e-30));
}
