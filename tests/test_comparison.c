#include "tests/check.h"

#include "fit/comparison.h"
#include "fit/report_color.h"
#include "io/image.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- helpers ------------------------------------------------------------------------------------------
 */

/* A picture, its model and uses, all of which the test fills. */
struct pair {
    struct io_image *image, *model;
    unsigned char *uses;
    struct fit_report_picture picture;
};

static struct pair *pair_create(int width, int height)
{
    struct pair *const pair = calloc(1, sizeof *pair);
    assert_non_null(pair);
    assert_true(io_image_create(width, height, 4, &pair->image, NULL)); /* alpha must not matter */
    assert_true(io_image_create(width, height, 3, &pair->model, NULL));
    pair->uses = calloc((size_t)width * (size_t)height, 1);
    pair->picture = (struct fit_report_picture){
        .name = "pair.exr", .image = pair->image, .model = pair->model, .uses = pair->uses
    };
    return pair;
}

static void pair_destroy(struct pair *pair)
{
    io_image_destroy(pair->image);
    io_image_destroy(pair->model);
    free(pair->uses);
    free(pair);
}

static void pair_set(struct pair *pair, int i, float target, float model)
{
    for (int c = 0; c < 3; c++) {
        pair->image->pixels[4 * i + c] = target;
        pair->model->pixels[3 * i + c] = model;
    }
}

static struct fit_comparison *compare(const struct pair *pair)
{
    struct fit_comparison *comparison;
    assert_true(fit_comparison_create(&pair->picture, (size_t)1 << 22, &comparison, NULL));
    return comparison;
}

static int code_of(double linear)
{
    const double srgb = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (int)lround(255 * srgb);
}

static void assert_pixel(const struct io_image *image, int i, const unsigned char rgb[3])
{
    for (int c = 0; c < 3; c++)
        assert_int_equal(code_of(image->pixels[3 * i + c]), rgb[c]);
}

static double relative_lightness(const unsigned char rgb[3])
{
    static const double weights[3] = { 0.2126, 0.7152, 0.0722 };
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double srgb = rgb[c] / 255.0;
        sum += weights[c] * (srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4));
    }
    return cbrt(sum);
}

/* ---- colours ------------------------------------------------------------------------------------------
 */

/* Oracle: white at 0, blue below, red above, and a larger difference is a darker colour, of either sign as
 * dark to 0.4 of L*, and as rounding to bytes leaves it. */
static void differences_have_the_colours_of_their_sign(void **state)
{
    (void)state;
    unsigned char rgb[3], other[3];
    fit_difference_color(0, rgb);
    assert_true(rgb[0] == 255 && rgb[1] == 255 && rgb[2] == 255);
    fit_difference_color(-0.0, rgb);
    assert_true(rgb[0] == 255 && rgb[1] == 255 && rgb[2] == 255);
    double last = 2;
    for (int i = 1; i <= 100; i++) {
        fit_difference_color(i / 100.0, rgb);
        fit_difference_color(-i / 100.0, other);
        assert_true(rgb[0] > rgb[1] && rgb[0] > rgb[2]);
        assert_true(other[2] > other[1] && other[1] >= other[0]);
        assert_true(relative_lightness(rgb) < last);
        last = relative_lightness(rgb);
        assert_true(fabs(relative_lightness(other) - last) < 0.01);
    }
    fit_difference_color(INFINITY, other);
    assert_memory_equal(other, rgb, 3);
    fit_difference_color(NAN, rgb);
    assert_memory_equal(rgb, fit_no_difference_color, 3);
}

/* Oracle: each use has a name and a colour that no other has, also in 16 steps a channel. */
static void uses_are_told_apart(void **state)
{
    (void)state;
    for (int i = 0; i < FIT_USE_COUNT; i++) {
        assert_non_null(fit_use_names[i]);
        for (int k = 0; k < i; k++) {
            int distance = 0;
            for (int c = 0; c < 3; c++)
                distance += abs(fit_use_colors[i][c] - fit_use_colors[k][c]);
            assert_true(distance > 48);
            assert_string_not_equal(fit_use_names[i], fit_use_names[k]);
        }
    }
}

