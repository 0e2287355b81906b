/* The exponential modes (T29). What any model of layers must keep is in test_layers.c. */
#include "libdipole/internal.h"
#include "oracle_modes.h"
#include "random_layers.h"
#include "reference_file.h"
#include "stacks.h"

#include <stdlib.h>

static void system_of(const dipole_layer *layers, size_t count, int parameter, struct system *system)
{
    dipole_coefficients coefficients[RANDOM_LAYERS];
    coefficients_of(layers, count, coefficients);
    dipole_system_init(system, layers, coefficients, count, parameter);
    dipole_modes_init(system);
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct modes_oracle oracle;
static struct layers_spectrum spectrum;

/* ---- against MPFR --------------------------------------------------------------------------------- */

/* Oracle: the textbook's linear equations in MPFR. R^, T^ and the totals to 1e-10. */
static void responses_agree_with_mpfr(void **state)
{
    (void)state;
    enum { CASES = 2000 / SLOWNESS };
    static double errors[2 * CASES];
    size_t error_count = 0;
    struct rng rng = { .seed = 71 };
    modes_oracle_begin(&oracle);
    for (int i = 0; i < CASES; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        const size_t count = random_layers(&rng, layers);
        coefficients_of(layers, count, coefficients);
        system_of(layers, count, -1, &system);
        modes_oracle_init(&oracle, layers, coefficients, count);
        const double l = coefficients[random_bits(&rng) % count].mean_free_path_mm;
        const bool is_total = i % 5 == 0;
        const double k = (is_total ? 1e-30 : log_uniform(&rng, 1e-8, 1e4)) / l;
        double expected[2];
        struct dual found[2];
        modes_oracle_response(&oracle, k, expected);
        dipole_modes_solve(&system, is_total ? 0.0 : k * k, found);
        for (int face = 0; face < 2; face++) {
            if (expected[face] < least && creal(found[face].v) < least)
                continue;
            assert_close(creal(found[face].v), expected[face], 1e-10,
                         "case %d, %zu layers, face %d, k l %g", i, count, face, k * l);
            errors[error_count++] = fabs(creal(found[face].v) / expected[face] - 1.0);
        }
        modes_oracle_clear(&oracle);
    }
    modes_oracle_end(&oracle);
    qsort(errors, error_count, sizeof errors[0], by_value);
    print_message("  %d stacks, relative error: median %.1e, worst %.1e\n", CASES, errors[error_count / 2],
                  errors[error_count - 1]);
}

/* R^ and T^ of a system at real k, for the transform. */
static void response_at(void *context, double k, double out[2])
{
    struct dual found[2];
    dipole_modes_solve(context, k * k, found);
    out[0] = creal(found[0].v);
    out[1] = creal(found[1].v);
}

/* Oracle: the responses, which the test above has checked, along the real k axis, where nothing is
 * singular, transformed to distances. Both faces to 1e-9 of the value at a hundredth of the width. */
static void profiles_agree_with_the_transform_along_real_k(void **state)
{
    (void)state;
    enum { CASES = 120 / SLOWNESS, RADII = 4 };
    static double errors[2 * RADII * CASES];
    size_t error_count = 0;
    struct rng rng = { .seed = 72 };
    for (int i = 0; i < CASES; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        struct system system;
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_MODES);
        system_of(layers, count, -1, &system);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            if (!(dipole_stack_total(stack, face) > least))
                continue;
            const double width_mm = half_width_mm(stack, face), top = top_of(stack, face);
            layers_spectrum_init(&spectrum, response_at, &system, 1e-7 / width_mm);
            for (int j = 0; j < RADII; j++) {
                const double r = width_mm * log_uniform(&rng, 1e-2, 30.0);
                const double found = profile(stack, face, r),
                             expected = fmax(0.0, layers_oracle_profile(&spectrum, f, r));
                const double error = fabs(found - expected) / top;
                if (!(error <= 1e-9))
                    fail_msg("case %d, %zu layers, face %d, r %g: found %.15g, expected %.15g, top %g", i,
                             count, f, r, found, expected, top);
                errors[error_count++] = error;
            }
        }
        dipole_stack_destroy(stack);
    }
    qsort(errors, error_count, sizeof errors[0], by_value);
    print_message("  %zu values, error over the top: median %.1e, worst %.1e\n", error_count,
                  errors[error_count / 2], errors[error_count - 1]);
}

