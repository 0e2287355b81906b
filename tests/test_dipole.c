#include "oracle.h"
#include "reference_file.h"

#define PI 3.14159265358979323846

static dipole_coefficients coefficients(double sigma_a, double sigma_s_prime, double eta,
                                        dipole_fdr_kind kind)
{
    const dipole_medium medium = { sigma_a, sigma_s_prime, eta, kind };
    dipole_coefficients c;
    dipole_status status;
    if (!dipole_coefficients_init(&medium, &c, &status))
        fail_msg("%s", status.message);
    return c;
}

/* Media far beyond the measured ones, one in eight at a corner. */
static dipole_coefficients random_medium(struct rng *rng)
{
    double sigma_a = log_uniform(rng, 1e-12, 1e6), sigma_s_prime = log_uniform(rng, 1e-12, 1e6);
    double eta = log_uniform(rng, 0.5, 3.0);
    switch (random_bits(rng) % 24) {
    case 0:
        sigma_a = 0.0;
        break;
    case 1:
        sigma_s_prime = 0.0;
        break;
    case 2:
        eta = 1.0;
        break;
    default:
        break;
    }
    return coefficients(sigma_a, sigma_s_prime, eta, DIPOLE_FDR_EXACT);
}

/* Distances around the medium's own lengths, and now and then 0 or far away. */
static double random_distance(struct rng *rng, const dipole_coefficients *c)
{
    switch (random_bits(rng) % 16) {
    case 0:
        return 0.0;
    case 1:
        return log_uniform(rng, 1e-9, 1e9);
    default:
        return c->z_r_mm * log_uniform(rng, 1e-4, 1e4);
    }
}

/* What rounding sigma_tr d in the exponent costs, on top of a few ULP. */
static double tolerance(const dipole_coefficients *c, double r_mm)
{
    return 2e-15 + 4e-16 * fmin(c->sigma_tr_per_mm * hypot(r_mm, c->z_r_mm), 1e6);
}

/* Doubles below the normal range have an absolute error instead. */
static bool is_subnormal(double value)
{
    return fabs(value) < 1e-290;
}

/* Oracle: the textbook formulas with 512 bits, over 20,000 random media and distances. */
static void everything_agrees_with_high_precision(void **state)
{
    (void)state;
    struct rng rng = { .seed = 11 };
    for (int i = 0; i < 20000; i++) {
        const dipole_coefficients c = random_medium(&rng);
        const double r = random_distance(&rng, &c), hi = r * (1.0 + log_uniform(&rng, 1e-12, 10.0));
        struct oracle o;
        oracle_init(&o, &c);
        const struct {
            const char *name;
            double found, expected;
        } pairs[] = {
            { "rd", dipole_rd_per_mm2(&c, r), oracle_rd(&o, r) },
            { "within", dipole_reflectance_within(&c, r), oracle_between(&o, 0.0, r) },
            { "tail", dipole_tail_fraction(&c, r), oracle_tail(&o, r) },
            { "total", dipole_diffuse_reflectance(&c), oracle_between(&o, 0.0, -1.0) },
            { "spectrum", dipole_spectrum(&c, 1.0 / fmax(r, 1e-9)),
              oracle_spectrum(&o, 1.0 / fmax(r, 1e-9)) },
            { "ring", dipole_rd_ring_mean_per_mm2(&c, r, hi) * (PI * (hi - r) * (hi + r)),
              oracle_between(&o, r, hi) },
        };
        for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
            const double spectral = pairs[k].name[0] == 's' ? 4e-16 * c.z_v_mm / fmax(r, 1e-9) : 0.0;
            if (is_subnormal(pairs[k].expected) || is_subnormal(pairs[k].expected / fmax(hi * hi, 1.0)))
                assert_true(pairs[k].found >= 0.0 && pairs[k].found <= fmax(1.0, hi * hi) * 1e-289);
            else
                assert_close(pairs[k].found, pairs[k].expected, 2.0 * tolerance(&c, r) + spectral,
                             "%s, case %d: sigma_a %.17g, sigma_s' %.17g, eta %.17g, r %.17g",
                             pairs[k].name, i, c.sigma_a_per_mm, c.sigma_s_prime_per_mm, c.eta, r);
        }
        oracle_clear(&o);
    }
}

