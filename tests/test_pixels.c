#include "fit/pixels.h"

#include "check.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 60, HEIGHT = 40, COUNT = WIDTH * HEIGHT };

/* A capture and a picture that agree: radiance 0.6, 0.85, 1.1 but for ripples, specular 0.1. */
struct scene {
    struct render_capture capture;
    struct fit_photo photo;
    struct io_image *direct, *mask;
    float object[COUNT], position_mm[3 * COUNT], coverage[COUNT], exit_per_sr[COUNT], specular[3 * COUNT];
};

static float *radiance(struct scene *scene, size_t x, size_t y)
{
    return scene->photo.image->pixels + (y * WIDTH + x) * (size_t)scene->photo.image->channel_count;
}

static struct scene *scene_create(int channel_count, int bits)
{
    struct scene *const scene = calloc(1, sizeof *scene);
    assert_non_null(scene);
    scene->photo = (struct fit_photo){
        .linear_limit = INFINITY, .bits = bits, .exposure = bits > 0 ? 0.5 : 1, .is_srgb = bits > 0
    };
    assert_true(io_image_create(WIDTH, HEIGHT, channel_count, &scene->photo.image, NULL));
    assert_true(io_image_create(WIDTH, HEIGHT, 4, &scene->direct, NULL));
    assert_true(io_image_create(WIDTH, HEIGHT, 1, &scene->mask, NULL));
    scene->capture = (struct render_capture){ .width_px = WIDTH,
                                              .height_px = HEIGHT,
                                              .position_mm = scene->position_mm,
                                              .object = scene->object,
                                              .coverage = scene->coverage,
                                              .exit_per_sr = scene->exit_per_sr,
                                              .specular = scene->specular };
    for (size_t i = 0; i < COUNT; i++) {
        const size_t x = i % WIDTH, y = i / WIDTH;
        scene->coverage[i] = 1;
        scene->object[i] = (float)(1 + i % 2);
        scene->exit_per_sr[i] = 0.25f;
        scene->position_mm[3 * i] = (float)x;
        scene->position_mm[3 * i + 1] = (float)y;
        scene->mask->pixels[i] = 1;
        for (size_t c = 0; c < 3; c++) {
            scene->specular[3 * i + c] = 0.1f;
            radiance(scene, x, y)[c] = 0.1f + 0.25f * (float)(c + 2) + 1e-4f * (float)i / COUNT;
            scene->direct->pixels[4 * i + c] = 0.5f;
        }
    }
    return scene;
}

static void scene_destroy(struct scene *scene)
{
    io_image_destroy(scene->photo.image);
    io_image_destroy(scene->direct);
    io_image_destroy(scene->mask);
    free(scene);
}

static struct fit_pixels *pixels_of(struct scene *scene, bool has_mask, bool has_direct, size_t limit)
{
    const struct fit_pixel_request request = { .capture = &scene->capture,
                                               .photo = &scene->photo,
                                               .mask = has_mask ? scene->mask : NULL,
                                               .direct = has_direct ? scene->direct : NULL,
                                               .gain = 1,
                                               .limit = limit };
    struct fit_pixels *pixels;
    dipole_status status;
    if (!fit_pixels_create(&request, NULL, &pixels, &status))
        fail_msg("%s", status.message);
    return pixels;
}

static int use_of(const struct fit_pixels *pixels, size_t x, size_t y)
{
    return pixels->uses[y * WIDTH + x];
}

/* Oracle: counting: a picture without fault is used as a whole, each pixel where it is. */
static void a_picture_without_fault_is_used_as_a_whole(void **state)
{
    (void)state;
    for (int channel_count = 3; channel_count <= 4; channel_count++) {
        struct scene *const scene = scene_create(channel_count, 0);
        struct fit_pixels *const pixels = pixels_of(scene, true, true, 1000000);
        assert_int_equal(pixels->count, COUNT);
        assert_int_equal(pixels->use_counts[FIT_USE_OK], COUNT);
        assert_int_equal(pixels->width_px, WIDTH);
        assert_int_equal(pixels->height_px, HEIGHT);
        for (size_t j = 0; j < pixels->count; j++) {
            const size_t pixel = pixels->at[j];
            assert_int_equal(pixels->objects[j], pixel % 2);
            assert_true(pixels->positions_mm[3 * j] == (float)(pixel % WIDTH));
            assert_true(pixels->positions_mm[3 * j + 1] == (float)(pixel / WIDTH));
            /* squares a sixteenth as wide as the longer side */
            assert_int_equal(pixels->tiles[j],
                             pixel / WIDTH * 16 / WIDTH * 16 + pixel % WIDTH * 16 / WIDTH);
        }
        fit_pixels_destroy(pixels);
        scene_destroy(scene);
    }
}

