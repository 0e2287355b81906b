/* How far a picture is from the reference. */
#ifndef ACCURACY_ERROR_H
#define ACCURACY_ERROR_H

#include "io/exr.h"

/* Of radiance, over interior pixels (interior.h), all channels together. */
struct accuracy_error {
    double rmse_all; /* like rmse, but over all pixels that show an object, edges as well             */
    double rmse;     /* sqrt(sum (L - L_ref)^2 / sum L_ref^2)                                    */
    double weber_99; /* 99th percentile of |L - L_ref|/L_ref where L_ref is above 1e-4 of the brightest */
    double max;      /* largest |L - L_ref| over the brightest L_ref                             */
    size_t pixel_count;
};

/* Pictures of 4 channels and the same size, and the kind of each pixel. Fails with DIPOLE_BAD_VALUE (sizes
 * differ, no pixel is interior, the reference is black) or DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool accuracy_error_measure(const struct io_image *reference, const struct io_image *picture,
                                           const unsigned char *kinds, struct accuracy_error *error_out,
                                           dipole_status *status);

/* Signed difference as a picture of 3 channels, mean of the channels: red is too bright, blue too dark,
 * white none, full colour at limit times the brightest. */
DIPOLE_CHECKED bool accuracy_difference_create(const struct io_image *reference,
                                               const struct io_image *picture, double limit,
                                               struct io_image **image_out, dipole_status *status);

#endif
