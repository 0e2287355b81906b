/* What the composite would do to the radiosity, kept as numbers: exit factor, coverage, and how much of the
 * pixel shows the surface that its radiosity was computed for. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)plan;
    return request->is_captured ? render_called_for("asked for") : render_not_called_for("not asked for");
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
    { .name = "capture",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "surface_triangle", "mesh_triangles", "mesh_positions_mm", "mesh_normals",
                 "surface_exit" },
      .reads_if_written = { "object_media" },
      .writes = { "capture" },
      .depth_tested = "position_depth",
      .bind = bind },
};

const struct render_effect render_effect_capture = {
    .name = "capture",
    .source = "the composite without scattering",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
