#include "reference_file.h"

#include "libdipole/internal.h"

#include <mpfr.h>

/* Oracle: the textbook amplitudes in long double, away from the cancellation they have near eta = 1. */
static void reflectance_is_the_textbook_one(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    for (int i = 0; i < 100000; i++) {
        const double eta = log_uniform(&rng, 0.1, 10.0), c = uniform(&rng, 0.0, 1.0);
        const long double sine2 = (1.0L - (long double)c * c) / ((long double)eta * eta);
        long double expected = 1.0L;
        if (sine2 < 1.0L) {
            const long double t = sqrtl(1.0L - sine2);
            const long double r_s = (c - eta * t) / (c + eta * t), r_p = (eta * c - t) / (eta * c + t);
            expected = 0.5L * (r_s * r_s + r_p * r_p);
        }
        const double tolerance = fabs(eta - 1.0) > 0.01 ? 1e-9 : 1e-6;
        /* just inside the critical angle F is as steep as a square root */
        if (sine2 < 1.0L - 1e-6L || sine2 > 1.0L + 1e-6L)
            assert_close(dipole_fresnel_reflectance(eta, c), (double)expected, tolerance,
                         "eta %.17g, cosine %.17g", eta, c);
    }
}

/* Oracle: limits. Normal incidence ((eta-1)/(eta+1))^2, grazing 1, nothing at eta = 1, Brewster's angle. */
static void reflectance_has_its_limits(void **state)
{
    (void)state;
    struct rng rng = { .seed = 2 };
    for (int i = 0; i < 1000; i++) {
        const double eta = log_uniform(&rng, 0.1, 10.0), amplitude = (eta - 1.0) / (eta + 1.0);
        assert_close(dipole_fresnel_reflectance(eta, 1.0), amplitude * amplitude, 1e-13, "eta %g", eta);
        assert_close(dipole_fresnel_reflectance_schlick(eta, 1.0), amplitude * amplitude, 1e-13, "eta %g",
                     eta);
        assert_close(dipole_fresnel_reflectance(eta, 0.0), 1.0, 1e-15, "eta %g", eta);
        assert_close(dipole_fresnel_reflectance_schlick(eta, 0.0), 1.0, 1e-15, "eta %g", eta);
        assert_true(dipole_fresnel_reflectance(1.0, uniform(&rng, 0.0, 1.0)) == 0.0);
        /* near eta = 1 at normal incidence (d/2)^2 to first order: no digits cancel */
        const double tiny = log_uniform(&rng, 1e-15, 1e-9), above = 1.0 + tiny;
        assert_close(dipole_fresnel_reflectance(above, 1.0), pow((above - 1.0) / 2.0, 2.0), 3e-9, "1 + %g",
                     tiny);
        const double brewster = 1.0 / sqrt(1.0 + eta * eta);
        const double r_s = (1.0 - eta * eta) / (1.0 + eta * eta);
        if (eta > 1.0)
            assert_close(dipole_fresnel_reflectance(eta, brewster), 0.5 * r_s * r_s, 1e-12, "eta %g", eta);
    }
}

/* Oracle: the exact reflectance; Schlick's error for common indices (1.3 to 1.6) is stated in theory.md T1.
 */
static void schlick_is_near_the_exact_reflectance(void **state)
{
    (void)state;
    double worst = 0.0;
    for (int e = 0; e <= 30; e++)
        for (int i = 0; i <= 1000; i++) {
            const double eta = 1.3 + 0.01 * e, c = i / 1000.0;
            worst = fmax(worst, fabs(dipole_fresnel_reflectance_schlick(eta, c) -
                                     dipole_fresnel_reflectance(eta, c)));
        }
    print_message("  largest error of Schlick, eta 1.3 to 1.6: %.4f\n", worst);
    assert_true(worst < 0.07);
}

/* Oracle: mpmath quadrature with 60 digits, tests/reference/fresnel_internal.csv. */
static void diffuse_reflectance_agrees_with_high_precision(void **state)
{
    (void)state;
    struct reference_file rows;
    reference_open(&rows, "fresnel_internal.csv");
    int count = 0;
    double worst_fit = 0.0;
    while (reference_next(&rows)) {
        const double eta = reference_number(&rows, "eta_rel");
        const double fdr = reference_number(&rows, "Fdr_exact"), a = reference_number(&rows, "A_exact");
        /* the file's eta is decimal: rounding it to binary moves Fdr, which falls with eta - 1 */
        const double rounding = eta == 1.0 ? 0.0 : 1.2e-16 / fabs(eta - 1.0);
        assert_close(dipole_fdr_exact(eta), fdr, 1e-14 + rounding, "Fdr, eta %g", eta);
        assert_close((1.0 + dipole_fdr_exact(eta)) / dipole_fdt_exact(eta), a, 1e-14, "A, eta %g", eta);
        if (eta != 1.0)
            /* a sum of terms of order 1: rounding is absolute */
            assert_close(dipole_fdr_polynomial(eta), reference_number(&rows, "Fdr_fit"),
                         1e-15 / dipole_fdr_polynomial(eta), "fit, eta %g", eta);
        if (eta >= 0.7 && eta <= 2.2)
            worst_fit = fmax(worst_fit, fabs(dipole_fdr_polynomial(eta) - fdr));
        count++;
    }
    assert_true(count > 50);
    /* as theory.md T3 states */
    print_message("  largest error of the polynomial, eta 0.7 to 2.2: %.5f\n", worst_fit);
    assert_true(worst_fit <= 0.0017 + 1e-4);
}

