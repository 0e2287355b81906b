/* What the camera sees: triangles at four points of each pixel, then one surface for each pixel (theory.md
 * T58). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)plan;
    return render_called_for("%zu object%s in the scene", request->scene->object_count,
                             request->scene->object_count == 1 ? "" : "s");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_TRIANGLE_4, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_EMPTY_PIXEL, render_cost_pixels(plan)) +
           render_cost_ms(RENDER_COST_SURFACE_PIXEL, plan->covered_px);
}

static void bind_surface(const struct render_frame *frame)
{
    render_set_matrix(frame->program, "view_projection", &frame->plan->camera);
    render_executor_find_points(frame);
}

static void bind_depth(const struct render_frame *frame)
{
    render_set_float(frame->program, "near_mm", frame->plan->camera.near_mm);
    render_set_float(frame->program, "far_mm", frame->plan->camera.far_mm);
    render_set_camera(frame->program, frame->plan);
}

/* Gloss is off by at most 2.1 times its square where normals turn by less (theory.md T58); a capture is
 * exact. */
#define GLOSS_SPREAD 0.05

static void bind_resolve(const struct render_frame *frame)
{
    render_set_float(frame->program, "flat_mm", frame->plan->flat_mm);
    render_set_float(frame->program, "gloss_spread", frame->request->is_captured ? 0 : GLOSS_SPREAD);
    render_set_points(frame);
    render_set_medium(frame->program, frame->plan);
}

static const struct render_pass passes[] = {
    { .name = "surface_meshes",
      .draw = RENDER_DRAW_NOTHING,
      .reads_if_written = { "posed_vertices" },
      .writes = { "mesh_triangles", "mesh_positions_mm", "mesh_normals", "mesh_roughness" },
      .run = render_executor_use_meshes },
    { .name = "surface",
      .draw = RENDER_DRAW_SCENE,
      .writes = { "surface_triangle" },
      .depth_written = "surface_depth",
      .bind = bind_surface },
    { .name = "position_depth",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "surface_triangle", "surface_depth" },
      .depth_written = "position_depth",
      .bind = bind_depth },
    { .name = "surface_resolve",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "surface_triangle", "mesh_triangles", "mesh_positions_mm", "mesh_normals",
                 "mesh_roughness" },
      .reads_if_written = { "object_media" },
      .writes = { "position_mm", "surface_exit" },
      .writes_if_wanted = { "normal" },
      .depth_tested = "position_depth",
      .bind = bind_resolve },
};

const struct render_effect render_effect_surface = {
    .name = "surface",
    .source = "visibility buffer, Burns and Hunt 2013",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
