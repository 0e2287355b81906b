#include "renderer/gather_sources.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cubes by which samples are ordered are 2^3 times smaller than the second band's spacing. */
enum { ORDER_BITS = 3 };

/* ---- order -------------------------------------------------------------------------------------- */

/* Keys of so many samples are filled by one thread at a time. */
enum { BLOCK_SIZE = 4096 };

struct keys {
    const struct render_light_sample *samples;
    const uint64_t *codes; /* NULL: of cubes in space */
    size_t count;
    double min_mm[3], cell_mm;
    struct render_z_key *keys;
};

static void fill_block(void *context, int block)
{
    const struct keys *const all = context;
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t i = first; i < all->count && i < first + BLOCK_SIZE; i++) {
        double cell[3];
        for (int k = 0; k < 3 && !all->codes; k++)
            cell[k] = ((double)all->samples[i].position_mm[k] - all->min_mm[k]) / all->cell_mm;
        all->keys[i] =
            (struct render_z_key){ .code = all->codes ? all->codes[i] : render_z_order(cell), .index = i };
    }
}

static void fill_keys(const struct render_light_sample *samples, const uint64_t *codes, size_t count,
                      double cell_mm, struct render_z_key *keys)
{
    struct keys all = {
        .samples = samples, .codes = codes, .count = count, .cell_mm = cell_mm, .keys = keys
    };
    for (int k = 0; k < 3; k++)
        all.min_mm[k] = INFINITY;
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            const double place_mm = (double)samples[i].position_mm[k];
            all.min_mm[k] = place_mm < all.min_mm[k] ? place_mm : all.min_mm[k];
        }
    }
    lut_parallel_for((int)((count + BLOCK_SIZE - 1) / BLOCK_SIZE), 0, fill_block, &all);
}

/* ---- merging ------------------------------------------------------------------------------------ */

/* Brightness, whatever the colour: what a mean position is weighted by. */
static double weight_of(const struct render_gather_source *source)
{
    return (double)source->flux_w[0] + (double)source->flux_w[1] + (double)source->flux_w[2];
}

static struct render_gather_source merge_run(const struct render_gather_source *sources, size_t count)
{
    static const int rows[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 1, 2 }, { 2, 0 }, { 0, 1 } };
    double flux_w[3] = { 0, 0, 0 }, mean_mm[3] = { 0, 0, 0 }, spread_mm2[6] = { 0, 0, 0, 0, 0, 0 },
           weight_sum = 0;
    if (count == 1)
        return sources[0];
    for (size_t i = 0; i < count; i++) {
        const double weight = weight_of(&sources[i]);
        weight_sum += weight;
        for (int k = 0; k < 3; k++) {
            flux_w[k] += (double)sources[i].flux_w[k];
            mean_mm[k] += weight * (double)sources[i].position_mm[k];
        }
    }
    if (!(weight_sum > 0))
        return sources[0];
    for (int k = 0; k < 3; k++)
        mean_mm[k] /= weight_sum;
    for (size_t i = 0; i < count; i++) {
        const double part = weight_of(&sources[i]) / weight_sum;
        double step_mm[3];
        for (int k = 0; k < 3; k++)
            step_mm[k] = (double)sources[i].position_mm[k] - mean_mm[k];
        for (int m = 0; m < 6; m++)
            spread_mm2[m] +=
                part * ((double)sources[i].spread_mm2[m] + step_mm[rows[m][0]] * step_mm[rows[m][1]]);
    }
    struct render_gather_source merged;
    for (int k = 0; k < 3; k++) {
        merged.position_mm[k] = (float)mean_mm[k];
        merged.flux_w[k] = (float)flux_w[k];
    }
    for (int m = 0; m < 6; m++)
        merged.spread_mm2[m] = (float)spread_mm2[m];
    return merged;
}

/* Merge in place those that share a cube; returns how many there are left. */
static size_t merge(struct render_gather_source *sources, uint64_t *codes, size_t count, int shift)
{
    size_t kept = 0;
    for (size_t first = 0, end; first < count; first = end) {
        end = first + 1;
        while (end < count && codes[end] >> shift == codes[first] >> shift)
            end++;
        sources[kept] = merge_run(sources + first, end - first);
        codes[kept++] = codes[first];
    }
    return kept;
}

