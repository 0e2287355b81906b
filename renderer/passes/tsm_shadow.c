/* Translucent shadow maps of light that blockers, other objects and the light's size leave: what opaque
 * surfaces and blockers are about each map, the part of the light that comes to blocks of its texels, and
 * the flux that enters, times that. theory.md T72. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/shadow_draw.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (!plan->shadows.of_map)
        return render_not_called_for("no blocker, no spot, no light has a size: maps see what hides what");
    return render_called_for("%zu map%s, each with a shadow map of its own, in blocks of %d x %d texels",
                             plan->map_count, plan->map_count == 1 ? "" : "s", RENDER_MAP_BLOCK,
                             RENDER_MAP_BLOCK);
}

static double texels(const struct render_plan *plan)
{
    return (double)plan->shadows.size_px * plan->shadows.size_px * (double)plan->map_count;
}

static double cost_map_ms(const struct render_plan *plan)
{
    const double triangles = (double)(plan->triangle_count + plan->shadows.triangle_count);
    return (double)plan->map_count * render_cost_ms(RENDER_COST_TRIANGLE, triangles) +
           render_cost_ms(RENDER_COST_SHADOW_TEXEL, texels(plan));
}

static const struct render_pass map_passes[] = {
    { .name = "shadow_map",
      .draw = RENDER_DRAW_BY_RUN,
      .is_per_map = true,
      .writes = { "shadow_depth_mm" },
      .depth_written = "shadow_order",
      .bind = render_shadow_bind_map,
      .run = render_shadow_draw_map },
};

const struct render_effect render_effect_tsm_shadow_map = {
    .name = "tsm_shadow_map",
    .source = "Williams 1978",
    .decide = decide,
    .cost_ms = cost_map_ms,
    .passes = map_passes,
    .pass_count = COUNT(map_passes),
};

static struct render_decision decide_avsm(const struct render_request *request,
                                          const struct render_plan *plan)
{
    const struct render_decision map = decide(request, plan);
    if (!map.is_active)
        return map;
    if (plan->shadows.translucent_count == 0)
        return render_not_called_for("nothing lets light through");
    return render_called_for("%zu blockers and objects let light through", plan->shadows.translucent_count);
}

static double cost_avsm_ms(const struct render_plan *plan)
{
    double surface_count = 0;
    for (size_t i = 0; i < plan->map_count; i++)
        surface_count += plan->shadows.of_map[i].surface_count;
    return (double)plan->map_count *
               render_cost_ms(RENDER_COST_BLOCKER_TRIANGLE, (double)plan->shadows.triangle_count) +
           render_cost_ms(RENDER_COST_BLOCKER_SURFACE, surface_count) +
           render_cost_ms(RENDER_COST_CURVE_TEXEL, texels(plan));
}

static const struct render_pass avsm_passes[] = {
    { .name = "avsm",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_map = true,
      .writes = { "avsm_ranges", "avsm_nodes" },
      .run = render_shadow_make_curves },
};

const struct render_effect render_effect_tsm_avsm = {
    .name = "tsm_avsm",
    .source = "adaptive volumetric shadow maps, Salvi et al. 2010; Klein et al.",
    .decide = decide_avsm,
    .cost_ms = cost_avsm_ms,
    .passes = avsm_passes,
    .pass_count = COUNT(avsm_passes),
};

static struct render_decision decide_nearest(const struct render_request *request,
                                             const struct render_plan *plan)
{
    const struct render_decision map = decide(request, plan);
    if (!map.is_active)
        return map;
    if (plan->shadows.soft_light_count == 0)
        return render_not_called_for("no light has a size");
    return render_called_for("penumbras are not looked for where nothing blocks");
}

static double cost_nearest_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SCREEN_PIXEL, texels(plan));
}

static const struct render_pass nearest_passes[] = {
    { .name = "shadow_nearest",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .reads = { "shadow_depth_mm" },
      .reads_if_written = { "avsm_ranges" },
      .writes = { "shadow_nearest" } },
    { .name = "shadow_reach",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_map = true,
      .reads = { "shadow_nearest" },
      .run = render_shadow_find_nearest },
};

const struct render_effect render_effect_tsm_shadow_nearest = {
    .name = "tsm_shadow_nearest",
    .source = "the least depth of blocks of texels",
    .decide = decide_nearest,
    .cost_ms = cost_nearest_ms,
    .passes = nearest_passes,
    .pass_count = COUNT(nearest_passes),
};

static double cost_ms(const struct render_plan *plan)
{
    const double taps = plan->shadows.soft_light_count > 0 ? 2.0 * plan->shadows.tap_count : 16;
    const double per_block = RENDER_COST_SCREEN_PIXEL + RENDER_COST_SHADOW_TAP * taps;
    return render_cost_ms(per_block / (RENDER_MAP_BLOCK * RENDER_MAP_BLOCK) + RENDER_COST_SCREEN_PIXEL,
                          render_cost_map_texels(plan));
}

static void bind(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_set_int(frame->program, "tsm_block_px", RENDER_MAP_BLOCK);
    render_set_shadow(frame, &frame->view->projection, (double)frame->view->size_px / RENDER_MAP_BLOCK);
}

/* The target is multiplied by what is drawn. */
static void bind_shade(const struct render_frame *frame)
{
    render_set_int(frame->program, "tsm_block_px", RENDER_MAP_BLOCK);
    glBlendFunc(GL_DST_COLOR, GL_ZERO);
}

static const struct render_pass passes[] = {
    { .name = "tsm_shadow",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .reads = { "tsm_position_mm", "tsm_normal", "shadow_depth_mm" },
      .reads_if_written = { "avsm_ranges", "avsm_nodes", "avsm_colour", "shadow_taps", "shadow_nearest" },
      .writes = { "tsm_shadow" },
      .bind = bind },
    { .name = "tsm_shade",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .is_added = true,
      .reads = { "tsm_shadow" },
      .writes = { "tsm_flux" },
      .bind = bind_shade },
};

const struct render_effect render_effect_tsm_shadow = {
    .name = "tsm_shadow",
    .source = "volumetric percentage closer soft shadows, Klein et al.",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