/* Oracle: differences of MPFR's R^ and T^, five points; the derivatives of a decay by a nepers are a times
 * as large. Every parameter of a random layer of stacks of every kind. */
static void derivatives_agree_with_mpfr(void **state)
{
    (void)state;
    double worst = 0.0;
    struct rng rng = { .seed = 73 };
    modes_oracle_begin(&oracle);
    for (int i = 0; i < 300 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS], moved[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        struct dual found[2];
        const size_t count = random_layers(&rng, layers), at = random_bits(&rng) % count;
        const int parameter = (int)(random_bits(&rng) % (isinf(layers[at].thickness_mm) ? 2 : 3));
        coefficients_of(layers, count, coefficients);
        const double k = log_uniform(&rng, 1e-8, 1e3) / coefficients[at].mean_free_path_mm;
        system_of(layers, count, 3 * (int)at + parameter, &system);
        dipole_modes_solve(&system, k * k, found);
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
            modes_oracle_init(&oracle, moved, coefficients, count);
            modes_oracle_response(&oracle, k, values[n + 2]);
            modes_oracle_clear(&oracle);
        }
        for (int face = 0; face < 2; face++) {
            if (values[2][face] < least)
                continue;
            const double expected =
                (values[0][face] - 8.0 * values[1][face] + 8.0 * values[3][face] - values[4][face]) /
                (12.0 * step);
            const double error = fabs(creal(found[face].d) - expected) / (values[2][face] * (1.0 + fall));
            if (!(error < 1e-8))
                fail_msg("case %d, layer %zu of %zu, parameter %d, face %d: found %.12g, expected %.12g, "
                         "value %g",
                         i, at, count, parameter, face, creal(found[face].d), expected, values[2][face]);
            worst = fmax(worst, error);
        }
    }
    modes_oracle_end(&oracle);
    print_message("  worst error %.1e of the value times its logarithm\n", worst);
}

/* ---- closed forms and other programs -------------------------------------------------------------- */

/* nu_j^2 over sigma^2 by bisection; the determinant of B without its first root is known. */
static void rates_find(long double alpha, long double epsilon, const long double *t, const long double *w,
                       long double *nu2)
{
    for (int j = 0; j < 3; j++) {
        long double lo = 0.0L, hi = alpha * w[j]; /* t^2 - nu^2 */
        if (j > 0 && hi > t[j] * t[j] - t[j - 1] * t[j - 1])
            hi = t[j] * t[j] - t[j - 1] * t[j - 1];
        hi *= 2.0L;
        for (int step = 0; step < 200; step++) {
            const long double delta = 0.5L * (lo + hi);
            long double sum = -1.0L;
            for (int m = 0; m < 3; m++)
                sum += alpha * w[m] / (t[m] * t[m] - t[j] * t[j] + delta);
            if (sum > 0.0L && (j == 0 || delta < t[j] * t[j] - t[j - 1] * t[j - 1]))
                lo = delta;
            else
                hi = delta;
        }
        nu2[j] = t[j] * t[j] - 0.5L * (lo + hi);
    }
    nu2[0] = epsilon * t[0] * t[0] * t[1] * t[1] * t[2] * t[2] / (nu2[1] * nu2[2]);
}

/* Oracle: the closed form of a half-space, by Wiener and Hopf: with H(p) = prod (p + s_m)/(p + q_m), the
 * waves u = b + C F u, b_m = alpha'/2 g_m H(1) H(s_m)/(1 + s_m), C_mn = alpha'/2 g_m H(s_m) H(s_n)
 * t_n^2/((s_m + s_n) s_n), and R^ = sum (1 - F_m) u_m. F_m(k) from MPFR. */
