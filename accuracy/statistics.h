/* Of measured numbers. */
#ifndef ACCURACY_STATISTICS_H
#define ACCURACY_STATISTICS_H

#include <stddef.h>

/* For qsort: doubles, least first. */
int accuracy_compare_numbers(const void *a, const void *b);

/* Sorts them. The mean of the two in the middle of an even count; NAN of none. */
double accuracy_median(double *values, size_t count);

/* The middle of measured times, and how far they spread. */
struct accuracy_spread {
    double median, low, high; /* quartiles; 0 of none */
};
/* Of up to ACCURACY_REPEAT_LIMIT. */
struct accuracy_spread accuracy_spread_of(const double *values, size_t count);

/*
 * How many times as long it takes to halve an error: 2^-p of t ~ error^p, by least squares of logarithms
 * over points with error > 0. NAN where there are fewer than two, or their errors are within a factor of
 * 1.5.
 */
double accuracy_halving_of(const double *errors, const double *times, size_t count);

struct accuracy_line {
    double intercept, slope;
};

enum { ACCURACY_LINE_POINTS = 64, ACCURACY_REPEAT_LIMIT = 32 };

/* y = intercept + slope x, both at least 0, of up to ACCURACY_LINE_POINTS points with x and y > 0: the line
 * with the least sum of |line - y|/y, so that points far off hardly move it. Of intercepts the parts 0,
 * 1/32, 2/32 ... of the least y are tried. */
struct accuracy_line accuracy_fit_line(const double *x, const double *y, size_t count);

#endif
