/* Light from all around that leaves where it enters: radiosity = total reflectance times irradiance. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/environment_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    (void)request;
    if (!plan->has_environment)
        return render_not_called_for("no environment is drawn");
    if (plan->technique != RENDER_TECHNIQUE_LAMBERT)
        return render_not_called_for("technique is %s", render_technique_names[plan->technique]);
    return render_called_for("irradiance by the normal at each pixel, from a table");
}

static double cost_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SCREEN_PIXEL, render_cost_pixels(plan)) +
           render_cost_ms(RENDER_COST_SKY_PIXEL, plan->covered_px);
}

static const struct render_pass passes[] = {
    { .name = "environment_lambert",
      .draw = RENDER_DRAW_FULLSCREEN,
      .is_added = true,
      .reads = { "position_mm", "normal", "environment_irradiance" },
      .reads_if_written = { "object_media" },
      .writes = { "radiosity" },
      .bind = render_sky_bind },
};

const struct render_effect render_effect_environment_lambert = {
    .name = "environment_lambert",
    .source = "Ramamoorthi and Hanrahan 2001",
    .decide = decide,
    .cost_ms = cost_ms,
    .passes = passes,
    .pass_count = COUNT(passes),
};
