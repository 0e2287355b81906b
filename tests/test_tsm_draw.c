/* renderer/tsm_draw.c, plan_tsm.c, volumes.c, passes/tsm_*.c: translucent shadow maps against closed forms,
 * sums and other techniques. */
#include "drawing.h"

#include "renderer/plan.h"
#include "renderer/volumes.h"

#include <unistd.h>

enum { WIDTH = 60, HEIGHT = 44 };

/* ---- what the tests share ----------------------------------------------------------------------- */

static const struct render_options by_splats = { .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.005 };

static struct render_options by_maps(enum render_tsm_response response)
{
    return (struct render_options){ .technique = RENDER_TECHNIQUE_TSM, .tsm = { .response = response } };
}

/* One object of a shape, no light yet. */
static void init(struct test_scene *test, enum io_primitive primitive, int detail, double scale_mm,
                 const struct io_material *material)
{
    scene_init(test, 4.5 * scale_mm);
    test->scene.camera.width_px = WIDTH;
    test->scene.camera.height_px = HEIGHT;
    assert_true(scene_add(test, primitive, detail, scale_mm, 0, material));
}

static struct io_image *draw_once(const struct test_scene *test, const struct render_options *options,
                                  struct render_report *report)
{
    struct renderer *const renderer = renderer_of(test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const image = draw(renderer, options, report);
    render_destroy(renderer);
    return image;
}

/* Over pixels that objects cover wholly. Ends both. */
static struct deviation compare(struct io_image *found, struct io_image *expected)
{
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < (size_t)found->width_px * (size_t)found->height_px; i++) {
        if (expected->pixels[4 * i + 3] < 1)
            continue;
        for (size_t c = 0; c < 3; c++)
            deviation_add(&deviation, (double)found->pixels[4 * i + c],
                          (double)expected->pixels[4 * i + c]);
    }
    io_image_destroy(found);
    io_image_destroy(expected);
    return deviation;
}

static double difference(const struct test_scene *test, const struct render_options *a,
                         const struct render_options *b)
{
    const struct deviation deviation = compare(draw_once(test, a, NULL), draw_once(test, b, NULL));
    return relative_rmse(&deviation);
}

/* ---- energy ------------------------------------------------------------------------------------- */

static const struct {
    dipole_model model;
    bool is_layered;
} models[] = { { DIPOLE_MODEL_DIPOLE, false }, { DIPOLE_MODEL_BEAM, false }, { DIPOLE_MODEL_MODES, true } };

/* Largest relative error of the radiosity in the middle of a slab, lit by tilt away from straight above. */
static double slab_error(const struct io_material *material, double tilt, bool is_point)
{
    struct test_scene test;
    dipole_stack *stack;
    const double irradiance = 2, half_mm = 15, cosine = 1 / sqrt(1 + tilt * tilt), far_mm = 4000;
    assert_true(dipole_stack_create(material->layers[0], material->layer_count, material->model,
                                    DIPOLE_FROM_ABOVE, &stack, NULL));
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, half_mm, 0, material));
    if (is_point)
        scene_add_point(&test, -tilt * cosine * far_mm, cosine * far_mm, 0, irradiance * far_mm * far_mm);
    else
        scene_add_directional(&test, tilt, -1, 0, irradiance);
    test.scene.camera = (struct io_camera){ .eye_mm = { 0, 50, 0 },
                                            .up = { 0, 0, 1 },
                                            .is_orthographic = true,
                                            .height_mm = 3,
                                            .width_px = 8,
                                            .height_px = 8 };
    const struct render_options options = by_maps(RENDER_TSM_TABLE);
    struct io_image *const image = draw_once(&test, &options, NULL);
    const double eta = material->layers[0][0].medium.eta;
    const double expected = irradiance * cosine * (1 - dipole_fresnel_reflectance(eta, cosine)) *
                            dipole_stack_total(stack, DIPOLE_FACE_LIT) *
                            (1 - dipole_fresnel_reflectance(eta, 1)) / (PI * dipole_fdt_outside(eta));
    double worst = 0;
    for (int i = 0; i < 8 * 8; i++)
        worst = fmax(worst, fabs((double)image->pixels[4 * i] / expected - 1));
    io_image_destroy(image);
    dipole_stack_destroy(stack);
    scene_end(&test);
    return worst;
}