/* Oracle: mpmath with up to 700 digits, tests/reference/dipole_exact.csv: value, total, derivatives. */
static void profile_agrees_with_the_reference_file(void **state)
{
    (void)state;
    struct reference_file rows;
    reference_open(&rows, "dipole_exact.csv");
    int count = 0;
    while (reference_next(&rows)) {
        const double sigma_a = reference_number(&rows, "sigma_a_per_mm"),
                     r = reference_number(&rows, "r_mm");
        const double sigma_s_prime = reference_number(&rows, "sigma_sp_per_mm");
        const double eta = reference_number(&rows, "eta_rel");
        const char *const branch = reference_text(&rows, "fdr_branch");
        if (eta == 1.0 && strcmp(branch, "lt") == 0)
            continue; /* the polynomial for eta < 1 is not defined at 1; ours takes the other branch there
                       */
        const dipole_coefficients c =
            coefficients(sigma_a, sigma_s_prime, eta,
                         strcmp(branch, "exact0") == 0 ? DIPOLE_FDR_EXACT : DIPOLE_FDR_POLYNOMIAL);
        const char *const id = reference_text(&rows, "id");
        const double bound = 1e-13 + tolerance(&c, r);
        assert_close(c.boundary_a, reference_number(&rows, "A"), 1e-14, "A, row %s", id);
        assert_close(c.z_v_mm, reference_number(&rows, "z_v_mm"), 1e-14, "z_v, row %s", id);
        assert_close(c.sigma_tr_per_mm, reference_number(&rows, "sigma_tr_per_mm"), 1e-15, "row %s", id);
        assert_close(dipole_diffuse_reflectance(&c), reference_number(&rows, "Rd_total"), 1e-13, "row %s",
                     id);
        const double expected = reference_number(&rows, "Rd_nearest_double");
        const double found = dipole_rd_per_mm2(&c, r);
        if (expected < 1e-300)
            assert_true(fabs(found - expected) <= 1e-300);
        else
            assert_close(found, expected, bound, "Rd, row %s", id);
        const dipole_derivative d = dipole_rd_derivative(&c, r);
        const double d_a = reference_number(&rows, "dRd_dsigma_a_per_mm");
        const double d_s = reference_number(&rows, "dRd_dsigma_sp_per_mm");
        if (fabs(d_a) > 1e-290)
            assert_close(d.d_sigma_a, d_a, 10.0 * bound, "dRd/dsigma_a, row %s", id);
        if (fabs(d_s) > 1e-290)
            assert_close(d.d_sigma_s_prime, d_s, 10.0 * bound, "dRd/dsigma_s', row %s", id);
        count++;
    }
    assert_true(count > 80);
}

