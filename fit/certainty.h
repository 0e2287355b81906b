/* Inside: what intervals follow from, and how their ends are found. theory.md T40. */
#ifndef FIT_CERTAINTY_H
#define FIT_CERTAINTY_H

#include "fit/interval.h"

/* Everything that the intervals follow from. */
struct fit_certainty {
    struct fit_problem *problem;
    const struct fit_minimum *minimum;
    bool is_quick;
    const volatile sig_atomic_t *stop;
    double *inverse, *covariance, *singular;
    double *triangle, *middle; /* J folded, and the middle of the sandwich                    */
    double noise, quantile;
};

/* Fill in inverse, covariance, singular, triangle, middle, noise and quantile, for which there is memory;
 * and misfit and rms residuals of *out. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool fit_certainty_find(struct fit_certainty *certainty, struct fit_estimates *out,
                                       dipole_status *status);

/* Of a parameter that is searched by its logarithm, by the profile of the likelihood where that is not
 * quadratic and it is no nuisance; and of one that is searched as it is, in a unit. */
struct fit_interval fit_certainty_of_logarithm(const struct fit_certainty *certainty, int parameter,
                                               bool is_nuisance);
struct fit_interval fit_certainty_of_number(const struct fit_certainty *certainty, int parameter,
                                            double unit);

#endif
