/* Half floats: 1 sign, 5 exponent and 10 fraction bits, as IEEE 754 binary16. */
#ifndef IO_HALF_H
#define IO_HALF_H

#include "io/exr.h"

#include <stdint.h>

/* Nearest half, ties to even; what rounds beyond 65504 becomes infinity, NaN stays NaN. */
uint16_t io_half_from_float(float value);

/* Exact. */
float io_float_from_half(uint16_t half);

/* Fails with DIPOLE_BAD_VALUE where a finite value of the image rounds beyond 65504, naming path, pixel and
 * channel: a clamped table would be silently wrong. */
DIPOLE_CHECKED bool io_half_check(const char *path, const struct io_image *image, dipole_status *status);

#endif
