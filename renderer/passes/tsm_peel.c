/* Surfaces behind each other as a light meets them: they tell material from air, in a bowl or between
 * strands of a knot. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.layer_count == 0)
        return render_not_called_for("not asked for: what lies between two points counts as solid");
    if (request->tsm.part == RENDER_TSM_LOCAL)
        return render_not_called_for("the local response does not look for air");
    return render_called_for("%d layers are asked for", request->tsm.layer_count);
}

static double cost_ms(const struct render_plan *plan)
{
    return plan->tsm.layer_count *
           ((double)plan->map_count * render_cost_ms(RENDER_COST_TRIANGLE, (double)plan->triangle_count) +
            render_cost_ms(RENDER_COST_LIT_TEXEL, render_cost_map_texels(plan)));
}

static const struct render_pass passes[] = {
    { .name = "tsm_peel",
      .draw = RENDER_DRAW_BY_RUN,
      .is_per_map = true,
      .writes = { "tsm_layers" },
      .depth_written = "tsm_depth",
      .bind = render_tsm_set_map,
      .run = render_tsm_peel },
};

const struct render_effect render_effect_tsm_peel = {
    .name = "tsm_peel",
    .source = "depth peeling, Everitt 2001",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
