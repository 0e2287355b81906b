/*
 * Where light enters: a picture taken from a light, reduced to samples no farther apart on the surface
 * than the spacing asked. Pure C on plain arrays: no OpenGL here. theory.md T13.
 */
#ifndef RENDERER_LIGHT_SAMPLES_H
#define RENDERER_LIGHT_SAMPLES_H

#include "libdipole/dipole.h"
#include "renderer/z_order.h"

#include <stdint.h>

/* Light that enters through one patch of surface. */
struct render_light_sample {
    float position_mm[3]; /* flux-weighted mean of the patch          */
    float footprint_mm;   /* largest extent of the patch              */
    float flux_w[3];      /* transmitted power per channel, in W      */
    float object;         /* whose surface it is; 0 without object ids */
    float spread_mm2[6];  /* mean of d d^T, weighted alike, d from position_mm: xx yy zz yz zx xy */
};

/* Weighted sums of positions, from which mean and spread follow. */
struct render_spread_sums {
    double weight, first[3], second[6];
};

static inline void render_spread_add(struct render_spread_sums *sums, double weight, double x_mm,
                                     double y_mm, double z_mm)
{
    const double x = weight * x_mm, y = weight * y_mm, z = weight * z_mm;
    sums->weight += weight;
    sums->first[0] += x;
    sums->first[1] += y;
    sums->first[2] += z;
    sums->second[0] += x * x_mm;
    sums->second[1] += y * y_mm;
    sums->second[2] += z * z_mm;
    sums->second[3] += y * z_mm;
    sums->second[4] += z * x_mm;
    sums->second[5] += x * y_mm;
}

/* Times scale; less where that is more than patches of spacing_mm have, as where texels lie at two depths.
 */
void render_spread_of(const struct render_spread_sums *sums, double scale, double spacing_mm,
                      float spread_mm2[6]);

struct render_light_samples {
    struct render_light_sample *samples;
    size_t count, capacity;
    uint64_t *codes; /* of the cubes of cell_samples.h; NULL, or old, for others */
    size_t code_capacity;
};

enum { RENDER_LIGHT_BLOCK_LIMIT = 128 };

/* One picture from a light: size_px x size_px texels of { x, y, z in mm, power share }, where
 * power share times the light's rgb is the transmitted power in W of the texel; 0 where no surface is. */
struct render_light_view {
    const float *texels;
    const float *objects; /* of each texel: object + 1; NULL: all are object 0 */
    const float
        *irradiance; /* of each texel, per rgb; NULL, or in place of its flux samples get their mean */
    int size_px;
    double forward[3]; /* unit vector, the view's depth axis */
    double eye_depth_mm,
        texel; /* perspective: the eye's place along forward; a texel's width at distance 1 */
    double rgb[3];
    int block_px; /* texels are merged in square blocks of so many a side, 1 to RENDER_LIGHT_BLOCK_LIMIT */
    const float *rest_mm; /* of each texel, of four floats: its surface at rest; for cell_samples.h      */
    const float *shadows; /* of blocks, four floats: part of each channel's power that arrives; NULL: all */
    int shadow_block_px, shadow_side_px; /* texels a side of a block, and blocks a side              */
    double flux_factor; /* 0: 1. Samples carry so much of the flux                               */
    bool is_shifted;    /* blocks begin half of one before the view does                              */
    /* In place of texels and objects: draws those of the tile whose lower left texel is (x, y), or says
     * that it is empty; as render_light_tiles_draw. Tiles begin where blocks do; each is a power of two
     * blocks wide. Nothing else of a texel is known then. */
    bool (*draw_tile)(const void *tiles, int x, int y, float *texels, float *objects);
    const void *tiles;
    int tile_px;
    size_t tile_object_count; /* 0: objects are not told apart */
};

/* How many texels before the view its first blocks begin. */
static inline int render_light_view_shift_px(const struct render_light_view *view)
{
    return view->is_shifted ? view->block_px / 2 : 0;
}

/* Texels a side of tiles that are drawn and sampled while they are in a processor's cache. */
int render_light_tile_px(int block_px);

/* Add what arrives of a texel's power share to that of each channel; nothing where the view has no shadows.
 */
static inline void render_light_view_add_shadow(const struct render_light_view *view, int x, int y,
                                                double share, double arriving[3])
{
    if (!view->shadows)
        return;
    const size_t row = (size_t)(y / view->shadow_block_px), column = (size_t)(x / view->shadow_block_px);
    const float *const shadow = view->shadows + 4 * (row * (size_t)view->shadow_side_px + column);
    for (int k = 0; k < 3; k++)
        arriving[k] += share * (double)shadow[k];
}

/* Where the samples of an object go, and how far apart they may be. NULL: it gets none. */
struct render_light_target {
    struct render_light_samples *samples;
    double spacing_mm;
    double cell_mm,
        origin_mm[3]; /* of cell_samples.h: side of a cube, and a corner of the object at rest */
};

/*
 * Append the samples of one view to the target of each object, of which there are as many as objects (or
 * one): each block of block_px texels a side is halved, across the side that is
 * longer on the surface, until both extents on the surface (size across the view and depth range) are at
 * most spacing_mm, or one texel is left. Objects in one block are sampled one after the other. Neighbours
 * in the list are near each other in space. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_light_samples_append(const struct render_light_target *targets,
                                                const struct render_light_view *view,
                                                dipole_status *status);

/*
 * Append to *merged one sample for each object in each cube of side cell_mm that holds samples: total flux,
 * flux-weighted mean position. They are ordered along a space-filling curve. Fails with
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_light_samples_merge(const struct render_light_samples *samples, double cell_mm,
                                               struct render_light_samples *merged, dipole_status *status);

/* What merging shares with cell_samples.c: the sample that the keys' samples are together, and sorting. */
struct render_light_sample render_light_samples_merge_run(const struct render_light_samples *samples,
                                                          const struct render_z_key *keys, size_t count);

/* Append one sample. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_light_samples_add(struct render_light_samples *samples,
                                             const struct render_light_sample *sample,
                                             dipole_status *status);

/* Append all of others, without codes. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_light_samples_add_all(struct render_light_samples *samples,
                                                 const struct render_light_samples *others,
                                                 dipole_status *status);

/* By object, then code; equal ones stay in their order. Both hold count keys; returns the one that is
 * sorted. */
struct render_z_key *render_light_samples_sort_keys(struct render_z_key *keys, struct render_z_key *spare,
                                                    size_t count);
/* The cube of side cell_mm that a position is in, as its place on a space-filling curve; 2^21 to a side. */
uint64_t render_cube_code(const double position_mm[3], const double min_mm[3], double cell_mm);

void render_light_samples_destroy(struct render_light_samples *samples);

#endif
