/* Sources under one point of a surface, seen from another. docs/theory.md T30. */
#include "internal.h"
#include "row.h"
#include "sources.h"

/* ---- what they are for each model ----------------------------------------------------------------- */

static dipole_source source_of(const dipole_coefficients *c, double depth_mm, double weight)
{
    return (dipole_source){ depth_mm, weight, c->sigma_tr_per_mm, c->sigma_tr_low_per_mm };
}

static void dipole_sources_fill(const dipole_coefficients *c, dipole_sources *out)
{
    out->count = 2;
    out->at[0] = source_of(c, c->z_r_mm, 0.5 * c->alpha_prime);
    out->at[1] = source_of(c, -c->z_v_mm, 0.5 * c->alpha_prime);
}

/*
 * The beam model's line of sources by the trapezoidal rule in log z with a step h: for a strip of
 * half-width pi/4 the error is about 2 e^(-pi^2/2h), which is set to epsilon/4. Below the first node the
 * integrand has fallen as the square of the depth, beyond the last as e^(-z/L). What is cut off and left
 * over is shared out so that the total is exact.
 */
static bool beam_sources_fill(const dipole_coefficients *c, double epsilon, double r_min_mm,
                              dipole_sources *out)
{
    const double l = c->mean_free_path_mm, longest = fmax(1.0, 2.0 / 3.0 * c->boundary_a);
    const double step = 0.5 * PI * PI / log(8.0 / epsilon);
    const double first = log(fmin(r_min_mm / l, 1.0) * sqrt(0.25 * epsilon));
    const double last = log(longest * (log(4.0 / epsilon) + 4.0));
    const size_t count = (size_t)ceil((last - first) / step) + 1;
    if (2 * count > DIPOLE_SOURCE_LIMIT)
        return false;
    const double s = c->sigma_tr_per_mm;
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        const double x = exp(first + (double)k * step), weight = dipole_row_beam_weight(c, x, step);
        sum += weight * exp(-s * x * l);
        out->at[2 * k] = source_of(c, x * l, weight);
        out->at[2 * k + 1] = source_of(c, -x * l, weight);
    }
    const double b = 2.0 / 3.0 * c->boundary_a, total = 1.0 / ((1.0 + s * l) * (1.0 + s * l * b));
    for (size_t k = 0; k < 2 * count; k++)
        out->at[k].weight *= 0.5 * c->alpha_prime * total / sum;
    out->count = 2 * count;
    return true;
}

static bool beam_sources_init(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                              dipole_sources *out, dipole_status *status)
{
    const dipole_coefficients *const c = dipole_stack_coefficients(stack, 0);
    if (!beam_sources_fill(c, epsilon, r_min_mm, out))
        return dipole_fail(
            status, DIPOLE_NOT_SUPPORTED, NULL,
            "more than %d sources are needed for eta %g, r_min_mm %g, epsilon %g; expected larger ones",
            (int)DIPOLE_SOURCE_LIMIT, c->eta, r_min_mm, epsilon);
    out->max_relative_error = dipole_source_error(stack, out, r_min_mm, r_max_mm);
    return true;
}

static bool fitted_sources_init(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                                dipole_sources *out, dipole_status *status)
{
    double bad_r_mm;
    if (!dipole_source_fit(stack, epsilon, r_min_mm, r_max_mm, out, &bad_r_mm))
        return dipole_fail(status, DIPOLE_NOT_CONVERGED, NULL,
                           "the profile is 0 at %g mm, which no source is; expected a smaller r_max_mm",
                           bad_r_mm);
    return out->max_relative_error <= epsilon ||
           dipole_fail(
               status, DIPOLE_NOT_CONVERGED, NULL,
               "sources come within %.3g of the profile from r_min_mm %g to r_max_mm %g, epsilon is "
               "%g; expected a larger one",
               out->max_relative_error, r_min_mm, r_max_mm, epsilon);
}

static bool request_check(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                          dipole_status *status)
{
    const double least = 1e-6 * dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
    if (!(epsilon >= 1e-9 && epsilon <= 0.1))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "epsilon is %g, expected 1e-9 to 0.1", epsilon);
    if (!(r_min_mm >= least && r_min_mm < INFINITY))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "r_min_mm is %g, expected at least %g", r_min_mm,
                           least);
    if (!(r_max_mm > r_min_mm && r_max_mm <= SOURCE_RANGE_LIMIT * r_min_mm))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "r_max_mm is %g, expected more than r_min_mm, %g, and at most %g times it",
                           r_max_mm, r_min_mm, SOURCE_RANGE_LIMIT);
    return true;
}

bool dipole_sources_init(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                         dipole_sources *out, dipole_status *status)
{
    if (!request_check(stack, epsilon, r_min_mm, r_max_mm, status))
        return false;
    const dipole_coefficients *const c = dipole_stack_coefficients(stack, 0);
    const dipole_model model = dipole_stack_model(stack);
    const bool is_half_space =
        dipole_stack_layer_count(stack) == 1 && isinf(dipole_stack_layer(stack, 0)->thickness_mm);
    *out = (dipole_sources){ .sigma_tr_per_mm = c->sigma_tr_per_mm };
    if (!(dipole_stack_total(stack, DIPOLE_FACE_LIT) > 0.0))
        return true;
    if (is_half_space && model == DIPOLE_MODEL_BEAM)
        return beam_sources_init(stack, epsilon, r_min_mm, r_max_mm, out, status);
    if (is_half_space && (model == DIPOLE_MODEL_DIPOLE || model == DIPOLE_MODEL_MULTIPOLE)) {
        dipole_sources_fill(c, out);
        return true;
    }
    return fitted_sources_init(stack, epsilon, r_min_mm, r_max_mm, out, status);
}

/* ---- what they send out --------------------------------------------------------------------------- */

double dipole_sources_between_per_mm2(const dipole_sources *sources, const double in_mm[3],
                                      const double in_normal[3], const double out_mm[3])
{
    double sum = 0.0;
    for (size_t k = 0; k < sources->count; k++) {
        const double z = sources->at[k].depth_mm;
        double d2 = 0.0;
        for (int axis = 0; axis < 3; axis++)
            d2 += square(out_mm[axis] - in_mm[axis] + z * in_normal[axis]);
        sum += sources->at[k].weight * source_lobe(&sources->at[k], d2);
    }
    return sum / (2.0 * PI);
}

static const struct source_loops *loops(void)
{
#ifdef DIPOLE_HAS_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return &dipole_source_loops_avx2;
#endif
    return &dipole_source_loops_portable;
}

void dipole_sources_profile_per_mm2(const dipole_sources *sources, double distance_mm,
                                    const double *cosines, size_t count, double *values)
{
    loops()->profile(sources, distance_mm, cosines, count, values);
}

double dipole_sources_within(const dipole_sources *sources, double height_mm, double r_mm)
{
    double value;
    loops()->within(sources, height_mm, &r_mm, 1, &value);
    return value;
}

void dipole_sources_within_many(const dipole_sources *sources, double height_mm, const double *r_mm,
                                size_t count, double *values)
{
    loops()->within(sources, height_mm, r_mm, count, values);
}
