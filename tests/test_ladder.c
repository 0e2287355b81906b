/* accuracy/ladder.h, reference.h and simulation.h. */
#include "reference_cases.h"
#include "run_tool.h"
#include "tests/svg_check.h"

#include "accuracy/ladder.h"
#include "accuracy/simulation.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

enum {
    MONTE_CARLO_1E3 = 0,
    MONTE_CARLO_1E4,
    MONTE_CARLO_1E5,
    MONTE_CARLO_1E6,
    DIPOLE,
    BETTER,
    MULTIPOLE,
    BEAM,
    MODES
};

/* ---- what the tests share ----------------------------------------------------------------------- */

static const struct accuracy_reference_case *find_case(const struct accuracy_reference *reference,
                                                       const char *name)
{
    for (size_t i = 0; i < reference->case_count; i++)
        if (strcmp(reference->cases[i].name, name) == 0)
            return &reference->cases[i];
    fail_msg("no case %s", name);
    return NULL;
}

/* Three quick cases, and every fourteenth slab. */
static struct accuracy_reference *few_references(void)
{
    struct accuracy_reference *const all = read_reference();
    struct accuracy_reference *const few = calloc(1, sizeof *few);
    assert_non_null(few);
    few->cases[few->case_count++] = *find_case(all, "semi_lowalb_n14");
    few->cases[few->case_count++] = *find_case(all, "slab_hialb_n15_01mfp");
    few->cases[few->case_count++] = *find_case(all, "layer2_absorbtop_n135_155");
    for (size_t i = 0; i < all->slab_count; i += 14)
        few->slabs[few->slab_count++] = all->slabs[i];
    free(all);
    return few;
}

static void climb(const struct accuracy_ladder_options *options, struct accuracy_ladder *ladder)
{
    dipole_status status;
    if (!accuracy_ladder_init(options, ladder, &status))
        fail_msg("%s", status.message);
}

/* ---- reference data ------------------------------------------------------------------------------- */

/* Oracle: the files, as one reads them. */
static void reference_data_are_read(void **state)
{
    (void)state;
    struct accuracy_reference *const reference = read_reference();
    assert_int_equal(reference->case_count, 16);
    assert_int_equal(reference->slab_count, 168);
    const struct accuracy_reference_case *const skin = find_case(reference, "layer3_skinR");
    assert_int_equal(skin->stack.layer_count, 3);
    assert_true(skin->stack.layers[1].sigma_s_per_mm == 3.2 && skin->stack.layers[1].thickness_mm == 0.5);
    assert_true(isinf(skin->stack.layers[2].thickness_mm) && skin->ring_count == 130);
    assert_true(skin->rd_per_mm2[0] == 26.90902 && skin->rd_error[0] == 0.042 && skin->td_per_mm2[0] == 0);
    const struct accuracy_reference_case *const slab = find_case(reference, "slab_hialb_n15_01mfp");
    assert_true(slab->td_per_mm2[0] == 0.7904046 && slab->unscattered_transmitted == 0.33927562);
    assert_int_equal(find_case(reference, "val_giovanelli")->ring_count, 0);
    assert_true(reference->slabs[1].total_t == 0.189321516433 && reference->slabs[1].error == 7.7e-8);
    assert_true(reference->slabs[1].stack.layers[0].thickness_mm == 2);
    free(reference);
}

