/* Tables as bare numbers, and the JSON beside a table that says what its bytes are. Written only. */
#ifndef IO_RAW_H
#define IO_RAW_H

#include "io/exr.h"

/*
 * Write an image of 3 channels as RGB, float or half (rounded to nearest even), low byte first, without a
 * header: x fastest, then y from the top, then the depth slices that lie side by side in the image. Beside
 * it goes its sidecar. Each is written atomically, the sidecar last, so that one whose content_hash is that
 * of the bytes belongs to them, wherever writing was interrupted.
 *
 * Fails as io_texels_init does, with DIPOLE_OUT_OF_MEMORY, or as io_file_write and io_dds_sidecar_write do.
 */
DIPOLE_CHECKED bool io_raw_write(const char *path, const struct io_image *image, int depth, bool is_half,
                                 dipole_status *status);

/*
 * Write path.json, the sidecar of the file that io_dds_write makes of the image at path: layout and size of
 * its bytes, their hash (FNV-1a, 64 bit), and all attributes of the image. Numbers give back the same
 * double; a text whose attribute's name ends with _json stands there as JSON. docs/engines.md. The file is
 * not looked at: when others write there at the same time, the sidecar is of this image or of theirs, never
 * of a mixture.
 *
 * Fails as io_texels_init does; with DIPOLE_BAD_VALUE when an attribute is not finite, not UTF-8 or not the
 * JSON that its name promises; with DIPOLE_OUT_OF_MEMORY; or as io_file_write does.
 */
DIPOLE_CHECKED bool io_dds_sidecar_write(const char *path, const struct io_image *image, int depth,
                                         bool is_half, dipole_status *status);

/* Whether the file at path and its sidecar have the very bytes that io_raw_write, or io_dds_write and
 * io_dds_sidecar_write, would write. False, too, where
 * that cannot be found out. */
bool io_sidecar_is_current(const char *path, const struct io_image *image, int depth, bool is_half);

#endif
