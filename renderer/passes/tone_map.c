/* Radiance over the background, to what a screen can show (theory.md T20). */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#include <math.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)plan;
    if (!request->is_tone_mapped || request->is_captured)
        return render_not_called_for("linear radiance is asked for");
    return render_called_for("the picture is for a screen, exposure %+g EV", request->scene->exposure_ev);
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan));
}

static void bind(const struct render_frame *frame)
{
    const struct io_scene *const scene = frame->request->scene;
    render_set_vec3(frame->program, "background", scene->background);
    render_set_float(frame->program, "exposure", exp2(scene->exposure_ev));
}

static const struct render_pass passes[] = {
    { .name = "tone_map",
      .draw = RENDER_DRAW_FULLSCREEN,
      .reads = { "radiance" },
      .writes = { "display" },
      .bind = bind },
};

const struct render_effect render_effect_tone_map = {
    .name = "tone_map",
    .source = "exponential shoulder on the largest channel, fading to white",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
