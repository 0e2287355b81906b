/* Random directions, and where light comes to the body. */
#include "path_tracer_parts.h"

#include <string.h>

/* ---- random directions ------------------------------------------------------------------------------ */

double tracer_disc(struct accuracy_stream *stream, double point[2])
{
    for (;;) {
        point[0] = 2 * accuracy_uniform(stream) - 1;
        point[1] = 2 * accuracy_uniform(stream) - 1;
        const double r2 = point[0] * point[0] + point[1] * point[1];
        if (r2 < 1 && r2 > 0)
            return r2;
    }
}

/* Two unit vectors at right angles to a unit vector and each other (Duff et al. 2017). */
static void basis(const double n[3], double a[3], double b[3])
{
    const double sign = n[2] >= 0 ? 1 : -1;
    const double u = -1 / (sign + n[2]), v = n[0] * n[1] * u;
    a[0] = 1 + sign * n[0] * n[0] * u;
    a[1] = sign * v;
    a[2] = -sign * n[0];
    b[0] = v;
    b[1] = sign + n[1] * n[1] * u;
    b[2] = -n[1];
}

void tracer_turn(const double axis[3], double cosine, const double point[2], double r2, double out[3])
{
    double a[3], b[3];
    basis(axis, a, b);
    const double sine = sqrt(fmax(1 - cosine * cosine, 0) / r2);
    for (int k = 0; k < 3; k++)
        out[k] = cosine * axis[k] + sine * (point[0] * a[k] + point[1] * b[k]);
    /* One step of Newton's keeps the length at 1. */
    const double scale = 1.5 - 0.5 * tracer_dot(out, out);
    for (int k = 0; k < 3; k++)
        out[k] *= scale;
}

bool tracer_meet(const struct tracer_shape *shape, const double from_mm[3], const double direction[3],
                 double p_mm[3], int *face)
{
    double distance_mm = -INFINITY;
    if (shape->is_sphere) {
        double x[3];
        for (int k = 0; k < 3; k++)
            x[k] = shape->centre_mm[k] - from_mm[k];
        const double along = tracer_dot(x, direction);
        const double under = along * along + (shape->radius_mm * shape->radius_mm - tracer_dot(x, x));
        if (under < 0)
            return false;
        distance_mm = along - sqrt(under);
        *face = 0;
    } else {
        double leave_mm = INFINITY;
        for (int k = 0; k < 3; k++) {
            const int far = 2 * k + (direction[k] > 0), near = far ^ 1;
            if (direction[k] == 0) {
                if (from_mm[k] < shape->planes_mm[2 * k] || from_mm[k] > shape->planes_mm[2 * k + 1])
                    return false;
                continue;
            }
            const double enter_mm = (shape->planes_mm[near] - from_mm[k]) / direction[k];
            if (enter_mm > distance_mm) {
                distance_mm = enter_mm;
                *face = near;
            }
            leave_mm = fmin(leave_mm, (shape->planes_mm[far] - from_mm[k]) / direction[k]);
        }
        if (distance_mm >= leave_mm)
            return false;
    }
    if (!(distance_mm >= 0 && distance_mm < INFINITY))
        return false;
    for (int k = 0; k < 3; k++)
        p_mm[k] = from_mm[k] + distance_mm * direction[k];
    if (!shape->is_sphere)
        p_mm[*face / 2] = shape->planes_mm[*face];
    return true;
}