/* Oracle: conservation of energy. What leaves the middle of a slab is the model's total of what enters, lit
 * from straight above to within half a per cent: the pattern tiles the plane. Lit at an angle the cells'
 * means are no longer exact: 5 % at 45 degrees, 20 % at 63. */
static void energy_is_conserved(void **state)
{
    (void)state;
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        const struct io_material material = grey(models[m].model, models[m].is_layered);
        const double above = slab_error(&material, 0, false);
        print_message("  %s: %.2f %%\n", io_model_names[models[m].model], 100 * above);
        assert_true(above < 0.005);
    }
}

/* Oracle: the same, of a point light far away; and lit at an angle, where cells' means are no longer exact:
 * 5 % at 45 degrees, 20 % at 63. */
static void energy_is_nearly_conserved_at_an_angle(void **state)
{
    (void)state;
    const struct io_material material = grey(DIPOLE_MODEL_DIPOLE, false);
    const double point = slab_error(&material, 0, true), steep = slab_error(&material, 1, false);
    const double grazing = slab_error(&material, 2, false);
    print_message("  point light %.2f %%, at 45 degrees %.1f %%, at 63 %.1f %%\n", 100 * point, 100 * steep,
                  100 * grazing);
    assert_true(point < 0.005 && steep < 0.05 && grazing < 0.2);
}

/* Oracle: the measurements of docs/rendering.md. Layers in a translucent shadow map are warned of, in
 * splats they are not. */
static void layers_are_warned_of(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        const struct io_material material = grey(DIPOLE_MODEL_BEAM, i > 0);
        struct test_scene test;
        scene_init(&test, 40);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 5, 0, &material));
        scene_add_directional(&test, 0, 0, -1, 3);
        struct render_plan *plan;
        const struct render_request request = { .scene = &test.scene,
                                                .epsilon = 0.05,
                                                .technique = i == 2 ? RENDER_TECHNIQUE_SPLAT
                                                                    : RENDER_TECHNIQUE_TSM };
        assert_true(render_plan_create(&request, &plan, NULL));
        assert_int_equal(plan->note_count, i == 1);
        if (i == 1)
            assert_non_null(strstr(plan->notes[0], "material \"beam\" has layers"));
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* ---- parts of the error ------------------------------------------------------------------------- */

/* Oracle: the response without a table differs by no more than the error that the table states. */
static void the_table_errs_as_it_states(void **state)
{
    (void)state;
    for (int is_back = 0; is_back < 2; is_back++) {
        struct test_scene test;
        const struct io_material material = skin1();
        init(&test, IO_PRIMITIVE_SPHERE, 96, 6, &material);
        scene_add_directional(&test, 0.3, -0.5, is_back ? 1 : -1, 3);
        const struct render_options table = by_maps(RENDER_TSM_TABLE), exact = by_maps(RENDER_TSM_EXACT);
        struct render_report report;
        io_image_destroy(draw_once(&test, &table, &report));
        const double off = difference(&test, &table, &exact);
        print_message("  %s: %.2e, stated %.2e\n", is_back ? "back" : "front", off, report.table_error);
        assert_true(off > 0 && off < report.table_error);
        assert_true(isinf(report.error_predicted));
        scene_end(&test);
    }
}

/* Oracle: splats, which sum the same profile over samples of their own: parallel light, a point light with
 * one map, and one with six. What is left is the splats' epsilon and texels at silhouettes. */
