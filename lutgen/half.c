/* Half floats: what they hold. */
#include "lutgen/internal.h"

#include <math.h>

static const double half_max = 65504, half_min_normal = 0x1p-14;

double lut_half_scale(double max)
{
    if (!(max > 0))
        return 1;
    int exponent;
    frexp(max / half_max, &exponent); /* max / half_max < 2^exponent */
    const double scale = ldexp(1, exponent);
    return max <= half_max * scale / 2 ? scale / 2 : scale;
}

double lut_half_round(double value)
{
    int exponent; /* subnormals keep the step of the smallest normal */
    frexp(fmax(fabs(value), half_min_normal), &exponent);
    const double step = ldexp(1, exponent - 11);
    return nearbyint(value / step) * step;
}
