/* A sphere's radiosity by a quadrature that knows neither light view nor mesh. */
#ifndef SPHERE_ORACLE_H
#define SPHERE_ORACLE_H

#include "libdipole/dipole.h"

#include <math.h>
#include <string.h>

enum { SPHERE_POINTS = 30000 };

/* Radiosity at a point of a sphere lit from the direction toward_light, channel by channel: the integral
 * over the lit hemisphere on a Fibonacci lattice, which is uniform in area to better than 0.1 %. */
static inline void sphere_radiosity(const double position_mm[3], double radius_mm,
                                    const double toward_light[3], double irradiance,
                                    const dipole_coefficients k[3], double radiosity[3])
{
    const double pi = acos(-1), golden_rad = pi * (3 - sqrt(5));
    const double area_mm2 = 4 * pi * radius_mm * radius_mm / SPHERE_POINTS;
    memset(radiosity, 0, 3 * sizeof *radiosity);
    for (int i = 0; i < SPHERE_POINTS; i++) {
        const double z = 1 - (2 * i + 1.0) / SPHERE_POINTS, rho = sqrt(1 - z * z);
        const double n[3] = { rho * cos(golden_rad * i), rho * sin(golden_rad * i), z };
        const double cosine = n[0] * toward_light[0] + n[1] * toward_light[1] + n[2] * toward_light[2];
        if (cosine <= 0)
            continue;
        const double flux_w =
            irradiance * cosine * area_mm2 * (1 - dipole_fresnel_reflectance(k[0].eta, cosine));
        double r2 = 0;
        for (int a = 0; a < 3; a++) {
            const double d = position_mm[a] - radius_mm * n[a];
            r2 += d * d;
        }
        for (int c = 0; c < 3; c++)
            radiosity[c] += flux_w * dipole_rd_per_mm2(&k[c], sqrt(r2));
    }
}

#endif
