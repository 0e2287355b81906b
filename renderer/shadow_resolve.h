/*
 * Lists of blockers' surfaces, as they were drawn from a light, made into the transmittance of each texel.
 * Pure C on plain arrays, on all processors. theory.md T62 to T65.
 */
#ifndef RENDERER_SHADOW_RESOLVE_H
#define RENDERER_SHADOW_RESOLVE_H

#include "io/scene_file.h"

#include <stdint.h>

/* One surface in one texel, as avsm_list.frag writes it: the texel times 1024 plus the blocker; and the
 * bits of its depth as a float, below 0 where light enters. */
struct render_shadow_item {
    uint32_t where, depth;
};
enum { RENDER_SHADOW_ITEM_BLOCKERS = 1024 };

/* Places of nodes are floats in ranges. */
#define RENDER_SHADOW_NODE_TOTAL ((size_t)1 << 24)

/* Curves of a map of size_px x size_px texels. */
struct render_shadow_curves {
    const struct io_blocker *blockers;
    int size_px, node_limit; /* of each texel; INT_MAX: no limit */
    bool has_colour;         /* nodes are { depth, left in r, g, b }, else { depth, left } of channel 0  */
    double half_width;       /* of the view */
    bool is_parallel;
    float *ranges; /* first and last depth, place of the first node, how many; 0: nothing blocks */
    float *nodes;  /* behind the last of each texel: { 0, mean depth of what stays }           */
    size_t node_count, node_capacity;
};

/* Room for the ranges of an empty map; end it with render_shadow_curves_destroy. Fails with
 * DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_shadow_curves_begin(struct render_shadow_curves *curves, dipole_status *status);

/* Add the texels of rows first to end - 1, of which these are the items, in any order. The same items give
 * the same curves. Fails with DIPOLE_OUT_OF_MEMORY, or DIPOLE_NOT_SUPPORTED for more than
 * RENDER_SHADOW_NODE_TOTAL nodes. */
DIPOLE_CHECKED bool render_shadow_curves_add(struct render_shadow_curves *curves,
                                             const struct render_shadow_item *items, size_t count,
                                             int first, int end, dipole_status *status);

void render_shadow_curves_destroy(struct render_shadow_curves *curves);

#endif
