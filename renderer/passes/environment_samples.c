/* Light samples over the whole surface, from the triangles themselves (theory.md T53). */
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
    if (request->environment_samples != RENDER_ENVIRONMENT_SURFACE)
        return render_not_called_for("%s is asked for",
                                     render_environment_samples_names[request->environment_samples]);
    return render_called_for("all of the surface is lit, %.3g mm apart", plan->spacing_mm);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_sky_samples_ms(plan);
}

static const struct render_pass passes[] = {
    { .name = "environment_samples",
      .draw = RENDER_DRAW_NOTHING,
      .reads = { "environment_irradiance" },
      .writes = { "light_samples" },
      .run = render_sky_sample },
};

const struct render_effect render_effect_environment_samples = {
    .name = "environment_samples",
    .source = "patches of the triangles; spacing by the sampling theorem",
    .decide = decide,
    .cost_ms = cost_ms,
    .is_kept = true,
    .passes = passes,
    .pass_count = COUNT(passes),
};
