/* exp(-0.3 r) + exp(-0.4 r) at count radii, as fast as the compiler and the C library do it. */
#ifndef BENCH_BARE_EXP_H
#define BENCH_BARE_EXP_H

#include <stddef.h>

void bare_exp(const double *r_mm, size_t count, double *values);

#endif
