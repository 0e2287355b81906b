/* A picture to fit to, as it comes from a camera or from render: linear values, and what they are worth. */
#ifndef FIT_PHOTO_H
#define FIT_PHOTO_H

#include "fit/target.h"
#include "io/image.h"
#include "io/material_file.h"

struct fit_photo {
    struct io_image *image; /* linear, 3 channels or 4; alpha is not used                              */
    int bits;               /* of its integer codes; 0: floating point                                 */
    bool is_srgb;           /* its codes were sRGB                                                     */
    double exposure;        /* what radiance was multiplied by before it was coded; undone in image    */
    double linear_limit; /* brighter values were bent by tone mapping, as they stand in image; INFINITY */
    /* What a picture by render says about its own making. */
    bool is_rendered;
    dipole_model model; /* of its material; only where has_model                      */
    bool has_model;
    double cut_mm;                     /* light farther than this was left out; INFINITY: none was   */
    double spacing_mm;                 /* of its light samples; 0: not stated                        */
    double blur_mm[FIT_CHANNEL_COUNT]; /* of its profile, T34; 0: none                               */
    struct fit_systematic systematic;
};

/*
 * Read a picture. Integers are sRGB unless is_linear; they are divided by exposure (2^exposure_ev of the
 * scene, which render multiplied them by). What render says in an EXR or PNG about itself is kept. A grey
 * picture becomes three equal channels. End it with fit_photo_destroy. Fails as io_exr_read and
 * io_photo_read do.
 */
DIPOLE_CHECKED bool fit_photo_read(const char *path, bool is_linear, double exposure, struct fit_photo *out,
                                   dipole_status *status);
void fit_photo_destroy(struct fit_photo *photo);

/*
 * Bring a picture that is a whole number of times as large as the camera's to the camera's size: means of
 * squares, in linear light; a square with a clipped value keeps its largest, so that it counts as clipped.
 * Other sizes are left alone. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool fit_photo_reduce(struct fit_photo *photo, int width_px, int height_px,
                                     dipole_status *status);

/* The same of a mask: bright where all of the square is. */
DIPOLE_CHECKED bool fit_mask_reduce(struct io_image **mask, int width_px, int height_px,
                                    dipole_status *status);

/* The value of the code `code` (fractions are between codes), as it stands in image. */
double fit_photo_value(const struct fit_photo *photo, double code);

#endif
