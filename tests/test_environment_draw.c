/* renderer/environment_draw.c, plan_environment.c and the environment's passes: pictures against the
 * reference, and what the plan decides. */
#include "drawing.h"
#include "environment_maps.h"
#include "plans.h"

#include "renderer/reference.h"

static void light_by(struct test_scene *test, const char *map)
{
    test->scene.has_environment = true;
    test->scene.environment = (struct io_environment){ .rgb = { 1, 1, 1 }, .rotate_rad = 0.5 };
    snprintf(test->scene.environment.path, sizeof test->scene.environment.path,
             SOURCE_FOLDER "/scenes/probes/%s.exr", map);
}

static void init(struct test_scene *test, enum io_primitive primitive, const struct io_material *material,
                 const char *map)
{
    scene_init(test, 100);
    assert_true(scene_add(test, primitive, primitive == IO_PRIMITIVE_SPHERE ? 96 : 160, 6, 0, material));
    test->scene.camera.is_orthographic = true;
    test->scene.camera.height_mm = 13;
    light_by(test, map);
}

static struct io_image *draw_reference(const struct test_scene *test, const struct render_options *options)
{
    struct io_image *image;
    dipole_status status;
    if (!render_reference_draw(&test->scene, options, &image, NULL, &status))
        fail_msg("%s", status.message);
    return image;
}

/* Of the pixels that are covered with all their neighbours and show a single surface. */
static double difference(struct renderer *renderer, const struct io_image *found,
                         const struct io_image *expected)
{
    struct render_capture *const shown = capture(renderer, 1);
    struct deviation deviation = { 0 };
    for (int i = 0; i < found->width_px * found->height_px; i++) {
        for (int c = 0; c < 3 && shown->coverage[i] >= 1; c++)
            deviation_add(&deviation, (double)found->pixels[4 * i + c],
                          (double)expected->pixels[4 * i + c]);
    }
    render_capture_destroy(shown);
    return relative_rmse(&deviation);
}

/* Oracle: light adds up. What two lights do beside an environment is what each does; shadows and gloss are
 * those of the light that they are of. */
static void lights_add_up_beside_it(void **state)
{
    (void)state;
    const struct io_material material = marble();
    struct io_image *images[4];
    for (int i = 0; i < 4; i++) { /* none, one, the other, both */
        struct test_scene test;
        init(&test, IO_PRIMITIVE_KNOT, &material, "studio");
        test.objects[0].has_specular = true;
        if (i & 1)
            scene_add_directional(&test, -1, -1, -1, 3);
        if (i & 2)
            scene_add_directional(&test, 1, -1, -1, 3);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        images[i] = draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, NULL);
        render_destroy(renderer);
        scene_end(&test);
    }
    const int count = 4 * images[0]->width_px * images[0]->height_px;
    for (int i = 0; i < count; i++) {
        const double sum =
            (double)images[1]->pixels[i] + (double)images[2]->pixels[i] - (double)images[0]->pixels[i];
        assert_true(fabs(sum - (double)images[3]->pixels[i]) < 1e-5 * (1 + fabs(sum)));
    }
    for (int i = 0; i < 4; i++)
        io_image_destroy(images[i]);
}

/* Oracle: the reference, which sums the map itself over random points. At the default epsilon splats are
 * within it, of each map on a ball and on a knot; peeling along three axes is nearly as good. */
static void splats_agree_with_the_reference(void **state)
{
    (void)state;
    const struct io_material materials[2] = { skin1(), marble() };
    for (int shape = 0; shape < 2; shape++) {
        for (int p = 0; p < PROBES; p++) {
            struct test_scene test;
            init(&test, shape == 0 ? IO_PRIMITIVE_SPHERE : IO_PRIMITIVE_KNOT, &materials[shape],
                 probe_names[p]);
            const struct render_options options = { .epsilon = 0.05 }; /* of the reference: 0.5 % */
            struct io_image *const expected = draw_reference(&test, &options);
            struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
            for (int way = 0; way < 3; way += 2) {
                const struct render_options ours = { .environment_samples =
                                                         (enum render_environment_samples)way };
                struct render_report report;
                struct io_image *const found = draw(renderer, &ours, &report);
                const double error = difference(renderer, found, expected);
                /* a knot's pixels are a tenth of its strand wide: their four points differ */
                assert_true(error < (shape == 1 ? 0.02 : way == 0 ? 0.003 : 0.008));
                assert_int_equal((int)report.view_count, 0); /* no light's view is drawn */
                io_image_destroy(found);
            }
            render_destroy(renderer);
            io_image_destroy(expected);
            scene_end(&test);
        }
    }
}

/* Oracle: radiance = R E(n) exit, with E(n) from C. A ball's normal is its position; what a pixel shows is
 * the mean of four points. */
