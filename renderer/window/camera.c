#include "renderer/window/camera.h"

#include "renderer/projection.h"

#include <math.h>
#include <string.h>

#define RADIANS_PER_PIXEL 0.008
#define ZOOM_PER_NOTCH 0.9
#define POLE_COSINE 0.995
#define DEGREES (180 / 3.14159265358979323846)

/* An eye may be so far from what it looks at: a scene can say no more (docs/formats.md). */
#define DISTANCE_MIN_MM 1e-3
#define DISTANCE_MAX_MM 1e5

/* Turn v about a unit axis (Rodrigues). */
static void rotate(double v[3], const double axis[3], double angle_rad)
{
    const double s = sin(angle_rad), c = cos(angle_rad), along = render_dot(axis, v);
    const double before[3] = { v[0], v[1], v[2] };
    for (int x = 0; x < 3; x++) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        v[x] = c * before[x] + s * (axis[y] * before[z] - axis[z] * before[y]) + (1 - c) * along * axis[x];
    }
}

static double length_of(const double v[3])
{
    return sqrt(render_dot(v, v));
}

/* About up, then about the camera's right. */
static void drag(const struct io_camera *camera, double v[3], double dx_px, double dy_px)
{
    struct render_projection axes;
    const struct render_ball ball = { .radius_mm = 1 };
    const double length = length_of(camera->up);
    double up[3];
    for (int k = 0; k < 3; k++)
        up[k] = camera->up[k] / length;
    render_projection_of_camera(camera, &ball, &axes);
    rotate(v, up, dx_px * RADIANS_PER_PIXEL);
    rotate(v, axes.right, dy_px * RADIANS_PER_PIXEL);
}

void window_camera_turn(struct io_camera *camera, double dx_px, double dy_px)
{
    double from_target[3];
    for (int k = 0; k < 3; k++)
        from_target[k] = camera->eye_mm[k] - camera->target_mm[k];
    drag(camera, from_target, -dx_px, -dy_px);
    const double cosine =
        render_dot(from_target, camera->up) / (length_of(from_target) * length_of(camera->up));
    for (int k = 0; fabs(cosine) <= POLE_COSINE && k < 3; k++)
        camera->eye_mm[k] = camera->target_mm[k] + from_target[k];
}

void window_camera_zoom(struct io_camera *camera, double notches)
{
    double from_target[3];
    for (int k = 0; k < 3; k++)
        from_target[k] = camera->eye_mm[k] - camera->target_mm[k];
    const double before = camera->is_orthographic ? camera->height_mm : length_of(from_target);
    const double wanted = before * pow(ZOOM_PER_NOTCH, notches);
    const double factor = fmin(fmax(wanted, DISTANCE_MIN_MM), DISTANCE_MAX_MM) / before;
    if (camera->is_orthographic)
        camera->height_mm *= factor;
    for (int k = 0; k < 3 && !camera->is_orthographic; k++)
        camera->eye_mm[k] = camera->target_mm[k] + factor * from_target[k];
}

void window_light_turn(struct io_light *light, const struct io_camera *camera, const double centre_mm[3],
                       double dx_px, double dy_px)
{
    if (light->kind == IO_LIGHT_DIRECTIONAL) {
        drag(camera, light->direction, dx_px, dy_px);
        const double length = length_of(light->direction);
        for (int k = 0; k < 3; k++)
            light->direction[k] /= length;
        return;
    }
    double from_centre[3];
    for (int k = 0; k < 3; k++)
        from_centre[k] = light->position_mm[k] - centre_mm[k];
    drag(camera, from_centre, dx_px, dy_px);
    for (int k = 0; k < 3; k++)
        light->position_mm[k] = centre_mm[k] + from_centre[k];
}

void window_angles_of_direction(const double direction[3], double *turn_deg, double *height_deg)
{
    *turn_deg = atan2(-direction[0], -direction[2]) * DEGREES;
    *height_deg = atan2(-direction[1], hypot(direction[0], direction[2])) * DEGREES;
}

void window_direction_of_angles(double turn_deg, double height_deg, double direction[3])
{
    const double turn = turn_deg / DEGREES, height = height_deg / DEGREES;
    direction[0] = -sin(turn) * cos(height);
    direction[1] = -sin(height);
    direction[2] = -cos(turn) * cos(height);
}
