#include "renderer/light_samples.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Extents are measured on float positions: a patch exactly as wide as the spacing must not be split. */
#define EXTENT_SLACK 1e-4

enum { FIRST_CAPACITY = 4096, TILE_WANTED = 48 };

/* A block of texels. */
struct block {
    int x, y, width, height;
};

struct reducer {
    const struct render_light_target *targets;
    const struct render_light_view *view;
    int object;                 /* that is being sampled */
    double limit_mm, widest_mm; /* of the object; of any */
    int left, low, right, high; /* texels that there are, right and high are one past the last */
    float *tile;                /* of texels, then of objects, where the view draws tiles */
    dipole_status *status;
};

/* The texel, if it shows a lit surface of the object; else NULL. */
static const float *lit_texel(const struct reducer *reducer, int x, int y)
{
    const struct render_light_view *const view = reducer->view;
    const size_t index = (size_t)y * (size_t)view->size_px + (size_t)x;
    assert(view->texels);
    const float *const texel = view->texels + 4 * index;
    const bool is_its = !view->objects || view->objects[index] == (float)(reducer->object + 1);
    return texel[3] > 0 && is_its ? texel : NULL;
}

/* What is lit of a line of texels. */
struct line {
    const float *first, *last; /* NULL: nothing */
    int first_index, last_index;
    double depth_min, depth_max;
};

static const struct line dark_line = { .depth_min = INFINITY, .depth_max = -INFINITY };

static void line_add(struct line *line, const float *texel, int index, double depth)
{
    line->depth_min = depth < line->depth_min ? depth : line->depth_min; /* as fmin(), but faster */
    line->depth_max = depth > line->depth_max ? depth : line->depth_max;
    if (!line->first) {
        line->first = texel;
        line->first_index = index;
    }
    line->last = texel;
    line->last_index = index;
}

/*
 * Square of a line's extent on the surface: across the view from end to end, and in depth from nearest to
 * farthest. Positions are those of texel centres, so the extent is scaled from the distance of centres to
 * whole texels.
 */
static double line_extent2_mm2(const double forward[3], const struct line *line)
{
    if (!line->first || line->first_index == line->last_index)
        return 0;
    double across2 = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        const double step = (double)line->last[k] - (double)line->first[k];
        across2 += step * step;
        along += step * forward[k];
    }
    const double depth_range = line->depth_max - line->depth_min;
    const int steps = line->last_index - line->first_index;
    const double scale = (double)(steps + 1) / steps;
    const double flat2 = across2 - along * along; /* what is left may be a rounding error below 0 */
    return ((flat2 > 0 ? flat2 : 0) + depth_range * depth_range) * scale * scale;
}

struct extents {
    double x_mm, y_mm;
};

/* The largest extents of a block's rows and of its columns. */
static struct extents extents_of_lines(const struct reducer *reducer, struct block block)
{
    const double *const forward = reducer->view->forward;
    struct line columns[RENDER_LIGHT_BLOCK_LIMIT];
    double x2_mm2 = 0, y2_mm2 = 0;
    assert(block.width <= RENDER_LIGHT_BLOCK_LIMIT);
    for (int i = 0; i < block.width; i++)
        columns[i] = dark_line;
    for (int j = 0; j < block.height; j++) {
        struct line row = dark_line;
        for (int i = 0; i < block.width; i++) {
            const float *const t = lit_texel(reducer, block.x + i, block.y + j);
            if (!t)
                continue;
            const double depth =
                forward[0] * (double)t[0] + forward[1] * (double)t[1] + forward[2] * (double)t[2];
            line_add(&row, t, i, depth);
            line_add(&columns[i], t, j, depth);
        }
        const double extent2_mm2 = line_extent2_mm2(forward, &row);
        x2_mm2 = extent2_mm2 > x2_mm2 ? extent2_mm2 : x2_mm2;
    }
    for (int i = 0; i < block.width; i++) {
        const double extent2_mm2 = line_extent2_mm2(forward, &columns[i]);
        y2_mm2 = extent2_mm2 > y2_mm2 ? extent2_mm2 : y2_mm2;
    }
    return (struct extents){ .x_mm = sqrt(x2_mm2), .y_mm = sqrt(y2_mm2) };
}

