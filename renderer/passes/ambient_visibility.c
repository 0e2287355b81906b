/* What hides the environment from the surface: rays from each of its light samples (theory.md T53). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/environment_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (!plan->has_environment)
        return render_not_called_for("no environment is drawn");
    if (!render_plan_sums_samples(plan))
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (request->ambient_visibility == 0)
        return render_not_called_for("not asked for: nothing stands in the environment's way; the error of "
                                     "that is not bounded; 64 rays would take %.3g ms",
                                     render_cost_rays_ms(plan, 64));
    return render_called_for("%d rays from each light sample, about %.3g ms of the samples' time",
                             request->ambient_visibility,
                             render_cost_rays_ms(plan, request->ambient_visibility));
}

/* The tree; rays are traced where samples are made. */
static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_TREE_TRIANGLE, (double)plan->triangle_count);
}

static const struct render_pass passes[] = {
    { .name = "ambient_visibility",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "environment_tree" },
      .run = render_sky_plant },
};

const struct render_effect render_effect_ambient_visibility = {
    .name = "ambient_visibility",
    .source = "ambient occlusion, Zhukov et al. 1998, weighted by the light that is hidden",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