/* Oracle: the colours that the table states, read back from the file; in boxes the commonest. */
static void a_mask_has_the_colours_of_its_uses(void **state)
{
    (void)state;
    unsigned char uses[2 * FIT_USE_COUNT];
    for (int i = 0; i < 2 * FIT_USE_COUNT; i++)
        uses[i] = (unsigned char)(i % FIT_USE_COUNT);
    struct io_image *found;
    assert_true(fit_mask_write("mask.png", uses, FIT_USE_COUNT, 2, NULL));
    assert_true(io_photo_read("mask.png", IO_PHOTO_SRGB, NULL, &found, NULL));
    assert_int_equal(found->width_px, FIT_USE_COUNT);
    assert_int_equal(found->height_px, 2);
    assert_int_equal(found->channel_count, 3);
    for (int i = 0; i < 2 * FIT_USE_COUNT; i++)
        assert_pixel(found, i, fit_use_colors[i % FIT_USE_COUNT]);
    io_image_destroy(found);

    static const unsigned char boxes[] = { 2, 2, 4, 0, 7, //
                                           2, 0, 4, 0, 3, //
                                           1, 8, 5, 5, 6 };
    static const unsigned char expected[] = { 2, 0, 3, 1, 5, 6 };
    assert_true(fit_uses_draw(boxes, 5, 3, 2, &found, NULL));
    assert_int_equal(found->width_px, 3);
    assert_int_equal(found->height_px, 2);
    for (int i = 0; i < 6; i++)
        assert_pixel(found, i, fit_use_colors[expected[i]]);
    io_image_destroy(found);
}

