/* renderer/shadow_taps.c: places that soft shadows look at. */
#include "check.h"
#include "renderer/shadow_taps.h"

#define PI 3.14159265358979323846

enum { MOST = 128 };

/* Root mean square, over lines that cross the disc anywhere, of what the part of the places beyond a line
 * is off the part of the area. */
static double discrepancy(int count, const double (*places)[2])
{
    enum { ANGLES = 60, OFFSETS = 101 };
    double sum2 = 0;
    for (int a = 0; a < ANGLES; a++) {
        const double x = cos(2 * PI * a / ANGLES + 0.001), y = sin(2 * PI * a / ANGLES + 0.001);
        for (int o = 0; o < OFFSETS; o++) {
            const double at = -1 + 2.0 * o / (OFFSETS - 1);
            double beyond = 0;
            for (int i = 0; i < count; i++)
                beyond += places[i][0] * x + places[i][1] * y > at;
            sum2 += pow(beyond / count - (acos(at) - at * sqrt(1 - at * at)) / PI, 2);
        }
    }
    return sqrt(sum2 / (ANGLES * OFFSETS));
}

/* Oracle: the disc. Middle, mean of the squared radius, and no two so near each other as the side of a
 * square of two fifths of a tap's area. */
static void places_are_spread_over_the_disc(void **state)
{
    (void)state;
    static const int counts[] = { 1, 2, 4, 9, 16, 25, 49, 64, 100, MOST };
    static double places[MOST][2], again[MOST][2];
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        const int count = counts[c];
        double sum[2] = { 0, 0 }, radius2 = 0, least = INFINITY;
        assert_true(render_shadow_taps(count, places, NULL));
        assert_true(render_shadow_taps(count, again, NULL));
        assert_memory_equal(places, again, (size_t)count * sizeof *places);
        for (int i = 0; i < count; i++) {
            const double from2 = places[i][0] * places[i][0] + places[i][1] * places[i][1];
            assert_true(from2 < 1);
            radius2 += from2 / count;
            for (int k = 0; k < 2; k++)
                sum[k] += places[i][k] / count;
            for (int j = 0; j < i; j++)
                least = fmin(least, hypot(places[i][0] - places[j][0], places[i][1] - places[j][1]));
        }
        assert_true(hypot(sum[0], sum[1]) < 0.015);
        assert_true(fabs(radius2 - 0.5 * (1 - 1.0 / count)) <
                    0.005 + 0.2 / count); /* less the parts' own */
        if (count > 1)
            assert_true(least > sqrt(0.4 * PI / count));
    }
}

/* Oracle: the spiral, from which they are relaxed: less of an edge is missed. At 25 taps 12 % less. */
static void edges_are_met_better_than_by_the_spiral(void **state)
{
    (void)state;
    static const int counts[] = { 4, 9, 16, 25, 49, 100 };
    static double relaxed[MOST][2], spiral[MOST][2];
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        assert_true(render_shadow_taps(counts[c], relaxed, NULL));
        render_shadow_spiral(counts[c], spiral);
        const double ratio = discrepancy(counts[c], (const double(*)[2])relaxed) /
                             discrepancy(counts[c], (const double(*)[2])spiral);
        print_message("  %d taps: %.3f of the spiral's\n", counts[c], ratio);
        assert_true(ratio < 0.97);
    }
    render_shadow_spiral(1, spiral);
    assert_true(hypot(spiral[0][0], spiral[0][1]) < 1);
}

/* Oracle: the spiral itself, where relaxing would take long and no longer matters. */
static void very_many_are_the_spiral(void **state)
{
    (void)state;
    static double taps[300][2], spiral[300][2];
    assert_true(render_shadow_taps(300, taps, NULL));
    render_shadow_spiral(300, spiral);
    assert_memory_equal(taps, spiral, sizeof taps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_are_spread_over_the_disc),
        cmocka_unit_test(edges_are_met_better_than_by_the_spiral),
        cmocka_unit_test(very_many_are_the_spiral),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
