/* The same as light_view, drawn in memory, where OpenGL is software and more than samples is taken from it:
 * what the processor needs is not read back, and shaders get it as a texture. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/light_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (!plan->has_light_pictures)
        return render_not_called_for("lights' views are drawn by OpenGL, or not at all");
    if (!render_plan_keeps_pictures(plan))
        return render_not_called_for("no more than samples is taken from what lights see");
    return render_called_for("%zu view%s of up to %d texels a side: OpenGL is software", plan->view_count,
                             plan->view_count == 1 ? "" : "s", plan->views[0].size_px);
}

static double cost_ms(const struct render_plan *plan)
{
    return (double)plan->view_count *
               render_cost_ms(RENDER_COST_PICTURE_TRIANGLE, (double)plan->triangle_count) +
           render_cost_ms(RENDER_COST_WHOLE_TEXEL, render_cost_view_texels(plan)) +
           render_cost_ms(RENDER_COST_DRAWN_TEXEL +
                              (render_plan_wants(plan, "light_rest") ? RENDER_COST_DRAWN_REST : 0),
                          render_cost_lit_texels(plan));
}

static bool draw(const struct render_frame *frame, dipole_status *status)
{
    struct render_light_drawing *drawing;
    return render_executor_need_drawing(frame, &drawing, status) &&
           render_light_drawing_draw(drawing, frame, status);
}

static const struct render_pass passes[] = {
    { .name = "light_picture",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_view = true,
      .is_of_samples = true,
      .writes_if_wanted = { "light_view" },
      .run = draw },
};

const struct render_effect render_effect_light_picture = {
    .name = "light_picture",
    .source = "reflective shadow maps, Dachsbacher and Stamminger 2005; flux instead of irradiance",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
