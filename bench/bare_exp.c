/* As many exponentials as a batch takes, and nothing else: what the compiler makes of exp() in a loop. It
 * is compiled with -ffast-math, which lets it call the C library's vector version. */
#include "bench/bare_exp.h"

#include <math.h>

void bare_exp(const double *r_mm, size_t count, double *values)
{
    for (size_t i = 0; i < count; i++)
        values[i] = exp(-0.3 * r_mm[i]) + exp(-0.4 * r_mm[i]);
}