static void half_spaces_have_their_closed_form(void **state)
{
    (void)state;
    double worst = 0.0;
    struct rng rng = { .seed = 74 };
    modes_oracle_begin(&oracle);
    for (int i = 0; i < 2000 / SLOWNESS; i++) {
        const dipole_layer base = { { i % 10 == 0 ? 0.0 : log_uniform(&rng, 1e-6, 10.0),
                                      log_uniform(&rng, 1e-3, 10.0), random_eta(&rng), DIPOLE_FDR_EXACT },
                                    INFINITY };
        dipole_coefficients c;
        struct system system;
        struct dual found[2];
        coefficients_of(&base, 1, &c);
        const double k = i % 7 == 0 ? 0.0 : log_uniform(&rng, 1e-4, 1e4) * c.sigma_t_prime_per_mm;
        double out[2];
        modes_oracle_init(&oracle, &base, &c, 1);
        modes_oracle_response(&oracle, fmax(k, 1e-30), out); /* fills F_m(k) */
        modes_oracle_clear(&oracle);
        const long double sigma =
            (long double)base.medium.sigma_a_per_mm + (long double)base.medium.sigma_s_prime_per_mm;
        const long double alpha = base.medium.sigma_s_prime_per_mm / sigma, x = k / sigma;
        long double t[3], w[3], g[3], f[3], lost[3], nu2[3], s[3], h[3], h_1 = 1.0L, u[3][4];
        for (int m = 0; m < 3; m++) {
            t[m] = mpfr_get_ld(oracle.rate[m], MPFR_RNDN);
            w[m] = mpfr_get_ld(oracle.weight[m], MPFR_RNDN);
            g[m] = mpfr_get_ld(oracle.gauss[m], MPFR_RNDN);
            f[m] = mpfr_get_ld(oracle.reflected[0][m], MPFR_RNDN);
            mpfr_ui_sub(oracle.a, 1, oracle.reflected[0][m], MPFR_RNDN);
            lost[m] = mpfr_get_ld(oracle.a, MPFR_RNDN);
            s[m] = sqrtl(t[m] * t[m] + x * x);
        }
        rates_find(alpha, base.medium.sigma_a_per_mm / sigma, t, w, nu2);
        for (int m = 0; m < 3; m++) {
            h[m] = 1.0L;
            h_1 *= (1.0L + s[m]) / (1.0L + sqrtl(nu2[m] + x * x));
            for (int n = 0; n < 3; n++)
                h[m] *= (s[m] + s[n]) / (s[m] + sqrtl(nu2[n] + x * x));
        }
        for (int m = 0; m < 3; m++) {
            for (int n = 0; n < 3; n++)
                u[m][n] = (m == n) -
                          0.5L * alpha * g[m] * h[m] * h[n] / (s[m] + s[n]) * t[n] * t[n] / s[n] * f[n];
            u[m][3] = 0.5L * alpha * g[m] * h_1 * h[m] / (1.0L + s[m]);
        }
        for (int n = 0; n < 3; n++) /* Gauss and Jordan; the matrix is dominated by its diagonal */
            for (int m = 0; m < 3; m++)
                for (int j = 3; m != n && j >= n; j--)
                    u[m][j] -= u[m][n] / u[n][n] * u[n][j];
        long double expected = 0.0L;
        for (int m = 0; m < 3; m++)
            expected += lost[m] * u[m][3] / u[m][m];
        system_of(&base, 1, -1, &system);
        dipole_modes_solve(&system, k * k, found);
        assert_close(creal(found[0].v), (double)expected, 1e-12, "case %d, alpha' %Lg, eta %g, k l %Lg", i,
                     alpha, base.medium.eta, x);
        worst = fmax(worst, fabs(creal(found[0].v) / (double)expected - 1.0));
    }
    modes_oracle_end(&oracle);
    print_message("  worst relative error %.1e\n", worst);
}

/* Oracle: another program, in Python: 2M x 2M equations by numpy, eigenvectors by LAPACK. To the digits of
 * its own 1e-12. */
