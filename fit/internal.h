/* What estimate.c and its tests share. */
#ifndef FIT_INTERNAL_H
#define FIT_INTERNAL_H

#include "fit/estimate.h"
#include "fit/solve.h"

/* Weighted rows of one channel, [ H | B ] divided by (B + floor) sqrt(pixel_count), folded to a triangle.
 */
struct fit_channel_system {
    size_t node_count, pixel_count;
    const double *node_r_mm;
    double eta;
    dipole_fdr_kind fdr_kind;
    double floor_w_per_mm2;
    double *triangle; /* (node_count + 1)^2 */
    double *profile;  /* scratch: 3 x node_count */
};

DIPOLE_CHECKED bool fit_channel_system_init(const struct fit_operator *op, int channel,
                                            const struct fit_measurement *measurement,
                                            const dipole_medium *start, struct fit_channel_system *out,
                                            dipole_status *status);
void fit_channel_system_destroy(struct fit_channel_system *system);

/* A fit_residual_function over a fit_channel_system; parameters are log sigma_a and log sigma_s'. */
bool fit_channel_residuals(const void *system, const double *parameters, double *residuals,
                           double *jacobian);

#endif
