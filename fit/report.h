/* What was found, as one page to look at. */
#ifndef FIT_REPORT_H
#define FIT_REPORT_H

#include "fit/use.h"
#include "io/exr.h"

/* A coefficient or a nuisance parameter, with its 95 % interval. */
struct fit_report_value {
    const char *group; /* channel or picture: "R", "knot.exr"                                     */
    const char *name;  /* "sigma_a", "exposure"                                                   */
    const char *unit;  /* "1/mm", or ""                                                           */
    double value, ci95[2];
    const char *note; /* or ""                                                                   */
};

/* A picture that was fitted to, and the same picture drawn with what was found. */
struct fit_report_picture {
    const char *name;             /* "knot.exr"                                                          */
    const struct io_image *image; /* linear radiance, 3 or 4 channels                                    */
    const struct io_image *model; /* of the same size, scale and channels 0 to 2; not finite or 0 where
                                     no object is                                                        */
    const unsigned char *uses;    /* enum fit_use of every pixel                                         */
};

/* A profile: of the coefficients found, with its 95 % band, and measured points if it was fitted to. */
struct fit_report_profile {
    const char *name; /* "R", "R: skin.csv", "skin.csv"                                          */
    size_t count;
    const double *r_mm, *rd_per_mm2, *low_per_mm2, *high_per_mm2;
    size_t measured_count; /* 0: none                                                          */
    const double *measured_r_mm, *measured_rd_per_mm2, *measured_sem_per_mm2; /* sem may be NULL       */
};

/* How a search went: the sum of squares after each of count iterations. */
struct fit_report_search {
    const char *name; /* "round 1, start 2"                                                       */
    size_t count;
    const double *sum_of_squares;
    bool is_reweighed; /* with weights of its own: its sums do not compare with other searches'        */
};

struct fit_report {
    const char *title;   /* "knot.exr: marble, fitted"                                                */
    const char *verdict; /* one or more plain sentences                                               */
    const char *model;   /* "beam"                                                                    */
    bool has_converged;
    double seconds, rms_residual;
    size_t value_count, picture_count, profile_count, search_count, note_count;
    const struct fit_report_value *values;
    const struct fit_report_picture *pictures;
    const struct fit_report_profile *profiles;
    const struct fit_report_search *searches;
    const char *const *notes;
    size_t correlation_count; /* of parameters                                                         */
    const char *const *correlation_names;
    const double *correlations; /* correlation_count^2, -1 to 1, NAN where it means nothing               */
};

/*
 * Write folder/index.html, a page that needs no other file, and for each picture folder/NAME.mask.png.
 * The folder is made. Same report, same bytes. Fails with DIPOLE_IO_FAILED, DIPOLE_BAD_VALUE or
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool fit_report_write(const char *folder, const struct fit_report *report,
                                     dipole_status *status);

/* The uses of a picture's pixels in colours, with none of its values: what --report writes, and --mask-out.
 */
DIPOLE_CHECKED bool fit_mask_write(const char *path, const unsigned char *uses, int width_px, int height_px,
                                   dipole_status *status);

#endif
