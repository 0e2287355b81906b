#include "fit/blur.h"

#include "renderer/footprint.h"
#include "stacks.h"

#include <stdlib.h>

static const double pi = 3.14159265358979323846;

enum { PER_OCTAVE = 8 };

/* Distances as the operator has them: even in r^2 up to scale_mm, then even in its octaves. */
static double *rows_create(double scale_mm, double largest_mm, size_t *count_out)
{
    const size_t octaves = (size_t)ilogb(1 + pow(largest_mm / scale_mm, 2)) + 1;
    double *const rows = malloc((octaves * PER_OCTAVE + 1) * sizeof *rows);
    assert_non_null(rows);
    for (size_t k = 0; k <= octaves * PER_OCTAVE; k++)
        rows[k] =
            scale_mm * sqrt(ldexp(1 + (double)(k % PER_OCTAVE) / PER_OCTAVE, (int)(k / PER_OCTAVE)) - 1);
    *count_out = octaves * PER_OCTAVE + 1;
    return rows;
}

/* A blur over rows that suit it, as fit/picture.c makes it: nothing is finer than 1.5 of it. */
static struct fit_blur *blur_of(double blur_mm, double largest_mm, double **rows_out)
{
    struct fit_blur *blur;
    size_t count;
    *rows_out = rows_create(0.5 * blur_mm, largest_mm, &count);
    assert_true(fit_blur_create(*rows_out, count, blur_mm, blur_mm, &blur, NULL));
    assert_int_equal(blur->row_count, count);
    return blur;
}

static double blurred(const struct fit_blur *blur, size_t row, const double *values)
{
    double sum = 0;
    for (size_t k = 0; k < blur->node_count; k++)
        sum += blur->matrix[row * blur->node_count + k] * values[k];
    return sum;
}

static double *values_create(const struct fit_blur *blur)
{
    double *const values = malloc(blur->node_count * sizeof *values);
    assert_non_null(values);
    return values;
}

/* The average by its definition: the kernel times the profile, summed in fine steps of log s. */
enum { FINE = 6000 };
struct fine {
    double s_mm[FINE], profile[FINE], step;
};

static void fine_init(struct fine *fine, const dipole_stack *stack, double blur_mm)
{
    fine->step = log(60 * blur_mm / 1e-7) / FINE;
    for (int i = 0; i < FINE; i++)
        fine->s_mm[i] = 1e-7 * exp(fine->step * (i + 0.5));
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, fine->s_mm, FINE, fine->profile);
}

static double fine_blurred(const struct fine *fine, double blur_mm, double r_mm)
{
    double sum = 0;
    for (int i = 0; i < FINE; i++)
        sum += 2 * pi * fine->s_mm[i] * fine->s_mm[i] * fine->step * fine->profile[i] *
               render_footprint_kernel_per_mm2(&(struct render_footprint_kernel){ .blur_mm = blur_mm },
                                               r_mm, fine->s_mm[i]);
    return sum;
}

/* Oracle: the definition, by 6000 steps of log s, and render's own table of the same, for all models.
 * Tolerances are parts of the brightest: 3e-5 of the definition, as the innermost disc of a pole is 1e-5;
 * 2e-3 of the table, whose rings, blur / 8 wide, widen the profile by their own width, and which is a
 * polygon. */
