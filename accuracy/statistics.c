#include "accuracy/statistics.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int accuracy_compare_numbers(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double accuracy_median(double *values, size_t count)
{
    qsort(values, count, sizeof *values, accuracy_compare_numbers);
    return count > 0 ? 0.5 * (values[(count - 1) / 2] + values[count / 2]) : (double)NAN;
}

struct accuracy_spread accuracy_spread_of(const double *values, size_t count)
{
    double sorted[ACCURACY_REPEAT_LIMIT];
    assert(count <= ACCURACY_REPEAT_LIMIT);
    if (count == 0)
        return (struct accuracy_spread){ .median = 0 };
    memcpy(sorted, values, count * sizeof *sorted);
    const double median = accuracy_median(sorted, count);
    return (struct accuracy_spread){ median, sorted[count / 4], sorted[count - 1 - count / 4] };
}

double accuracy_halving_of(const double *errors, const double *times, size_t count)
{
    double used = 0, x_sum = 0, y_sum = 0, xx_sum = 0, xy_sum = 0, least = INFINITY, most = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(errors[i] > 0))
            continue;
        const double x = log(errors[i]), y = log(times[i]);
        used++;
        x_sum += x;
        y_sum += y;
        xx_sum += x * x;
        xy_sum += x * y;
        least = fmin(least, errors[i]);
        most = fmax(most, errors[i]);
    }
    if (used < 2 || most < 1.5 * least)
        return NAN;
    return pow(2, -(used * xy_sum - x_sum * y_sum) / (used * xx_sum - x_sum * x_sum));
}

enum { INTERCEPTS = 32 };

struct weighted {
    double value, weight;
};

static int compare_weighted(const void *a, const void *b)
{
    return accuracy_compare_numbers(&((const struct weighted *)a)->value,
                                    &((const struct weighted *)b)->value);
}

/* Of the slopes the one with the least error is the median of those through each point, its weight x/y. */
static double best_slope(const double *x, const double *y, size_t count, double intercept)
{
    struct weighted slopes[ACCURACY_LINE_POINTS];
    double half = 0;
    for (size_t i = 0; i < count; i++) {
        slopes[i] = (struct weighted){ (y[i] - intercept) / x[i], x[i] / y[i] };
        half += 0.5 * slopes[i].weight;
    }
    qsort(slopes, count, sizeof *slopes, compare_weighted);
    size_t middle = 0;
    for (double sum = slopes[0].weight; sum < half && middle + 1 < count; sum += slopes[middle].weight)
        middle++;
    return slopes[middle].value;
}

struct accuracy_line accuracy_fit_line(const double *x, const double *y, size_t count)
{
    struct accuracy_line best = { .slope = 1 };
    double least_y = INFINITY, least_error = INFINITY;
    assert(count <= ACCURACY_LINE_POINTS);
    for (size_t i = 0; i < count; i++)
        least_y = fmin(least_y, y[i]);
    for (int part = 0; part < INTERCEPTS && count > 0; part++) {
        struct accuracy_line line = { .intercept = least_y * part / INTERCEPTS };
        double error = 0;
        line.slope = best_slope(x, y, count, line.intercept);
        for (size_t i = 0; i < count; i++)
            error += fabs(line.intercept + line.slope * x[i] - y[i]) / y[i];
        if (error < least_error) {
            least_error = error;
            best = line;
        }
    }
    return best;
}
