/*
 * One band of a profile as eight polynomials for each channel, and the loop that sums it: light samples at
 * eight places at a time. Single precision. theory.md T43.
 */
#ifndef RENDERER_GATHER_KERNEL_H
#define RENDERER_GATHER_KERNEL_H

#include "renderer/bands.h"
#include "renderer/light_samples.h"

#include <stdint.h>

enum { RENDER_GATHER_LANES = 8, RENDER_GATHER_PIECES = 8, RENDER_GATHER_TERMS = 4 };

/*
 * Of u = 1 + (distance squared) x inverse, pieces end at 1, 1.5, 2, 3, 4, 6, 8, 12, 16, half powers of two:
 * bits 22 to 24 of u as a float are the piece's column. Polynomials in the mantissa of u, 1 to 1.5 over the
 * lower and the upper half alike, less 1.25.
 */
struct render_gather_kernel {
    float inverse_per_mm2, reach2_mm2;
    float lost_per_mm2[IO_CHANNEL_COUNT]; /* of the power, for each mm^2 of spread, and given back */
    float averaged_mm2; /* the profile is averaged over this variance, each way along the surface */
    bool is_grey;       /* the same in all channels: one need be looked up */
    _Alignas(32) float slope[RENDER_GATHER_PIECES]; /* of the mantissa, per mm^2 of the distance squared */
    _Alignas(32) float terms[IO_CHANNEL_COUNT][RENDER_GATHER_TERMS][RENDER_GATHER_PIECES];
};

void render_gather_kernel_init(const struct render_split *split, int band,
                               struct render_gather_kernel *kernel);

/* The band in 1/mm^2, 0 beyond the reach: mean over sources that are spread, to the second order, of which
 * step_mm leads to the place. */
void render_gather_kernel_at(const struct render_gather_kernel *kernel, const float step_mm[3],
                             const float spread_mm2[6], float rgb_out[IO_CHANNEL_COUNT]);

/* Half its derivative along the step by the step's length, in 1/mm^4, as if they were spread the same in
 * the plane. */
void render_gather_kernel_change_at(const struct render_gather_kernel *kernel, const float step_mm[3],
                                    const float spread_mm2[6], float rgb_out[IO_CHANNEL_COUNT]);

/* Places, one column each. */
struct render_gather_places {
    _Alignas(32) float position_mm[3][RENDER_GATHER_LANES];
    _Alignas(32) float sums[IO_CHANNEL_COUNT][RENDER_GATHER_LANES];
    _Alignas(
        32) float slopes[IO_CHANNEL_COUNT][3][RENDER_GATHER_LANES]; /* of the sums, per mm along x y z */
};

/* Light that enters about a point: flux, mean position, and how far it is spread: the mean of d d^T, d the
 * distance from the mean position, all weighted by flux, less what the profile is averaged over:
 * averaged_mm2 on the diagonal. */
struct render_gather_source {
    float position_mm[3];
    float flux_w[IO_CHANNEL_COUNT];
    float spread_mm2[6]; /* xx yy zz yz zx xy */
};

/* Eight sources, as they are chosen by distance and as they are summed. */
struct render_gather_group {
    _Alignas(32) float position_mm[3][RENDER_GATHER_LANES];
    struct render_gather_source sources[RENDER_GATHER_LANES];
};

/* A box of space. */
struct render_gather_box {
    float min_mm[3], max_mm[3];
};

/* The same functions for each kind of processor (gather_portable.c, gather_avx2.c). */
struct render_gather_loops {
    /* Sources of the group that are within reach of the box, a bit each. */
    unsigned (*near)(const struct render_gather_group *group, const struct render_gather_box *box,
                     float reach2_mm2);
    /* The same of groups by their numbers, one after the other: adds sources to the list, of which *listed
     * are there, until it may not hold those of one more. Returns how many groups were looked at. */
    size_t (*list)(const struct render_gather_group *groups, const uint32_t *numbers, size_t count,
                   const struct render_gather_box *box, float reach2_mm2,
                   const struct render_gather_source **sources, size_t *listed, size_t capacity);
    /* Add flux x profile of each source in the list to the places' sums. */
    void (*sum)(const struct render_gather_kernel *kernel,
                const struct render_gather_source *const *sources, size_t count,
                struct render_gather_places *places);
    /* The same, and to their slopes. */
    void (*sum_with_slopes)(const struct render_gather_kernel *kernel,
                            const struct render_gather_source *const *sources, size_t count,
                            struct render_gather_places *places);
};
extern const struct render_gather_loops render_gather_loops_portable;
#if defined(__x86_64__)
extern const struct render_gather_loops render_gather_loops_avx2;
#endif

/* Those of the processor that this runs on. */
const struct render_gather_loops *render_gather_loops_best(void);

#endif
