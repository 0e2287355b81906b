/* renderer/plan_grid.c: splats over a uniform grid of each light's view. */
#include "drawing.h"
#include "plans.h"

#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

/* ---- the bound ---------------------------------------------------------------------------------- */

/* Radiosity about a place on a plane that is lit evenly, by samples along apart one way and across the
 * other, of one unit of flux per mm^2 each; as part of what it is without gaps. */
static double lattice_radiosity(const dipole_coefficients *k, double along_mm, double across_mm,
                                const double place[2])
{
    const double reach_mm = 40 / k->sigma_tr_per_mm;
    const int columns = (int)ceil(reach_mm / along_mm), rows = (int)ceil(reach_mm / across_mm);
    double sum = 0;
    for (int i = -columns; i <= columns; i++) {
        for (int j = -rows; j <= rows; j++)
            sum += dipole_rd_per_mm2(k, hypot((i + place[0]) * along_mm, (j + place[1]) * across_mm));
    }
    return sum * along_mm * across_mm / dipole_diffuse_reflectance(k);
}

/* Oracle: direct sums over the samples of a grid on slopes, at a sample, midway between two, and between
 * four. At a sample all waves add up, which is the bound, but for slopes between those that are looked at.
 */
static void aliasing_on_slopes_is_as_predicted(void **state)
{
    (void)state;
    struct rng rng = { .seed = 20260801 };
    for (int i = 0; i < 20; i++) {
        const dipole_medium medium = { .sigma_a_per_mm = log_uniform(&rng, 0.02, 2),
                                       .sigma_s_prime_per_mm = log_uniform(&rng, 0.5, 5),
                                       .eta = uniform(&rng, 1, 1.5) };
        const dipole_layer layer = { medium, INFINITY };
        dipole_coefficients k;
        dipole_stack *stack;
        assert_true(dipole_coefficients_init(&medium, &k, NULL));
        assert_true(dipole_stack_create(&layer, 1, DIPOLE_MODEL_DIPOLE, DIPOLE_FROM_ABOVE, &stack, NULL));
        const double texel_mm =
            log_uniform(&rng, 0.2, 1.2) / (medium.sigma_a_per_mm + medium.sigma_s_prime_per_mm);
        const double bound = render_plan_grid_aliasing(stack, texel_mm);
        double worst = 0;
        for (double cosine = 1; cosine > 0.02; cosine *= 0.9) {
            const double enters = (1 - dipole_fresnel_reflectance(medium.eta, cosine)) /
                                  (1 - dipole_fresnel_reflectance(medium.eta, 1));
            const double places[3][2] = { { 0, 0 }, { 0.5, 0.5 }, { 0.5, 0 } };
            for (int p = 0; p < 3; p++)
                worst = fmax(worst,
                             cosine * enters *
                                 fabs(lattice_radiosity(&k, texel_mm / cosine, texel_mm, places[p]) - 1));
        }
        assert_true(worst <= bound * 1.01);
        assert_true(worst >= bound * 0.97);
        dipole_stack_destroy(stack);
    }
}

/* ---- plans -------------------------------------------------------------------------------------- */

static void init_sphere(struct test_scene *test, double radius_mm)
{
    const struct io_material material = skin1();
    scene_init(test, 5 * radius_mm);
    test->scene.camera.width_px = 96;
    test->scene.camera.height_px = 72;
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 192, radius_mm, 0, &material));
}

static struct render_request grid_request(const struct test_scene *test, int splat_grid)
{
    return (struct render_request){ .scene = &test->scene,
                                    .epsilon = 0.01,
                                    .technique = RENDER_TECHNIQUE_SPLAT,
                                    .splat_grid = splat_grid };
}

/* Oracle: the definition, and T11's spacing by libdipole. N is kept, in one band, without blur; auto takes
 * the N that T11 asks for; costs grow with N^2; the note names both N that would do, and none stands where
 * they do. */
