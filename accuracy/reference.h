/* What other people's programs computed: the folder tests/reference, docs/models.md. */
#ifndef ACCURACY_REFERENCE_H
#define ACCURACY_REFERENCE_H

#include "accuracy/monte_carlo.h"

enum {
    ACCURACY_REFERENCE_RING_LIMIT = 256,
    ACCURACY_REFERENCE_CASE_LIMIT = 32,
    ACCURACY_REFERENCE_SLAB_LIMIT = 256
};

/* A stack by MCML. Per power that falls on it; scattered light alone, as accuracy_mc_powers counts it. */
struct accuracy_reference_case {
    char name[64];
    struct accuracy_mc_stack stack;
    double specular, unscattered_reflected, unscattered_transmitted;
    double reflected, reflected_error, transmitted, transmitted_error;
    size_t ring_count; /* 0: only totals are known */
    double edges_mm[ACCURACY_REFERENCE_RING_LIMIT + 1];
    double rd_per_mm2[ACCURACY_REFERENCE_RING_LIMIT], rd_error[ACCURACY_REFERENCE_RING_LIMIT];
    double td_per_mm2[ACCURACY_REFERENCE_RING_LIMIT], td_error[ACCURACY_REFERENCE_RING_LIMIT];
};

/* A layer by adding and doubling. Of all light, mirrored and unscattered as well. */
struct accuracy_reference_slab {
    struct accuracy_mc_stack stack;
    double total_r, total_t, unscattered_r, unscattered_t;
    double error; /* at most that of all four */
};

struct accuracy_reference {
    struct accuracy_reference_case cases[ACCURACY_REFERENCE_CASE_LIMIT];
    size_t case_count;
    struct accuracy_reference_slab slabs[ACCURACY_REFERENCE_SLAB_LIMIT];
    size_t slab_count;
};

/*
 * Read mcml_totals.csv, mcml/CASE.csv where there is one, and adding_doubling.csv. The caller frees *out.
 * Fails with place and reason, or with DIPOLE_OUT_OF_MEMORY; *out is then NULL.
 */
DIPOLE_CHECKED bool accuracy_reference_read(const char *folder, struct accuracy_reference **out,
                                            dipole_status *status);

#endif
