#include "check.h"

#include "libdipole/dipole.h"

#include <stdbool.h>
#include <string.h>

static double total_of(const dipole_medium *medium, dipole_model model, dipole_coefficients *coefficients)
{
    const dipole_layer base = { *medium, INFINITY };
    dipole_stack *stack;
    assert_true(dipole_stack_create(&base, 1, model, DIPOLE_FROM_ABOVE, &stack, NULL));
    const double total = dipole_stack_total(stack, DIPOLE_FACE_LIT);
    *coefficients = *dipole_stack_coefficients(stack, 0);
    dipole_stack_destroy(stack);
    return total;
}

/* Oracle: the way forth, whose totals have their own oracles. Both ends: R from 1e-30, and 1 - R from
 * 1e-15, which must be met in what is absorbed as well. */
static void reflectance_survives_the_round_trip(void **state)
{
    (void)state;
    struct rng rng = { .seed = 41 };
    for (int i = 0; i < 20000; i++) {
        const double reflectance = i % 3 == 0   ? log_uniform(&rng, 1e-30, 1.0)
                                   : i % 3 == 1 ? 1.0 - log_uniform(&rng, 1e-15, 0.5)
                                                : uniform(&rng, 0.0, 1.0);
        const double eta = log_uniform(&rng, 0.5, 3.0), length_mm = log_uniform(&rng, 1e-6, 1e6);
        const dipole_model model = i % 2 ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE;
        dipole_medium by_length, by_diffuse;
        dipole_coefficients c;
        dipole_status status;
        if (!dipole_medium_from_mean_free_path(reflectance, length_mm, eta, DIPOLE_FDR_EXACT, model,
                                               &by_length, &status) ||
            !dipole_medium_from_diffuse_mean_free_path(reflectance, length_mm, eta, DIPOLE_FDR_EXACT, model,
                                                       &by_diffuse, &status))
            fail_msg("R %.17g: %s", reflectance, status.message);
        assert_close(total_of(&by_length, model, &c), reflectance, 1e-12, "R, case %d, model %d", i,
                     (int)model);
        assert_close(c.mean_free_path_mm, length_mm, 1e-14, "mean free path, case %d", i);
        assert_close(total_of(&by_diffuse, model, &c), reflectance, 1e-12, "R, case %d, model %d", i,
                     (int)model);
        assert_close(1.0 / c.sigma_tr_per_mm, length_mm, 1e-12, "diffuse mean free path, case %d", i);
    }
}

/* Oracle: near R = 1 the deficit is (1 + c) x/2 or (1 + b) x to first order, x = sqrt(3 sigma_a/sigma_t'):
 * the absorption that makes it keeps all its digits. */
static void absorption_keeps_its_digits_near_one(void **state)
{
    (void)state;
    for (double deficit = 1e-15; deficit < 1e-8; deficit *= 10.0) {
        const double reflectance = 1.0 - deficit, exact = 1.0 - reflectance;
        for (int m = 0; m < 2; m++) {
            dipole_medium medium;
            const dipole_model model = m ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE;
            assert_true(dipole_medium_from_mean_free_path(reflectance, 1.0, 1.3, DIPOLE_FDR_EXACT, model,
                                                          &medium, NULL));
            dipole_coefficients c;
            assert_true(dipole_coefficients_init(&medium, &c, NULL));
            const double slope = 1.0 + 2.0 / 3.0 * c.boundary_a; /* 1 + b, and (1 + c)/2 as well */
            assert_close(slope * sqrt(3.0 * medium.sigma_a_per_mm), exact, 1e-12 + 10.0 * deficit, "1 - %g",
                         deficit);
        }
    }
}

/* Oracle: physics. A brighter medium of the same mean free path absorbs less. */
static void absorption_falls_as_reflectance_rises(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        double last = INFINITY;
        for (int i = 0; i <= 1000; i++) {
            dipole_medium medium;
            assert_true(dipole_medium_from_mean_free_path(i / 1000.0, 1.0, 1.4, DIPOLE_FDR_EXACT,
                                                          m ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE,
                                                          &medium, NULL));
            assert_true(medium.sigma_a_per_mm < last && medium.sigma_s_prime_per_mm >= 0.0);
            last = medium.sigma_a_per_mm;
        }
        assert_true(last == 0.0);
    }
}

/* Oracle: the messages that dipole.h promises; *out stays as it was. %s stands for the name of the length.
 */
