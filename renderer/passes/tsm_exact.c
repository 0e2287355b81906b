/* The sources of a map's medium in place of its volume: what is left is not the table's error. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.response == RENDER_TSM_TABLE)
        return render_not_called_for("the response is looked up in a table");
    return render_called_for("response \"%s\" is asked for",
                             render_tsm_response_names[request->tsm.response]);
}

/* Of a volume, or of factors and sources: baked and uploaded. */
#define BAKE_MS 15.0

static double cost_ms(const struct render_plan *plan)
{
    return BAKE_MS * (double)plan->media->count;
}

static const struct render_pass passes[] = {
    { .name = "tsm_exact",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_map = true,
      .writes = { "tsm_sources", "tsm_factors" },
      .run = render_tsm_use_sources },
};

const struct render_effect render_effect_tsm_exact = {
    .name = "tsm_exact",
    .source = "sources of the model, theory.md T30",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