/* Of a block's lines; one that is one texel wide is measured together with its neighbour, of which it is
 * half. */
static struct extents block_extents(const struct reducer *reducer, struct block block)
{
    struct extents extents = extents_of_lines(reducer, block);
    struct block wide = block, high = block;
    if (block.width == 1) {
        wide.x &= ~1;
        wide.width = wide.x + 2 <= reducer->right ? 2 : 1;
        extents.x_mm = 0.5 * extents_of_lines(reducer, wide).x_mm;
    }
    if (block.height == 1) {
        high.y &= ~1;
        high.height = high.y + 2 <= reducer->high ? 2 : 1;
        extents.y_mm = 0.5 * extents_of_lines(reducer, high).y_mm;
    }
    return extents;
}

static bool grow_samples(struct render_light_samples *samples, size_t capacity, dipole_status *status)
{
    struct render_light_sample *const grown =
        capacity > SIZE_MAX / sizeof *grown ? NULL : realloc(samples->samples, capacity * sizeof *grown);
    if (!grown)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples", capacity);
    samples->samples = grown;
    samples->capacity = capacity;
    return true;
}

bool render_light_samples_add(struct render_light_samples *samples,
                              const struct render_light_sample *sample, dipole_status *status)
{
    if (samples->count == samples->capacity &&
        !grow_samples(samples, samples->capacity ? 2 * samples->capacity : FIRST_CAPACITY, status))
        return false;
    samples->samples[samples->count++] = *sample;
    return true;
}

bool render_light_samples_add_all(struct render_light_samples *samples,
                                  const struct render_light_samples *others, dipole_status *status)
{
    if (others->count == 0)
        return true;
    if (samples->capacity - samples->count < others->count &&
        !grow_samples(samples, samples->count + others->count, status))
        return false;
    memcpy(samples->samples + samples->count, others->samples, others->count * sizeof *others->samples);
    samples->count += others->count;
    return true;
}

/* Rows and columns of the second moments. */
static const int moment_axes[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 1, 2 }, { 2, 0 }, { 0, 1 } };

void render_spread_of(const struct render_spread_sums *sums, double scale, double spacing_mm,
                      float spread_mm2[6])
{
    const double limit_mm2 = 0.25 * spacing_mm * spacing_mm; /* a square has a sixth */
    double moments_mm2[6];
    for (int m = 0; m < 6; m++) {
        const double a = sums->first[moment_axes[m][0]] / sums->weight,
                     b = sums->first[moment_axes[m][1]] / sums->weight;
        moments_mm2[m] = scale * (sums->second[m] / sums->weight - a * b);
    }
    const double trace_mm2 = moments_mm2[0] + moments_mm2[1] + moments_mm2[2];
    for (int m = 0; m < 6; m++)
        spread_mm2[m] = (float)(moments_mm2[m] * (trace_mm2 > limit_mm2 ? limit_mm2 / trace_mm2 : 1));
}

/* Of the spread of so many texels to that of their middles: both ways together. */
static double whole_texels(struct block block)
{
    const double squares = (double)block.width * block.width + (double)block.height * block.height;
    return squares > 2 ? squares / (squares - 2) : 0;
}

