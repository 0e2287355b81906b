/*
 * The profile averaged over the patch that a light sample stands for, once or twice.
 *
 * spread_mm: a Gaussian of that standard deviation, as light was spread before it was put together in the
 * sample; theory.md T79.
 *
 * blur_mm = b: samples farther apart than the profile is wide would show as dots. The average by
 * 3 G(b) - 3 G(b sqrt 2) + G(b sqrt 3), G(b) a Gaussian of standard deviation b, has the spectrum
 * 1 - (1 - e^(-(bk)^2/2))^3, which leaves coarse features alone and ends as fast as a Gaussian's;
 * theory.md T34.
 *
 * Either may be 0, not both.
 */
#ifndef RENDERER_FOOTPRINT_H
#define RENDERER_FOOTPRINT_H

#include "libdipole/dipole.h"

/* Standard deviation of the light of a sample along its patch, as part of the samples' spacing. */
#define RENDER_FOOTPRINT_SPREAD 0.212

struct render_footprint_kernel {
    double blur_mm, spread_mm;
};

/* The kernel about a point, meaned over a ring of radius s_mm whose centre is r_mm away, in 1/mm^2. */
double render_footprint_kernel_per_mm2(const struct render_footprint_kernel *kernel, double r_mm,
                                       double s_mm);

/* Aliasing of samples up to spacing_mm apart, at most, as part of the total. With a spread, samples have
 * second moments, of patches as wide as they are apart. T11, T82 */
double render_footprint_aliasing(const dipole_stack *stack, double spacing_mm,
                                 const struct render_footprint_kernel *kernel);

/* The blur that keeps aliasing at epsilon; 0 where it is less without. */
double render_footprint_blur_mm(const dipole_stack *stack, double spacing_mm, double spread_mm,
                                double epsilon);

/* The spacing at which aliasing is epsilon without a blur, of a spread that is such a part of it, or 0. */
double render_footprint_sharp_spacing_mm(const dipole_stack *stack, double epsilon, double spread);

/* What the blur changes at the edge of a shadow on a flat surface, at most, as part of the lit radiosity:
 * of means over pixel_mm, or with 0 at any point. */
double render_footprint_error(const dipole_stack *stack, double blur_mm, double pixel_mm);

/* Beyond so many times the blur lies less than 2e-6 of what is averaged: e^(-r^2/(6 b^2)). */
#define RENDER_FOOTPRINT_REACH 9

/* The spacing at which aliasing and error of the blur are epsilon each; not less than least_mm. */
double render_footprint_spacing_mm(const dipole_stack *stack, double epsilon, double spread,
                                   double least_mm, double pixel_mm);

/* Averaged profile of the lit face, tabulated out to reach_mm. One allocation; end it with free. */
struct render_footprint {
    struct render_footprint_kernel kernel;
    double step_mm, reach_mm;
    int count, ring_count;
    double *power;           /* of rings about the steps */
    double values_per_mm2[]; /* at the steps             */
};
DIPOLE_CHECKED bool render_footprint_create(const dipole_stack *stack,
                                            const struct render_footprint_kernel *kernel,
                                            struct render_footprint **footprint_out, dipole_status *status);

/* 0 <= r_mm <= reach_mm; the second is the average itself, not interpolated. */
double render_footprint_sample(const struct render_footprint *footprint, double r_mm);
double render_footprint_exact_per_mm2(const struct render_footprint *footprint, double r_mm);

/* Beyond reach_mm: the same from the profile itself at r_mm / RENDER_FOOTPRINT_STRIDE, r_mm and r_mm times
 * it. */
#define RENDER_FOOTPRINT_STRIDE 1.05
double render_footprint_far_per_mm2(const struct render_footprint *footprint, double r_mm,
                                    const double profile_per_mm2[3]);

#endif
