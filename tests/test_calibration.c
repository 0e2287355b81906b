/* renderer/calibration.c: what a machine's times are kept in, and what plans make of it. */
#include "plans.h"
#include "scenes.h"

#include "renderer/calibration.h"

#include <stdlib.h>
#include <unistd.h>

static struct render_machine machine(void)
{
    struct render_machine machine = { .cpu = "a \"fast\" one", .core_count = 3 };
    snprintf(machine.driver, sizeof machine.driver, "a driver, OpenGL 4.5");
    return machine;
}

static struct render_calibration calibration(void)
{
    return (struct render_calibration){ .effects = { { "surface", 0.25, 0.5, 7 },
                                                     { "gather", 0, 2, 0 },
                                                     { RENDER_BESIDE_EFFECTS, 0, 1, 11 } },
                                        .effect_count = 3 };
}

/* Oracle: what was written. */
static void what_is_kept_is_read_back(void **state)
{
    (void)state;
    const struct render_machine here = machine();
    const struct render_calibration kept = calibration();
    struct render_calibration read;
    assert_true(render_calibration_write("a/b/c.json", &here, &kept, NULL));
    assert_true(render_calibration_read("a/b/c.json", &here, &read, NULL));
    assert_int_equal(read.effect_count, kept.effect_count);
    for (size_t i = 0; i < kept.effect_count; i++) {
        assert_string_equal(read.effects[i].name, kept.effects[i].name);
        assert_close(read.effects[i].fixed_ms, kept.effects[i].fixed_ms, 0, "fixed");
        assert_close(read.effects[i].scale, kept.effects[i].scale, 0, "scale");
        assert_close(read.effects[i].start_ms, kept.effects[i].start_ms, 0, "start");
    }
    assert_null(render_calibration_find(&read, "splat"));
    assert_null(render_calibration_find(NULL, "surface"));
    assert_close(render_calibration_find(&read, "gather")->scale, 2, 0, "found");
}

/* Another machine, driver or number of processors has another name, and another's file is refused. */
static void a_calibration_is_of_one_machine(void **state)
{
    (void)state;
    const struct render_calibration kept = calibration();
    const struct render_machine here = machine();
    struct render_machine others[3] = { here, here, here };
    char path[256], other_path[256];
    others[0].cpu[0] = 'b';
    others[1].core_count = 4;
    others[2].driver[0] = 'b';
    assert_int_equal(setenv("DIPOLE_CACHE", "cache", 1), 0);
    assert_true(render_calibration_path(&here, path, sizeof path, NULL));
    assert_memory_equal(path, "cache/calibration-", 18);
    assert_true(render_calibration_write(path, &here, &kept, NULL));
    for (int i = 0; i < 3; i++) {
        struct render_calibration read;
        dipole_status status;
        assert_true(render_calibration_path(&others[i], other_path, sizeof other_path, NULL));
        assert_string_not_equal(other_path, path);
        assert_false(render_calibration_read(path, &others[i], &read, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_int_equal(read.effect_count, 0);
        assert_false(render_calibration_read(other_path, &others[i], &read, &status));
        assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    }
}

static void folders_follow_the_environment(void **state)
{
    (void)state;
    const struct render_machine here = machine();
    char path[256];
    dipole_status status;
    assert_int_equal(unsetenv("DIPOLE_CACHE"), 0);
    assert_int_equal(setenv("XDG_CACHE_HOME", "/x", 1), 0);
    assert_true(render_calibration_path(&here, path, sizeof path, NULL));
    assert_memory_equal(path, "/x/libdipole/calibration-", 25);
    assert_int_equal(setenv("XDG_CACHE_HOME", "relative", 1), 0); /* to be ignored, by its specification */
    assert_int_equal(setenv("HOME", "/h", 1), 0);
    assert_true(render_calibration_path(&here, path, sizeof path, NULL));
    assert_memory_equal(path, "/h/.cache/libdipole/calibration-", 32);
    assert_false(render_calibration_path(&here, path, 40, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_int_equal(unsetenv("HOME"), 0);
    assert_false(render_calibration_path(&here, path, sizeof path, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
}

static void damaged_files_are_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "", "[]", "{", "{\"version\": 1}",
        "{\"version\": \"x\", \"cpu\": \"a\", \"cores\": 1, \"opengl\": \"b\", \"effects\": 3}"
    };
    const struct render_machine here = machine();
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct render_calibration read;
        dipole_status status;
        FILE *const file = fopen("damaged.json", "w");
        assert_non_null(file);
        fputs(texts[i], file);
        fclose(file);
        assert_false(render_calibration_read("damaged.json", &here, &read, &status));
        assert_int_equal(read.effect_count, 0);
    }
}

/* Oracle: scale times the cost beside what is fixed, and start once, of the first picture alone. */
static void plans_predict_as_calibrated(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    const struct render_calibration here = calibration();
    scene_init(&test, 40);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 8, 0, &material));
    scene_add_directional(&test, -1, -1, -1, 3);
    struct render_request request = {
        .scene = &test.scene, .epsilon = 0.05, .technique = RENDER_TECHNIQUE_GATHER, .is_warm = true
    };
    struct render_plan *const bare = plan_for(&request);
    request.calibration = &here;
    struct render_plan *const warm = plan_for(&request);
    request.is_warm = false;
    struct render_plan *const first = plan_for(&request);
    const double surface_ms = decision_of(bare, "surface")->cost_ms;
    assert_true(surface_ms > 0);
    assert_close(decision_of(warm, "surface")->cost_ms, 0.25 + 0.5 * surface_ms, 1e-12, "scaled");
    assert_close(decision_of(first, "surface")->cost_ms, 0.25 + 0.5 * surface_ms + 7, 1e-12, "with start");
    assert_close(decision_of(warm, "gather")->cost_ms, 2 * decision_of(bare, "gather")->cost_ms, 1e-12,
                 "gather");
    assert_close(decision_of(warm, "light_samples")->cost_ms, decision_of(bare, "light_samples")->cost_ms,
                 0, "not measured");
    assert_close(first->beside_ms, warm->beside_ms + 11, 1e-12, "beside effects");
    double sum_ms = warm->beside_ms;
    for (size_t e = 0; e < warm->effect_count; e++)
        sum_ms += warm->decisions[e].cost_ms;
    assert_close(render_plan_cost_ms(warm), sum_ms, 1e-12, "sum");
    render_plan_destroy(bare);
    render_plan_destroy(warm);
    render_plan_destroy(first);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_kept_is_read_back),      cmocka_unit_test(a_calibration_is_of_one_machine),
        cmocka_unit_test(folders_follow_the_environment), cmocka_unit_test(damaged_files_are_refused),
        cmocka_unit_test(plans_predict_as_calibrated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