static bool append_block(const struct reducer *reducer, struct block block, double extent_mm)
{
    const struct render_light_view *const view = reducer->view;
    struct render_spread_sums sums = { .weight = 0 };
    double irradiance = 0, arriving[3] = { 0, 0, 0 };
    int lit_count = 0;
    for (int y = block.y; y < block.y + block.height; y++) {
        for (int x = block.x; x < block.x + block.width; x++) {
            const float *const t = lit_texel(reducer, x, y);
            if (!t)
                continue;
            render_spread_add(&sums, (double)t[3], (double)t[0], (double)t[1], (double)t[2]);
            lit_count++;
            if (view->irradiance)
                irradiance += (double)view->irradiance[(size_t)y * (size_t)view->size_px + (size_t)x];
            render_light_view_add_shadow(view, x, y, (double)t[3], arriving);
        }
    }
    const double share = sums.weight;
    if (!(share > 0))
        return true;
    const double factor = view->flux_factor > 0 ? view->flux_factor : 1;
    struct render_light_sample sample = { .footprint_mm = (float)extent_mm,
                                          .object = (float)reducer->object };
    for (int k = 0; k < 3; k++) {
        sample.position_mm[k] = (float)(sums.first[k] / share);
        sample.flux_w[k] =
            (float)((view->irradiance ? irradiance / lit_count : share) * factor * view->rgb[k]);
        if (view->shadows)
            sample.flux_w[k] *= (float)(arriving[k] / share);
    }
    render_spread_of(&sums, whole_texels(block), reducer->limit_mm, sample.spread_mm2);
    return render_light_samples_add(reducer->targets[reducer->object].samples, &sample, reducer->status);
}

/* Halve the block across its longer side on the surface until both are short enough. */
static bool reduce_block(const struct reducer *reducer, struct block block)
{
    const struct extents extents = block_extents(reducer, block);
    const bool can_split_x = block.width > 1 && extents.x_mm > reducer->limit_mm;
    const bool can_split_y = block.height > 1 && extents.y_mm > reducer->limit_mm;
    if (!can_split_x && !can_split_y)
        return append_block(reducer, block, fmax(extents.x_mm, extents.y_mm));
    struct block low = block, high = block;
    if (can_split_x && (extents.x_mm >= extents.y_mm || !can_split_y)) {
        low.width /= 2;
        high.x += low.width;
        high.width -= low.width;
    } else {
        low.height /= 2;
        high.y += low.height;
        high.height -= low.height;
    }
    return reduce_block(reducer, low) && reduce_block(reducer, high);
}

/* The lowest object in the block that is not below the given one, lit; -1: none. */
static int next_object(const struct render_light_view *view, struct block block, int least)
{
    float next = INFINITY;
    for (int y = block.y; y < block.y + block.height; y++) {
        for (int x = block.x; x < block.x + block.width; x++) {
            const size_t index = (size_t)y * (size_t)view->size_px + (size_t)x;
            if (view->texels[4 * index + 3] > 0 && view->objects[index] > (float)least)
                next = fminf(next, view->objects[index]);
        }
    }
    return isfinite(next) ? (int)next - 1 : -1;
}

static bool is_lit(const struct render_light_view *view, struct block block)
{
    for (int y = block.y; y < block.y + block.height; y++) {
        const float *const row = view->texels + 4 * ((size_t)y * (size_t)view->size_px + (size_t)block.x);
        for (int i = 0; i < block.width; i++) {
            if (row[4 * i + 3] > 0)
                return true;
        }
    }
    return false;
}

/* Whether a block of a perspective view is wider, across the view where its first lit texel is, than any
 * object's samples may be apart: then it need not be measured to be split. */
static bool is_too_wide(const struct reducer *reducer, struct block block)
{
    const struct render_light_view *const view = reducer->view;
    if (!(view->texel > 0) || block.width % 2 != 0 || block.height % 2 != 0)
        return false;
    for (int y = block.y; y < block.y + block.height; y++) {
        const float *const row = view->texels + 4 * ((size_t)y * (size_t)view->size_px + (size_t)block.x);
        for (int i = 0; i < block.width; i++) {
            const float *const t = row + 4 * (size_t)i;
            if (!(t[3] > 0))
                continue;
            const double depth_mm = view->forward[0] * (double)t[0] + view->forward[1] * (double)t[1] +
                                    view->forward[2] * (double)t[2] - view->eye_depth_mm;
            return (block.width < block.height ? block.width : block.height) * view->texel * depth_mm >
                   reducer->widest_mm;
        }
    }
    return false;
}

