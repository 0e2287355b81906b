/* Transmittance along the light in each texel, of blockers that let light through: lists of all their
 * surfaces, sorted and compressed (theory.md T62 to T65); one curve, or one for each channel. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#include <limits.h>
#include <stdio.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const struct render_plan_shadows *const shadows = &plan->shadows;
    (void)request;
    if (shadows->translucent_count == 0)
        return render_not_called_for(
            "%s%s%s", shadows->blocker_count > 0 ? "all blockers are opaque" : "nothing but objects blocks",
            shadows->casters.opaque_reason[0] ? ": " : "", shadows->casters.opaque_reason);
    if (!shadows->of_view)
        return render_not_called_for("no light shines");
    if (render_plan_shades_maps_alone(plan))
        return render_not_called_for("translucent shadow maps have their own");
    char nodes[32] = "all nodes are kept", objects[64] = "";
    if (shadows->node_limit < INT_MAX)
        snprintf(nodes, sizeof nodes, "%d nodes", shadows->node_limit);
    if (shadows->object_count > 0)
        snprintf(objects, sizeof objects, ", %zu object%s up to %.2g of it", shadows->object_count,
                 shadows->object_count == 1 ? "" : "s", shadows->casters.most_left);
    return render_called_for("%zu of %zu blockers let light through%s; %s",
                             shadows->translucent_count - shadows->object_count, shadows->blocker_count,
                             objects, nodes);
}

static double cost_ms(const struct render_plan *plan)
{
    const struct render_plan_shadows *const shadows = &plan->shadows;
    const double texels = (double)shadows->size_px * shadows->size_px;
    double ms = 0;
    for (size_t i = 0; i < plan->view_count; i++) {
        if (!plan->views[i].is_repeated)
            ms +=
                render_cost_ms(1, RENDER_COST_BLOCKER_TRIANGLE * (double)(shadows->triangle_count -
                                                                          shadows->opaque_triangle_count) +
                                      RENDER_COST_BLOCKER_SURFACE * shadows->of_view[i].surface_count +
                                      RENDER_COST_CURVE_TEXEL * texels);
    }
    return ms;
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
    return render_called_for("channels of %zu of %zu blockers and objects differ",
                             plan->shadows.coloured_count,
                             plan->shadows.blocker_count + plan->shadows.object_count);
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
