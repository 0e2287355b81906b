#include "libdipole/internal.h"
#include "oracle_layers.h"
#include "random_layers.h"

#include <stdlib.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SLOWNESS = 20 }; /* how many times fewer cases */
#else
enum { SLOWNESS = 1 };
#endif

static dipole_stack *stack_of(const dipole_layer *layers, size_t count, dipole_model model)
{
    dipole_stack *stack;
    dipole_status status;
    if (!dipole_stack_create(layers, count, model, DIPOLE_FROM_ABOVE, &stack, &status))
        fail_msg("%s", status.message);
    return stack;
}

static double profile(const dipole_stack *stack, dipole_face face, double r_mm)
{
    double value;
    dipole_stack_profile_per_mm2(stack, face, &r_mm, 1, &value);
    return value;
}

static void coefficients_of(const dipole_layer *layers, size_t count, dipole_coefficients *coefficients)
{
    for (size_t i = 0; i < count; i++)
        assert_true(dipole_coefficients_init(&layers[i].medium, &coefficients[i], NULL));
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct layers_oracle oracle;
static struct layers_spectrum spectrum;

/* What is smaller than this is no number to be right about: it is near where doubles end. */
static const double least = 1e-290;

/* ---- against MPFR --------------------------------------------------------------------------------- */

/* Oracle: the textbook's linear equations in MPFR. R^, T^ and the totals to 1e-12, and what left without
 * scattering; the reflectance of interfaces whose indices differ by 1e-12 is only known to 1e-4. */
static void responses_agree_with_mpfr(void **state)
{
    (void)state;
    enum { CASES = 12000 / SLOWNESS };
    static double errors[2 * CASES];
    size_t error_count = 0;
    struct rng rng = { .seed = 51 };
    for (int i = 0; i < CASES; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        const size_t count = random_layers(&rng, layers);
        coefficients_of(layers, count, coefficients);
        dipole_system_init(&system, layers, coefficients, count, -1);
        layers_oracle_init(&oracle, layers, coefficients, count);
        const double l = coefficients[random_bits(&rng) % count].mean_free_path_mm;
        const bool is_total = i % 5 == 0;
        const double k = (is_total ? 1e-30 : log_uniform(&rng, 1e-8, 1e4)) / l;
        double expected[2];
        struct dual found[2];
        layers_oracle_response(&oracle, k, expected);
        dipole_system_solve(&system, is_total ? 0.0 : k * k, found);
        for (int face = 0; face < 2; face++) {
            assert_true(fabs(creal(system.unscattered[face].v) - oracle.unscattered[face]) <=
                        1e-12 * oracle.unscattered[face] + 1e-22);
            if (expected[face] < least && creal(found[face].v) < least)
                continue;
            assert_close(creal(found[face].v), expected[face], 1e-12,
                         "case %d, %zu layers, face %d, k l %g", i, count, face, k * l);
            errors[error_count++] = fabs(creal(found[face].v) / expected[face] - 1.0);
        }
        layers_oracle_clear(&oracle);
    }
    qsort(errors, error_count, sizeof errors[0], by_value);
    print_message("  %d stacks, relative error: median %.1e, worst %.1e\n", CASES, errors[error_count / 2],
                  errors[error_count - 1]);
}

/* Oracle: the same along the real k axis, transformed to distances. Both faces to 1e-10 of their value at
 * 0. */
static void profiles_agree_with_mpfr(void **state)
{
    (void)state;
    enum { CASES = 160 / SLOWNESS, RADII = 4 };
    static double errors[2 * RADII * CASES];
    size_t error_count = 0;
    struct rng rng = { .seed = 52 };
    for (int i = 0; i < CASES; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        coefficients_of(layers, count, coefficients);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM);
        layers_oracle_init(&oracle, layers, coefficients, count);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            if (!(total > least && top > least))
                continue;
            const double width_mm = sqrt(total / top);
            layers_spectrum_init(&spectrum, layers_oracle_response, &oracle, 1e-7 / width_mm);
            for (int j = 0; j < RADII; j++) {
                const double r = width_mm * log_uniform(&rng, 1e-2, 30.0);
                const double found = profile(stack, face, r),
                             expected = layers_oracle_profile(&spectrum, f, r);
                const double error = fabs(found - expected) / top;
                if (!(error <= 1e-10))
                    fail_msg("case %d, %zu layers, face %d, r %g: found %.15g, expected %.15g, at 0 %g", i,
                             count, f, r, found, expected, top);
                errors[error_count++] = error;
            }
        }
        layers_oracle_clear(&oracle);
        dipole_stack_destroy(stack);
    }
    qsort(errors, error_count, sizeof errors[0], by_value);
    print_message("  %zu values, error over the value at 0: median %.1e, worst %.1e\n", error_count,
                  errors[error_count / 2], errors[error_count - 1]);
}

