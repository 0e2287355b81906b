/* Layers of any kind: derivatives, energy, powers, radii. Values against MPFR: stability_layers.c. */
#include "libdipole/internal.h"
#include "oracle_layers.h"
#include "random_layers.h"
#include "stacks.h"

#include <stdlib.h>

static struct layers_oracle oracle;

/* The models of any layers: how fast they are, and what rounding leaves of them. */
static const struct any_layers {
    dipole_model model;
    int slowness;
    double energy, dimension; /* largest errors */
    void (*init)(struct system *system);
    void (*solve)(const struct system *system, double complex k2, struct dual out[2]);
} models[] = {
    { DIPOLE_MODEL_BEAM, 1, 1e-13, 1e-11, NULL, dipole_system_solve },
    { DIPOLE_MODEL_MODES, 3, 1e-12, 1e-10, dipole_modes_init, dipole_modes_solve },
};
enum { MODELS = sizeof models / sizeof models[0] };

/* ---- against MPFR --------------------------------------------------------------------------------- */

/* Oracle: differences of MPFR's R^ and T^, five points; the derivatives of a decay by a nepers are a times
 * as large. Every parameter of a random layer of stacks of every kind. */
static void derivatives_agree_with_mpfr(void **state)
{
    (void)state;
    double worst = 0.0;
    struct rng rng = { .seed = 53 };
    for (int i = 0; i < 1000 / SLOWNESS; i++) {
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

static void check_energy(const struct any_layers *model)
{
    double worst = 0.0;
    struct rng rng = { .seed = 54 };
    for (int i = 0; i < 50000 / SLOWNESS / model->slowness; i++) {
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
        if (model->init != NULL)
            model->init(&system);
        model->solve(&system, 0.0, totals);
        double sum = 0.0;
        for (int face = 0; face < 2; face++) {
            const double total = creal(totals[face].v), unscattered = creal(system.unscattered[face].v);
            assert_true(cimag(totals[face].v) == 0.0);
            assert_true(total >= 0.0 && total <= 1.0 + 0.1 * model->energy && unscattered >= 0.0 &&
                        unscattered <= 1.0 + 1e-14);
            sum += total + unscattered;
        }
        assert_true(sum <= 1.0 + model->energy);
        if (is_lossless) {
            worst = fmax(worst, fabs(sum - 1.0));
            assert_true(fabs(sum - 1.0) < model->energy);
        }
    }
    print_message("  worst loss without absorption %.1e\n", worst);
}

/* Oracle: conservation. What leaves is no more than what entered, and all of it where nothing absorbs. */
static void energy_is_kept_by_any_layers(void **state)
{
    (void)state;
    for (int m = 0; m < MODELS; m++)
        check_energy(&models[m]);
}

/* Oracle: the integral. The power between two radii, from K_1, is the integral of the profile, from K_0. */
static void powers_are_integrals_of_profiles(void **state)
{
    (void)state;
    static const double gauss[5][2] = { { 0.0, 0.28444444444444444444 },
                                        { -0.53846931010568309104, 0.23931433524968323402 },
                                        { 0.53846931010568309104, 0.23931433524968323402 },
                                        { -0.90617984593866399280, 0.11846344252809454376 },
                                        { 0.90617984593866399280, 0.11846344252809454376 } };
    double worst = 0.0;
    struct rng rng = { .seed = 60 };
    for (int i = 0; i < 400 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_BEAM);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            if (!(total > least && top > least))
                continue;
            const double r = sqrt(total / top) * log_uniform(&rng, 1e-2, 30.0), r_hi = 1.5 * r;
            double sum = 0.0;
            for (int panel = 0; panel < 8; panel++)
                for (int k = 0; k < 5; k++) {
                    const double share = (panel + 0.5 + 0.5 * gauss[k][0]) / 8.0;
                    const double at = sqrt(r * r + share * (r_hi - r) * (r_hi + r));
                    sum += gauss[k][1] / 8.0 * profile(stack, face, at);
                }
            sum *= PI * (r_hi - r) * (r_hi + r);
            const double found =
                dipole_stack_beyond(stack, face, r) - dipole_stack_beyond(stack, face, r_hi);
            const double error = fabs(found - sum) / total;
            if (!(error <= 1e-12))
                fail_msg("case %d, face %d, r %g: %.15g, the integral is %.15g of %g", i, f, r, found, sum,
                         total);
            worst = fmax(worst, error);
        }
        dipole_stack_destroy(stack);
    }
    print_message("  worst error %.1e of the total\n", worst);
}

