/* Photographs and PNG by OpenImageIO (image.cpp is the shim). */
#ifndef IO_IMAGE_H
#define IO_IMAGE_H

#include "io/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write 8-bit sRGB PNG from linear values in 0..1 (clamped, rounded to nearest, no dither), atomically.
 * Alpha is premultiplied in memory. Same image, same bytes; attributes are kept, as description. */
DIPOLE_CHECKED bool io_png_write(const char *path, const struct io_image *image, dipole_status *status);

/* The same file in memory; the caller frees *bytes_out, which is NULL on failure. */
DIPOLE_CHECKED bool io_png_encode(const struct io_image *image, unsigned char **bytes_out, size_t *size_out,
                                  dipole_status *status);

/* What was in the file. */
struct io_photo_info {
    int bits;     /* of an integer code, 8 or 16 as a rule; 0: floating point                   */
    bool is_srgb; /* codes were decoded                                                         */
};

/* How integers are coded. */
enum io_photo_coding { IO_PHOTO_SRGB = 0, IO_PHOTO_LINEAR };

/* Read any format OpenImageIO knows into linear RGB(A) floats; alpha is premultiplied. Grey stays one
 * channel, with its alpha dropped; channels after the fourth are, too. info_out may be NULL. */
DIPOLE_CHECKED bool io_photo_read(const char *path, enum io_photo_coding coding,
                                  struct io_photo_info *info_out, struct io_image **image_out,
                                  dipole_status *status);

/* Width and height of a picture of any such format, without its pixels. */
DIPOLE_CHECKED bool io_photo_size(const char *path, int *width_px, int *height_px, dipole_status *status);

/* The linear value of an sRGB code, 0 to 1, and back (IEC 61966-2-1). */
double io_linear_from_srgb(double srgb);
double io_srgb_from_linear(double linear);

#ifdef __cplusplus
}
#endif
#endif
