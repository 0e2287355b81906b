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
    for (size_t e = 0; render_effects[e]; e++) {
        if (strcmp(render_effects[e]->name, name) == 0)
            return &plan->decisions[e];
    }
    fail_msg("no effect %s", name);
    return NULL;
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