/* Oracle: central differences of the value with the step that leaves 1e-9. */
static void gradients_are_the_slopes_of_the_values(void **state)
{
    (void)state;
    struct rng rng = { .seed = 12 };
    const double step = 1e-5;
    for (int i = 0; i < 2000; i++) {
        const double sigma_a = log_uniform(&rng, 1e-6, 1e2), sigma_s_prime = log_uniform(&rng, 1e-3, 1e3);
        const double eta = log_uniform(&rng, 0.6, 2.5);
        dipole_coefficients c[5];
        for (int k = 0; k < 5; k++) {
            const double factor_a = k == 1 ? exp(step) : k == 2 ? exp(-step) : 1.0;
            const double factor_s = k == 3 ? exp(step) : k == 4 ? exp(-step) : 1.0;
            c[k] = coefficients(sigma_a * factor_a, sigma_s_prime * factor_s, eta, DIPOLE_FDR_EXACT);
        }
        const double r = c[0].z_r_mm * log_uniform(&rng, 1e-2, 30.0);
        const double value = dipole_rd_per_mm2(&c[0], r), total = dipole_diffuse_reflectance(&c[0]);
        const dipole_gradient g = dipole_rd_gradient(&c[0], r),
                              t = dipole_diffuse_reflectance_gradient(&c[0]);
        const double scale = 1.0 + pow(c[0].sigma_tr_per_mm * r, 2.0);
        const struct {
            double found, expected, unit;
        } rows[] = {
            { g.d_log_sigma_a, (dipole_rd_per_mm2(&c[1], r) - dipole_rd_per_mm2(&c[2], r)) / (2 * step),
              value },
            { g.d_log_sigma_s_prime,
              (dipole_rd_per_mm2(&c[3], r) - dipole_rd_per_mm2(&c[4], r)) / (2 * step), value },
            { t.d_log_sigma_a,
              (dipole_diffuse_reflectance(&c[1]) - dipole_diffuse_reflectance(&c[2])) / (2 * step), total },
            { t.d_log_sigma_s_prime,
              (dipole_diffuse_reflectance(&c[3]) - dipole_diffuse_reflectance(&c[4])) / (2 * step), total },
        };
        for (int k = 0; k < 4; k++)
            if (fabs(rows[k].found - rows[k].expected) > 1e-8 * rows[k].unit * scale)
                fail_msg("row %d, sigma_a %g, sigma_s' %g, r %g: found %.12g, expected %.12g", k, sigma_a,
                         sigma_s_prime, r, rows[k].found, rows[k].expected);
    }
    /* the edges that logarithms hide: finite and 0 */
    const dipole_coefficients clear = coefficients(1.0, 0.0, 1.4, DIPOLE_FDR_EXACT);
    const dipole_coefficients white = coefficients(0.0, 1.0, 1.4, DIPOLE_FDR_EXACT);
    assert_true(dipole_rd_gradient(&clear, 1.0).d_log_sigma_s_prime == 0.0);
    assert_true(dipole_rd_gradient(&white, 1.0).d_log_sigma_a == 0.0);
    assert_true(dipole_diffuse_reflectance_gradient(&white).d_log_sigma_a == 0.0);
    assert_true(dipole_rd_derivative(&white, 1.0).d_sigma_a < 0.0);
}

/* Oracle: physics. Positive, falling with distance, total at most 1, within + tail = total. */
static void profile_is_monotone_and_keeps_energy(void **state)
{
    (void)state;
    struct rng rng = { .seed = 13 };
    for (int i = 0; i < 5000; i++) {
        const dipole_coefficients c = random_medium(&rng);
        const double total = dipole_diffuse_reflectance(&c);
        assert_true(total >= 0.0 && total <= 1.0);
        double last_rd = INFINITY, last_within = 0.0, last_tail = 1.0;
        for (int k = -60; k <= 60; k++) {
            const double r = c.z_r_mm * pow(10.0, k / 10.0);
            const double rd = dipole_rd_per_mm2(&c, r), within = dipole_reflectance_within(&c, r);
            const double tail = dipole_tail_fraction(&c, r);
            assert_true(rd >= 0.0 && rd <= last_rd * (1.0 + 1e-13));
            assert_true(within >= last_within * (1.0 - 1e-13) && within <= total * (1.0 + 1e-13));
            assert_true(tail >= 0.0 && tail <= last_tail * (1.0 + 1e-13));
            if (total > 0.0)
                assert_close(within / total + tail, 1.0, 1e-13, "sigma_a %g, sigma_s' %g, r %g",
                             c.sigma_a_per_mm, c.sigma_s_prime_per_mm, r);
            last_rd = rd;
            last_within = within;
            last_tail = tail;
        }
    }
}

/* Oracle: scaling. Lengths times s: Rd times 1/s^2, totals unchanged (exactly, for powers of two). */
static void scaling_lengths_scales_the_profile(void **state)
{
    (void)state;
    struct rng rng = { .seed = 14 };
    for (int i = 0; i < 1000; i++) {
        const dipole_coefficients c =
            coefficients(log_uniform(&rng, 1e-3, 1.0), log_uniform(&rng, 0.1, 10.0), 1.3, DIPOLE_FDR_EXACT);
        const double s = ldexp(1.0, (int)uniform(&rng, -40.0, 40.0)), r = log_uniform(&rng, 1e-3, 1e2);
        const dipole_coefficients scaled =
            coefficients(c.sigma_a_per_mm / s, c.sigma_s_prime_per_mm / s, 1.3, DIPOLE_FDR_EXACT);
        assert_close(dipole_rd_per_mm2(&scaled, r * s) * s * s, dipole_rd_per_mm2(&c, r), 1e-15 + 1e-15 * r,
                     "scale %g", s);
        assert_close(dipole_diffuse_reflectance(&scaled), dipole_diffuse_reflectance(&c), 1e-15, "scale %g",
                     s);
    }
}

