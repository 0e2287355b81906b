/* Scattering that never leaves the spot: radiosity = total reflectance times irradiance that enters. What
 * an opaque material would show, and what is right where r_max is under a pixel. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (request->is_captured)
        return render_not_called_for("captured without scattering");
    if (plan->technique != RENDER_TECHNIQUE_LAMBERT)
        return render_not_called_for("technique is %s: scattered light reaches %.3g pixels",
                                     render_technique_names[plan->technique], plan->r_max_px);
    if (plan->lit_count == 0)
        return render_not_called_for("no light shines");
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (request->technique == RENDER_TECHNIQUE_LAMBERT)
        return render_called_for("asked for");
    return render_called_for("scattered light stays within %.2g pixels", plan->r_max_px);
}

static double cost_ms(const struct render_plan *plan)
{
    return (double)plan->view_count * (render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan)) +
                                       render_cost_ms(RENDER_COST_SHADOW_PIXEL, plan->covered_px));
}

static void bind(const struct render_frame *frame)
{
    render_set_light_view(frame->program, frame->request, frame->view);
    render_set_medium(frame->program, frame->plan);
}

static const struct render_pass passes[] = {
    { .name = "lambert",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .is_added = true,
      .reads = { "position_mm", "normal", "light_view" },
      .reads_if_written = { "object_media", "shadow" },
      .writes = { "radiosity" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_lambert = {
    .name = "lambert",
    .source = "Lambert 1760",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
