/* Objects told apart: by their light samples and by the pixels that show them, each with its own medium. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    return plan->has_object_ids ? render_called_for("%s", plan->ids_reason)
                                : render_not_called_for("%s", plan->ids_reason);
}

static double cost_ms(const struct render_plan *plan)
{
    (void)plan;
    return 0.1;
}

static const struct render_pass passes[] = {
    { .name = "object_media",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "object_media" },
      .run = render_executor_fill_media },
};

const struct render_effect render_effect_object_ids = {
    .name = "object_ids",
    .source = "Shah, Konttinen and Pattanaik 2009",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
