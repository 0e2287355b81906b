#include "accuracy/statistics.h"

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
