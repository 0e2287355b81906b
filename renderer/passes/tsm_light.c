/* Translucent shadow maps: what a light sees of one object, and the flux that enters there. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    return render_called_for("%zu map%s of lights and visible objects, up to %d texels a side",
                             plan->map_count, plan->map_count == 1 ? "" : "s",
                             render_plan_map_side_px(plan));
}

static double cost_ms(const struct render_plan *plan)
{
    return (double)plan->map_count * render_cost_ms(RENDER_COST_TRIANGLE, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_MAP_TEXEL, render_cost_map_texels(plan));
}

static void bind(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_set_vec3(frame->program, "light_rgb", frame->request->scene->lights[frame->view->light].rgb);
}

static const struct render_pass passes[] = {
    { .name = "tsm_light",
      .draw = RENDER_DRAW_SCENE,
      .is_per_map = true,
      .writes = { "tsm_position_mm", "tsm_normal", "tsm_flux" },
      .depth_written = "tsm_depth",
      .bind = bind },
};

const struct render_effect render_effect_tsm_light = {
    .name = "tsm_light",
    .source = "Dachsbacher and Stamminger 2003, section 3",
    .decide = decide,
    .cost_ms = cost_ms,
    .start_ms = RENDER_COST_LEVELS_MS,
    .passes = passes,
    .pass_count = COUNT(passes),
};
