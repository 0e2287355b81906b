/* renderer/transmittance.c: light that is left along a ray. */
#include "check.h"
#include "renderer/blocker.h"
#include "renderer/transmittance.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 10000 };

static struct render_segment segments[MOST];
static struct render_node_event events[3 * MOST];
static struct render_node nodes[3 * MOST];
static double areas[3 * MOST];

static struct render_segment grey(double z0_mm, double ze_mm, double alpha)
{
    return (struct render_segment){ .z0_mm = z0_mm, .ze_mm = ze_mm, .alpha = { alpha, alpha, alpha } };
}

/* Sheets and solids, overlapping, some opaque, some of a colour, some that begin where others end. */
static size_t random_segments(struct rng *rng, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const double z0_mm =
            random_bits(rng) % 4 == 0 && i > 0 ? segments[i - 1].ze_mm : uniform(rng, 0, 10);
        const double length_mm = random_bits(rng) % 2 ? 0 : log_uniform(rng, 1e-6, 5);
        segments[i] = (struct render_segment){ .z0_mm = z0_mm, .ze_mm = z0_mm + length_mm };
        for (int c = 0; c < 3; c++) {
            const uint64_t kind = random_bits(rng) % 20;
            segments[i].alpha[c] = kind == 0   ? 0
                                   : kind == 1 ? 1
                                   : kind == 2 ? 1 - log_uniform(rng, 1e-16, 1e-3)
                                               : log_uniform(rng, 1e-6, 0.7);
        }
    }
    return count;
}

/* What each segment leaves by itself, multiplied. */
static double left_by_product(size_t count, double z_mm, int channel)
{
    double left = 1;
    for (size_t i = 0; i < count; i++) {
        const struct render_segment *const s = &segments[i];
        if (z_mm < s->z0_mm)
            continue;
        const double part = s->ze_mm > s->z0_mm ? fmin((z_mm - s->z0_mm) / (s->ze_mm - s->z0_mm), 1) : 1;
        if (part == 0 && s->alpha[channel] < 1)
            continue;
        left *= part == 0 ? 1 - s->alpha[channel]
                          : 1 - s->alpha[channel] * render_blocker_part(s->alpha[channel], part);
    }
    return left;
}

static void check_falls(const struct render_node *found, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++) {
            assert_true(found[i].left[c] >= 0 && found[i].left[c] <= 1);
            assert_true(i == 0 ||
                        (found[i].left[c] <= found[i - 1].left[c] && found[i].z_mm >= found[i - 1].z_mm));
        }
    }
}

/* Oracle: the product over all blockers, each by itself. */
static void curve_is_the_product_of_blockers(void **state)
{
    (void)state;
    struct rng rng = { .seed = 63 };
    for (int i = 0; i < 300; i++) {
        const size_t count = random_segments(&rng, 1 + random_bits(&rng) % 40);
        const size_t node_count = render_transmittance_build(segments, count, events, nodes);
        check_falls(nodes, node_count);
        for (int k = 0; k < 40; k++) {
            const double z_mm = uniform(&rng, -1, 16);
            for (int c = 0; c < 3; c++) {
                const double expected = left_by_product(count, z_mm, c);
                /* rates of up to 37 in 1e-6 mm are added up and come off again: 1e-16 of them is left */
                assert_true(fabs(render_transmittance_at(nodes, node_count, z_mm, c) - expected) <
                            1e-6 * expected + 1e-14);
            }
        }
    }
}

/* Oracle: what stands in the segments. A sheet is a step, also at the depth itself. */
static void single_blockers_are_as_given(void **state)
{
    (void)state;
    double mean_mm = -1;
    segments[0] = grey(2, 2, 0.25);
    size_t count = render_transmittance_build(segments, 1, events, nodes);
    assert_int_equal(count, 2);
    assert_true(render_transmittance_at(nodes, count, 1.999, 0) == 1);
    assert_close(render_transmittance_at(nodes, count, 2, 0), 0.75, 1e-15, "behind the sheet");
    assert_true(render_transmittance_blocked(nodes, count, 2, 0, &mean_mm) == 0 && mean_mm == -1);
    assert_close(render_transmittance_blocked(nodes, count, 3, 0, &mean_mm), 0.25, 1e-15, "by the sheet");
    assert_true(mean_mm == 2);
    segments[0] = grey(2, 6, 0.75);
    count = render_transmittance_build(segments, 1, events, nodes);
    assert_int_equal(count, 2);
    assert_close(render_transmittance_at(nodes, count, 4, 1), 0.5, 1e-15, "half of the optical depth");
    assert_close(render_transmittance_blocked(nodes, count, 9, 1, &mean_mm), 0.75, 1e-15, "by the solid");
    assert_close(mean_mm, render_blocker_half_mm(2, 6, 0.75), 1e-15, "its half depth");
    assert_close(render_transmittance_blocked(nodes, count, 4, 1, &mean_mm), 0.5, 1e-15,
                 "by its first half");
    assert_close(mean_mm, render_blocker_half_mm(2, 4, 0.5), 1e-15, "half depth of that");
}

