#include "renderer/frusta.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* What is this wide or less, seen from the light, fits one view. */
static const double single_view_angle_rad = 100 * PI / 180;

static const double up[3] = { 0, 1, 0 };

struct box {
    double min[3], max[3];
};

static void box_add(struct box *box, const struct render_projection *view, const struct io_mesh *mesh)
{
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        const float *const p = &mesh->positions[3 * v];
        const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
        double in_view[3];
        render_projection_to_view(view, position_mm, in_view);
        for (int k = 0; k < 3; k++) {
            box->min[k] = fmin(box->min[k], in_view[k]);
            box->max[k] = fmax(box->max[k], in_view[k]);
        }
    }
}

void render_frustum_of_parallel(const double direction[3], const struct io_object *objects, size_t count,
                                const struct render_ball *ball, double margin,
                                struct render_projection *out)
{
    struct box box = { { INFINITY, INFINITY, INFINITY }, { -INFINITY, -INFINITY, -INFINITY } };
    *out = (struct render_projection){ .is_orthographic = true };
    render_projection_aim(out, direction, up);
    for (size_t i = 0; i < count; i++)
        box_add(&box, out, objects[i].mesh);
    const double slack_mm = 1e-3 * ball->radius_mm;
    const double half = 0.5 * fmax(box.max[0] - box.min[0], box.max[1] - box.min[1]) * margin;
    out->half_width = out->half_height = fmax(half, slack_mm);
    out->near_mm = slack_mm;
    out->far_mm = box.max[2] - box.min[2] + 3 * slack_mm;
    for (int k = 0; k < 3; k++)
        out->eye_mm[k] = 0.5 * (box.min[0] + box.max[0]) * out->right[k] +
                         0.5 * (box.min[1] + box.max[1]) * out->up[k] +
                         (box.min[2] - 2 * slack_mm) * out->forward[k];
}

static void make_faces(const struct render_projection *view, struct render_projection faces[RENDER_FACES])
{
    for (int face = 0; face < RENDER_FACES; face++) {
        const double face_up[3] = { 0, face / 2 != 1, face / 2 == 1 };
        double forward[3] = { 0, 0, 0 };
        forward[face / 2] = face % 2 ? -1 : 1;
        faces[face] = *view;
        render_projection_aim(&faces[face], forward, face_up);
    }
}

size_t render_frusta_of_point(const double position_mm[3], const struct render_ball *ball, double margin,
                              double half_width, struct render_projection out[RENDER_FACES])
{
    struct render_projection view = { .is_orthographic = false };
    double toward[3];
    for (int k = 0; k < 3; k++)
        toward[k] = ball->centre_mm[k] - position_mm[k];
    const double distance_mm = sqrt(render_dot(toward, toward)), radius_mm = ball->radius_mm;
    memcpy(view.eye_mm, position_mm, sizeof view.eye_mm);
    view.far_mm = (distance_mm + radius_mm) * 1.001;
    view.near_mm = fmax((distance_mm - radius_mm) * 0.999, 1e-4 * radius_mm);
    if (distance_mm > radius_mm && 2 * asin(radius_mm / distance_mm) <= single_view_angle_rad) {
        for (int k = 0; k < 3; k++)
            toward[k] /= distance_mm;
        render_projection_aim(&view, toward, up);
        view.half_width = view.half_height = tan(asin(radius_mm / distance_mm)) * margin;
        out[0] = view;
        return 1;
    }
    /* a corner is farther away than it is deep */
    view.near_mm /= sqrt(1 + 2 * half_width * half_width);
    view.half_width = view.half_height = half_width;
    make_faces(&view, out);
    return RENDER_FACES;
}

/* Of all vertices: right and up at distance 1, and depth. */
static struct box slopes_of(const struct render_projection *view, const struct io_object *objects,
                            size_t count)
{
    struct box box = { { INFINITY, INFINITY, INFINITY }, { -INFINITY, -INFINITY, -INFINITY } };
    for (size_t i = 0; i < count; i++) {
        const struct io_mesh *const mesh = objects[i].mesh;
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            const float *const p = &mesh->positions[3 * v];
            const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
            double at[3];
            render_projection_to_view(view, position_mm, at);
            at[0] /= at[2];
            at[1] /= at[2];
            for (int k = 0; k < 3; k++) {
                box.min[k] = fmin(box.min[k], at[k]);
                box.max[k] = fmax(box.max[k], at[k]);
            }
        }
    }
    return box;
}

void render_frustum_narrow(const struct io_object *objects, size_t count, double margin,
                           struct render_projection *view)
{
    struct render_projection narrow = *view;
    double forward[3], aside[2];
    const struct box before = slopes_of(view, objects, count);
    for (int k = 0; k < 2; k++)
        aside[k] = tan(0.5 * (atan(before.min[k]) + atan(before.max[k])));
    for (int k = 0; k < 3; k++)
        forward[k] = view->forward[k] + aside[0] * view->right[k] + aside[1] * view->up[k];
    const double length = sqrt(render_dot(forward, forward));
    for (int k = 0; k < 3; k++)
        forward[k] /= length;
    render_projection_aim(&narrow, forward, up);
    const struct box box = slopes_of(&narrow, objects, count);
    if (!(before.min[2] > 0 && box.min[2] > 0))
        return;
    const double half = fmax(fmax(-box.min[0], box.max[0]), fmax(-box.min[1], box.max[1])) * margin;
    narrow.half_width = narrow.half_height = fmax(half, 1e-3 * view->half_width);
    narrow.near_mm = box.min[2] * 0.999;
    narrow.far_mm = box.max[2] * 1.001;
    *view = narrow;
}
