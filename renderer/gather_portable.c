/* For any processor. */
#include "renderer/gather_kernel.h"

static unsigned near(const struct render_gather_group *group, const struct render_gather_box *box,
                     float reach2_mm2)
{
    unsigned bits = 0;
    for (unsigned i = 0; i < RENDER_GATHER_LANES; i++) {
        float distance2 = 0;
        for (int k = 0; k < 3; k++) {
            const float x = group->position_mm[k][i];
            const float below = box->min_mm[k] - x, above = x - box->max_mm[k];
            const float gap = below > above ? below : above;
            distance2 += gap > 0 ? gap * gap : 0;
        }
        bits |= distance2 <= reach2_mm2 ? 1u << i : 0;
    }
    return bits;
}

static size_t list(const struct render_gather_group *groups, const uint32_t *numbers, size_t count,
                   const struct render_gather_box *box, float reach2_mm2,
                   const struct render_gather_source **sources, size_t *listed, size_t capacity)
{
    size_t g = 0;
    for (; g < count && *listed + RENDER_GATHER_LANES <= capacity; g++) {
        const struct render_gather_group *const group = &groups[numbers[g]];
        for (unsigned bits = near(group, box, reach2_mm2); bits; bits &= bits - 1)
            sources[(*listed)++] = &group->sources[__builtin_ctz(bits)];
    }
    return g;
}

static void sum(const struct render_gather_kernel *kernel,
                const struct render_gather_source *const *sources, size_t count,
                struct render_gather_places *places)
{
    for (size_t s = 0; s < count; s++) {
        const struct render_gather_source *const source = sources[s];
        for (int i = 0; i < RENDER_GATHER_LANES; i++) {
            float step_mm[3], rgb[IO_CHANNEL_COUNT];
            for (int k = 0; k < 3; k++)
                step_mm[k] = places->position_mm[k][i] - source->position_mm[k];
            render_gather_kernel_at(kernel, step_mm, source->spread_mm2, rgb);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                places->sums[c][i] += source->flux_w[c] * rgb[c];
        }
    }
}

static void sum_with_slopes(const struct render_gather_kernel *kernel,
                            const struct render_gather_source *const *sources, size_t count,
                            struct render_gather_places *places)
{
    sum(kernel, sources, count, places);
    for (size_t s = 0; s < count; s++) {
        const struct render_gather_source *const source = sources[s];
        for (int i = 0; i < RENDER_GATHER_LANES; i++) {
            float step_mm[3], rgb[IO_CHANNEL_COUNT];
            for (int k = 0; k < 3; k++)
                step_mm[k] = places->position_mm[k][i] - source->position_mm[k];
            render_gather_kernel_change_at(kernel, step_mm, source->spread_mm2, rgb);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
                for (int k = 0; k < 3; k++)
                    places->slopes[c][k][i] += 2 * source->flux_w[c] * rgb[c] * step_mm[k];
            }
        }
    }
}

const struct render_gather_loops render_gather_loops_portable = { near, list, sum, sum_with_slopes };
