/* Light samples grouped into splats: rectangles on the picture that hold all that the samples reach. */
#ifndef RENDERER_SPLATS_H
#define RENDERER_SPLATS_H

#include "renderer/light_samples.h"
#include "renderer/projection.h"

#include <stdint.h>

/* At most so many samples share one rectangle. */
enum { RENDER_SPLAT_SAMPLES = 32 };

/* A row of the instance buffer. */
struct render_splat {
    float rectangle[4];    /* left, bottom, right, top in -1..1                        */
    float depth;           /* linear depth of the nearest point that is reached, 0..1  */
    uint32_t first, count; /* its samples                                              */
    uint32_t reserved;
    float centre_mm[3], reach2_mm2; /* no sample reaches farther from their middle */
};

struct render_splats {
    struct render_splat *splats;
    size_t count;
};

/*
 * Group samples that follow each other and lie close together, compared with r_max_mm; leave out what
 * cannot be seen. End it with render_splats_destroy. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_splats_create(const struct render_light_samples *samples,
                                         const struct render_projection *camera, double r_max_mm,
                                         struct render_splats *out, dipole_status *status);
void render_splats_destroy(struct render_splats *splats);

#endif
