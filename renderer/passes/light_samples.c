/* The light's view, reduced to samples no farther apart than the profile's spectrum allows (theory.md T11,
 * T13). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/splat_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static int largest_side_px(const struct render_plan *plan)
{
    int side_px = 0;
    for (size_t i = 0; i < plan->view_count; i++)
        side_px = plan->views[i].size_px > side_px ? plan->views[i].size_px : side_px;
    return side_px;
}

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (plan->lit_count == 0)
        return render_not_called_for("no light shines");
    if (request->is_captured)
        return render_called_for("captured, %.3g mm apart", plan->spacing_mm);
    if (!render_plan_sums_samples(plan))
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (plan->has_grid)
        return render_called_for("uniform grid of up to %d texels a side, %.3g mm apart across the view",
                                 largest_side_px(plan), plan->grid_texel_mm);
    return render_called_for("%.3g mm apart keep aliasing under %.3g", plan->spacing_mm,
                             plan->aliasing_epsilon);
}

static double cost_ms(const struct render_plan *plan)
{
    if (plan->has_light_pictures && !render_plan_keeps_pictures(plan))
        return render_cost_ms(RENDER_COST_PICTURE_TEXEL, render_cost_view_texels(plan)) +
               (double)plan->view_count *
                   render_cost_ms(RENDER_COST_PICTURE_TRIANGLE, (double)plan->triangle_count);
    const double read = plan->has_light_pictures ? 0 : RENDER_COST_READ_TEXEL;
    const double ns_each =
        RENDER_COST_SAMPLED_TEXEL + read + (plan->has_object_ids ? RENDER_COST_TOLD_TEXEL + read : 0) +
        (plan->coherence == RENDER_COHERENCE_SURFACE ? RENDER_COST_CELL_TEXEL + read : 0);
    return render_cost_ms(ns_each, render_cost_view_texels(plan));
}

static double error(const struct render_plan *plan)
{
    return plan->aliasing_error + plan->blur_error;
}

static bool sample(const struct render_frame *frame, dipole_status *status)
{
    struct render_splatter *splatter;
    return render_executor_need_splatter(frame, &splatter, status) &&
           render_splatter_sample_view(splatter, frame, status);
}

static const struct render_pass passes[] = {
    { .name = "light_samples",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_view = true,
      .is_of_samples = true,
      .reads_if_written = { "light_view" },
      .writes = { "light_samples" },
      .run = sample },
};

const struct render_effect render_effect_light_samples = {
    .name = "light_samples",
    .source = "Shah, Konttinen and Pattanaik 2009; spacing by the sampling theorem",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