static void it_is_the_average_by_definition(void **state)
{
    (void)state;
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE,
                                           DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES };
    static const double blurs_mm[] = { 0.1, 0.5, 2 };
    const dipole_layer layer = { { .sigma_a_per_mm = 0.02, .sigma_s_prime_per_mm = 1.1, .eta = 1.4 },
                                 INFINITY };
    struct fine *const fine = malloc(sizeof *fine);
    assert_non_null(fine);
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        dipole_stack *const stack = stack_of(&layer, 1, models[m]);
        double worst = 0, worst_table = 0;
        for (size_t b = 0; b < 3; b++) {
            double *rows;
            struct fit_blur *const blur = blur_of(blurs_mm[b], 40 * blurs_mm[b], &rows);
            double *const values = values_create(blur);
            struct render_footprint *footprint;
            dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, blur->node_r_mm, blur->node_count, values);
            assert_true(render_footprint_create(
                stack, &(struct render_footprint_kernel){ .blur_mm = blurs_mm[b] }, &footprint, NULL));
            fine_init(fine, stack, blurs_mm[b]);
            const double brightest = fine_blurred(fine, blurs_mm[b], 0);
            for (size_t i = 0; i < blur->row_count && rows[i] < 30 * blurs_mm[b]; i += 3) {
                const double found = blurred(blur, i, values);
                const double expected = fine_blurred(fine, blurs_mm[b], rows[i]);
                const double table = render_footprint_sample(footprint, rows[i]);
                worst = fmax(worst, fabs(found - expected) / brightest);
                worst_table = fmax(worst_table, fabs(found - table) / brightest);
            }
            free(footprint);
            free(values);
            free(rows);
            free(blur);
        }
        print_message("model %d: %.2g, table %.2g of the brightest\n", (int)models[m], worst, worst_table);
        assert_true(worst < 3e-5 && worst_table < 2e-3);
        dipole_stack_destroy(stack);
    }
    free(fine);
}

static double gaussian(double variance, double r_mm)
{
    return exp(-0.5 * r_mm * r_mm / variance) / (2 * pi * variance);
}

/* 3 f(1) - 3 f(2) + f(3), the kernel of footprint.h, of what Gaussians of those variances make. */
static double by_variances(double f(double variance, double r_mm), double blur_mm, double r_mm)
{
    const double v = blur_mm * blur_mm;
    return 3 * f(v, r_mm) - 3 * f(2 * v, r_mm) + f(3 * v, r_mm);
}

static double wide_gaussian(double variance, double r_mm)
{
    return gaussian(variance + 1.7 * 1.7, r_mm);
}

/* E_1 by its series or its continued fraction. */
static double exponential_integral(double x)
{
    if (x > 1.5) {
        double fraction = 0;
        for (int n = 200; n > 0; n--)
            fraction = n / (1 + n / (x + fraction));
        return exp(-x) / (x + fraction);
    }
    double sum = -0.57721566490153286 - log(x), term = -1;
    for (int n = 1; n < 60; n++) {
        term *= -x / n;
        sum += term / n;
    }
    return sum;
}

/* -log r under a Gaussian: its potential. */
static double blurred_logarithm(double variance, double r_mm)
{
    if (r_mm == 0)
        return -0.5 * (log(2 * variance) - 0.57721566490153286);
    return -log(r_mm) - 0.5 * exponential_integral(0.5 * r_mm * r_mm / variance);
}

/* 1/r under a Gaussian; e^-x I_0(x) as the mean of e^(x (cos t - 1)). */
static double blurred_pole(double variance, double r_mm)
{
    const double x = 0.25 * r_mm * r_mm / variance;
    double sum = 0;
    for (int i = 0; i < 4000; i++)
        sum += exp(x * (cos(2 * pi * i / 4000) - 1)) / 4000;
    return sqrt(pi / (2 * variance)) * sum;
}

/* Oracle: closed forms. A Gaussian stays one, variances add; a logarithm and a pole at 0 are finite under
 * the blur. 5e-5 of the value out to six deviations: the rule's rings, and the innermost disc of a pole,
 * 1e-5. */
