/* Subsurface scattering: every light sample adds flux times R_d(distance) to the pixels within r_max of it
 * (theory.md T14). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/splat_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (request->is_captured)
        return render_not_called_for("captured without scattering");
    if (plan->technique != RENDER_TECHNIQUE_SPLAT)
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (plan->area != RENDER_AREA_FLUX)
        return render_not_called_for("areas are counted: overlap");
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (render_plan_dark_reason(plan))
        return render_not_called_for("%s", render_plan_dark_reason(plan));
    if (plan->has_grid)
        return render_called_for(
            "one splat for each lit texel of a uniform grid, in one band: %.3g mm, %.3g pixels",
            plan->r_max_mm, plan->r_max_px);
    return render_called_for("scattered light reaches %.3g mm, %.3g pixels", plan->r_max_mm,
                             plan->r_max_px);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_splats_ms(plan);
}

static double error(const struct render_plan *plan)
{
    return plan->truncation_error + plan->banding_error + plan->table_error;
}

static bool draw(const struct render_frame *frame, dipole_status *status)
{
    struct render_splatter *splatter;
    return render_executor_need_splatter(frame, &splatter, status) &&
           render_splatter_draw(splatter, frame, status);
}

static const struct render_pass passes[] = {
    { .name = "splat",
      .draw = RENDER_DRAW_BY_RUN,
      .is_added = true,
      .reads = { "position_mm", "light_samples" },
      .reads_if_written = { "object_media" },
      .writes = { "radiosity" },
      .depth_tested = "position_depth",
      .run = draw },
};

const struct render_effect render_effect_splat = {
    .name = "splat",
    .source = "Shah, Konttinen and Pattanaik 2009",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