/* Oracle: use.h; pixels spoilt one by one, in every way there is; neighbours stay, but those of clipped
 * ones and of shadows' edges. */
static void every_use_has_its_pixels(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3, 0);
    scene->coverage[0] = 0.99f;
    scene->coverage[2] = NAN;
    scene->exit_per_sr[4] = 0;
    scene->mask->pixels[6] = 0.49f;
    scene->mask->pixels[8] = 0.5f;
    scene->mask->pixels[10] = NAN;
    radiance(scene, 12, 0)[1] = NAN;
    radiance(scene, 14, 0)[2] = -INFINITY;
    scene->specular[3 * 16] = NAN;
    scene->specular[3 * 18] = 0.31f; /* of 0.6 */
    scene->specular[3 * 20] = 0.29f;
    radiance(scene, 22, 0)[0] = 0; /* less than what is mirrored */
    struct fit_pixels *const pixels = pixels_of(scene, true, false, 1000000);
    static const struct {
        size_t x;
        enum fit_use use;
    } expected[] = {
        { 0, FIT_USE_NOT_COVERED }, { 2, FIT_USE_NOT_COVERED }, { 4, FIT_USE_NOT_COVERED },
        { 6, FIT_USE_MASKED },      { 8, FIT_USE_OK },          { 10, FIT_USE_MASKED },
        { 12, FIT_USE_NOT_FINITE }, { 14, FIT_USE_NOT_FINITE }, { 16, FIT_USE_NOT_FINITE },
        { 18, FIT_USE_SPECULAR },   { 20, FIT_USE_OK },         { 22, FIT_USE_SPECULAR },
    };
    size_t left_out = 0;
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        assert_int_equal(use_of(pixels, expected[i].x, 0), expected[i].use);
        assert_int_equal(use_of(pixels, expected[i].x + 1, 0), FIT_USE_OK);
        left_out += expected[i].use != FIT_USE_OK;
    }
    assert_int_equal(pixels->count, COUNT - left_out);
    assert_int_equal(pixels->use_counts[FIT_USE_NOT_COVERED], 3);
    assert_int_equal(pixels->use_counts[FIT_USE_MASKED], 2);
    assert_int_equal(pixels->use_counts[FIT_USE_NOT_FINITE], 3);
    assert_int_equal(pixels->use_counts[FIT_USE_SPECULAR], 2);
    for (size_t j = 0; j < pixels->count; j++)
        assert_int_equal(pixels->uses[pixels->at[j]], FIT_USE_OK);
    fit_pixels_destroy(pixels);
    scene_destroy(scene);
}

/* Oracle: the codes of the picture: the highest one is clipped and takes its eight neighbours along, which
 * do not take theirs; the one below holds a value. A channel is dark at its own code 0 or 1, and a pixel
 * where all three are. */
