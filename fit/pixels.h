/* Which pixels of a picture tell about the medium, and what their radiosity is. Plain arrays. */
#ifndef FIT_PIXELS_H
#define FIT_PIXELS_H

#include "fit/estimate.h"
#include "io/exr.h"
#include "renderer/render.h"

/* One allocation apart from the arrays it names; end it with fit_pixels_destroy. */
struct fit_pixels {
    size_t count, usable_count; /* chosen, out of those that could be                               */
    float *positions_mm;        /* count x 3                                                        */
    float *radiosity_w_per_mm2; /* count x FIT_CHANNEL_COUNT: (radiance - specular) / exit          */
    int *tiles;                 /* count: squares a sixteenth as wide as the object's box           */
    int tile_count;
};

/*
 * Choose at most about limit pixels, spread evenly, from those that the capture explains: wholly covered,
 * finite, and not mostly specular in any channel. The same input gives the same choice. picture has the
 * capture's size and 3 or 4 channels; place (may be NULL) is its file.
 * Fails with DIPOLE_BAD_VALUE when fewer than FIT_PIXEL_MIN are left, saying what became of the others, or
 * DIPOLE_OUT_OF_MEMORY; *pixels_out is then NULL.
 */
enum { FIT_PIXEL_MIN = 100 };
DIPOLE_CHECKED bool fit_pixels_create(const struct render_capture *capture, const struct io_image *picture,
                                      size_t limit, const dipole_place *place,
                                      struct fit_pixels **pixels_out, dipole_status *status);
void fit_pixels_destroy(struct fit_pixels *pixels);

#endif
