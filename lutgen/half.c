/* Half floats: what they hold. */
#include "lutgen/internal.h"

#include <math.h>

static const double half_max = 65504;

double lut_half_scale(double max)
{
    if (!(max > 0))
        return 1;
    int exponent;
    frexp(max / half_max, &exponent); /* max / half_max < 2^exponent */
    const double scale = ldexp(1, exponent);
    return max <= half_max * scale / 2 ? scale / 2 : scale;
}