static void codes_are_clipped_and_dark(void **state)
{
    (void)state;
    for (int bits = 8; bits <= 16; bits += 8) {
        struct scene *const scene = scene_create(3, bits);
        const double last = ldexp(1, bits) - 1;
        for (size_t i = 0; i < COUNT; i++) {
            for (size_t c = 0; c < 3; c++) {
                scene->photo.image->pixels[3 * i + c] = (float)fit_photo_value(&scene->photo, 0.5 * last);
                scene->specular[3 * i + c] = 0;
            }
        }
        radiance(scene, 10, 10)[2] = (float)fit_photo_value(&scene->photo, last);
        radiance(scene, 20, 10)[2] = (float)fit_photo_value(&scene->photo, last - 1);
        for (size_t c = 0; c < 3; c++) {
            radiance(scene, 30, 10)[c] = (float)fit_photo_value(&scene->photo, 1);
            radiance(scene, 40, 10)[c] = (float)fit_photo_value(&scene->photo, c == 1 ? 2 : 0);
        }
        struct fit_pixels *const pixels = pixels_of(scene, false, false, 1000000);
        assert_int_equal(pixels->use_counts[FIT_USE_CLIPPED], 9);
        for (size_t y = 9; y <= 11; y++) {
            for (size_t x = 9; x <= 11; x++)
                assert_int_equal(use_of(pixels, x, y), FIT_USE_CLIPPED);
        }
        assert_int_equal(use_of(pixels, 20, 10), FIT_USE_OK);
        assert_int_equal(use_of(pixels, 30, 10), FIT_USE_DARK);
        assert_int_equal(use_of(pixels, 40, 10), FIT_USE_OK);
        assert_int_equal(pixels->use_counts[FIT_USE_DARK], 1);
        assert_false(fit_pixel_has_value(&scene->photo, 10 * WIDTH + 40, 0));
        assert_true(fit_pixel_has_value(&scene->photo, 10 * WIDTH + 40, 1));
        assert_false(fit_pixel_has_value(&scene->photo, 10 * WIDTH + 40, 2));
        assert_false(fit_pixel_has_value(&scene->photo, 10 * WIDTH + 30, 1));
        fit_pixels_destroy(pixels);
        scene_destroy(scene);
    }
}

/* Oracle: pixels.h: of numbers, the highest value of a channel is a clip if many share it: a dozen do, nine
 * do not; a background, which shares its value as well, is not asked. */
static void plateaus_of_numbers_are_clipped(void **state)
{
    (void)state;
    for (int many = 0; many < 2; many++) {
        struct scene *const scene = scene_create(3, 0);
        const size_t side = many ? 4 : 3;
        for (size_t i = 0; i < side * 3; i++)
            radiance(scene, 20 + i % 3, 10 + i / 3)[1] = 7;
        for (size_t x = 0; x < WIDTH; x++) {
            radiance(scene, x, HEIGHT - 1)[1] = 9;
            scene->coverage[(HEIGHT - 1) * WIDTH + x] = 0;
        }
        struct fit_pixels *const pixels = pixels_of(scene, false, false, 1000000);
        assert_int_equal(pixels->use_counts[FIT_USE_CLIPPED], many ? 5 * 6 : 0);
        assert_int_equal(use_of(pixels, 21, 11), many ? FIT_USE_CLIPPED : FIT_USE_OK);
        assert_int_equal(use_of(pixels, 19, 9), many ? FIT_USE_CLIPPED : FIT_USE_OK);
        assert_int_equal(use_of(pixels, 18, 9), FIT_USE_OK);
        assert_int_equal(pixels->use_counts[FIT_USE_NOT_COVERED], WIDTH);
        fit_pixels_destroy(pixels);
        scene_destroy(scene);
    }
}

/* Oracle: fit/photo.h: codes brighter than tone mapping leaves alone are no measurement. */
static void what_tone_mapping_bends_is_clipped(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3, 8);
    scene->photo.linear_limit = 1.5;
    radiance(scene, 10, 10)[0] = 1.51f;
    radiance(scene, 20, 10)[0] = 1.49f;
    struct fit_pixels *const pixels = pixels_of(scene, false, false, 1000000);
    assert_int_equal(use_of(pixels, 10, 10), FIT_USE_CLIPPED);
    assert_int_equal(use_of(pixels, 20, 10), FIT_USE_OK);
    fit_pixels_destroy(pixels);
    scene_destroy(scene);
}

/* Oracle: a picture of something even has one value, and no sensor's end. */
static void an_even_picture_is_not_clipped(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3, 0);
    for (size_t i = 0; i < 3 * COUNT; i++)
        scene->photo.image->pixels[i] = 0.7f;
    struct fit_pixels *const pixels = pixels_of(scene, false, false, 1000000);
    assert_int_equal(pixels->use_counts[FIT_USE_OK], COUNT);
    fit_pixels_destroy(pixels);
    scene_destroy(scene);
}

/* Oracle: by hand: a step of direct light between columns 29 and 30 spoils both; one to a background does
 * not, nor a slow fall of the light, nor a step of a quarter, nor steps where it is all but dark. */
