/* Coefficients of one colour channel, with intervals, from radiosities and the operator. theory.md T17,
 * T18. */
#ifndef FIT_ESTIMATE_H
#define FIT_ESTIMATE_H

#include "fit/operator.h"

/* What was measured at the operator's pixels. */
struct fit_measurement {
    const float *radiosity_w_per_mm2; /* pixel_count x FIT_CHANNEL_COUNT, finite                    */
    const int *tiles;                 /* pixel_count: the part of the picture a pixel lies in,
                                         0 to tile_count - 1; errors within a tile go together      */
    int tile_count;
    double scale_error;  /* relative standard error common to all pixels               */
    double tile_error;   /* relative standard error common to a tile's pixels          */
    double offset_error; /* standard error added to all pixels, relative to their mean */
};

/* One channel's answer. Values stand even where is_identifiable is false: then they are one choice among
 * the many that make the same picture, and the intervals say how many. */
struct fit_estimate {
    double sigma_a_per_mm, sigma_a_ci95[2];             /* [lo, hi] */
    double sigma_s_prime_per_mm, sigma_s_prime_ci95[2]; /* [lo, hi] */
    double rms_residual; /* of (model - picture) / (picture + 10 % of its mean)                  */
    int iteration_count; /* 0: there was no light to fit */
    bool has_converged, is_identifiable;
    char note[192]; /* why it is not identifiable, or ""                                    */
};

/*
 * Fit sigma_a and sigma_s' of a channel; start gives eta, fdr_kind and where the search begins (others are
 * tried as well). The caller states in finest_mm the shortest mean free path to consider: what the operator
 * was made with. Fails with DIPOLE_OUT_OF_MEMORY, or DIPOLE_BAD_VALUE on a start that is no medium.
 */
DIPOLE_CHECKED bool fit_estimate_channel(const struct fit_operator *op, int channel,
                                         const struct fit_measurement *measurement,
                                         const dipole_medium *start, double finest_mm,
                                         struct fit_estimate *out, dipole_status *status);

#endif