static void all_texels_with_the_profile_are_the_splats(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct test_scene test;
        const struct io_material material = skin1();
        init(&test, IO_PRIMITIVE_SPHERE, 96, 2, &material);
        if (i == 0)
            scene_add_directional(&test, 1, -0.5, -0.4, 3);
        else
            scene_add_point(&test, i == 1 ? -10 : -1.84, 1, i == 1 ? 4 : 0.6, 300);
        const struct render_options profile = by_maps(RENDER_TSM_PROFILE);
        const double off = difference(&test, &profile, &by_splats);
        struct render_report report;
        io_image_destroy(draw_once(&test, &profile, &report));
        print_message("  light %d: %.2e, %d maps\n", i, off, report.map_count);
        assert_int_equal(report.map_count, i == 2 ? 6 : 1);
        assert_true(off < 0.01);
        scene_end(&test);
    }
}

/* Oracle: all texels, of which the samples of the pattern take so few. More samples are nearer, those of
 * 245 within 3 % on a sphere. */
static void samples_approach_all_texels(void **state)
{
    (void)state;
    static const int sample_counts[] = { 21, 53, 245 };
    for (int i = 1; i < 3; i++) {
        struct test_scene test;
        const struct io_material material = i == 1 ? marble() : skin1();
        init(&test, IO_PRIMITIVE_SPHERE, 96, 3, &material);
        if (i < 2)
            scene_add_directional(&test, 0.7, -0.5, -0.4, 3);
        else
            scene_add_point(&test, -6, 4, 6, 300);
        const struct render_options texels = by_maps(RENDER_TSM_TEXELS);
        double off[3];
        for (int k = 0; k < 3; k++) {
            struct render_options exact = by_maps(RENDER_TSM_EXACT);
            exact.tsm.sample_count = sample_counts[k];
            off[k] = difference(&test, &exact, &texels);
        }
        print_message("  scene %d: %.2e, %.2e, %.2e\n", i, off[0], off[1], off[2]);
        assert_true(off[0] < 0.25 && off[1] < off[0] && off[2] < 0.03);
        scene_end(&test);
    }
}

/* Oracle: the definition. */
static void parts_add_up_to_the_sum(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    init(&test, IO_PRIMITIVE_KNOT, 96, 6, &material);
    scene_add_directional(&test, 0.5, -0.5, -1, 3);
    scene_add_point(&test, 10, 10, 10, 300);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_options options = by_maps(RENDER_TSM_TABLE);
    struct io_image *parts[3];
    for (int i = 0; i < 3; i++) {
        options.tsm.part = (enum render_tsm_part)i;
        parts[i] = draw(renderer, &options, NULL);
    }
    for (size_t i = 0; i < WIDTH * HEIGHT * 4; i++)
        assert_true(i % 4 == 3 ||
                    fabsf(parts[RENDER_TSM_GLOBAL]->pixels[i] + parts[RENDER_TSM_LOCAL]->pixels[i] -
                          parts[RENDER_TSM_SUM]->pixels[i]) <= 1e-5f * parts[RENDER_TSM_SUM]->pixels[i]);
    for (int i = 0; i < 3; i++)
        io_image_destroy(parts[i]);
    render_destroy(renderer);
    scene_end(&test);
}

/* ---- where it is gathered ----------------------------------------------------------------------- */

/* Oracle: the same at each fragment, from which vertices half a pixel apart cannot be far; of two objects,
 * whose vertices stand one after the other. */
static void dense_vertices_are_near_fragments(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble(), other = skin1();
    init(&test, IO_PRIMITIVE_SPHERE, 128, 5, &material);
    assert_true(scene_add(&test, IO_PRIMITIVE_TORUS, 128, 3, 6, &other));
    scene_add_directional(&test, 0.5, -0.5, -1, 3);
    struct render_options fragment = by_maps(RENDER_TSM_TABLE), vertex = fragment;
    vertex.tsm.gather = RENDER_TSM_VERTEX;
    const double off = difference(&test, &vertex, &fragment);
    print_message("  %.2e\n", off);
    assert_true(off < 0.01);
    scene_end(&test);
}

