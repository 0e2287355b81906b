/* Subsurface scattering by gathering: what splats sum, scale by scale, over fewer samples and at fewer
 * pixels the wider the profile is (theory.md T14, T21, T43). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/gather_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

struct render_decision render_decide_gather(const struct render_request *request,
                                            const struct render_plan *plan)
{
    if (request->is_captured)
        return render_not_called_for("captured without scattering");
    if (plan->technique != RENDER_TECHNIQUE_GATHER)
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (render_plan_dark_reason(plan))
        return render_not_called_for("%s", render_plan_dark_reason(plan));
    return render_called_for("reaches %.3g mm, %.3g pixels, in %d bands (%s)", plan->r_max_mm,
                             plan->r_max_px, plan->band_count, plan->gather_reason);
}

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (plan->gather != RENDER_GATHER_C)
        return render_not_called_for("gathered by OpenGL (%s)", plan->gather_reason);
    return render_decide_gather(request, plan);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_gather_ms(plan, RENDER_GATHER_C, plan->has_gpu);
}

double render_gather_error(const struct render_plan *plan)
{
    return plan->truncation_error + plan->banding_error + plan->table_error;
}

bool render_run_gather(const struct render_frame *frame, dipole_status *status)
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
      .run = render_run_gather },
};

const struct render_effect render_effect_gather = {
    .name = "gather",
    .source = "by scale, as d'Eon, Luebke and Enderton 2007 split profiles; clusters by moments, as Barnes "
              "and Hut 1986",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = render_gather_error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
