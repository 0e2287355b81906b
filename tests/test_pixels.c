#include "check.h"
#include "fit/pixels.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 60, HEIGHT = 40, COUNT = WIDTH * HEIGHT };

/* A capture and a picture that agree: radiosity 2, 3, 4 everywhere, exit 0.25, specular 0.1. */
struct scene {
    struct render_capture capture;
    struct io_image *picture;
    float position_mm[3 * COUNT], coverage[COUNT], exit_per_sr[COUNT], specular[3 * COUNT];
};

static struct scene *scene_create(int channel_count)
{
    struct scene *const scene = calloc(1, sizeof *scene);
    assert_non_null(scene);
    assert_true(io_image_create(WIDTH, HEIGHT, channel_count, &scene->picture, NULL));
    scene->capture = (struct render_capture){ .width_px = WIDTH,
                                              .height_px = HEIGHT,
                                              .position_mm = scene->position_mm,
                                              .coverage = scene->coverage,
                                              .exit_per_sr = scene->exit_per_sr,
                                              .specular = scene->specular };
    for (size_t i = 0; i < COUNT; i++) {
        scene->coverage[i] = 1.0f;
        scene->exit_per_sr[i] = 0.25f;
        const size_t x = i % WIDTH, y = i / WIDTH;
        scene->position_mm[3 * i] = (float)x;
        scene->position_mm[3 * i + 1] = (float)y;
        for (size_t c = 0; c < 3; c++) {
            scene->specular[3 * i + c] = 0.1f;
            scene->picture->pixels[i * (size_t)channel_count + c] = 0.1f + 0.25f * (float)(c + 2);
        }
    }
    return scene;
}

static void scene_destroy(struct scene *scene)
{
    io_image_destroy(scene->picture);
    free(scene);
}

/* Oracle: the radiosity the picture was made with; float rounding. */
static void radiosity_is_what_is_left_without_specular(void **state)
{
    (void)state;
    for (int channel_count = 3; channel_count <= 4; channel_count++) {
        struct scene *const scene = scene_create(channel_count);
        struct fit_pixels *pixels;
        assert_true(fit_pixels_create(&scene->capture, scene->picture, 1000000, NULL, &pixels, NULL));
        assert_int_equal(pixels->count, COUNT);
        assert_int_equal(pixels->usable_count, COUNT);
        for (size_t j = 0; j < pixels->count; j++) {
            for (size_t c = 0; c < 3; c++)
                assert_close((double)pixels->radiosity_w_per_mm2[3 * j + c], (double)(c + 2), 1e-6,
                             "pixel %zu", j);
        }
        fit_pixels_destroy(pixels);
        scene_destroy(scene);
    }
}

/* Oracle: pixels spoilt one by one, in every way there is, must not be among those chosen. */
static void pixels_that_tell_nothing_are_left_out(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3);
    scene->coverage[0] = 0.99f;
    scene->coverage[1] = NAN;
    scene->exit_per_sr[2] = 0.0f;
    scene->picture->pixels[3 * 3 + 1] = NAN;
    scene->picture->pixels[3 * 4 + 2] = INFINITY;
    scene->specular[3 * 5] = 0.59f; /* of 0.6 */
    scene->picture->pixels[3 * 6] = 0.0f;
    scene->specular[3 * 7] = NAN;
    struct fit_pixels *pixels;
    assert_true(fit_pixels_create(&scene->capture, scene->picture, 1000000, NULL, &pixels, NULL));
    assert_int_equal(pixels->count, COUNT - 8);
    for (size_t j = 0; j < pixels->count; j++)
        assert_true(pixels->positions_mm[3 * j] >= 8.0f || pixels->positions_mm[3 * j + 1] >= 1.0f);
    fit_pixels_destroy(pixels);
    scene_destroy(scene);
}

/* Oracle: what even spreading means: a quarter of the picture gets a quarter of the pixels chosen, and each
 * pixel is chosen once. Same input, same choice. */
static void a_limited_choice_is_spread_evenly(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3);
    struct fit_pixels *pixels, *again;
    assert_true(fit_pixels_create(&scene->capture, scene->picture, COUNT / 4, NULL, &pixels, NULL));
    assert_true(fit_pixels_create(&scene->capture, scene->picture, COUNT / 4, NULL, &again, NULL));
    assert_int_equal(pixels->usable_count, COUNT);
    assert_int_equal(pixels->count, COUNT / 4);
    assert_int_equal(pixels->count, again->count);
    assert_memory_equal(pixels->positions_mm, again->positions_mm, 3 * pixels->count * sizeof(float));
    size_t quarters[4] = { 0 }, odd_count = 0;
    bool *const is_seen = calloc(COUNT, sizeof *is_seen);
    assert_non_null(is_seen);
    for (size_t j = 0; j < pixels->count; j++) {
        const size_t x = (size_t)pixels->positions_mm[3 * j], y = (size_t)pixels->positions_mm[3 * j + 1];
        assert_false(is_seen[y * WIDTH + x]);
        is_seen[y * WIDTH + x] = true;
        quarters[2 * (y >= HEIGHT / 2) + (x >= WIDTH / 2)]++;
        odd_count += x % 2;
        assert_in_range(pixels->tiles[j], 0, pixels->tile_count - 1);
    }
    for (int q = 0; q < 4; q++)
        assert_in_range(quarters[q] * 4, pixels->count * 3 / 4, pixels->count * 5 / 4);
    /* one of every 2 x 2, but not always the same one: light samples lie on a grid, too */
    assert_in_range(odd_count, COUNT / 4 * 4 / 10, COUNT / 4 * 6 / 10);
    free(is_seen);
    fit_pixels_destroy(pixels);
    fit_pixels_destroy(again);
    scene_destroy(scene);
}

/* Oracle: pixels.h; the message counts what became of the pixels. */
static void too_few_pixels_are_refused_with_the_reasons(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3);
    for (size_t i = 50; i < COUNT; i++)
        scene->coverage[i] = 0.5f;
    scene->picture->pixels[0] = NAN;
    struct fit_pixels *pixels;
    dipole_status status;
    assert_false(fit_pixels_create(&scene->capture, scene->picture, 1000, NULL, &pixels, &status));
    assert_null(pixels);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_non_null(strstr(status.message, "49 pixels to fit"));
    assert_non_null(strstr(status.message, "2350 are not wholly covered"));
    assert_non_null(strstr(status.message, "1 are not finite"));
    scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(radiosity_is_what_is_left_without_specular),
        cmocka_unit_test(pixels_that_tell_nothing_are_left_out),
        cmocka_unit_test(a_limited_choice_is_spread_evenly),
        cmocka_unit_test(too_few_pixels_are_refused_with_the_reasons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
