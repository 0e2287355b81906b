/* accuracy/fits.c: coefficients by a picture whose coefficients are known, with less and more of it. */
#include "check.h"

#include "accuracy/fits.h"
#include "io/file.h"
#include "io/image.h"
#include "renderer/reference.h"

#include <string.h>

static const char head[] =
    "{ \"camera\": { \"eye\": [5, 10, 48], \"target\": [0, 0, 0], \"fov_y_deg\": 38, \"size\": [96, 72] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [-0.5, -0.6, -0.6], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"sphere\", \"detail\": 48, \"transform\": { \"scale\": 12 },\n"
    "                \"material\": \"marble\", \"specular\": false }";

static const struct io_scene_options reading = { .width_px = 0 };
static const volatile sig_atomic_t go_on = 0, halt = 1;

static struct io_scene *scene_of(const char *rest)
{
    char text[1024];
    struct io_scene *scene;
    snprintf(text, sizeof text, "%s%s", head, rest);
    assert_true(io_file_write("scene.json", text, strlen(text), NULL));
    assert_true(io_scene_read("scene.json", &reading, &scene, NULL));
    return scene;
}

/* Oracle: the coefficients that the reference was drawn with. Intervals are honest, and few pixels tell
 * less. */
static void coefficients_come_back_from_the_reference(void **state)
{
    (void)state;
    struct io_scene *const scene = scene_of("] }");
    struct render_media *media;
    struct io_image *reference;
    struct render_report report;
    static struct accuracy_fits fits;
    assert_true(render_media_create(scene, &media, NULL));
    assert_true(render_reference_draw(
        scene, &(struct render_options){ .technique = RENDER_TECHNIQUE_REFERENCE, .epsilon = 0.003 },
        &reference, &report, NULL));
    assert_true(io_exr_write("reference.exr", reference, false, NULL));
    struct accuracy_fits_options options = {
        .scene = scene, .media = media, .picture_path = "reference.exr", .stop = &go_on
    };
    assert_true(accuracy_fits_measure(&options, &fits, NULL));
    assert_string_equal(fits.refusal, "");
    assert_int_equal(fits.point_count,
                     accuracy_fit_knobs[0].value_count + accuracy_fit_knobs[1].value_count);
    for (size_t i = 0; i < fits.point_count; i++) {
        const struct accuracy_fit_point *const point = &fits.points[i];
        print_message("  %s %d: %d told, %d inside, error %.2g, half width %.2g\n",
                      accuracy_fit_knobs[point->knob].name, point->value, point->told_count,
                      point->inside_count, point->error, point->half_width);
        const bool is_usual =
            point->value ==
            accuracy_fit_knobs[point->knob].values[accuracy_fit_knobs[point->knob].value_count - 1];
        if (!is_usual)
            continue;
        assert_int_equal(point->told_count, 6);
        assert_int_equal(point->inside_count, 6);
        assert_true(point->error <= point->half_width);
        assert_true(point->half_width < 0.1);
    }
    const size_t last = accuracy_fit_knobs[0].value_count - 1;
    assert_true(fits.points[0].half_width > fits.points[last].half_width);
    options.stop = &halt;
    assert_true(accuracy_fits_measure(&options, &fits, NULL));
    assert_int_equal(fits.point_count, 0);
    io_image_destroy(reference);
    render_media_destroy(media);
    io_scene_destroy(scene);
}

/* What fit cannot do is told, and nothing is read. */
static void scenes_that_fit_refuses_are_told(void **state)
{
    (void)state;
    static const struct {
        const char *rest, *reason;
    } cases[] = {
        { ", { \"primitive\": \"cube\", \"material\": \"skin1\" }] }", "it has more than one material" },
        { "], \"environment\": { \"image\": \"sky.exr\" } }", "it has light from all around" },
    };
    struct io_image *sky;
    assert_true(io_image_create(8, 4, 3, &sky, NULL));
    sky->pixels[0] = 1;
    assert_true(io_exr_write("sky.exr", sky, false, NULL));
    io_image_destroy(sky);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct io_scene *const scene = scene_of(cases[i].rest);
        struct render_media *media;
        static struct accuracy_fits fits;
        assert_true(render_media_create(scene, &media, NULL));
        assert_true(accuracy_fits_measure(
            &(struct accuracy_fits_options){
                .scene = scene, .media = media, .picture_path = "missing.exr", .stop = &go_on },
            &fits, NULL));
        assert_string_equal(fits.refusal, cases[i].reason);
        assert_int_equal(fits.point_count, 0);
        render_media_destroy(media);
        io_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coefficients_come_back_from_the_reference),
        cmocka_unit_test(scenes_that_fit_refuses_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
