/*
 * The picture as a linear function of the profile: with light and view fixed, radiosity at pixel j is
 *     B_j = sum_i Phi_i R_d(|x_j - x_i|) = sum_k H_jk R_d(r_k),
 * H made once from geometry. theory.md T16. Pure C on plain arrays: no OpenGL, no files.
 */
#ifndef FIT_OPERATOR_H
#define FIT_OPERATOR_H

#include "fit/form.h"
#include "renderer/light_samples.h"

/*
 * H, by rows. The nodes r_k lie evenly on the logarithm of r^2 + s^2, from 0 to beyond the largest
 * distance in the scene; between them R_d is interpolated. One allocation.
 */
struct fit_operator {
    size_t pixel_count, node_count;
    double *node_r_mm; /* node_count, rising from 0                                                */
    double *rows;      /* set_count x pixel_count x node_count, in W: times R_d in 1/mm^2, W/mm^2 */
    size_t set_count;  /* 1 where all light has the same colour, else FIT_CHANNEL_COUNT            */
    double colour[FIT_CHANNEL_COUNT]; /* what a channel's rows must be multiplied by              */
};

/* What is drawn from where; nothing is kept. */
struct fit_geometry {
    const float *positions_mm; /* of pixels, pixel_count x 3, finite              */
    const int *objects;        /* of pixels: only light samples of the same object count; NULL: all do */
    size_t pixel_count;
    const struct render_light_sample *samples;
    size_t sample_count;
    double cut_mm;        /* light farther than this was left out of the picture; INFINITY: none was   */
    double finest_mm;     /* mean free paths down to this are represented, > 0                          */
    int nodes_per_octave; /* of r^2 + s^2: a power of 2 up to 32; 0: FIT_NODES_PER_OCTAVE            */
};
enum { FIT_NODES_PER_OCTAVE = 8 };

/* Called now and then from the calling thread with 0 to 1. show may be NULL. */
struct fit_progress {
    void (*show)(void *context, const char *what, double fraction);
    void *context;
};

/*
 * Make H for the given geometry. Interpolation changes no pixel lit at all brightly (above 1e-4 of the
 * brightest) by more than 1e-4 of itself, for media whose mean free path is at least finest_mm, by
 * FIT_NODES_PER_OCTAVE or more. The
 * same input gives the same H on any number of threads.
 * The caller ends it with fit_operator_destroy. Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_BAD_VALUE
 * (distances span more than the axis can); *operator_out is then NULL.
 */
DIPOLE_CHECKED bool fit_operator_create(const struct fit_geometry *geometry,
                                        const struct fit_progress *progress,
                                        struct fit_operator **operator_out, dipole_status *status);
void fit_operator_destroy(struct fit_operator *op);

/* The row of a pixel, before the factor colour[channel]. */
const double *fit_operator_row(const struct fit_operator *op, int channel, size_t pixel);

#endif