/* Oracle: differences of MPFR's R^ and T^, five points; the derivatives of a decay by a nepers are a times
 * as large. Every parameter of a random layer of stacks of every kind. */
static void derivatives_agree_with_mpfr(void **state)
{
    (void)state;
    double worst = 0.0;
    struct rng rng = { .seed = 53 };
    for (int i = 0; i < 2000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS], moved[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        struct dual found[2];
        const size_t count = random_layers(&rng, layers), at = random_bits(&rng) % count;
        const int parameter = (int)(random_bits(&rng) % (isinf(layers[at].thickness_mm) ? 2 : 3));
        coefficients_of(layers, count, coefficients);
        const double k = log_uniform(&rng, 1e-8, 1e3) / coefficients[at].mean_free_path_mm;
        dipole_system_init(&system, layers, coefficients, count, 3 * (int)at + parameter);
        dipole_system_solve(&system, k * k, found);
        double fall = 0.0;
        for (int face = 0; face < 2; face++)
            fall = creal(found[face].v) > least ? fmax(fall, -log(creal(found[face].v))) : fall;
        const double step = 1e-3 / (1.0 + fall);
        double values[5][2];
        for (int n = -2; n <= 2; n++) {
            for (size_t m = 0; m < count; m++)
                moved[m] = layers[m];
            double *const fields[3] = { &moved[at].medium.sigma_a_per_mm,
                                        &moved[at].medium.sigma_s_prime_per_mm, &moved[at].thickness_mm };
            *fields[parameter] *= exp(n * step);
            layers_oracle_init(&oracle, moved, coefficients, count);
            layers_oracle_response(&oracle, k, values[n + 2]);
            layers_oracle_clear(&oracle);
        }
        for (int face = 0; face < 2; face++) {
            if (values[2][face] < least)
                continue;
            const double expected =
                (values[0][face] - 8.0 * values[1][face] + 8.0 * values[3][face] - values[4][face]) /
                (12.0 * step);
            const double unit = values[2][face] * (1.0 + fall);
            const double error = fabs(creal(found[face].d) - expected) / unit;
            if (!(error < 1e-9))
                fail_msg("case %d, layer %zu of %zu, parameter %d, face %d: found %.12g, expected %.12g, "
                         "value %g",
                         i, at, count, parameter, face, creal(found[face].d), expected, values[2][face]);
            worst = fmax(worst, error);
        }
    }
    print_message("  worst error %.1e of the value times its logarithm\n", worst);
}

/* ---- any layers ----------------------------------------------------------------------------------- */

/* Oracle: conservation. What leaves is no more than what entered, and all of it where nothing absorbs. */
static void energy_is_kept_by_any_layers(void **state)
{
    (void)state;
    double worst = 0.0;
    struct rng rng = { .seed = 54 };
    for (int i = 0; i < 100000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        struct dual totals[2];
        const size_t count = random_layers(&rng, layers);
        const bool is_lossless = i % 3 == 0;
        for (size_t k = 0; is_lossless && k < count; k++) {
            layers[k].medium.sigma_s_prime_per_mm += layers[k].medium.sigma_a_per_mm;
            layers[k].medium.sigma_a_per_mm = 0.0;
        }
        coefficients_of(layers, count, coefficients);
        dipole_system_init(&system, layers, coefficients, count, -1);
        dipole_system_solve(&system, 0.0, totals);
        double sum = 0.0;
        for (int face = 0; face < 2; face++) {
            const double total = creal(totals[face].v), unscattered = creal(system.unscattered[face].v);
            assert_true(cimag(totals[face].v) == 0.0);
            assert_true(total >= 0.0 && total <= 1.0 + 1e-14 && unscattered >= 0.0 &&
                        unscattered <= 1.0 + 1e-14);
            sum += total + unscattered;
        }
        assert_true(sum <= 1.0 + 1e-14 * (double)count);
        if (is_lossless) {
            worst = fmax(worst, fabs(sum - 1.0));
            assert_true(fabs(sum - 1.0) < 1e-13);
        }
    }
    print_message("  worst loss without absorption %.1e\n", worst);
}

