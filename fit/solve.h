/* Least squares by Ceres, and the QR step that makes it cheap (solve.cpp is the shim). */
#ifndef FIT_SOLVE_H
#define FIT_SOLVE_H

#include "libdipole/dipole.h"

#include <signal.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FIT_PARAMETER_LIMIT = 128, FIT_HISTORY_LIMIT = 256 };

/* Fill residuals and, unless it is NULL, jacobian (residual_count x parameter_count, by rows: derivative of
 * the residual with respect to the parameter). Returns false where the parameters have no value. */
typedef bool fit_residual_function(const void *context, const double *parameters, double *residuals,
                                   double *jacobian);

/* Minimise the sum of the squared residuals, lower <= parameter <= upper. */
struct fit_least_squares {
    fit_residual_function *residuals;
    const void *context;
    size_t residual_count;
    size_t parameter_count; /* at most FIT_PARAMETER_LIMIT */
    double lower[FIT_PARAMETER_LIMIT], upper[FIT_PARAMETER_LIMIT];
    int iteration_limit;               /* 0: 100                                             */
    bool is_held[FIT_PARAMETER_LIMIT]; /* stays where it starts                             */
    const volatile sig_atomic_t *stop; /* not 0: end after this iteration; NULL: never      */
};

struct fit_minimum {
    double parameters[FIT_PARAMETER_LIMIT];
    double sum_of_squares;
    int iteration_count;
    bool has_converged;
    double history[FIT_HISTORY_LIMIT]; /* sum of squares at the start and after each iteration */
    int history_count;
};

/*
 * Search from start, a point within the bounds. Prints nothing. Not converging is an answer
 * (has_converged), not a failure. Fails with DIPOLE_NOT_CONVERGED where start has no value, or
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool fit_least_squares_solve(const struct fit_least_squares *problem, const double *start,
                                            struct fit_minimum *out, dipole_status *status);

/* Largest difference between jacobian and Ceres' own numeric derivative at a point, relative to the larger
 * of the two; INFINITY where there is no value. For tests. */
double fit_least_squares_jacobian_error(const struct fit_least_squares *problem, const double *parameters);

/*
 * Invert J'J for the triangle J that weighted rows of derivatives were folded into, after a look at its
 * singular values: columns are scaled to length 1 first, and singular values below rank_tolerance of the
 * largest are raised to it, so that what the data do not tell comes out as variances as large as they are.
 *
 *   triangle  count x count, upper
 *   inverse   count x count; rows and columns of parameters without any effect are INFINITY on the
 * diagonal, 0 beside it singular  count values, of the scaled columns, falling; those without effect are 0
 *
 * Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool fit_inverse_information(const double *triangle, size_t count, double rank_tolerance,
                                            double *inverse, double *singular, dipole_status *status);

/*
 * Fold rows (row_count x column_count, by rows) into triangle (column_count x column_count, upper, by rows;
 * all 0 to begin): afterwards |triangle v|^2 has grown by |rows v|^2 for every vector v. Householder
 * reflections: no digits are squared away, as they are with normal equations.
 * Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool fit_triangle_fold(double *triangle, size_t column_count, const double *rows,
                                      size_t row_count, dipole_status *status);

#ifdef __cplusplus
}
#endif
#endif
