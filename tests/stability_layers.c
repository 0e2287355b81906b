/* The stability suite, stacks of layers: up to ten, 1e-6 to 1e6 mean free paths thick. */
#include "stability.h"

#include "libdipole/internal.h"
#include "oracle_layers.h"
#include "random_layers.h"
#include "stacks.h"

/* ---- what must hold for any stack ------------------------------------------------------------------ */

/* Never NaN, infinite or negative; falling with distance; the parts add up. What is 1e-13 of the whole is
 * as good as nothing. */
static void check_face(const dipole_stack *stack, dipole_face face, bool is_ordered, struct rng *rng,
                       int number)
{
    const double slack = 1e-13;
    const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
    /* below the floor the profile goes on as a constant, the power of a half-space does not */
    double floor_mm = INFINITY;
    for (size_t k = 0; k < dipole_stack_layer_count(stack); k++)
        floor_mm = fmin(floor_mm, 1e-9 * dipole_stack_coefficients(stack, k)->mean_free_path_mm);
    double r = log_uniform(rng, 1e-9, 1e-8), last = top, last_within = 0.0;
    if (!is_sound(total) || total > 1.0 + 1e-14 || !is_sound(top))
        failed("stack %d, face %d: total %.17g, at 0 %.17g", number, (int)face, total, top);
    for (int k = 0; k < 25; k++, r *= log_uniform(rng, 1.0, 30.0)) {
        const double value = profile(stack, face, r), within = dipole_stack_within(stack, face, r),
                     beyond = dipole_stack_beyond(stack, face, r),
                     ring = dipole_stack_ring_mean_per_mm2(stack, face, r, r * 1.5);
        if (!is_sound(value) || (is_ordered && value > last * (1.0 + 1e-9) + slack * top + least))
            failed("stack %d, face %d, r %.17g: profile %.17g after %.17g", number, (int)face, r, value,
                   last);
        if (!is_sound(within) || !is_sound(beyond) || fabs(within + beyond - total) > 1e-14 * total ||
            (is_ordered && within < last_within * (1.0 - 1e-9) - slack * total - least))
            failed("stack %d, face %d, r %.17g: within %.17g after %.17g, beyond %.17g", number, (int)face,
                   r, within, last_within, beyond);
        if (!is_sound(ring) ||
            (is_ordered && r >= floor_mm && ring > value * (1.0 + 1e-9) + 10.0 * slack * top + least))
            failed("stack %d, face %d, r %.17g: ring mean %.17g, inner edge %.17g, outer %.17g", number,
                   (int)face, r, ring, value, profile(stack, face, 1.5 * r));
        last = value, last_within = within;
    }
}

static void check_gradients(const dipole_stack *stack, dipole_face face, struct rng *rng, int number)
{
    const size_t at = random_bits(rng) % dipole_stack_layer_count(stack);
    const double radii[3] = { 0.0, log_uniform(rng, 1e-9, 1e9),
                              dipole_stack_coefficients(stack, at)->mean_free_path_mm };
    dipole_stack_gradient gradients[4];
    dipole_stack_profile_gradient(stack, face, at, radii, 3, gradients);
    gradients[3] = dipole_stack_total_gradient(stack, face, at);
    for (int k = 0; k < 4; k++)
        if (!isfinite(gradients[k].d_log_sigma_a) || !isfinite(gradients[k].d_log_sigma_s_prime) ||
            !isfinite(gradients[k].d_log_thickness))
            failed("stack %d, face %d, layer %zu: gradient %d", number, (int)face, at, k);
}

static void check_stack(const dipole_layer *layers, size_t count, dipole_model model, dipole_side side,
                        bool is_ordered, struct rng *rng, int number)
{
    dipole_stack *stack;
    dipole_status status;
    if (!dipole_stack_create(layers, count, model, side, &stack, &status)) {
        failed("stack %d: %s", number, status.message);
        return;
    }
    double sum = 0.0;
    for (int f = 0; f < 2; f++) {
        const dipole_face face = (dipole_face)f;
        sum += dipole_stack_total(stack, face) + dipole_stack_unscattered(stack, face);
        check_face(stack, face, is_ordered, rng, number);
        if (number % 8 == 0)
            check_gradients(stack, face, rng, number);
    }
    if (!(sum <= 1.0 + 1e-14 * (double)count))
        failed("stack %d: energy %.17g", number, sum);
    dipole_stack_destroy(stack);
}

