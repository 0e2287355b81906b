#include "check.h"

#include "libdipole/dipole.h"

#include <string.h>

#define PI 3.14159265358979323846

static dipole_coefficients coefficients(double sigma_a, double sigma_s_prime, double eta)
{
    const dipole_medium medium = { sigma_a, sigma_s_prime, eta, DIPOLE_FDR_EXACT };
    dipole_coefficients c;
    dipole_status status;
    if (!dipole_coefficients_init(&medium, &c, &status))
        fail_msg("%s", status.message);
    return c;
}

static const double origin[3] = { 0.0, 0.0, 0.0 }, up[3] = { 0.0, 0.0, 1.0 };

/* Oracle: over a flat surface the three-dimensional form is the profile, in any position and direction. */
static void over_a_flat_surface_it_is_the_profile(void **state)
{
    (void)state;
    struct rng rng = { .seed = 51 };
    for (int i = 0; i < 1000; i++) {
        const dipole_coefficients c = coefficients(
            log_uniform(&rng, 1e-4, 10.0), log_uniform(&rng, 0.01, 10.0), log_uniform(&rng, 0.7, 2.0));
        dipole_source sources[DIPOLE_SOURCE_LIMIT];
        assert_int_equal(dipole_sources_init(&c, DIPOLE_MODEL_DIPOLE, 0.01, 1.0, sources, NULL), 2);
        /* a normal and a direction across it, from two angles */
        const double polar = uniform(&rng, 0.0, PI), turn = uniform(&rng, 0.0, 2.0 * PI);
        const double normal[3] = { sin(polar) * cos(turn), sin(polar) * sin(turn), cos(polar) };
        const double across[3] = { cos(polar) * cos(turn), cos(polar) * sin(turn), -sin(polar) };
        const double in[3] = { uniform(&rng, -5.0, 5.0), uniform(&rng, -5.0, 5.0),
                               uniform(&rng, -5.0, 5.0) };
        const double r = c.z_r_mm * log_uniform(&rng, 0.1, 30.0);
        double out[3];
        for (int axis = 0; axis < 3; axis++)
            out[axis] = in[axis] + r * across[axis];
        /* r^2 comes out of a difference of squares, and positions of 5 mm have errors of 1e-15 mm */
        const double tolerance = 1e-12 * (1.0 + 10.0 / r) * (1.0 + c.sigma_tr_per_mm * (r + c.z_v_mm));
        assert_close(dipole_rd_between_per_mm2(&c, sources, 2, in, normal, out), dipole_rd_per_mm2(&c, r),
                     tolerance, "case %d, r/l %g", i, r / c.z_r_mm);
    }
}

/* Oracle: the beam model's own profile. The short sum is as near as asked from r_min on; the total is
 * exact; it is short. */
static void short_sums_are_as_near_as_asked(void **state)
{
    (void)state;
    struct rng rng = { .seed = 52 };
    size_t longest[3] = { 0, 0, 0 };
    for (int i = 0; i < 300; i++) {
        const double sigma_a = i % 7 == 0 ? 0.0 : log_uniform(&rng, 1e-5, 3.0);
        const double eta = i % 5 == 0 ? 1.0 : uniform(&rng, 0.7, 2.0);
        const dipole_coefficients c = coefficients(sigma_a, 1.0, eta);
        const dipole_layer base = { { sigma_a, 1.0, eta, DIPOLE_FDR_EXACT }, (double)INFINITY };
        dipole_stack *stack;
        assert_true(dipole_stack_create(&base, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL));
        for (int k = 0; k < 3; k++) {
            const double epsilon = pow(10.0, -1 - 2 * k), r_min = 0.1 * c.mean_free_path_mm;
            dipole_source sources[DIPOLE_SOURCE_LIMIT];
            const size_t count = dipole_sources_init(&c, DIPOLE_MODEL_BEAM, epsilon, r_min, sources, NULL);
            assert_true(count > 0 && count % 2 == 0);
            longest[k] = count > longest[k] ? count : longest[k];
            double total = 0.0;
            for (size_t j = 0; j < count; j++)
                total += sources[j].weight * exp(-c.sigma_tr_per_mm * fabs(sources[j].depth_mm));
            assert_close(total, dipole_stack_total(stack, DIPOLE_FACE_LIT), 1e-13, "case %d", i);
            for (double r = r_min; r < 100.0 * c.mean_free_path_mm; r *= 1.3) {
                const double out[3] = { r, 0.0, 0.0 };
                double expected;
                dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r, 1, &expected);
                assert_close(dipole_rd_between_per_mm2(&c, sources, count, origin, up, out), expected,
                             epsilon, "case %d, sigma_a %g, eta %g, r/l %g, %zu sources", i, sigma_a, eta,
                             r / c.mean_free_path_mm, count);
            }
        }
        dipole_stack_destroy(stack);
    }
    print_message("  at most %zu, %zu, %zu sources for 0.1, 0.001, 0.00001\n", longest[0], longest[1],
                  longest[2]);
    assert_true(longest[0] <= 24);
}

