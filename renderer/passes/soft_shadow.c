/* Penumbras of lights with a size: taps that look for what blocks, and as many that filter over what it
 * makes of the light (theory.md T60, T61, T64); and the nearest blocker of blocks of texels, which says
 * where nothing is to be looked for. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (plan->shadows.soft_light_count == 0)
        return render_not_called_for("no light has a size");
    if (!plan->shadows.of_view)
        return render_not_called_for("no light shines");
    return render_called_for("%zu of %zu lights have a size: %d taps", plan->shadows.soft_light_count,
                             plan->lit_count, plan->shadows.tap_count);
}

static double cost_ms(const struct render_plan *plan)
{
    (void)plan;
    return 0.1;
}

static const struct render_pass passes[] = {
    { .name = "shadow_taps",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "shadow_taps" },
      .run = render_shadow_fill_taps },
};

const struct render_effect render_effect_soft_shadow = {
    .name = "soft_shadow",
    .source = "percentage closer soft shadows, Fernando 2005; volumetric, Klein et al.",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};

static struct render_decision decide_nearest(const struct render_request *request,
                                             const struct render_plan *plan)
{
    const struct render_decision soft = decide(request, plan);
    if (soft.is_active && render_plan_shades_maps_alone(plan))
        return render_not_called_for("translucent shadow maps have their own");
    return soft.is_active ? render_called_for("penumbras are not looked for where nothing blocks") : soft;
}

static double cost_nearest_ms(const struct render_plan *plan)
{
    const double texels = (double)plan->shadows.size_px * plan->shadows.size_px;
    return (double)render_plan_shadow_map_count(plan) * render_cost_ms(RENDER_COST_SHADOW_TEXEL, texels);
}

static const struct render_pass nearest_passes[] = {
    { .name = "shadow_nearest",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .reads = { "shadow_depth_mm" },
      .reads_if_written = { "avsm_ranges" },
      .writes = { "shadow_nearest" },
      .bind = render_shadow_bind_nearest },
    { .name = "shadow_reach",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_view = true,
      .reads = { "shadow_nearest" },
      .run = render_shadow_find_nearest },
};

const struct render_effect render_effect_shadow_nearest = {
    .name = "shadow_nearest",
    .source = "the least depth of blocks of texels",
    .decide = decide_nearest,
    .cost_ms = cost_nearest_ms,
    .passes = nearest_passes,
    .pass_count = COUNT(nearest_passes),
};
