/* renderer/window/difference.c */
#include "check.h"

#include "renderer/window/difference.h"

#include <math.h>
#include <string.h>

/* Oracle: by hand. Two pixels of four are covered; the brightest channel of both is 4. */
static void numbers_are_parts_of_the_brightest(void **state)
{
    (void)state;
    const float left[16] = { 1, 2, 3, 1, 0, 0, 0, 0, 4, 1, 1, 0.5f, 9, 9, 9, 0 };
    const float right[16] = { 1, 2, 2, 1, 0, 0, 0, 0, 1, 1, 2, 0.5f, 0, 0, 0, 0 };
    struct window_difference found;
    window_difference_measure(left, right, 4, &found);
    assert_close(found.brightest, 4, 0, "brightest");
    assert_close(found.max, 0.75, 1e-15, "max");
    assert_close(found.rmse, sqrt((1 + 9 + 1) / 6.0) / 4, 1e-15, "rmse");
    assert_close(found.range, 1, 1e-15, "range");
    window_difference_measure(right, left, 4, &found);
    assert_close(found.max, 0.75, 1e-15, "the sign is left out");
}

/* Oracle: nothing differs from itself; black pictures, or none, have no brightest to divide by. */
static void edges_give_zero(void **state)
{
    (void)state;
    const float lit[4] = { 1, 2, 3, 1 }, black[4] = { 0, 0, 0, 1 };
    struct window_difference found;
    window_difference_measure(lit, lit, 1, &found);
    assert_true(found.max == 0 && found.rmse == 0 && found.range == 1e-4);
    window_difference_measure(black, black, 1, &found);
    assert_true(found.max == 0 && found.rmse == 0 && found.brightest == 0);
    window_difference_measure(lit, black, 1, &found);
    assert_true(found.max == 1 && found.rmse > 0);
    window_difference_measure(lit, black, 0, &found);
    assert_true(found.max == 0 && found.rmse == 0);
}

/* Oracle: 1, 2, 5 times a power of ten, the least that is not below; itself where the value is one. */
static void ranges_are_round(void **state)
{
    (void)state;
    static const double cases[][2] = { { 0, 1e-4 },    { 1e-9, 1e-4 }, { 1e-4, 1e-4 }, { 1.1e-4, 2e-4 },
                                       { 0.02, 0.02 }, { 0.3, 0.5 },   { 0.5, 0.5 },   { 0.51, 1 },
                                       { 1, 1 },       { 7, 10 },      { 99, 100 } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_close(window_difference_range(cases[i][0]), cases[i][1], 1e-12, "%g", cases[i][0]);
    struct rng rng = { .seed = 4 };
    for (int i = 0; i < 1000; i++) {
        const double value = log_uniform(&rng, 1e-4, 100), range = window_difference_range(value);
        assert_true(range >= value * (1 - 1e-12) && range <= 2.5 * value * (1 + 1e-12));
    }
}

static double lightness(const float rgb[3])
{
    return 0.2126 * pow((double)rgb[0], 2.2) + 0.7152 * pow((double)rgb[1], 2.2) +
           0.0722 * pow((double)rgb[2], 2.2);
}

/* Oracle: a diverging scale is lightest in the middle, darker to either side, blue and red at its ends. */
static void colours_diverge_from_the_middle(void **state)
{
    (void)state;
    float before[3], rgb[3];
    window_difference_colour(0, before);
    assert_true(before[0] == before[1] && before[1] == before[2] && before[0] > 0.9f);
    for (int sign = -1; sign <= 1; sign += 2) {
        window_difference_colour(0, before);
        for (int i = 1; i <= 100; i++) {
            window_difference_colour(sign * i / 100.0, rgb);
            assert_true(lightness(rgb) < lightness(before));
            assert_true(sign < 0 ? rgb[2] > rgb[0] : rgb[0] > rgb[2]);
            memcpy(before, rgb, sizeof rgb);
        }
        window_difference_colour(sign * 7.0, rgb);
        assert_memory_equal(rgb, before, sizeof rgb);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_parts_of_the_brightest),
        cmocka_unit_test(edges_give_zero),
        cmocka_unit_test(ranges_are_round),
        cmocka_unit_test(colours_diverge_from_the_middle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