/* Power that leaves through the far face of a sheet by the three-dimensional form; the integral by the
 * trapezoidal rule in log r. */
static double through_sheet(const dipole_coefficients *c, const dipole_source *sources, size_t count,
                            double thickness_mm)
{
    double sum = 0.0;
    const double step = 0.01;
    for (double log_r = -14.0; log_r < 14.0; log_r += step) {
        const double r = c->mean_free_path_mm * exp(log_r), out[3] = { r, 0.0, -thickness_mm };
        sum += 2.0 * PI * r * r * dipole_rd_between_per_mm2(c, sources, count, origin, up, out) * step;
    }
    return sum;
}

/* Oracle: the clamp's own integral. A source in the plane of the far face is held at its depth z: out to
 * r = z its lobe is constant, beyond that it falls as 1/r^3, so without absorption 1/2 + 1 of it leaves
 * there. And wherever the far face lies, what arrives is finite and falls with the thickness beyond the
 * source. */
static void sheets_thinner_than_the_source_is_deep_stay_finite(void **state)
{
    (void)state;
    const dipole_coefficients white = coefficients(0.0, 1.0, 1.0);
    const dipole_source real = { 1.0, 1.0 };
    assert_close(through_sheet(&white, &real, 1, 1.0), 1.5, 1e-3, "the sheet ends at the source");
    struct rng rng = { .seed = 53 };
    for (int i = 0; i < 100; i++) {
        const dipole_coefficients c =
            coefficients(log_uniform(&rng, 1e-4, 1.0), 1.0, uniform(&rng, 1.0, 2.0));
        for (int m = 0; m < 2; m++) {
            dipole_source sources[DIPOLE_SOURCE_LIMIT];
            const size_t count = dipole_sources_init(&c, m ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE, 0.01,
                                                     0.1 * c.mean_free_path_mm, sources, NULL);
            double last = 2.0;
            for (double t = 1e-6; t < 100.0; t *= 1.5) {
                const double through = through_sheet(&c, sources, count, t * c.mean_free_path_mm);
                assert_true(isfinite(through) && through >= 0.0 && through < 2.0);
                if (t > 3.0)
                    assert_true(through < last);
                last = through;
            }
        }
    }
    /* next to a source and in it */
    const dipole_coefficients skin = coefficients(0.032, 0.74, 1.3);
    dipole_source sources[DIPOLE_SOURCE_LIMIT];
    assert_int_equal(dipole_sources_init(&skin, DIPOLE_MODEL_DIPOLE, 0.01, 1.0, sources, NULL), 2);
    const double in_source[3] = { 0.0, 0.0, -skin.z_r_mm };
    const double at_source = dipole_rd_between_per_mm2(&skin, sources, 2, origin, up, in_source);
    assert_true(isfinite(at_source) && at_source < 2.0 * dipole_rd_per_mm2(&skin, 0.0));
}

/* Oracle: the table in theory.md T30, what the clamp does to the energy of sheets (white, index 1.5): power
 * through the far face with it, and the beam model's own transmittance of that slab. */
static void the_clamp_costs_what_is_stated(void **state)
{
    (void)state;
    static const struct {
        double thickness, dipole, beam, slab;
    } rows[] = {
        { 0.25, 0.92, 0.83, 0.11 }, { 0.5, 0.98, 0.83, 0.20 }, { 1.0, 1.01, 0.81, 0.31 },
        { 2.0, 0.71, 0.74, 0.39 },  { 5.0, 0.25, 0.51, 0.34 }, { 20.0, 0.04, 0.08, 0.11 },
    };
    const dipole_coefficients c = coefficients(0.001, 1.0, 1.5);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const double t = rows[i].thickness * c.mean_free_path_mm;
        const dipole_layer sheet = { { 0.001, 1.0, 1.5, DIPOLE_FDR_EXACT }, t };
        dipole_stack *stack;
        assert_true(dipole_stack_create(&sheet, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL));
        double through[2];
        for (int m = 0; m < 2; m++) {
            dipole_source sources[DIPOLE_SOURCE_LIMIT];
            const size_t count = dipole_sources_init(&c, m ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE, 0.01,
                                                     0.1 * c.mean_free_path_mm, sources, NULL);
            through[m] = through_sheet(&c, sources, count, t);
        }
        const double slab = dipole_stack_total(stack, DIPOLE_FACE_FAR);
        if (fabs(through[0] - rows[i].dipole) > 0.006 || fabs(through[1] - rows[i].beam) > 0.006 ||
            fabs(slab - rows[i].slab) > 0.006)
            fail_msg("%g mean free paths: dipole %.3f, beam %.3f, slab %.3f", rows[i].thickness, through[0],
                     through[1], slab);
        dipole_stack_destroy(stack);
    }
}

