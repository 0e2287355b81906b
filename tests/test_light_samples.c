/* renderer/light_samples.c: light views made by hand, reduced to samples. */
#include "check.h"

#include "renderer/light_samples.h"

#include <stdlib.h>
#include <string.h>

enum { SIDE = 64, LEVELS = 3 };

#define TEXEL_MM 0.25

/* A view along -z of the height field z = slope_x x + slope_y y, texels TEXEL_MM wide. */
static void fill_plane(float *texels, double slope_x, double slope_y)
{
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            float *const t = texels + 4 * (y * SIDE + x);
            const double x_mm = (x + 0.5) * TEXEL_MM, y_mm = (y + 0.5) * TEXEL_MM;
            t[0] = (float)x_mm;
            t[1] = (float)y_mm;
            t[2] = (float)(slope_x * x_mm + slope_y * y_mm);
            t[3] = (float)(TEXEL_MM * TEXEL_MM);
        }
    }
}

static struct render_light_samples reduce(const float *texels, double spacing_mm)
{
    const struct render_light_view view = { .texels = texels,
                                            .size_px = SIDE,
                                            .forward = { 0, 0, -1 },
                                            .rgb = { 1, 2, 4 },
                                            .block_px = 1 << LEVELS };
    struct render_light_samples samples = { 0 };
    const struct render_light_target target = { .samples = &samples, .spacing_mm = spacing_mm };
    assert_true(render_light_samples_append(&target, &view, NULL));
    return samples;
}

/* Total flux and its first moment, exactly as far as double sums of floats are. */
static void total(const struct render_light_samples *samples, int c, double *flux_w, double moment[3])
{
    *flux_w = moment[0] = moment[1] = moment[2] = 0;
    for (size_t i = 0; i < samples->count; i++) {
        const struct render_light_sample *const sample = &samples->samples[i];
        *flux_w += (double)sample->flux_w[c];
        for (int k = 0; k < 3; k++)
            moment[k] += (double)sample->flux_w[c] * (double)sample->position_mm[k];
    }
}

/* Oracle: flux and its first moment are conserved, whatever the shape; each float is rounded once. */
static void flux_and_its_middle_are_conserved(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    struct rng rng = { .seed = 5 };
    double flux_w = 0, moment[3] = { 0, 0, 0 };
    for (int i = 0; i < SIDE * SIDE; i++) {
        float *const t = texels + 4 * i;
        for (int k = 0; k < 3; k++)
            t[k] = (float)uniform(&rng, 1, 3);
        t[3] = uniform(&rng, 0, 1) < 0.3 ? 0.0f : (float)uniform(&rng, 0, 1);
        flux_w += (double)t[3];
        for (int k = 0; k < 3; k++)
            moment[k] += (double)t[3] * (double)t[k];
    }
    const double spacings_mm[] = { 1e-3, 0.5, 2, 1e3 };
    for (int s = 0; s < 4; s++) {
        struct render_light_samples samples = reduce(texels, spacings_mm[s]);
        for (int c = 0; c < 3; c++) {
            double found_w, found_moment[3];
            total(&samples, c, &found_w, found_moment);
            assert_close(found_w, flux_w * (1 << c), 1e-7, "flux, spacing %g", spacings_mm[s]);
            for (int k = 0; k < 3; k++)
                assert_close(found_moment[k], moment[k] * (1 << c), 2e-7, "moment, spacing %g",
                             spacings_mm[s]);
        }
        render_light_samples_destroy(&samples);
    }
}

/* Oracle: a plane that faces the light needs one sample for each block as wide as the spacing. */
static void a_facing_plane_gives_one_sample_per_cell(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    fill_plane(texels, 0, 0);
    const int blocks = SIDE >> LEVELS;
    struct render_light_samples samples = reduce(texels, TEXEL_MM * (1 << LEVELS));
    assert_int_equal(samples.count, blocks * blocks);
    for (size_t i = 0; i < samples.count; i++)
        assert_close((double)samples.samples[i].footprint_mm, TEXEL_MM * (1 << LEVELS), 1e-5, "sample %zu",
                     i);
    render_light_samples_destroy(&samples);
}

/* Oracle: moments of a rectangle, h^2/12 along each side and (s h)^2/12 in depth, of whole texels. A jump
 * in depth within a block counts for no more than samples may be apart. */
