/* accuracy/statistics.c: medians, and the lines that times are predicted by. */
#include "check.h"

#include "accuracy/statistics.h"

#include <math.h>

static void medians_are_in_the_middle(void **state)
{
    (void)state;
    double odd[] = { 3, 1, 2 }, even[] = { 4, 1, 3, 2 };
    assert_close(accuracy_median(odd, 3), 2, 0, "odd");
    assert_close(accuracy_median(even, 4), 2.5, 0, "even");
    assert_true(isnan(accuracy_median(odd, 0)));
}

/* Oracle: the line the points were taken from. Its intercept is one of those tried: 1/4 of the least y. Two
 * points of ten are far off, and change nothing. */
static void lines_pass_by_what_is_far_off(void **state)
{
    (void)state;
    double x[10], y[10];
    for (int i = 0; i < 10; i++) {
        x[i] = exp2(i);
        y[i] = 1 + 3 * x[i];
    }
    struct accuracy_line line = accuracy_fit_line(x, y, 10);
    assert_close(line.intercept, 1, 1e-12, "intercept");
    assert_close(line.slope, 3, 1e-12, "slope");
    y[4] *= 7;
    y[8] *= 0.2;
    line = accuracy_fit_line(x, y, 10);
    assert_close(line.intercept, 1, 1e-12, "intercept, two off");
    assert_close(line.slope, 3, 1e-12, "slope, two off");
}

/* Oracle: no line that was looked for by brute force has a lesser sum of relative errors. */
static void no_line_is_nearer(void **state)
{
    (void)state;
    static const double x[] = { 1, 2, 3, 5, 8, 13, 21 }, y[] = { 2.1, 2.4, 5, 4.4, 9.1, 11, 25 };
    enum { COUNT = sizeof x / sizeof *x };
    const struct accuracy_line line = accuracy_fit_line(x, y, COUNT);
    double error = 0, least = INFINITY;
    for (int i = 0; i < COUNT; i++)
        error += fabs(line.intercept + line.slope * x[i] - y[i]) / y[i];
    for (int a = 0; a < 64; a++) {
        for (int b = 0; b < 4000; b++) {
            double sum = 0;
            for (int i = 0; i < COUNT; i++)
                sum += fabs(a / 32.0 + 1e-3 * b * x[i] - y[i]) / y[i];
            least = fmin(least, sum);
        }
    }
    assert_true(error <= 1.01 * least);
}

/* One point is on the line through 0; none leaves predictions as they are. */
static void few_points_make_lines_too(void **state)
{
    (void)state;
    const double x = 2, y = 5;
    const struct accuracy_line one = accuracy_fit_line(&x, &y, 1), none = accuracy_fit_line(&x, &y, 0);
    assert_close(one.intercept, 0, 0, "intercept of one");
    assert_close(one.slope, 2.5, 1e-15, "slope of one");
    assert_close(none.intercept, 0, 0, "intercept of none");
    assert_close(none.slope, 1, 0, "slope of none");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(medians_are_in_the_middle),
        cmocka_unit_test(lines_pass_by_what_is_far_off),
        cmocka_unit_test(no_line_is_nearer),
        cmocka_unit_test(few_points_make_lines_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
