/* Eight places, and eight pieces of a polynomial, to a register. */
#include "renderer/gather_kernel.h"

#include <immintrin.h>

static inline __attribute__((always_inline)) unsigned near_box(const struct render_gather_group *group,
                                                               const __m256 min_mm[3],
                                                               const __m256 max_mm[3], __m256 reach2_mm2)
{
    __m256 distance2 = _mm256_setzero_ps();
    for (int k = 0; k < 3; k++) {
        const __m256 x = _mm256_load_ps(group->position_mm[k]);
        const __m256 below = _mm256_sub_ps(min_mm[k], x), above = _mm256_sub_ps(x, max_mm[k]);
        const __m256 gap = _mm256_max_ps(_mm256_max_ps(below, above), _mm256_setzero_ps());
        distance2 = _mm256_fmadd_ps(gap, gap, distance2);
    }
    return (unsigned)_mm256_movemask_ps(_mm256_cmp_ps(distance2, reach2_mm2, _CMP_LE_OQ));
}

static inline __attribute__((always_inline)) void load_box(const struct render_gather_box *box,
                                                           __m256 min_mm[3], __m256 max_mm[3])
{
    for (int k = 0; k < 3; k++) {
        min_mm[k] = _mm256_broadcast_ss(&box->min_mm[k]);
        max_mm[k] = _mm256_broadcast_ss(&box->max_mm[k]);
    }
}

static unsigned near(const struct render_gather_group *group, const struct render_gather_box *box,
                     float reach2_mm2)
{
    __m256 min_mm[3], max_mm[3];
    load_box(box, min_mm, max_mm);
    return near_box(group, min_mm, max_mm, _mm256_set1_ps(reach2_mm2));
}

static size_t list(const struct render_gather_group *groups, const uint32_t *numbers, size_t count,
                   const struct render_gather_box *box, float reach2_mm2,
                   const struct render_gather_source **sources, size_t *listed, size_t capacity)
{
    __m256 min_mm[3], max_mm[3];
    load_box(box, min_mm, max_mm);
    const __m256 reach2 = _mm256_set1_ps(reach2_mm2);
    size_t g = 0, next = *listed;
    for (; g < count && next + RENDER_GATHER_LANES <= capacity; g++) {
        const struct render_gather_group *const group = &groups[numbers[g]];
        for (unsigned bits = near_box(group, min_mm, max_mm, reach2); bits; bits &= bits - 1)
            sources[next++] = &group->sources[__builtin_ctz(bits)];
    }
    *listed = next;
    return g;
}

/* A column of pieces, one for each place. */
static inline __m256 pick(const float pieces[RENDER_GATHER_PIECES], __m256i piece)
{
    return _mm256_permutevar8x32_ps(_mm256_load_ps(pieces), piece);
}