static void responses_are_those_of_the_reference_program(void **state)
{
    (void)state;
    static const struct {
        dipole_layer layers[4];
        size_t count;
    } stacks[] = {
        { { { { 0.001, 1.0, 1.5, DIPOLE_FDR_EXACT }, INFINITY } }, 1 },
        { { { { 1.0, 1.0, 1.4, DIPOLE_FDR_EXACT }, INFINITY } }, 1 },
        { { { { 0.3, 2.0, 1.0, DIPOLE_FDR_EXACT }, INFINITY } }, 1 },
        { { { { 0.3, 2.0, 0.8, DIPOLE_FDR_EXACT }, INFINITY } }, 1 },
        { { { { 0.001, 1.0, 1.5, DIPOLE_FDR_EXACT }, 0.999 } }, 1 },
        { { { { 0.01, 1.0, 1.0, DIPOLE_FDR_EXACT }, 2.0 } }, 1 },
        { { { { 0.2, 2.0, 1.4, DIPOLE_FDR_EXACT }, 0.2273 },
            { { 0.005, 1.0, 1.4, DIPOLE_FDR_EXACT }, INFINITY } },
          2 },
        { { { { 0.2, 2.0, 1.35, DIPOLE_FDR_EXACT }, 0.2273 },
            { { 0.005, 1.0, 1.55, DIPOLE_FDR_EXACT }, INFINITY } },
          2 },
        { { { { 0.21, 4.8, 1.4, DIPOLE_FDR_EXACT }, 0.1 },
            { { 0.016, 3.2, 1.4, DIPOLE_FDR_EXACT }, 0.5 },
            { { 0.0085, 0.45, 1.4, DIPOLE_FDR_EXACT }, INFINITY } },
          3 },
        { { { { 0.02, 0.3, 1.33, DIPOLE_FDR_EXACT }, 0.5 },
            { { 0.01, 8.0, 1.5, DIPOLE_FDR_EXACT }, 0.2 },
            { { 0.5, 2.0, 0.9, DIPOLE_FDR_EXACT }, 1.0 },
            { { 0.001, 1.0, 1.2, DIPOLE_FDR_EXACT }, 3.0 } },
          4 },
    };
    static const struct {
        size_t stack;
        double k_per_mm, expected[2];
    } rows[] = {
        { 0, 0, { 0.835016524048468, 0 } },
        { 0, 0.3, { 0.43928629003554, 0 } },
        { 0, 5, { 0.0475512735422688, 0 } },
        { 1, 0.01, { 0.0534227756455905, 0 } },
        { 1, 1, { 0.0505940560386261, 0 } },
        { 1, 1000, { 0.000335741203513961, 0 } },
        { 2, 0, { 0.36579628732865, 0 } },
        { 2, 0.3, { 0.360871188231076, 0 } },
        { 2, 5, { 0.144888015194376, 0 } },
        { 3, 0.01, { 0.355218020046884, 0 } },
        { 3, 1, { 0.311706378845222, 0 } },
        { 3, 1000, { 0.000964252024312766, 0 } },
        { 4, 0, { 0.32459459089906, 0.312569938235655 } },
        { 4, 0.3, { 0.287706681243387, 0.275321243512958 } },
        { 4, 5, { 0.0436096778516831, 0.0243418297094157 } },
        { 5, 0.01, { 0.499935243838666, 0.330447206415806 } },
        { 5, 1, { 0.312738661201823, 0.157672902852978 } },
        { 5, 1000, { 0.00049949847577944, 6.63951855471159e-05 } },
        { 6, 0, { 0.546965735150975, 0 } },
        { 6, 0.3, { 0.382133959745342, 0 } },
        { 6, 5, { 0.0733502183465508, 0 } },
        { 7, 0.01, { 0.539510434666952, 0 } },
        { 7, 1, { 0.177723877842137, 0 } },
        { 7, 1000, { 0.000704361932489981, 0 } },
        { 8, 0, { 0.543348714864243, 0 } },
        { 8, 0.3, { 0.407635050756463, 0 } },
        { 8, 5, { 0.141952282262553, 0 } },
        { 9, 0.01, { 0.527651112381348, 0.0511255332814774 } },
        { 9, 1, { 0.270526222368096, 0.0037824676965713 } },
        { 9, 1000, { 0.000108216956892732, 2.63401285602546e-07 } },
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct system system;
        struct dual found[2];
        system_of(stacks[rows[i].stack].layers, stacks[rows[i].stack].count, -1, &system);
        dipole_modes_solve(&system, rows[i].k_per_mm * rows[i].k_per_mm, found);
        for (int face = 0; face < 2; face++)
            assert_close(creal(found[face].v), rows[i].expected[face], 1e-11, "row %zu, face %d", i, face);
    }
}