/* Oracle: the sum over sheets by hand, Delta_i = alpha_i prod (1 - alpha_j), z_TF = sum Delta z / sum
 * Delta. */
static void blocked_light_is_where_sheets_are(void **state)
{
    (void)state;
    struct rng rng = { .seed = 64 };
    for (int i = 0; i < 100; i++) {
        const size_t count = 1 + random_bits(&rng) % 20;
        double z_mm = 0, left = 1, blocked = 0, moment = 0, mean_mm = 0;
        for (size_t k = 0; k < count; k++) {
            const double alpha = uniform(&rng, 0.01, 0.5);
            z_mm += uniform(&rng, 0.1, 1);
            segments[k] = grey(z_mm, z_mm, alpha);
            blocked += alpha * left;
            moment += alpha * left * z_mm;
            left *= 1 - alpha;
        }
        const size_t node_count = render_transmittance_build(segments, count, events, nodes);
        assert_close(render_transmittance_blocked(nodes, node_count, 1e9, 2, &mean_mm), blocked, 1e-12,
                     "case %d", i);
        assert_close(mean_mm, moment / blocked, 1e-12, "case %d", i);
    }
}

/* Oracle: invariants. What is asked is kept; the ends, and so what all blockers leave together, never
 * change. */
static void compression_keeps_the_curve_falling(void **state)
{
    (void)state;
    struct rng rng = { .seed = 65 };
    static struct render_node few[3 * MOST];
    static const size_t limits[] = { 2, 4, 8, 16, 1000 };
    double error_mm[5] = { 0 };
    for (int i = 0; i < 100; i++) {
        const size_t count = random_segments(&rng, 1 + random_bits(&rng) % 60);
        const size_t node_count = render_transmittance_build(segments, count, events, nodes);
        for (int l = 0; l < 5 && node_count > 0; l++) {
            memcpy(few, nodes, node_count * sizeof *nodes);
            const size_t left = render_transmittance_compress(few, node_count, limits[l], areas);
            assert_true(left <= limits[l] && left <= node_count);
            check_falls(few, left);
            assert_memory_equal(&few[0], &nodes[0], sizeof *nodes);
            assert_memory_equal(&few[left - 1], &nodes[node_count - 1], sizeof *nodes);
            for (int c = 0; c < 3; c++)
                error_mm[l] += fabs(render_transmittance_area_mm(few, left, c) -
                                    render_transmittance_area_mm(nodes, node_count, c));
            if (limits[l] >= node_count)
                assert_memory_equal(few, nodes, node_count * sizeof *nodes);
        }
    }
    assert_true(error_mm[0] > error_mm[1] && error_mm[1] > error_mm[2] && error_mm[2] > error_mm[3]);
    assert_true(error_mm[4] == 0);
    print_message("  mean error of the area, %% of the way: 2 nodes %.2f, 4: %.2f, 8: %.2f, 16: %.3f\n",
                  error_mm[0] / 30, error_mm[1] / 30, error_mm[2] / 30, error_mm[3] / 30);
}

/* Oracle: by hand. The node whose going changes the area least is the one on the line. */
static void the_least_node_goes(void **state)
{
    (void)state;
    struct render_node line[4] = {
        { 0, { 1, 1, 1 } }, { 1, { 0.5, 0.5, 0.5 } }, { 2, { 0.25, 0.25, 0.25 } }, { 3, { 0.2, 0.2, 0.2 } }
    };
    assert_int_equal(render_transmittance_compress(line, 4, 3, areas), 3);
    assert_true(line[1].z_mm == 2 && line[2].z_mm == 3); /* 0.25 lies on the way from 1 to 0.5 carried on */
}

