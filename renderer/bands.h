/*
 * The profile as a sum of bands of scale: each reaches twice as far as the last, is as much smoother, and
 * is summed over light samples twice as far apart: what is far from a sample need not know exactly where it
 * is. theory.md T21.
 */
#ifndef RENDERER_BANDS_H
#define RENDERER_BANDS_H

#include "renderer/footprint.h"
#include "renderer/media.h"

/* Nodes of a table: steps of less than 0.2 % of the distance, which interpolation errs by some 1e-5 of the
 * profile for. */
enum { RENDER_BAND_LIMIT = 12, RENDER_BAND_NODES = 8193, RENDER_CAP_TERMS = 4 };

struct render_band {
    double spacing_mm; /* of the light samples that it is summed over                              */
    double cap_mm;     /* within, the profile is replaced by a smooth cap; 0: it is not, the finest */
    double r_outer_mm; /* the band is 0 beyond: the next one's cap, of the last r_max               */
};

/* Bands for samples spacing_mm apart at the finest, out to r_max_mm; each one's cap is cap_spacings of its
 * spacings wide. Returns how many. */
int render_bands_make(double spacing_mm, double r_max_mm, double cap_spacings,
                      struct render_band bands[RENDER_BAND_LIMIT]);

/* Where a medium's profile comes from: a row of a table, and where spread_mm or a channel's blur_mm > 0
 * its average by footprint.h. */
struct render_band_source {
    const struct lut_splat *table;
    size_t row;
    const struct render_medium *medium;
    double spread_mm, blur_mm[IO_CHANNEL_COUNT];
};

/* What tables of bands are made for. */
struct render_band_key {
    struct render_band_source source;
    int band_count; /* 0: of nothing */
    struct render_band bands[RENDER_BAND_LIMIT];
};
bool render_band_keys_are_same(const struct render_band_key *a, const struct render_band_key *b);

/* A profile in bands. */
struct render_split {
    struct render_band_source source;
    int band_count;
    struct render_band bands[RENDER_BAND_LIMIT];
    double caps[RENDER_BAND_LIMIT][IO_CHANNEL_COUNT][RENDER_CAP_TERMS]; /* in powers of 1 - (r/cap)^2 */
    struct render_footprint *averaged[IO_CHANNEL_COUNT];                /* NULL: the table's           */
};

/* Table and medium must outlive the split, which the caller ends with render_split_end, even on failure. */
DIPOLE_CHECKED bool render_split_init(const struct render_band_source *source,
                                      const struct render_band *bands, int band_count,
                                      struct render_split *split, dipole_status *status);
void render_split_end(struct render_split *split);

/* One band at r_mm, in 1/mm^2, and the sum of it and all beyond it: of the first the whole profile. */
void render_split_band_per_mm2(const struct render_split *split, int band, double r_mm,
                               double rgb_out[IO_CHANNEL_COUNT]);
void render_split_from_per_mm2(const struct render_split *split, int band, double r_mm,
                               double rgb_out[IO_CHANNEL_COUNT]);

/* The axis of the bands' own tables: in the logarithm (power 0), with nodes as dense as the caps need. */
struct lut_axis render_bands_axis(const struct render_band_source *source);

/* Each band's table on that axis: R G B 0 per node, band after band, node_count x 4 floats each.
 * Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_bands_bake(const struct render_band_source *source,
                                      const struct render_band *bands, int band_count, float *rgb,
                                      dipole_status *status);

#endif