static void the_plan_keeps_to_the_grid_and_tells_what_it_leaves(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test, 20);
    scene_add_directional(&test, -1, -1, -1, 3);
    struct render_request request = grid_request(&test, 64);
    struct render_plan *const coarse = plan_for(&request);
    request.splat_grid = 128;
    struct render_plan *const fine = plan_for(&request);
    request.splat_grid = RENDER_SPLAT_GRID_AUTO;
    struct render_plan *const chosen = plan_for(&request);
    assert_true(coarse->has_grid && coarse->band_count == 1 && coarse->of_medium[0].band_count == 1);
    assert_int_equal(coarse->views[0].size_px, 64);
    assert_int_equal(coarse->views[0].block_px, 1);
    assert_close(coarse->grid_texel_mm, 2 * coarse->views[0].projection.half_width / 64, 1e-12, "texel");
    assert_close(coarse->of_medium[0].bands[0].r_outer_mm, coarse->of_medium[0].r_max_mm, 0, "reach");
    assert_true(coarse->blur_error == 0 && coarse->banding_error == 0);
    assert_true(fine->aliasing_error < coarse->aliasing_error &&
                fine->aliasing_error > fine->aliasing_epsilon);
    assert_close(decision_of(coarse, "light_samples")->error, coarse->aliasing_error, 0, "error");
    const double costs[2] = { decision_of(coarse, "splat")->cost_ms - 5,
                              decision_of(fine, "splat")->cost_ms - 5 };
    assert_close(costs[1], 4 * costs[0], 1e-9, "cost");
    assert_non_null(
        strstr(decision_of(coarse, "light_samples")->reason, "uniform grid of up to 64 texels a side"));
    assert_non_null(strstr(decision_of(coarse, "splat")->reason, "uniform grid, in one band"));
    double spacing_mm = INFINITY;
    for (int c = 0; c < 3; c++) {
        dipole_coefficients k;
        assert_true(dipole_coefficients_init(&test.objects[0].material.layers[c][0].medium, &k, NULL));
        spacing_mm = fmin(spacing_mm, dipole_splat_spacing_mm(&k, coarse->aliasing_epsilon));
    }
    const double width_mm = 2 * chosen->views[0].projection.half_width;
    assert_int_equal(chosen->views[0].size_px, (int)ceil(width_mm / spacing_mm));
    assert_int_equal(coarse->note_count, 1);
    int facing = 0, sloped = 0;
    char note[sizeof coarse->notes[0]];
    memcpy(note, coarse->notes[0], sizeof note);
    const char *const numbers = strstr(note, "need N = ");
    assert_true(numbers && sscanf(numbers, "need N = %d, slopes N = %d", &facing, &sloped) == 2);
    assert_int_equal(facing, chosen->views[0].size_px);
    request.splat_grid = sloped;
    struct render_plan *const enough = plan_for(&request);
    assert_int_equal(enough->note_count, 0);
    assert_true(enough->error_predicted <= enough->epsilon);
    request.splat_grid = (int)(0.97 * sloped);
    struct render_plan *const less = plan_for(&request);
    assert_int_equal(less->note_count, 1);
    render_plan_destroy(coarse);
    render_plan_destroy(fine);
    render_plan_destroy(chosen);
    render_plan_destroy(enough);
    render_plan_destroy(less);
    scene_end(&test);
}

/* Oracle: the rule. A grid is of splats alone, of lights that shine, and of samples that do not move. */
static void a_grid_is_of_splats_alone(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test, 8);
    scene_add_directional(&test, -1, -1, -1, 3);
    struct render_request request = grid_request(&test, 64);
    request.technique = RENDER_TECHNIQUE_AUTO;
    struct render_plan *plan = plan_for(&request);
    assert_true(plan->has_grid && plan->technique == RENDER_TECHNIQUE_SPLAT);
    render_plan_destroy(plan);
    request.technique = RENDER_TECHNIQUE_GATHER;
    plan = plan_for(&request);
    assert_false(plan->has_grid);
    assert_true(plan->views[0].size_px > 64);
    render_plan_destroy(plan);
    request.is_captured = true;
    plan = plan_for(&request);
    assert_false(plan->has_grid);
    render_plan_destroy(plan);
    request = grid_request(&test, 64);
    test.scene.frames.count = 4;
    test.scene.frames.lights_turn_deg = 90;
    request.coherence = RENDER_COHERENCE_SURFACE;
    plan = plan_for(&request);
    assert_int_equal(plan->coherence, RENDER_COHERENCE_NONE);
    render_plan_destroy(plan);
    test.scene.light_count = 0;
    plan = plan_for(&request);
    assert_false(plan->has_grid);
    render_plan_destroy(plan);
    scene_end(&test);
}

/* Oracle: the messages. Six views of a light within the scene have a sixth of the texels each; auto keeps
 * to it. */
