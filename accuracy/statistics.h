/* Of measured numbers. */
#ifndef ACCURACY_STATISTICS_H
#define ACCURACY_STATISTICS_H

#include <stddef.h>

/* For qsort: doubles, least first. */
int accuracy_compare_numbers(const void *a, const void *b);

/* Sorts them. The mean of the two in the middle of an even count; NAN of none. */
double accuracy_median(double *values, size_t count);

#endif
