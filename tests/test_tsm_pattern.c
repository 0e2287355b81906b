/* lutgen/tsm_pattern.c, tsm_sample.c: the cells and the axes of a volume. */
#include "tsm_check.h"

static const struct {
    int slices, count;
    double extent;
} designs[] = { { 16, 13, 3 }, { 32, 21, 9 }, { 64, 53, 16 }, { 128, 117, 35.72 }, { 256, 245, 28.93 } };

static double coordinate_max(const struct lut_cell *cell)
{
    double most = 0;
    for (int k = 0; k < 4; k++)
        most = fmax(most, fmax(fabs(cell->corners[k][0]), fabs(cell->corners[k][1])));
    return most;
}

/* Oracle: docs/theory.md T32 and the room that a volume has: kernel, depth factors, self-test. */
static void there_are_five_patterns(void **state)
{
    (void)state;
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    for (size_t i = 0; i < COUNT(designs); i++) {
        assert_true(lut_pattern_has(designs[i].slices));
        assert_int_equal(lut_pattern_cells(designs[i].slices, cells), designs[i].count);
        assert_true(designs[i].count + 3 <= designs[i].slices);
        assert_close(lut_pattern_extent(designs[i].slices), designs[i].extent, 1e-3, "extent %zu", i);
    }
    static const int others[] = { -1, 0, 1, 8, 21, 31, 33, 512 };
    for (size_t i = 0; i < COUNT(others); i++)
        assert_false(lut_pattern_has(others[i]));
}

/* Strictly inside a polygon that goes counter-clockwise; an edge without length has no outside. */
static bool is_inside(const struct lut_cell *cell, double u, double v)
{
    for (int k = 0; k < 4; k++) {
        const double *const a = cell->corners[k], *const b = cell->corners[(k + 1) % 4];
        if ((a[0] != b[0] || a[1] != b[1]) && (b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0]) <= 0)
            return false;
    }
    return true;
}

/* Oracle: geometry. Areas add up to the square's, and each point of it lies in one cell; an inner one if it
 * lies in the inner square. */
static void cells_tile_the_square(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    for (size_t i = 0; i < COUNT(designs); i++) {
        struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
        const int count = lut_pattern_cells(designs[i].slices, cells);
        const double extent = lut_pattern_extent(designs[i].slices);
        double area = 0;
        for (int k = 0; k < count; k++) {
            const double reach = coordinate_max(&cells[k]);
            area += cells[k].area;
            assert_int_equal(cells[k].is_inner, reach < 0.51);
            assert_int_equal(cells[k].is_outermost, reach > 0.499 * extent);
        }
        assert_close(area, extent * extent, 1e-12, "area of pattern %zu", i);
        for (int n = 0; n < 20000; n++) {
            const double side = n % 2 ? extent : 1.5;
            const double u = uniform(&rng, -0.5, 0.5) * side, v = uniform(&rng, -0.5, 0.5) * side;
            int found = 0, inner = 0;
            for (int k = 0; k < count; k++)
                if (is_inside(&cells[k], u, v)) {
                    found++;
                    inner += cells[k].is_inner;
                }
            if (found != 1 || inner != (fmax(fabs(u), fabs(v)) < 0.5))
                fail_msg("pattern %zu: (%g, %g) lies in %d cells, %d of them inner", i, u, v, found, inner);
        }
    }
}

/* Oracle: the square's symmetries; each cell's image is a cell. */
static void patterns_have_the_symmetry_of_a_square(void **state)
{
    (void)state;
    for (size_t i = 0; i < COUNT(designs); i++) {
        struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
        const int count = lut_pattern_cells(designs[i].slices, cells);
        for (int turn = 0; turn < 2; turn++) /* by a quarter; mirrored: these make all others */
            for (int k = 0; k < count; k++) {
                const double u = turn ? -cells[k].centre[1] : -cells[k].centre[0];
                const double v = turn ? cells[k].centre[0] : cells[k].centre[1];
                int found = 0;
                for (int n = 0; n < count; n++)
                    found += fabs(cells[n].centre[0] - u) < 1e-9 && fabs(cells[n].centre[1] - v) < 1e-9 &&
                             fabs(cells[n].area - cells[k].area) < 1e-9 * cells[k].area &&
                             cells[n].is_outermost == cells[k].is_outermost;
                assert_int_equal(found, 1);
            }
    }
}

/* Oracle: the mean of a triangle's or a parallelogram's corners is its centre; the square of the mip
 * level's width is the cell's area. */