/* ---- any layers ----------------------------------------------------------------------------------- */

/* Oracle: continuity. On k^2 = -kappa^2 < 0 below the first singularity the response is real, positive and
 * does not jump: there are no poles in between that the search might have stepped over. */
static void responses_are_regular_below_the_first_singularity(void **state)
{
    (void)state;
    struct rng rng = { .seed = 76 };
    for (int i = 0; i < 1000 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        struct system system;
        const size_t count = random_layers(&rng, layers);
        system_of(layers, count, -1, &system);
        const double end = dipole_modes_first_singularity_per_mm(&system);
        double last[2] = { 0.0, 0.0 };
        for (int n = 0; n < 60; n++) {
            const double kappa = end * n / 60.0;
            struct dual found[2];
            dipole_modes_solve(&system, -kappa * kappa, found);
            for (int face = 0; face < 2; face++) {
                const double value = creal(found[face].v);
                if (!(isfinite(value) && fabs(cimag(found[face].v)) <= 1e-9 * value + least &&
                      value >= 0.5 * last[face]))
                    fail_msg("case %d, %zu layers, face %d, kappa %g of %g: %g after %g", i, count, face,
                             kappa, end, value, last[face]);
                last[face] = value;
            }
        }
    }
}

/* The largest rise of a profile with distance, over what it is at a hundredth of its width. Fails unless it
 * is finite and not negative, and what leaves within and beyond add up. */
static double largest_rise(const dipole_stack *stack, dipole_face face, int number)
{
    const double total = dipole_stack_total(stack, face), width_mm = half_width_mm(stack, face);
    const double top = top_of(stack, face);
    double last = INFINITY, rise = 0.0, l = INFINITY;
    for (size_t k = 0; k < dipole_stack_layer_count(stack); k++)
        l = fmin(l, dipole_stack_coefficients(stack, k)->mean_free_path_mm);
    for (double r = 1e-9 * fmax(l, width_mm); r < 1e9 * width_mm; r *= 3.3) {
        const double value = profile(stack, face, r), within = dipole_stack_within(stack, face, r),
                     beyond = dipole_stack_beyond(stack, face, r);
        if (!(isfinite(value) && value >= 0.0 && fabs(within + beyond - total) <= 1e-9 * total))
            fail_msg("case %d, face %d, r %g: %g; within %.17g, beyond %.17g, total %.17g", number,
                     (int)face, r, value, within, beyond, total);
        rise = fmax(rise, (value - last) / top);
        last = value;
    }
    return rise;
}

/* Oracle: order. Where neighbours' sigma_t' and eta differ no more than in skin or glazed clay, profiles
 * fall with distance. */
static void profiles_of_common_layers_fall(void **state)
{
    (void)state;
    struct rng rng = { .seed = 77 };
    double worst = 0.0;
    for (int i = 0; i < 600 / SLOWNESS; i++) {
        dipole_layer layers[4];
        const size_t count = 1 + random_bits(&rng) % 4;
        for (size_t k = 0; k < count; k++) {
            const double sigma_t = log_uniform(&rng, 1.0, 10.0), epsilon = log_uniform(&rng, 1e-4, 0.5);
            layers[k] = (dipole_layer){ { epsilon * sigma_t, (1.0 - epsilon) * sigma_t,
                                          uniform(&rng, 1.3, 1.6), DIPOLE_FDR_EXACT },
                                        log_uniform(&rng, 0.1, 10.0) / sigma_t };
        }
        if (random_bits(&rng) % 2)
            layers[count - 1].thickness_mm = INFINITY;
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_MODES);
        for (int f = 0; f < (isinf(layers[count - 1].thickness_mm) ? 1 : 2); f++) {
            const double rise = largest_rise(stack, (dipole_face)f, i);
            worst = fmax(worst, rise);
        }
        dipole_stack_destroy(stack);
    }
    print_message("  worst rise %.1e of the value at a hundredth of the width\n", worst);
    assert_true(worst < 1e-4);
}

