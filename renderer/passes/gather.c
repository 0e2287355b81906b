/* Subsurface scattering by gathering: what splats sum, scale by scale, over fewer samples and at fewer
 * pixels the wider the profile is (theory.md T14, T21, T43). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/gather_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (request->is_captured)
        return render_not_called_for("captured without scattering");
    if (plan->technique != RENDER_TECHNIQUE_GATHER)
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (render_plan_dark_reason(plan))
        return render_not_called_for("%s", render_plan_dark_reason(plan));
    return render_called_for("scattered light reaches %.3g mm, %.3g pixels, in %d bands", plan->r_max_mm,
                             plan->r_max_px, plan->band_count);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_GATHER_PIXEL, plan->covered_px) +
           render_cost_ms(RENDER_COST_GATHER_EVALUATION, render_cost_gather_evaluations(plan)) +
           render_cost_ms(RENDER_COST_GATHER_SAMPLE, render_cost_samples(plan)) +
           render_cost_ms(RENDER_COST_SCREEN_PIXEL, 4 * render_cost_pixels(plan));
}

static double error(const struct render_plan *plan)
{
    return plan->truncation_error + plan->banding_error + plan->table_error;
}

static bool run(const struct render_frame *frame, dipole_status *status)
{
    struct render_gatherer *gatherer;
    return render_executor_need_gatherer(frame, &gatherer, status) &&
           render_gatherer_run(gatherer, frame, status);
}

static const struct render_pass passes[] = {
    { .name = "gather",
      .draw = RENDER_DRAW_NOTHING,
      .reads = { "position_mm", "light_samples" },
      .writes = { "radiosity" },
      .run = run },
};

const struct render_effect render_effect_gather = {
    .name = "gather",
    .source = "by scale, as d'Eon, Luebke and Enderton 2007 split profiles; clusters by moments, as Barnes "
              "and Hut 1986",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
