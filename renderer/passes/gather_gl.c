/* The same as gather, by shaders: for machines whose OpenGL has a processor of its own (theory.md T43). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/gather_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (plan->technique == RENDER_TECHNIQUE_GATHER && plan->gather != RENDER_GATHER_GL)
        return render_not_called_for("gathered in C (%s)", plan->gather_reason);
    return render_decide_gather(request, plan);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_gather_ms(plan, RENDER_GATHER_GL, plan->has_gpu);
}

static const struct render_pass passes[] = {
    { .name = "gather_gl",
      .draw = RENDER_DRAW_BY_RUN,
      .reads = { "position_mm", "light_samples" },
      .writes = { "radiosity" },
      .run = render_run_gather },
};

const struct render_effect render_effect_gather_gl = {
    .name = "gather_gl",
    .source = "as gather",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = render_gather_error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
