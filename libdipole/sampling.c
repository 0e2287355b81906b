/* How far the light reaches and how densely it must be sampled. docs/theory.md T9, T11. */
#include "internal.h"

/*
 * The root in [lo, hi] by Newton's method in log x, kept inside a shrinking bracket by bisection; ends
 * when the bracket or the step is below one part in 10^15.
 */
double dipole_find_root(falling_function *function, const void *context, double lo, double hi)
{
    double log_lo = log(lo), log_hi = log(hi), log_x = 0.5 * (log_lo + log_hi);
    for (int i = 0; i < 200; i++) {
        double value, slope;
        function(context, exp(log_x), &value, &slope);
        if (value > 0.0)
            log_lo = log_x;
        else
            log_hi = log_x;
        const double newton = log_x - value / slope;
        const bool is_inside = newton > log_lo && newton < log_hi; /* false for NaN */
        const double next = is_inside ? newton : 0.5 * (log_lo + log_hi);
        const bool is_done = fabs(next - log_x) <= 1e-15;
        log_x = next;
        if (is_done)
            break;
    }
    return exp(log_x);
}

/* ---- r_max (T9) ----------------------------------------------------------------------------------- */

struct reach {
    const dipole_coefficients *coefficients;
    double epsilon;
};

/* log(tail / epsilon), or where epsilon > 1/2, and the tail would be a difference of equals,
 * log((1 - epsilon) / within). */
static void reach_function(const void *context, double r_mm, double *value, double *d_log_r)
{
    const struct reach *const reach = context;
    const dipole_coefficients *const c = reach->coefficients;
    /* alpha' is irrelevant and may be 0: set it to 1 */
    dipole_coefficients lossless = *c;
    lossless.alpha_prime = 1.0;
    const double total = dipole_diffuse_reflectance(&lossless);
    const double slope = 2.0 * PI * r_mm * r_mm * dipole_rd_per_mm2(&lossless, r_mm) / total;
    if (reach->epsilon > 0.5) {
        const double within = dipole_reflectance_within(&lossless, r_mm) / total;
        *value = log((1.0 - reach->epsilon) / within);
        *d_log_r = -slope / within;
    } else {
        const double tail = dipole_tail_fraction(c, r_mm);
        *value = log(tail) - log(reach->epsilon);
        *d_log_r = -slope / tail;
    }
}

double dipole_r_max_mm(const dipole_coefficients *c, double epsilon)
{
    if (!(epsilon >= DIPOLE_EPSILON_MIN && epsilon < 1.0))
        return NAN;
    const struct reach reach = { c, epsilon };
    double lo = c->z_r_mm, hi = c->z_v_mm;
    while (dipole_tail_fraction(c, lo) < epsilon)
        lo *= 0.5;
    while (dipole_tail_fraction(c, hi) > epsilon)
        hi *= 2.0;
    return dipole_find_root(reach_function, &reach, lo, hi);
}

/* ---- splat spacing (T11) -------------------------------------------------------------------------- */

/* log of spectrum(k)/spectrum(0) over epsilon/4, with the common factor e^(-sigma_tr z_r) divided out. */
static void aliasing_function(const void *context, double k_per_mm, double *value, double *d_log_k)
{
    const struct reach *const reach = context;
    const dipole_coefficients *const c = reach->coefficients;
    const double s = c->sigma_tr_per_mm, q = hypot(s, k_per_mm), separation = source_separation_mm(c);
    const double q_excess = path_excess_mm(s, k_per_mm), virtual_weight = exp(-q * separation);
    *value = -c->z_r_mm * q_excess + log1p(virtual_weight) - log1p(exp(-s * separation)) -
             log(reach->epsilon / 4.0);
    *d_log_k =
        -(k_per_mm / q) * k_per_mm * (c->z_r_mm + separation * virtual_weight / (1.0 + virtual_weight));
}

double dipole_splat_spacing_mm(const dipole_coefficients *c, double epsilon)
{
    if (!(epsilon >= DIPOLE_EPSILON_MIN && epsilon < 4.0))
        return NAN;
    /* The ratio lies between e^(-z_r x)/2 and e^(-z_r x), x = q - sigma_tr, which brackets x and so k. */
    const double s = c->sigma_tr_per_mm, x_hi = -log(epsilon / 4.0) / c->z_r_mm;
    const double k_hi = sqrt(x_hi) * sqrt(x_hi + 2.0 * s);
    const struct reach reach = { c, epsilon };
    double lo = k_hi;
    for (double value = -1.0, slope; value < 0.0;) {
        lo *= 0.5;
        aliasing_function(&reach, lo, &value, &slope);
    }
    return 2.0 * PI / dipole_find_root(aliasing_function, &reach, lo, k_hi);
}
