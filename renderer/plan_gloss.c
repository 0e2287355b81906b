/* Whether light mirrored at surfaces can be seen. theory.md T80. */
#include "renderer/gloss.h"
#include "renderer/plan_internal.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Of epsilon, by squares: with all that gathering spends (theory.md, "Budget") 0.98 in all. */
#define GLOSS_SHARE 0.5

/* Ways from a ball's points: one, and how far others lie about it. */
struct ways {
    double unit[3], spread_rad;
};

static struct ways ways_along(const double direction[3], double sign, double spread_rad)
{
    struct ways ways = { .spread_rad = spread_rad };
    const double length = sqrt(render_dot(direction, direction));
    for (int k = 0; k < 3; k++)
        ways.unit[k] = sign * direction[k] / length;
    return ways;
}

/* To a disc about a place that faces them. */
static struct ways ways_to(const struct render_ball *ball, const double place_mm[3], double disc_mm)
{
    double step_mm[3];
    for (int k = 0; k < 3; k++)
        step_mm[k] = place_mm[k] - ball->centre_mm[k];
    const double distance_mm = sqrt(render_dot(step_mm, step_mm));
    if (!(distance_mm > ball->radius_mm))
        return (struct ways){ .spread_rad = PI };
    return ways_along(step_mm, 1,
                      asin(ball->radius_mm / distance_mm) +
                          atan2(0.5 * disc_mm, distance_mm - ball->radius_mm));
}

static double most_per_sr(const struct render_plan *plan, const struct render_ball *ball,
                          const struct io_light *light, double eta, double roughness)
{
    const struct ways to_light = light->kind == IO_LIGHT_POINT
                                     ? ways_to(ball, light->position_mm, light->size_mm)
                                     : ways_along(light->direction, -1, 0.5 * light->size_rad);
    const struct ways to_eye = plan->camera.is_orthographic ? ways_along(plan->camera.forward, -1, 0)
                                                            : ways_to(ball, plan->camera.eye_mm, 0);
    const double apart_rad = acos(fmin(fmax(render_dot(to_light.unit, to_eye.unit), -1), 1));
    const double spread_rad = to_light.spread_rad + to_eye.spread_rad;
    return render_gloss_most_per_sr(eta, roughness, fmax(apart_rad - spread_rad, 0),
                                    fmin(apart_rad + spread_rad, PI));
}

/* The most that an object mirrors, of what a flat surface of its medium that faces the light sends out: in
 * the brightest channels of either. */
static double gloss_most(const struct io_scene *scene, const struct render_plan *plan, size_t index)
{
    const struct render_medium *const medium = &plan->media->media[plan->objects[index].medium];
    double most = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const struct io_light *const light = &scene->lights[i];
        double brightest = 0, sent_per_sr = 0;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            brightest = fmax(brightest, light->rgb[c]);
            sent_per_sr = fmax(sent_per_sr, light->rgb[c] * medium->diffuse_reflectance[c] / PI);
        }
        const double mirrored_per_sr =
            brightest > 0 ? brightest * most_per_sr(plan, &plan->objects[index].ball, light, medium->eta,
                                                    scene->objects[index].roughness)
                          : 0;
        if (mirrored_per_sr > 0)
            most = fmax(most, mirrored_per_sr / sent_per_sr);
    }
    return most;
}

void render_plan_look_at_gloss(const struct render_request *request, struct render_plan *plan)
{
    const struct io_scene *const scene = request->scene;
    const double negligible =
        request->is_captured || request->keeps_negligible ? 0 : GLOSS_SHARE * plan->epsilon;
    for (size_t i = 0; i < scene->object_count; i++) {
        if (!plan->objects[i].is_visible || !scene->objects[i].has_specular)
            continue;
        plan->is_glossy = true;
        plan->glossy_px += plan->objects[i].pixel_count;
        if (!plan->has_specular)
            plan->gloss_most = fmax(plan->gloss_most, gloss_most(scene, plan, i));
        plan->has_specular = plan->has_specular || plan->gloss_most > negligible;
    }
    plan->glossy_px = fmin(plan->glossy_px, plan->covered_px);
    plan->gloss_error = plan->has_specular ? 0 : plan->gloss_most;
}
