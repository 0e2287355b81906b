#include "libdipole/internal.h"
#include "oracle_modes.h"
#include "random_layers.h"

#include <stdlib.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SLOWNESS = 20 }; /* how many times fewer cases */
#else
enum { SLOWNESS = 1 };
#endif

static void coefficients_of(const dipole_layer *layers, size_t count, dipole_coefficients *coefficients)
{
    for (size_t i = 0; i < count; i++)
        assert_true(dipole_coefficients_init(&layers[i].medium, &coefficients[i], NULL));
}

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

/* What is smaller than this is no number to be right about: it is near where doubles end. */
static const double least = 1e-290;

/* ---- against MPFR --------------------------------------------------------------------------------- */

/* Oracle: the textbook's linear equations in MPFR. */
static void responses_agree_with_mpfr(void **state)
{
    (void)state;
    enum { CASES = 2500 / SLOWNESS };
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
            const double error = fabs(creal(found[face].v) / expected[face] - 1.0);
            if (!(error < 1e-11))
                print_message("case %d, %zu layers, face %d, k l %g: found %.17g, expected %.17g: %.1e\n",
                              i, count, face, k * l, creal(found[face].v), expected[face], error);
            errors[error_count++] = error;
        }
        modes_oracle_clear(&oracle);
    }
    modes_oracle_end(&oracle);
    qsort(errors, error_count, sizeof errors[0], by_value);
    print_message("  %d stacks, relative error: median %.1e, worst %.1e\n", CASES, errors[error_count / 2],
                  errors[error_count - 1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(responses_agree_with_mpfr),
    };
    return cmocka_run_group_tests_name("modes", tests, NULL, NULL);
}