/* A point on one of the faces that see the light. */
static void sample_box(const struct tracer_lamp *lamp, const struct tracer_shape *shape,
                       struct accuracy_stream *stream, struct tracer_arrival *out)
{
    const struct tracer_light *const light = &lamp->light;
    const double *const planes = shape->planes_mm;
    double weights[TRACER_FACES] = { 0 }, total = 0;
    for (int face = 0; face < TRACER_FACES; face++) {
        const int axis = face / 2;
        const double sign = face % 2 == 1 ? 1 : -1;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const double area_mm2 = (planes[2 * u + 1] - planes[2 * u]) * (planes[2 * v + 1] - planes[2 * v]);
        if (light->kind == TRACER_DIRECTIONAL)
            weights[face] = area_mm2 * fmax(-sign * light->direction[axis], 0);
        else
            weights[face] = sign * (light->position_mm[axis] - planes[face]) > 0 ? area_mm2 : 0;
        total += weights[face];
    }
    double left = total * accuracy_uniform(stream);
    for (int face = 0; face < TRACER_FACES; face++) {
        if (weights[face] > 0) {
            out->face = face;
            if (left <= weights[face])
                break;
            left -= weights[face];
        }
    }
    for (int k = 0; k < 3; k++)
        out->p_mm[k] = planes[2 * k] + (planes[2 * k + 1] - planes[2 * k]) * accuracy_uniform(stream);
    out->p_mm[out->face / 2] = planes[out->face];
    out->power_w = light->strength * total;
    memcpy(out->direction, light->direction, sizeof out->direction);
    if (light->kind == TRACER_POINT) {
        for (int k = 0; k < 3; k++)
            out->direction[k] = out->p_mm[k] - light->position_mm[k];
        const double distance_mm = sqrt(tracer_dot(out->direction, out->direction));
        for (int k = 0; k < 3; k++)
            out->direction[k] /= distance_mm;
        out->power_w *= fabs(out->direction[out->face / 2]) / (distance_mm * distance_mm);
    }
}

/* Directional: a point of the disc that the sphere shows the light. Point: a direction in the cone that
 * holds the sphere. */
static void sample_sphere(const struct tracer_lamp *lamp, const struct tracer_shape *shape,
                          struct accuracy_stream *stream, struct tracer_arrival *out)
{
    const struct tracer_light *const light = &lamp->light;
    const double radius_mm = shape->radius_mm, *const centre_mm = shape->centre_mm;
    double point[2];
    const double r2 = tracer_disc(stream, point);
    out->face = 0;
    if (light->kind == TRACER_DIRECTIONAL) {
        for (int k = 0; k < 3; k++) {
            out->direction[k] = light->direction[k];
            out->p_mm[k] =
                centre_mm[k] + radius_mm * (point[0] * lamp->across[0][k] + point[1] * lamp->across[1][k] -
                                            sqrt(1 - r2) * light->direction[k]);
        }
        out->power_w = light->strength * TRACER_PI * radius_mm * radius_mm;
        return;
    }
    double axis[3];
    for (int k = 0; k < 3; k++)
        axis[k] = centre_mm[k] - light->position_mm[k];
    const double distance_mm = sqrt(tracer_dot(axis, axis));
    for (int k = 0; k < 3; k++)
        axis[k] /= distance_mm;
    const double sine2 = radius_mm * radius_mm / (distance_mm * distance_mm);
    const double height = sine2 / (1 + sqrt(1 - sine2)); /* 1 - cosine */
    tracer_turn(axis, 1 - height * r2, point, r2, out->direction);
    out->power_w = light->strength * 2 * TRACER_PI * height;
    if (!tracer_meet(shape, light->position_mm, out->direction, out->p_mm, &out->face)) {
        /* only by rounding at the rim: there nothing enters */
        const double rim_mm = sqrt(fmax(distance_mm * distance_mm - radius_mm * radius_mm, 0));
        for (int k = 0; k < 3; k++)
            out->p_mm[k] = light->position_mm[k] + rim_mm * out->direction[k];
    }
}

void tracer_lamp_sample(const struct tracer_lamp *lamp, const struct tracer_shape *shape,
                        struct accuracy_stream *stream, struct tracer_arrival *out)
{
    const struct tracer_light *const light = &lamp->light;
    if (light->kind == TRACER_PENCIL) {
        memcpy(out->direction, light->direction, sizeof out->direction);
        out->power_w = light->strength;
        (void)tracer_meet(shape, light->position_mm, light->direction, out->p_mm, &out->face);
    } else if (shape->is_sphere) {
        sample_sphere(lamp, shape, stream, out);
    } else {
        sample_box(lamp, shape, stream, out);
    }
}

void tracer_lamp_init(const struct tracer_light *light, struct tracer_lamp *out)
{
    *out = (struct tracer_lamp){ .light = *light };
    const double length = sqrt(tracer_dot(light->direction, light->direction));
    for (int k = 0; k < 3; k++)
        out->light.direction[k] = length > 0 ? light->direction[k] / length : k == 2;
    basis(out->light.direction, out->across[0], out->across[1]);
}
