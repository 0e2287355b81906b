#include "io/texels.h"

#include "io/half.h"

#include <string.h>

bool io_texels_init(struct io_texels *texels, const char *path, const struct io_image *image, int depth,
                    size_t channel_count, bool is_half, dipole_status *status)
{
    const dipole_place place = { .source = path };
    if (image->channel_count != 3)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "a table of %d channels, expected 3",
                           image->channel_count);
    if (depth < 1 || image->width_px % depth != 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "%d slices in a width of %d, expected slices of equal width", depth,
                           image->width_px);
    if (is_half && !io_half_check(path, image, status))
        return false;
    /* An image has at most IO_IMAGE_PIXEL_LIMIT pixels: 4 GiB as texels. */
    *texels = (struct io_texels){ .width = (size_t)image->width_px / (size_t)depth,
                                  .height = (size_t)image->height_px,
                                  .depth = (size_t)depth,
                                  .channel_count = channel_count,
                                  .value_size = is_half ? 2 : 4 };
    texels->row_bytes = texels->width * channel_count * texels->value_size;
    texels->slice_bytes = texels->row_bytes * texels->height;
    texels->bytes = texels->slice_bytes * texels->depth;
    return true;
}

uint8_t *io_bytes_put(uint8_t *out, uint32_t value, size_t size)
{
    for (size_t i = 0; i < size; i++)
        out[i] = (uint8_t)(value >> (8 * i));
    return out + size;
}

static uint8_t *put_value(uint8_t *out, float value, size_t size)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return io_bytes_put(out, size == 2 ? io_half_from_float(value) : bits, size);
}

void io_texels_pack(const struct io_texels *texels, const struct io_image *image, uint8_t *out)
{
    for (size_t z = 0; z < texels->depth; z++)
        for (size_t y = 0; y < texels->height; y++) {
            const float *in = image->pixels + ((y * texels->depth + z) * texels->width) * 3;
            for (size_t x = 0; x < texels->width; x++) {
                for (int c = 0; c < 3; c++)
                    out = put_value(out, *in++, texels->value_size);
                if (texels->channel_count == 4)
                    out = put_value(out, 1.0f, texels->value_size);
            }
        }
}
