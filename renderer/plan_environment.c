/* Light from all around in the plan: what it is, to which order, sampled how finely. */
#include "renderer/environment_visibility.h"
#include "renderer/irradiance_table.h"
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdlib.h>

enum { PEEL_SIDE_MIN = 16, PEEL_SIDE_MAX = 2048 };

const char *const render_environment_samples_names[] = { "surface", "peel", "peel3", NULL };

bool render_plan_check_rays(int ray_count, dipole_status *status)
{
    return (ray_count >= 0 && ray_count <= RENDER_VISIBILITY_RAY_LIMIT) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "ambient visibility is %d rays, expected 0 to %d",
                       ray_count, RENDER_VISIBILITY_RAY_LIMIT);
}

bool render_plan_take_environment(const struct render_request *request, struct render_plan *plan,
                                  dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (!render_plan_check_rays(request->ambient_visibility, status))
        return false;
    if (!scene->has_environment || request->is_captured)
        return true;
    if (!request->environment &&
        !render_environment_read(&scene->environment, &plan->own_environment, status))
        return false;
    plan->environment = request->environment ? request->environment : plan->own_environment;
    if (!render_environment_shines(plan->environment))
        plan->environment = NULL;
    return true;
}

/* Why the technique cannot draw it; NULL when it can. */
static const char *why_not(const struct render_plan *plan)
{
    if (plan->technique == RENDER_TECHNIQUE_TSM)
        return "a translucent shadow map is of one direction: splats draw it";
    return plan->area == RENDER_AREA_OVERLAP ? "areas are counted by views of lights" : NULL;
}

int render_plan_peel_side_px(const struct render_plan *plan, size_t object)
{
    const struct render_plan_object *const planned = &plan->objects[object];
    const double wanted = ceil(2.02 * planned->ball.radius_mm / (RENDER_PEEL_SHARE * planned->spacing_mm));
    return planned->spacing_mm > 0 ? (int)fmin(fmax(wanted, PEEL_SIDE_MIN), PEEL_SIDE_MAX) : 0;
}

static void choose_peel_size(const struct render_request *request, struct render_plan *plan)
{
    plan->peel_axis_count = request->environment_samples == RENDER_ENVIRONMENT_PEEL ? 1 : 3;
    for (size_t i = 0; i < request->scene->object_count; i++) {
        const int side_px = render_plan_peel_side_px(plan, i);
        plan->peel_side_px = side_px > plan->peel_side_px ? side_px : plan->peel_side_px;
    }
    if (plan->peel_side_px == PEEL_SIDE_MAX)
        render_plan_add_note(plan,
                             "peeled layers are limited to %d texels a side: light samples are as far "
                             "apart as those",
                             PEEL_SIDE_MAX);
}

/* What a medium's light adds to what all have to do, and err by. */
static void measure_irradiance(const struct render_irradiance *irradiance, struct render_plan *plan)
{
    double error;
    const int rows = render_irradiance_table_rows(irradiance, plan->irradiance_tolerance, &error);
    const double nodes = (double)render_irradiance_table_nodes(rows);
    plan->irradiance_nodes += nodes;
    plan->irradiance_terms += nodes * (irradiance->order + 1);
    plan->environment_error = fmax(plan->environment_error, irradiance->error + error);
    if (irradiance->order > plan->environment_order)
        plan->environment_order = irradiance->order;
}

bool render_plan_light_from_around(const struct render_request *request, struct render_plan *plan,
                                   dipole_status *status)
{
    if (!plan->environment || !plan->has_scattering)
        return true;
    const char *const idle = why_not(plan);
    if (idle) {
        render_plan_add_note(plan, "the environment is not drawn: %s", idle);
        plan->environment = NULL;
        return true;
    }
    const double share = (RENDER_ENVIRONMENT_SHARE - RENDER_IRRADIANCE_SHARE) * plan->epsilon;
    const double epsilon = request->limits.environment > 0 ? request->limits.environment
                           : request->keeps_negligible     ? 0
                                                           : share;
    plan->irradiance_tolerance = RENDER_IRRADIANCE_SHARE * plan->epsilon;
    plan->irradiance = calloc(plan->media->count, sizeof(struct render_irradiance *));
    if (!plan->irradiance)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the light in %zu media",
                           plan->media->count);
    for (size_t m = 0; m < plan->media->count; m++) {
        const struct render_medium *const medium = &plan->media->media[m];
        if (!plan->of_medium[m].is_visible || !medium->has_scattering)
            continue;
        if (!render_irradiance_create(plan->environment, medium->eta, epsilon, &plan->irradiance[m],
                                      status))
            return false;
        measure_irradiance(plan->irradiance[m], plan);
    }
    plan->has_environment = true;
    plan->visibility_ray_count = request->ambient_visibility;
    const double asked = epsilon + plan->irradiance_tolerance;
    if (plan->environment_error > asked)
        render_plan_add_note(
            plan,
            "the environment is drawn to order %d: what is above adds up to %.2g of its mean, "
            "%.2g were asked",
            plan->environment_order, plan->environment_error, asked);
    if (plan->is_glossy)
        render_plan_add_note(plan, "gloss does not mirror the environment");
    if (render_plan_sums_samples(plan) && request->environment_samples != RENDER_ENVIRONMENT_SURFACE)
        choose_peel_size(request, plan);
    return true;
}

const char *render_plan_dark_reason(const struct render_plan *plan)
{
    return plan->lit_count == 0 && !plan->has_environment ? "no light shines" : NULL;
}

void render_plan_forget_environment(struct render_plan *plan)
{
    for (size_t m = 0; plan->irradiance && m < plan->media->count; m++)
        render_irradiance_destroy(plan->irradiance[m]);
    free(plan->irradiance);
    render_environment_destroy(plan->own_environment);
}
