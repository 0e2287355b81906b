/* What the parts of the ladder share: what a rung is, calls that can be timed, agreement. */
#ifndef ACCURACY_LADDER_PARTS_H
#define ACCURACY_LADDER_PARTS_H

#include "accuracy/ladder.h"
#include "accuracy/statistics.h"

#define LADDER_PI 3.14159265358979323846

/* Of Monte Carlo the number of photons, of a model, which has none, which. */
struct ladder_kind {
    const char *name;
    size_t photon_count;
    dipole_model model;
};

enum { LADDER_FIRST_MODEL = 4 };

extern const struct ladder_kind ladder_kinds[ACCURACY_RUNG_COUNT];

/* ---- time ----------------------------------------------------------------------------------------- */

/* Median of a few times, each of so many calls that the clock can tell; a slow call is made once. */
double ladder_measure_ns(void (*call)(void *context), void *context);

/* ---- what is timed -------------------------------------------------------------------------------- */

struct ladder_trace {
    const struct accuracy_mc_stack *stack;
    struct accuracy_mc_run run;
    const struct accuracy_mc_rings *rings;
    struct accuracy_mc_result result;
    bool is_done;
    dipole_status status;
};

void ladder_trace_call(void *context);

struct ladder_model {
    dipole_layer layers[DIPOLE_LAYER_LIMIT];
    size_t layer_count;
    dipole_model model;
    dipole_stack *stack; /* NULL where the model refuses */
    const double *r_mm;
    size_t count;
    double *values;
    double reflected, transmitted; /* of all light that entered */
    dipole_status status;
};

/* The stack as models know it. */
void ladder_model_init(const struct accuracy_mc_stack *stack, dipole_model model, struct ladder_model *out);

/* Make stack and totals anew. */
void ladder_model_call(void *context);

/* ---- rungs ---------------------------------------------------------------------------------------- */

double ladder_area_mm2(const struct accuracy_ladder_case *at, size_t ring);

void ladder_agree(struct accuracy_agreement *agreement, double found, double expected, double error);

/* Light that entered and leaves through the top, scattered or not. */
double ladder_reflected(const struct accuracy_mc_powers *powers);

/* Trace a case; what is found is per power that enters. time_ns may be NULL: once, untimed. */
DIPOLE_CHECKED bool ladder_trace_case(const struct accuracy_ladder_case *at,
                                      const struct accuracy_mc_run *run, double *rd_per_mm2,
                                      double *rd_error, struct accuracy_mc_result *result, double *time_ns,
                                      dipole_status *status);

/* All rungs of a case; reference (may be NULL) is what it was made of. */
DIPOLE_CHECKED bool ladder_climb(const struct accuracy_ladder_options *options,
                                 struct accuracy_ladder_case *at,
                                 const struct accuracy_reference_case *reference,
                                 struct accuracy_ladder *ladder, dipole_status *status);

/* Totals by a rung, of slabs of g = 0 or of g > 0. */
DIPOLE_CHECKED bool ladder_climb_totals(const struct accuracy_ladder_options *options, size_t rung,
                                        int is_forward, struct accuracy_ladder *ladder,
                                        dipole_status *status);

static inline bool ladder_is_stopped(const struct accuracy_ladder_options *options)
{
    return options->stop && *options->stop;
}

#endif
