/* What `accuracy --monte-carlo` does: a material's profiles by Monte Carlo, with standard errors. */
#ifndef ACCURACY_SIMULATION_H
#define ACCURACY_SIMULATION_H

#include "accuracy/monte_carlo.h"
#include "io/material_file.h"

#include <jansson.h>
#include <stdio.h>

enum { ACCURACY_SIMULATION_RING_COUNT = 40 };

struct accuracy_simulation_options {
    const char *material; /* a file, or the name of a bundled material               */
    double g;             /* mean cosine, -0.99 to 0.99; sigma_s is sigma_s' / (1 - g) */
    struct accuracy_mc_run run;
};

struct accuracy_simulation_channel {
    struct accuracy_mc_stack stack;
    struct accuracy_mc_result result;
    double edges_mm[ACCURACY_SIMULATION_RING_COUNT + 1]; /* accuracy_rings_choose */
    double rd_per_mm2[ACCURACY_SIMULATION_RING_COUNT], rd_error[ACCURACY_SIMULATION_RING_COUNT];
    double td_per_mm2[ACCURACY_SIMULATION_RING_COUNT], td_error[ACCURACY_SIMULATION_RING_COUNT];
};

struct accuracy_simulation {
    struct io_material material;
    double g, time_s; /* of all channels */
    uint64_t seed;
    struct accuracy_simulation_channel channels[IO_CHANNEL_COUNT];
};

/* Edges of count (at least 2) rings from 0, the first 1/20 of the first layer's mean free path, then
 * growing evenly, so far out that by the beam model 0.1 % of what leaves does so beyond. Fails as
 * dipole_stack_create does. */
DIPOLE_CHECKED bool accuracy_rings_choose(const dipole_layer *layers, size_t layer_count, size_t count,
                                          double *edges_mm, dipole_status *status);

/* Read the material and follow light in each channel. Fails as io_material_open and accuracy_mc_trace do.
 */
DIPOLE_CHECKED bool accuracy_simulation_run(const struct accuracy_simulation_options *options,
                                            struct accuracy_simulation *out, dipole_status *status);

/* docs/formats.md; NULL: no memory. */
json_t *accuracy_simulation_to_json(const struct accuracy_simulation *simulation);

/* Tables for people: powers, then rings, with one standard error each. */
void accuracy_simulation_print(const struct accuracy_simulation *simulation, FILE *file);

#endif
