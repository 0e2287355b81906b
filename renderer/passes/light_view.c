/* What a light sees: the position of each texel's surface, and the share of the light's power that enters
 * there (theory.md T13). Both light samples and shadows are taken from it. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (plan->lit_count == 0)
        return render_not_called_for("no light shines");
    if (!plan->has_scattering && !plan->has_specular && !request->is_captured)
        return render_not_called_for("no channel scatters and no surface is glossy");
    if (plan->technique == RENDER_TECHNIQUE_TSM && !plan->has_specular)
        return render_not_called_for("translucent shadow maps are seen instead");
    if (plan->has_light_pictures)
        return render_not_called_for("%zu view%s of up to %d texels a side drawn in memory",
                                     plan->view_count, plan->view_count == 1 ? "" : "s",
                                     plan->views[0].size_px);
    return render_called_for("%zu of %zu lights shine, seen in %zu view%s of up to %d texels a side",
                             plan->lit_count, request->scene->light_count, plan->view_count,
                             plan->view_count == 1 ? "" : "s", plan->views[0].size_px);
}

static double cost_ms(const struct render_plan *plan)
{
    return (double)plan->view_count * render_cost_ms(RENDER_COST_TRIANGLE, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_VIEW_TEXEL, render_cost_view_texels(plan)) +
           render_cost_ms(RENDER_COST_LIT_TEXEL +
                              (render_plan_wants(plan, "light_rest") ? RENDER_COST_REST_TEXEL : 0),
                          render_cost_lit_texels(plan));
}

static void bind(const struct render_frame *frame)
{
    const struct render_plan_view *const view = frame->view;
    const struct io_light *const light = &frame->request->scene->lights[view->light];
    render_set_matrix(frame->program, "view_projection", &view->projection);
    render_set_light(frame->program, light);
    render_set_vec3(frame->program, "forward_ws", view->projection.forward);
    render_set_float(frame->program, "texel_area", view->texel_area);
    render_set_int(frame->program, "light_layer", view->layer);
}

static const struct render_pass passes[] = {
    { .name = "light_view",
      .draw = RENDER_DRAW_SCENE,
      .is_per_view = true,
      .is_of_samples = true,
      .reads_if_written = { "light_front" },
      .writes = { "light_view" },
      .writes_if_wanted = { "light_object", "light_irradiance", "light_rest" },
      .depth_written = "light_depth",
      .bind = bind },
};

const struct render_effect render_effect_light_view = {
    .name = "light_view",
    .source = "reflective shadow maps, Dachsbacher and Stamminger 2005; flux instead of irradiance",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
