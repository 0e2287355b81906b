/* Shadows of blockers and of lights with a size: opaque surfaces as a light sees them. Without such,
 * shadows are those of the lights' views. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const struct render_plan_shadows *const shadows = &plan->shadows;
    (void)request;
    if (!shadows->is_called_for)
        return render_not_called_for("no blocker, no spot, and no light has a size: lights' views do");
    if (!shadows->of_view)
        return render_not_called_for("no light shines");
    return render_called_for("%zu blocker%s, %zu light%s with a size, %zu spot%s: %d texels a side",
                             shadows->blocker_count, shadows->blocker_count == 1 ? "" : "s",
                             shadows->soft_light_count, shadows->soft_light_count == 1 ? "" : "s",
                             shadows->spot_count, shadows->spot_count == 1 ? "" : "s", shadows->size_px);
}

static double cost_ms(const struct render_plan *plan)
{
    const double texels = (double)plan->shadows.size_px * plan->shadows.size_px;
    const double triangles = (double)(plan->triangle_count + plan->shadows.triangle_count);
    return RENDER_COST_PROGRAM_MS +
           (double)plan->view_count *
               render_cost_ms(1, RENDER_COST_TRIANGLE * triangles + RENDER_COST_VIEW_TEXEL * texels);
}

static const struct render_pass passes[] = {
    { .name = "shadow_map",
      .draw = RENDER_DRAW_BY_RUN,
      .is_per_view = true,
      .writes = { "shadow_depth_mm" },
      .depth_written = "shadow_order",
      .bind = render_shadow_bind_map,
      .run = render_shadow_draw_map },
};

const struct render_effect render_effect_shadow_map = {
    .name = "shadow_map",
    .source = "Williams 1978",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
