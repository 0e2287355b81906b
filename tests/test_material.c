#include "check.h"

#include "libdipole/dipole.h"

#include <stdbool.h>

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

/* Oracle: the messages that dipole.h promises; *out stays as it was. */
static void bad_values_are_refused(void **state)
{
    (void)state;
    dipole_medium out = { .eta = 42.0 };
    dipole_status status;
    assert_false(dipole_medium_from_mean_free_path(1.1, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE,
                                                   &out, &status));
    assert_string_equal(status.message, "diffuse_reflectance is 1.1, expected 0 to 1");
    assert_false(dipole_medium_from_mean_free_path((double)NAN, 1.0, 1.3, DIPOLE_FDR_EXACT,
                                                   DIPOLE_MODEL_DIPOLE, &out, &status));
    assert_string_equal(status.message, "diffuse_reflectance is nan, expected 0 to 1");
    assert_false(dipole_medium_from_mean_free_path(0.5, 0.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE,
                                                   &out, &status));
    assert_string_equal(status.message, "mean_free_path_mm is 0, expected > 0 (1e-50 to 1e+50)");
    assert_false(dipole_medium_from_mean_free_path(0.5, 1.0, 0.0, DIPOLE_FDR_EXACT, DIPOLE_MODEL_DIPOLE,
                                                   &out, &status));
    assert_string_equal(status.message, "eta is 0, expected > 0 (0.1 to 10)");
    assert_false(dipole_medium_from_mean_free_path(0.5, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_MULTIPOLE,
                                                   &out, &status));
    assert_int_equal(status.code, DIPOLE_NOT_SUPPORTED);
    assert_string_equal(status.message, "this model has no inverse, expected \"dipole\" or \"beam\"");
    assert_false(dipole_medium_from_diffuse_mean_free_path(1.0, 1.0, 1.3, DIPOLE_FDR_EXACT,
                                                           DIPOLE_MODEL_DIPOLE, &out, &status));
    assert_string_equal(status.message,
                        "diffuse_reflectance is 1, where light travels without end, expected less "
                        "beside diffuse_mean_free_path_mm");
    assert_true(out.eta == 42.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reflectance_survives_the_round_trip),
        cmocka_unit_test(absorption_keeps_its_digits_near_one),
        cmocka_unit_test(absorption_falls_as_reflectance_rises),
        cmocka_unit_test(bad_values_are_refused),
    };
    return cmocka_run_group_tests_name("material", tests, NULL, NULL);
}
