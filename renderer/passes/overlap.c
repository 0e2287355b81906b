/* Subsurface scattering with areas as the paper counts them: the disc that a splat covers, over the number
 * of samples whose discs overlap at a pixel. For comparison with the flux of passes/splat.c. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/splat_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (plan->area != RENDER_AREA_OVERLAP)
        return render_not_called_for("areas follow from the flux");
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (plan->lit_count == 0)
        return render_not_called_for("no light shines");
    return render_called_for("asked for; %zu view%s counted one by one", plan->view_count,
                             plan->view_count == 1 ? "" : "s");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_splats_ms(plan);
}

/* Samples of other views have counters of their own. */
static bool draw(const struct render_frame *frame, dipole_status *status)
{
    struct render_splatter *splatter;
    if (!render_executor_need_splatter(frame, &splatter, status) ||
        !render_splatter_draw(splatter, frame, status))
        return false;
    render_splatter_drop_samples(splatter);
    return true;
}

static void bind_resolve(const struct render_frame *frame)
{
    render_set_float(frame->program, "r_max_mm", frame->plan->of_medium[0].r_max_mm);
}

static const struct render_pass passes[] = {
    { .name = "splat", /* each of whose samples adds 1 to alpha */
      .draw = RENDER_DRAW_BY_RUN,
      .is_per_view = true,
      .is_blended = true,
      .reads = { "position_mm", "light_samples" },
      .reads_if_written = { "object_media" },
      .writes = { "overlap_sum" },
      .depth_tested = "position_depth",
      .run = draw },
    { .name = "overlap",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .is_added = true,
      .reads = { "overlap_sum", "position_mm" },
      .reads_if_written = { "object_media" },
      .writes = { "radiosity" },
      .bind = bind_resolve },
};

const struct render_effect render_effect_overlap = {
    .name = "overlap",
    .source = "Shah, Konttinen and Pattanaik 2009, equation 4",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
