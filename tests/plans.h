/* Plans for the tests of them. */
#ifndef PLANS_H
#define PLANS_H

#include "check.h"

#include "renderer/plan.h"

#include <string.h>

static inline struct render_plan *plan_for(const struct render_request *request)
{
    struct render_plan *plan;
    dipole_status status;
    if (!render_plan_create(request, &plan, &status))
        fail_msg("%s", status.message);
    return plan;
}

/* What was decided about an effect. */
static inline const struct render_decision *decision_of(const struct render_plan *plan, const char *name)
{
    size_t e = 0;
    while (render_effects[e] && strcmp(render_effects[e]->name, name) != 0)
        e++;
    if (!render_effects[e])
        fail_msg("no effect %s", name);
    return &plan->decisions[e];
}

/* No plan is made, and this is why. */
static inline void fails_with(const struct render_request *request, const char *message)
{
    struct render_plan *plan;
    dipole_status status = { 0 };
    assert_false(render_plan_create(request, &plan, &status));
    assert_null(plan);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message, message);
}

#endif
