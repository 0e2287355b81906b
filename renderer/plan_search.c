/* The plan that a budget of time pays for: epsilon is searched for among plans, none of which is drawn. */
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { STEPS_PER_DECADE = 10, NAMED = 3 };

double render_plan_cost_ms(const struct render_plan *plan)
{
    double sum_ms = plan->beside_ms;
    for (size_t e = 0; e < plan->effect_count; e++)
        sum_ms += plan->decisions[e].cost_ms;
    return sum_ms;
}

/* The steps of epsilon, from the largest down. */
static double epsilon_of(int step)
{
    return fmax(RENDER_EPSILON_MAX * pow(10, -(double)step / STEPS_PER_DECADE), RENDER_BUDGET_EPSILON_MIN);
}

static bool cost_of(const struct render_request *request, int step, double *cost_ms, dipole_status *status)
{
    struct render_request tried = *request;
    struct render_plan *plan;
    tried.budget_ms = 0;
    tried.epsilon = epsilon_of(step);
    if (!render_plan_create(&tried, &plan, status))
        return false;
    *cost_ms = render_plan_cost_ms(plan);
    render_plan_destroy(plan);
    return true;
}

/* Bisection: costs grow as epsilon falls. */
bool render_plan_spend_budget(struct render_request *request, dipole_status *status)
{
    if (!(request->budget_ms > 0))
        return true;
    int within = 0,
        beyond = (int)ceil(STEPS_PER_DECADE * log10(RENDER_EPSILON_MAX / RENDER_BUDGET_EPSILON_MIN)) + 1;
    while (beyond - within > 1) {
        const int middle = (within + beyond) / 2;
        double cost_ms;
        if (!cost_of(request, middle, &cost_ms, status))
            return false;
        *(cost_ms <= request->budget_ms ? &within : &beyond) = middle;
    }
    request->epsilon = epsilon_of(within);
    return true;
}

/* "surface 38 ms, gather 20, light_view 18" */
static void name_dearest(const struct render_plan *plan, char *out, size_t size)
{
    bool is_named[RENDER_EFFECT_LIMIT] = { false };
    size_t used = 0;
    for (int n = 0; n < NAMED; n++) {
        size_t dearest = plan->effect_count;
        for (size_t e = 0; e < plan->effect_count; e++) {
            if (!is_named[e] && plan->decisions[e].cost_ms > 0 &&
                (dearest == plan->effect_count ||
                 plan->decisions[e].cost_ms > plan->decisions[dearest].cost_ms))
                dearest = e;
        }
        if (dearest == plan->effect_count || used >= size)
            break;
        is_named[dearest] = true;
        used += (size_t)snprintf(out + used, size - used, "%s%s %.3g%s", n > 0 ? ", " : "",
                                 render_effects[dearest]->name, plan->decisions[dearest].cost_ms,
                                 n == 0 ? " ms" : "");
    }
}

void render_plan_note_budget(const struct render_request *request, struct render_plan *plan)
{
    plan->budget_ms = request->budget_ms;
    if (!(request->budget_ms > 0))
        return;
    const double cost_ms = render_plan_cost_ms(plan);
    if (cost_ms > request->budget_ms) {
        char dearest[128] = "";
        name_dearest(plan, dearest, sizeof dearest);
        render_plan_add_note(
            plan,
            "a budget of %.3g ms cannot be kept: with the largest error, epsilon %g, %.3g ms are "
            "predicted (%s)",
            request->budget_ms, plan->epsilon, cost_ms, dearest);
    }
    if (!request->calibration)
        render_plan_add_note(plan, "times are predicted as on another machine: accuracy --calibrate "
                                   "measures this one");
}
