/* Colours of what a report shows: uses of pixels, and signed differences. sRGB, R, G, B. */
#ifndef FIT_REPORT_COLOR_H
#define FIT_REPORT_COLOR_H

#include "fit/use.h"
#include "io/exr.h"

/* White for pixels that are used. The others are those of Okabe and Ito (2008), which colour-blind readers
 * can tell apart, and two greys. */
extern const unsigned char fit_use_colors[FIT_USE_COUNT][3];

/* Where there is no difference to show. */
extern const unsigned char fit_no_difference_color[3];

/*
 * Blue at position -1 (or below), white at 0, red at 1 (or above), straight lines between in sRGB. Both
 * sides are equally dark, within 0.4 of CIELAB's L*, so that lightness says how large a difference is, and
 * blue against red which sign it has, which every common kind of colour-blindness leaves apart. NaN gives
 * fit_no_difference_color.
 */
void fit_difference_color(double position, unsigned char rgb[3]);

/* Give pixel index of an image with 3 channels the linear values that become rgb in a PNG. */
void fit_pixel_set(struct io_image *image, size_t index, const unsigned char rgb[3]);

/* The uses in their colours, each pixel the commonest of its box of factor x factor (the first of the enum
 * among equals); boxes at the right and lower edges are cut. uses are below FIT_USE_COUNT. */
DIPOLE_CHECKED bool fit_uses_draw(const unsigned char *uses, int width_px, int height_px, int factor,
                                  struct io_image **image_out, dipole_status *status);

#endif
