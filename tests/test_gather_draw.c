/* renderer/gather_draw.c, gather_gl.c, gather_records.c: what gathers, and whether it matters. */
#include "drawing.h"

#include "renderer/plan.h"

#include <string.h>

/* Two objects of different media that touch each other's tiles, seen by a picture of no whole tiles. */
static void init_pair(struct test_scene *test, int width_px, int height_px)
{
    const struct io_material first = marble(), second = skin1();
    scene_init(test, 60);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 32, 8, -6, &first));
    assert_true(scene_add(test, IO_PRIMITIVE_CUBE, 8, 10, 7, &second));
    scene_add_directional(test, -1, -1, -2, 3);
    scene_add_point(test, 10, 25, 20, 4000);
    test->scene.camera.width_px = width_px;
    test->scene.camera.height_px = height_px;
}

static bool is_active(const struct render_report *report, const char *effect)
{
    for (size_t e = 0; e < report->effect_count; e++) {
        if (strcmp(report->effects[e].name, effect) == 0)
            return report->effects[e].is_active;
    }
    fail_msg("no effect %s", effect);
    return false;
}

static void assert_same(const struct io_image *found, const struct io_image *expected, double limit)
{
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < 4 * (size_t)expected->width_px * (size_t)expected->height_px; i++)
        deviation_add(&deviation, (double)found->pixels[i], (double)expected->pixels[i]);
    print_message("  relative RMSE %.1e, worst %.1e of the brightest\n", relative_rmse(&deviation),
                  deviation.worst / deviation.peak);
    assert_true(deviation.peak > 0.1);
    assert_true(relative_rmse(&deviation) <= limit);
    assert_true(deviation.worst <= 10 * limit * deviation.peak);
}

/* Oracle: the processor's sums, that test_gather.c compares with direct ones. OpenGL sums the same samples.
 * It interpolates without slopes, and so at other places: both differ by what interpolation may err by, a
 * tenth of epsilon each. Where pixels are too far apart for that, by rounding alone. Picture after picture,
 * nothing changes.
 */
static void opengl_gathers_the_same(void **state)
{
    (void)state;
    static const struct {
        int width_px, height_px;
        double epsilon, limit;
    } pictures[] = { { 203, 117, 0.03, 0.006 },
                     { 301, 240, 0.1, 0.02 },
                     { 400, 300, 0.003, 6e-4 },
                     { 21, 19, 0.003, 1e-6 } };
    for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++) {
        struct test_scene test;
        init_pair(&test, pictures[i].width_px, pictures[i].height_px);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_options options = { .technique = RENDER_TECHNIQUE_GATHER,
                                          .epsilon = pictures[i].epsilon };
        struct io_image *images[3];
        for (int k = 0; k < 3; k++) {
            struct render_report report;
            options.gather = k > 0 ? RENDER_GATHER_GL : RENDER_GATHER_C;
            images[k] = draw(renderer, &options, &report);
            assert_true(is_active(&report, k > 0 ? "gather_gl" : "gather"));
            assert_false(is_active(&report, k > 0 ? "gather" : "gather_gl"));
        }
        assert_same(images[1], images[0], pictures[i].limit);
        assert_memory_equal(images[2]->pixels, images[1]->pixels,
                            4 * sizeof(float) * (size_t)images[1]->width_px * (size_t)images[1]->height_px);
        for (int k = 0; k < 3; k++)
            io_image_destroy(images[k]);
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* Oracle: by hand. One renderer draws frames of several sizes; where no light falls nothing is gathered. */
static void opengl_gathers_frame_after_frame(void **state)
{
    (void)state;
    struct test_scene test;
    init_pair(&test, 40, 30);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    for (int k = 0; k < 4; k++) {
        struct render_options options = { .technique = RENDER_TECHNIQUE_GATHER, .epsilon = 0.03 };
        struct io_image *images[2];
        test.scene.camera.width_px = k % 2 ? 200 : 72;
        test.scene.camera.height_px = k % 2 ? 33 : 90;
        options.gather = RENDER_GATHER_C;
        images[0] = draw(renderer, &options, NULL);
        options.gather = RENDER_GATHER_GL;
        images[1] = draw(renderer, &options, NULL);
        assert_same(images[1], images[0], 0.2 * options.epsilon);
        io_image_destroy(images[0]);
        io_image_destroy(images[1]);
    }
    test.scene.light_count = 0;
    struct render_report report;
    const struct render_options options = { .technique = RENDER_TECHNIQUE_GATHER,
                                            .gather = RENDER_GATHER_GL };
    struct io_image *const dark = draw(renderer, &options, &report);
    assert_false(is_active(&report, "gather_gl"));
    io_image_destroy(dark);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the definition. Where OpenGL is software, the processor is asked; where it is not, OpenGL is, for
 * what is not tiny; and what the user asks for is done. */
static void the_plan_takes_what_costs_less(void **state)
{
    (void)state;
    struct test_scene test;
    init_pair(&test, 800, 600);
    for (int has_gpu = 0; has_gpu < 2; has_gpu++) {
        for (int asked = RENDER_GATHER_AUTO; render_gather_names[asked]; asked++) {
            const struct render_request request = { .scene = &test.scene,
                                                    .epsilon = RENDER_EPSILON_DEFAULT,
                                                    .technique = RENDER_TECHNIQUE_GATHER,
                                                    .gather = (enum render_gather)asked,
                                                    .has_gpu = has_gpu };
            struct render_plan *plan;
            assert_true(render_plan_create(&request, &plan, NULL));
            const enum render_gather expected = asked != RENDER_GATHER_AUTO ? (enum render_gather)asked
                                                : has_gpu                   ? RENDER_GATHER_GL
                                                                            : RENDER_GATHER_C;
            assert_int_equal(plan->gather, expected);
            assert_non_null(
                strstr(plan->gather_reason, asked == RENDER_GATHER_AUTO ? "predicted: " : "asked"));
            render_plan_destroy(plan);
        }
    }
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(opengl_gathers_the_same),
        cmocka_unit_test(opengl_gathers_frame_after_frame),
        cmocka_unit_test(the_plan_takes_what_costs_less),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
