/*
 * Sources under one point of a surface: what between.c, source_fit.c and the loops share. docs/theory.md
 * T30.
 */
#ifndef LIBDIPOLE_SOURCES_H
#define LIBDIPOLE_SOURCES_H

#include "lobe.h"

#include "libdipole/dipole.h"

/*
 * Nearer to a source than its own depth, which happens off a flat surface only, its lobe would have no
 * bound. There it is continued as a parabola in t = (d/z)^2 that has the same value and slope at t = 1 and
 * is level at the source: lobe(z) (1 + b (u - u^2/2)), u = 1 - t, b = -d log lobe/dt = (3 + x^2/(1 + x))/2,
 * x = sigma_tr z. This is b; beyond x = 1400 the lobe is 0 whatever it is multiplied by.
 */
static inline double source_steepness(double x)
{
    const double y = x > 1400.0 ? 1400.0 : x;
    return 0.5 * (2.0 + y + 1.0 / (1.0 + y));
}

/* |depth| (sigma_tr + 1/d) e^(-sigma_tr d)/d^2, so continued: as a lobe, at the distance that makes the
 * hypotenuse d. */
static inline double source_lobe(const dipole_source *source, double d2_mm2)
{
    const double z = fabs(source->depth_mm), r2 = d2_mm2 - z * z;
    const double r = sqrt(r2 < 0.0 ? 0.0 : r2); /* NaN stays NaN */
    const struct dd sigma_tr = { source->sigma_tr_per_mm, source->sigma_tr_low_per_mm };
    const double distance = lobe_distance(r);
    const double u = r2 < 0.0 ? -r2 / (z * z) : 0.0;
    return lobe_value((struct dd){ z, 0.0 }, sigma_tr, distance, lobe_square(distance)) *
           (1.0 + source_steepness(source->sigma_tr_per_mm * z) * (u - 0.5 * u * u));
}

/* r_max_mm over r_min_mm. */
#define SOURCE_RANGE_LIMIT 1e6

/*
 * Fill *out with pairs of sources at +-z for the profile of the lit face, fitted from r_min_mm to r_max_mm
 * until it is measured to be within epsilon, or as near as can be. False where a value of the profile is
 * not positive; *bad_r_mm is then its radius.
 */
bool dipole_source_fit(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                       dipole_sources *out, double *bad_r_mm);

/* Largest relative error of the sources' profile, at places from r_min_mm to r_max_mm that no fit uses. */
double dipole_source_error(const dipole_stack *stack, const dipole_sources *sources, double r_min_mm,
                           double r_max_mm);

/* The loops of dipole.h, compiled for one kind of processor each; between.c picks. */
struct source_loops {
    void (*profile)(const dipole_sources *sources, double distance_mm, const double *cosines, size_t count,
                    double *values);
    void (*within)(const dipole_sources *sources, double height_mm, const double *r_mm, size_t count,
                   double *values);
};

extern const struct source_loops dipole_source_loops_portable;
#ifdef DIPOLE_HAS_AVX2
extern const struct source_loops dipole_source_loops_avx2;
#endif

#endif
