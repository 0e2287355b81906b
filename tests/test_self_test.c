#include "tests/check.h"

#include "lutgen/self_test.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum { LIMIT = 64 };

/* The patch of a table of depth slices, as it was filled, without the slices before it. */
static void get_patch(int width, int height, int depth, bool is_half, float *rgb)
{
    struct io_image *image;
    assert_true(io_image_create(width * depth, height, 3, &image, NULL));
    for (int i = 0; i < width * depth * height * 3; i++)
        image->pixels[i] = -7.0f;
    lut_self_test_fill(image, depth, is_half);
    for (int y = 0; y < height; y++) {
        const float *const row = image->pixels + (size_t)y * (size_t)(width * depth) * 3;
        for (int i = 0; i < width * (depth - 1) * 3; i++)
            assert_true(row[i] == -7.0f); /* other slices are not touched */
        memcpy(rgb + (size_t)y * (size_t)width * 3, row + width * (depth - 1) * 3,
               (size_t)width * 3 * sizeof *rgb);
    }
    io_image_destroy(image);
}

static void expect_texel(const float *rgb, int width, int x, int y, float r, float g, float b)
{
    const float *const texel = rgb + (y * width + x) * 3;
    if (texel[0] != r || texel[1] != g || texel[2] != b)
        fail_msg("(%d, %d) is %g %g %g, expected %g %g %g", x, y, (double)texel[0], (double)texel[1],
                 (double)texel[2], (double)r, (double)g, (double)b);
}

/* Oracle: the values in the header's comment. */
static void the_patch_is_as_documented(void **state)
{
    (void)state;
    static const int sizes[][3] = { { 8, 8, 1 }, { 64, 64, 32 }, { 17, 9, 3 }, { 9, 40, 2 } };
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        for (int is_half = 0; is_half < 2; is_half++) {
            const int width = sizes[i][0], height = sizes[i][1];
            float rgb[LIMIT * LIMIT * 3];
            get_patch(width, height, sizes[i][2], is_half, rgb);
            expect_texel(rgb, width, 0, 0, 1, 0, 0);
            expect_texel(rgb, width, width - 1, 0, 0, 1, 0);
            expect_texel(rgb, width, 0, height - 1, 0, 0, 1);
            expect_texel(rgb, width, width - 1, height - 1, 0.5f, 0.5f, 0.5f);
            const float greys[] = { 0.5f,
                                    0.25f,
                                    0.0009765625f,
                                    1000,
                                    is_half ? 65504.0f : 131072.0f,
                                    is_half ? 1.0f / 16384 : 1.0f / 1073741824 };
            for (int x = 1; x <= 6; x++)
                expect_texel(rgb, width, x, 2, greys[x - 1], greys[x - 1], greys[x - 1]);
            for (int x = 0; x < width; x++) {
                const float ramp = (float)x / (float)(width == 8    ? 8
                                                      : width == 64 ? 64
                                                      : width == 17 ? 32
                                                                    : 16);
                expect_texel(rgb, width, x, height / 2, ramp, ramp, ramp);
            }
            float sum = 0;
            for (int x = 0; x < width * 3; x++)
                sum += rgb[x] + rgb[width * 3 + x] + rgb[(height - 1) * width * 3 + x];
            assert_true(sum == 1 + 1 + 1 + 1.5f); /* these rows are black but for the corners */
        }
}

/* ---- what programs do to a picture, by independent formulas ---------------------------------------- */

static float decode(float v)
{
    return (float)(v <= 0.04045f ? (double)v / 12.92 : pow(((double)v + 0.055) / 1.055, 2.4));
}

static float encode(float v)
{
    return (float)(v <= 0.0031308f ? (double)v * 12.92 : 1.055 * pow((double)v, 1 / 2.4) - 0.055);
}

static float clamp(float v)
{
    return v > 1 ? 1 : v;
}

static float quantise(float v)
{
    return (float)(int)(clamp(v) * 255 + 0.5f) / 255;
}

static float halve(float v)
{
    return v > 65504 ? INFINITY : v < 3e-8f ? 0 : v;
}

