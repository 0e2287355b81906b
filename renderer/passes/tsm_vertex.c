/* The global response gathered at the meshes' vertices, and interpolated between them. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#include <math.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.gather != RENDER_TSM_VERTEX)
        return render_not_called_for("gathered at each fragment");
    if (request->tsm.part == RENDER_TSM_LOCAL)
        return render_not_called_for("the local part alone is asked for");
    return render_called_for("at %zu vertices; what the samples miss is not bounded", plan->vertex_count);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_map_samples_ms(plan, (double)plan->vertex_count * (double)plan->map_count) +
           render_cost_ms(RENDER_COST_TRIANGLE_4, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_POINTS_PIXEL, render_cost_pixels(plan));
}

/* Nothing bounds what so few samples make of an arbitrary shape. */
static double error(const struct render_plan *plan)
{
    (void)plan;
    return INFINITY;
}

static void bind_gather(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_tsm_set_response(frame);
}

static void bind_interpolate(const struct render_frame *frame)
{
    render_set_matrix(frame->program, "view_projection", &frame->plan->camera);
}

static void bind_resolve(const struct render_frame *frame)
{
    render_set_points(frame);
}

static const struct render_pass passes[] = {
    { .name = "tsm_vertices",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_map = true,
      .writes = { "tsm_vertices" },
      .run = render_tsm_use_vertices },
    { .name = "tsm_vertex",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_per_map = true,
      .is_added = true,
      .reads = { "tsm_vertices", "tsm_position_mm", "tsm_normal", "tsm_flux", "tsm_volume", "tsm_pattern",
                 "tsm_form" },
      .reads_if_written = { "tsm_sources", "tsm_factors", "tsm_layers" },
      .writes = { "tsm_vertex_radiosity" },
      .bind = bind_gather },
    { .name = "tsm_interpolate",
      .draw = RENDER_DRAW_SCENE,
      .reads = { "tsm_vertex_radiosity" },
      .writes = { "tsm_surface_radiosity" },
      .depth_written = "surface_depth",
      .bind = bind_interpolate },
    { .name = "tsm_resolve",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_added = true,
      .reads = { "surface_triangle", "mesh_triangles", "mesh_positions_mm", "mesh_normals",
                 "tsm_surface_radiosity", "position_mm", "normal" },
      .writes = { "radiosity" },
      .bind = bind_resolve },
};

const struct render_effect render_effect_tsm_vertex = {
    .name = "tsm_vertex",
    .source = "Dachsbacher and Stamminger 2003, section 4.4",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
