/* What the .c files of libdipole share; never installed. */
#ifndef LIBDIPOLE_INTERNAL_H
#define LIBDIPOLE_INTERNAL_H

#include "libdipole/dipole.h"

#include <math.h>

#define PI 3.14159265358979323846

static inline double square(double x)
{
    return x * x;
}

/* z_v - z_r = (4/3) A z_r, without the cancellation of subtracting. */
static inline double source_separation_mm(const dipole_coefficients *c)
{
    return 4.0 / 3.0 * c->boundary_a * c->z_r_mm;
}

/* hypot(z, r) - z, without the cancellation of subtracting. */
static inline double path_excess_mm(double z_mm, double r_mm)
{
    return r_mm * (r_mm / (hypot(z_mm, r_mm) + z_mm));
}

#endif