/*
 * Oracle: order, for the multipole, whose layers are thicker than a mean free path. Its profile falls where
 * no face's extrapolated boundary is farther from it than the middle of the layer (T25); else the far
 * profile of that layer is negative, and 0 is given.
 */
static void profiles_of_any_multipole_are_finite(void **state)
{
    (void)state;
    struct rng rng = { .seed = 56 };
    for (int i = 0; i < 1000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        for (size_t k = 0; k < count; k++)
            layers[k].thickness_mm =
                fmax(layers[k].thickness_mm,
                     1.01 / (layers[k].medium.sigma_a_per_mm + layers[k].medium.sigma_s_prime_per_mm));
        bool is_positive = true;
        for (size_t k = 0; k < count; k++) {
            const double ratios[2] = {
                layers[k].medium.eta / (k > 0 ? layers[k - 1].medium.eta : 1.0),
                layers[k].medium.eta / (k + 1 < count ? layers[k + 1].medium.eta : 1.0),
            };
            double z_b_mm[2]; /* T5 */
            for (int j = 0; j < 2; j++)
                z_b_mm[j] = 2.0 / 3.0 * (1.0 + dipole_fdr_exact(ratios[j])) / dipole_fdt_exact(ratios[j]) /
                            (layers[k].medium.sigma_a_per_mm + layers[k].medium.sigma_s_prime_per_mm);
            is_positive = is_positive && fabs(z_b_mm[0] - z_b_mm[1]) <= layers[k].thickness_mm;
        }
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_MULTIPOLE);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            double last = INFINITY;
            assert_true(total >= 0.0 && total <= 1.0 + 1e-12 && isfinite(top) && top >= 0.0);
            for (double r = log_uniform(&rng, 1e-9, 7e-9); r < 1e9; r *= 7.3) {
                const double value = profile(stack, face, r);
                if (!(isfinite(value) && value >= 0.0 && (value <= last + 1e-9 * top || !is_positive)))
                    fail_msg("case %d, face %d, r %g: %.17g after %.17g, at 0 %g", i, f, r, value, last,
                             top);
                last = value;
            }
        }
        dipole_stack_destroy(stack);
    }
}