static void check_falls(const dipole_stack *stack, dipole_face face, double r_first_mm, int number)
{
    const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
    double last = top, last_within = 0.0, last_beyond = total;
    assert_true(isfinite(top) && top >= 0.0);
    for (double r = r_first_mm; r < 1e9; r *= 7.3) {
        const double value = profile(stack, face, r), within = dipole_stack_within(stack, face, r),
                     beyond = dipole_stack_beyond(stack, face, r);
        if (!(isfinite(value) && value >= 0.0 && value <= last * (1.0 + 1e-9)))
            fail_msg("case %d, face %d, r %g: %.17g after %.17g, at 0 %g", number, (int)face, r, value,
                     last, top);
        if (!(within >= last_within * (1.0 - 1e-9) && beyond <= last_beyond * (1.0 + 1e-9) &&
              beyond >= 0.0 && fabs(within + beyond - total) <= 1e-12 * total))
            fail_msg(
                "case %d, face %d, r %g: within %.17g after %.17g, beyond %.17g after %.17g, total %.17g",
                number, (int)face, r, within, last_within, beyond, last_beyond, total);
        last = value, last_within = within, last_beyond = beyond;
    }
}

/* Oracle: order. Profiles of any layers are finite, not negative and fall with distance, as does the power
 * beyond; that within rises, and the two add up. */
static void profiles_of_any_layers_fall(void **state)
{
    (void)state;
    struct rng rng = { .seed = 55 };
    for (int i = 0; i < 4000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM);
        for (int f = 0; f < 2; f++)
            check_falls(stack, (dipole_face)f, log_uniform(&rng, 1e-9, 7e-9), i);
        dipole_stack_destroy(stack);
    }
}

/* Oracle: the same for the multipole, whose layers are thicker than a mean free path. */
static void profiles_of_any_multipole_are_finite(void **state)
{
    (void)state;
    struct rng rng = { .seed = 56 };
    for (int i = 0; i < 2000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        for (size_t k = 0; k < count; k++)
            layers[k].thickness_mm =
                fmax(layers[k].thickness_mm,
                     1.01 / (layers[k].medium.sigma_a_per_mm + layers[k].medium.sigma_s_prime_per_mm));
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_MULTIPOLE);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            double last = INFINITY;
            assert_true(total >= 0.0 && total <= 1.0 + 1e-12 && isfinite(top) && top >= 0.0);
            for (double r = log_uniform(&rng, 1e-9, 7e-9); r < 1e9; r *= 7.3) {
                const double value = profile(stack, face, r);
                if (!(isfinite(value) && value >= 0.0 && value <= last + 1e-9 * top))
                    fail_msg("case %d, face %d, r %g: %.17g after %.17g, at 0 %g", i, f, r, value, last,
                             top);
                last = value;
            }
        }
        dipole_stack_destroy(stack);
    }
}

/* Oracle: dimensions. Totals do not change if all lengths are scaled, so their derivatives by log sigma_a
 * and log sigma_s' less those by log thickness sum to 0 over the layers; those of the profile are finite.
 */
static void derivatives_of_any_layers_are_sound(void **state)
{
    (void)state;
    struct rng rng = { .seed = 57 };
    for (int i = 0; i < 300 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            double sum = 0.0, unit = 1e-300;
            for (size_t k = 0; k < count; k++) {
                const dipole_stack_gradient g = dipole_stack_total_gradient(stack, face, k);
                sum += g.d_log_sigma_a + g.d_log_sigma_s_prime - g.d_log_thickness;
                unit += fabs(g.d_log_sigma_a) + fabs(g.d_log_sigma_s_prime) + fabs(g.d_log_thickness);
            }
            if (!(fabs(sum) <= 1e-11 * unit))
                fail_msg("case %d, face %d: sum %g of terms of %g", i, f, sum, unit);
            const double l = dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
            const double radii[6] = { 0.0, 1e-9, 0.1 * l, 30.0 * l, 1e9, INFINITY };
            dipole_stack_gradient gradients[6];
            dipole_stack_profile_gradient(stack, face, random_bits(&rng) % count, radii, 6, gradients);
            for (int j = 0; j < 6; j++)
                assert_true(isfinite(gradients[j].d_log_sigma_a) &&
                            isfinite(gradients[j].d_log_sigma_s_prime) &&
                            isfinite(gradients[j].d_log_thickness));
        }
        dipole_stack_destroy(stack);
    }
}

