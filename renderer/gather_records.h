/*
 * What shaders need to gather by: tiles of places, and for each band the samples near them. Pure C; who
 * draws them is gather_gl.c. theory.md T43.
 */
#ifndef RENDERER_GATHER_RECORDS_H
#define RENDERER_GATHER_RECORDS_H

#include "renderer/gather_places.h"

/*
 * Words of a tile, from its first_word on: one for each node, row by row, 0 where it has nothing to do:
 *     bits 0 to 23   the pixel that it stands at
 *     bits 24 to 27  which nodes about it what is coarser is interpolated from; none: it sums that itself
 *     bit 28         1
 * then for each band the number of words that follow for it, and those: groups of samples,
 *     bits 0 to 7    which of the eight are near
 *     bits 8 to 31   number of the group, of all objects and bands
 */
enum { RENDER_GATHER_MASK_SHIFT = 24, RENDER_GATHER_NODE_BIT = 1 << 28, RENDER_GATHER_GROUP_SHIFT = 8 };
#define RENDER_GATHER_GROUP_LIMIT ((size_t)1 << (32 - RENDER_GATHER_GROUP_SHIFT))

struct render_gather_record {
    int32_t x, y; /* in tiles */
    uint32_t first_word;
    int32_t coarser;      /* level to interpolate from; -1: there is none */
    int32_t first_kernel; /* of the first band that is listed */
    int32_t band_count, refined_band_count;
    int32_t object;
};

struct render_gather_records {
    struct render_gather_record *tiles;
    uint32_t *words;
    size_t tile_count, word_count, tile_capacity, word_capacity;
};

/* Of object o's band b: number of its first group. */
static inline size_t render_gather_band_number(size_t object, int band)
{
    return object * RENDER_BAND_LIMIT + (size_t)band;
}

/* The records of rows of tiles first to end - 1 of a level, in place of what records held. first_groups:
 * by render_gather_band_number, that is a kernel's number, too. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_gather_record(const struct render_gather_places_of_frame *places, int level,
                                         int first_row, int end_row, const uint32_t *first_groups,
                                         struct render_gather_records *records, dipole_status *status);
void render_gather_records_end(struct render_gather_records *records);

#endif