/* Samples in a row that are merged by one thread at a time; no cube is in two of them. */
enum { PART_LIMIT = 16, PART_SIZE = 4096 };

struct part {
    size_t first, count;
    struct render_gather_source *merged[RENDER_BAND_LIMIT];
    size_t merged_count[RENDER_BAND_LIMIT];
    bool is_done;
};

/* ---- groups and boxes --------------------------------------------------------------------------- */

static void box_add(struct render_gather_box *box, const float min_mm[3], const float max_mm[3])
{
    for (int k = 0; k < 3; k++) {
        box->min_mm[k] = min_mm[k] < box->min_mm[k] ? min_mm[k] : box->min_mm[k];
        box->max_mm[k] = max_mm[k] > box->max_mm[k] ? max_mm[k] : box->max_mm[k];
    }
}

static void fill_group(const struct render_gather_source *sources, size_t count,
                       struct render_gather_group *group, struct render_gather_box *box)
{
    const float *const at = sources[0].position_mm;
    *box = (struct render_gather_box){ { at[0], at[1], at[2] }, { at[0], at[1], at[2] } };
    for (size_t i = 0; i < RENDER_GATHER_LANES; i++) {
        const struct render_gather_source *const source = &sources[i < count ? i : count - 1];
        group->sources[i] = *source;
        for (int c = 0; c < IO_CHANNEL_COUNT && i >= count; c++)
            group->sources[i].flux_w[c] = 0;
        for (int k = 0; k < 3; k++)
            group->position_mm[k][i] = i < count ? source->position_mm[k] : INFINITY; /* near nothing */
        box_add(box, source->position_mm, source->position_mm);
    }
}

/* The parts' sources of a band, one part behind the other. */
static void fill_groups(const struct part *parts, int part_count, int band,
                        struct render_gather_level *level)
{
    struct render_gather_source lanes[RENDER_GATHER_LANES];
    size_t group = 0, filled = 0;
    for (int p = 0; p < part_count; p++) {
        for (size_t i = 0; i < parts[p].merged_count[band]; i++) {
            lanes[filled++] = parts[p].merged[band][i];
            if (filled < RENDER_GATHER_LANES)
                continue;
            fill_group(lanes, filled, &level->groups[group], &level->boxes[0][group]);
            group++;
            filled = 0;
        }
    }
    if (filled > 0)
        fill_group(lanes, filled, &level->groups[group], &level->boxes[0][group]);
}

static bool level_init(const struct part *parts, int part_count, int band,
                       struct render_gather_level *level)
{
    for (int p = 0; p < part_count; p++)
        level->source_count += parts[p].merged_count[band];
    level->group_count = (level->source_count + RENDER_GATHER_LANES - 1) / RENDER_GATHER_LANES;
    if (level->source_count == 0)
        return true;
    size_t box_count = level->group_count, total = 0;
    while (level->depth < RENDER_GATHER_DEPTH) {
        level->box_counts[level->depth++] = box_count;
        total += box_count;
        if (box_count == 1)
            break;
        box_count = (box_count + RENDER_GATHER_FAN - 1) / RENDER_GATHER_FAN;
    }
    assert(level->box_counts[level->depth - 1] == 1);
    level->groups =
        aligned_alloc(_Alignof(struct render_gather_group), level->group_count * sizeof *level->groups);
    level->boxes[0] = calloc(total + 1, sizeof *level->boxes[0]);
    if (!level->groups || !level->boxes[0])
        return false;
    fill_groups(parts, part_count, band, level);
    for (int d = 1; d < level->depth; d++) {
        level->boxes[d] = level->boxes[d - 1] + level->box_counts[d - 1];
        for (size_t i = 0; i < level->box_counts[d - 1]; i++) {
            const struct render_gather_box *const below = &level->boxes[d - 1][i];
            struct render_gather_box *const box = &level->boxes[d][i / RENDER_GATHER_FAN];
            if (i % RENDER_GATHER_FAN == 0)
                *box = *below;
            box_add(box, below->min_mm, below->max_mm);
        }
    }
    return true;
}

