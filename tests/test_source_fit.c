#include "check.h"
#include "random_layers.h"
#include "stacks.h"

#include "io/material_file.h"
#include "libdipole/dipole.h"

#include <dirent.h>
#include <string.h>

static const char *const model_names[] = { "dipole", "better_dipole", "multipole", "beam", "modes" };

/* How far the sources' profile is from the stack's, at random radii. */
static double largest_error(const dipole_stack *stack, const dipole_sources *sources, double r_min,
                            double r_max, struct rng *rng)
{
    double largest = 0.0;
    for (int i = 0; i < 50; i++) {
        const double r = log_uniform(rng, r_min, r_max), across = 0.0;
        double found;
        dipole_sources_profile_per_mm2(sources, r, &across, 1, &found);
        largest = fmax(largest, fabs(found / profile(stack, DIPOLE_FACE_LIT, r) - 1.0));
    }
    return largest;
}

static void check_sources(const dipole_sources *sources, const char *name)
{
    assert_true(sources->count % 2 == 0 && sources->count <= DIPOLE_SOURCE_LIMIT);
    double slowest = INFINITY;
    for (size_t k = 0; k < sources->count; k++) {
        const dipole_source *const source = &sources->at[k];
        if (!(source->weight > 0.0 && source->depth_mm != 0.0))
            fail_msg("%s: source %zu at %g mm has weight %g", name, k, source->depth_mm, source->weight);
        slowest = fmin(slowest, source->sigma_tr_per_mm);
    }
    assert_true(sources->count == 0 || slowest == sources->sigma_tr_per_mm);
}

/* ---- the bundled materials ------------------------------------------------------------------------ */

struct tally {
    size_t fits, most, sum;
    double worst;
};

static struct tally tallies[5];

static void one_fit(const struct io_material *material, int channel, dipole_model model, dipole_side side,
                    double scale)
{
    dipole_layer layers[DIPOLE_LAYER_LIMIT];
    for (size_t i = 0; i < material->layer_count; i++) {
        layers[i] = material->layers[channel][i];
        layers[i].medium.sigma_a_per_mm *= scale;
        layers[i].medium.sigma_s_prime_per_mm *= scale;
        layers[i].thickness_mm /= scale;
    }
    dipole_stack *stack;
    if (!dipole_stack_create(layers, material->layer_count, model, side, &stack, NULL))
        return; /* the model does not know such layers */
    const double r_min = 0.1 * dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
    const double r_max = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-3);
    if (r_max > r_min) {
        dipole_sources sources;
        dipole_status status;
        if (!dipole_sources_init(stack, 0.01, r_min, r_max, &sources, &status))
            fail_msg("%s %s, channel %d: %s", material->name, model_names[model], channel, status.message);
        check_sources(&sources, material->name);
        struct rng rng = { .seed = 61 };
        const double error = largest_error(stack, &sources, r_min, r_max, &rng);
        const double power = dipole_sources_within(&sources, 0.0, r_max),
                     all = dipole_sources_within(&sources, 0.0, INFINITY);
        /* between the places where it is measured it may be a little more */
        if (!(sources.max_relative_error <= 0.01 && error <= 1.3 * sources.max_relative_error + 1e-12))
            fail_msg("%s %s, channel %d: error %g, measured %g", material->name, model_names[model],
                     channel, error, sources.max_relative_error);
        assert_close(all, dipole_stack_total(stack, DIPOLE_FACE_LIT), 1e-3, "%s, total", material->name);
        assert_close(power, dipole_stack_within(stack, DIPOLE_FACE_LIT, r_max),
                     model == DIPOLE_MODEL_BEAM ? 1e-3 : 1e-10, "%s, within r_max", material->name);
        struct tally *const tally = &tallies[model];
        tally->fits++;
        tally->sum += sources.count;
        tally->most = sources.count > tally->most ? sources.count : tally->most;
        tally->worst = fmax(tally->worst, error);
    }
    dipole_stack_destroy(stack);
}

static void every_fit_of(const char *path)
{
    struct io_material material;
    dipole_status status;
    if (!io_material_read(path, &material, &status))
        fail_msg("%s", status.message);
    static const double scales[] = { 1.0, 1e-6, 1e6 };
    for (int i = 0; i < 3; i++)
        for (int channel = 0; channel < IO_CHANNEL_COUNT; channel++)
            for (dipole_model model = DIPOLE_MODEL_DIPOLE; model <= DIPOLE_MODEL_MODES; model++) {
                one_fit(&material, channel, model, DIPOLE_FROM_ABOVE, scales[i]);
                one_fit(&material, channel, model, DIPOLE_FROM_BELOW, scales[i]);
            }
}

static void each_material(const char *folder)
{
    DIR *entries = opendir(folder);
    assert_non_null(entries);
    for (const struct dirent *entry; (entry = readdir(entries));) {
        const char *const end = strstr(entry->d_name, ".json");
        if (!end || end[5] != '\0' || strstr(entry->d_name, "schema"))
            continue;
        char path[2048];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        every_fit_of(path);
    }
    closedir(entries);
}

