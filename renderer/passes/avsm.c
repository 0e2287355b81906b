/* Transmittance along the light in each texel, of blockers that let light through: lists of all their
 * surfaces, sorted and compressed (theory.md T62 to T65); one curve, or one for each channel. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#include <limits.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const struct render_plan_shadows *const shadows = &plan->shadows;
    (void)request;
    if (shadows->translucent_count == 0)
        return render_not_called_for(shadows->blocker_count > 0 ? "all blockers are opaque"
                                                                : "nothing but objects blocks");
    if (!shadows->of_view)
        return render_not_called_for("no light shines");
    if (shadows->node_limit == INT_MAX)
        return render_called_for("%zu of %zu blockers let light through; all nodes are kept",
                                 shadows->translucent_count, shadows->blocker_count);
    return render_called_for("%zu of %zu blockers let light through; %d nodes", shadows->translucent_count,
                             shadows->blocker_count, shadows->node_limit);
}

/* Four surfaces in each texel, of half the map. */
static double cost_ms(const struct render_plan *plan)
{
    const double texels = (double)plan->shadows.size_px * plan->shadows.size_px;
    return RENDER_COST_PROGRAM_MS +
           (double)plan->view_count *
               render_cost_ms(1, RENDER_COST_TRIANGLE * (double)plan->shadows.triangle_count +
                                     RENDER_COST_BLOCKER_SURFACE * 2 * texels +
                                     RENDER_COST_VIEW_TEXEL * texels);
}

static const struct render_pass passes[] = {
    { .name = "avsm",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_view = true,
      .writes = { "avsm_ranges", "avsm_nodes" },
      .run = render_shadow_make_curves },
};

const struct render_effect render_effect_avsm = {
    .name = "avsm",
    .source = "adaptive volumetric shadow maps, Salvi et al. 2010; Klein et al.",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};

static struct render_decision decide_colour(const struct render_request *request,
                                            const struct render_plan *plan)
{
    (void)request;
    if (plan->shadows.coloured_count == 0)
        return render_not_called_for(plan->shadows.translucent_count > 0 ? "no blocker's channels differ"
                                                                         : "no blocker lets light through");
    if (!plan->shadows.of_view)
        return render_not_called_for("no light shines");
    return render_called_for("channels of %zu of %zu blockers differ", plan->shadows.coloured_count,
                             plan->shadows.blocker_count);
}

static double cost_colour_ms(const struct render_plan *plan)
{
    (void)plan;
    return 0.1;
}

static const struct render_pass colour_passes[] = {
    { .name = "avsm_colour",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "avsm_colour" },
      .run = render_shadow_mark_colour },
};

const struct render_effect render_effect_avsm_colour = {
    .name = "avsm_colour",
    .source = "a curve and a replacement depth for each channel",
    .decide = decide_colour,
    .cost_ms = cost_colour_ms,
    .passes = colour_passes,
    .pass_count = COUNT(colour_passes),
};
