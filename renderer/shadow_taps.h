/* Where soft shadows look: places spread over a disc. theory.md T68. */
#ifndef RENDERER_SHADOW_TAPS_H
#define RENDERER_SHADOW_TAPS_H

#include "libdipole/dipole.h"

/* Beyond, the spiral of T66 is left as it is, which no longer matters. */
enum { RENDER_SHADOW_RELAXED_LIMIT = 128 };

/*
 * count (1 or more) places in the disc of radius 1, each in the middle of the part of the disc that is
 * nearest to it, parts of the same area but for 1 or 2 %: no two are near each other, and none is on the
 * rim. The same places for the same count. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_shadow_taps(int count, double (*places)[2], dipole_status *status);

/* The same, count of them, on the spiral of T66. */
void render_shadow_spiral(int count, double (*places)[2]);

#endif
