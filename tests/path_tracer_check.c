/* The body, and what is refused. */
#include "path_tracer_parts.h"

enum { PIXEL_LIMIT = 1 << 20, RING_LIMIT = 4096 };

void tracer_shape_init(const struct tracer_body *body, struct tracer_shape *out)
{
    *out = (struct tracer_shape){ .is_sphere = body->kind == TRACER_SPHERE, .radius_mm = body->radius_mm };
    for (int k = 0; k < 3; k++) {
        out->centre_mm[k] = body->centre_mm[k];
        const double half_mm = body->kind == TRACER_BOX ? body->half_size_mm[k] : (double)INFINITY;
        out->planes_mm[2 * k] = body->centre_mm[k] - half_mm;
        out->planes_mm[2 * k + 1] = body->centre_mm[k] + half_mm;
    }
    if (body->kind == TRACER_HALF_SPACE)
        out->planes_mm[TRACER_TOP] = body->centre_mm[1];
}

void tracer_normal(const struct tracer_shape *shape, const double p_mm[3], int face, double normal[3])
{
    for (int k = 0; k < 3; k++)
        normal[k] = shape->is_sphere ? (p_mm[k] - shape->centre_mm[k]) / shape->radius_mm : 0;
    if (!shape->is_sphere)
        normal[face / 2] = face % 2 == 1 ? 1 : -1;
}

static bool is_outside(const struct tracer_shape *shape, const double p_mm[3])
{
    double r2 = 0;
    bool is_beyond = false;
    for (int k = 0; k < 3; k++) {
        r2 += (p_mm[k] - shape->centre_mm[k]) * (p_mm[k] - shape->centre_mm[k]);
        is_beyond = is_beyond || p_mm[k] < shape->planes_mm[2 * k] || p_mm[k] > shape->planes_mm[2 * k + 1];
    }
    return shape->is_sphere ? r2 > shape->radius_mm * shape->radius_mm : is_beyond;
}

static const char *find_fault_in_body(const struct tracer_scene *scene)
{
    const struct tracer_body *const body = &scene->body;
    const struct tracer_medium *const medium = &scene->medium;
    if (body->kind == TRACER_SPHERE && !(body->radius_mm > 0 && body->radius_mm < INFINITY))
        return "radius_mm must be above 0";
    for (int k = 0; k < 3 && body->kind == TRACER_BOX; k++)
        if (!(body->half_size_mm[k] > 0 && body->half_size_mm[k] < INFINITY))
            return "half_size_mm must be above 0";
    if (!(medium->sigma_a_per_mm >= 0 && medium->sigma_a_per_mm < INFINITY && medium->sigma_s_per_mm >= 0 &&
          medium->sigma_s_per_mm < INFINITY))
        return "sigma_a and sigma_s must be 0 or above";
    if (body->kind == TRACER_HALF_SPACE && medium->sigma_a_per_mm == 0)
        return "sigma_a of a half-space must be above 0: without, walks have no end";
    if (!(fabs(medium->g) < 1))
        return "g must be between -1 and 1";
    if (!(medium->eta >= DIPOLE_ETA_MIN && medium->eta <= DIPOLE_ETA_MAX))
        return "eta must be 0.1 to 10";
    return NULL;
}

static const char *find_fault_in_light(const struct tracer_scene *scene, const struct tracer_shape *shape)
{
    const struct tracer_light *const light = &scene->light;
    if (!(light->strength > 0 && light->strength < INFINITY))
        return "the light's strength must be above 0";
    if (light->kind != TRACER_POINT && !(tracer_dot(light->direction, light->direction) > 0))
        return "the light's direction must not be 0";
    if (light->kind != TRACER_DIRECTIONAL && !is_outside(shape, light->position_mm))
        return "the light must be outside the body";
    struct tracer_lamp lamp;
    double p_mm[3];
    int face;
    tracer_lamp_init(light, &lamp);
    if (light->kind == TRACER_PENCIL &&
        !tracer_meet(shape, light->position_mm, lamp.light.direction, p_mm, &face))
        return "the pencil must meet the body";
    if (scene->body.kind == TRACER_HALF_SPACE && light->kind != TRACER_PENCIL)
        return "a half-space is lit by a pencil only";
    return NULL;
}

static const char *find_fault_in_view(const struct tracer_view *view, const struct tracer_shape *shape)
{
    const struct io_camera *const camera = &view->camera;
    if (camera->width_px < 1 || camera->height_px < 1 || camera->width_px > PIXEL_LIMIT / camera->height_px)
        return "the picture must have 1 to 2^20 pixels";
    if (!(camera->is_orthographic ? camera->height_mm > 0
                                  : camera->fov_y_rad > 0 && camera->fov_y_rad < TRACER_PI))
        return "the camera must have a height or an angle above 0";
    if (!camera->is_orthographic && !is_outside(shape, camera->eye_mm))
        return "the eye must be outside the body";
    if (view->estimator == TRACER_ANGLE && !(view->cone_rad > 0 && view->cone_rad <= 0.5))
        return "cone_rad must be above 0 and up to 0.5";
    if (view->estimator == TRACER_NEXT_EVENT && (shape->is_sphere || !camera->is_orthographic))
        return "next events need flat faces and an orthographic camera";
    return NULL;
}

static const char *find_fault_in_rings(const struct tracer_scene *scene, const struct tracer_rings *rings)
{
    if (scene->body.kind == TRACER_SPHERE || scene->light.kind != TRACER_PENCIL)
        return "rings need flat faces and a pencil";
    if (rings->count < 1 || rings->count > RING_LIMIT || !(rings->edges_mm[0] >= 0))
        return "there must be 1 to 4096 rings, from 0 on";
    for (size_t i = 0; i < rings->count; i++)
        if (!(rings->edges_mm[i] < rings->edges_mm[i + 1]))
            return "edges_mm must ascend";
    return NULL;
}

const char *tracer_find_fault(const struct tracer_scene *scene, const struct tracer_run *run,
                              const struct tracer_rings *rings)
{
    struct tracer_shape shape;
    tracer_shape_init(&scene->body, &shape);
    const char *fault = find_fault_in_body(scene);
    if (fault == NULL)
        fault = find_fault_in_light(scene, &shape);
    if (fault == NULL && scene->view != NULL)
        fault = find_fault_in_view(scene->view, &shape);
    if (fault == NULL && rings != NULL)
        fault = find_fault_in_rings(scene, rings);
    if (fault == NULL && (run->photon_count < 1 || run->photon_count > 1000000000000))
        fault = "photon_count must be 1 to 10^12";
    return fault;
}