static void edges_of_shadows_are_left_out(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3, 0);
    for (size_t i = 0; i < COUNT; i++) {
        const size_t x = i % WIDTH, y = i / WIDTH;
        const float dark = x < 30 ? 0.5f : 0.0f;
        const float quarter = x < 30 ? 0.5f : 0.4f;
        const float slow = (float)exp(-0.1 * (double)x);
        const float faint = x < 30 ? 0.004f : 0.0f;
        /* bands of 10 rows, whose borders are silhouettes */
        const float light = y < 10 ? dark : y < 20 ? quarter : y < 30 ? slow : faint;
        for (size_t c = 0; c < 3; c++)
            scene->direct->pixels[4 * i + c] = 0.1f + (c == 1 ? light : 0.0f);
        if (y % 10 == 9)
            scene->coverage[i] = 0.5f;
    }
    struct fit_pixels *const pixels = pixels_of(scene, false, true, 1000000);
    assert_int_equal(pixels->use_counts[FIT_USE_SHADOW_EDGE], 2 * 9);
    for (size_t y = 0; y < 9; y++) {
        assert_int_equal(use_of(pixels, 28, y), FIT_USE_OK);
        assert_int_equal(use_of(pixels, 29, y), FIT_USE_SHADOW_EDGE);
        assert_int_equal(use_of(pixels, 30, y), FIT_USE_SHADOW_EDGE);
        assert_int_equal(use_of(pixels, 31, y), FIT_USE_OK);
    }
    fit_pixels_destroy(pixels);
    scene_destroy(scene);
}

/* Oracle: what even spreading means: a quarter of the picture gets a quarter of the pixels chosen, and each
 * pixel is chosen once. Same input, same choice. */
static void a_limited_choice_is_spread_evenly(void **state)
{
    (void)state;
    struct scene *const scene = scene_create(3, 0);
    struct fit_pixels *const pixels = pixels_of(scene, false, false, COUNT / 4);
    struct fit_pixels *const again = pixels_of(scene, false, false, COUNT / 4);
    assert_int_equal(pixels->use_counts[FIT_USE_OK], COUNT);
    assert_int_equal(pixels->count, COUNT / 4);
    assert_int_equal(pixels->count, again->count);
    assert_memory_equal(pixels->at, again->at, pixels->count * sizeof *pixels->at);
    size_t quarters[4] = { 0 }, odd_count = 0;
    bool *const is_seen = calloc(COUNT, sizeof *is_seen);
    assert_non_null(is_seen);
    for (size_t j = 0; j < pixels->count; j++) {
        const size_t x = pixels->at[j] % WIDTH, y = pixels->at[j] / WIDTH;
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
    struct scene *const scene = scene_create(3, 0);
    for (size_t i = 50; i < COUNT; i++)
        scene->coverage[i] = 0.5f;
    radiance(scene, 0, 0)[1] = NAN;
    const struct fit_pixel_request request = {
        .capture = &scene->capture, .photo = &scene->photo, .gain = 1, .limit = 1000
    };
    const dipole_place place = { .source = "photo.png" };
    struct fit_pixels *pixels;
    dipole_status status;
    assert_false(fit_pixels_create(&request, &place, &pixels, &status));
    assert_null(pixels);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.source, "photo.png");
    assert_non_null(strstr(status.message, "49 pixels to fit, expected 100 or more"));
    assert_non_null(strstr(status.message, "2350 not covered"));
    assert_non_null(strstr(status.message, "1 not finite"));
    scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_without_fault_is_used_as_a_whole),
        cmocka_unit_test(every_use_has_its_pixels),
        cmocka_unit_test(codes_are_clipped_and_dark),
        cmocka_unit_test(plateaus_of_numbers_are_clipped),
        cmocka_unit_test(what_tone_mapping_bends_is_clipped),
        cmocka_unit_test(an_even_picture_is_not_clipped),
        cmocka_unit_test(edges_of_shadows_are_left_out),
        cmocka_unit_test(a_limited_choice_is_spread_evenly),
        cmocka_unit_test(too_few_pixels_are_refused_with_the_reasons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