/* Oracle: an object in the shadow of another gets no light, though it touches it: not one pixel of it. */
static void nothing_leaks_into_an_object_that_touches(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct test_scene test;
        const struct io_material material = marble(), other = skin1();
        init(&test, IO_PRIMITIVE_SPHERE, 64, 5, &material);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 3, 7.99, i % 2 ? &other : &material));
        scene_add_directional(&test, 1, 0, 0, 3);
        test.scene.camera.is_orthographic = true;
        test.scene.camera.height_mm = 14;
        test.scene.camera.eye_mm[0] = test.scene.camera.target_mm[0] = 3;
        struct render_options options = by_maps(RENDER_TSM_TABLE);
        options.tsm.gather = i == 0 ? RENDER_TSM_FRAGMENT : RENDER_TSM_VERTEX;
        struct io_image *const image = draw_once(&test, &options, NULL);
        int lit_count = 0, dark_count = 0;
        for (int p = 0; p < WIDTH * HEIGHT; p++) {
            const double x_mm = 3 + (p % WIDTH + 0.5 - WIDTH / 2) * 14.0 / HEIGHT;
            if (image->pixels[4 * p + 3] < 1 || fabs(x_mm - 5) < 0.3)
                continue;
            lit_count += x_mm < 5 && image->pixels[4 * p] > 0;
            dark_count += x_mm > 5;
            assert_true(x_mm < 5 || image->pixels[4 * p] == 0);
        }
        assert_true(lit_count > 500 && dark_count > 150);
        io_image_destroy(image);
        scene_end(&test);
    }
}

/* ---- lights and layers -------------------------------------------------------------------------- */

/* Oracle: light from so far away is parallel. All texels say the same; samples differ by how they fall on
 * the map's texels. */
static void a_far_point_light_is_directional(void **state)
{
    (void)state;
    static const enum render_tsm_response responses[] = { RENDER_TSM_PROFILE, RENDER_TSM_TABLE };
    for (int i = 0; i < 2; i++) {
        struct test_scene test, far;
        const double distance_mm = 3000;
        const struct io_material material = skin1();
        init(&test, IO_PRIMITIVE_SPHERE, 96, 3, &material);
        init(&far, IO_PRIMITIVE_SPHERE, 96, 3, &material);
        scene_add_directional(&test, -0.48, -0.6, -0.64, 3);
        scene_add_point(&far, 0.48 * distance_mm, 0.6 * distance_mm, 0.64 * distance_mm,
                        3 * distance_mm * distance_mm);
        const struct render_options options = by_maps(responses[i]);
        const struct deviation deviation =
            compare(draw_once(&far, &options, NULL), draw_once(&test, &options, NULL));
        print_message("  %s: %.2e\n", render_tsm_response_names[responses[i]], relative_rmse(&deviation));
        assert_true(relative_rmse(&deviation) < (i == 0 ? 0.005 : 0.05));
        scene_end(&test);
        scene_end(&far);
    }
}

static double mean_of(struct io_image *image)
{
    double sum = 0;
    for (size_t i = 0; i < WIDTH * HEIGHT; i++)
        sum += (double)image->pixels[4 * i];
    io_image_destroy(image);
    return sum;
}

/* Oracle: a convex object has no air in it, whatever its slope; a bowl has, and gets less. */
static void layers_find_the_air_of_hollow_objects(void **state)
{
    (void)state;
    static const enum io_primitive primitives[] = { IO_PRIMITIVE_SPHERE, IO_PRIMITIVE_CUBE,
                                                    IO_PRIMITIVE_BOWL };
    for (int i = 0; i < 3; i++) {
        struct test_scene test;
        const struct io_material material = marble();
        init(&test, primitives[i], 96, 8, &material);
        scene_add_directional(&test, 0.6, -0.5, -0.6, 3);
        struct render_options solid = by_maps(RENDER_TSM_TABLE), layered = solid;
        layered.tsm.layer_count = 6;
        const double ratio =
            mean_of(draw_once(&test, &layered, NULL)) / mean_of(draw_once(&test, &solid, NULL));
        print_message("  %d: %.5f\n", i, ratio);
        assert_true(i < 2 ? fabs(ratio - 1) < 1e-4 : ratio < 0.98 && ratio > 0.5);
        scene_end(&test);
    }
}

