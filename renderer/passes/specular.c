/* Light mirrored at the rough surface: GGX, with the shadows of the light's view (theory.md T19). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (!plan->is_glossy)
        return render_not_called_for("no object is glossy");
    if (plan->lit_count == 0)
        return render_not_called_for("no light shines");
    if (!plan->has_specular)
        return render_not_called_for("gloss adds at most %.2g of what a lit surface sends out",
                                     plan->gloss_most);
    return render_called_for("an object is glossy");
}

static double cost_ms(const struct render_plan *plan)
{
    return (double)plan->view_count * (render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan)) +
                                       render_cost_ms(RENDER_COST_GLOSS_PIXEL, plan->glossy_px));
}

static void bind(const struct render_frame *frame)
{
    render_set_light_view(frame->program, frame->request, frame->view);
    render_set_points(frame);
    render_set_medium(frame->program, frame->plan);
}

static const struct render_pass passes[] = {
    { .name = "specular",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_view = true,
      .is_added = true,
      .reads = { "surface_triangle", "mesh_triangles", "mesh_positions_mm", "mesh_normals",
                 "mesh_roughness", "position_mm", "normal", "surface_exit", "light_view" },
      .reads_if_written = { "object_media", "shadow" },
      .writes = { "specular" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_specular = {
    .name = "specular",
    .source = "GGX, Walter et al. 2007; height-correlated Smith, Heitz 2014",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
