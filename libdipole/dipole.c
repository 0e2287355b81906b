/* The classical dipole: profile, totals, spectrum, gradients. docs/theory.md T4 to T8, T10, T12. */
#include "internal.h"
#include "lobe.h"
#include "row.h"

#include <limits.h>

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
    const double boundary_a = (1.0 + fdr) / fdt;
    const struct dd one = { 1.0, 0.0 }, sigma_t_prime = dd_sum(sigma_a, sigma_s_prime);
    const struct dd sigma_tr = dd_root(dd_multiply(dd_product(3.0, sigma_a), sigma_t_prime));
    const struct dd z_r = dd_divide(one, sigma_t_prime);
    const struct dd z_v =
        dd_multiply(z_r, dd_add(one, dd_divide(dd_product(4.0, boundary_a), (struct dd){ 3.0, 0.0 })));
    *out = (dipole_coefficients){
        .sigma_a_per_mm = sigma_a,
        .sigma_s_prime_per_mm = sigma_s_prime,
        .eta = medium->eta,
        .sigma_t_prime_per_mm = sigma_t_prime.hi,
        .alpha_prime = sigma_s_prime / sigma_t_prime.hi,
        .mean_free_path_mm = z_r.hi,
        .sigma_tr_per_mm = sigma_tr.hi,
        .fdr = fdr,
        .boundary_a = boundary_a,
        .z_r_mm = z_r.hi,
        .z_v_mm = z_v.hi,
        .sigma_tr_low_per_mm = sigma_tr.lo,
        .z_r_low_mm = z_r.lo,
        .z_v_low_mm = z_v.lo,
    };
    return true;
}

/* ---- profile (T5) --------------------------------------------------------------------------------- */

static bool is_distance(double r_mm)
{
    return r_mm >= 0.0;
}

double dipole_rd_per_mm2(const dipole_coefficients *c, double r_mm)
{
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    return dipole_row_value(&pair.row, r_mm);
}

void dipole_rd_profile_per_mm2(const dipole_coefficients *c, const double *r_mm, size_t count,
                               double *values)
{
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    dipole_row_profile(&pair.row, r_mm, count, values);
}

/* ---- integrals (T6, T7, T8) ----------------------------------------------------------------------- */

double dipole_diffuse_reflectance(const dipole_coefficients *c)
{
    return 0.5 * c->alpha_prime *
           (exp(-c->sigma_tr_per_mm * c->z_r_mm) + exp(-c->sigma_tr_per_mm * c->z_v_mm));
}

double dipole_rd_ring_mean_per_mm2(const dipole_coefficients *c, double r_lo_mm, double r_hi_mm)
{
    if (!(is_distance(r_lo_mm) && r_hi_mm >= r_lo_mm))
        return NAN;
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    return c->alpha_prime / (2.0 * PI) * dipole_row_ring_mean(&pair.row, r_lo_mm, r_hi_mm);
}

double dipole_reflectance_within(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return NAN;
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    return fmin(c->alpha_prime * dipole_row_within(&pair.row, r_mm), dipole_diffuse_reflectance(c));
}

/* Scaled by 2^64 until the total, which is at least e^(-sqrt 3)/2, has been divided out, so that what ends
 * as a subnormal number is rounded once. */
double dipole_tail_fraction(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return NAN;
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    const double total =
        0.5 * (exp(-c->sigma_tr_per_mm * c->z_r_mm) + exp(-c->sigma_tr_per_mm * c->z_v_mm));
    return fmin(dipole_row_beyond(&pair.row, 0x1p64, r_mm) / total * 0x1p-64, 1.0);
}

/* ---- spectrum (T10) ------------------------------------------------------------------------------- */

/* e^(-z q) with z and q to 32 digits, as in lobe.h */
static double plane_decay(double z_mm, double z_low_mm, struct dd q)
{
    const double x = z_mm * q.hi;
    const double x_low = product_error(z_mm, q.hi, x) + (z_mm * q.lo + z_low_mm * q.hi);
    return decay_times(1.0, decay_split(x, x_low));
}

double dipole_spectrum(const dipole_coefficients *c, double k_per_mm)
{
    if (!(k_per_mm >= 0.0))
        return NAN;
    const double k = fmin(k_per_mm, LOBE_FAR_MM); /* where nothing is left */
    const struct dd s = { c->sigma_tr_per_mm, c->sigma_tr_low_per_mm };
    const struct dd q = dd_root(dd_add(dd_product(k, k), dd_multiply(s, s)));
    return 0.5 * c->alpha_prime *
           (plane_decay(c->z_r_mm, c->z_r_low_mm, q) + plane_decay(c->z_v_mm, c->z_v_low_mm, q));
}

/* ---- derivatives (T12) ---------------------------------------------------------------------------- */

dipole_gradient dipole_rd_gradient(const dipole_coefficients *c, double r_mm)
{
    const dipole_derivative d = dipole_rd_derivative(c, r_mm);
    return (dipole_gradient){ c->sigma_a_per_mm * d.d_sigma_a,
                              c->sigma_s_prime_per_mm * d.d_sigma_s_prime };
}