static void samples_are_the_cells_centres(void **state)
{
    (void)state;
    for (size_t i = 0; i < COUNT(designs); i++) {
        struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
        struct lut_tsm lut = { .size = { 64, 64, designs[i].slices }, .inner_mm = 2.5 };
        const int count = lut_pattern_cells(designs[i].slices, cells);
        lut_tsm_samples_fill(&lut);
        assert_int_equal(lut.sample_count, count);
        for (int k = 0; k < count; k++) {
            const struct lut_tsm_sample *const sample = &lut.samples[k];
            double sum[2] = { 0, 0 };
            int corners = 0;
            for (int n = 0; n < 4; n++) {
                const double *const a = cells[k].corners[n], *const b = cells[k].corners[(n + 1) % 4];
                if (a[0] == b[0] && a[1] == b[1])
                    continue;
                sum[0] += a[0];
                sum[1] += a[1];
                corners++;
            }
            for (int axis = 0; axis < 2; axis++)
                assert_true(fabs(sample->offset_mm[axis] - 2.5 * sum[axis] / corners) < 1e-12 * 100);
            assert_close(sample->area_mm2, 6.25 * cells[k].area, 1e-14, "area of %d", k);
            assert_close(sample->width_mm * sample->width_mm, sample->area_mm2, 1e-14, "width of %d", k);
        }
    }
}

/* Oracle: the formulas of the attributes, and inverses. */
static void axes_are_what_the_attributes_say(void **state)
{
    (void)state;
    struct rng rng = { .seed = 2 };
    for (int i = 0; i < 2000; i++) {
        struct lut_tsm lut = { .size = { 8 + (int)(random_bits(&rng) % 1000),
                                         8 + (int)(random_bits(&rng) % 1000), 32 },
                               .depth_scale_mm = log_uniform(&rng, 1e-6, 1e6) };
        lut.depth_max_mm = lut.depth_scale_mm * log_uniform(&rng, 0.5, 50);
        lut.inner_mm = lut.depth_scale_mm * log_uniform(&rng, 0.5, 2);
        lut.local_depth_scale_mm = lut.inner_mm * log_uniform(&rng, 1e-3, 1);
        const double dz_mm = uniform(&rng, -1, 1) * lut.depth_max_mm;
        const double t =
            (1 + asinh(dz_mm / lut.depth_scale_mm) / asinh(lut.depth_max_mm / lut.depth_scale_mm)) / 2;
        assert_close(lut_tsm_depth_index(&lut, dz_mm), t * (lut.size[1] - 1), 1e-13, "depth index");
        /* half the range is subtracted */
        assert_true(fabs(lut_tsm_depth_mm(&lut, t * (lut.size[1] - 1)) - dz_mm) < 1e-13 * lut.depth_max_mm);
        assert_close(lut_tsm_depth_mm(&lut, 0), -lut.depth_max_mm, 1e-13, "first node");
        assert_close(lut_tsm_depth_mm(&lut, lut.size[1] - 1), lut.depth_max_mm, 1e-13, "last node");

        const double near_mm = uniform(&rng, -1, 1) * lut.inner_mm;
        const double at = (lut.size[0] - 1) * asinh(fabs(near_mm) / lut.local_depth_scale_mm) /
                          asinh(lut.inner_mm / lut.local_depth_scale_mm);
        assert_close(lut_tsm_local_depth_index(&lut, near_mm), at, 1e-13, "local index");
        assert_close(lut_tsm_local_depth_mm(&lut, at), fabs(near_mm), 1e-12, "local depth");
    }
}

/* Oracle: what is promised of a blend: 1 at 0, 0 from the end on, falling, symmetric, and without a kink at
 * either end, where the slope is less than the step. */
static void proximity_blends_without_a_kink(void **state)
{
    (void)state;
    const struct lut_tsm lut = { .inner_mm = 2 };
    assert_true(lut_tsm_proximity(&lut, 0) == 1);
    assert_true(lut_tsm_proximity(&lut, 2) == 0 && lut_tsm_proximity(&lut, 1e9) == 0);
    assert_close(lut_tsm_proximity(&lut, 1), 0.5, 1e-15, "half way");
    double before = 1;
    for (int i = 1; i <= 1000; i++) {
        const double dz_mm = 0.002 * i, here = lut_tsm_proximity(&lut, dz_mm);
        assert_true(lut_tsm_proximity(&lut, -dz_mm) == here);
        assert_true(here >= 0 && here <= before);
        assert_true(fabs(here + lut_tsm_proximity(&lut, 2 - dz_mm) - 1) < 1e-14);
        before = here;
    }
    /* two derivatives are 0: what is left is 10 x^3 */
    assert_close(1 - lut_tsm_proximity(&lut, 0.02), 10 * 0.01 * 0.01 * 0.01, 0.02, "at the start");
    assert_close(lut_tsm_proximity(&lut, 1.98), 10 * 0.01 * 0.01 * 0.01, 0.02, "at the end");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_are_five_patterns),
        cmocka_unit_test(cells_tile_the_square),
        cmocka_unit_test(patterns_have_the_symmetry_of_a_square),
        cmocka_unit_test(samples_are_the_cells_centres),
        cmocka_unit_test(axes_are_what_the_attributes_say),
        cmocka_unit_test(proximity_blends_without_a_kink),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
