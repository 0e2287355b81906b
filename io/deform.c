#include "io/deform.h"

#include <math.h>

const char *const io_deform_kind_names[] = { "twist", "bend", "wave", NULL };

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void add(double v[3], double factor, const double direction[3])
{
    for (int k = 0; k < 3; k++)
        v[k] += factor * direction[k];
}

/* sin(x)/x */
static double sinc(double x)
{
    return fabs(x) < 1e-4 ? 1 - x * x / 6 : sin(x) / x;
}

/* cos(x) - 1, which keeps its digits where x is small. */
static double cos_less_one(double x)
{
    const double s = sin(0.5 * x);
    return -2 * s * s;
}

/* Turn v about the unit axis by what is added to it, so that a small angle changes few digits. */
static void turn(double v[3], const double axis[3], double angle_rad)
{
    double sideways[3], along = dot(axis, v), radial[3] = { v[0], v[1], v[2] };
    cross(axis, v, sideways);
    add(radial, -along, axis);
    add(v, cos_less_one(angle_rad), radial);
    add(v, sin(angle_rad), sideways);
}

/* T54: J = (I + u a') R with u = rate a x r, r the turned radius; its determinant is 1. */
static void twist(const struct io_deform *deform, double position_mm[3], double normal[3])
{
    double radius_mm[3], sideways_mm[3];
    for (int k = 0; k < 3; k++)
        radius_mm[k] = position_mm[k] - deform->origin_mm[k];
    const double along_mm = dot(radius_mm, deform->axis), angle_rad = deform->rate_rad_per_mm * along_mm;
    const double before_mm[3] = { radius_mm[0], radius_mm[1], radius_mm[2] };
    turn(radius_mm, deform->axis, angle_rad);
    for (int k = 0; k < 3; k++)
        position_mm[k] += radius_mm[k] - before_mm[k];
    turn(normal, deform->axis, angle_rad);
    cross(deform->axis, radius_mm, sideways_mm);
    add(normal, -deform->rate_rad_per_mm * dot(sideways_mm, normal), deform->axis);
}

/* T55: J's columns are f a', t' and b; f = 1 - curvature times the place toward. */
static void bend(const struct io_deform *deform, double position_mm[3], double normal[3])
{
    const double *const axis = deform->axis, *const toward = deform->toward;
    const double rate = deform->rate_rad_per_mm;
    double from_mm[3];
    for (int k = 0; k < 3; k++)
        from_mm[k] = position_mm[k] - deform->origin_mm[k];
    const double along_mm = dot(from_mm, axis), up_mm = dot(from_mm, toward), angle_rad = rate * along_mm;
    const double half = sinc(0.5 * angle_rad);
    add(position_mm, along_mm * (sinc(angle_rad) - 1) - up_mm * sin(angle_rad), axis);
    add(position_mm, 0.5 * along_mm * angle_rad * half * half + up_mm * cos_less_one(angle_rad), toward);
    const double factor = 1 - rate * up_mm, along = dot(normal, axis), up = dot(normal, toward);
    const double s = sin(angle_rad), c = cos(angle_rad);
    for (int k = 0; k < 3; k++) {
        const double across = normal[k] - along * axis[k] - up * toward[k];
        normal[k] =
            along * (c * axis[k] + s * toward[k]) + factor * (up * (c * toward[k] - s * axis[k]) + across);
    }
}

/* T56: J = I + slope t a'; its determinant is 1. */
static void wave(const struct io_deform *deform, double position_mm[3], double normal[3])
{
    double along_mm = 0;
    for (int k = 0; k < 3; k++)
        along_mm += (position_mm[k] - deform->origin_mm[k]) * deform->axis[k];
    const double angle_rad = deform->rate_rad_per_mm * along_mm - deform->phase_rad;
    const double slope = deform->amplitude_mm * deform->rate_rad_per_mm * cos(angle_rad);
    add(position_mm, deform->amplitude_mm * sin(angle_rad), deform->toward);
    add(normal, -slope * dot(normal, deform->toward), deform->axis);
}

bool io_deform_is_identity(const struct io_deform *deform)
{
    return deform->kind == IO_DEFORM_WAVE ? deform->amplitude_mm == 0 : deform->rate_rad_per_mm == 0;
}

void io_deform_apply(const struct io_deform *deform, double position_mm[3], double normal[3])
{
    if (io_deform_is_identity(deform)) /* even adding 0 would change the sign of a 0 */
        return;
    if (deform->kind == IO_DEFORM_TWIST)
        twist(deform, position_mm, normal);
    else if (deform->kind == IO_DEFORM_BEND)
        bend(deform, position_mm, normal);
    else
        wave(deform, position_mm, normal);
}

static void move(const struct io_pose *pose, double position_mm[3], double normal[3])
{
    const double p[3] = { position_mm[0], position_mm[1], position_mm[2] },
                 n[3] = { normal[0], normal[1], normal[2] };
    for (int k = 0; k < 3; k++) {
        position_mm[k] = dot(pose->rotation[k], p) + pose->shift_mm[k];
        normal[k] = dot(pose->rotation[k], n);
    }
}

void io_pose_apply(const struct io_pose *pose, double position_mm[3], double normal[3])
{
    for (size_t i = 0; i < pose->deform_count; i++)
        io_deform_apply(&pose->deforms[i], position_mm, normal);
    if (pose->is_moved)
        move(pose, position_mm, normal);
    if (io_pose_is_rest(pose))
        return;
    const double length = sqrt(dot(normal, normal));
    for (int k = 0; k < 3 && length > 0; k++)
        normal[k] /= length;
}

bool io_pose_is_rest(const struct io_pose *pose)
{
    return pose->deform_count == 0 && !pose->is_moved;
}
