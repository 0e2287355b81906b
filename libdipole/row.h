/*
 * A half-space as a row of sources under the point where the light enters:
 *   R(r) = alpha'/(2 pi) sum_k w_k lobe(z_k, sigma_tr, r).
 * The dipole has two, the beam model has some hundred. docs/theory.md T5, T22.
 */
#ifndef LIBDIPOLE_ROW_H
#define LIBDIPOLE_ROW_H

#include "dd.h"
#include "libdipole/dipole.h"

enum { ROW_LIMIT = 768 };

/* Distance of the beam model's sources in log depth. */
#define ROW_STEP 0.125

struct row {
    const dipole_coefficients *coefficients;
    size_t count;                          /* 1 to ROW_LIMIT */
    const double *depth_mm, *depth_low_mm; /* ascending; depth + depth_low is the depth */
    const double *weight;
};

/* The dipole's own row of two, in the caller's storage. */
struct row_of_two {
    struct row row;
    double depth_mm[2], depth_low_mm[2], weight[2];
};
void dipole_row_of_two_init(const dipole_coefficients *coefficients, struct row_of_two *out);

/* w(x) dx of the beam model's line of sources at depth x mean free paths, dx = x d log x. T22 */
double dipole_row_beam_weight(const dipole_coefficients *coefficients, double x, double d_log_x);
/* How many sources the beam model needs, at most ROW_LIMIT; and to fill that many. T22 */
size_t dipole_row_beam_count(const dipole_coefficients *coefficients);
void dipole_row_beam_fill(const dipole_coefficients *coefficients, double *depth_mm, double *depth_low_mm,
                          double *weight);

/* alpha'/(2 pi) sum_k w_k lobe, to a few units in the last place; NaN where r_mm is negative or NaN. */
double dipole_row_value(const struct row *row, double r_mm);
/* The same of a row of two at count radii, faster, with a relative error of 3e-16 (8 + sigma_tr r). */
void dipole_row_profile(const struct row *row, const double *r_mm, size_t count, double *values);
/* The same, and its derivatives with respect to log sigma_a and log sigma_s'; weights and depth/l held. */
void dipole_row_gradient(const struct row *row, const double *r_mm, size_t count, double *values,
                         double *d_log_sigma_a, double *d_log_sigma_s_prime);
/* Without alpha': factor times the power beyond r, the power within r, 2 pi times the mean over a ring. */
double dipole_row_beyond(const struct row *row, double factor, double r_mm);
double dipole_row_within(const struct row *row, double r_mm);
double dipole_row_ring_mean(const struct row *row, double r_lo_mm, double r_hi_mm);

/* The same functions, compiled for one kind of processor each (row_portable.c, row_avx2.c); row.c picks. */
struct row_loops {
    double (*value)(const struct row *row, double r_mm);
    void (*profile)(const struct row *row, const double *r_mm, size_t count, double *values);
    void (*gradient)(const struct row *row, const double *r_mm, size_t count, double *values,
                     double *d_log_sigma_a, double *d_log_sigma_s_prime);
    double (*beyond)(const struct row *row, double factor, double r_mm);
    double (*within)(const struct row *row, double r_mm);
    double (*ring_mean)(const struct row *row, double r_lo_mm, double r_hi_mm);
};

extern const struct row_loops dipole_row_loops_portable;
#ifdef DIPOLE_HAS_AVX2
extern const struct row_loops dipole_row_loops_avx2;
#endif

#endif