void sweep_layers(int count)
{
    /* Of these models only the beam's profile falls in any stack: the others' formulas give something
     * negative between very unequal layers (T25, T29), which is cut off. The multipole's source must lie
     * within the layer. */
    static const struct {
        dipole_model model;
        bool is_ordered;
        int divisor; /* of the count */
        const char *name, *held;
    } sweeps[] = {
        { DIPOLE_MODEL_BEAM, true, 1, "beam, 1 to 10 layers", "the same, to 1e-13 of the whole" },
        { DIPOLE_MODEL_MODES, false, 4, "modes, 1 to 10 layers",
          "never NaN, infinite or negative; within + beyond = total; energy ≤ 1" },
        { DIPOLE_MODEL_MULTIPOLE, false, 4, "multipole, 1 to 10 layers", "the same" },
    };
    for (size_t m = 0; m < sizeof sweeps / sizeof *sweeps; m++) {
        struct rng rng = { .seed = 111 };
        for (int i = 0; i < count / sweeps[m].divisor; i++) {
            dipole_layer layers[RANDOM_LAYERS];
            const size_t layer_count = random_layers(&rng, layers);
            const bool is_finite = isfinite(layers[layer_count - 1].thickness_mm);
            for (size_t k = 0; sweeps[m].model == DIPOLE_MODEL_MULTIPOLE && k < layer_count; k++)
                layers[k].thickness_mm =
                    fmax(layers[k].thickness_mm,
                         1.01 / (layers[k].medium.sigma_a_per_mm + layers[k].medium.sigma_s_prime_per_mm));
            check_stack(layers, layer_count, sweeps[m].model,
                        is_finite && i % 2 ? DIPOLE_FROM_BELOW : DIPOLE_FROM_ABOVE, sweeps[m].is_ordered,
                        &rng, i);
        }
        printf("| %s | %d | %s |\n", sweeps[m].name, 50 * (count / sweeps[m].divisor), sweeps[m].held);
    }
}

/* ---- against MPFR ---------------------------------------------------------------------------------- */

static struct layers_oracle oracle;
static struct layers_spectrum spectrum;

static void compare_responses(int count)
{
    struct rng rng = { .seed = 112 };
    struct errors all[] = { { .name = "layers, totals, relative", .bound = 1e-12 },
                            { .name = "layers, spectrum, relative", .bound = 1e-12 } };
    for (int k = 0; k < 2; k++)
        errors_init(&all[k], 2 * (size_t)count);
    for (int i = 0; i < count; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        struct system system;
        struct dual found[2];
        double expected[2];
        const size_t layer_count = random_layers(&rng, layers);
        for (size_t k = 0; k < layer_count; k++)
            if (!dipole_coefficients_init(&layers[k].medium, &coefficients[k], NULL))
                failed("stack %d was refused", i);
        const int is_total = i % 3 == 0;
        const double k = (is_total ? 1e-30 : log_uniform(&rng, 1e-8, 1e4)) /
                         coefficients[random_bits(&rng) % layer_count].mean_free_path_mm;
        layers_oracle_init(&oracle, layers, coefficients, layer_count);
        layers_oracle_response(&oracle, k, expected);
        dipole_system_init(&system, layers, coefficients, layer_count, -1);
        dipole_system_solve(&system, is_total ? 0.0 : k * k, found);
        for (int face = 0; face < 2; face++)
            if (expected[face] > least &&
                !errors_add(&all[!is_total], fabs(creal(found[face].v) / expected[face] - 1.0)))
                failed("stack %d, face %d, k %g: found %.17g, expected %.17g", i, face, k,
                       creal(found[face].v), expected[face]);
        layers_oracle_clear(&oracle);
    }
    for (int k = 0; k < 2; k++)
        errors_print(&all[k], "1");
}

static void compare_profiles(int count)
{
    enum { RADII = 8 };
    struct rng rng = { .seed = 113 };
    struct errors errors = { .name = "layers, profile, over its value at 0", .bound = 1e-9 };
    errors_init(&errors, 2 * RADII * (size_t)count);
    for (int i = 0; i < count; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        dipole_coefficients coefficients[RANDOM_LAYERS];
        const size_t layer_count = random_layers(&rng, layers);
        dipole_stack *stack;
        dipole_status status;
        if (!dipole_stack_create(layers, layer_count, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack,
                                 &status)) {
            failed("stack %d: %s", i, status.message);
            continue;
        }
        for (size_t k = 0; k < layer_count; k++)
            coefficients[k] = *dipole_stack_coefficients(stack, k);
        layers_oracle_init(&oracle, layers, coefficients, layer_count);
        for (int f = 0; f < 2; f++) {
            const dipole_face face = (dipole_face)f;
            const double total = dipole_stack_total(stack, face), top = profile(stack, face, 0.0);
            if (!(total > least && top > least))
                continue;
            const double width_mm = sqrt(total / top);
            layers_spectrum_init(&spectrum, layers_oracle_response, &oracle, 1e-7 / width_mm);
            for (int j = 0; j < RADII; j++) {
                const double r = width_mm * log_uniform(&rng, 1e-2, 30.0), found = profile(stack, face, r),
                             expected = layers_oracle_profile(&spectrum, f, r);
                if (!errors_add(&errors, fabs(found - expected) / top))
                    failed("stack %d, face %d, r %g: found %.17g, expected %.17g, at 0 %g", i, f, r, found,
                           expected, top);
            }
        }
        layers_oracle_clear(&oracle);
        dipole_stack_destroy(stack);
    }
    errors_print(&errors, "1");
}

void compare_layers(int count)
{
    compare_responses(count);
    compare_profiles(count / 100 + 1);
}
