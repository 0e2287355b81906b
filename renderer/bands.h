/*
 * The profile as a sum of bands, each on a ring of distances twice as wide as the last and sampled twice as
 * coarsely: what is far from a sample need not know exactly where it is. theory.md T21.
 */
#ifndef RENDERER_BANDS_H
#define RENDERER_BANDS_H

#include "renderer/media.h"

/* Nodes of a table: steps of less than 0.2 % of the distance, which interpolation errs by some 1e-5 of the
 * profile for. */
enum { RENDER_BAND_LIMIT = 8, RENDER_BAND_NODES = 8193 };

struct render_band {
    double spacing_mm;             /* of the light samples that it is summed over      */
    double r_inner_mm, r_outer_mm; /* its weight is 0 outside                          */
    double rise_mm, fall_mm;       /* weight rises over rise..2 rise, falls over fall..2 fall;
                                      0: it is 1 from the start, to the end            */
};

/*
 * Bands for samples spacing_mm apart at the finest, out to r_max_mm. A band begins ring_spacings of the
 * finer band's spacings away: 6 err by less than 6e-5 of the total each, 2.3 more by ten times less.
 * Returns how many.
 */
int render_bands_make(double spacing_mm, double r_max_mm, double ring_spacings,
                      struct render_band bands[RENDER_BAND_LIMIT]);

/* Part of the profile that the band carries at r_mm, 0 to 1; the bands' weights add to 1. */
double render_band_weight(const struct render_band *band, double r_mm);

/* Where a medium's profile comes from: a row of a table, and where a channel's blur_mm > 0 its average
 * by footprint.h. */
struct render_band_source {
    const struct lut_splat *table;
    size_t row;
    const struct render_medium *medium;
    double blur_mm[IO_CHANNEL_COUNT];
};

/* The axis of the bands' own tables: in the logarithm (power 0), with nodes as dense as the weights need.
 */
struct lut_axis render_bands_axis(const struct render_band_source *source);

/* Each band's table on that axis: R G B 0 per node, band after band, node_count x 4 floats each.
 * Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_bands_bake(const struct render_band_source *source,
                                      const struct render_band *bands, int band_count, float *rgb,
                                      dipole_status *status);

#endif