/* Oracle: exact messages. */
static void broken_reference_data_are_refused(void **state)
{
    (void)state;
    static const char head[] = "case,layers,Rsp,R,R_sem,R0,T,T_sem,T0\n";
    static const struct {
        const char *rows, *message;
    } cases[] = {
        { "a,n=1,0,0,0,0,0,0,0\n", "layers is \"n=1\", expected n=... d_mm=..." },
        { "a,n=1 sigma_a=1 sigma_s=1 g=0 d_mm=1,0,2,0,0,0,0,0\n", "R is 2, expected 0 to 1" },
    };
    struct accuracy_reference *reference;
    dipole_status status;
    assert_false(accuracy_reference_read(".", &reference, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_null(reference);
    write_text("mcml_totals.csv", "case,layers\n");
    assert_false(accuracy_reference_read(".", &reference, &status));
    assert_string_equal(status.message, "has no column Rsp");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[512];
        snprintf(text, sizeof text, "%s%s", head, cases[i].rows);
        write_text("mcml_totals.csv", text);
        assert_false(accuracy_reference_read(".", &reference, &status));
        assert_string_equal(status.message, cases[i].message);
        assert_int_equal(status.line, 2);
    }
    write_text("mcml_totals.csv", head);
    assert_false(accuracy_reference_read(".", &reference, &status)); /* adding_doubling.csv is not there */
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
}

/* ---- the ladder ----------------------------------------------------------------------------------- */

/* Oracle: the sum of T78 by hand; the numbers of docs/models.md for totals; more photons are nearer, within
 * their errors; what agrees with MCML and adding and doubling is within 3 standard errors, 1 % of rings at
 * most beyond. */
static void rungs_stand_where_they_should(void **state)
{
    (void)state;
    struct accuracy_reference *const few = few_references();
    const struct accuracy_ladder_options options = { .reference = few, .is_quick = true, .seed = 3 };
    struct accuracy_ladder ladder;
    climb(&options, &ladder);
    assert_int_equal(ladder.case_count, 3);
    const struct accuracy_ladder_case *const low = &ladder.cases[0];
    dipole_stack *stack;
    const dipole_layer layer = { { 1, 1, 1.4, DIPOLE_FDR_EXACT }, INFINITY };
    assert_true(dipole_stack_create(&layer, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL));
    double difference = 0, sum = 0;
    for (size_t i = 0; i < low->ring_count; i++) {
        const double lo_mm = low->edges_mm[i], hi_mm = low->edges_mm[i + 1];
        const double area_mm2 = PI * (hi_mm * hi_mm - lo_mm * lo_mm);
        const double found = dipole_stack_within(stack, DIPOLE_FACE_LIT, hi_mm) -
                             dipole_stack_within(stack, DIPOLE_FACE_LIT, lo_mm);
        difference += fabs(found - area_mm2 * low->rd_per_mm2[i]);
        sum += area_mm2 * low->rd_per_mm2[i];
    }
    dipole_stack_destroy(stack);
    /* The table's power is 0.052 of what falls on it, of which 0.0278 is mirrored. */
    assert_close(sum, 0.052324868 / (1 - 0.027777778), 1e-3, "power in rings");
    assert_close(low->rungs[BEAM].error, difference / sum, 1e-9, "beam");
    assert_true(fabs(low->rungs[DIPOLE].total_error - 0.37) < 0.01);
    assert_true(fabs(low->rungs[BEAM].total_error - 0.14) < 0.01);
    assert_false(low->rungs[MULTIPOLE].is_known);
    assert_false(ladder.cases[1].rungs[MULTIPOLE].is_known || ladder.cases[2].rungs[DIPOLE].is_known);
    for (size_t i = 0; i < ladder.case_count; i++) {
        const struct accuracy_rung *const rungs = ladder.cases[i].rungs;
        assert_true(rungs[MONTE_CARLO_1E5].is_known && !rungs[MONTE_CARLO_1E6].is_known);
        assert_true(rungs[MONTE_CARLO_1E5].error < 0.3 * rungs[MONTE_CARLO_1E3].error);
        assert_true(rungs[MODES].is_known && rungs[BEAM].error > rungs[MODES].error);
        assert_true(rungs[MODES].time_ns > 0 && rungs[MODES].prepare_ns > 0);
        assert_true(ladder.cases[i].floor > 0 && ladder.cases[i].floor < 0.005);
    }
    const struct accuracy_agreement *const totals = &ladder.agreement_totals, *const rings =
                                                                                  &ladder.agreement_rings;
    print_message("  z of %zu totals up to %.2f, of %zu rings up to %.2f, %zu beyond 3\n", totals->count,
                  totals->worst, rings->count, rings->worst, rings->beyond_count);
    assert_true(totals->count > 20 && totals->worst < 3);
    assert_true(rings->count > 60 && rings->worst < 4.5 && rings->beyond_count <= 1);
    assert_true(rings->mean_square < 1.5);
    for (int g = 0; g < 2; g++)
        assert_true(ladder.total_counts[g][MODES] > 5 && ladder.totals[g][MONTE_CARLO_1E4].error < 0.05);
    assert_true(ladder.totals[0][MODES].error < ladder.totals[0][BEAM].error);
    accuracy_ladder_end(&ladder);
    free(few);
}

/* Oracle: the contract of the JSON and of SVG; the median, least and largest by eye. */
static void results_are_written(void **state)
{
    (void)state;
    struct io_material materials[2];
    struct accuracy_ladder ladder;
    assert_true(io_material_open("skin1", &materials[0], NULL) &&
                io_material_open("layered/marble_slab", &materials[1], NULL));
    const struct accuracy_ladder_options options = {
        .materials = materials, .material_count = 2, .truth_photon_count = 8000, .g = 0.3
    };
    climb(&options, &ladder);
    assert_int_equal(ladder.case_count, 6);
    assert_string_equal(ladder.cases[0].name, "Skin 1, R");
    assert_true(ladder.cases[0].is_own_truth && ladder.cases[0].rungs[MONTE_CARLO_1E3].is_known);
    assert_false(
        ladder.cases[0].rungs[MONTE_CARLO_1E4].is_known); /* truth is by less than four times as many */
    assert_close(ladder.cases[0].stack.layers[0].sigma_s_per_mm, 0.74 / 0.7, 1e-15, "similarity");
    ladder.cases[0].rungs[DIPOLE].error = 0.1; /* the slab has none */
    ladder.cases[1].rungs[DIPOLE].error = 0.3;
    ladder.cases[2].rungs[DIPOLE].error = 0.2;
    struct accuracy_rung_summary summary;
    assert_true(accuracy_rung_summarize(&ladder, DIPOLE, &summary));
    assert_true(summary.count == 3 && summary.error == 0.2 && summary.error_low == 0.1 &&
                summary.error_high == 0.3);
    assert_false(accuracy_rung_summarize(&ladder, MONTE_CARLO_1E6, &summary));
    json_t *const root = accuracy_ladder_to_json(&ladder);
    json_t *rungs, *cases, *totals;
    double numbers;
    assert_int_equal(json_unpack(root, "{s:o, s:o, s:o, s:{s:{s:F, s:F, s:F, s:F !}, s:o !} !}", "rungs",
                                 &rungs, "cases", &cases, "totals", &totals, "monte_carlo_z", "totals",
                                 "numbers", &numbers, "beyond_3", &numbers, "worst_z", &numbers,
                                 "mean_square_z", &numbers, "rings", &(json_t *){ NULL }),
                     0);
    assert_int_equal(json_array_size(cases), 6);
    assert_string_equal(json_string_value(json_object_get(json_array_get(rungs, 1), "rung")), "dipole");
    assert_int_equal(json_array_size(json_object_get(json_array_get(cases, 5), "edges_mm")), 41);
    json_decref(root);
    char *svg;
    size_t size;
    assert_true(accuracy_ladder_plot_create(&ladder, &svg, &size, NULL));
    assert_drawable(svg);
    assert_non_null(strstr(svg, "modes"));
    free(svg);
    accuracy_ladder_end(&ladder);
}

static size_t shown_count;

static void count_shown(void *context, const char *what, double fraction)
{
    assert_true(what[0] != '\0' && fraction >= 0 && fraction <= 1);
    *(volatile sig_atomic_t *)context = 1;
    shown_count++;
}

/* Oracle: what was asked for; an empty ladder has a picture, too. */
static void it_ends_early(void **state)
{
    (void)state;
    volatile sig_atomic_t stop = 0;
    struct accuracy_reference *const few = few_references();
    const struct accuracy_ladder_options options = {
        .reference = few, .is_quick = true, .stop = &stop, .show = count_shown, .context = (void *)&stop
    };
    struct accuracy_ladder ladder;
    climb(&options, &ladder);
    assert_true(ladder.case_count == 1 && shown_count == 1 && !ladder.totals[0][MODES].is_known);
    accuracy_ladder_end(&ladder);
    climb(&options, &ladder);
    assert_true(ladder.case_count == 0);
    char *svg;
    size_t size;
    assert_true(accuracy_ladder_plot_create(&ladder, &svg, &size, NULL));
    assert_drawable(svg);
    free(svg);
    accuracy_ladder_end(&ladder);
    free(few);
}

/* ---- simulations of materials --------------------------------------------------------------------- */

/* Oracle: the same stack traced by itself; the contract of the JSON. */
static void a_material_is_simulated(void **state)
{
    (void)state;
    const struct accuracy_simulation_options options = { "layered/skin", 0.5, { 6400, 9, 0 } };
    struct accuracy_simulation *const simulation = malloc(sizeof *simulation);
    struct accuracy_mc_stack stack;
    struct accuracy_mc_result alone;
    assert_non_null(simulation);
    assert_true(accuracy_simulation_run(&options, simulation, NULL));
    accuracy_mc_stack_init(simulation->material.layers[1], 3, 0.5, &stack);
    assert_close(stack.layers[0].sigma_s_per_mm, 12, 1e-15, "similarity");
    assert_true(accuracy_mc_trace(&stack, &options.run, NULL, &alone, NULL));
    assert_memory_equal(&alone.mean, &simulation->channels[1].result.mean, sizeof alone.mean);
    const double *const edges_mm = simulation->channels[1].edges_mm;
    assert_close(edges_mm[1], 0.05 / (6 + 0.21), 1e-12, "first ring");
    double power = 0;
    for (int i = 0; i < ACCURACY_SIMULATION_RING_COUNT; i++)
        power += PI * (edges_mm[i + 1] * edges_mm[i + 1] - edges_mm[i] * edges_mm[i]) *
                 simulation->channels[1].rd_per_mm2[i];
    assert_close(power, alone.mean.reflected, 0.01, "power in rings");
    json_t *const root = accuracy_simulation_to_json(simulation);
    const char *name, *channel;
    double g, seconds, per_photon;
    json_int_t photons, seed;
    json_t *channels, *powers, *rings;
    assert_int_equal(json_unpack(root, "{s:s, s:F, s:I, s:I, s:F, s:o !}", "material", &name, "g", &g,
                                 "photons", &photons, "seed", &seed, "seconds", &seconds, "channels",
                                 &channels),
                     0);
    assert_true(g == 0.5 && photons == 6400 && seed == 9 && json_array_size(channels) == 3);
    assert_int_equal(json_unpack(json_array_get(channels, 2), "{s:s, s:F, s:o, s:o !}", "channel", &channel,
                                 "scatterings_per_photon", &per_photon, "powers", &powers, "rings", &rings),
                     0);
    assert_true(strcmp(channel, "B") == 0 && per_photon > 1);
    assert_int_equal(json_array_size(json_object_get(powers, "absorbed_in_layers")), 3);
    assert_int_equal(json_array_size(rings), 40);
    json_decref(root);
    FILE *const file = fopen("table.txt", "w");
    assert_non_null(file);
    accuracy_simulation_print(simulation, file);
    assert_int_equal(fclose(file), 0);
    free(simulation);
}

/* Oracle: exact messages. */
static void materials_that_are_none_are_refused(void **state)
{
    (void)state;
    struct accuracy_simulation *const simulation = malloc(sizeof *simulation);
    dipole_status status;
    assert_non_null(simulation);
    struct accuracy_simulation_options options = { "nothing.json", 0, { 100, 1, 1 } };
    assert_false(accuracy_simulation_run(&options, simulation, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    options = (struct accuracy_simulation_options){ "skin1", 0, { 0, 1, 1 } };
    assert_false(accuracy_simulation_run(&options, simulation, &status));
    assert_string_equal(status.message, "photon_count is 0, expected 1 to 1e12");
    free(simulation);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reference_data_are_read),
        tool_test(broken_reference_data_are_refused),
        cmocka_unit_test(rungs_stand_where_they_should),
        cmocka_unit_test(results_are_written),
        cmocka_unit_test(it_ends_early),
        tool_test(a_material_is_simulated),
        cmocka_unit_test(materials_that_are_none_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
