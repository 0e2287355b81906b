/* Splat tables: the profile of a material over [0, r_max] for a renderer, with its measured error. */
#ifndef LUTGEN_LUT_H
#define LUTGEN_LUT_H

#include "io/exr.h"
#include "io/material_file.h"

/*
 * Axis of the table, node i of N at u = i / (N - 1) (texel centres: u = 0 and u = 1 are the centres of the
 * first and the last texel). theory.md T15:
 *   u(r) = log(1 + (r/s)^2) / log(1 + (r_max/s)^2),   r(u) = s sqrt((1 + (r_max/s)^2)^u - 1)
 */
struct lut_axis {
    double r_max_mm, scale_mm;
    int node_count;
};
double lut_axis_index(const struct lut_axis *axis, double r_mm); /* 0 .. node_count - 1 */
double lut_axis_r_mm(const struct lut_axis *axis, double index);

/* A 1D table: RGB per node, interpolated linearly between nodes. End it with lut_splat1d_destroy. */
struct lut_splat1d {
    struct io_material material;
    double epsilon;            /* asked relative error and r_max                                     */
    double max_relative_error; /* the largest the audit found, plus 1 % for what lies between its points */
    struct lut_axis axis;
    float *rgb; /* node_count x 3, in 1/mm^2                                          */
};

/* Smallest and largest node_count. */
enum { LUT_NODE_COUNT_MIN = 64, LUT_NODE_COUNT_MAX = 32768 };

/*
 * Bake a table whose relative error is at most epsilon for every channel out to r_max(epsilon) of that
 * channel, with the fewest nodes among the powers of two from LUT_NODE_COUNT_MIN to LUT_NODE_COUNT_MAX.
 * epsilon 1e-6 to 0.5. Fails with DIPOLE_BAD_VALUE or DIPOLE_NOT_CONVERGED, naming what was reached.
 */
DIPOLE_CHECKED bool lut_splat1d_bake(const struct io_material *material, double epsilon,
                                     struct lut_splat1d **lut_out, dipole_status *status);

/* The same, with values that half stores exactly once scaled as lut_splat1d_write does, so that the error
 * holds in half. Fails with DIPOLE_BAD_VALUE, too, where half has not the digits or the range. */
DIPOLE_CHECKED bool lut_splat1d_bake_half(const struct io_material *material, double epsilon,
                                          struct lut_splat1d **lut_out, dipole_status *status);

void lut_splat1d_destroy(struct lut_splat1d *lut);

/* The table at r_mm as the shader evaluates it; 0 beyond r_max. */
void lut_splat1d_sample(const struct lut_splat1d *lut, double r_mm, double rgb_out[3]);

/* Largest relative error against direct evaluation at the nodes and at count random points (seeded), one in
 * each of count equal parts of the axis. Relative to R_d(r), and beyond a channel's own r_max(epsilon) to
 * R_d there. */
double lut_splat1d_audit(const struct lut_splat1d *lut, size_t count, unsigned seed);

/*
 * Write an EXR of node_count x 1 pixels and the attributes of docs/formats.md. With is_half each channel is
 * divided by the power of two in "dipole:scale", so that its values lie in half's normal range; the table
 * must be one that lut_splat1d_bake_half made, else DIPOLE_BAD_VALUE.
 */
DIPOLE_CHECKED bool lut_splat1d_write(const struct lut_splat1d *lut, const char *path, bool is_half,
                                      dipole_status *status);

/* Read one back, values in 1/mm^2. Fails as io_exr_read does, or with DIPOLE_BAD_VALUE, naming the
 * attribute that is missing, out of range or at odds with the others. */
DIPOLE_CHECKED bool lut_splat1d_read(const char *path, struct lut_splat1d **lut_out, dipole_status *status);

#endif
