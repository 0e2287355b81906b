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
        return render_not_called_for("no blocker, no spot, no light has a size: lights' views do%s%s",
                                     shadows->casters.opaque_reason[0] ? "; " : "",
                                     shadows->casters.opaque_reason);
    if (!shadows->of_view)
        return render_not_called_for("no light shines");
    if (render_plan_shades_maps_alone(plan))
        return render_not_called_for("translucent shadow maps have their own");
    return render_called_for(
        "%zu blocker%s, %zu object%s that let light through, %zu light%s with a size, %zu "
        "spot%s: %d texels a side",
        shadows->blocker_count, shadows->blocker_count == 1 ? "" : "s", shadows->object_count,
        shadows->object_count == 1 ? "" : "s", shadows->soft_light_count,
        shadows->soft_light_count == 1 ? "" : "s", shadows->spot_count, shadows->spot_count == 1 ? "" : "s",
        shadows->size_px);
}

static double cost_ms(const struct render_plan *plan)
{
    const double texels = (double)plan->shadows.size_px * plan->shadows.size_px;
    return (double)render_plan_shadow_map_count(plan) *
           render_cost_ms(1,
                          RENDER_COST_TRIANGLE * (double)plan->triangle_count +
                              RENDER_COST_BLOCKER_TRIANGLE * (double)plan->shadows.opaque_triangle_count +
                              RENDER_COST_SHADOW_TEXEL * texels);
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
