/* The classical dipole: profile, totals, spectrum, gradients. docs/theory.md T4 to T8, T10, T12. */
#include "internal.h"

/* ---- coefficients (T4) ---------------------------------------------------------------------------- */

static bool sigma_check(double value_per_mm, const char *name, dipole_status *status)
{
    if (value_per_mm == 0.0 ||
        (value_per_mm >= DIPOLE_SIGMA_MIN_PER_MM && value_per_mm <= DIPOLE_SIGMA_MAX_PER_MM))
        return true;
    return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s is %g, expected >= 0 (0, or %g to %g)", name,
                       value_per_mm, DIPOLE_SIGMA_MIN_PER_MM, DIPOLE_SIGMA_MAX_PER_MM);
}

static bool medium_check(const dipole_medium *medium, dipole_status *status)
{
    if (!sigma_check(medium->sigma_a_per_mm, "sigma_a_per_mm", status) ||
        !sigma_check(medium->sigma_s_prime_per_mm, "sigma_s_prime_per_mm", status))
        return false;
    if (medium->sigma_a_per_mm == 0.0 && medium->sigma_s_prime_per_mm == 0.0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "sigma_a_per_mm and sigma_s_prime_per_mm are both 0, expected one > 0");
    if (!(medium->eta >= DIPOLE_ETA_MIN && medium->eta <= DIPOLE_ETA_MAX))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "eta is %g, expected > 0 (%g to %g)",
                           medium->eta, DIPOLE_ETA_MIN, DIPOLE_ETA_MAX);
    if (medium->fdr_kind != DIPOLE_FDR_EXACT && medium->fdr_kind != DIPOLE_FDR_POLYNOMIAL)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "fdr_kind is %d, expected a dipole_fdr_kind",
                           (int)medium->fdr_kind);
    return true;
}

bool dipole_coefficients_init(const dipole_medium *medium, dipole_coefficients *out, dipole_status *status)
{
    if (!medium_check(medium, status))
        return false;
    double fdr = dipole_fdr_exact(medium->eta), fdt = dipole_fdt_exact(medium->eta);
    if (medium->fdr_kind == DIPOLE_FDR_POLYNOMIAL) {
        fdr = dipole_fdr_polynomial(medium->eta);
        fdt = 1.0 - fdr;
        if (!(fdr >= 0.0 && fdr < 1.0))
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "eta is %g, where the polynomial gives Fdr = %g, expected an eta where it "
                               "lies in 0 to 1, or fdr \"exact\"",
                               medium->eta, fdr);
    }
    const double sigma_a = medium->sigma_a_per_mm, sigma_s_prime = medium->sigma_s_prime_per_mm;
    const double sigma_t_prime = sigma_a + sigma_s_prime;
    dipole_coefficients c = {
        .sigma_a_per_mm = sigma_a,
        .sigma_s_prime_per_mm = sigma_s_prime,
        .eta = medium->eta,
        .sigma_t_prime_per_mm = sigma_t_prime,
        .alpha_prime = sigma_s_prime / sigma_t_prime,
        .mean_free_path_mm = 1.0 / sigma_t_prime,
        .sigma_tr_per_mm = sqrt(3.0 * sigma_a * sigma_t_prime),
        .fdr = fdr,
        .boundary_a = (1.0 + fdr) / fdt,
        .z_r_mm = 1.0 / sigma_t_prime,
    };
    c.z_v_mm = c.z_r_mm + source_separation_mm(&c);
    *out = c;
    return true;
}

/* ---- profile (T5) --------------------------------------------------------------------------------- */

static bool is_distance(double r_mm)
{
    return r_mm >= 0.0;
}

/* z (sigma_tr + 1/d) e^(-sigma_tr d) / d^2, in an order in which no factor overflows; the exponential is
 * split in two, so that it does not underflow before a large 1/d^2 has been multiplied in. */
double dipole_lobe(double z_mm, double sigma_tr_per_mm, double r_mm)
{
    const double d = hypot(r_mm, z_mm), x = sigma_tr_per_mm * d;
    if (!(x < 2000.0) || isinf(d))
        return 0.0;
    const double root = exp(-0.5 * x);
    return (z_mm / d) * ((1.0 + x) / d) * root / d * root;
}

double dipole_rd_per_mm2(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return NAN;
    return c->alpha_prime / (4.0 * PI) *
           (dipole_lobe(c->z_r_mm, c->sigma_tr_per_mm, r_mm) +
            dipole_lobe(c->z_v_mm, c->sigma_tr_per_mm, r_mm));
}

