/* Tables that translucent shadow maps are looked up in: the volume of a map's medium, and where to sample.
 */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_unsampled_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.response == RENDER_TSM_EXACT)
        return render_called_for("for the places of the samples");
    return render_called_for("volumes are within %.2g of the response", plan->table_error);
}

/* Volumes are uploaded once, and kept. */
#define UPLOAD_MS 2.0

static double cost_ms(const struct render_plan *plan)
{
    (void)plan;
    return 0;
}

static double error(const struct render_plan *plan)
{
    return plan->table_error;
}

static const struct render_pass passes[] = {
    { .name = "tsm_table",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_map = true,
      .writes = { "tsm_volume", "tsm_pattern", "tsm_form", "tsm_kernel" },
      .run = render_tsm_use_volume },
};

const struct render_effect render_effect_tsm_table = {
    .name = "tsm_table",
    .source = "Dachsbacher and Stamminger 2003; volumes by lutgen",
    .decide = decide,
    .cost_ms = cost_ms,
    .start_ms = UPLOAD_MS,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
