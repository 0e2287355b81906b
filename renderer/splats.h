/* Light samples grouped into splats: rectangles on the picture that hold all that the samples reach. */
#ifndef RENDERER_SPLATS_H
#define RENDERER_SPLATS_H

#include "renderer/light_samples.h"
#include "renderer/projection.h"

#include <stdint.h>

/* At most so many samples share one rectangle. */
enum { RENDER_SPLAT_SAMPLES = 32 };

/* Where the profile of a band stands in the table that the shader reads (common/profile.glsl). */
struct render_splat_profile {
    float reach2_mm2, first_node, inverse_scale2, nodes_per_log2;
};

/* A row of the instance buffer. */
struct render_splat {
    float rectangle[4];             /* left, bottom, right, top in -1..1                        */
    float depth;                    /* linear depth of the nearest point that is reached, 0..1  */
    uint32_t first, count;          /* its samples                                              */
    float object;                   /* whose light it is; 0 without object ids                  */
    float centre_mm[3], reach2_mm2; /* no sample reaches farther from their middle      */
    struct render_splat_profile profile;
};

/* Begin with { 0 }, end with render_splats_destroy. */
struct render_splats {
    struct render_splat *splats;
    size_t count, capacity;
};

/*
 * Append splats: samples of one object that follow each other and lie close together, compared with
 * r_max_mm, are grouped; what cannot be seen is left out. first_sample: how many samples stand before these
 * in the buffer. sample_limit: at most so many share a splat, 1 to RENDER_SPLAT_SAMPLES. Fails with
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_splats_append(struct render_splats *splats,
                                         const struct render_light_samples *samples, size_t first_sample,
                                         const struct render_projection *camera, double r_max_mm,
                                         const struct render_splat_profile *profile, size_t sample_limit,
                                         dipole_status *status);
void render_splats_destroy(struct render_splats *splats);

#endif
