/*
 * Radiosity of a picture by gathering light samples band by band: the wider a band, the fewer samples it is
 * summed over and the fewer pixels it is summed at; others interpolate. Pure C: no OpenGL here. theory.md
 * T43.
 */
#ifndef RENDERER_GATHER_H
#define RENDERER_GATHER_H

#include "renderer/gather_sources.h"

/* Pixels of a level are 2^level apart. */
enum { RENDER_GATHER_LEVELS = 6 };

/*
 * The finest band's samples are merged in cubes of so many spacings of T11, and each band's cap is so many
 * of its own spacings wide, that merging errs by error, relative RMSE: measured over all measured
 * materials, on wavy surfaces at any angle, at edges of light and steps (theory.md T43).
 */
#define RENDER_GATHER_MERGING_ERROR_MAX 3.4e-3 /* narrower caps save little time */
double render_gather_finest_spacings(double error);
double render_gather_cap_spacings(double error);

/* A medium's bands, and how much they can change from place to place. */
struct render_gather_medium {
    int band_count;
    struct render_gather_kernel kernels[RENDER_BAND_LIMIT];
    float reach_mm[RENDER_BAND_LIMIT];
    /* Of a band and all beyond it, over the total, the worst channel's: the largest slope of radiosity near
     * the edge of light on a flat surface, and the largest second derivative. */
    double slope_per_mm[RENDER_BAND_LIMIT], bend_per_mm2[RENDER_BAND_LIMIT];
    /* The same, over the radiosity itself: as no sample's share changes by more, so does none of their sum.
     */
    double own_slope_per_mm[RENDER_BAND_LIMIT], own_bend_per_mm2[RENDER_BAND_LIMIT];
    /* Third derivatives, of both kinds. */
    double third_per_mm3[RENDER_BAND_LIMIT], own_third_per_mm3[RENDER_BAND_LIMIT];
};

DIPOLE_CHECKED bool render_gather_medium_init(const struct render_band_source *source,
                                              const struct render_band *bands, int band_count,
                                              struct render_gather_medium *medium, dipole_status *status);

struct render_gather_object {
    const struct render_gather_medium *medium; /* NULL: nothing is gathered */
    const struct render_gather_sources *sources;
    double pixel_mm; /* between pixels, about */
};

struct render_gather_request {
    int width_px, height_px;
    const float *position_mm; /* x y z in mm, number of the object from 1 (0: no object); for each pixel */
    const struct render_gather_object *objects;
    size_t object_count; /* 1: all pixels are its, whatever their number */
    double epsilon;      /* what interpolation may err by, of what a lit flat surface sends out */
    double own_epsilon;  /* and of what is there                                                */
    int thread_count;    /* 0: as many as processors; sums do not depend on it */
    bool has_slopes;     /* nodes know their slopes, and may lie farther apart (theory.md T43) */
};

struct render_gather_counts {
    size_t place_count;      /* at which any band was summed                 */
    size_t refined_count;    /* of them, where wide bands could not be interpolated */
    size_t evaluation_count; /* samples at places                            */
};

/* The most groups of any object and band. */
size_t render_gather_group_limit(const struct render_gather_request *request);

/* R G B 0 for each pixel, in W/mm^2. Fails with DIPOLE_OUT_OF_MEMORY. counts_out may be NULL. */
DIPOLE_CHECKED bool render_gather_run(const struct render_gather_request *request,
                                      float *radiosity_w_per_mm2, struct render_gather_counts *counts_out,
                                      dipole_status *status);

#endif