static void bad_grids_are_refused(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test, 8);
    scene_add_point(&test, 0, 0, 9, 100);
    struct render_request request = grid_request(&test, 1);
    fails_with(&request, "splat_grid is 1, expected auto, 0 or 2 to 4096 texels a side");
    request.splat_grid = -2;
    fails_with(&request, "splat_grid is -2, expected auto, 0 or 2 to 4096 texels a side");
    request.splat_grid = 4097;
    fails_with(&request, "splat_grid is 4097, expected auto, 0 or 2 to 4096 texels a side");
    request.splat_grid = 4096;
    fails_with(
        &request,
        "splat_grid is 4096, expected at most 2364: the lights have 6 views, of 33554432 texels in all");
    request.splat_grid = 2364;
    struct render_plan *plan = plan_for(&request);
    assert_int_equal(plan->views[5].size_px, 2364);
    render_plan_destroy(plan);
    request.splat_grid = RENDER_SPLAT_GRID_AUTO;
    request.epsilon = 1e-5;
    for (int c = 0; c < 3; c++) {
        test.objects[0].material.layers[c][0].medium.sigma_a_per_mm *= 1000;
        test.objects[0].material.layers[c][0].medium.sigma_s_prime_per_mm *= 1000;
    }
    plan = plan_for(&request);
    assert_int_equal(plan->views[5].size_px, 2364);
    assert_int_equal(plan->note_count, 1);
    render_plan_destroy(plan);
    scene_end(&test);
}

/* ---- pictures ----------------------------------------------------------------------------------- */

enum scene_kind { DIRECTIONAL = 0, POINT, INSIDE, TWO_MEDIA, SCENE_KINDS };

static void init_scene(struct test_scene *test, enum scene_kind kind)
{
    const struct io_material other = marble();
    init_sphere(test, 6);
    if (kind == TWO_MEDIA)
        assert_true(scene_add(test, IO_PRIMITIVE_KNOT, 192, 3, 9, &other));
    if (kind == DIRECTIONAL || kind == TWO_MEDIA)
        scene_add_directional(test, -1, -1, -1, 3);
    if (kind == POINT || kind == TWO_MEDIA)
        scene_add_point(test, 8, 12, 14, 500);
    if (kind == INSIDE)
        scene_add_point(test, 3, 4, 6.5, 300);
    for (size_t i = 0; i < test->scene.object_count; i++)
        test->objects[i].has_specular = false;
}

/* The largest difference of two pictures where they are exact, as part of the brightest. */
static struct deviation deviation_of(const struct io_image *picture, const struct io_image *expected,
                                     const struct render_capture *captured)
{
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < (size_t)picture->width_px * (size_t)picture->height_px; i++) {
        for (size_t c = 0; c < 3 && captured->coverage[i] >= 1; c++)
            deviation_add(&deviation, (double)picture->pixels[4 * i + c],
                          (double)expected->pixels[4 * i + c]);
    }
    return deviation;
}

/* Exact pixels of a scene whose media are alike: a capture knows one. */
static struct render_capture *exact_pixels(const struct test_scene *test)
{
    struct test_scene alike = *test;
    alike.scene.lights = alike.lights;
    alike.scene.objects = alike.objects;
    for (size_t i = 1; i < alike.scene.object_count; i++)
        alike.objects[i].material = alike.objects[0].material;
    struct renderer *const renderer = renderer_of(&alike, RENDER_CONTEXT_DEFAULT);
    struct render_capture *const captured = capture(renderer, 1);
    render_destroy(renderer);
    return captured;
}

/* Oracle: adaptive splats. Where the grid is fine both agree within the errors that they predict, channel
 * by channel and at the worst pixel, as part of the brightest; at the coarsest, the error is over the half
 * of what is asked. */
static void pictures_of_fine_grids_are_those_of_adaptive_splats(void **state)
{
    (void)state;
    for (int kind = 0; kind < SCENE_KINDS; kind++) {
        struct test_scene test;
        init_scene(&test, (enum scene_kind)kind);
        struct render_capture *const captured = exact_pixels(&test);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_report adaptive, uniform_grid;
        struct io_image *const expected = draw(
            renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.003 },
            &adaptive);
        struct io_image *const image = draw(
            renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .splat_grid = 160 },
            &uniform_grid);
        const struct deviation deviation = deviation_of(image, expected, captured);
        const double predicted = adaptive.error_predicted + uniform_grid.error_predicted;
        print_message(
            "  scene %d: %zu splats, worst %.2e of the peak, predicted %.2e, relative RMSE %.2e\n", kind,
            uniform_grid.splat_count, deviation.worst / deviation.peak, predicted,
            relative_rmse(&deviation));
        assert_true(deviation.worst <= predicted * deviation.peak);
        assert_true(relative_rmse(&deviation) < 0.01);
        assert_true(uniform_grid.splat_count <= uniform_grid.sample_count && uniform_grid.band_count == 1);
        io_image_destroy(expected);
        io_image_destroy(image);
        render_destroy(renderer);
        render_capture_destroy(captured);
        scene_end(&test);
    }
}

