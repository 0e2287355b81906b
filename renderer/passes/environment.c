/* Light from all around: irradiance that enters by the normal, as a sum of spherical harmonics (theory.md
 * T50 to T52), tabulated by the normal (T47). Its samples and its pixels are effects of their own. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/environment_draw.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide(const struct render_request *request, const struct render_plan *plan)
{
    if (!request->scene->has_environment)
        return render_not_called_for("the scene has none");
    if (request->is_captured)
        return render_not_called_for("captured without it");
    if (!plan->has_scattering)
        return render_not_called_for("no channel scatters");
    if (!plan->has_environment)
        return render_not_called_for(plan->technique == RENDER_TECHNIQUE_TSM ? "technique is tsm"
                                     : plan->area == RENDER_AREA_OVERLAP     ? "areas are counted: overlap"
                                                                             : "it is black");
    return render_called_for("order %d: those above add at most %.2g of the mean irradiance",
                             plan->environment_order, plan->environment_error);
}

/* Of tables made anew: they are kept while the light, its epsilon and the media are the same. */
static double cost_ms(const struct render_plan *plan)
{
    const double threads_ms = 0.2;
    return threads_ms + render_cost_ms(RENDER_COST_SKY_NODE, plan->irradiance_nodes) +
           render_cost_ms(RENDER_COST_SKY_TERM, plan->irradiance_terms);
}

static double error(const struct render_plan *plan)
{
    return plan->environment_error;
}

static const struct render_pass passes[] = {
    { .name = "environment",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "environment_irradiance" },
      .run = render_sky_tabulate },
};

const struct render_effect render_effect_environment = {
    .name = "environment",
    .source = "Ramamoorthi and Hanrahan 2001, with the Fresnel-weighted cosine",
    .decide = decide,
    .cost_ms = cost_ms,
    .error = error,
    .passes = passes,
    .pass_count = COUNT(passes),
};
