#include "renderer/area_light.h"

#include "renderer/projection.h"

#include <math.h>

#define PI 3.14159265358979323846
#define GOLDEN_ANGLE_RAD 2.39996322972865332223

bool render_light_has_size(const struct io_light *light)
{
    return light->kind == IO_LIGHT_POINT ? light->size_mm > 0 : light->size_rad > 0;
}

static void normalize(double v[3])
{
    const double length = sqrt(render_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] = length > 0 ? v[k] / length : k == 1;
}

/* Two unit vectors across a third. */
static void across(const double along[3], double right[3], double up[3])
{
    struct render_projection frame = { .is_orthographic = true };
    const double y[3] = { 0, 1, 0 };
    render_projection_aim(&frame, along, y);
    for (int k = 0; k < 3; k++) {
        right[k] = frame.right[k];
        up[k] = frame.up[k];
    }
}

struct io_light render_light_place(const struct io_light *light, const double position_mm[3], int index,
                                   int count)
{
    struct io_light place = *light;
    place.size_mm = place.size_rad = 0;
    if (!render_light_has_size(light) || count <= 1)
        return place;
    const double radius = sqrt((index + 0.5) / count), angle = index * GOLDEN_ANGLE_RAD;
    double along[3], right[3], up[3];
    for (int k = 0; k < 3; k++)
        along[k] =
            light->kind == IO_LIGHT_POINT ? position_mm[k] - light->position_mm[k] : light->direction[k];
    normalize(along);
    across(along, right, up);
    const double reach = light->kind == IO_LIGHT_POINT ? light->size_mm / 2 : tan(light->size_rad / 2);
    for (int k = 0; k < 3; k++) {
        const double aside = reach * radius * (cos(angle) * right[k] + sin(angle) * up[k]);
        if (light->kind == IO_LIGHT_POINT)
            place.position_mm[k] += aside;
        else
            place.direction[k] = along[k] + aside;
    }
    if (light->kind == IO_LIGHT_DIRECTIONAL)
        normalize(place.direction);
    return place;
}

void render_light_spot_cosines(const struct io_light *light, double *inner_out, double *outer_out)
{
    *outer_out = cos(light->cone_rad / 2);
    *inner_out = cos(light->cone_rad / 2 * (1 - light->cone_blend));
}

double render_light_spot_part(const struct io_light *light, const double direction[3])
{
    double inner, outer;
    if (!light->is_spot)
        return 1;
    render_light_spot_cosines(light, &inner, &outer);
    const double cosine = render_dot(light->direction, direction);
    if (!(inner > outer))
        return cosine >= outer;
    const double t = fmin(fmax((cosine - outer) / (inner - outer), 0), 1);
    return t * t * (3 - 2 * t);
}
