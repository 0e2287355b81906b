/* Which pixels of a picture tell about the medium. Plain arrays. */
#ifndef FIT_PIXELS_H
#define FIT_PIXELS_H

#include "fit/photo.h"
#include "fit/use.h"
#include "renderer/render.h"

#include <stdint.h>

struct fit_pixel_request {
    const struct render_capture *capture; /* of the picture's size                                    */
    const struct fit_photo *photo;
    const struct io_image *mask;   /* of the same size: 0.5 and more is used; NULL: everything may be */
    const struct io_image *direct; /* radiance by direct light alone, of the same size, for the edges of
                                      shadows; NULL: they are not looked for                          */
    double gain;  /* about what the picture must be divided by to be in the capture's units           */
    size_t limit; /* of pixels to choose                                                              */
};

/* One allocation apart from the arrays it names; end it with fit_pixels_destroy. */
struct fit_pixels {
    size_t count;        /* chosen                                                                   */
    uint32_t *at;        /* their places in the picture, rising by cells                             */
    float *positions_mm; /* count x 3                                                                */
    int *objects;        /* count: which of the scene's objects, from 0                              */
    int *tiles;          /* count: squares a sixteenth as wide as the object's box                   */
    int tile_count;
    int width_px, height_px;
    size_t use_counts[FIT_USE_COUNT];
    unsigned char *uses; /* enum fit_use of every pixel                                              */
};

/*
 * Say what becomes of every pixel, and choose about limit of those that may be used, spread evenly. A pixel
 * must be wholly covered by one surface and finite; in no channel clipped (the highest code, or a value
 * that many pixels share as their highest), nor next to one that is; not mostly mirrored light; not crossed
 * by the edge of a shadow; and hold a value in some channel. The same input gives the same choice. Fails
 * with DIPOLE_BAD_VALUE when fewer than FIT_PIXEL_MIN are left, saying what became of the others, or
 * DIPOLE_OUT_OF_MEMORY; *pixels_out is then NULL. place (may be NULL) is the picture's file.
 */
enum { FIT_PIXEL_MIN = 100 };
DIPOLE_CHECKED bool fit_pixels_create(const struct fit_pixel_request *request, const dipole_place *place,
                                      struct fit_pixels **pixels_out, dipole_status *status);
void fit_pixels_destroy(struct fit_pixels *pixels);

/* Whether a channel of a pixel holds a value: not so dark that its code says nothing. */
bool fit_pixel_has_value(const struct fit_photo *photo, size_t pixel, int channel);

#endif