/* The block's samples, object by object. */
static bool reduce_objects(struct reducer *reducer, struct block block)
{
    const bool has_objects = reducer->view->objects != NULL;
    int object = has_objects ? next_object(reducer->view, block, 0) : is_lit(reducer->view, block) ? 0 : -1;
    while (object >= 0) {
        const struct render_light_target *const target = &reducer->targets[object];
        reducer->object = object;
        reducer->limit_mm = target->spacing_mm * (1 + EXTENT_SLACK);
        if (target->samples && !reduce_block(reducer, block))
            return false;
        object = has_objects ? next_object(reducer->view, block, object + 1) : -1;
    }
    return true;
}

static bool reduce_quadrant(struct reducer *reducer, int x, int y, int size);

/* One tile is a small view of its own. */
static bool reduce_tile(const struct reducer *reducer, int x, int y)
{
    struct render_light_view drawn = *reducer->view;
    const size_t texel_count = (size_t)drawn.tile_px * (size_t)drawn.tile_px;
    float *const objects = drawn.tile_object_count > 0 ? reducer->tile + 4 * texel_count : NULL;
    if (!drawn.draw_tile(drawn.tiles, x, y, reducer->tile, objects))
        return true;
    struct reducer of_tile = *reducer;
    drawn.draw_tile = NULL;
    drawn.texels = reducer->tile;
    drawn.objects = objects;
    drawn.size_px = drawn.tile_px;
    of_tile.view = &drawn;
    of_tile.left = x < 0 ? -x : 0;
    of_tile.low = y < 0 ? -y : 0;
    of_tile.right = reducer->right - x < drawn.tile_px ? reducer->right - x : drawn.tile_px;
    of_tile.high = reducer->high - y < drawn.tile_px ? reducer->high - y : drawn.tile_px;
    return reduce_quadrant(&of_tile, 0, 0, drawn.tile_px);
}

/* Walk down the quadtree over the whole view: samples near in space then lie near in the list. */
static bool reduce_quadrant(struct reducer *reducer, int x, int y, int size)
{
    const int left = x > reducer->left ? x : reducer->left, low = y > reducer->low ? y : reducer->low;
    const int right = x + size < reducer->right ? x + size : reducer->right,
              high = y + size < reducer->high ? y + size : reducer->high;
    if (left >= right || low >= high)
        return true;
    if (reducer->view->draw_tile && size <= reducer->view->tile_px)
        return reduce_tile(reducer, x, y);
    const struct block block = { .x = left, .y = low, .width = right - left, .height = high - low };
    if (size <= reducer->view->block_px && !(size % 2 == 0 && is_too_wide(reducer, block)))
        return reduce_objects(reducer, block);
    const int half = size / 2;
    return reduce_quadrant(reducer, x, y, half) && reduce_quadrant(reducer, x + half, y, half) &&
           reduce_quadrant(reducer, x, y + half, half) &&
           reduce_quadrant(reducer, x + half, y + half, half);
}

/* ---- threads ------------------------------------------------------------------------------------ */

/* Subtrees of the quadtree, one after the other as the walk meets them: each is a round of the loop, and
 * has lists of its own, put behind each other at the end. So the order is that of one thread. */
enum { PART_LEVELS = 3, PART_COUNT = 1 << 2 * PART_LEVELS };

struct part {
    struct render_light_target *targets;
    struct render_light_samples *lists; /* of each list that some target has */
    dipole_status status;
    bool is_done;
};

struct parts {
    const struct render_light_view *view;
    int start, size;  /* of the whole quadtree, along both sides */
    double widest_mm; /* samples of any object may be so far apart */
    struct part at[PART_COUNT];
};

/* Every other bit, from the lowest on: a place on the Z-order curve to its x. */
static int every_other_bit(int code)
{
    int value = 0;
    for (int bit = 0; bit < PART_LEVELS; bit++)
        value |= (code >> 2 * bit & 1) << bit;
    return value;
}

