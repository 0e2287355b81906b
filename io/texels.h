/* A table's texels as bytes, for files that hold little else: low byte first on every machine. */
#ifndef IO_TEXELS_H
#define IO_TEXELS_H

#include "io/exr.h"

#include <stdint.h>

/* How a table of depth slices of width x height lies in memory: x fastest, then y from the top, then the
 * slice, without gaps. Sizes are in texels and bytes. */
struct io_texels {
    size_t width, height, depth;
    size_t channel_count, value_size; /* 3 or 4; 2 (half) or 4 (float) */
    size_t row_bytes, slice_bytes, bytes;
};

/*
 * Layout of an image of 3 channels, in which depth slices lie side by side, as texels of channel_count: 3,
 * or 4 with alpha 1. Fails with DIPOLE_BAD_VALUE, naming path, when the image has other channels, its width
 * is not a multiple of depth, or, in half, as io_half_check does.
 */
DIPOLE_CHECKED bool io_texels_init(struct io_texels *texels, const char *path, const struct io_image *image,
                                   int depth, size_t channel_count, bool is_half, dipole_status *status);

/* Write the texels->bytes of the image. */
void io_texels_pack(const struct io_texels *texels, const struct io_image *image, uint8_t *out);

/* Low byte first; returns what follows. */
uint8_t *io_bytes_put(uint8_t *out, uint32_t value, size_t size);

#endif
