/* Photographs and PNG by OpenImageIO (image.cpp is the shim). */
#ifndef IO_IMAGE_H
#define IO_IMAGE_H

#include "io/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write 8-bit sRGB PNG from linear values in 0..1 (clamped, rounded to nearest, no dither), atomically.
 * Alpha is premultiplied in memory. Same image, same bytes; attributes are not kept. */
DIPOLE_CHECKED bool io_png_write(const char *path, const struct io_image *image, dipole_status *status);

/* Read any format OpenImageIO knows into linear RGB(A) floats; integers are taken as sRGB, and alpha is
 * premultiplied. Grey stays one channel, with its alpha dropped; channels after the fourth are, too. */
DIPOLE_CHECKED bool io_photo_read(const char *path, struct io_image **image_out, dipole_status *status);

#ifdef __cplusplus
}
#endif
#endif
