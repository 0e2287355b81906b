/* What blockers leave of the light that enters what scatters: in blocks of texels of each light's view,
 * from which light samples are made. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#include <math.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (!plan->shadows.is_called_for)
        return render_not_called_for("light that lights' views see enters");
    if (!plan->shadows.of_view)
        return render_not_called_for("no light shines");
    if (!request->is_captured && (!render_plan_sums_samples(plan) || !plan->has_scattering))
        return render_not_called_for("no light samples are taken");
    return render_called_for("light samples are taken of %zu view%s", plan->view_count,
                             plan->view_count == 1 ? "" : "s");
}

static double cost_ms(const struct render_plan *plan)
{
    const double block_px = render_plan_shadow_block_px(plan);
    double ms = 0;
    for (size_t i = 0; i < plan->view_count; i++) {
        const double side = plan->views[i].size_px / block_px;
        ms += render_cost_ms(RENDER_COST_SHADOW_BLOCK, side * side) +
              render_cost_shadow_points_ms(plan, i, side * side);
    }
    return ms;
}

static void bind(const struct render_frame *frame)
{
    render_set_light_view(frame->program, frame->request, frame->view);
    render_set_int(frame->program, "light_block_px", render_plan_shadow_block_px(frame->plan));
    render_set_shadow(frame, &frame->view->projection,
                      (double)frame->view->size_px / render_plan_shadow_block_px(frame->plan));
}

static const struct render_pass passes[] = {
    { .name = "light_shadow",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .is_of_samples = true,
      .reads = { "light_view", "shadow_depth_mm" },
      .reads_if_written = { "avsm_ranges", "avsm_nodes", "avsm_colour", "shadow_taps", "shadow_nearest" },
      .writes = { "light_shadow" },
      .bind = bind },
};

const struct render_effect render_effect_light_shadow = {
    .name = "light_shadow",
    .source = "volumetric percentage closer soft shadows, Klein et al.",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
