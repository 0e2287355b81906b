/*
 * What the accuracy of a fit costs: the coefficients of a scene's material by a picture of it, with more
 * and more pixels taken, and with the profile known at more and more radii. docs/theory.md T16, T38.
 */
#ifndef ACCURACY_FITS_H
#define ACCURACY_FITS_H

#include "accuracy/statistics.h"
#include "renderer/media.h"

#include <jansson.h>
#include <signal.h>

enum { ACCURACY_FIT_KNOBS = 2, ACCURACY_FIT_VALUES = 8, ACCURACY_FIT_POINTS = 16 };

/* The other one stands as fit has it: the last value. */
struct accuracy_fit_knob {
    const char *name, *title;
    const char *what; /* one sentence */
    int values[ACCURACY_FIT_VALUES];
    size_t value_count;
};
extern const struct accuracy_fit_knob accuracy_fit_knobs[ACCURACY_FIT_KNOBS];

struct accuracy_fit_point {
    size_t knob;
    int value;
    int told_count;    /* coefficients that the picture tells, of six                              */
    int inside_count;  /* of these, the ones whose 95 % interval holds the truth                   */
    double error;      /* the largest of these, relative; NAN where none is told                   */
    double half_width; /* of the widest of their intervals, relative                               */
    double times_s[ACCURACY_REPEAT_LIMIT]; /* of the whole fit, after a first that is not counted */
    size_t time_count;
    struct accuracy_spread time_s;
};

struct accuracy_fits {
    struct accuracy_fit_point points[ACCURACY_FIT_POINTS];
    size_t point_count; /* 0: not measured, or refused */
    char refusal[384];  /* why nothing can be fitted to the scene; "": something can */
};

struct accuracy_fits_options {
    const struct io_scene *scene; /* of which the picture is */
    const struct render_media *media;
    const char *picture_path; /* EXR */
    int repeat_count;         /* up to ACCURACY_REPEAT_LIMIT */
    const volatile sig_atomic_t *stop;
    void (*show)(void *context, const char *what, double fraction); /* NULL, or progress */
    void *context;
};

/* Fit with each setting, by turns. What fit refuses is no failure. Ends early, without points, once *stop
 * is set. Fails with DIPOLE_OUT_OF_MEMORY, or as reading the picture does. */
DIPOLE_CHECKED bool accuracy_fits_measure(const struct accuracy_fits_options *options,
                                          struct accuracy_fits *out, dipole_status *status);

/* accuracy_halving_of a knob. */
double accuracy_fits_halving_cost(const struct accuracy_fits *fits, size_t knob);

/* ---- results (fits_results.c) --------------------------------------------------------------------- */

/* "fits" of accuracy.json, docs/formats.md; NULL: no memory. */
json_t *accuracy_fits_to_json(const struct accuracy_fits *fits);

/* Errors and half widths of intervals of all points against their times. The caller frees *svg_out. */
DIPOLE_CHECKED bool accuracy_fits_plot_create(const struct accuracy_fits *fits, char **svg_out,
                                              size_t *size_out, dipole_status *status);

#endif
