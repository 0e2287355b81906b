/* Surfaces of an object behind the first that a light sees of it: in its penumbra on itself, and where it
 * lets light through, light enters there, too (theory.md T71). Keeps what the view before has shown. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (plan->shadows.soft_light_count + plan->shadows.object_count == 0)
        return render_not_called_for("objects hide all of a light, or none");
    if (plan->shadows.layer_count == 0)
        return render_not_called_for(
            "no light samples are taken where an object hides a part of a light from "
            "itself");
    return render_called_for(
        "objects hide a part of the light from themselves: %zu of %zu views see behind "
        "the first surface",
        plan->shadows.layer_count, plan->view_count);
}

static double cost_ms(const struct render_plan *plan)
{
    const double side_px = plan->views[0].size_px;
    return render_cost_ms(RENDER_COST_VIEW_TEXEL, side_px * side_px * (double)plan->view_count);
}

/* The view before is of the same light and object. */
static bool keep(const struct render_frame *frame, dipole_status *status)
{
    const int side_px = frame->view->size_px;
    (void)status;
    if (frame->view->layer > 0)
        glCopyImageSubData(render_executor_texture(frame->executor, "light_view"), GL_TEXTURE_2D, 0, 0, 0,
                           0, render_executor_texture(frame->executor, "light_front"), GL_TEXTURE_2D, 0, 0,
                           0, 0, side_px, side_px, 1);
    return true;
}

static const struct render_pass passes[] = {
    { .name = "light_front",
      .draw = RENDER_DRAW_NOTHING,
      .is_per_view = true,
      .is_of_samples = true,
      .writes = { "light_front" },
      .run = keep },
};

const struct render_effect render_effect_light_layers = {
    .name = "light_layers",
    .source = "depth peeling, Everitt 2001",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
