#include "renderer/gloss.h"

#include "libdipole/dipole.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Angles between light and eye; normals on either side of the half vector. */
enum { ANGLES = 8, NORMALS = 24 };

double render_ggx_per_sr(double roughness, double cosine_half, double cosine_in, double cosine_out)
{
    const double a2 = roughness * roughness;
    const double d = 1 + cosine_half * cosine_half * (a2 - 1);
    const double distribution = a2 / (PI * d * d);
    const double smith_in = cosine_out * sqrt(a2 + (1 - a2) * cosine_in * cosine_in);
    const double smith_out = cosine_in * sqrt(a2 + (1 - a2) * cosine_out * cosine_out);
    return distribution * 0.5 * cosine_in / (smith_in + smith_out);
}

/* Over normals in the plane of both ways, among which the most is. */
static double most_at(double roughness, double apart_rad)
{
    const double half_rad = 0.5 * apart_rad, limit_rad = 0.5 * PI - half_rad;
    double most = 0;
    for (int n = -NORMALS; n <= NORMALS; n++) {
        const double tilt_rad = limit_rad * n / NORMALS; /* from the half vector to the light */
        const double cosine_in = fmax(cos(half_rad - tilt_rad), 1e-9),
                     cosine_out = fmax(cos(half_rad + tilt_rad), 1e-9);
        most = fmax(most, render_ggx_per_sr(roughness, cos(tilt_rad), cosine_in, cosine_out));
    }
    return most;
}

double render_gloss_most_per_sr(double eta, double roughness, double least_rad, double most_rad)
{
    double most = 0, before = most_at(roughness, least_rad);
    for (int i = 1; i <= ANGLES; i++) {
        const double apart_rad = least_rad + (most_rad - least_rad) * i / ANGLES;
        const double here = most_at(roughness, apart_rad);
        /* reflectance grows with the angle */
        most = fmax(most, dipole_fresnel_reflectance(eta, cos(0.5 * apart_rad)) * fmax(before, here));
        before = here;
    }
    return most;
}