/* Oracle: central differences of profiles of both faces, as accurate as the profile's own error allows. */
static void profile_gradients_are_the_slopes_of_the_profiles(void **state)
{
    (void)state;
    struct rng rng = { .seed = 58 };
    for (int i = 0; i < 100 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers), at = random_bits(&rng) % count;
        const int parameter = (int)(random_bits(&rng) % (isinf(layers[at].thickness_mm) ? 2 : 3));
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM), *sides[2];
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            if (!(total > least && top > least))
                continue;
            const double fall = 1.0 - log(total), step = 1e-4 / fall, width_mm = sqrt(total / top);
            for (int side = 0; side < 2; side++) {
                dipole_layer moved[RANDOM_LAYERS];
                for (size_t k = 0; k < count; k++)
                    moved[k] = layers[k];
                double *const fields[3] = { &moved[at].medium.sigma_a_per_mm,
                                            &moved[at].medium.sigma_s_prime_per_mm,
                                            &moved[at].thickness_mm };
                *fields[parameter] *= exp(side ? step : -step);
                sides[side] = stack_of(moved, count, DIPOLE_MODEL_BEAM);
            }
            double radii[5];
            dipole_stack_gradient gradients[5];
            for (int j = 0; j < 5; j++)
                radii[j] = width_mm * log_uniform(&rng, 1e-3, 10.0);
            dipole_stack_profile_gradient(stack, face, at, radii, 5, gradients);
            for (int j = 0; j < 5; j++) {
                const double found[3] = { gradients[j].d_log_sigma_a, gradients[j].d_log_sigma_s_prime,
                                          gradients[j].d_log_thickness };
                const double expected =
                    (profile(sides[1], face, radii[j]) - profile(sides[0], face, radii[j])) / (2.0 * step);
                if (!(fabs(found[parameter] - expected) <= 1e-7 * fall * top))
                    fail_msg(
                        "case %d, face %d, layer %zu of %zu, parameter %d, r %g: found %g, expected %g, "
                        "at 0 %g",
                        i, f, at, count, parameter, radii[j], found[parameter], expected, top);
            }
            dipole_stack_destroy(sides[0]);
            dipole_stack_destroy(sides[1]);
        }
        dipole_stack_destroy(stack);
    }
}

/* Oracle: T9 and T11 themselves, for any layers: what they promise holds at their roots. */
static void radii_and_spacings_of_any_layers_solve_their_equations(void **state)
{
    (void)state;
    struct rng rng = { .seed = 59 };
    for (int i = 0; i < 1000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM);
        const double epsilon = i % 2 ? log_uniform(&rng, 1e-100, 1e-3) : uniform(&rng, 0.0, 1.0);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face);
            if (!(epsilon * total > 1e-280))
                continue;
            const double r = dipole_stack_r_max_mm(stack, face, epsilon),
                         h = dipole_stack_splat_spacing_mm(stack, face, epsilon);
            assert_close(dipole_stack_beyond(stack, face, r), epsilon * total, 1e-9,
                         "case %d, face %d, epsilon %g, r_max %g", i, f, epsilon, r);
            assert_close(4.0 * dipole_stack_spectrum(stack, face, 2.0 * PI / h), epsilon * total, 1e-9,
                         "case %d, face %d, epsilon %g, spacing %g", i, f, epsilon, h);
        }
        dipole_stack_destroy(stack);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(responses_agree_with_mpfr),
        cmocka_unit_test(profiles_agree_with_mpfr),
        cmocka_unit_test(derivatives_agree_with_mpfr),
        cmocka_unit_test(energy_is_kept_by_any_layers),
        cmocka_unit_test(profiles_of_any_layers_fall),
        cmocka_unit_test(profiles_of_any_multipole_are_finite),
        cmocka_unit_test(derivatives_of_any_layers_are_sound),
        cmocka_unit_test(profile_gradients_are_the_slopes_of_the_profiles),
        cmocka_unit_test(radii_and_spacings_of_any_layers_solve_their_equations),
    };
    return cmocka_run_group_tests_name("layers", tests, NULL, NULL);
}
