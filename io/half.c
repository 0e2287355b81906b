#include "io/half.h"

#include <math.h>
#include <string.h>

uint16_t io_half_from_float(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000u);
    const uint32_t magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return sign | 0x7e00u; /* NaN */
    if (magnitude >= 0x47800000u)
        return sign | 0x7c00u;   /* 65536 and more */
    if (magnitude < 0x38800000u) /* below 2^-14 a half counts in units of 2^-24; rintf rounds to even */
        return sign | (uint16_t)rintf(fabsf(value) * 0x1p24f);
    const uint32_t odd = magnitude >> 13 & 1u;
    return sign | (uint16_t)((magnitude - 0x38000000u + 0xfffu + odd) >> 13);
}

float io_float_from_half(uint16_t half)
{
    const bool is_finite = (half & 0x7c00u) != 0x7c00u;
    const uint32_t bits = (half & 0x7fffu) << 13 | (is_finite ? 0u : 0x7f800000u);
    float value;
    memcpy(&value, &bits, sizeof value);
    if (is_finite) /* exponents of half and float differ by 112 */
        value *= 0x1p112f;
    return half & 0x8000u ? -value : value;
}

bool io_half_check(const char *path, const struct io_image *image, dipole_status *status)
{
    const size_t channel_count = (size_t)image->channel_count, width = (size_t)image->width_px;
    const size_t count = width * (size_t)image->height_px * channel_count;
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(image->pixels[i]) || (io_half_from_float(image->pixels[i]) & 0x7fffu) < 0x7c00u)
            continue;
        const size_t pixel = i / channel_count;
        const dipole_place place = { .source = path };
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "pixel (%zu, %zu) of channel %c is %g, expected at most 65504 in half",
                           pixel % width, pixel / width,
                           channel_count == 1 ? 'Y' : "RGBA"[i % channel_count],
                           (double)image -> pixels[i]);
    }
    return true;
}
