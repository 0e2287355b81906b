/* Light samples over the whole surface as the paper finds them: layers of front and back faces in turn,
 * seen along one axis, or along all three with each facet taken from the axis that it faces most (theory.md
 * T53). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/environment_draw.h"

#include <math.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (!plan->has_environment)
        return render_not_called_for("no environment is drawn");
    if (!render_plan_sums_samples(plan))
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (request->environment_samples == RENDER_ENVIRONMENT_SURFACE)
        return render_not_called_for("not asked for: triangles are sampled instead");
    return render_called_for("asked for: layers of up to %d texels a side along %s", plan->peel_side_px,
                             request->environment_samples == RENDER_ENVIRONMENT_PEEL ? "y" : "x, y and z");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_sky_peel_ms(plan);
}

/* Nothing bounds what surfaces along the one axis are missed. */
static double error(const struct render_plan *plan)
{
    (void)plan;
    return INFINITY;
}

static const struct render_pass passes[] = {
    { .name = "environment_peel",
      .draw = RENDER_DRAW_BY_RUN,
      .reads = { "environment_irradiance" },
      .writes = { "peel_position_mm", "peel_normal", "light_samples" },
      .depth_written = "peel_depth",
      .run = render_sky_peel },
};

const struct render_effect render_effect_environment_peel = {
    .name = "environment_peel",
    .source = "Shah, Konttinen and Pattanaik 2009; depth peeling, Everitt 2001",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
