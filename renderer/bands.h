/*
 * The profile as a sum of bands, each on a ring of distances twice as wide as the last and sampled twice as
 * coarsely: what is far from a sample need not know exactly where it is. theory.md T21.
 */
#ifndef RENDERER_BANDS_H
#define RENDERER_BANDS_H

#include "lutgen/lut.h"

enum { RENDER_BAND_LIMIT = 8 };

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

/* The axis of the bands' own tables: in the logarithm (power 0), with nodes as dense as the weights need.
 */
struct lut_axis render_bands_axis(const struct lut_splat *table);

/*
 * Each band's table, R G B 0 per node on that axis: band after band, node_count x 4 floats
 * each. The caller frees it; NULL: no memory.
 */
float *render_bands_bake(const struct lut_splat *table, const struct render_band *bands, int band_count);

#endif