static void lambert_shows_the_irradiance(void **state)
{
    (void)state;
    for (int p = 0; p < PROBES; p++) {
        const struct io_material material = skin1();
        struct test_scene test;
        struct deviation deviation = { 0 };
        struct render_irradiance *irradiance;
        init(&test, IO_PRIMITIVE_SPHERE, &material, probe_names[p]);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        const struct render_options options = { .technique = RENDER_TECHNIQUE_LAMBERT, .epsilon = 0.002 };
        struct render_environment *environment;
        struct render_media *media;
        assert_true(render_environment_read(&test.scene.environment, &environment, NULL) &&
                    render_irradiance_create(environment, 1.3, 0.3 * 0.002, &irradiance, NULL) &&
                    render_media_create(&test.scene, &media, NULL));
        struct io_image *const found = draw(renderer, &options, NULL);
        struct render_capture *const shown = capture(renderer, 1);
        for (int i = 0; i < found->width_px * found->height_px; i++) {
            double normal[3], rgb[3], length2 = 0;
            if (shown->coverage[i] < 1)
                continue;
            for (int k = 0; k < 3; k++)
                length2 += (double)shown->position_mm[3 * i + k] * (double)shown->position_mm[3 * i + k];
            for (int k = 0; k < 3; k++)
                normal[k] = (double)shown->position_mm[3 * i + k] / sqrt(length2);
            render_irradiance_at(irradiance, normal, rgb);
            for (int c = 0; c < 3; c++)
                deviation_add(&deviation, (double)found->pixels[4 * i + c],
                              media->media[0].diffuse_reflectance[c] * rgb[c] *
                                  (double)shown->exit_per_sr[i]);
        }
        /* normals of a ball of 96 segments, interpolated */
        assert_true(relative_rmse(&deviation) < 3e-3);
        render_capture_destroy(shown);
        io_image_destroy(found);
        render_media_destroy(media);
        render_irradiance_destroy(irradiance);
        render_environment_destroy(environment);
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* Oracle: the reference with as many rays. What a bowl hides from itself and a ball from a slab is a large
 * part of the light: without rays the picture is far too bright. */
static void visibility_agrees_with_the_reference(void **state)
{
    (void)state;
    const struct io_material material = marble();
    struct test_scene test;
    scene_init(&test, 100);
    assert_true(scene_add(&test, IO_PRIMITIVE_BOWL, 96, 6, 0, &material));
    test.scene.camera.eye_mm[1] = 80;
    test.scene.camera.is_orthographic = true;
    test.scene.camera.height_mm = 14;
    light_by(&test, "studio");
    const struct render_options exact = { .epsilon = 0.1, .ambient_visibility = 256 };
    const struct render_options some = { .ambient_visibility = 64 }, none = { .ambient_visibility = 0 };
    struct io_image *const expected = draw_reference(&test, &exact);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const by_some = draw(renderer, &some, NULL),
                           *const again = draw(renderer, &some, NULL),
                           *const by_none = draw(renderer, &none, NULL);
    const double with_rays = difference(renderer, by_some, expected),
                 without = difference(renderer, by_none, expected);
    assert_true(with_rays < 0.03 && without > 0.1);
    assert_memory_equal(by_some->pixels, again->pixels,
                        4 * sizeof(float) * (size_t)again->width_px * (size_t)again->height_px);
    io_image_destroy(by_some);
    io_image_destroy(again);
    io_image_destroy(by_none);
    io_image_destroy(expected);
    render_destroy(renderer);
    scene_end(&test);
}

/* ---- plans -------------------------------------------------------------------------------------- */

static bool has_note(const struct render_plan *plan, const char *text)
{
    for (size_t i = 0; i < plan->note_count; i++) {
        if (strstr(plan->notes[i], text))
            return true;
    }
    return false;
}

/* Oracle: by hand. Without lights no light's view is drawn; samples or pixels by technique; peeling and
 * rays only where asked; a map that is black, a shadow map and a capture draw none, and say so. */
static void plans_take_what_is_asked(void **state)
{
    (void)state;
    const struct io_material material = skin1();
    const char *const names[] = { "environment",
                                  "environment_samples",
                                  "environment_peel",
                                  "environment_lambert",
                                  "ambient_visibility",
                                  "splat",
                                  "lambert",
                                  "light_picture",
                                  "light_samples" };
    enum { NAMES = 9 };
    const struct {
        struct render_request request;
        bool expected[NAMES];
        const char *note;
    } rows[] = {
        { { .technique = RENDER_TECHNIQUE_SPLAT }, { 1, 1, 0, 0, 0, 1, 0, 0, 0 }, "gloss does not mirror" },
        { { .technique = RENDER_TECHNIQUE_GATHER },
          { 1, 1, 0, 0, 0, 0, 0, 0, 0 },
          "gloss does not mirror" },
        { { .technique = RENDER_TECHNIQUE_SPLAT, .environment_samples = RENDER_ENVIRONMENT_PEEL },
          { 1, 0, 1, 0, 0, 1, 0, 0, 0 },
          NULL },
        { { .technique = RENDER_TECHNIQUE_SPLAT, .ambient_visibility = 16 },
          { 1, 1, 0, 0, 1, 1, 0, 0, 0 },
          NULL },
        { { .technique = RENDER_TECHNIQUE_LAMBERT }, { 1, 0, 0, 1, 0, 0, 0, 0, 0 }, NULL },
        { { .technique = RENDER_TECHNIQUE_TSM }, { 0, 0, 0, 0, 0, 0, 0, 0, 0 }, "is not drawn" },
        { { .technique = RENDER_TECHNIQUE_SPLAT, .area = RENDER_AREA_OVERLAP },
          { 0, 0, 0, 0, 0, 0, 0, 0, 0 },
          "is not drawn" },
        { { .technique = RENDER_TECHNIQUE_SPLAT, .is_captured = true },
          { 0, 0, 0, 0, 0, 0, 0, 0, 0 },
          NULL },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct test_scene test;
        init(&test, IO_PRIMITIVE_SPHERE, &material, "sky");
        test.objects[0].has_specular = true;
        struct render_request request = rows[i].request;
        request.scene = &test.scene;
        request.epsilon = 0.01;
        struct render_plan *const plan = plan_for(&request);
        for (int k = 0; k < NAMES; k++) {
            if (decision_of(plan, names[k])->is_active != rows[i].expected[k])
                fail_msg("row %zu: %s is %sactive: %s", i, names[k],
                         decision_of(plan, names[k])->is_active ? "" : "not ",
                         decision_of(plan, names[k])->reason);
            assert_true(strlen(decision_of(plan, names[k])->reason) > 0);
        }
        if (rows[i].note)
            assert_true(has_note(plan, rows[i].note));
        assert_true(plan->view_count == 0);
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* Oracle: by hand. A black map lights nothing and is said to be black; nothing else does then. */
static void a_black_map_is_none(void **state)
{
    (void)state;
    const struct io_material material = skin1();
    const double level = 0;
    struct render_environment *const black = sky_of(4, constant_sky, &level);
    struct test_scene test;
    init(&test, IO_PRIMITIVE_SPHERE, &material, "sky");
    const struct render_request request = { .scene = &test.scene, .epsilon = 0.01, .environment = black };
    struct render_plan *const plan = plan_for(&request);
    assert_false(decision_of(plan, "environment")->is_active);
    assert_string_equal(decision_of(plan, "environment")->reason, "it is black");
    assert_false(decision_of(plan, "environment_samples")->is_active);
    assert_string_equal(render_plan_dark_reason(plan), "no light shines");
    render_plan_destroy(plan);
    render_environment_destroy(black);
    scene_end(&test);
}

/* Oracle: the smaller epsilon, the higher the order, and what is left out keeps to a tenth of epsilon;
 * a sky with a sun needs more than soft boxes; a uniform sky 0. */
static void orders_follow_epsilon_and_the_map(void **state)
{
    (void)state;
    const struct io_material material = skin1();
    const double level = 1;
    struct render_environment *const uniform_sky = sky_of(16, constant_sky, &level);
    int orders[PROBES][3];
    for (int p = 0; p < PROBES; p++) {
        struct test_scene test;
        init(&test, IO_PRIMITIVE_SPHERE, &material, probe_names[p]);
        for (int i = 0; i < 3; i++) {
            struct render_request request = { .scene = &test.scene, .epsilon = 0.1 * pow(0.2, i) };
            struct render_plan *plan = plan_for(&request);
            orders[p][i] = plan->environment_order;
            assert_true(plan->environment_error <= 0.1 * request.epsilon ||
                        plan->environment_order == RENDER_HARMONIC_LIMIT);
            assert_true(i == 0 || orders[p][i] >= orders[p][i - 1]);
            assert_close(decision_of(plan, "environment")->error, plan->environment_error, 0, "error");
            render_plan_destroy(plan);
            request.environment = uniform_sky;
            plan = plan_for(&request);
            assert_int_equal(plan->environment_order, 0);
            render_plan_destroy(plan);
        }
        scene_end(&test);
    }
    assert_true(orders[2][1] > orders[1][1] && orders[1][1] > 0);
    render_environment_destroy(uniform_sky);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_add_up_beside_it),
        cmocka_unit_test(plans_take_what_is_asked),
        cmocka_unit_test(a_black_map_is_none),
        cmocka_unit_test(orders_follow_epsilon_and_the_map),
        cmocka_unit_test(lambert_shows_the_irradiance),
        cmocka_unit_test(splats_agree_with_the_reference),
        cmocka_unit_test(visibility_agrees_with_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
