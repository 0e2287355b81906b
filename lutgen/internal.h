/* What the .c files of lutgen share. */
#ifndef LUTGEN_INTERNAL_H
#define LUTGEN_INTERNAL_H

#include "lutgen/lut.h"

#define LUT_EPSILON_MIN 1e-6
#define LUT_EPSILON_MAX 0.5

/* The power of two by which values up to max are divided so that the largest lies just below half's limit,
 * which leaves the most range below; 1 for max = 0. */
double lut_half_scale(double max);

/* The half nearest to value, ties to even; |value| at most 65504. */
double lut_half_round(double value);

#endif