static float saturate_half(float v)
{
    return v > 65504 ? 65504 : v < 3e-8f ? 0 : v;
}

/* A little noise, as of another conversion to half. */
static float noise(float v)
{
    return v * 1.0004f;
}

static void map(float *rgb, int count, float (*function)(float))
{
    for (int i = 0; i < count * 3; i++)
        rgb[i] = function(rgb[i]);
}

static void swap(float *rgb, int a, int b)
{
    float texel[3];
    memcpy(texel, rgb + a * 3, sizeof texel);
    memcpy(rgb + a * 3, rgb + b * 3, sizeof texel);
    memcpy(rgb + b * 3, texel, sizeof texel);
}

static void flip_x(float *rgb, int width, int height)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width / 2; x++)
            swap(rgb, y * width + x, y * width + width - 1 - x);
}

static void flip_y(float *rgb, int width, int height)
{
    for (int y = 0; y < height / 2; y++)
        for (int x = 0; x < width; x++)
            swap(rgb, y * width + x, (height - 1 - y) * width + x);
}

static void reorder(float *rgb, int count, const int order[3])
{
    for (int i = 0; i < count; i++) {
        float texel[3];
        memcpy(texel, rgb + i * 3, sizeof texel);
        for (int c = 0; c < 3; c++)
            rgb[i * 3 + c] = texel[order[c]];
    }
}

/* Oracle: what was done is what is named, alone and with each other, on patches of several sizes. */
static void what_happened_is_named(void **state)
{
    (void)state;
    static const struct {
        float (*first)(float), (*second)(float);
        unsigned flags;
        bool is_float_only;
    } changes[] = {
        { NULL, NULL, LUT_SELF_TEST_FINE, false },
        { noise, NULL, LUT_SELF_TEST_FINE, false },
        { decode, NULL, LUT_SELF_TEST_SRGB_DECODED, false },
        { encode, NULL, LUT_SELF_TEST_SRGB_ENCODED, false },
        { clamp, NULL, LUT_SELF_TEST_CLAMPED, false },
        { quantise, NULL, LUT_SELF_TEST_QUANTISED, false },
        { clamp, decode, LUT_SELF_TEST_CLAMPED | LUT_SELF_TEST_SRGB_DECODED, false },
        { encode, quantise, LUT_SELF_TEST_QUANTISED | LUT_SELF_TEST_SRGB_ENCODED, false },
        { quantise, decode, LUT_SELF_TEST_QUANTISED | LUT_SELF_TEST_SRGB_DECODED, false },
        { halve, NULL, LUT_SELF_TEST_HALVED, true },
        { saturate_half, NULL, LUT_SELF_TEST_HALVED, true },
        { halve, decode, LUT_SELF_TEST_HALVED | LUT_SELF_TEST_SRGB_DECODED, true },
    };
    static const int orders[][3] = { { 0, 1, 2 }, { 2, 1, 0 }, { 0, 2, 1 }, { 1, 2, 0 } };
    static const int sizes[][2] = { { 8, 8 }, { 64, 64 }, { 17, 9 } };
    for (size_t size = 0; size < 3; size++)
        for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++)
            for (int is_half = 0; is_half < (changes[i].is_float_only ? 1 : 2); is_half++)
                for (int flip = 0; flip < 4; flip++)
                    for (size_t order = 0; order < 4; order++) {
                        const int width = sizes[size][0], height = sizes[size][1];
                        float rgb[LIMIT * LIMIT * 3];
                        get_patch(width, height, 2, is_half, rgb);
                        if (changes[i].first)
                            map(rgb, width * height, changes[i].first);
                        if (changes[i].second)
                            map(rgb, width * height, changes[i].second);
                        if (flip & 1)
                            flip_x(rgb, width, height);
                        if (flip & 2)
                            flip_y(rgb, width, height);
                        reorder(rgb, width * height, orders[order]);
                        const unsigned expected = changes[i].flags |
                                                  (flip & 1 ? LUT_SELF_TEST_FLIPPED_X : 0u) |
                                                  (flip & 2 ? LUT_SELF_TEST_FLIPPED_Y : 0u) |
                                                  (order ? LUT_SELF_TEST_CHANNELS_SWAPPED : 0u);
                        const unsigned found = lut_self_test_check(rgb, width, height, is_half);
                        if (found != expected)
                            fail_msg("size %zu, change %zu, half %d, flip %d, order %zu: %u, expected %u",
                                     size, i, is_half, flip, order, found, expected);
                    }
}