static void reduce_part(void *context, int index)
{
    struct parts *const parts = context;
    struct part *const part = &parts->at[index];
    struct reducer reducer = { .targets = part->targets, .view = parts->view, .status = &part->status };
    reducer.right = reducer.high = parts->view->size_px;
    reducer.widest_mm = parts->widest_mm;
    const int size = parts->size >> PART_LEVELS, tile_px = parts->view->tile_px;
    if (parts->view->draw_tile) {
        reducer.tile = malloc((size_t)tile_px * (size_t)tile_px * 5 * sizeof *reducer.tile);
        if (!reducer.tile) {
            part->is_done = dipole_fail(&part->status, DIPOLE_OUT_OF_MEMORY, NULL,
                                        "no memory for a tile of %d texels a side", tile_px);
            return;
        }
    }
    part->is_done = reduce_quadrant(&reducer, parts->start + every_other_bit(index) * size,
                                    parts->start + every_other_bit(index >> 1) * size, size);
    free(reducer.tile);
}

/* Room for so many more. */
static bool reserve(struct render_light_samples *samples, size_t more, dipole_status *status)
{
    if (samples->capacity - samples->count >= more)
        return true;
    const size_t capacity = samples->count + more;
    struct render_light_sample *const grown = realloc(samples->samples, capacity * sizeof *grown);
    if (!grown)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples", capacity);
    samples->samples = grown;
    samples->capacity = capacity;
    return true;
}

/* Which targets share a list: numbers of the lists, and the lists; returns how many. */
static size_t number_lists(const struct render_light_target *targets, size_t target_count, size_t *numbers,
                           struct render_light_samples **lists)
{
    size_t list_count = 0;
    for (size_t i = 0; i < target_count; i++) {
        size_t k = 0;
        while (k < list_count && lists[k] != targets[i].samples)
            k++;
        if (k == list_count)
            lists[list_count++] = targets[i].samples;
        numbers[i] = k;
    }
    return list_count;
}

/* How many targets there are: as many as the view's objects say. */
static size_t count_targets(const struct render_light_view *view)
{
    float most = 1;
    if (view->draw_tile)
        return view->tile_object_count > 0 ? view->tile_object_count : 1;
    const size_t texel_count = (size_t)view->size_px * (size_t)view->size_px;
    for (size_t i = 0; view->objects && i < texel_count; i++)
        most = fmaxf(most, view->texels[4 * i + 3] > 0 ? view->objects[i] : 0);
    return (size_t)most;
}

/* Lists and targets of the parts in two allocations; false: no memory. */
static bool parts_init(struct parts *parts, const struct render_light_target *targets, size_t target_count,
                       const size_t *numbers, size_t list_count)
{
    parts->at[0].targets = calloc(PART_COUNT * target_count, sizeof *parts->at[0].targets);
    parts->at[0].lists = calloc(PART_COUNT * list_count, sizeof *parts->at[0].lists);
    if (!parts->at[0].targets || !parts->at[0].lists)
        return false;
    for (size_t p = 0; p < PART_COUNT; p++) {
        struct part *const part = &parts->at[p];
        part->targets = parts->at[0].targets + p * target_count;
        part->lists = parts->at[0].lists + p * list_count;
        for (size_t i = 0; i < target_count; i++) {
            part->targets[i] = targets[i];
            if (targets[i].samples)
                part->targets[i].samples = &part->lists[numbers[i]];
        }
    }
    return true;
}

static bool parts_join(const struct parts *parts, struct render_light_samples *const *lists,
                       size_t list_count, dipole_status *status)
{
    for (size_t p = 0; p < PART_COUNT; p++) {
        if (parts->at[p].is_done)
            continue;
        if (status)
            *status = parts->at[p].status;
        return false;
    }
    for (size_t k = 0; k < list_count; k++) {
        size_t more = 0;
        for (size_t p = 0; p < PART_COUNT; p++)
            more += parts->at[p].lists[k].count;
        if (lists[k] && !reserve(lists[k], more, status))
            return false;
        for (size_t p = 0; lists[k] && p < PART_COUNT; p++) {
            const struct render_light_samples *const part = &parts->at[p].lists[k];
            if (part->count > 0)
                memcpy(lists[k]->samples + lists[k]->count, part->samples,
                       part->count * sizeof *part->samples);
            lists[k]->count += part->count;
        }
    }
    return true;
}

