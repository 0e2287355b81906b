/*
 * Light samples of one object for each band: merged in cubes that double, in groups of eight under a tree
 * of boxes. theory.md T43.
 */
#ifndef RENDERER_GATHER_SOURCES_H
#define RENDERER_GATHER_SOURCES_H

#include "renderer/gather_kernel.h"

enum { RENDER_GATHER_FAN = 8, RENDER_GATHER_DEPTH = 9 };

/* Groups, and the boxes about them: boxes[0] of each group, boxes[1] of RENDER_GATHER_FAN of those, up to a
 * single one.
 */
struct render_gather_level {
    size_t source_count, group_count;
    struct render_gather_group *groups;
    int depth; /* of boxes; 0: there are no samples */
    size_t box_counts[RENDER_GATHER_DEPTH];
    struct render_gather_box *boxes[RENDER_GATHER_DEPTH];
};

struct render_gather_sources {
    int band_count;
    struct render_gather_level levels[RENDER_BAND_LIMIT];
};

/* Samples are merged in cubes as wide as each band's spacing. codes: of each sample the cube of
 * cell_samples.h that it is of, which is merged with its neighbours at rest instead, 2^band to a side, so
 * that the same samples are merged however the object moves; NULL: by where they are. averaged_mm: what the
 * profile is averaged over, render_band_source's spread_mm. Fails with
 * DIPOLE_OUT_OF_MEMORY; end them with render_gather_sources_end in any case. */
DIPOLE_CHECKED bool render_gather_sources_init(const struct render_light_sample *samples,
                                               const uint64_t *codes, int code_level, size_t count,
                                               const struct render_band *bands, int band_count,
                                               double averaged_mm, struct render_gather_sources *sources,
                                               dipole_status *status);
void render_gather_sources_end(struct render_gather_sources *sources);

/* Write to groups those that the box reaches, at most capacity; returns how many there are. */
size_t render_gather_find(const struct render_gather_level *level, const struct render_gather_box *box,
                          float reach_mm, uint32_t *groups, size_t capacity);

#endif