/* Oracle: erratum E1. With the printed sigma_t' in the denominator the integral over the plane would be
 * total / sigma_t', a length; the right profile integrates to the total (trapezoid in log r). */
static void profile_integrates_to_the_total(void **state)
{
    (void)state;
    struct rng rng = { .seed = 15 };
    for (int i = 0; i < 50; i++) {
        const dipole_coefficients c =
            coefficients(log_uniform(&rng, 1e-3, 1.0), log_uniform(&rng, 0.1, 10.0),
                         log_uniform(&rng, 0.7, 2.0), DIPOLE_FDR_EXACT);
        double sum = 0.0;
        const double step = 0.02;
        for (double log_r = log(c.z_r_mm) - 16.0; log_r < log(c.z_r_mm) + 16.0; log_r += step) {
            const double r = exp(log_r);
            sum += 2.0 * PI * r * r * dipole_rd_per_mm2(&c, r) * step;
        }
        const double lost = dipole_tail_fraction(&c, c.z_r_mm * exp(16.0));
        assert_close(sum, dipole_diffuse_reflectance(&c) * (1.0 - lost), 1e-9, "sigma_t' %g",
                     c.sigma_t_prime_per_mm);
        if (fabs(c.sigma_t_prime_per_mm - 1.0) > 0.1)
            assert_true(fabs(sum / c.sigma_t_prime_per_mm - dipole_diffuse_reflectance(&c)) > 0.01 * sum);
    }
}

/* Oracle: erratum E3. sigma_t' is the sum; printed as sigma_s' twice, it would miss absorption. */
static void reduced_extinction_is_the_sum(void **state)
{
    (void)state;
    const dipole_coefficients c = coefficients(0.48, 1.01, 1.3, DIPOLE_FDR_EXACT);
    assert_close(c.sigma_t_prime_per_mm, 1.49, 1e-15, "skin1 blue");
    assert_close(c.mean_free_path_mm, 1.0 / 1.49, 1e-15, "skin1 blue");
    assert_close(c.alpha_prime, 1.01 / 1.49, 1e-15, "skin1 blue");
}

/* Oracle: the measured materials' published totals, 35 of 36 within 0.01 (jensen2001.csv); here marble's.
 */
static void marble_reflects_what_was_measured(void **state)
{
    (void)state;
    const double expected[3] = { 0.83, 0.79, 0.75 };
    const double sigma_a[3] = { 0.0021, 0.0041, 0.0071 }, sigma_s_prime[3] = { 2.19, 2.62, 3.00 };
    for (int i = 0; i < 3; i++) {
        const dipole_coefficients c = coefficients(sigma_a[i], sigma_s_prime[i], 1.5, DIPOLE_FDR_EXACT);
        assert_true(fabs(dipole_diffuse_reflectance(&c) - expected[i]) < 0.01);
    }
}

