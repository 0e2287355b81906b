/* The global response of translucent shadow maps: light through the volume, from the samples of the
 * pattern. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#include <math.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_unsampled_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.gather == RENDER_TSM_VERTEX)
        return render_not_called_for("gathered at vertices");
    if (request->tsm.part == RENDER_TSM_LOCAL)
        return render_not_called_for("the local part alone is asked for");
    return render_called_for("at each fragment; what the samples miss is not bounded");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_map_samples_ms(plan, render_cost_map_pixels(plan));
}

/* Nothing bounds what so few samples make of an arbitrary shape. */
static double error(const struct render_plan *plan)
{
    (void)plan;
    return INFINITY;
}

static void bind(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_tsm_set_response(frame);
}

static const struct render_pass passes[] = {
    { .name = "tsm_global",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .is_added = true,
      .reads = { "position_mm", "tsm_position_mm", "tsm_normal", "tsm_flux", "tsm_volume", "tsm_pattern",
                 "tsm_form" },
      .reads_if_written = { "tsm_sources", "tsm_factors", "tsm_layers" },
      .writes = { "radiosity" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_tsm_global = {
    .name = "tsm_global",
    .source = "Dachsbacher and Stamminger 2003, section 4",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