static void bad_values_are_refused(void **state)
{
    (void)state;
    const struct {
        double reflectance, length_mm, eta;
        dipole_fdr_kind fdr_kind;
        dipole_model model;
        dipole_code code;
        const char *message;
    } rows[] = {
        { 1.1, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "diffuse_reflectance is 1.1, expected 0 to 1" },
        { -1e-300, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "diffuse_reflectance is -1e-300, expected 0 to 1" },
        { INFINITY, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "diffuse_reflectance is inf, expected 0 to 1" },
        { (double)NAN, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "diffuse_reflectance is nan, expected 0 to 1" },
        { 0.5, 0.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "%s is 0, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, -1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "%s is -1, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, INFINITY, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "%s is inf, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, (double)NAN, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "%s is nan, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, 9e-51, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "%s is 9e-51, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, 1.1e50, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "%s is 1.1e+50, expected > 0 (1e-50 to 1e+50)" },
        { 0.5, 1.0, 0.0, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE, DIPOLE_BAD_VALUE,
          "eta is 0, expected > 0 (0.1 to 10)" },
        { 0.5, 1.0, (double)NAN, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "eta is nan, expected > 0 (0.1 to 10)" },
        { 0.5, 1.0, INFINITY, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "eta is inf, expected > 0 (0.1 to 10)" },
        { 0.5, 1.0, 1.3, (dipole_fdr_kind)7, DIPOLE_MODEL_BEAM, DIPOLE_BAD_VALUE,
          "fdr_kind is 7, expected a dipole_fdr_kind" },
        { 0.5, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_MULTIPOLE, DIPOLE_NOT_SUPPORTED,
          "this model has no inverse, expected \"dipole\" or \"beam\"" },
        { 0.5, 1.0, 1.3, DIPOLE_FDR_EXACT, (dipole_model)9, DIPOLE_NOT_SUPPORTED,
          "this model has no inverse, expected \"dipole\" or \"beam\"" },
    };
    for (size_t i = 0; i < 2 * (sizeof rows / sizeof rows[0]); i++) {
        const char *const rest = strstr(rows[i / 2].message, "%s") ? rows[i / 2].message + 2 : NULL;
        char expected[128];
        snprintf(expected, sizeof expected, "%s%s",
                 rest == NULL ? ""
                 : i % 2      ? "diffuse_mean_free_path_mm"
                              : "mean_free_path_mm",
                 rest == NULL ? rows[i / 2].message : rest);
        dipole_medium out = { .eta = 42.0 };
        dipole_status status = { .code = DIPOLE_OK };
        assert_false(
            (i % 2 ? dipole_medium_from_diffuse_mean_free_path : dipole_medium_from_mean_free_path)(
                rows[i / 2].reflectance, rows[i / 2].length_mm, rows[i / 2].eta, rows[i / 2].fdr_kind,
                rows[i / 2].model, &out, &status));
        assert_int_equal(status.code, rows[i / 2].code);
        assert_string_equal(status.message, expected);
        assert_true(out.eta == 42.0);
    }
}

/* Oracle: dipole.h. What is asked for is legal, but no legal medium does it. */
static void media_out_of_range_are_refused(void **state)
{
    (void)state;
    dipole_medium out = { .eta = 42.0 };
    dipole_status status;
    assert_false(dipole_medium_from_diffuse_mean_free_path(1.0, 1.0, 1.3, DIPOLE_FDR_EXACT,
                                                           DIPOLE_MODEL_DIPOLE, &out, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message,
                        "diffuse_reflectance is 1, where light travels without end, expected less "
                        "beside diffuse_mean_free_path_mm");
    assert_false(dipole_medium_from_mean_free_path(1e-60, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM,
                                                   &out, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_non_null(strstr(status.message, ", expected >= 0 (0, or 1e-50 to 1e+50)"));
    assert_true(strncmp(status.message, "sigma_s_prime_per_mm is ", 24) == 0);
    assert_true(out.eta == 42.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reflectance_survives_the_round_trip),
        cmocka_unit_test(absorption_keeps_its_digits_near_one),
        cmocka_unit_test(absorption_falls_as_reflectance_rises),
        cmocka_unit_test(bad_values_are_refused),
        cmocka_unit_test(media_out_of_range_are_refused),
    };
    return cmocka_run_group_tests_name("material", tests, NULL, NULL);
}