/* ---- volumes ------------------------------------------------------------------------------------ */

/* Oracle: a renderer of its own. Volumes with another number of samples may come to lie where others were.
 */
static void samples_may_change_from_picture_to_picture(void **state)
{
    (void)state;
    static const int counts[] = { 13, 21, 53, 21, 13, 53, 13 };
    struct test_scene test;
    const struct io_material material = marble();
    init(&test, IO_PRIMITIVE_SPHERE, 32, 8, &material);
    scene_add_directional(&test, -1, -1, -1, 3);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        const struct render_options options = { .technique = RENDER_TECHNIQUE_TSM,
                                                .tsm = { .sample_count = counts[i] } };
        struct io_image *const expected = draw_once(&test, &options, NULL), *const found = draw(
                                                                                renderer, &options, NULL);
        assert_memory_equal(found->pixels, expected->pixels,
                            sizeof(float) * 4 * (size_t)found->width_px * (size_t)found->height_px);
        io_image_destroy(expected);
        io_image_destroy(found);
    }
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the same volume, baked in memory. A volume of another medium, or none, is refused. */
static void volumes_of_a_folder_are_used(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble(), other = skin1();
    init(&test, IO_PRIMITIVE_SPHERE, 48, 5, &material);
    scene_add_directional(&test, 0.6, -0.5, -0.6, 3);
    struct render_media *media;
    struct render_volumes *baked, *read;
    struct io_image *strip;
    dipole_status status;
    assert_true(render_media_create(&test.scene, &media, NULL));
    assert_true(render_volumes_bake(media, render_volume_epsilon(0.01), 32, &baked, NULL));
    assert_true(lut_tsm_to_image(baked->volumes[0], &strip, NULL));
    assert_true(io_exr_write("marble.tsm.exr", strip, false, NULL));
    assert_true(render_volumes_find(".", media, 0, &read, NULL));
    struct render_options from_memory = by_maps(RENDER_TSM_TABLE), from_folder = from_memory;
    from_folder.volumes = (const struct lut_tsm *const *)read->volumes;
    assert_true(difference(&test, &from_folder, &from_memory) == 0);

    test.objects[0].material = other;
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *image;
    assert_false(render_draw(renderer, &from_folder, &image, NULL, &status));
    assert_string_equal(status.message, "the volume is of another medium than material \"skin1\"");
    render_destroy(renderer);
    test.objects[0].material = material;
    assert_int_equal(unlink("marble.tsm.exr"), 0);
    render_volumes_destroy(read);
    assert_false(render_volumes_find(".", media, 0, &read, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_non_null(strstr(status.message, "no volume of material \"marble\""));
    assert_false(render_volumes_find("nowhere", media, 0, &read, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    io_image_destroy(strip);
    render_volumes_destroy(baked);
    render_media_destroy(media);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_conserved),
        cmocka_unit_test(energy_is_nearly_conserved_at_an_angle),
        cmocka_unit_test(layers_are_warned_of),
        cmocka_unit_test(the_table_errs_as_it_states),
        cmocka_unit_test(all_texels_with_the_profile_are_the_splats),
        cmocka_unit_test(samples_approach_all_texels),
        cmocka_unit_test(parts_add_up_to_the_sum),
        cmocka_unit_test(dense_vertices_are_near_fragments),
        cmocka_unit_test(nothing_leaks_into_an_object_that_touches),
        cmocka_unit_test(a_far_point_light_is_directional),
        cmocka_unit_test(layers_find_the_air_of_hollow_objects),
        cmocka_unit_test(samples_may_change_from_picture_to_picture),
        cmocka_unit_test(volumes_of_a_folder_are_used),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
