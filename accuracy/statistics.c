#include "accuracy/statistics.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

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