/* ---- integrals (T6, T7, T8) ----------------------------------------------------------------------- */

double dipole_diffuse_reflectance(const dipole_coefficients *c)
{
    return 0.5 * c->alpha_prime *
           (exp(-c->sigma_tr_per_mm * c->z_r_mm) + exp(-c->sigma_tr_per_mm * c->z_v_mm));
}

/*
 * Mean of 2 * lobe over a ring. The antiderivative z e^(-sigma d)/d is differenced by hand:
 *   z e^(-s d_lo)/d_lo - z e^(-s d_hi)/d_hi = z e^(-s d_lo)/d_hi [D/d_lo + 1 - e^(-s D)],  D = d_hi - d_lo,
 * and the ring's area is pi D (d_hi + d_lo), so that D divides out and nothing cancels however thin it is.
 */
double dipole_lobe_ring_mean(double z_mm, double sigma_tr_per_mm, double r_lo_mm, double r_hi_mm)
{
    const double d_lo = hypot(r_lo_mm, z_mm), d_hi = hypot(r_hi_mm, z_mm);
    if (isinf(d_hi) || !(sigma_tr_per_mm * d_lo < 2000.0))
        return 0.0;
    const double difference = (r_hi_mm - r_lo_mm) * ((r_hi_mm + r_lo_mm) / (d_hi + d_lo));
    const double root = exp(-0.5 * sigma_tr_per_mm * d_lo);
    const double slope = 1.0 / d_lo + sigma_tr_per_mm * decay_mean(sigma_tr_per_mm * difference);
    return 2.0 * (z_mm / d_hi) * root * slope / (d_hi + d_lo) * root;
}

double dipole_rd_ring_mean_per_mm2(const dipole_coefficients *c, double r_lo_mm, double r_hi_mm)
{
    if (!(is_distance(r_lo_mm) && r_hi_mm >= r_lo_mm))
        return NAN;
    return c->alpha_prime / (4.0 * PI) *
           (dipole_lobe_ring_mean(c->z_r_mm, c->sigma_tr_per_mm, r_lo_mm, r_hi_mm) +
            dipole_lobe_ring_mean(c->z_v_mm, c->sigma_tr_per_mm, r_lo_mm, r_hi_mm));
}

/* 1 - (z/d) e^(-sigma_tr (d - z)) as a sum of two positive terms: the part of one lobe within r. */
double dipole_lobe_within(double z_mm, double sigma_tr_per_mm, double r_mm)
{
    const double d = hypot(r_mm, z_mm);
    if (isinf(d))
        return 1.0;
    const double excess = path_excess_mm(z_mm, r_mm);
    return excess / d - (z_mm / d) * expm1(-sigma_tr_per_mm * excess);
}

double dipole_reflectance_within(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return NAN;
    const double s = c->sigma_tr_per_mm;
    return 0.5 * c->alpha_prime *
           (exp(-s * c->z_r_mm) * dipole_lobe_within(c->z_r_mm, s, r_mm) +
            exp(-s * c->z_v_mm) * dipole_lobe_within(c->z_v_mm, s, r_mm));
}

/* (z/d) e^(-sigma_tr (d - z)): the part of one lobe beyond r. */
double dipole_lobe_tail(double z_mm, double sigma_tr_per_mm, double r_mm)
{
    const double d = hypot(r_mm, z_mm);
    return isinf(d) ? 0.0 : (z_mm / d) * exp(-sigma_tr_per_mm * path_excess_mm(z_mm, r_mm));
}

/* The common factor e^(-sigma_tr z_r) is divided out, so that no total underflows. */
double dipole_tail_fraction(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return NAN;
    const double s = c->sigma_tr_per_mm, virtual_weight = exp(-s * source_separation_mm(c));
    return (dipole_lobe_tail(c->z_r_mm, s, r_mm) + virtual_weight * dipole_lobe_tail(c->z_v_mm, s, r_mm)) /
           (1.0 + virtual_weight);
}

/* ---- spectrum (T10) ------------------------------------------------------------------------------- */

double dipole_spectrum(const dipole_coefficients *c, double k_per_mm)
{
    if (!(k_per_mm >= 0.0))
        return NAN;
    const double q = hypot(c->sigma_tr_per_mm, k_per_mm);
    return 0.5 * c->alpha_prime * (exp(-q * c->z_r_mm) + exp(-q * c->z_v_mm));
}

