#include "renderer/projection.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The nearest the near plane comes to an eye inside the scene, as part of the ball's radius. */
#define NEAR_SHARE 1e-3

/* Of a ball at the origin; and of an orthographic view's depth, as part of how far away it is. */
#define LEAST_RADIUS_MM 1e-12
#define LEAST_DEPTH 1e-12

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalise(double v[3])
{
    const double length = sqrt(render_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

/* Positions are floats: a ball is no smaller than they can tell apart, so that what has shrunk to a point
 * still has a view. */
static double least_radius_mm(const double centre_mm[3])
{
    const double centre = fmax(fmax(fabs(centre_mm[0]), fabs(centre_mm[1])), fabs(centre_mm[2]));
    return fmax(FLT_EPSILON * centre, LEAST_RADIUS_MM);
}

static double farthest2(const struct io_mesh *mesh, const double centre_mm[3])
{
    double radius2 = 0;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        double distance2 = 0;
        for (int k = 0; k < 3; k++) {
            const double d = (double)mesh->positions[3 * v + (size_t)k] - centre_mm[k];
            distance2 += d * d;
        }
        radius2 = fmax(radius2, distance2);
    }
    return radius2;
}

struct render_ball render_ball_of_scene(const struct io_scene *scene)
{
    struct render_ball ball = { .radius_mm = 0 };
    for (int k = 0; k < 3; k++)
        ball.centre_mm[k] = 0.5 * (scene->min_mm[k] + scene->max_mm[k]);
    double radius2 = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        radius2 = fmax(radius2, farthest2(scene->objects[i].mesh, ball.centre_mm));
    ball.radius_mm = fmax(sqrt(radius2), least_radius_mm(ball.centre_mm));
    return ball;
}

struct render_ball render_ball_of_mesh(const struct io_mesh *mesh)
{
    struct render_ball ball = { .radius_mm = 0 };
    for (int k = 0; k < 3; k++)
        ball.centre_mm[k] = 0.5 * ((double)mesh->min[k] + (double)mesh->max[k]);
    ball.radius_mm = fmax(sqrt(farthest2(mesh, ball.centre_mm)), least_radius_mm(ball.centre_mm));
    return ball;
}

double render_mesh_gap_mm(const struct io_mesh *a, const struct io_mesh *b)
{
    double gap2 = 0;
    for (int k = 0; k < 3; k++) {
        const double gap =
            fmax(fmax((double)a->min[k] - (double)b->max[k], (double)b->min[k] - (double)a->max[k]), 0);
        gap2 += gap * gap;
    }
    return sqrt(gap2);
}

void render_projection_aim(struct render_projection *projection, const double forward[3],
                           const double up[3])
{
    memcpy(projection->forward, forward, sizeof projection->forward);
    cross(forward, up, projection->right);
    if (render_dot(projection->right, projection->right) < 1e-12 * render_dot(up, up)) {
        /* up lies along the view: any other axis will do */
        const double axis[3] = { fabs(forward[0]) < 0.5, fabs(forward[0]) >= 0.5, 0 };
        cross(forward, axis, projection->right);
    }
    normalise(projection->right);
    cross(projection->right, forward, projection->up);
}

void render_projection_of_camera(const struct io_camera *camera, const struct render_ball *ball,
                                 struct render_projection *out)
{
    double forward[3];
    for (int k = 0; k < 3; k++)
        forward[k] = camera->target_mm[k] - camera->eye_mm[k];
    normalise(forward);
    *out = (struct render_projection){ .is_orthographic = camera->is_orthographic };
    memcpy(out->eye_mm, camera->eye_mm, sizeof out->eye_mm);
    render_projection_aim(out, forward, camera->up);
    out->half_height = camera->is_orthographic ? 0.5 * camera->height_mm : tan(0.5 * camera->fov_y_rad);
    out->half_width = out->half_height * camera->width_px / camera->height_px;
    double centre_mm[3];
    render_projection_to_view(out, ball->centre_mm, centre_mm);
    const double margin_mm = 1.001 * ball->radius_mm;
    out->near_mm = centre_mm[2] - margin_mm;
    out->far_mm = centre_mm[2] + margin_mm;
    if (!out->is_orthographic) {
        out->near_mm = fmax(out->near_mm, NEAR_SHARE * ball->radius_mm);
        out->far_mm = fmax(out->far_mm, 2 * out->near_mm);
    } else {
        out->far_mm = fmax(out->far_mm, out->near_mm + LEAST_DEPTH * fabs(out->near_mm));
    }
}

void render_projection_to_view(const struct render_projection *projection, const double position_mm[3],
                               double view_mm[3])
{
    double d[3];
    for (int k = 0; k < 3; k++)
        d[k] = position_mm[k] - projection->eye_mm[k];
    view_mm[0] = render_dot(d, projection->right);
    view_mm[1] = render_dot(d, projection->up);
    view_mm[2] = render_dot(d, projection->forward);
}

void render_projection_matrix(const struct render_projection *projection, float matrix[16])
{
    const struct render_projection *const p = projection;
    const double depth = p->far_mm - p->near_mm;
    /* Rows of the clip transform as weights of (right, up, forward, 1). */
    const double z_scale = p->is_orthographic ? 2 / depth : (p->far_mm + p->near_mm) / depth;
    const double z_shift =
        p->is_orthographic ? -(p->far_mm + p->near_mm) / depth : -2 * p->far_mm * p->near_mm / depth;
    double rows[4][4];
    for (int k = 0; k < 3; k++) {
        rows[0][k] = p->right[k] / p->half_width;
        rows[1][k] = p->up[k] / p->half_height;
        rows[2][k] = p->forward[k] * z_scale;
        rows[3][k] = p->is_orthographic ? 0 : p->forward[k];
    }
    for (int row = 0; row < 4; row++)
        rows[row][3] = -render_dot(rows[row], p->eye_mm);
    rows[2][3] += z_shift;
    rows[3][3] += p->is_orthographic ? 1 : 0;
    for (int row = 0; row < 4; row++) {
        for (int column = 0; column < 4; column++)
            matrix[4 * column + row] = (float)rows[row][column];
    }
}

/* Bounds of x / z over a circle in the half-plane z > 0, by its tangents from the origin. */
static bool bound_circle(double x, double z, double radius, double half_extent, double *lo, double *hi)
{
    const double distance = hypot(x, z);
    if (distance <= radius) {
        *lo = -1;
        *hi = 1;
        return true;
    }
    const double middle_rad = atan2(x, z), half_rad = asin(radius / distance);
    const double right_angle_rad = acos(0);
    if (middle_rad - half_rad >= right_angle_rad || middle_rad + half_rad <= -right_angle_rad)
        return false;
    *lo = middle_rad - half_rad <= -right_angle_rad ? -1 : tan(middle_rad - half_rad) / half_extent;
    *hi = middle_rad + half_rad >= right_angle_rad ? 1 : tan(middle_rad + half_rad) / half_extent;
    return true;
}

bool render_projection_bound_sphere(const struct render_projection *projection, const double centre_mm[3],
                                    double radius_mm, double rectangle[4])
{
    double c[3];
    render_projection_to_view(projection, centre_mm, c);
    if (projection->is_orthographic) {
        rectangle[0] = (c[0] - radius_mm) / projection->half_width;
        rectangle[1] = (c[1] - radius_mm) / projection->half_height;
        rectangle[2] = (c[0] + radius_mm) / projection->half_width;
        rectangle[3] = (c[1] + radius_mm) / projection->half_height;
    } else if (!bound_circle(c[0], c[2], radius_mm, projection->half_width, &rectangle[0], &rectangle[2]) ||
               !bound_circle(c[1], c[2], radius_mm, projection->half_height, &rectangle[1],
                             &rectangle[3])) {
        return false;
    }
    if (c[2] + radius_mm < projection->near_mm || rectangle[0] >= 1 || rectangle[1] >= 1 ||
        rectangle[2] <= -1 || rectangle[3] <= -1)
        return false;
    for (int k = 0; k < 4; k++)
        rectangle[k] = fmin(fmax(rectangle[k], -1), 1);
    return true;
}

double render_projection_linear_depth(const struct render_projection *projection, double view_z_mm)
{
    const double depth = (view_z_mm - projection->near_mm) / (projection->far_mm - projection->near_mm);
    return fmin(fmax(depth, 0), 1);
}