/* Oracle: what is no patch is not taken for one: another slice, filtered, a single texel changed by 1 %,
 * NaN, too small. */
static void what_is_no_patch_is_unknown(void **state)
{
    (void)state;
    enum { SIDE = 16 };
    float rgb[SIDE * SIDE * 3] = { 0 };
    assert_int_equal(lut_self_test_check(rgb, SIDE, SIDE, true), LUT_SELF_TEST_UNKNOWN);
    get_patch(SIDE, SIDE, 1, true, rgb);
    for (int i = SIDE * SIDE * 3 - 4; i >= 0; i--)
        rgb[i + 3] = 0.5f * (rgb[i] + rgb[i + 3]);
    assert_int_equal(lut_self_test_check(rgb, SIDE, SIDE, true), LUT_SELF_TEST_UNKNOWN);
    struct rng rng = { .seed = 4 };
    for (int i = 0; i < 200; i++) {
        get_patch(SIDE, SIDE, 1, true, rgb);
        float *const value = &rgb[random_bits(&rng) % (SIDE * SIDE * 3)];
        *value = i % 10 == 0 ? NAN : *value * 1.01f + (*value == 0 ? 1e-6f : 0);
        assert_int_equal(lut_self_test_check(rgb, SIDE, SIDE, true), LUT_SELF_TEST_UNKNOWN);
    }
    assert_int_equal(lut_self_test_check(rgb, 7, SIDE, true), LUT_SELF_TEST_UNKNOWN);
    assert_int_equal(lut_self_test_check(rgb, SIDE, 7, true), LUT_SELF_TEST_UNKNOWN);
}

/* Oracle: the texels themselves; each corner stands there once. */
static void probes_are_the_corners(void **state)
{
    (void)state;
    static const struct {
        int width, height, depth, count;
    } cases[] = { { 64, 1, 1, 2 }, { 64, 5, 1, 4 }, { 8, 8, 4, 8 }, { 1, 1, 1, 1 }, { 1, 3, 1, 2 } };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const int width = cases[i].width, height = cases[i].height, depth = cases[i].depth;
        struct rng rng = { .seed = i };
        struct io_image *image;
        assert_true(io_image_create(width * depth, height, 3, &image, NULL));
        for (int k = 0; k < width * depth * height * 3; k++)
            image->pixels[k] = (float)log_uniform(&rng, 1e-12, 1e3);
        assert_true(lut_self_test_set_probes(image, depth));
        json_t *const probes = json_loads(io_image_find(image, "dipole:self_test_json")->text, 0, NULL);
        assert_int_equal(json_array_size(probes), cases[i].count);
        for (size_t k = 0; k < json_array_size(probes); k++) {
            int x, y, z;
            double rgb[3];
            assert_int_equal(json_unpack(json_array_get(probes, k), "{s:[i, i, i!], s:[F, F, F!] !}",
                                         "texel", &x, &y, &z, "rgb", &rgb[0], &rgb[1], &rgb[2]),
                             0);
            assert_true((x == 0 || x == width - 1) && (y == 0 || y == height - 1) &&
                        (z == 0 || z == depth - 1));
            const float *const texel = image->pixels + (y * width * depth + z * width + x) * 3;
            for (int c = 0; c < 3; c++)
                assert_true(rgb[c] == (double)texel[c]);
            for (size_t m = 0; m < k; m++)
                assert_false(json_equal(json_array_get(probes, m), json_array_get(probes, k)));
        }
        json_decref(probes);
        io_image_destroy(image);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_patch_is_as_documented),
        cmocka_unit_test(what_happened_is_named),
        cmocka_unit_test(what_is_no_patch_is_unknown),
        cmocka_unit_test(probes_are_the_corners),
    };
    return cmocka_run_group_tests_name("self_test", tests, NULL, NULL);
}