/* ---- all bands ---------------------------------------------------------------------------------- */

/* What the bands are made in: sources in order, and their codes. */
struct workshop {
    const struct render_light_sample *samples;
    const struct render_z_key *order;
    struct render_gather_source *sources;
    uint64_t *codes;
    struct render_z_key *keys, *spare;
    int order_bits;
    float averaged_mm2;
    struct part parts[PART_LIMIT];
    int part_count;
    struct render_gather_sources *out;
    bool is_level_done[RENDER_BAND_LIMIT];
};

/* By how many bits codes are shifted to be the same within a cube of the band. */
static int shift_of(const struct workshop *shop, int band)
{
    const int shift = shop->order_bits + band - 1;
    return 3 * (shift < 0 ? 0 : shift < 20 ? shift : 20);
}

/* Parts about as large as each other that end where a cube of the last band does. */
static void share_out(struct workshop *shop, size_t count)
{
    const int shift = shift_of(shop, shop->out->band_count - 1);
    const size_t wanted = count / PART_SIZE < PART_LIMIT ? count / PART_SIZE + 1 : PART_LIMIT;
    size_t first = 0;
    for (size_t i = 1; i <= wanted; i++) {
        size_t end = i == wanted ? count : count / wanted * i;
        while (end > first && end < count &&
               shop->order[end].code >> shift == shop->order[end - 1].code >> shift)
            end++;
        if (end > first)
            shop->parts[shop->part_count++] = (struct part){ .first = first, .count = end - first };
        first = end > first ? end : first;
    }
}

static void merge_part(void *context, int index)
{
    struct workshop *const shop = context;
    struct part *const part = &shop->parts[index];
    struct render_gather_source *const sources = shop->sources + part->first;
    uint64_t *const codes = shop->codes + part->first;
    size_t count = part->count;
    for (size_t i = 0; i < count; i++) {
        const struct render_z_key *const key = &shop->order[part->first + i];
        const struct render_light_sample *const sample = &shop->samples[key->index];
        codes[i] = key->code;
        memcpy(sources[i].position_mm, sample->position_mm, sizeof sample->position_mm);
        memcpy(sources[i].flux_w, sample->flux_w, sizeof sample->flux_w);
        memcpy(sources[i].spread_mm2, sample->spread_mm2, sizeof sample->spread_mm2);
        for (int k = 0; k < 3; k++)
            sources[i].spread_mm2[k] -= shop->averaged_mm2;
    }
    for (int b = 0; b < shop->out->band_count; b++) {
        count = merge(sources, codes, count, shift_of(shop, b));
        part->merged[b] = malloc((count + 1) * sizeof *sources);
        if (!part->merged[b])
            return;
        memcpy(part->merged[b], sources, count * sizeof *sources);
        part->merged_count[b] = count;
    }
    part->is_done = true;
}

static void make_level(void *context, int band)
{
    struct workshop *const shop = context;
    shop->is_level_done[band] = level_init(shop->parts, shop->part_count, band, &shop->out->levels[band]);
}

/* What parts were merged from. */
static void clear_away(struct workshop *shop)
{
    free(shop->sources);
    free(shop->codes);
    free(shop->keys);
    free(shop->spare);
    shop->sources = NULL;
    shop->codes = NULL;
    shop->keys = shop->spare = NULL;
}

static bool fill_levels(struct workshop *shop, const uint64_t *codes, int code_level, size_t count,
                        double finest_mm)
{
    shop->order_bits = codes ? code_level + 1 : ORDER_BITS;
    fill_keys(shop->samples, codes, count, ldexp(finest_mm, 1 - shop->order_bits), shop->keys);
    shop->order = render_light_samples_sort_keys(shop->keys, shop->spare, count);
    share_out(shop, count);
    lut_parallel_for(shop->part_count, 0, merge_part, shop);
    bool done = true;
    for (int i = 0; i < shop->part_count; i++)
        done &= shop->parts[i].is_done;
    clear_away(shop); /* millions of samples take gigabytes */
    if (done)
        lut_parallel_for(shop->out->band_count, 0, make_level, shop);
    for (int b = 0; done && b < shop->out->band_count; b++)
        done = shop->is_level_done[b];
    return done;
}