/* 2 int F mu dmu for light from the thin side, index ratio x > 1: Walsh's closed form, which cancels
 * badly near 1 and is evaluated with 600 bits here. */
static double walsh_outside(double excess)
{
    enum { BITS = 600 };
    mpfr_t x, x2, a, b, sum;
    mpfr_inits2(BITS, x, x2, a, b, sum, (mpfr_ptr)0);
    mpfr_set_d(x, excess, MPFR_RNDN);
    mpfr_add_ui(x, x, 1, MPFR_RNDN);
    mpfr_sqr(x2, x, MPFR_RNDN);
    /* 1/2 + (x-1)(3x+1)/(6 (x+1)^2) */
    mpfr_mul_ui(a, x, 3, MPFR_RNDN);
    mpfr_add_ui(a, a, 1, MPFR_RNDN);
    mpfr_sub_ui(b, x, 1, MPFR_RNDN);
    mpfr_mul(a, a, b, MPFR_RNDN);
    mpfr_add_ui(b, x, 1, MPFR_RNDN);
    mpfr_sqr(b, b, MPFR_RNDN);
    mpfr_mul_ui(b, b, 6, MPFR_RNDN);
    mpfr_div(sum, a, b, MPFR_RNDN);
    mpfr_set_d(a, 0.5, MPFR_RNDN);
    mpfr_add(sum, sum, a, MPFR_RNDN);
    /* x^2 (x^2-1)^2/(x^2+1)^3 log((x-1)/(x+1)) */
    mpfr_t c, d;
    mpfr_inits2(BITS, c, d, (mpfr_ptr)0);
    mpfr_sub_ui(a, x, 1, MPFR_RNDN);
    mpfr_add_ui(b, x, 1, MPFR_RNDN);
    mpfr_div(a, a, b, MPFR_RNDN);
    mpfr_log(a, a, MPFR_RNDN);
    mpfr_sub_ui(b, x2, 1, MPFR_RNDN); /* b = x^2 - 1 */
    mpfr_add_ui(c, x2, 1, MPFR_RNDN); /* c = x^2 + 1 */
    mpfr_mul(a, a, x2, MPFR_RNDN);
    mpfr_mul(a, a, b, MPFR_RNDN);
    mpfr_mul(a, a, b, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_add(sum, sum, a, MPFR_RNDN);
    /* - 2 x^3 (x^2 + 2x - 1)/((x^2+1)(x^4-1)) */
    mpfr_mul_ui(a, x, 2, MPFR_RNDN);
    mpfr_add(a, a, x2, MPFR_RNDN);
    mpfr_sub_ui(a, a, 1, MPFR_RNDN);
    mpfr_mul(a, a, x2, MPFR_RNDN);
    mpfr_mul(a, a, x, MPFR_RNDN);
    mpfr_mul_ui(a, a, 2, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, b, MPFR_RNDN);
    mpfr_sub(sum, sum, a, MPFR_RNDN);
    /* + 8 x^4 (x^4+1)/((x^2+1)(x^4-1)^2) log x */
    mpfr_log(a, x, MPFR_RNDN);
    mpfr_sqr(d, x2, MPFR_RNDN);
    mpfr_mul(a, a, d, MPFR_RNDN);
    mpfr_add_ui(d, d, 1, MPFR_RNDN);
    mpfr_mul(a, a, d, MPFR_RNDN);
    mpfr_mul_ui(a, a, 8, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, c, MPFR_RNDN);
    mpfr_div(a, a, b, MPFR_RNDN);
    mpfr_div(a, a, b, MPFR_RNDN);
    mpfr_add(sum, sum, a, MPFR_RNDN);
    const double result = mpfr_get_d(sum, MPFR_RNDN);
    mpfr_clears(x, x2, a, b, c, d, sum, (mpfr_ptr)0);
    return result;
}

/* Oracle: Walsh's closed form in 600 bits, down to eta = 1 + 1e-12 and up to 10, and reciprocity. */
static void diffuse_reflectance_agrees_with_the_closed_form(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 2000; i++) {
        const double wished = log_uniform(&rng, 1e-12, 9.0), eta = 1.0 + wished, excess = eta - 1.0;
        const double outside = walsh_outside(excess);
        assert_close(1.0 - dipole_fdt_outside(eta), outside, 1e-14 / outside, "1 + %.17g", excess);
        assert_close(dipole_fdr_exact(eta), (excess * (2.0 + excess) + outside) / (eta * eta), 1e-14,
                     "1 + %.17g", excess);
        assert_close(dipole_fdt_exact(eta), (1.0 - outside) / (eta * eta), 1e-13, "1 + %.17g", excess);
        /* seen from the other side; 1/(1 - x) = 1 + x/(1 - x) keeps the excess exact */
        const double small = excess / eta, inverse = 1.0 - small;
        if (inverse >= DIPOLE_ETA_MIN)
            assert_close(dipole_fdr_exact(inverse), walsh_outside((1.0 - inverse) / inverse), 1e-14,
                         "1 - %.17g", small);
    }
    assert_true(dipole_fdr_exact(1.0) == 0.0 && dipole_fdt_exact(1.0) == 1.0);
}