static void samples_know_how_far_they_are_spread(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    const double wide_mm = TEXEL_MM * (1 << LEVELS), slope = 0.5;
    fill_plane(texels, slope, 0);
    struct render_light_samples samples = reduce(texels, 2 * wide_mm);
    const double square_mm2 = wide_mm * wide_mm / 12;
    const double expected[6] = { square_mm2, square_mm2,         slope * slope * square_mm2,
                                 0,          slope * square_mm2, 0 };
    for (size_t i = 0; i < samples.count; i++) {
        for (int m = 0; m < 6; m++)
            assert_true(fabs((double)samples.samples[i].spread_mm2[m] - expected[m]) < 1e-4 * square_mm2);
    }
    render_light_samples_destroy(&samples);
    for (int i = 0; i < SIDE * SIDE; i++)
        texels[4 * i + 3] = 0; /* but for two texels of a block that share no line */
    for (int corner = 0; corner < 2; corner++) {
        float *const t = texels + (size_t)4 * (size_t)(corner * (SIDE + 1));
        t[2] = 1000.0f * (float)corner;
        t[3] = 1;
    }
    samples = reduce(texels, wide_mm);
    double trace_mm2 = 0;
    assert_int_equal(samples.count, 1);
    for (int m = 0; m < 3; m++)
        trace_mm2 += (double)samples.samples[0].spread_mm2[m];
    assert_close(trace_mm2, 0.25 * wide_mm * wide_mm, 1e-3, "bounded");
    render_light_samples_destroy(&samples);
}

/* Oracle: on a plane of slope s a block is sqrt(1 + s^2) longer along the slope, and is halved until it is
 * as short as the spacing: 2, 4, 8 samples beyond 45, 75.5, 82.8 degrees... and one just below each. */
static void a_sloped_plane_gives_more_samples(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    const double spacing_mm = TEXEL_MM * (1 << LEVELS);
    const int blocks = (SIDE >> LEVELS) * (SIDE >> LEVELS);
    const struct {
        double length; /* of a block along the slope, in spacings */
        int samples;
    } rows[] = { { 1.01, 2 }, { 1.99, 2 }, { 2.01, 4 }, { 3.99, 4 }, { 4.01, 8 }, { 20, 8 } };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double slope = sqrt(rows[i].length * rows[i].length - 1);
        fill_plane(texels, slope, 0);
        struct render_light_samples along_x = reduce(texels, spacing_mm);
        assert_int_equal(along_x.count, blocks * rows[i].samples);
        fill_plane(texels, 0, -slope);
        struct render_light_samples along_y = reduce(texels, spacing_mm);
        assert_int_equal(along_y.count, blocks * rows[i].samples);
        render_light_samples_destroy(&along_x);
        render_light_samples_destroy(&along_y);
    }
}

/* Oracle: the promise itself. On a smooth bump no patch is wider than the spacing, unless it is a texel. */
static void patches_are_no_wider_than_the_spacing(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    const double spacing_mm = 1.3;
    size_t wide_count = 0;
    fill_plane(texels, 0, 0);
    for (int i = 0; i < SIDE * SIDE; i++) {
        float *const t = texels + 4 * i;
        const double x = (double)t[0] - 8, y = (double)t[1] - 8;
        t[2] = (float)(6 * exp(-(x * x + y * y) / 18));
    }
    struct render_light_samples samples = reduce(texels, spacing_mm);
    for (size_t i = 0; i < samples.count; i++) {
        const struct render_light_sample *const sample = &samples.samples[i];
        const double texel_flux_w = TEXEL_MM * TEXEL_MM * 1.01;
        if ((double)sample->footprint_mm > spacing_mm * 1.001) {
            wide_count++;
            assert_true((double)sample->flux_w[0] < texel_flux_w);
        }
    }
    assert_true(wide_count == 0);
    assert_true(samples.count > 160 && samples.count < 1500);
    render_light_samples_destroy(&samples);
}

/* Oracle: where the surface jumps, positions on both sides must not be averaged. */
static void a_jump_is_not_bridged(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    fill_plane(texels, 0, 0);
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            if (x + y / 3 > SIDE / 2)
                texels[4 * (y * SIDE + x) + 2] = -9;
        }
    }
    struct render_light_samples samples = reduce(texels, 2);
    for (size_t i = 0; i < samples.count; i++) {
        const double z_mm = (double)samples.samples[i].position_mm[2];
        assert_true(fabs(z_mm) < 1e-6 || fabs(z_mm + 9) < 1e-6);
    }
    render_light_samples_destroy(&samples);
}

