/* Six coefficients from a picture of a scene: what `fit` does between reading and writing files. */
#ifndef FIT_PICTURE_H
#define FIT_PICTURE_H

#include "fit/estimate.h"
#include "io/exr.h"
#include "io/scene_file.h"

struct fit_picture_request {
    const struct io_scene *scene;   /* of one medium: eta and fdr_kind are its, its sigmas are not used   */
    const struct io_image *picture; /* linear radiance, the camera's size, 3 or 4 channels                */
    const char *picture_path;       /* for messages                                                       */
    const dipole_medium *start;     /* IO_CHANNEL_COUNT, of which the sigmas are used                     */
    struct fit_progress progress;
};

struct fit_picture_result {
    struct fit_estimate channels[FIT_CHANNEL_COUNT];
    bool has_converged;
    double rms_residual; /* over all channels, see struct fit_estimate                              */
    double scale_error, tile_error; /* relative, taken into the intervals                                 */
    double spacing_mm; /* of the light samples at the end                                         */
    size_t sample_count, pixel_count, usable_pixel_count;
    int round_count;
    char note[256]; /* a promise that could not be kept, or ""                                 */
};

/*
 * Draw what the scene's light and view say about the picture, fit, and draw again with light samples as
 * close as the coefficients found need them, until that changes nothing.
 * Not converging is an answer. Fails with what render_create, render_capture_create, fit_pixels_create and
 * fit_operator_create fail with, or DIPOLE_BAD_VALUE (size or channels of the picture).
 */
DIPOLE_CHECKED bool fit_picture(const struct fit_picture_request *request,
                                struct fit_picture_result *result_out, dipole_status *status);

#endif
