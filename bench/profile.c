/* What one evaluation costs, beside as many exponentials in the same run. Prints two Markdown tables. */
#include "bench/bare_exp.h"
#include "cli/cli.h"
#include "libdipole/dipole.h"

#include <math.h>
#include <stdlib.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { RADIUS_COUNT = 4096, ROW_LIMIT = 16, ROUND_COUNT = 41 };

static double radii_mm[RADIUS_COUNT], values[RADIUS_COUNT], d_sigma_a[RADIUS_COUNT],
    d_sigma_s_prime[RADIUS_COUNT];
static dipole_coefficients coefficients;
static double cosines[RADIUS_COUNT];
static dipole_stack *dipole, *half_space, *layers;
static dipole_sources two_sources, fitted_sources;

/* ---- one radius a call ---------------------------------------------------------------------------- */

static double rd(double r_mm)
{
    return dipole_rd_per_mm2(&coefficients, r_mm);
}

static double gradient(double r_mm)
{
    return dipole_rd_gradient(&coefficients, r_mm).d_log_sigma_a;
}

static double within(double r_mm)
{
    return dipole_reflectance_within(&coefficients, r_mm);
}

static double tail(double r_mm)
{
    return dipole_tail_fraction(&coefficients, r_mm);
}

static double r_max(double r_mm)
{
    return dipole_r_max_mm(&coefficients, 0.01 + 1e-3 * r_mm);
}

static double fdr(double r_mm)
{
    return dipole_fdr_exact(1.3 + 1e-3 * r_mm);
}

static double stack_profile(const dipole_stack *stack, double r_mm)
{
    double value;
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r_mm, 1, &value);
    return value;
}

static double beam(double r_mm)
{
    return stack_profile(half_space, r_mm);
}

static double beam_layers(double r_mm)
{
    return stack_profile(layers, r_mm);
}

/* ---- many radii a call ---------------------------------------------------------------------------- */

static void all_bare_exp(size_t count)
{
    bare_exp(radii_mm, count, values);
}

/* The formula of T5 as one writes it down, with the C library's exp() one at a time. */
static void all_formula(size_t count)
{
    const double z[2] = { coefficients.z_r_mm, coefficients.z_v_mm };
    const double sigma_tr = coefficients.sigma_tr_per_mm,
                 factor = coefficients.alpha_prime / (4.0 * 3.14159265358979323846);
    for (size_t i = 0; i < count; i++) {
        values[i] = 0.0;
        for (int k = 0; k < 2; k++) {
            const double d = sqrt(radii_mm[i] * radii_mm[i] + z[k] * z[k]);
            values[i] += factor * z[k] * (sigma_tr + 1.0 / d) * exp(-sigma_tr * d) / (d * d);
        }
    }
}

static void all_profile(size_t count)
{
    dipole_rd_profile_per_mm2(&coefficients, radii_mm, count, values);
}

static void all_gradients(size_t count)
{
    dipole_rd_profile_gradient(&coefficients, radii_mm, count, values, d_sigma_a, d_sigma_s_prime);
}

static void all_beam(size_t count)
{
    dipole_stack_profile_per_mm2(half_space, DIPOLE_FACE_LIT, radii_mm, count, values);
}

static void all_layers(size_t count)
{
    dipole_stack_profile_per_mm2(layers, DIPOLE_FACE_LIT, radii_mm, count, values);
}

static void all_two_sources(size_t count)
{
    dipole_sources_profile_per_mm2(&two_sources, 5.0, cosines, count, values);
}

static void in_calls_of_64(size_t count)
{
    for (size_t i = 0; i < count; i += 64)
        dipole_sources_profile_per_mm2(&two_sources, 5.0, cosines + i, 64, values + i);
}

static void all_fitted_sources(size_t count)
{
    dipole_sources_profile_per_mm2(&fitted_sources, 5.0, cosines, count, values);
}

static void all_discs_of_two(size_t count)
{
    dipole_sources_within_many(&two_sources, -0.2, radii_mm, count, values);
}

/* ---- the tables ----------------------------------------------------------------------------------- */

struct row {
    const char *name;
    double (*one)(double r_mm); /* or */
    void (*all)(size_t count);
    size_t count; /* of radii in a pass */
};