/* Oracle: a mask that is none is refused with what is wrong, and no file is left. */
static void what_is_no_mask_is_refused(void **state)
{
    (void)state;
    static const unsigned char uses[4] = { 0, 1, FIT_USE_COUNT, 0 };
    dipole_status status;
    assert_false(fit_mask_write("none.png", uses, 2, 2, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.source, "none.png");
    assert_string_equal(status.message, "use of pixel 2 is 9, expected 0 to 8");
    assert_false(fit_mask_write("none.png", uses, 0, 2, &status));
    assert_string_equal(status.message, "a mask of 0 x 2 pixels, expected 1 to 65536");
    assert_false(fit_mask_write("none.png", uses, 65536, 65536, &status));
    assert_string_equal(status.message, "a mask of 4294967296 pixels, expected at most 268435456");
    assert_int_equal(access("none.png", F_OK), -1);
    assert_false(fit_mask_write("missing/none.png", uses, 2, 1, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
}

/* ---- comparisons --------------------------------------------------------------------------------------
 */

/* Oracle: in an even picture the difference is the model's excess, over floats' rounding. */
static void a_difference_is_relative(void **state)
{
    (void)state;
    static const float excesses[] = { 0, 0.1f, -0.27f, 0.88f, -1 };
    static const double limits[] = { 0.01, 0.1, 0.5, 1, 1 };
    for (int k = 0; k < 5; k++) {
        struct pair *const pair = pair_create(11, 7);
        for (int i = 0; i < 77; i++)
            pair_set(pair, i, 3e-4f, 3e-4f * (1 + excesses[k]));
        struct fit_comparison *const comparison = compare(pair);
        for (int i = 0; i < 3 * 77; i++)
            assert_true(fabsf(comparison->differences->pixels[i] - excesses[k]) < 3e-7f);
        for (int c = 0; c < 3; c++)
            assert_true(fabs(comparison->mean_differences[c] - (double)excesses[k]) < 3e-7);
        assert_close(comparison->exposure, 0.8 / 3e-4, 1e-6, "excess %d", k);
        assert_close(comparison->limit, limits[k], 1e-15, "excess %d", k);
        struct io_image *drawn;
        unsigned char rgb[3];
        assert_true(fit_differences_draw(comparison, -1, &drawn, NULL));
        fit_difference_color((double)excesses[k] / limits[k], rgb);
        assert_pixel(drawn, 40, rgb);
        io_image_destroy(drawn);
        fit_comparison_destroy(comparison);
        pair_destroy(pair);
    }
}

/* Where a channel is at u, v; NaN outside, where it is not finite or not used. */
static double used_at(const struct pair *pair, int u, int v, int c)
{
    if (u < 0 || v < 0 || u >= pair->image->width_px || v >= pair->image->height_px)
        return NAN;
    const int i = v * pair->image->width_px + u;
    const float target = pair->image->pixels[4 * i + c];
    return pair->uses[i] == FIT_USE_OK && isfinite(target) && isfinite(pair->model->pixels[3 * i + c])
               ? (double)target
               : NAN;
}

/* Oracle: the definition in comparison.h, summed anew for random pictures with holes. The tolerance is that
 * of differences of floats. */
static void differences_follow_their_definition(void **state)
{
    (void)state;
    struct rng rng = { .seed = 11 };
    for (int k = 0; k < 20; k++) {
        const int width = 1 + (int)uniform(&rng, 0, 25), height = 1 + (int)uniform(&rng, 0, 25);
        struct pair *const pair = pair_create(width, height);
        for (int i = 0; i < width * height; i++) {
            for (int c = 0; c < 3; c++) {
                pair->image->pixels[4 * i + c] =
                    uniform(&rng, 0, 1) < 0.05 ? NAN : (float)log_uniform(&rng, 1e-6, 1);
                pair->model->pixels[3 * i + c] =
                    uniform(&rng, 0, 1) < 0.05 ? INFINITY : (float)log_uniform(&rng, 1e-6, 1);
            }
            pair->uses[i] =
                (unsigned char)(uniform(&rng, 0, 1) < 0.5 ? 0 : uniform(&rng, 0, FIT_USE_COUNT));
        }
        struct fit_comparison *const comparison = compare(pair);
        for (int i = 0; i < 3 * width * height; i++) {
            const int c = i % 3, u = i / 3 % width, v = i / 3 / width;
            const float found = comparison->differences->pixels[i];
            if (isnan(used_at(pair, u, v, c))) {
                assert_true(isnan(found));
                continue;
            }
            double sum = 0, count = 0;
            for (int y = v - 3; y <= v + 3; y++)
                for (int x = u - 3; x <= u + 3; x++)
                    if (!isnan(used_at(pair, x, y, c))) {
                        sum += used_at(pair, x, y, c);
                        count++;
                    }
            const double scale = fmax(sum / count, 0.008 / comparison->exposure);
            const double expected = ((double)pair->model->pixels[i] - used_at(pair, u, v, c)) / scale;
            assert_close((double)found, expected, 1e-6, "case %d, value %d", k, i);
        }
        fit_comparison_destroy(comparison);
        pair_destroy(pair);
    }
}

/* Oracle: of values 1 to 1000, with as many ten times as bright that are not used, 990 is the 99th
 * percentile. */
static void exposure_is_that_of_used_pixels(void **state)
{
    (void)state;
    struct pair *const pair = pair_create(100, 20);
    for (int i = 0; i < 1000; i++) {
        pair_set(pair, 2 * i, (float)(i + 1), (float)(i + 1));
        pair_set(pair, 2 * i + 1, 10 * (float)(i + 1), INFINITY);
        pair->uses[2 * i + 1] = FIT_USE_CLIPPED;
    }
    struct fit_comparison *const comparison = compare(pair);
    assert_close(comparison->exposure, 0.8 / 990, 2e-3, "one place of a thousand");
    assert_close((double)comparison->target->pixels[3 * 1998], 1000 * comparison->exposure, 1e-6, "target");
    assert_int_equal(comparison->use_counts[FIT_USE_OK], 1000);
    assert_int_equal(comparison->use_counts[FIT_USE_CLIPPED], 1000);
    assert_int_equal(comparison->use_counts[FIT_USE_MASKED], 0);
    fit_comparison_destroy(comparison);
    pair_destroy(pair);
}

/* Oracle: sizes that the limits give by hand; means of boxes, also cut ones, summed anew. */
static void large_pictures_are_means_of_boxes(void **state)
{
    (void)state;
    static const struct {
        int width, height, factor;
        size_t limit;
    } cases[] = { { 4000, 3000, 4, (size_t)1 << 22 },
                  { 1024, 1024, 1, (size_t)1 << 22 },
                  { 1025, 3, 2, (size_t)1 << 22 },
                  { 1, 4001, 4, (size_t)1 << 22 },
                  { 130, 70, 3, 1200 },
                  { 5, 4, 5, 1 },
                  { 1, 1, 1, 1 } };
    struct rng rng = { .seed = 3 };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        const int width = cases[k].width, height = cases[k].height, factor = cases[k].factor;
        struct pair *const pair = pair_create(width, height);
        for (int i = 0; i < width * height; i++)
            pair_set(pair, i, (float)uniform(&rng, 0, 1), (float)uniform(&rng, 0, 2));
        pair->image->pixels[0] = NAN;
        struct fit_comparison *comparison;
        assert_true(fit_comparison_create(&pair->picture, cases[k].limit, &comparison, NULL));
        assert_int_equal(comparison->factor, factor);
        const struct io_image *const small = comparison->target;
        assert_int_equal(small->width_px, (width + factor - 1) / factor);
        assert_int_equal(small->height_px, (height + factor - 1) / factor);
        for (int n = 0; n < 100; n++) {
            const int x = n == 0 ? small->width_px - 1 : (int)uniform(&rng, 0, small->width_px);
            const int y = n == 0 ? small->height_px - 1 : (int)uniform(&rng, 0, small->height_px);
            double sum = 0, count = 0;
            for (int v = y * factor; v < (y + 1) * factor && v < height; v++)
                for (int u = x * factor; u < (x + 1) * factor && u < width; u++, count++)
                    sum += (double)pair->image->pixels[4 * (v * width + u) + 1];
            assert_close((double)small->pixels[3 * (y * small->width_px + x) + 1],
                         comparison->exposure * sum / count, 1e-6, "case %zu, box %d, %d", k, x, y);
        }
        fit_comparison_destroy(comparison);
        pair_destroy(pair);
    }
}

/* Oracle: with nothing used, nothing differs, and the picture is still shown by its own level; with nothing
 * finite in it, unchanged. */
static void nothing_used_is_no_difference(void **state)
{
    (void)state;
    struct pair *const pair = pair_create(4, 4);
    for (int i = 0; i < 16; i++) {
        pair_set(pair, i, 2, 3);
        pair->uses[i] = FIT_USE_MASKED;
    }
    struct fit_comparison *comparison = compare(pair);
    assert_close(comparison->exposure, 0.4, 1e-6, "level 2");
    assert_true(isnan(comparison->mean_differences[1]) && isnan(comparison->differences->pixels[5]));
    struct io_image *drawn;
    assert_true(fit_differences_draw(comparison, 2, &drawn, NULL));
    assert_pixel(drawn, 7, fit_no_difference_color);
    io_image_destroy(drawn);
    fit_comparison_destroy(comparison);
    for (int i = 0; i < 16; i++)
        pair_set(pair, i, NAN, -INFINITY);
    comparison = compare(pair);
    assert_close(comparison->exposure, 1, 0, "nothing finite");
    fit_comparison_destroy(comparison);
    pair_destroy(pair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(differences_have_the_colours_of_their_sign),
        cmocka_unit_test(uses_are_told_apart),
        cmocka_unit_test(a_mask_has_the_colours_of_its_uses),
        cmocka_unit_test(what_is_no_mask_is_refused),
        cmocka_unit_test(a_difference_is_relative),
        cmocka_unit_test(differences_follow_their_definition),
        cmocka_unit_test(exposure_is_that_of_used_pixels),
        cmocka_unit_test(large_pictures_are_means_of_boxes),
        cmocka_unit_test(nothing_used_is_no_difference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
