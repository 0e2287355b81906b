/* What the camera sees: positions and normals, four to a pixel; then one of them for each pixel. */
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
    return 2 * RENDER_COST_PROGRAM_MS +
           render_cost_ms(RENDER_COST_TRIANGLE_4, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_SURFACE_PIXEL, render_cost_pixels(plan));
}

static void bind_surface(const struct render_frame *frame)
{
    render_set_matrix(frame->program, "view_projection", &frame->plan->camera);
}

static void bind_resolve(const struct render_frame *frame)
{
    const struct render_projection *const camera = &frame->plan->camera;
    render_set_vec3(frame->program, "eye_ws_mm", camera->eye_mm);
    render_set_vec3(frame->program, "forward_ws", camera->forward);
    render_set_float(frame->program, "near_mm", camera->near_mm);
    render_set_float(frame->program, "far_mm", camera->far_mm);
    render_set_camera(frame->program, frame->plan);
}

static const struct render_pass passes[] = {
    { .name = "surface",
      .draw = RENDER_DRAW_SCENE,
      .writes = { "surface_position_mm", "surface_normal" },
      .depth_written = "surface_depth",
      .bind = bind_surface },
    { .name = "surface_resolve",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "surface_position_mm", "surface_normal" },
      .writes = { "position_mm", "normal" },
      .depth_written = "position_depth",
      .bind = bind_resolve },
};

const struct render_effect render_effect_surface = {
    .name = "surface",
    .source = "deferred shading, Saito and Takahashi 1990",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