/* Oracle: order. Of layers of any kind, 6 % of the profiles do rise somewhere: the model's interfaces
 * between layers of very different sigma_t' do not keep what leaves positive. */
static void profiles_of_any_layers_are_finite(void **state)
{
    (void)state;
    struct rng rng = { .seed = 80 };
    int count_all = 0, count_rising = 0;
    for (int i = 0; i < 240 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *const stack = stack_of(layers, count, DIPOLE_MODEL_MODES);
        for (int f = 0; f < 2; f++) {
            if (!(dipole_stack_total(stack, (dipole_face)f) > least))
                continue;
            count_rising += largest_rise(stack, (dipole_face)f, i) > 1e-4;
            count_all++;
        }
        dipole_stack_destroy(stack);
    }
    print_message("  %d of %d rise\n", count_rising, count_all);
    assert_true(count_rising < 0.1 * count_all + 3);
}

/* ---- transport ------------------------------------------------------------------------------------ */

/* Oracle: adding-doubling, half-spaces and slabs from one mean free path, alpha' from 0.9. Isotropic
 * scattering: R within 1.5 % and T within 2 %. With g = 0.8 and the same sigma_s' the truth itself is up to
 * 4 % lower in half-spaces, which no model of sigma_s' can know. */
static void totals_agree_with_adding_doubling(void **state)
{
    (void)state;
    struct reference_file rows;
    reference_open(&rows, "adding_doubling.csv");
    int count = 0;
    double worst[2] = { 0.0, 0.0 }, worst_forward = 0.0;
    while (reference_next(&rows)) {
        const double albedo = reference_number(&rows, "albedo"), g = reference_number(&rows, "g");
        const double n = reference_number(&rows, "n_slab"), sigma_s_prime = albedo * (1.0 - g);
        const dipole_layer slab = { { 1.0 - albedo, sigma_s_prime, n, DIPOLE_FDR_EXACT },
                                    reference_number(&rows, "tau") };
        if (sigma_s_prime / (sigma_s_prime + 1.0 - albedo) < 0.9 || slab.thickness_mm < 1.0 ||
            (g > 0.0 && !isinf(slab.thickness_mm)))
            continue;
        dipole_stack *const stack = stack_of(&slab, 1, DIPOLE_MODEL_MODES);
        const double entered = 1.0 - pow((n - 1.0) / (n + 1.0), 2.0);
        const double expected[2] = {
            (reference_number(&rows, "R_total") - reference_number(&rows, "R_unscattered")) / entered,
            (reference_number(&rows, "T_total") - reference_number(&rows, "T_unscattered")) / entered
        };
        for (int face = 0; face < (isinf(slab.thickness_mm) ? 1 : 2); face++) {
            const double error = fabs(dipole_stack_total(stack, (dipole_face)face) / expected[face] - 1.0);
            if (g > 0.0)
                worst_forward = fmax(worst_forward, error);
            else
                worst[face] = fmax(worst[face], error);
        }
        dipole_stack_destroy(stack);
        count++;
    }
    print_message("  %d media, worst: R %.2f %%, T %.2f %%; g = 0.8 R %.2f %%\n", count, 100.0 * worst[0],
                  100.0 * worst[1], 100.0 * worst_forward);
    assert_true(worst[0] < 0.015 && worst[1] < 0.02 && worst_forward < 0.04 && count > 40);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(responses_agree_with_mpfr),
        cmocka_unit_test(profiles_agree_with_the_transform_along_real_k),
        cmocka_unit_test(derivatives_agree_with_mpfr),
        cmocka_unit_test(half_spaces_have_their_closed_form),
        cmocka_unit_test(responses_are_those_of_the_reference_program),
        cmocka_unit_test(responses_are_regular_below_the_first_singularity),
        cmocka_unit_test(profiles_of_common_layers_fall),
        cmocka_unit_test(profiles_of_any_layers_are_finite),
        cmocka_unit_test(totals_agree_with_adding_doubling),
    };
    return cmocka_run_group_tests_name("modes", tests, NULL, NULL);
}