/* Oracle: merging conserves flux and its first moment, and leaves one sample for each cube. */
static void merging_conserves_flux_and_bounds_the_count(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    fill_plane(texels, 0.3, 0.1);
    struct render_light_samples fine = reduce(texels, 0.5), merged = { 0 };
    assert_true(render_light_samples_merge(&fine, 2, &merged, NULL));
    assert_true(merged.count >= 64 && merged.count < 64 * 3); /* 16 mm square in cubes of 2 mm, some cut */
    for (int c = 0; c < 3; c++) {
        double before_w, after_w, before[3], after[3];
        total(&fine, c, &before_w, before);
        total(&merged, c, &after_w, after);
        assert_close(after_w, before_w, 1e-6, "flux of channel %d", c);
        for (int k = 0; k < 3; k++)
            assert_close(after[k], before[k], 1e-6, "moment of channel %d", c);
    }
    for (size_t i = 0; i < merged.count; i++)
        assert_true((double)merged.samples[i].footprint_mm < 2 * sqrt(3) + 0.6);
    render_light_samples_destroy(&fine);
    render_light_samples_destroy(&merged);
}

/* Oracle: all pairs. Of each object and cube there is one sample; objects come one after the other. */
static void merging_leaves_one_sample_for_each_cube(void **state)
{
    (void)state;
    enum { COUNT = 3000 };
    static struct render_light_sample rows[COUNT];
    struct rng rng = { .seed = 11 };
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < 3; k++) {
            rows[i].position_mm[k] = (float)uniform(&rng, 0, i == 0 ? 0 : 40);
            rows[i].flux_w[k] = 1;
        }
        rows[i].object = (float)floor(uniform(&rng, 0, 5000)); /* more than a digit of the sort */
        rows[i].object = i % 3 ? 2 : rows[i].object;
    }
    size_t expected = 0;
    for (int i = 0; i < COUNT; i++) {
        bool is_first = true;
        for (int j = 0; j < i && is_first; j++) {
            bool is_same = rows[i].object == rows[j].object;
            for (int k = 0; k < 3; k++)
                is_same = is_same && floor((double)rows[i].position_mm[k] / 4) ==
                                         floor((double)rows[j].position_mm[k] / 4);
            is_first = !is_same;
        }
        expected += is_first;
    }
    const struct render_light_samples all = { .samples = rows, .count = COUNT };
    struct render_light_samples merged = { 0 };
    assert_true(render_light_samples_merge(&all, 4, &merged, NULL));
    assert_int_equal(merged.count, expected);
    for (size_t i = 1; i < merged.count; i++)
        assert_true(merged.samples[i].object >= merged.samples[i - 1].object);
    render_light_samples_destroy(&merged);
}

/* Oracle: one view is as good as another: a view's samples are those of its quarters, one after the other,
 * as its quadtree has them, on however many threads. */
static void quarters_come_one_after_the_other(void **state)
{
    (void)state;
    enum { HALF = SIDE / 2 };
    static float texels[4 * SIDE * SIDE], quarter[4 * HALF * HALF];
    fill_plane(texels, 1.7, -0.4);
    struct render_light_samples whole = reduce(texels, 0.8), parts = { 0 };
    for (int q = 0; q < 4; q++) {
        for (int y = 0; y < HALF; y++)
            memcpy(quarter + 4 * y * HALF, texels + 4 * ((y + q / 2 * HALF) * SIDE + q % 2 * HALF),
                   4 * HALF * sizeof *texels);
        const struct render_light_view view = { .texels = quarter,
                                                .size_px = HALF,
                                                .forward = { 0, 0, -1 },
                                                .rgb = { 1, 2, 4 },
                                                .block_px = 1 << LEVELS };
        const struct render_light_target target = { .samples = &parts, .spacing_mm = 0.8 };
        assert_true(render_light_samples_append(&target, &view, NULL));
    }
    assert_int_equal(whole.count, parts.count);
    assert_memory_equal(whole.samples, parts.samples, whole.count * sizeof *whole.samples);
    render_light_samples_destroy(&whole);
    render_light_samples_destroy(&parts);
}

/* Tiles of a whole picture, in place of drawn ones. */
struct tiles {
    const float *texels, *objects;
    int tile_px;
};

