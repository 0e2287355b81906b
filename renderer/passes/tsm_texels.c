/* Every texel of a translucent shadow map in place of the pattern's samples: slow, to measure what these
 * miss. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/tsm_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    if (idle)
        return render_not_called_for("%s", idle);
    if (request->tsm.response != RENDER_TSM_TEXELS && request->tsm.response != RENDER_TSM_PROFILE)
        return render_not_called_for("the samples of the pattern are summed");
    return render_called_for("response \"%s\" is asked for",
                             render_tsm_response_names[request->tsm.response]);
}

static double cost_ms(const struct render_plan *plan)
{
    double count = 0;
    for (size_t i = 0; i < plan->map_count; i++)
        count +=
            plan->objects[plan->maps[i].object].pixel_count * plan->maps[i].size_px * plan->maps[i].size_px;
    return render_cost_ms(RENDER_COST_MAP_EVALUATION, count);
}

static void bind(const struct render_frame *frame)
{
    render_tsm_set_map(frame);
    render_tsm_set_response(frame);
    render_set_float(frame->program, "map_texel_area", frame->view->texel_area);
    render_set_int(frame->program, "is_profile", frame->request->tsm.response == RENDER_TSM_PROFILE);
}

/* Mesa's software renderer leaves a shader's loops after 65535 rounds, counted over all of them. */
enum { ROUND_LIMIT = 60000, ROUNDS_PER_TEXEL = 12 };

static bool draw(const struct render_frame *frame, dipole_status *status)
{
    (void)status;
    const int texel_count = frame->view->size_px * frame->view->size_px;
    const int step = ROUND_LIMIT / (ROUNDS_PER_TEXEL + render_tsm_source_count(frame));
    for (int first = 0; first < texel_count; first += step) {
        render_set_int(frame->program, "first_texel", first);
        render_set_int(frame->program, "texel_count",
                       first + step < texel_count ? step : texel_count - first);
        render_draw_fullscreen(frame);
    }
    return true;
}

static const struct render_pass passes[] = {
    { .name = "tsm_texels",
      .draw = RENDER_DRAW_BY_RUN,
      .is_per_map = true,
      .is_added = true,
      .reads = { "position_mm", "tsm_position_mm", "tsm_normal", "tsm_flux", "tsm_sources" },
      .writes = { "radiosity" },
      .depth_tested = "position_depth",
      .bind = bind,
      .run = draw },
};

const struct render_effect render_effect_tsm_texels = {
    .name = "tsm_texels",
    .source = "the sum that Dachsbacher and Stamminger 2003 approximate",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