static inline __attribute__((always_inline)) void sum_all(const struct render_gather_kernel *kernel,
                                                          const struct render_gather_source *const *sources,
                                                          size_t count, struct render_gather_places *places,
                                                          bool has_slopes, bool is_grey)
{
    const __m256 x = _mm256_load_ps(places->position_mm[0]), y = _mm256_load_ps(places->position_mm[1]),
                 z = _mm256_load_ps(places->position_mm[2]);
    const __m256 one = _mm256_set1_ps(1), inverse = _mm256_set1_ps(kernel->inverse_per_mm2),
                 reach2 = _mm256_set1_ps(kernel->reach2_mm2), middle = _mm256_set1_ps(1.25f);
    const __m256i within = _mm256_set1_epi32(0x3fffff), exponent = _mm256_set1_epi32(0x3f800000);
    __m256 sums[IO_CHANNEL_COUNT], slopes[IO_CHANNEL_COUNT][3];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        sums[c] = _mm256_load_ps(places->sums[c]);
        for (int k = 0; has_slopes && k < 3; k++)
            slopes[c][k] = _mm256_load_ps(places->slopes[c][k]);
    }
    for (size_t s = 0; s < count; s++) {
        const struct render_gather_source *const source = sources[s];
        const float *const m = source->spread_mm2;
        const __m256 dx = _mm256_sub_ps(x, _mm256_broadcast_ss(&source->position_mm[0]));
        const __m256 dy = _mm256_sub_ps(y, _mm256_broadcast_ss(&source->position_mm[1]));
        const __m256 dz = _mm256_sub_ps(z, _mm256_broadcast_ss(&source->position_mm[2]));
        const __m256 distance2 = _mm256_fmadd_ps(dx, dx, _mm256_fmadd_ps(dy, dy, _mm256_mul_ps(dz, dz)));
        const __m256 is_near = _mm256_cmp_ps(distance2, reach2, _CMP_LE_OQ);
        const __m256 u = _mm256_fmadd_ps(_mm256_and_ps(distance2, is_near), inverse, one);
        const __m256i bits = _mm256_castps_si256(u);
        const __m256i piece = _mm256_srli_epi32(bits, 22); /* of which the lowest three bits count */
        const __m256 t = _mm256_sub_ps(
            _mm256_castsi256_ps(_mm256_or_si256(_mm256_and_si256(bits, within), exponent)), middle);
        const __m256 t_by_3 = _mm256_add_ps(t, _mm256_add_ps(t, t));
        /* d^T spread d */
        const __m256 row_x = _mm256_fmadd_ps(
            dx, _mm256_set1_ps(m[0]),
            _mm256_fmadd_ps(dz, _mm256_set1_ps(2 * m[4]), _mm256_mul_ps(dy, _mm256_set1_ps(2 * m[5]))));
        const __m256 row_y =
            _mm256_fmadd_ps(dy, _mm256_set1_ps(m[1]), _mm256_mul_ps(dz, _mm256_set1_ps(2 * m[3])));
        const __m256 row_z = _mm256_mul_ps(dz, _mm256_set1_ps(m[2]));
        const __m256 along =
            _mm256_fmadd_ps(dx, row_x, _mm256_fmadd_ps(dy, row_y, _mm256_mul_ps(dz, row_z)));
        const __m256 slope = pick(kernel->slope, piece);
        const float trace = m[0] + m[1] + m[2] + kernel->averaged_mm2;
        const __m256 first = _mm256_mul_ps(slope, _mm256_set1_ps(trace));
        const __m256 second =
            _mm256_mul_ps(_mm256_mul_ps(slope, slope), _mm256_mul_ps(_mm256_set1_ps(4), along));
        const __m256 slope_by_2 = _mm256_add_ps(slope, slope),
                     first_by_4 = _mm256_mul_ps(first, _mm256_set1_ps(4)),
                     second_by_3 = _mm256_mul_ps(second, _mm256_set1_ps(3));
        __m256 value = one, spread_bend = one; /* of the last channel that was looked up */
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            if (c == 0 || !is_grey) {
                const float(*const terms)[RENDER_GATHER_PIECES] = kernel->terms[c];
                const __m256 t1 = pick(terms[1], piece), t2 = pick(terms[2], piece),
                             t3 = pick(terms[3], piece);
                const __m256 half_bend = _mm256_fmadd_ps(t_by_3, t3, t2);
                const __m256 bend = _mm256_fmadd_ps(t, _mm256_add_ps(half_bend, t2), t1);
                value = _mm256_fmadd_ps(t, _mm256_fmadd_ps(t, _mm256_fmadd_ps(t, t3, t2), t1),
                                        pick(terms[0], piece));
                value = _mm256_fmadd_ps(first, bend, _mm256_fmadd_ps(second, half_bend, value));
                if (has_slopes)
                    spread_bend =
                        _mm256_fmadd_ps(first_by_4, half_bend, _mm256_fmadd_ps(second_by_3, t3, bend));
            }
            const float kept = source->flux_w[c] * (1 + kernel->lost_per_mm2[c] * trace);
            const __m256 flux = _mm256_and_ps(_mm256_set1_ps(kept), is_near);
            sums[c] = _mm256_fmadd_ps(flux, value, sums[c]);
            if (has_slopes) {
                const __m256 change = _mm256_mul_ps(_mm256_mul_ps(flux, slope_by_2), spread_bend);
                slopes[c][0] = _mm256_fmadd_ps(change, dx, slopes[c][0]);
                slopes[c][1] = _mm256_fmadd_ps(change, dy, slopes[c][1]);
                slopes[c][2] = _mm256_fmadd_ps(change, dz, slopes[c][2]);
            }
        }
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        _mm256_store_ps(places->sums[c], sums[c]);
        for (int k = 0; has_slopes && k < 3; k++)
            _mm256_store_ps(places->slopes[c][k], slopes[c][k]);
    }
}

static void sum(const struct render_gather_kernel *kernel,
                const struct render_gather_source *const *sources, size_t count,
                struct render_gather_places *places)
{
    if (kernel->is_grey)
        sum_all(kernel, sources, count, places, false, true);
    else
        sum_all(kernel, sources, count, places, false, false);
}

static void sum_with_slopes(const struct render_gather_kernel *kernel,
                            const struct render_gather_source *const *sources, size_t count,
                            struct render_gather_places *places)
{
    if (kernel->is_grey)
        sum_all(kernel, sources, count, places, true, true);
    else
        sum_all(kernel, sources, count, places, true, false);
}

const struct render_gather_loops render_gather_loops_avx2 = { near, list, sum, sum_with_slopes };