bool render_gather_sources_init(const struct render_light_sample *samples, const uint64_t *codes,
                                int code_level, size_t count, const struct render_band *bands,
                                int band_count, double averaged_mm, struct render_gather_sources *sources,
                                dipole_status *status)
{
    *sources = (struct render_gather_sources){ .band_count = band_count };
    if (count == 0)
        return true;
    struct workshop shop = { .samples = samples,
                             .sources = malloc(count * sizeof *shop.sources),
                             .codes = malloc(count * sizeof *shop.codes),
                             .keys = malloc(count * sizeof *shop.keys),
                             .spare = malloc(count * sizeof *shop.spare),
                             .averaged_mm2 = (float)(averaged_mm * averaged_mm),
                             .out = sources };
    const bool done = shop.sources && shop.codes && shop.keys && shop.spare &&
                      fill_levels(&shop, codes, code_level, count, bands[0].spacing_mm);
    for (int i = 0; i < shop.part_count; i++) {
        for (int b = 0; b < band_count; b++)
            free(shop.parts[i].merged[b]);
    }
    clear_away(&shop);
    return done ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to order %zu light samples", count);
}

void render_gather_sources_end(struct render_gather_sources *sources)
{
    for (int b = 0; b < sources->band_count; b++) {
        free(sources->levels[b].groups);
        free(sources->levels[b].boxes[0]);
    }
    *sources = (struct render_gather_sources){ 0 };
}

/* ---- finding ------------------------------------------------------------------------------------ */

static bool is_near(const struct render_gather_box *a, const struct render_gather_box *b, float reach2_mm2)
{
    float distance2 = 0;
    for (int k = 0; k < 3; k++) {
        const float below = a->min_mm[k] - b->max_mm[k], above = b->min_mm[k] - a->max_mm[k];
        const float gap = below > above ? below : above;
        distance2 += gap > 0 ? gap * gap : 0;
    }
    return distance2 <= reach2_mm2;
}

size_t render_gather_find(const struct render_gather_level *level, const struct render_gather_box *box,
                          float reach_mm, uint32_t *groups, size_t capacity)
{
    /* Each box opened leaves at most RENDER_GATHER_FAN - 1 more to look at. */
    struct {
        int depth;
        uint32_t index;
    } stack[RENDER_GATHER_DEPTH * RENDER_GATHER_FAN];
    size_t count = 0, height = 0;
    if (level->depth > 0 && is_near(&level->boxes[level->depth - 1][0], box, reach_mm * reach_mm)) {
        stack[height].depth = level->depth - 1;
        stack[height++].index = 0;
    }
    while (height > 0) {
        const int depth = stack[--height].depth;
        const uint32_t index = stack[height].index;
        if (depth == 0) {
            if (count < capacity)
                groups[count] = index;
            count++;
            continue;
        }
        const size_t first = (size_t)index * RENDER_GATHER_FAN, below_count = level->box_counts[depth - 1];
        const size_t end =
            first + RENDER_GATHER_FAN < below_count ? first + RENDER_GATHER_FAN : below_count;
        if (depth == 1 &&
            capacity >= count + RENDER_GATHER_FAN) { /* the most common case, without branches */
            for (size_t i = first; i < end; i++) {
                groups[count] = (uint32_t)i;
                count += is_near(&level->boxes[0][i], box, reach_mm * reach_mm);
            }
            continue;
        }
        for (size_t i = end; i-- > first;) { /* the last first, so that groups come out in order */
            if (is_near(&level->boxes[depth - 1][i], box, reach_mm * reach_mm)) {
                stack[height].depth = depth - 1;
                stack[height++].index = (uint32_t)i;
            }
        }
    }
    return count;
}