/* Oracle: what the words say. Nothing is NaN, whatever is in the way. */
static void hard_blockers_give_numbers(void **state)
{
    (void)state;
    double mean_mm = -1;
    /* nothing blocks */
    segments[0] = grey(1, 2, 0);
    segments[1] = grey(3, 3, 0);
    assert_int_equal(render_transmittance_build(segments, 2, events, nodes), 0);
    assert_true(render_transmittance_at(nodes, 0, 5, 0) == 1);
    assert_true(render_transmittance_blocked(nodes, 0, 5, 0, &mean_mm) == 0 && mean_mm == -1);
    assert_int_equal(render_transmittance_compress(nodes, 0, 8, areas), 0);
    /* an opaque solid blocks where it begins */
    segments[0] = grey(1, 2, 1);
    size_t count = render_transmittance_build(segments, 1, events, nodes);
    assert_true(render_transmittance_at(nodes, count, 1, 0) == 0 &&
                render_transmittance_at(nodes, count, 0.999, 0) == 1);
    assert_true(render_transmittance_blocked(nodes, count, 1.5, 0, &mean_mm) == 1 && mean_mm == 1);
    /* one channel opaque, one clear, one between */
    segments[0] = (struct render_segment){ 1, 3, { 1, 0, 0.75 } };
    count = render_transmittance_build(segments, 1, events, nodes);
    assert_true(render_transmittance_at(nodes, count, 2, 0) == 0 &&
                render_transmittance_at(nodes, count, 2, 1) == 1);
    assert_close(render_transmittance_at(nodes, count, 2, 2), 0.5, 1e-15, "between");
    /* a solid as thin as nothing, and two blockers at the same place */
    segments[0] = grey(1, 1 + 0x1p-52, 0.5);
    segments[1] = segments[2] = grey(1, 1, 0.5);
    count = render_transmittance_build(segments, 3, events, nodes);
    assert_close(render_transmittance_at(nodes, count, 2, 0), 0.125, 1e-12, "three halves");
    assert_close(render_transmittance_blocked(nodes, count, 2, 0, &mean_mm), 0.875, 1e-12, "the rest");
    assert_close(mean_mm, 1, 1e-15, "there");
}

/* Oracle: the closed form 0.999^10000 and the mean depth of a geometric series; the invariants of
 * compression. */
static void ten_thousand_layers_in_one_texel(void **state)
{
    (void)state;
    double mean_mm = 0, expected_mm = 0, left = 1;
    for (int i = 0; i < MOST; i++) {
        segments[i] = grey(1 + 1e-3 * (MOST - 1 - i), 1 + 1e-3 * (MOST - 1 - i), 1e-3);
        expected_mm += left * 1e-3 * (1 + 1e-3 * i);
        left *= 1 - 1e-3;
    }
    size_t count = render_transmittance_build(segments, MOST, events, nodes);
    assert_int_equal(count, 2 * MOST);
    assert_close(render_transmittance_at(nodes, count, 100, 0), pow(0.999, MOST), 1e-10, "behind all");
    render_transmittance_blocked(nodes, count, 100, 0, &mean_mm);
    assert_close(mean_mm, expected_mm / (1 - left), 1e-10, "mean depth");
    count = render_transmittance_compress(nodes, count, 8, areas);
    assert_int_equal(count, 8);
    check_falls(nodes, count);
    assert_close(render_transmittance_at(nodes, count, 100, 0), pow(0.999, MOST), 1e-10,
                 "behind all, compressed");
    /* layers so near to each other are a solid: its curve has two nodes */
    for (int i = 0; i < 100; i++) {
        const double z_mm = 1 + 0.1 * i;
        assert_true(fabs(render_transmittance_at(nodes, count, z_mm, 0) - pow(0.999, 100 * i)) < 0.02);
    }
}

/* Oracle: the limit of n thin sheets of the same optical depth in all. Half absorption is their median, so
 * it is nearer to their mean than the middle is, for every alpha. */
static void half_depth_stands_for_many_sheets(void **state)
{
    (void)state;
    enum { SHEETS = 4000 };
    for (int i = 1; i < 20; i++) {
        const double alpha = 0.05 * i, each = -expm1(log1p(-alpha) / SHEETS);
        double mean_mm = 0;
        for (int k = 0; k < SHEETS; k++)
            segments[k] = grey(2 + 4 * (k + 0.5) / SHEETS, 2 + 4 * (k + 0.5) / SHEETS, each);
        const size_t count = render_transmittance_build(segments, SHEETS, events, nodes);
        const double blocked = render_transmittance_blocked(nodes, count, 10, 0, &mean_mm);
        assert_close(blocked, alpha, 1e-9, "alpha %g", alpha);
        assert_true(fabs(render_blocker_half_mm(2, 6, alpha) - mean_mm) < fabs(4 - mean_mm));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curve_is_the_product_of_blockers),
        cmocka_unit_test(single_blockers_are_as_given),
        cmocka_unit_test(blocked_light_is_where_sheets_are),
        cmocka_unit_test(compression_keeps_the_curve_falling),
        cmocka_unit_test(the_least_node_goes),
        cmocka_unit_test(hard_blockers_give_numbers),
        cmocka_unit_test(ten_thousand_layers_in_one_texel),
        cmocka_unit_test(half_depth_stands_for_many_sheets),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