/* What the bracket of one lobe's derivatives is made of. */
struct derivative_terms {
    struct dd alpha_prime, absorbed, l, sigma_a, slope_a; /* 3/2 (sigma_t' + sigma_a) */
};

/* Adds 4 pi dR_d/dsigma of one lobe to each sum, times 2^-*exponent:
 *   d/dsigma_a  = u e^(-x) alpha' {-3/2 (sigma_t' + sigma_a) - (l/d^2) [2 (x + 1) - u^2 P]}
 *   d/dsigma_s' = u e^(-x) {(l/d^2) [absorbed (x + 1) - alpha' (x + 1 - u^2 P)] - 3/2 alpha' sigma_a}
 * with u = z/d, P = x^2 + 3x + 3. The braces change sign, and so does the sum over both lobes: 32 digits
 * throughout. */
static void derivative_add(const struct derivative_terms *t, struct dd z, struct dd sigma_tr, double r,
                           int *exponent, struct dd *d_sigma_a, struct dd *d_sigma_s_prime)
{
    const struct dd one = { 1.0, 0.0 }, three = { 3.0, 0.0 };
    const struct dd d =
        r > LOBE_FAR_MM ? (struct dd){ r, 0.0 } : dd_root(dd_add(dd_product(r, r), dd_multiply(z, z)));
    struct dd x = dd_multiply(sigma_tr, d);
    if (x.hi > 1400.0)
        x = (struct dd){ 1400.0, 0.0 };
    const struct dd u = dd_divide(z, d), x_1 = dd_add(one, x);
    const struct dd p = dd_multiply(dd_multiply(u, u), dd_add(dd_multiply(x, dd_add(x, three)), three));
    const struct dd l_d2 = dd_divide(dd_divide(t->l, d), d), rest = dd_add(x_1, dd_negate(p));
    const struct dd brace_a =
        dd_negate(dd_multiply(t->alpha_prime, dd_add(t->slope_a, dd_multiply(l_d2, dd_add(x_1, rest)))));
    const struct dd inner =
        dd_add(dd_multiply(t->absorbed, x_1), dd_negate(dd_multiply(t->alpha_prime, rest)));
    const struct dd brace_s =
        dd_add(dd_multiply(l_d2, inner), dd_scale(-1.5, dd_multiply(t->alpha_prime, t->sigma_a)));
    int own;
    const struct dd weight = dd_multiply(u, dd_decay(x, &own));
    if (*exponent == INT_MIN)
        *exponent = own; /* of the real source, which is nearer */
    const double shift = own - *exponent < -300 ? 0.0 : ldexp(1.0, own - *exponent);
    *d_sigma_a = dd_add(*d_sigma_a, dd_scale(shift, dd_multiply(weight, brace_a)));
    *d_sigma_s_prime = dd_add(*d_sigma_s_prime, dd_scale(shift, dd_multiply(weight, brace_s)));
}

dipole_derivative dipole_rd_derivative(const dipole_coefficients *c, double r_mm)
{
    if (!is_distance(r_mm))
        return (dipole_derivative){ NAN, NAN };
    const struct dd z_r = { c->z_r_mm, c->z_r_low_mm }, z_v = { c->z_v_mm, c->z_v_low_mm };
    const struct dd sigma_tr = { c->sigma_tr_per_mm, c->sigma_tr_low_per_mm };
    const struct dd sigma_a = { c->sigma_a_per_mm, 0.0 };
    const struct dd sigma_t_prime = dd_sum(c->sigma_a_per_mm, c->sigma_s_prime_per_mm);
    const struct derivative_terms terms = {
        .alpha_prime = dd_scale(c->sigma_s_prime_per_mm, z_r),
        .absorbed = dd_scale(c->sigma_a_per_mm, z_r),
        .l = z_r,
        .sigma_a = sigma_a,
        .slope_a = dd_scale(1.5, dd_add(sigma_t_prime, sigma_a)),
    };
    struct dd d_sigma_a = { 0.0, 0.0 }, d_sigma_s_prime = { 0.0, 0.0 };
    const double r = lobe_distance(r_mm);
    int exponent = INT_MIN;
    derivative_add(&terms, z_r, sigma_tr, r, &exponent, &d_sigma_a, &d_sigma_s_prime);
    derivative_add(&terms, z_v, sigma_tr, r, &exponent, &d_sigma_a, &d_sigma_s_prime);
    return (dipole_derivative){ ldexp(d_sigma_a.hi / (4.0 * PI), exponent),
                                ldexp(d_sigma_s_prime.hi / (4.0 * PI), exponent) };
}

void dipole_rd_profile_gradient(const dipole_coefficients *c, const double *r_mm, size_t count,
                                double *values, double *d_log_sigma_a, double *d_log_sigma_s_prime)
{
    struct row_of_two pair;
    dipole_row_of_two_init(c, &pair);
    dipole_row_gradient(&pair.row, r_mm, count, values, d_log_sigma_a, d_log_sigma_s_prime);
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