static void closed_forms_are_met(void **state)
{
    (void)state;
    for (double blur_mm = 0.05; blur_mm < 4; blur_mm *= 3) {
        double *rows, worst[3] = { 0, 0, 0 };
        struct fit_blur *const blur = blur_of(blur_mm, 40 * blur_mm, &rows);
        double *const values = values_create(blur);
        for (int which = 0; which < 3; which++) {
            for (size_t k = 0; k < blur->node_count; k++) {
                const double r_mm = blur->node_r_mm[k];
                values[k] = which == 0 ? gaussian(1.7 * 1.7, r_mm) : which == 1 ? -log(r_mm) : 1 / r_mm;
            }
            for (size_t i = 0; i < blur->row_count && rows[i] < 30 * blur_mm; i++) {
                const double expected = which == 0   ? by_variances(wide_gaussian, blur_mm, rows[i])
                                        : which == 1 ? by_variances(blurred_logarithm, blur_mm, rows[i])
                                                     : by_variances(blurred_pole, blur_mm, rows[i]);
                if (which == 0 && rows[i] > 4 * 1.7)
                    continue;
                const double unit = which == 1 ? 1 : expected;
                worst[which] = fmax(worst[which], fabs(blurred(blur, i, values) - expected) / unit);
            }
        }
        print_message("blur %g mm: Gaussian %.2g, logarithm %.2g, pole %.2g\n", blur_mm, worst[0], worst[1],
                      worst[2]);
        assert_true(worst[0] < 1e-4 && worst[1] < 2e-5 && worst[2] < 2e-5);
        free(values);
        free(rows);
        free(blur);
    }
}

/* Oracle: what a mean is: of 1 it is 1; and far rows are their own node. */
static void rows_are_means(void **state)
{
    (void)state;
    double *rows;
    struct fit_blur *const blur = blur_of(0.4, 100, &rows);
    size_t far_count = 0;
    for (size_t i = 0; i < blur->row_count; i++) {
        double sum = 0;
        for (size_t k = 0; k < blur->node_count; k++) {
            const double weight = blur->matrix[i * blur->node_count + k];
            sum += weight;
            if (rows[i] > 32 * 0.4)
                assert_true(weight == (blur->node_r_mm[k] == rows[i] ? 1 : 0));
        }
        far_count += rows[i] > 32 * 0.4;
        assert_close(sum, 1, 1e-5, "row %zu", i);
    }
    assert_true(far_count > 10);
    for (size_t k = 0; k + 1 < blur->node_count; k++)
        assert_true(blur->node_r_mm[k] > 0 && blur->node_r_mm[k] < blur->node_r_mm[k + 1]);
    free(rows);
    free(blur);
}

/* Oracle: energy: what is blurred sends out as much, but for the innermost disc, 1e-5 of a pole's. Summed
 * by the trapezoidal rule with its correction for the slope of r f(r) at 0. */
static void energy_is_kept(void **state)
{
    (void)state;
    enum { ROWS = 2000 };
    static const double blur_mm = 0.5, reach_mm = 40;
    double *const rows = malloc(ROWS * sizeof *rows);
    assert_non_null(rows);
    for (size_t i = 0; i < ROWS; i++)
        rows[i] = reach_mm * (double)i / (ROWS - 1);
    struct fit_blur *blur;
    assert_true(fit_blur_create(rows, ROWS, blur_mm, blur_mm, &blur, NULL));
    double *const values = values_create(blur);
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES };
    const dipole_layer layer = { { .sigma_a_per_mm = 0.2, .sigma_s_prime_per_mm = 1.1, .eta = 1.4 },
                                 INFINITY };
    for (size_t m = 0; m < 3; m++) {
        dipole_stack *const stack = stack_of(&layer, 1, models[m]);
        const double step_mm = rows[1];
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, blur->node_r_mm, blur->node_count, values);
        double sum = 2 * pi * blurred(blur, 0, values) * step_mm * step_mm / 12;
        for (size_t i = 0; i < ROWS; i++)
            sum += 2 * pi * rows[i] * blurred(blur, i, values) * step_mm;
        const double expected = dipole_stack_within(stack, DIPOLE_FACE_LIT, reach_mm);
        assert_close(sum, expected, 2e-5, "model %d", (int)models[m]);
        dipole_stack_destroy(stack);
    }
    free(values);
    free(rows);
    free(blur);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_the_average_by_definition),
        cmocka_unit_test(closed_forms_are_met),
        cmocka_unit_test(rows_are_means),
        cmocka_unit_test(energy_is_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
