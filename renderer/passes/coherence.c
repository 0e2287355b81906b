/* Light samples that do not flicker as objects or lights move (theory.md T57): passes of light_view and
 * light_samples do it. */
#include "renderer/cost.h"
#include "renderer/effects.h"

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const int frame_count = request->scene->frames.count;
    if (frame_count <= 1)
        return render_not_called_for("one frame");
    if (request->coherence == RENDER_COHERENCE_NONE)
        return render_not_called_for("not asked for");
    if (plan->coherence == RENDER_COHERENCE_TWO_PASS)
        return render_called_for("%d frames: each view is sampled twice, half a block apart", frame_count);
    if (plan->coherence == RENDER_COHERENCE_SURFACE)
        return render_called_for("%d frames: samples stay where they are on the surface", frame_count);
    return render_not_called_for("no light samples move");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SAMPLED_TEXEL, render_cost_view_texels(plan));
}

const struct render_effect render_effect_coherence = {
    .name = "coherence",
    .source = "samples fixed to the surface; two-pass: two views half a block apart, our reading of "
              "\"two-pass sampling\" in Shah, Konttinen and Pattanaik 2009",
    .decide = decide,
    .cost_ms = cost_ms,
};
