/* The picture: radiosity leaves through the surface toward the eye (theory.md T14), specular light is
 * added, and the four points of each pixel are averaged. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)plan;
    if (request->is_captured)
        return render_not_called_for("its parts are captured instead");
    return render_called_for("4 points per pixel");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan)) +
           render_cost_ms(RENDER_COST_COMPOSITE_PIXEL, plan->covered_px);
}

static void bind(const struct render_frame *frame)
{
    render_set_points(frame);
    render_set_medium(frame->program, frame->plan);
}

static const struct render_pass passes[] = {
    { .name = "composite",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "surface_triangle", "mesh_triangles", "mesh_positions_mm", "mesh_normals", "position_mm",
                 "surface_exit" },
      .reads_if_written = { "radiosity", "specular", "object_media" },
      .writes = { "radiance" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_composite = {
    .name = "composite",
    .source = "Fresnel exit normalised to the radiosity",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
