/* How light that leaves becomes a picture. */
#include "path_tracer_parts.h"

#include <string.h>

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalise(double v[3])
{
    const double length = sqrt(tracer_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

/* ---- where a point is in the picture ---------------------------------------------------------------- */

struct footprint {
    size_t pixel;
    double toward_eye[3], cosine; /* to the normal                                   */
    double per_mm2;               /* radiance of 1 mm^2 across the view that gives 1 W/(mm^2 sr): 1 over
                                     the pixel's area at the point, across the view  */
};

/* false: not seen, or outside the picture. */
static bool find_pixel(const struct tracer_camera *camera, const double p_mm[3], const double normal[3],
                       struct footprint *out)
{
    const struct io_camera *const io = &camera->view.camera;
    double from_eye[3];
    for (int k = 0; k < 3; k++)
        from_eye[k] = p_mm[k] - io->eye_mm[k];
    const double distance_mm = sqrt(tracer_dot(from_eye, from_eye));
    const double z = tracer_dot(from_eye, camera->forward);
    if (!io->is_orthographic && z <= 0)
        return false;
    for (int k = 0; k < 3; k++)
        out->toward_eye[k] = io->is_orthographic ? -camera->forward[k] : -from_eye[k] / distance_mm;
    out->cosine = tracer_dot(out->toward_eye, normal);
    if (out->cosine <= 0)
        return false;
    const double scale = io->is_orthographic ? 1 : z;
    const double x = tracer_dot(from_eye, camera->right) / (scale * camera->half_width);
    const double y = tracer_dot(from_eye, camera->up) / (scale * camera->half_height);
    const double column = floor(0.5 * (1 + x) * io->width_px), row = floor(0.5 * (1 - y) * io->height_px);
    if (!(column >= 0 && column < io->width_px && row >= 0 && row < io->height_px))
        return false;
    out->pixel = (size_t)row * (size_t)io->width_px + (size_t)column;
    /* The picture's plane is at distance 1: a solid angle there covers its area times the cube of the
     * cosine to the view. */
    out->per_mm2 = 1 / camera->pixel_area;
    if (!io->is_orthographic)
        out->per_mm2 *= distance_mm / (z * z * z);
    return true;
}

double tracer_cone_flux(double cosine, double sine2)
{
    if (cosine * cosine >= sine2) /* all of it above the surface */
        return TRACER_PI * sine2 * cosine;
    const double sine = sqrt(1 - cosine * cosine), cotangent = sqrt(1 / sine2 - 1);
    const double y = -fmin(cotangent * cosine / sine, 1), root = sine * sqrt(1 - y * y);
    return (cosine * acos(y) - cotangent * root) * sine2 + atan(root / cotangent);
}

void tracer_camera_add(const struct tracer_camera *camera, const double p_mm[3], const double normal[3],
                       const double outward[3], double power_w, double *picture)
{
    struct footprint seen;
    if (camera->view.estimator == TRACER_NEXT_EVENT || !find_pixel(camera, p_mm, normal, &seen))
        return;
    /* The mean over a pixel of L is the integral of L cosine dA over the pixel's area. */
    const double per_radiance = seen.cosine * seen.per_mm2;
    if (camera->view.estimator == TRACER_RADIOSITY) {
        const double transmitted = 1 - dipole_fresnel_reflectance(camera->eta, fmin(seen.cosine, 1));
        picture[seen.pixel] += power_w * camera->exit_per_sr * transmitted * per_radiance;
    } else if (tracer_dot(outward, seen.toward_eye) >= camera->cone_cosine) {
        picture[seen.pixel] +=
            power_w / tracer_cone_flux(fmin(seen.cosine, 1), camera->cone_sine2) * per_radiance;
    }
}

/* ---- next-event estimation -------------------------------------------------------------------------- */

double tracer_phase_per_sr(double g, double cosine)
{
    const double d2 = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * TRACER_PI * d2 * sqrt(d2));
}

/* Optical depth up to which what remains is computed; beyond, a free path decides. */
#define DEPTH_COMPUTED 2.0

/* What is the same for all ways from one scattering to the eye. */
struct event {
    const struct tracer_camera *camera;
    const struct tracer_shape *shape;
    double sigma_t_per_mm;
    const double *p_mm;
    double depth_limit; /* optical depth that light gets to, beyond what is computed; one for all ways */
    double *picture;
};

/*
 * Follow light that starts in the direction given, a mirror image of the connection's. Where it comes to
 * the connection's face in the connection's direction, a part of it leaves to the eye; the rest is
 * mirrored and goes on, until little is left and roulette ends it.
 */
static void follow(const struct event *event, const struct tracer_connection *connection,
                   const double direction[3], double power_w_per_sr, struct accuracy_stream *stream)
{
    double p[3], d[3], depth = 0, left = 1;
    memcpy(p, event->p_mm, sizeof p);
    memcpy(d, direction, sizeof d);
    for (;;) {
        int face = 0;
        const double distance_mm = tracer_distance_mm(event->shape, p, d, &face);
        depth += event->sigma_t_per_mm * distance_mm;
        if (!(distance_mm < INFINITY && depth <= event->depth_limit))
            return;
        const int axis = face / 2;
        for (int k = 0; k < 3; k++)
            p[k] += distance_mm * d[k];
        p[axis] = event->shape->planes_mm[face];
        double normal[3] = { 0, 0, 0 };
        normal[axis] = face % 2 == 1 ? 1 : -1;
        struct footprint seen;
        if (face == connection->face && d[0] == connection->direction[0] &&
            d[1] == connection->direction[1] && d[2] == connection->direction[2] &&
            find_pixel(event->camera, p, normal, &seen))
            event->picture[seen.pixel] +=
                power_w_per_sr * left * exp(-fmin(depth, DEPTH_COMPUTED)) * connection->radiance;
        left *= connection->reflected[axis];
        d[axis] = -d[axis];
        if (left < 0.05) {
            if (accuracy_uniform(stream) * 0.05 > left || left == 0)
                return;
            left = 0.05;
        }
    }
}

void tracer_camera_connect(const struct tracer_camera *camera, const struct tracer_shape *shape,
                           const struct tracer_medium *medium, const double p_mm[3],
                           const double direction[3], double power_w, struct accuracy_stream *stream,
                           double *picture)
{
    struct event event = { .camera = camera, .shape = shape, .p_mm = p_mm };
    event.sigma_t_per_mm = medium->sigma_a_per_mm + medium->sigma_s_per_mm;
    event.depth_limit = DEPTH_COMPUTED - log(accuracy_uniform(stream));
    event.picture = picture;
    double nearest_mm = INFINITY; /* no way is shorter */
    for (int face = 0; face < TRACER_FACES; face++)
        nearest_mm = fmin(nearest_mm, fabs(shape->planes_mm[face] - p_mm[face / 2]));
    if (event.sigma_t_per_mm * nearest_mm > event.depth_limit)
        return;
    for (int i = 0; i < camera->connection_count; i++) {
        const struct tracer_connection *const connection = &camera->connections[i];
        for (int mirror = 0; mirror < 8; mirror++) {
            double d[3];
            bool is_new = true; /* a component that is 0 is its own mirror image */
            for (int k = 0; k < 3; k++) {
                const bool is_mirrored = (mirror >> k & 1) != 0;
                d[k] = is_mirrored ? -connection->direction[k] : connection->direction[k];
                is_new = is_new && !(is_mirrored && d[k] == 0);
            }
            if (is_new)
                follow(&event, connection, d,
                       power_w * tracer_phase_per_sr(medium->g, tracer_dot(direction, d)), stream);
        }
    }
}

/* Light within that leaves through a face toward the eye; false: there is none, or the face is not seen. */
static bool connection_init(const struct tracer_camera *camera, int face, struct tracer_connection *out)
{
    const int axis = face / 2;
    const double eta = camera->eta, sign = face % 2 == 1 ? 1 : -1;
    const double cosine = -camera->forward[axis] * sign;
    const double inside2 = 1 - (1 - cosine * cosine) / (eta * eta);
    if (cosine <= 0 || inside2 <= 0)
        return false;
    *out = (struct tracer_connection){ .face = face };
    for (int k = 0; k < 3; k++)
        out->direction[k] = k == axis ? sign * sqrt(inside2) : -camera->forward[k] / eta;
    for (int k = 0; k < 3; k++)
        out->reflected[k] = dipole_fresnel_reflectance(1 / eta, fmin(fabs(out->direction[k]), 1));
    /* eta^2 cosine_inside domega_inside = cosine domega outside; one pixel's area across the view sees it
     */
    out->radiance = (1 - out->reflected[axis]) * cosine / (eta * eta * sqrt(inside2)) / camera->pixel_area;
    return true;
}

/* ---- the camera ------------------------------------------------------------------------------------- */

void tracer_camera_init(const struct tracer_scene *scene, struct tracer_camera *out)
{
    const struct io_camera *const io = &scene->view->camera;
    *out = (struct tracer_camera){ .view = *scene->view, .eta = scene->medium.eta };
    out->exit_per_sr = 1 / (TRACER_PI * dipole_fdt_outside(out->eta));
    for (int k = 0; k < 3; k++)
        out->forward[k] = io->target_mm[k] - io->eye_mm[k];
    normalise(out->forward);
    cross(out->forward, io->up, out->right);
    normalise(out->right);
    cross(out->right, out->forward, out->up);
    out->half_height = io->is_orthographic ? 0.5 * io->height_mm : tan(0.5 * io->fov_y_rad);
    out->half_width = out->half_height * io->width_px / io->height_px;
    const double pixel_size = 2 * out->half_height / io->height_px;
    out->pixel_area = pixel_size * pixel_size;
    out->cone_cosine = cos(scene->view->cone_rad);
    out->cone_sine2 = sin(scene->view->cone_rad) * sin(scene->view->cone_rad);
    const bool is_half_space = scene->body.kind == TRACER_HALF_SPACE;
    for (int face = 0; face < TRACER_FACES && scene->view->estimator == TRACER_NEXT_EVENT; face++) {
        if ((!is_half_space || face == TRACER_TOP) &&
            connection_init(out, face, &out->connections[out->connection_count]))
            out->connection_count++;
    }
}