/* Oracle: the messages that dipole.h promises. */
static void bad_requests_are_refused(void **state)
{
    (void)state;
    const dipole_coefficients c = coefficients(0.032, 0.74, 1.3);
    const struct {
        dipole_model model;
        double epsilon, r_min_mm;
        dipole_code code;
        const char *message;
    } rows[] = {
        { DIPOLE_MODEL_MULTIPOLE, 0.01, 1.0, DIPOLE_NOT_SUPPORTED,
          "this model has no sources, expected \"dipole\" or \"beam\"" },
        { DIPOLE_MODEL_BEAM, 1e-10, 1.0, DIPOLE_BAD_VALUE, "epsilon is 1e-10, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, (double)NAN, 1.0, DIPOLE_BAD_VALUE, "epsilon is nan, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BETTER_DIPOLE, 0.01, 1.0, DIPOLE_NOT_SUPPORTED,
          "this model has no sources, expected \"dipole\" or \"beam\"" },
        { (dipole_model)9, 0.01, 1.0, DIPOLE_NOT_SUPPORTED,
          "this model has no sources, expected \"dipole\" or \"beam\"" },
        { DIPOLE_MODEL_BEAM, 0.11, 1.0, DIPOLE_BAD_VALUE, "epsilon is 0.11, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, INFINITY, 1.0, DIPOLE_BAD_VALUE, "epsilon is inf, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, -0.01, 1.0, DIPOLE_BAD_VALUE, "epsilon is -0.01, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, 0.01, (double)NAN, DIPOLE_BAD_VALUE,
          "r_min_mm is nan, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_BEAM, 0.01, -1.0, DIPOLE_BAD_VALUE,
          "r_min_mm is -1, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_BEAM, 0.01, 0.0, DIPOLE_BAD_VALUE, "r_min_mm is 0, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_BEAM, 1e-9, 1e-5, DIPOLE_NOT_SUPPORTED,
          "more than 128 sources are needed for eta 1.3, r_min_mm 1e-05, epsilon 1e-09; expected larger "
          "ones" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        dipole_source sources[DIPOLE_SOURCE_LIMIT];
        dipole_status status = { 0 };
        assert_int_equal(
            dipole_sources_init(&c, rows[i].model, rows[i].epsilon, rows[i].r_min_mm, sources, &status), 0);
        assert_int_equal(status.code, rows[i].code);
        assert_string_equal(status.message, rows[i].message);
    }
}

/* Oracle: dipole.h, NaN where a coordinate is, though no source is nearer than its depth; and nothing
 * arrives at the end of the world. */
static void bad_places_are_nan(void **state)
{
    (void)state;
    const dipole_coefficients c = coefficients(0.032, 0.74, 1.3);
    for (int i = 0; i < 2; i++) {
        dipole_source sources[DIPOLE_SOURCE_LIMIT];
        const size_t count =
            dipole_sources_init(&c, i ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE, 1e-3, 0.1, sources, NULL);
        assert_true(count > 0);
        for (int k = 0; k < 9; k++) {
            double at[3][3] = { { 0.0, 0.0, 0.0 }, { 0.0, 0.0, 1.0 }, { 1.0, 0.0, 0.0 } };
            at[k / 3][k % 3] = (double)NAN;
            assert_true(isnan(dipole_rd_between_per_mm2(&c, sources, count, at[0], at[1], at[2])));
        }
        const double far[3] = { INFINITY, 0.0, 0.0 };
        assert_true(dipole_rd_between_per_mm2(&c, sources, count, origin, up, far) == 0.0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(over_a_flat_surface_it_is_the_profile),
        cmocka_unit_test(short_sums_are_as_near_as_asked),
        cmocka_unit_test(sheets_thinner_than_the_source_is_deep_stay_finite),
        cmocka_unit_test(the_clamp_costs_what_is_stated),
        cmocka_unit_test(bad_requests_are_refused),
        cmocka_unit_test(bad_places_are_nan),
    };
    return cmocka_run_group_tests_name("between", tests, NULL, NULL);
}
