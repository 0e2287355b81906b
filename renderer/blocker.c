#include "renderer/blocker.h"

#include <math.h>

double render_blocker_alpha(double extinction_per_mm, double length_mm)
{
    if (extinction_per_mm == 0 || length_mm == 0)
        return 0; /* also where the other one is infinite */
    return -expm1(-extinction_per_mm * length_mm);
}

double render_blocker_part(double alpha, double part)
{
    if (part <= 0 || alpha <= 0)
        return part < 0 ? 0 : part > 1 ? 1 : alpha > 0 ? 0 : part;
    if (part >= 1 || alpha >= 1)
        return 1;
    return expm1(part * log1p(-alpha)) / -alpha;
}

double render_blocker_half_mm(double z0_mm, double ze_mm, double alpha)
{
    if (alpha >= 1)
        return z0_mm;
    /* half of the smallest doubles is no double any more */
    const double part = alpha > 1e-300 ? log1p(-alpha / 2) / log1p(-alpha) : 0.5;
    const double half_mm = z0_mm + (ze_mm - z0_mm) * part;
    return half_mm < ze_mm ? half_mm : ze_mm;
}

double render_blocker_mean_left(double alpha)
{
    if (alpha <= 0)
        return 1;
    return alpha < 1 ? -alpha / log1p(-alpha) : 0;
}

double render_penumbra_mm(double receiver_mm, double blocker_mm, double size_mm)
{
    return receiver_mm > blocker_mm ? (receiver_mm - blocker_mm) / blocker_mm * size_mm : 0;
}

double render_penumbra_of_parallel_mm(double receiver_mm, double blocker_mm, double angle_rad)
{
    return receiver_mm > blocker_mm ? (receiver_mm - blocker_mm) * 2 * tan(angle_rad / 2) : 0;
}
