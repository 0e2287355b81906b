/* The average over light samples' footprints (theory.md T34) as a matrix: linear in the profile, so that it
 * serves the profile's derivatives as well. theory.md T38. */
#ifndef FIT_BLUR_H
#define FIT_BLUR_H

#include "libdipole/dipole.h"

/* averaged profile at row_r_mm[i] = sum over k of matrix[i * node_count + k] profile(node_r_mm[k]).
 * One allocation; end it with free. */
struct fit_blur {
    size_t row_count, node_count;
    double *node_r_mm; /* rising, > 0 */
    double *matrix;    /* row_count x node_count */
};

/* row_r_mm: row_count distances, rising from 0. blur_mm >= finest_mm > 0: nodes follow from rows and
 * finest_mm alone, so that blurs can share them. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool fit_blur_create(const double *row_r_mm, size_t row_count, double blur_mm,
                                    double finest_mm, struct fit_blur **blur_out, dipole_status *status);

#endif
