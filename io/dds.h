/* DDS files, the textures of Direct3D, written only. */
#ifndef IO_DDS_H
#define IO_DDS_H

#include "io/texels.h"

/* Bytes before the texels: magic number, header, header of Direct3D 10. */
enum { IO_DDS_HEADER_BYTES = 4 + 124 + 20 };

/*
 * Write an image of 3 channels, atomically, as RGBA with alpha 1 in float (DXGI_FORMAT_R32G32B32A32_FLOAT)
 * or half (DXGI_FORMAT_R16G16B16A16_FLOAT, rounded to nearest even), without mip maps: a texture of two
 * dimensions when depth is 1, else a volume of the depth slices that lie side by side in the image. Rows
 * are from the top, as in the image. A DDS file has no attributes: io_dds_sidecar_write.
 *
 * Fails as io_texels_init does, with DIPOLE_OUT_OF_MEMORY, or as io_file_write does.
 */
DIPOLE_CHECKED bool io_dds_write(const char *path, const struct io_image *image, int depth, bool is_half,
                                 dipole_status *status);

/* The IO_DDS_HEADER_BYTES + texels->bytes of such a file; texels of 4 channels. */
void io_dds_pack(const struct io_texels *texels, const struct io_image *image, uint8_t *out);

#endif