static bool copy_tile(const void *context, int x, int y, float *texels, float *objects)
{
    const struct tiles *const tiles = context;
    bool is_lit = false;
    for (int j = 0; j < tiles->tile_px; j++) {
        for (int i = 0; i < tiles->tile_px; i++) {
            const bool is_inside = x + i >= 0 && x + i < SIDE && y + j >= 0 && y + j < SIDE;
            const int from = is_inside ? (y + j) * SIDE + x + i : 0, to = j * tiles->tile_px + i;
            for (int k = 0; k < 4; k++)
                texels[4 * to + k] = is_inside ? tiles->texels[4 * from + k] : 0;
            if (objects)
                objects[to] = is_inside ? tiles->objects[from] : 0;
            is_lit |= texels[4 * to + 3] > 0;
        }
    }
    return is_lit;
}

/* Oracle: the whole picture. Drawn tile by tile it gives the same samples to the last bit, blocks of
 * whatever size, shifted by half of one or not, objects told apart or not; so does a part of it that is
 * dark. */
static void tiles_give_what_the_picture_does(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE], objects[SIDE * SIDE];
    static const int blocks_px[] = { 4, 8, 12, 20, 48, 64 };
    struct rng rng = { .seed = 8 };
    for (int round = 0; round < 24; round++) {
        fill_plane(texels, uniform(&rng, -3, 3), uniform(&rng, -3, 3));
        for (int i = 0; i < SIDE * SIDE; i++) {
            objects[i] = (float)(1 + (i % SIDE / 7 + i / SIDE / 5) % 2);
            if (i % SIDE < 20 || uniform(&rng, 0, 1) < 0.1)
                texels[4 * i + 3] = 0;
        }
        struct render_light_samples whole[2] = { { 0 }, { 0 } }, tiled[2] = { { 0 }, { 0 } };
        const struct render_light_target to_whole[2] = { { .samples = &whole[0], .spacing_mm = 0.9 },
                                                         { .samples = &whole[1], .spacing_mm = 0.6 } };
        const struct render_light_target to_tiled[2] = { { .samples = &tiled[0], .spacing_mm = 0.9 },
                                                         { .samples = &tiled[1], .spacing_mm = 0.6 } };
        const bool has_objects = round % 2 == 1;
        struct render_light_view view = { .texels = texels,
                                          .objects = has_objects ? objects : NULL,
                                          .size_px = SIDE,
                                          .block_px = blocks_px[round / 4],
                                          .forward = { 0, 0, -1 },
                                          .rgb = { 1, 2, 4 },
                                          .is_shifted = round / 2 % 2 == 1 };
        assert_true(render_light_samples_append(to_whole, &view, NULL));
        const struct tiles tiles = { texels, objects, render_light_tile_px(view.block_px) };
        view.texels = view.objects = NULL;
        view.draw_tile = copy_tile;
        view.tiles = &tiles;
        view.tile_px = tiles.tile_px;
        view.tile_object_count = has_objects ? 2 : 0;
        assert_true(render_light_samples_append(to_tiled, &view, NULL));
        for (int o = 0; o < 2; o++) {
            assert_true(whole[o].count > 20 || (o == 1 && !has_objects));
            assert_int_equal(tiled[o].count, whole[o].count);
            if (whole[o].count > 0)
                assert_memory_equal(tiled[o].samples, whole[o].samples,
                                    whole[o].count * sizeof *whole[o].samples);
            render_light_samples_destroy(&whole[o]);
            render_light_samples_destroy(&tiled[o]);
        }
    }
}

/* Oracle: no surface, no samples. */
static void an_empty_view_gives_none(void **state)
{
    (void)state;
    static float texels[4 * SIDE * SIDE];
    memset(texels, 0, sizeof texels);
    struct render_light_samples samples = reduce(texels, 1), merged = { 0 };
    assert_int_equal(samples.count, 0);
    assert_true(render_light_samples_merge(&samples, 2, &merged, NULL));
    assert_int_equal(merged.count, 0);
    render_light_samples_destroy(&samples);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flux_and_its_middle_are_conserved),
        cmocka_unit_test(a_facing_plane_gives_one_sample_per_cell),
        cmocka_unit_test(samples_know_how_far_they_are_spread),
        cmocka_unit_test(a_sloped_plane_gives_more_samples),
        cmocka_unit_test(patches_are_no_wider_than_the_spacing),
        cmocka_unit_test(a_jump_is_not_bridged),
        cmocka_unit_test(merging_conserves_flux_and_bounds_the_count),
        cmocka_unit_test(merging_leaves_one_sample_for_each_cube),
        cmocka_unit_test(quarters_come_one_after_the_other),
        cmocka_unit_test(tiles_give_what_the_picture_does),
        cmocka_unit_test(an_empty_view_gives_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
