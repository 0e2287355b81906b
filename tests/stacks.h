/* What the tests of layers share: stacks from above, their profiles, and how many cases there is time for.
 */
#ifndef STACKS_H
#define STACKS_H

#include "check.h"
#include "libdipole/dipole.h"

#include <math.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SLOWNESS = 20 }; /* how many times fewer cases */
#else
enum { SLOWNESS = 1 };
#endif

/* What is smaller than this is no number to be right about: it is near where doubles end. */
static const double least = 1e-290;

static inline dipole_stack *stack_of(const dipole_layer *layers, size_t count, dipole_model model)
{
    dipole_stack *stack;
    dipole_status status;
    if (!dipole_stack_create(layers, count, model, DIPOLE_FROM_ABOVE, &stack, &status))
        fail_msg("%s", status.message);
    return stack;
}

static inline double profile(const dipole_stack *stack, dipole_face face, double r_mm)
{
    double value;
    dipole_stack_profile_per_mm2(stack, face, &r_mm, 1, &value);
    return value;
}

static inline void coefficients_of(const dipole_layer *layers, size_t count,
                                   dipole_coefficients *coefficients)
{
    for (size_t i = 0; i < count; i++)
        assert_true(dipole_coefficients_init(&layers[i].medium, &coefficients[i], NULL));
}

/* Half of the power leaves within it. */
static inline double half_width_mm(const dipole_stack *stack, dipole_face face)
{
    return dipole_stack_r_max_mm(stack, face, 0.5);
}

/* The profile at a hundredth of that, or its mean if that is more: for models that are infinite at 0. */
static inline double top_of(const dipole_stack *stack, dipole_face face)
{
    const double width_mm = half_width_mm(stack, face), pi = 3.14159265358979323846;
    return fmax(profile(stack, face, 0.01 * width_mm),
                dipole_stack_total(stack, face) / (2.0 * pi * width_mm * width_mm));
}

#endif
