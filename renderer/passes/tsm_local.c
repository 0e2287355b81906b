/* The local response of translucent shadow maps: the peak near where light enters, which no sample of the
 * pattern resolves. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_unsampled_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.part == RENDER_TSM_GLOBAL)
        return render_not_called_for("the global part alone is asked for");
    return render_called_for("%d x %d cells about each fragment", LUT_TSM_LOCAL_SIDE, LUT_TSM_LOCAL_SIDE);
}

/* And the inner samples of the pattern. */
enum { CELLS = LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE + 5 };

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_MAP_CELL, CELLS * render_cost_map_pixels(plan));
}

static void bind(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_tsm_set_response(frame);
}

static const struct render_pass passes[] = {
    { .name = "tsm_local",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .is_added = true,
      .reads = { "position_mm", "tsm_position_mm", "tsm_normal", "tsm_flux", "tsm_pattern", "tsm_form",
                 "tsm_kernel" },
      .reads_if_written = { "tsm_sources" },
      .writes = { "radiosity" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_tsm_local = {
    .name = "tsm_local",
    .source = "Dachsbacher and Stamminger 2003, section 4.2",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