static void check_derivatives(const struct any_layers *model)
{
    struct rng rng = { .seed = 57 };
    for (int i = 0; i < 300 / SLOWNESS / model->slowness; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, model->model);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            double sum = 0.0, unit = 1e-3 * dipole_stack_total(stack, face) + 1e-300;
            for (size_t k = 0; k < count; k++) {
                const dipole_stack_gradient g = dipole_stack_total_gradient(stack, face, k);
                sum += g.d_log_sigma_a + g.d_log_sigma_s_prime - g.d_log_thickness;
                unit += fabs(g.d_log_sigma_a) + fabs(g.d_log_sigma_s_prime) + fabs(g.d_log_thickness);
            }
            if (!(fabs(sum) <= model->dimension * unit))
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

/* Oracle: dimensions. Totals do not change if all lengths are scaled, so their derivatives by log sigma_a
 * and log sigma_s' less those by log thickness sum to 0 over the layers; those of the profile are finite.
 */
static void derivatives_of_any_layers_are_sound(void **state)
{
    (void)state;
    for (int m = 0; m < MODELS; m++)
        check_derivatives(&models[m]);
}

static void check_slopes(const struct any_layers *model)
{
    struct rng rng = { .seed = 58 };
    for (int i = 0; i < 100 / SLOWNESS / model->slowness; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers), at = random_bits(&rng) % count;
        const int parameter = (int)(random_bits(&rng) % (isinf(layers[at].thickness_mm) ? 2 : 3));
        dipole_stack *const stack = stack_of(layers, count, model->model), *sides[2];
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face);
            if (!(total > least))
                continue;
            const double fall = 1.0 - log(total), step = 1e-4 / fall, top = top_of(stack, face),
                         width_mm = half_width_mm(stack, face);
            for (int side = 0; side < 2; side++) {
                dipole_layer moved[RANDOM_LAYERS];
                for (size_t k = 0; k < count; k++)
                    moved[k] = layers[k];
                double *const fields[3] = { &moved[at].medium.sigma_a_per_mm,
                                            &moved[at].medium.sigma_s_prime_per_mm,
                                            &moved[at].thickness_mm };
                *fields[parameter] *= exp(side ? step : -step);
                sides[side] = stack_of(moved, count, model->model);
            }
            double radii[5];
            dipole_stack_gradient gradients[5];
            for (int j = 0; j < 5; j++)
                radii[j] = width_mm * log_uniform(&rng, 1e-2, 10.0);
            dipole_stack_profile_gradient(stack, face, at, radii, 5, gradients);
            for (int j = 0; j < 5; j++) {
                const double found[3] = { gradients[j].d_log_sigma_a, gradients[j].d_log_sigma_s_prime,
                                          gradients[j].d_log_thickness };
                const double expected =
                    (profile(sides[1], face, radii[j]) - profile(sides[0], face, radii[j])) / (2.0 * step);
                if (!(fabs(found[parameter] - expected) <= 1e-7 * fall * top))
                    fail_msg(
                        "case %d, face %d, layer %zu of %zu, parameter %d, r %g: found %g, expected %g, "
                        "top %g",
                        i, f, at, count, parameter, radii[j], found[parameter], expected, top);
            }
            dipole_stack_destroy(sides[0]);
            dipole_stack_destroy(sides[1]);
        }
        dipole_stack_destroy(stack);
    }
}

/* Oracle: central differences of profiles of both faces, as accurate as the profile's own error allows. */
static void profile_gradients_are_the_slopes_of_the_profiles(void **state)
{
    (void)state;
    for (int m = 0; m < MODELS; m++)
        check_slopes(&models[m]);
}

/* Oracle: T9 and T11 themselves, for any layers: what they promise holds at their roots, to what rounding
 * leaves of the whole. */
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
            const double beyond = dipole_stack_beyond(stack, face, r);
            if (!(fabs(beyond - epsilon * total) <= (1e-9 * epsilon + 1e-14) * total))
                fail_msg("case %d, face %d, epsilon %g: beyond r_max %g %g of %g", i, f, epsilon, r, beyond,
                         total);
            assert_close(4.0 * dipole_stack_spectrum(stack, face, 2.0 * PI / h), epsilon * total, 1e-9,
                         "case %d, face %d, epsilon %g, spacing %g", i, f, epsilon, h);
        }
        dipole_stack_destroy(stack);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_agree_with_mpfr),
        cmocka_unit_test(energy_is_kept_by_any_layers),
        cmocka_unit_test(powers_are_integrals_of_profiles),
        cmocka_unit_test(profiles_of_any_multipole_are_finite),
        cmocka_unit_test(derivatives_of_any_layers_are_sound),
        cmocka_unit_test(profile_gradients_are_the_slopes_of_the_profiles),
        cmocka_unit_test(radii_and_spacings_of_any_layers_solve_their_equations),
    };
    return cmocka_run_group_tests_name("layers", tests, NULL, NULL);
}