/* Oracle: the prediction. Without shadows' edges, the error against fine adaptive splats is at most what is
 * predicted, and not under a tenth of it while it is above 3 %: dots of steep slopes show. It falls as N
 * grows. */
static void errors_of_coarse_grids_grow_as_predicted(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test, 20);
    scene_add_directional(&test, -1, -0.2, -0.4, 3);
    struct render_capture *const captured = exact_pixels(&test);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_report report;
    struct io_image *const expected =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.001 },
             &report);
    double before = INFINITY;
    for (int n = 12; n <= 96; n *= 2) {
        const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT, .splat_grid = n };
        struct io_image *const image = draw(renderer, &options, &report);
        const struct deviation deviation = deviation_of(image, expected, captured);
        const double worst = deviation.worst / deviation.peak;
        print_message("  N = %d: worst %.2e of the peak, predicted %.2e, relative RMSE %.2e\n", n, worst,
                      report.error_predicted, relative_rmse(&deviation));
        assert_true(worst <= report.error_predicted);
        assert_true(worst >= 0.1 * report.error_predicted || worst < 0.03);
        assert_true(worst < before);
        assert_true(report.splat_count == report.sample_count);
        before = worst;
        io_image_destroy(image);
    }
    io_image_destroy(expected);
    render_destroy(renderer);
    render_capture_destroy(captured);
    scene_end(&test);
}

/* All flux of light samples that a picture is made of, of one channel. */
static double flux_of(struct renderer *renderer, const struct render_options *options)
{
    struct render_report report;
    io_image_destroy(draw(renderer, options, &report));
    const struct render_light_samples *const samples =
        render_splatter_samples(render_executor_splatter(renderer->executor), 0);
    double sum = 0;
    for (size_t i = 0; i < samples->count; i++)
        sum += (double)samples->samples[i].flux_w[0];
    return sum;
}

/* Oracle: conservation of energy. The flux that enters a sphere does not depend on how it is sampled, but
 * for whole texels at the outline: a texel's part of the radius, of which random halves cancel. */
static void flux_is_that_of_adaptive_samples(void **state)
{
    (void)state;
    for (int kind = 0; kind < TWO_MEDIA; kind++) {
        struct test_scene test;
        init_scene(&test, (enum scene_kind)kind);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT };
        const double expected = flux_of(renderer, &options);
        for (int n = 32; n <= 256; n *= 2) {
            options.splat_grid = n;
            assert_close(flux_of(renderer, &options), expected, 1.0 / n, "scene %d, N = %d", kind, n);
        }
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* Oracle: pictures of both areas on the flat face of a box that is lit as far as r_max agree (T35), also
 * over a uniform grid; and light from all around is added to what the grid does. */
static void grids_go_with_overlap_and_environment(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test, 6);
    scene_add_directional(&test, 0, 0, -1, 3);
    struct renderer *renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_report report;
    io_image_destroy(draw(renderer,
                          &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT,
                                                    .area = RENDER_AREA_OVERLAP,
                                                    .splat_grid = 48 },
                          &report));
    assert_int_equal(report.splat_count, report.sample_count);
    render_destroy(renderer);
    test.scene.has_environment = true;
    test.scene.environment.rgb[0] = 1;
    strcpy(test.scene.environment.path, SOURCE_FOLDER "/scenes/probes/studio.exr");
    renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const with_grid =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .splat_grid = 160 },
             &report);
    struct io_image *const adaptive =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT }, &report);
    struct render_capture *const captured = exact_pixels(&test);
    const struct deviation deviation = deviation_of(with_grid, adaptive, captured);
    assert_true(relative_rmse(&deviation) < 0.01);
    render_capture_destroy(captured);
    io_image_destroy(with_grid);
    io_image_destroy(adaptive);
    render_destroy(renderer);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aliasing_on_slopes_is_as_predicted),
        cmocka_unit_test(the_plan_keeps_to_the_grid_and_tells_what_it_leaves),
        cmocka_unit_test(a_grid_is_of_splats_alone),
        cmocka_unit_test(bad_grids_are_refused),
        cmocka_unit_test(pictures_of_fine_grids_are_those_of_adaptive_splats),
        cmocka_unit_test(errors_of_coarse_grids_grow_as_predicted),
        cmocka_unit_test(flux_is_that_of_adaptive_samples),
        cmocka_unit_test(grids_go_with_overlap_and_environment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
