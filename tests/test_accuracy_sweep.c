/* accuracy/sweep.c and results.c: which points are best, what halving an error costs, and what is kept. */
#include "check.h"
#include "scenes.h"

#include "accuracy/sweep.h"
#include "io/file.h"
#include "io/json.h"

#include <string.h>
#include <unistd.h>

/* A sweep without a picture. */
struct test_sweep {
    struct test_scene scene;
    struct renderer renderer;
    struct accuracy_subject subject;
    struct accuracy_point points[64];
    struct accuracy_sweep sweep;
};

static void sweep_init(struct test_sweep *test, size_t count)
{
    memset(test, 0, sizeof *test);
    scene_init(&test->scene, 10);
    test->subject.scene = &test->scene.scene;
    test->subject.renderer = &test->renderer;
    render_machine_identify("a driver", &test->renderer.machine);
    test->sweep = (struct accuracy_sweep){
        .subject = &test->subject, .points = test->points, .point_count = count, .key = "key"
    };
    for (size_t i = 0; i < count; i++) {
        test->points[i] =
            (struct accuracy_point){ .knob = &accuracy_knobs[i % 3], .is_drawn = true, .time_count = 1 };
        snprintf(test->points[i].setting.label, ACCURACY_LABEL_SIZE, "setting %zu", i);
    }
}

/* Oracle: a point is best if none has less of both, by trying all; random points, many alike. */
static void the_best_points_are_those_that_none_beats(void **state)
{
    (void)state;
    struct rng rng = { 1 };
    struct test_sweep test;
    for (int round = 0; round < 50; round++) {
        sweep_init(&test, 40);
        for (size_t i = 0; i < 40; i++) {
            test.points[i].time_ms.median = floor(uniform(&rng, 1, 10));
            test.points[i].error.rmse = floor(uniform(&rng, 1, 10));
        }
        for (size_t i = 0; i < 40; i++) {
            bool is_beaten = false, has_twin = false;
            for (size_t k = 0; k < 40; k++) {
                const struct accuracy_point *const a = &test.points[i], *const b = &test.points[k];
                const bool is_less = b->time_ms.median < a->time_ms.median || b->error.rmse < a->error.rmse;
                is_beaten |=
                    b->time_ms.median <= a->time_ms.median && b->error.rmse <= a->error.rmse && is_less;
                has_twin |=
                    k < i && b->time_ms.median == a->time_ms.median && b->error.rmse == a->error.rmse;
            }
            assert_int_equal(accuracy_point_is_best(&test.sweep, i, true), !is_beaten && !has_twin);
        }
    }
}

/* Oracle: t = error^-p. */
static void halving_follows_a_power_law(void **state)
{
    (void)state;
    static const double powers[] = { 0.1, 0.5, 1, 2, 3 };
    for (size_t k = 0; k < sizeof powers / sizeof *powers; k++) {
        struct test_sweep test;
        sweep_init(&test, 12);
        for (size_t i = 0; i < 12; i++) {
            test.points[i].knob = &accuracy_knobs[2];
            test.points[i].error.rmse = pow(0.6, (double)i);
            test.points[i].time_ms.median = 3 * pow(test.points[i].error.rmse, -powers[k]);
        }
        test.points[5].time_ms.median *= 10; /* beaten: does not count */
        assert_close(accuracy_halving_cost(&test.sweep, &accuracy_knobs[2]), pow(2, powers[k]), 1e-9,
                     "p %g", powers[k]);
        assert_true(isnan(accuracy_halving_cost(&test.sweep, &accuracy_knobs[1])));
    }
}

static void knobs_have_names_of_their_own_and_go_from_coarse_to_fine(void **state)
{
    (void)state;
    for (size_t k = 0; accuracy_knobs[k].name; k++) {
        assert_true(accuracy_knobs[k].value_count > 1);
        assert_true(accuracy_knobs[k].value_count <= ACCURACY_SETTING_LIMIT);
        for (size_t j = 0; j < k; j++)
            assert_string_not_equal(accuracy_knobs[j].name, accuracy_knobs[k].name);
    }
}

/* Oracle: the times written. What another scene, machine or knob left is not taken over. */
static void results_are_taken_up_again(void **state)
{
    (void)state;
    struct test_sweep test, again;
    sweep_init(&test, 6);
    for (size_t i = 0; i < 6; i++) {
        test.points[i].time_count = i;
        for (size_t r = 0; r < i; r++)
            test.points[i].times_ms[r] = 1.5 * (double)i + (double)r;
        test.points[i].predicted_ms = (double)NAN;
    }
    (void)unlink("results.json");
    sweep_init(&again, 6);
    assert_true(accuracy_results_resume(&again.sweep, "results.json", NULL)); /* there is none */
    assert_true(accuracy_results_write(&test.sweep, "results.json", NULL));
    assert_true(accuracy_results_resume(&again.sweep, "results.json", NULL));
    for (size_t i = 0; i < 6; i++) {
        assert_int_equal(again.points[i].time_count, i);
        for (size_t r = 0; r < i; r++)
            assert_close(again.points[i].times_ms[r], 1.5 * (double)i + (double)r, 0, "time");
    }
    sweep_init(&again, 6);
    strcpy(again.sweep.key, "other");
    assert_true(accuracy_results_resume(&again.sweep, "results.json", NULL));
    assert_int_equal(again.points[5].time_count, 1);
    sweep_init(&again, 6);
    again.renderer.machine.cpu[0] ^= 1;
    assert_true(accuracy_results_resume(&again.sweep, "results.json", NULL));
    assert_int_equal(again.points[5].time_count, 1);
    assert_true(io_file_write("results.json", "{", 1, NULL));
    dipole_status status;
    assert_false(accuracy_results_resume(&again.sweep, "results.json", &status));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_best_points_are_those_that_none_beats),
        cmocka_unit_test(halving_follows_a_power_law),
        cmocka_unit_test(knobs_have_names_of_their_own_and_go_from_coarse_to_fine),
        cmocka_unit_test(results_are_taken_up_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