/* Oracle: the erratum E2. 0.668 gives Fdr = 0.445 at eta = 1.3; 0.0668, as printed, would be negative. */
static void polynomial_has_the_corrected_constant(void **state)
{
    (void)state;
    assert_close(dipole_fdr_polynomial(1.3), 0.4447628402, 1e-9, "eta 1.3");
    assert_close(dipole_fdr_polynomial(1.3), dipole_fdr_exact(1.3), 5e-3, "eta 1.3 against the exact");
    assert_true(dipole_fdr_polynomial(1.3) - 0.668 + 0.0668 < 0.0);
    /* and its jump at 1, where the truth is 0 */
    assert_close(dipole_fdr_polynomial(1.0), 0.0016, 1e-12, "from above");
    assert_close(dipole_fdr_polynomial(nextafter(1.0, 0.0)), 0.0017, 1e-12, "from below");
}

/* Oracle: the ranges in dipole.h. */
static void outside_the_range_is_nan(void **state)
{
    (void)state;
    assert_true(isnan(dipole_fresnel_reflectance(0.0, 0.5)));
    assert_true(isnan(dipole_fresnel_reflectance(-1.0, 0.5)));
    assert_true(isnan(dipole_fresnel_reflectance(1.5, 1.0 + 1e-15)));
    assert_true(isnan(dipole_fresnel_reflectance(1.5, -1e-300)));
    assert_true(isnan(dipole_fresnel_reflectance((double)NAN, 0.5)));
    assert_true(isnan(dipole_fresnel_reflectance_schlick(1.5, 2.0)));
    assert_true(isnan(dipole_fdr_exact(0.0999)) && isnan(dipole_fdr_exact(10.001)));
    assert_true(isnan(dipole_fdt_exact((double)NAN)) && isnan(dipole_fdt_outside(-1.0)));
    assert_true(isnan(dipole_fdr_polynomial(0.0)));
}

/* Oracle: the midpoint rule over one side of the critical cosine, in mu^2 = lo + (hi - lo) u^2 (3 - 2u);
 * and means over neighbouring ranges add up to that over all. */
static void means_over_ranges_agree_with_midpoints(void **state)
{
    (void)state;
    struct rng rng = { .seed = 6 };
    double worst = 0.0;
    for (int i = 0; i < 300; i++) {
        const double eta = i % 3 == 0 ? 1.0 + log_uniform(&rng, 1e-9, 1e-2) : log_uniform(&rng, 0.1, 10.0);
        const double edges[4] = { 0.0, uniform(&rng, 0.05, 0.35), uniform(&rng, 0.45, 0.9), 1.0 };
        const double critical2 = fmax(0.0, (eta - 1.0) * (eta + 1.0) / (eta * eta));
        double all[2] = { 0.0, 0.0 };
        for (int range = 0; range < 3; range++) {
            double reflected, transmitted;
            dipole_fresnel_mean_inside(eta, edges[range], edges[range + 1], &reflected, &transmitted);
            const double width = edges[range + 1] - edges[range];
            all[0] += width * reflected;
            all[1] += width * transmitted;
            assert_close(reflected + transmitted, 1.0, 1e-12, "eta %.17g", eta);
            const double lo = fmax(edges[range], critical2), hi = edges[range + 1];
            double sum = 0.0;
            for (int n = 0; lo < hi && n < 2000; n++) {
                const double u = (n + 0.5) / 2000.0, mu2 = lo + (hi - lo) * u * u * (3.0 - 2.0 * u);
                sum += 6.0 * u * (1.0 - u) / 2000.0 * (hi - lo) *
                       (1.0 - dipole_fresnel_reflectance(1.0 / eta, sqrt(mu2)));
            }
            worst = fmax(worst, fabs(transmitted - sum / width));
        }
        assert_close(all[0], dipole_fdr_exact(eta), 1e-13, "eta %.17g", eta);
        assert_close(all[1], dipole_fdt_exact(eta), 1e-13, "eta %.17g", eta);
    }
    print_message("  worst difference to midpoints %.1e\n", worst);
    assert_true(worst < 1e-5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reflectance_is_the_textbook_one),
        cmocka_unit_test(reflectance_has_its_limits),
        cmocka_unit_test(schlick_is_near_the_exact_reflectance),
        cmocka_unit_test(diffuse_reflectance_agrees_with_high_precision),
        cmocka_unit_test(diffuse_reflectance_agrees_with_the_closed_form),
        cmocka_unit_test(polynomial_has_the_corrected_constant),
        cmocka_unit_test(means_over_ranges_agree_with_midpoints),
        cmocka_unit_test(outside_the_range_is_nan),
    };
    return cmocka_run_group_tests_name("fresnel", tests, NULL, NULL);
}