/* Oracle: the messages that dipole.h promises; *out stays as it was. */
static void bad_media_are_refused(void **state)
{
    (void)state;
    const struct {
        dipole_medium medium;
        const char *message;
    } rows[] = {
        { { -0.2, 1.0, 1.3, DIPOLE_FDR_EXACT },
          "sigma_a_per_mm is -0.2, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { { 0.1, (double)NAN, 1.3, DIPOLE_FDR_EXACT },
          "sigma_s_prime_per_mm is nan, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { { (double)INFINITY, 1.0, 1.3, DIPOLE_FDR_EXACT },
          "sigma_a_per_mm is inf, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { { 1e-51, 1.0, 1.3, DIPOLE_FDR_EXACT },
          "sigma_a_per_mm is 1e-51, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { { 0.0, 0.0, 1.3, DIPOLE_FDR_EXACT },
          "sigma_a_per_mm and sigma_s_prime_per_mm are both 0, expected one > 0" },
        { { 0.1, 1.0, 0.0, DIPOLE_FDR_EXACT }, "eta is 0, expected > 0 (0.1 to 10)" },
        { { 0.1, 1.0, -1.3, DIPOLE_FDR_EXACT }, "eta is -1.3, expected > 0 (0.1 to 10)" },
        { { 0.1, 1.0, 11.0, DIPOLE_FDR_EXACT }, "eta is 11, expected > 0 (0.1 to 10)" },
        { { 0.1, 1.0, 9.0, DIPOLE_FDR_POLYNOMIAL },
          "eta is 9, where the polynomial gives Fdr = 1.30151, expected an eta where it lies in 0 to 1, or "
          "fdr "
          "\"exact\"" },
        { { 0.1, 1.0, 1.3, (dipole_fdr_kind)7 }, "fdr_kind is 7, expected a dipole_fdr_kind" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        dipole_coefficients c = { .eta = 42.0 };
        dipole_status status = { 0 };
        assert_false(dipole_coefficients_init(&rows[i].medium, &c, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_string_equal(status.message, rows[i].message);
        assert_true(c.eta == 42.0);
        assert_false(dipole_coefficients_init(&rows[i].medium, &c, NULL));
    }
}

/* Oracle: the ranges in dipole.h. */
static void outside_the_range_is_nan(void **state)
{
    (void)state;
    const dipole_coefficients c = coefficients(0.01, 1.0, 1.3, DIPOLE_FDR_EXACT);
    const double bad[] = { -1.0, -1e-300, -INFINITY, (double)NAN };
    for (int i = 0; i < 4; i++) {
        assert_true(isnan(dipole_rd_per_mm2(&c, bad[i])));
        assert_true(isnan(dipole_reflectance_within(&c, bad[i])));
        assert_true(isnan(dipole_tail_fraction(&c, bad[i])));
        assert_true(isnan(dipole_spectrum(&c, bad[i])));
        assert_true(isnan(dipole_rd_derivative(&c, bad[i]).d_sigma_a));
        assert_true(isnan(dipole_rd_gradient(&c, bad[i]).d_log_sigma_s_prime));
        double value, d_sigma_a, d_sigma_s_prime;
        dipole_rd_profile_per_mm2(&c, &bad[i], 1, &value);
        assert_true(isnan(value));
        dipole_rd_profile_gradient(&c, &bad[i], 1, &value, &d_sigma_a, &d_sigma_s_prime);
        assert_true(isnan(value) && isnan(d_sigma_a) && isnan(d_sigma_s_prime));
    }
    assert_true(isnan(dipole_rd_ring_mean_per_mm2(&c, 2.0, 1.0)));
    assert_true(isnan(dipole_rd_ring_mean_per_mm2(&c, -1.0, 1.0)));
    /* and the far end is not */
    assert_true(dipole_rd_per_mm2(&c, 1e308) == 0.0 && dipole_rd_per_mm2(&c, (double)INFINITY) == 0.0);
    assert_true(dipole_tail_fraction(&c, (double)INFINITY) == 0.0);
    assert_close(dipole_reflectance_within(&c, (double)INFINITY), dipole_diffuse_reflectance(&c), 1e-15,
                 "inf");
    assert_true(dipole_rd_ring_mean_per_mm2(&c, 0.0, 1e308) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(everything_agrees_with_high_precision),
        cmocka_unit_test(profile_agrees_with_the_reference_file),
        cmocka_unit_test(gradients_are_the_slopes_of_the_values),
        cmocka_unit_test(profile_is_monotone_and_keeps_energy),
        cmocka_unit_test(scaling_lengths_scales_the_profile),
        cmocka_unit_test(profile_integrates_to_the_total),
        cmocka_unit_test(reduced_extinction_is_the_sum),
        cmocka_unit_test(marble_reflects_what_was_measured),
        cmocka_unit_test(bad_media_are_refused),
        cmocka_unit_test(outside_the_range_is_nan),
    };
    return cmocka_run_group_tests_name("dipole", tests, NULL, NULL);
}