/* ---- derivatives (T12) ---------------------------------------------------------------------------- */

/*
 * One lobe g = z (x + 1) e^(-x) / d^3, x = sigma_tr d, and how it answers to its two parameters:
 *   dg / d log z         = (z/d^3) e^(-x) [(x + 1) - (z/d)^2 (x^2 + 3x + 3)]
 *   dg / d (sigma_tr^2)  = -(z/d) e^(-x) / 2, finite at sigma_tr = 0
 */
struct lobe_gradient dipole_lobe_differentiate(double z_mm, double sigma_tr_per_mm, double r_mm)
{
    const double d = hypot(r_mm, z_mm), x = sigma_tr_per_mm * d;
    if (!(x < 2000.0) || isinf(d))
        return (struct lobe_gradient){ 0.0, 0.0, 0.0 };
    const double root = exp(-0.5 * x), slant = z_mm / d;
    const double bracket = (x + 1.0) - slant * slant * ((x + 3.0) * x + 3.0);
    return (struct lobe_gradient){
        .value = slant * ((x + 1.0) / d) * root / d * root,
        .d_log_z = slant * (bracket / d) * root / d * root,
        .d_sigma_tr2 = -0.5 * slant * root * root,
    };
}

/* With absorbed = 1 - alpha' = sigma_a / sigma_t':
 *   d alpha' / d log sigma_a = -alpha' absorbed = -d alpha' / d log sigma_s'
 *   d log z / d log sigma_a = -absorbed          d log z / d log sigma_s' = -alpha'
 *   d sigma_tr^2 / d log sigma_a = 3 sigma_a (sigma_t' + sigma_a)    ... / d log sigma_s' = 3 sigma_a
 * sigma_s' The derivative with respect to sigma itself divides by it analytically. */
dipole_gradient dipole_rd_gradient(const dipole_coefficients *c, double r_mm)
{
    const dipole_derivative d = dipole_rd_derivative(c, r_mm);
    return (dipole_gradient){ c->sigma_a_per_mm * d.d_sigma_a,
                              c->sigma_s_prime_per_mm * d.d_sigma_s_prime };
}

dipole_derivative dipole_rd_derivative(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return (dipole_derivative){ NAN, NAN };
    const struct lobe_gradient real = dipole_lobe_differentiate(c->z_r_mm, c->sigma_tr_per_mm, r_mm);
    const struct lobe_gradient virtual = dipole_lobe_differentiate(c->z_v_mm, c->sigma_tr_per_mm, r_mm);
    const double value = real.value + virtual.value;
    const double d_log_z = real.d_log_z + virtual.d_log_z;
    const double d_sigma_tr2 = real.d_sigma_tr2 + virtual.d_sigma_tr2;
    const double mean_free_path = c->mean_free_path_mm, alpha_prime = c->alpha_prime;
    const double absorbed = c->sigma_a_per_mm * mean_free_path;
    return (dipole_derivative){
        .d_sigma_a = alpha_prime / (4.0 * PI) *
                     (3.0 * (c->sigma_t_prime_per_mm + c->sigma_a_per_mm) * d_sigma_tr2 -
                      mean_free_path * (value + d_log_z)),
        .d_sigma_s_prime = 1.0 / (4.0 * PI) *
                           (mean_free_path * (absorbed * value - alpha_prime * d_log_z) +
                            3.0 * alpha_prime * c->sigma_a_per_mm * d_sigma_tr2),
    };
}

/* sigma_tr z_r = sqrt(3 absorbed), so the total depends on absorbed = 1 - alpha' alone. */
dipole_gradient dipole_diffuse_reflectance_gradient(const dipole_coefficients *c)
{
    const double absorbed = c->sigma_a_per_mm * c->mean_free_path_mm;
    const double x_r = c->sigma_tr_per_mm * c->z_r_mm, x_v = c->sigma_tr_per_mm * c->z_v_mm;
    const double e_r = exp(-x_r), e_v = exp(-x_v);
    /* d total / d log absorbed */
    const double slope = -0.5 * (absorbed * (e_r + e_v) + 0.5 * c->alpha_prime * (x_r * e_r + x_v * e_v));
    /* d log absorbed / d log sigma_a = alpha', and the total is unchanged when both sigmas scale */
    return (dipole_gradient){ c->alpha_prime * slope, -c->alpha_prime * slope };
}