/* ns per radius of one pass. */
static double pass_ns(const struct row *row)
{
    static volatile double sink;
    double sum = 0.0;
    const double start_s = cli_now_s();
    if (row->all)
        row->all(row->count);
    else
        for (size_t k = 0; k < row->count; k++)
            sum += row->one(radii_mm[k * (RADIUS_COUNT / row->count)]);
    const double ns = 1e9 * (cli_now_s() - start_s) / (double)row->count;
    sink = sum + values[row->count - 1];
    (void)sink;
    return ns;
}

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Of one time per round; sorts them. */
static double median(double times[ROUND_COUNT])
{
    qsort(times, ROUND_COUNT, sizeof times[0], compare);
    return times[ROUND_COUNT / 2];
}

/* All rows in turns, so that a busy moment of the machine hits all alike; medians, and how often the first
 * row goes into each. */
static void print_table(const char *heading, const struct row *rows, size_t row_count)
{
    static double ns[ROW_LIMIT][ROUND_COUNT];
    for (int round = 0; round < ROUND_COUNT; round++)
        for (size_t i = 0; i < row_count; i++)
            ns[i][round] = pass_ns(&rows[i]);
    const double unit_ns = median(ns[0]);
    printf("\n| %s | ns | in units of the first row |\n|---|---|---|\n", heading);
    for (size_t i = 0; i < row_count; i++) {
        const double median_ns = median(ns[i]);
        printf("| %s | %.1f | %.2f |\n", rows[i].name, median_ns, median_ns / unit_ns);
    }
}

int main(void)
{
    static char fitted_name[64];
    static const struct row batches[] = {
        { "two exp(), vector code of the C library", NULL, all_bare_exp, RADIUS_COUNT },
        { "Rd(r) as a loop over its formula, scalar exp()", NULL, all_formula, RADIUS_COUNT },
        { "`dipole_rd_profile_per_mm2`", NULL, all_profile, RADIUS_COUNT },
        { "`dipole_rd_profile_gradient`: Rd and two derivatives", NULL, all_gradients, RADIUS_COUNT },
        { "`dipole_sources_profile_per_mm2`: the dipole's two", NULL, all_two_sources, RADIUS_COUNT },
        { "the same in calls of 64", NULL, in_calls_of_64, RADIUS_COUNT },
        { fitted_name, NULL, all_fitted_sources, RADIUS_COUNT },
        { "`dipole_sources_within_many`: the dipole's two", NULL, all_discs_of_two, RADIUS_COUNT },
        { "`dipole_stack_profile_per_mm2`: beam model, half-space", NULL, all_beam, 256 },
        { "the same: beam model, two layers", NULL, all_layers, 256 },
    };
    static const struct row calls[] = {
        { "Rd(r)", rd, NULL, RADIUS_COUNT },
        { "its two derivatives", gradient, NULL, RADIUS_COUNT },
        { "within(r)", within, NULL, RADIUS_COUNT },
        { "tail(r)", tail, NULL, RADIUS_COUNT },
        { "r_max(epsilon)", r_max, NULL, 64 },
        { "Fdr(eta), exact", fdr, NULL, 64 },
        { "R(r), beam model, half-space", beam, NULL, 256 },
        { "R(r), beam model, two layers", beam_layers, NULL, 256 },
    };
    const dipole_medium marble_green = { .sigma_a_per_mm = 0.0041,
                                         .sigma_s_prime_per_mm = 2.62,
                                         .eta = 1.5 };
    const dipole_layer stack[2] = { { marble_green, 1.0 },
                                    { { 0.0021, 2.19, 1.5, DIPOLE_FDR_EXACT }, INFINITY } };
    if (!dipole_coefficients_init(&marble_green, &coefficients, NULL) ||
        !dipole_stack_create(stack + 1, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &half_space, NULL) ||
        !dipole_stack_create(stack, 2, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &layers, NULL) ||
        !dipole_stack_create(stack + 1, 1, DIPOLE_MODEL_DIPOLE, DIPOLE_FROM_ABOVE, &dipole, NULL) ||
        !dipole_sources_init(dipole, 0.01, 0.1, 20.0, &two_sources, NULL) ||
        !dipole_sources_init(layers, 0.01, 0.1, 20.0, &fitted_sources, NULL))
        return EXIT_FAILED;
    for (int i = 0; i < RADIUS_COUNT; i++) {
        radii_mm[i] = 20.0 * i / RADIUS_COUNT;
        cosines[i] = 2.0 * i / RADIUS_COUNT - 1.0;
    }
    snprintf(fitted_name, sizeof fitted_name, "the same: beam model, two layers, %zu fitted sources",
             fitted_sources.count);
    print_table("one of many radii in a call", batches, COUNT(batches));
    print_table("one call of", calls, COUNT(calls));
    dipole_stack_destroy(dipole);
    dipole_stack_destroy(half_space);
    dipole_stack_destroy(layers);
    return EXIT_DONE;
}
