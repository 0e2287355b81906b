/*
 * The physics ladder: ways to the same profile, from a few operations to Monte Carlo, by their error
 * against truth and by their time. docs/theory.md T78, docs/accuracy.md.
 */
#ifndef ACCURACY_LADDER_H
#define ACCURACY_LADDER_H

#include "accuracy/reference.h"
#include "io/material_file.h"

#include <jansson.h>
#include <signal.h>

/* First Monte Carlo with more and more photons, then the library's models. */
enum { ACCURACY_RUNG_COUNT = 9, ACCURACY_LADDER_RING_LIMIT = 64 };

/* "dipole", or "Monte Carlo, 10^4 photons"; rung is below ACCURACY_RUNG_COUNT. */
const char *accuracy_rung_name(size_t rung);

/* One way to one profile, or to one set of totals. */
struct accuracy_rung {
    bool is_known;      /* false: the model refuses these layers, or it was not asked */
    double error;       /* T78: 0 is exact */
    double total_error; /* of all light that leaves through the top, relative, with its sign */
    double time_ns;     /* median, of one processor: of a radius, or of a total with all that it needs */
    double prepare_ns;  /* what is done once for a stack and is not in time_ns; 0 for Monte Carlo */
};

/* A stack, and truth for it. */
struct accuracy_ladder_case {
    char name[160];
    bool is_own_truth; /* by our own Monte Carlo, else by MCML */
    struct accuracy_mc_stack stack;
    double entered, reflected; /* part that enters; total, per entered power, unscattered light included */
    size_t ring_count;
    double edges_mm[ACCURACY_LADDER_RING_LIMIT + 1];
    double rd_per_mm2[ACCURACY_LADDER_RING_LIMIT],
        rd_error[ACCURACY_LADDER_RING_LIMIT]; /* per entered power */
    double floor; /* the error that a rung without errors would have by those of truth */
    struct accuracy_rung rungs[ACCURACY_RUNG_COUNT];
};

/* Differences of our Monte Carlo from the reference over their standard errors. */
struct accuracy_agreement {
    size_t count, beyond_count; /* beyond 3: some 0.3 % of many are expected */
    double worst, mean_square;  /* 1 is expected of the latter */
};

struct accuracy_ladder {
    struct accuracy_ladder_case *cases;
    size_t case_count;
    /* Against adding and doubling: relative RMS error of R and T of slabs, g = 0 and g = 0.8. */
    struct accuracy_rung totals[2][ACCURACY_RUNG_COUNT];
    size_t total_counts[2][ACCURACY_RUNG_COUNT]; /* numbers that a rung was judged by */
    struct accuracy_agreement agreement_totals, agreement_rings;
};

struct accuracy_ladder_options {
    const struct accuracy_reference *reference; /* NULL: none, then truth is all our own  */
    const struct io_material *materials;
    size_t material_count;
    double g;                  /* of the materials, of which the reduced coefficients are known */
    size_t truth_photon_count; /* for each channel of a material, 1000 to 10^9                */
    bool is_quick;             /* without the rung of most photons                         */
    uint64_t seed;
    int thread_count;                  /* for truth; rungs are timed on one processor            */
    const volatile sig_atomic_t *stop; /* NULL, or ends it early once set: then cases are fewer    */
    void (*show)(void *context, const char *what, double fraction); /* NULL, or progress      */
    void *context;
};

/* Climb. The caller ends *out with accuracy_ladder_end(), also after a failure. Fails with
 * DIPOLE_OUT_OF_MEMORY or DIPOLE_BAD_VALUE. */
DIPOLE_CHECKED bool accuracy_ladder_init(const struct accuracy_ladder_options *options,
                                         struct accuracy_ladder *out, dipole_status *status);
void accuracy_ladder_end(struct accuracy_ladder *ladder);

/* Over the cases a rung is known for: median, least and largest error, and median time; false: none. */
struct accuracy_rung_summary {
    size_t count;
    double error, error_low, error_high, time_ns;
};
bool accuracy_rung_summarize(const struct accuracy_ladder *ladder, size_t rung,
                             struct accuracy_rung_summary *out);

/* ---- results (ladder_results.c) ------------------------------------------------------------------- */

/* "ladder" of accuracy.json, docs/formats.md; NULL: no memory. */
json_t *accuracy_ladder_to_json(const struct accuracy_ladder *ladder);

/* Error against time of all rungs, as SVG. The caller frees *svg_out. */
DIPOLE_CHECKED bool accuracy_ladder_plot_create(const struct accuracy_ladder *ladder, char **svg_out,
                                                size_t *size_out, dipole_status *status);

#endif
