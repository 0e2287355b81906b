/* What one evaluation costs, beside as many calls of exp() in the same run. Prints a Markdown table. */
#include "cli/cli.h"
#include "libdipole/dipole.h"

#include <math.h>

enum { RADIUS_COUNT = 4096, REPEAT_COUNT = 200 };

static double radii_mm[RADIUS_COUNT];
static dipole_coefficients coefficients;
static dipole_stack *half_space, *layers;

static double exp_twice(double r_mm)
{
    return exp(-0.3 * r_mm) + exp(-0.4 * r_mm);
}

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

/* Shortest of REPEAT_COUNT passes over the radii, in ns per call. */
static double measure_ns(double (*function)(double), int call_count, volatile double *sink)
{
    double shortest_s = INFINITY;
    for (int i = 0; i < REPEAT_COUNT; i++) {
        double sum = 0.0;
        const double start_s = cli_now_s();
        for (int k = 0; k < call_count; k++)
            sum += function(radii_mm[k]);
        shortest_s = fmin(shortest_s, cli_now_s() - start_s);
        *sink = sum;
    }
    return 1e9 * shortest_s / call_count;
}

int main(void)
{
    const struct {
        const char *name;
        double (*function)(double);
        int call_count;
    } rows[] = {
        { "two exp()", exp_twice, RADIUS_COUNT },
        { "Rd(r)", rd, RADIUS_COUNT },
        { "its two derivatives", gradient, RADIUS_COUNT },
        { "within(r)", within, RADIUS_COUNT },
        { "tail(r)", tail, RADIUS_COUNT },
        { "r_max(epsilon)", r_max, 64 },
        { "Fdr(eta), exact", fdr, 64 },
        { "R(r), beam model, half-space", beam, 256 },
        { "R(r), beam model, two layers", beam_layers, 256 },
    };
    const dipole_medium marble_green = { .sigma_a_per_mm = 0.0041,
                                         .sigma_s_prime_per_mm = 2.62,
                                         .eta = 1.5 };
    const dipole_layer stack[2] = { { marble_green, 1.0 },
                                    { { 0.0021, 2.19, 1.5, DIPOLE_FDR_EXACT }, INFINITY } };
    if (!dipole_coefficients_init(&marble_green, &coefficients, NULL) ||
        !dipole_stack_create(stack + 1, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &half_space, NULL) ||
        !dipole_stack_create(stack, 2, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &layers, NULL))
        return EXIT_FAILED;
    for (int i = 0; i < RADIUS_COUNT; i++)
        radii_mm[i] = 20.0 * i / RADIUS_COUNT;
    volatile double sink = 0.0;
    double unit_ns = 0.0;
    printf("| one call of | ns | in units of two exp() |\n|---|---|---|\n");
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const double ns = measure_ns(rows[i].function, rows[i].call_count, &sink);
        unit_ns = i == 0 ? ns : unit_ns;
        printf("| %s | %.1f | %.1f |\n", rows[i].name, ns, ns / unit_ns);
    }
    dipole_stack_destroy(half_space);
    dipole_stack_destroy(layers);
    return EXIT_DONE;
}
