/* What blockers leave of each light at each pixel, once for all that is lit by it on the screen. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const bool is_lambert =
        plan->technique == RENDER_TECHNIQUE_LAMBERT && plan->has_scattering && !request->is_captured;
    if (!plan->shadows.is_called_for)
        return render_not_called_for("lights' views tell of shadows");
    if (!plan->shadows.of_view)
        return render_not_called_for("no light shines");
    if (!plan->has_specular && !is_lambert)
        return render_not_called_for("pixels are lit by no light directly");
    return render_called_for("pixels are lit by %zu view%s of lights", plan->view_count,
                             plan->view_count == 1 ? "" : "s");
}

static double cost_ms(const struct render_plan *plan)
{
    double ms = 0;
    for (size_t i = 0; i < plan->view_count; i++) {
        if (!plan->views[i].is_repeated)
            ms += render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan)) +
                  render_cost_shadow_points_ms(plan, i, plan->covered_px);
    }
    return ms;
}

static void bind(const struct render_frame *frame)
{
    render_set_light_view(frame->program, frame->request, frame->view);
    render_set_shadow(frame, &frame->plan->camera, frame->plan->width_px);
}

static const struct render_pass passes[] = {
    { .name = "shadow",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .reads = { "position_mm", "normal", "shadow_depth_mm" },
      .reads_if_written = { "avsm_ranges", "avsm_nodes", "avsm_colour", "shadow_taps", "shadow_nearest" },
      .writes = { "shadow" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_shadow = {
    .name = "shadow",
    .source = "volumetric percentage closer soft shadows, Klein et al.",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
