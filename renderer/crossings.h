/* Where a ray from a light crosses the surfaces of blockers, made into what they keep of it. Pure C.
 * theory.md T65. */
#ifndef RENDERER_CROSSINGS_H
#define RENDERER_CROSSINGS_H

#include "io/scene_file.h"
#include "renderer/transmittance.h"

struct render_crossing {
    float depth_mm; /* from the light */
    unsigned blocker;
    bool is_entry; /* the surface faces the light */
};

/*
 * Order the crossings of one ray by blocker and depth, and write a segment for each way through a solid,
 * each surface of a sheet and each particle; at most count. A solid that is left more often than it is
 * entered holds the light: the way begins at least_mm (INFINITY: it cannot, and is a sheet there). One that
 * is never left is a sheet, and no more than its opacity. mm_per_depth: of the ray, 1 or more, by which
 * extinction counts. Returns how many.
 */
size_t render_crossings_pair(const struct io_blocker *blockers, struct render_crossing *crossings,
                             size_t count, double least_mm, double mm_per_depth,
                             struct render_segment *segments);

/* Whether some channel lets light through; whether channels differ. */
bool render_blocker_is_opaque(const struct io_blocker *blocker);
bool render_blocker_is_coloured(const struct io_blocker *blocker);
/* Whether it blocks at all. */
bool render_blocker_is_there(const struct io_blocker *blocker);

#endif