int render_light_tile_px(int block_px)
{
    int tile_px = block_px;
    while (tile_px < TILE_WANTED)
        tile_px *= 2;
    return tile_px;
}

bool render_light_samples_append(const struct render_light_target *targets,
                                 const struct render_light_view *view, dipole_status *status)
{
    const size_t target_count = count_targets(view);
    const int shift = render_light_view_shift_px(view),
              least_px = view->draw_tile ? view->tile_px : view->block_px;
    struct parts parts = { .view = view, .start = -shift, .size = least_px << PART_LEVELS };
    size_t *const numbers = calloc(target_count, sizeof *numbers);
    struct render_light_samples **const lists = calloc(target_count, sizeof(struct render_light_samples *));
    for (size_t i = 0; i < target_count; i++)
        parts.widest_mm = fmax(parts.widest_mm, targets[i].spacing_mm);
    while (parts.size < view->size_px + shift)
        parts.size *= 2;
    size_t list_count = 0;
    if (numbers && lists)
        list_count = number_lists(targets, target_count, numbers, lists);
    bool done = list_count > 0 && parts_init(&parts, targets, target_count, numbers, list_count);
    if (done) {
        lut_parallel_for(PART_COUNT, 0, reduce_part, &parts);
        done = parts_join(&parts, lists, list_count, status);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to sample %zu objects", target_count);
    }
    for (size_t k = 0; parts.at[0].lists && k < PART_COUNT * list_count; k++)
        render_light_samples_destroy(&parts.at[0].lists[k]);
    free(parts.at[0].lists);
    free(parts.at[0].targets);
    free(numbers);
    free((void *)lists);
    return done;
}

/* ---- merging ------------------------------------------------------------------------------------ */

uint64_t render_cube_code(const double position_mm[3], const double min_mm[3], double cell_mm)
{
    double cell[3];
    for (int k = 0; k < 3; k++)
        cell[k] = floor((position_mm[k] - min_mm[k]) / cell_mm);
    return render_z_order(cell);
}

static uint64_t cube_code(const struct render_light_sample *sample, const double min_mm[3], double cell_mm)
{
    const double position_mm[3] = { (double)sample->position_mm[0], (double)sample->position_mm[1],
                                    (double)sample->position_mm[2] };
    return render_cube_code(position_mm, min_mm, cell_mm);
}

/* By object, then code; equal ones stay in their order. Digits in which all keys are alike are left out. */
enum { DIGIT_BITS = 11, DIGIT_COUNT = 1 << DIGIT_BITS };

static size_t digit_of(const struct render_z_key *key, int shift)
{
    return (size_t)((shift < 64 ? key->code : (uint64_t)key->object) >> shift % 64) & (DIGIT_COUNT - 1);
}

static void sort_digit(const struct render_z_key *keys, size_t count, int shift,
                       struct render_z_key *sorted)
{
    size_t starts[DIGIT_COUNT] = { 0 };
    for (size_t i = 0; i < count; i++)
        starts[digit_of(&keys[i], shift)]++;
    size_t sum = 0;
    for (size_t d = 0; d < DIGIT_COUNT; d++) {
        const size_t here = starts[d];
        starts[d] = sum;
        sum += here;
    }
    for (size_t i = 0; i < count; i++)
        sorted[starts[digit_of(&keys[i], shift)]++] = keys[i];
}

struct render_z_key *render_light_samples_sort_keys(struct render_z_key *keys, struct render_z_key *spare,
                                                    size_t count)
{
    static const int shifts[] = { 0, 11, 22, 33, 44, 55, 64, 75, 86 };
    uint64_t differing[2] = { 0, 0 }; /* bits of codes, and of objects */
    for (size_t i = 1; i < count; i++) {
        differing[0] |= keys[i].code ^ keys[0].code;
        differing[1] |= (uint64_t)keys[i].object ^ (uint64_t)keys[0].object;
    }
    for (size_t s = 0; s < sizeof shifts / sizeof *shifts; s++) {
        if ((differing[shifts[s] / 64] >> shifts[s] % 64 & (DIGIT_COUNT - 1)) == 0)
            continue;
        sort_digit(keys, count, shifts[s], spare);
        struct render_z_key *const sorted = spare;
        spare = keys;
        keys = sorted;
    }
    return keys;
}

