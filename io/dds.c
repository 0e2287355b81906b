/* Layout: "Programming Guide for DDS" and "DDS_HEADER_DXT10",
 * learn.microsoft.com/windows/win32/direct3ddds. */
#include "io/dds.h"

#include "io/file.h"

#include <stdlib.h>

enum {
    HAS_CAPS = 0x1,
    HAS_HEIGHT = 0x2,
    HAS_WIDTH = 0x4,
    HAS_PITCH = 0x8,
    HAS_PIXEL_FORMAT = 0x1000,
    HAS_MIP_MAP_COUNT = 0x20000,
    HAS_DEPTH = 0x800000,

    PIXEL_FORMAT_BYTES = 32,
    PIXEL_FORMAT_IS_FOUR_LETTERS = 0x4,
    DX10 = 'D' | 'X' << 8 | '1' << 16 | '0' << 24,

    CAPS_TEXTURE = 0x1000,
    CAPS_COMPLEX = 0x8,
    CAPS2_VOLUME = 0x200000,

    RGBA_FLOAT = 2,
    RGBA_HALF = 10,
    TEXTURE_2D = 3,
    TEXTURE_3D = 4,

    WORD_COUNT = IO_DDS_HEADER_BYTES / 4
};

static void put_header(const struct io_texels *texels, uint8_t out[IO_DDS_HEADER_BYTES])
{
    const bool is_half = texels->value_size == 2;
    const bool is_volume = texels->depth > 1;
    const uint32_t words[WORD_COUNT] = {
        [0] = 'D' | 'D' << 8 | 'S' << 16 | ' ' << 24,
        [1] = 124, /* bytes of the header from here */
        [2] = HAS_CAPS | HAS_HEIGHT | HAS_WIDTH | HAS_PITCH | HAS_PIXEL_FORMAT | HAS_MIP_MAP_COUNT |
              (is_volume ? HAS_DEPTH : 0),
        [3] = (uint32_t)texels->height,
        [4] = (uint32_t)texels->width,
        [5] = (uint32_t)texels->row_bytes,
        [6] = (uint32_t)texels->depth,
        [7] = 1, /* levels */
        /* 11 reserved words */
        [19] = PIXEL_FORMAT_BYTES,
        [20] = PIXEL_FORMAT_IS_FOUR_LETTERS,
        [21] = DX10,
        /* five words for formats without four letters */
        /* Optional for a volume without mip maps, but some readers refuse one that is not "complex". */
        [27] = CAPS_TEXTURE | (is_volume ? CAPS_COMPLEX : 0),
        [28] = is_volume ? CAPS2_VOLUME : 0,
        /* three reserved words; then the header of Direct3D 10 */
        [32] = is_half ? RGBA_HALF : RGBA_FLOAT,
        [33] = is_volume ? TEXTURE_3D : TEXTURE_2D,
        [35] = 1, /* textures in the file */
        /* [36] could say that alpha is 1, but the loaders of D3DX refuse files that do */
    };
    for (size_t i = 0; i < WORD_COUNT; i++)
        out = io_bytes_put(out, words[i], 4);
}

void io_dds_pack(const struct io_texels *texels, const struct io_image *image, uint8_t *out)
{
    put_header(texels, out);
    io_texels_pack(texels, image, out + IO_DDS_HEADER_BYTES);
}

bool io_dds_write(const char *path, const struct io_image *image, int depth, bool is_half,
                  dipole_status *status)
{
    struct io_texels texels;
    if (!io_texels_init(&texels, path, image, depth, 4, is_half, status))
        return false;
    const size_t size = IO_DDS_HEADER_BYTES + texels.bytes;
    uint8_t *const data = malloc(size);
    if (!data) {
        const dipole_place place = { .source = path };
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for %zu bytes", size);
    }
    io_dds_pack(&texels, image, data);
    const bool done = io_file_write(path, data, size, status);
    free(data);
    return done;
}