/* Oracle: each model's own profile, power within r_max and total, from 0.1 mean free paths of the first
 * layer to where 1/1000 of the light is left; all coefficients times 1e-6 and 1e6 as well. */
static void every_material_has_sources_within_a_hundredth(void **state)
{
    (void)state;
    each_material(SOURCE_FOLDER "/materials");
    each_material(SOURCE_FOLDER "/materials/layered");
    each_material(SOURCE_FOLDER "/materials/narasimhan2006");
    for (int model = 0; model < 5; model++)
        print_message("  %s: %zu, worst %.2g, %.1f sources, at most %zu\n", model_names[model],
                      tallies[model].fits, tallies[model].worst,
                      (double)tallies[model].sum / (double)tallies[model].fits, tallies[model].most);
}

/* ---- anything ------------------------------------------------------------------------------------- */

/* Oracle: the profile. Whatever the layers, either it is met or it is said what was reached. */
static void any_stack_is_met_or_refused(void **state)
{
    (void)state;
    struct rng rng = { .seed = 62 };
    static const dipole_model models[] = { DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES, DIPOLE_MODEL_MULTIPOLE };
    size_t met = 0, asked = 0;
    for (int i = 0; i < 300 / SLOWNESS; i++) {
        dipole_layer layers[RANDOM_LAYERS];
        const size_t count = random_layers(&rng, layers);
        dipole_stack *stack;
        if (!dipole_stack_create(layers, count, models[i % 3], DIPOLE_FROM_ABOVE, &stack, NULL))
            continue;
        const double r_min = 0.1 * dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
        const double r_max = fmin(dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-3), 1e6 * r_min);
        dipole_sources sources;
        dipole_status status = { 0 };
        if (r_max > r_min) {
            asked++;
            if (dipole_sources_init(stack, 0.01, r_min, r_max, &sources, &status)) {
                met++;
                check_sources(&sources, "any");
                const double error = largest_error(stack, &sources, r_min, r_max, &rng);
                if (!(sources.max_relative_error <= 0.01 && error <= 0.03))
                    fail_msg("case %d, %s: error %g, measured %g, %zu sources", i,
                             model_names[models[i % 3]], error, sources.max_relative_error, sources.count);
            } else {
                assert_true(status.code == DIPOLE_NOT_CONVERGED || status.code == DIPOLE_NOT_SUPPORTED);
            }
        }
        dipole_stack_destroy(stack);
    }
    print_message("  %zu of %zu\n", met, asked);
    assert_true(10 * met >= 8 * asked);
}

/* Oracle: energy. What does not scatter sends nothing out, and has no sources. */
static void what_does_not_scatter_has_no_sources(void **state)
{
    (void)state;
    const dipole_layer black = { { 1.0, 0.0, 1.3, DIPOLE_FDR_EXACT }, INFINITY };
    for (dipole_model model = DIPOLE_MODEL_DIPOLE; model <= DIPOLE_MODEL_MODES; model++) {
        dipole_stack *const stack = stack_of(&black, 1, model);
        dipole_sources sources;
        const double across = 0.0;
        double value;
        assert_true(dipole_sources_init(stack, 0.01, 0.1, 10.0, &sources, NULL));
        assert_int_equal(sources.count, 0);
        dipole_sources_profile_per_mm2(&sources, 1.0, &across, 1, &value);
        assert_true(value == 0.0 && dipole_sources_within(&sources, 0.0, INFINITY) == 0.0);
        dipole_stack_destroy(stack);
    }
}

/* Oracle: the messages that dipole.h promises. */
static void what_cannot_be_met_is_refused(void **state)
{
    (void)state;
    const dipole_layer skin = { { 0.032, 0.74, 1.3, DIPOLE_FDR_EXACT }, INFINITY };
    dipole_stack *const stack = stack_of(&skin, 1, DIPOLE_MODEL_MODES);
    dipole_sources sources;
    dipole_status status;
    assert_false(dipole_sources_init(stack, 1e-9, 0.1, 20.0, &sources, &status));
    assert_int_equal(status.code, DIPOLE_NOT_CONVERGED);
    if (!strstr(status.message,
                "of the profile from r_min_mm 0.1 to r_max_mm 20, epsilon is 1e-09; expected "
                "a larger one"))
        fail_msg("%s", status.message);
    assert_false(dipole_sources_init(stack, 0.01, 0.1, 1e5, &sources, &status));
    assert_int_equal(status.code, DIPOLE_NOT_CONVERGED);
    if (!strstr(status.message, "the profile is 0 at "))
        fail_msg("%s", status.message);
    dipole_stack_destroy(stack);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_material_has_sources_within_a_hundredth),
        cmocka_unit_test(any_stack_is_met_or_refused),
        cmocka_unit_test(what_does_not_scatter_has_no_sources),
        cmocka_unit_test(what_cannot_be_met_is_refused),
    };
    return cmocka_run_group_tests_name("source_fit", tests, NULL, NULL);
}
