/* What the parts of the Monte Carlo share: the stack as it is walked through, and what is counted. */
#ifndef ACCURACY_MONTE_CARLO_PARTS_H
#define ACCURACY_MONTE_CARLO_PARTS_H

#include "accuracy/batches.h"
#include "accuracy/monte_carlo.h"

/* Light that meets a layer for the first time, unscattered, downward from its top or upward from its
 * bottom. */
struct mc_source {
    int layer;
    bool is_upward;
    double end; /* of its share in all that scatters a first time: ascending from 0 to 1 */
};

struct mc_layer {
    double sigma_a_per_mm, sigma_t_per_mm, g, eta, thickness_mm;
    bool is_clear;             /* scatters nothing                                             */
    double mean_free_path_mm;  /* between scatterings or absorptions                           */
    double albedo, absorption; /* their sum is 1                                              */
    double trapped_cosine2;    /* of directions that both faces reflect wholly; 0 where none are */
};

enum { ZIGGURAT_LEVELS = 256 };

/* Stack, rings and random numbers as the walk needs them. */
struct mc_walk {
    struct mc_layer layers[DIPOLE_LAYER_LIMIT];
    int layer_count;
    double eta_below;                    /* of what is below the last layer that is walked in */
    struct accuracy_mc_powers ballistic; /* what happens to light before it scatters          */
    double scattered;                    /* part of the power that scatters at all            */
    struct mc_source sources[2 * DIPOLE_LAYER_LIMIT];
    int source_count;
    double edges2_mm2[ACCURACY_MC_RING_LIMIT + 1];
    size_t ring_count;
    double level[ZIGGURAT_LEVELS + 1];  /* of the exponential distribution: right ends,          */
    double height[ZIGGURAT_LEVELS + 1]; /* and its density there                                 */
};

/* What a batch counts, in units of the power of one photon at its first scattering. */
struct mc_tally {
    struct accuracy_mc_powers *powers;
    double *rings; /* 2 ring_count: reflected, then transmitted */
    double scatterings;
};

/* Derive all but edges2_mm2 from a stack that has been checked. */
void mc_walk_init(const struct accuracy_mc_stack *stack, struct mc_walk *out);

/* Follow photon_count photons, their first depths spread evenly over what is likely. */
void mc_walk_batch(const struct mc_walk *walk, size_t photon_count, struct accuracy_stream *stream,
                   struct mc_tally *tally);

#endif
