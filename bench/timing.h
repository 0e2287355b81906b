/* Times of several things, measured in turns so that a busy moment of the machine hits all alike. */
#ifndef BENCH_TIMING_H
#define BENCH_TIMING_H

#include <stdlib.h>

enum { TIMING_ROUNDS = 41 };

static inline int timing_compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* The median of one time per round; sorts them. */
static inline double timing_median(double times[TIMING_ROUNDS])
{
    qsort(times, TIMING_ROUNDS, sizeof times[0], timing_compare);
    return times[TIMING_ROUNDS / 2];
}

#endif
