/*
 * Monte Carlo of light in plane layers, as independent truth: it knows the equation of transfer and
 * Fresnel's formulas, but nothing of diffusion. docs/theory.md T76 to T78. One colour channel at a time.
 *
 * A pencil of light meets the stack at r = 0 at normal incidence, from outside, where the index is 1. All
 * powers are per unit of power that falls on it: divide by 1 - specular for one that enters.
 */
#ifndef ACCURACY_MONTE_CARLO_H
#define ACCURACY_MONTE_CARLO_H

#include "libdipole/dipole.h"

#include <stdint.h>

/* Top first. Below the last layer, too, the index is 1. */
struct accuracy_mc_layer {
    double sigma_a_per_mm, sigma_s_per_mm; /* 0 or 1e-50 to 1e50; sigma_s is not reduced           */
    double g;                              /* mean cosine of Henyey and Greenstein, -1 < g < 1     */
    double eta;                            /* index over that of the outside, 0.1 to 10            */
    double thickness_mm;                   /* 1e-50 to 1e50; INFINITY for the last: a half-space   */
};

struct accuracy_mc_stack {
    struct accuracy_mc_layer layers[DIPOLE_LAYER_LIMIT];
    size_t layer_count; /* 1 to DIPOLE_LAYER_LIMIT */
};

/* Layers that scatter as much as these do by their reduced coefficients, with a mean cosine g: sigma_s is
 * sigma_s' / (1 - g). */
void accuracy_mc_stack_init(const dipole_layer *layers, size_t count, double g,
                            struct accuracy_mc_stack *out);

/* Light is followed in ACCURACY_MC_BATCHES batches with random numbers of their own that follow from the
 * seed: no digit depends on thread_count. photon_count is rounded up to a multiple. */
struct accuracy_mc_run {
    size_t photon_count; /* 1 to 10^12               */
    uint64_t seed;
    int thread_count; /* 0: as many as processors */
};

enum { ACCURACY_MC_BATCHES = 64, ACCURACY_MC_RING_LIMIT = 4096 };

/*
 * Specular and unscattered parts, and what light loses before it scatters, are exact and have no error. The
 * sum of all members is 1 but for rounding.
 */
struct accuracy_mc_powers {
    double specular;                /* mirrored where it comes in                                        */
    double unscattered_reflected;   /* came back from interfaces below, never scattered                  */
    double unscattered_transmitted; /* straight through                                                  */
    double reflected, transmitted;  /* scattered at least once                                           */
    double absorbed[DIPOLE_LAYER_LIMIT]; /* in each layer                                                */
    double roulette; /* lost at Russian roulette: 0 in the mean                           */
    double lost;     /* still under way when no longer followed, after 2^20 events, or in a
                        layer that neither absorbs nor ends                               */
};

/* Scattered light by the distance from the pencil, through the top and through the bottom. */
struct accuracy_mc_rings {
    const double *edges_mm; /* count + 1, ascending, the first >= 0                                   */
    size_t count;           /* 0 to ACCURACY_MC_RING_LIMIT                                            */
    double *rd_per_mm2, *rd_error, *td_per_mm2, *td_error; /* count each, the caller's; means over rings */
};

struct accuracy_mc_result {
    struct accuracy_mc_powers mean, error; /* error: one standard error, from the spread of the batches */
    double scatterings;                    /* in all */
    size_t photon_count;
};

/*
 * Follow light through the stack. rings may be NULL. Memory is at most 5 MB. Fails with DIPOLE_BAD_VALUE,
 * naming layer, field, value and range, or with DIPOLE_OUT_OF_MEMORY; results are then untouched.
 */
DIPOLE_CHECKED bool accuracy_mc_trace(const struct accuracy_mc_stack *stack,
                                      const struct accuracy_mc_run *run,
                                      const struct accuracy_mc_rings *rings,
                                      struct accuracy_mc_result *result, dipole_status *status);

#endif