/* Brightness, whatever the colour: what a mean position is weighted by. */
static double weight_of(const struct render_light_sample *sample)
{
    return (double)sample->flux_w[0] + (double)sample->flux_w[1] + (double)sample->flux_w[2];
}

struct render_light_sample render_light_samples_merge_run(const struct render_light_samples *samples,
                                                          const struct render_z_key *keys, size_t count)
{
    double flux_w[3] = { 0, 0, 0 }, spread_mm2[6] = { 0 }, diagonal2 = 0;
    struct render_spread_sums sums = { .weight = 0 };
    float min[3], max[3], footprint_mm = 0;
    for (int k = 0; k < 3; k++)
        min[k] = max[k] = samples->samples[keys[0].index].position_mm[k];
    for (size_t i = 0; i < count; i++) {
        const struct render_light_sample *const sample = &samples->samples[keys[i].index];
        const double weight = weight_of(sample);
        render_spread_add(&sums, weight, (double)sample->position_mm[0], (double)sample->position_mm[1],
                          (double)sample->position_mm[2]);
        for (int m = 0; m < 6; m++)
            spread_mm2[m] += weight * (double)sample->spread_mm2[m];
        footprint_mm = fmaxf(footprint_mm, sample->footprint_mm);
        for (int k = 0; k < 3; k++) {
            flux_w[k] += (double)sample->flux_w[k];
            min[k] = fminf(min[k], sample->position_mm[k]);
            max[k] = fmaxf(max[k], sample->position_mm[k]);
        }
    }
    struct render_light_sample merged = { .object = keys[0].object };
    for (int k = 0; k < 3; k++) {
        merged.position_mm[k] = (float)(sums.first[k] / sums.weight);
        merged.flux_w[k] = (float)flux_w[k];
        diagonal2 += (double)(max[k] - min[k]) * (double)(max[k] - min[k]);
    }
    merged.footprint_mm = (float)sqrt(diagonal2) + footprint_mm;
    render_spread_of(&sums, 1, INFINITY, merged.spread_mm2);
    for (int m = 0; m < 6; m++)
        merged.spread_mm2[m] += (float)(spread_mm2[m] / sums.weight);
    return merged;
}

bool render_light_samples_merge(const struct render_light_samples *samples, double cell_mm,
                                struct render_light_samples *merged, dipole_status *status)
{
    const size_t count = samples->count;
    if (count == 0)
        return true;
    struct render_z_key *const unsorted =
        count > SIZE_MAX / 2 / sizeof *unsorted ? NULL : malloc(2 * count * sizeof *unsorted);
    if (!unsorted)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to merge %zu light samples",
                           count);
    double min_mm[3] = { INFINITY, INFINITY, INFINITY };
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++)
            min_mm[k] = fmin(min_mm[k], (double)samples->samples[i].position_mm[k]);
    }
    for (size_t i = 0; i < count; i++)
        unsorted[i] = (struct render_z_key){ .code = cube_code(&samples->samples[i], min_mm, cell_mm),
                                             .index = i,
                                             .object = samples->samples[i].object };
    const struct render_z_key *const keys =
        render_light_samples_sort_keys(unsorted, unsorted + count, count);
    bool done = true;
    for (size_t first = 0, end; done && first < count; first = end) {
        end = first + 1;
        while (end < count && keys[end].code == keys[first].code && keys[end].object == keys[first].object)
            end++;
        const struct render_light_sample sample =
            render_light_samples_merge_run(samples, keys + first, end - first);
        done = render_light_samples_add(merged, &sample, status);
    }
    free(unsorted);
    return done;
}

void render_light_samples_destroy(struct render_light_samples *samples)
{
    free(samples->samples);
    free(samples->codes);
    *samples = (struct render_light_samples){ 0 };
}
