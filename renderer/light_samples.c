#include "renderer/light_samples.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Extents are measured on float positions: a patch exactly as wide as the spacing must not be split. */
#define EXTENT_SLACK 1e-4

enum { FIRST_CAPACITY = 4096 };

/* A block of texels. */
struct block {
    int x, y, width, height;
};

struct reducer {
    const struct render_light_target *targets;
    const struct render_light_view *view;
    int object; /* that is being sampled */
    double limit_mm;
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

/*
 * Extent on the surface of one line of texels, from (x, y) in steps of (dx, dy): across the view from end
 * to end, and in depth from nearest to farthest. Positions are those of texel centres, so the extent is
 * scaled from the distance of centres to whole texels.
 */
static double line_extent_mm(const struct reducer *reducer, int x, int y, int dx, int dy, int count)
{
    const struct render_light_view *const view = reducer->view;
    const float *first = NULL, *last = NULL;
    int first_index = 0, last_index = 0;
    double depth_min = INFINITY, depth_max = -INFINITY;
    for (int i = 0; i < count; i++) {
        const float *const t = lit_texel(reducer, x + i * dx, y + i * dy);
        if (!t)
            continue;
        const double depth = view->forward[0] * (double)t[0] + view->forward[1] * (double)t[1] +
                             view->forward[2] * (double)t[2];
        depth_min = depth < depth_min ? depth : depth_min; /* as fmin(), but several times faster */
        depth_max = depth > depth_max ? depth : depth_max;
        if (!first) {
            first = t;
            first_index = i;
        }
        last = t;
        last_index = i;
    }
    if (!first || first_index == last_index)
        return 0;
    double step[3], along = 0;
    for (int k = 0; k < 3; k++) {
        step[k] = (double)last[k] - (double)first[k];
        along += step[k] * view->forward[k];
    }
    double across2 = 0;
    for (int k = 0; k < 3; k++)
        across2 += (step[k] - along * view->forward[k]) * (step[k] - along * view->forward[k]);
    const double depth_range = depth_max - depth_min;
    const int steps = last_index - first_index;
    return sqrt(across2 + depth_range * depth_range) * (steps + 1) / steps;
}

/* Largest extent of a block's lines along x (or y). A block one texel wide is measured together with its
 * neighbour, of which it is half. */
static double block_extent_mm(const struct reducer *reducer, struct block block, bool is_along_x)
{
    const int size_px = reducer->view->size_px;
    const int length = is_along_x ? block.width : block.height;
    if (length == 1) {
        if (is_along_x) {
            block.x &= ~1;
            block.width = block.x + 2 <= size_px ? 2 : 1;
        } else {
            block.y &= ~1;
            block.height = block.y + 2 <= size_px ? 2 : 1;
        }
    }
    double largest = 0;
    const int lines = is_along_x ? block.height : block.width;
    for (int i = 0; i < lines; i++) {
        const double extent = is_along_x
                                  ? line_extent_mm(reducer, block.x, block.y + i, 1, 0, block.width)
                                  : line_extent_mm(reducer, block.x + i, block.y, 0, 1, block.height);
        largest = fmax(largest, extent);
    }
    return length == 1 ? 0.5 * largest : largest;
}

bool render_light_samples_add(struct render_light_samples *samples,
                              const struct render_light_sample *sample, dipole_status *status)
{
    if (samples->count == samples->capacity) {
        const size_t capacity = samples->capacity ? 2 * samples->capacity : FIRST_CAPACITY;
        struct render_light_sample *const grown = capacity > SIZE_MAX / sizeof *grown
                                                      ? NULL
                                                      : realloc(samples->samples, capacity * sizeof *grown);
        if (!grown)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                               capacity);
        samples->samples = grown;
        samples->capacity = capacity;
    }
    samples->samples[samples->count++] = *sample;
    return true;
}

static bool append_block(const struct reducer *reducer, struct block block, double extent_mm)
{
    const struct render_light_view *const view = reducer->view;
    double share = 0, irradiance = 0, moment[3] = { 0, 0, 0 }, arriving[3] = { 0, 0, 0 };
    int lit_count = 0;
    for (int y = block.y; y < block.y + block.height; y++) {
        for (int x = block.x; x < block.x + block.width; x++) {
            const float *const t = lit_texel(reducer, x, y);
            if (!t)
                continue;
            share += (double)t[3];
            lit_count++;
            if (view->irradiance)
                irradiance += (double)view->irradiance[(size_t)y * (size_t)view->size_px + (size_t)x];
            for (int k = 0; k < 3; k++)
                moment[k] += (double)t[3] * (double)t[k];
            render_light_view_add_shadow(view, x, y, (double)t[3], arriving);
        }
    }
    if (!(share > 0))
        return true;
    const double factor = view->flux_factor > 0 ? view->flux_factor : 1;
    struct render_light_sample sample = { .footprint_mm = (float)extent_mm,
                                          .object = (float)reducer->object };
    for (int k = 0; k < 3; k++) {
        sample.position_mm[k] = (float)(moment[k] / share);
        sample.flux_w[k] =
            (float)((view->irradiance ? irradiance / lit_count : share) * factor * view->rgb[k]);
        if (view->shadows)
            sample.flux_w[k] *= (float)(arriving[k] / share);
    }
    return render_light_samples_add(reducer->targets[reducer->object].samples, &sample, reducer->status);
}

/* Halve the block across its longer side on the surface until both are short enough. */
static bool reduce_block(const struct reducer *reducer, struct block block)
{
    const double extent_x_mm = block_extent_mm(reducer, block, true);
    const double extent_y_mm = block_extent_mm(reducer, block, false);
    const bool can_split_x = block.width > 1 && extent_x_mm > reducer->limit_mm;
    const bool can_split_y = block.height > 1 && extent_y_mm > reducer->limit_mm;
    if (!can_split_x && !can_split_y)
        return append_block(reducer, block, fmax(extent_x_mm, extent_y_mm));
    struct block low = block, high = block;
    if (can_split_x && (extent_x_mm >= extent_y_mm || !can_split_y)) {
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

/* Walk down the quadtree over the whole view: samples near in space then lie near in the list. */
static bool reduce_quadrant(struct reducer *reducer, int x, int y, int size)
{
    const int size_px = reducer->view->size_px;
    if (x >= size_px || y >= size_px)
        return true;
    if (x + size <= 0 || y + size <= 0)
        return true;
    if (size <= 1 << reducer->view->levels) {
        const int left = x > 0 ? x : 0, bottom = y > 0 ? y : 0;
        const int right = x + size < size_px ? x + size : size_px;
        const int top = y + size < size_px ? y + size : size_px;
        return reduce_objects(
            reducer,
            (struct block){ .x = left, .y = bottom, .width = right - left, .height = top - bottom });
    }
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
    int start, size; /* of the whole quadtree, along both sides */
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
    const int size = parts->size >> PART_LEVELS;
    part->is_done = reduce_quadrant(&reducer, parts->start + every_other_bit(index) * size,
                                    parts->start + every_other_bit(index >> 1) * size, size);
}

static bool append_all(struct render_light_samples *samples, const struct render_light_samples *more,
                       dipole_status *status)
{
    if (more->count == 0)
        return true;
    if (samples->capacity - samples->count < more->count) {
        const size_t capacity = samples->count + more->count + samples->capacity / 2;
        struct render_light_sample *const grown = realloc(samples->samples, capacity * sizeof *grown);
        if (!grown)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                               capacity);
        samples->samples = grown;
        samples->capacity = capacity;
    }
    memcpy(samples->samples + samples->count, more->samples, more->count * sizeof *more->samples);
    samples->count += more->count;
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
    bool done = true;
    for (size_t p = 0; done && p < PART_COUNT; p++) {
        const struct part *const part = &parts->at[p];
        if (!part->is_done && status)
            *status = part->status;
        done = part->is_done;
        for (size_t k = 0; done && k < list_count; k++)
            done = !lists[k] || append_all(lists[k], &part->lists[k], status);
    }
    return done;
}

bool render_light_samples_append(const struct render_light_target *targets,
                                 const struct render_light_view *view, dipole_status *status)
{
    const size_t target_count = count_targets(view);
    const int shift = view->is_shifted ? 1 << view->levels >> 1 : 0;
    struct parts parts = { .view = view, .start = -shift, .size = 1 };
    size_t *const numbers = calloc(target_count, sizeof *numbers);
    struct render_light_samples **const lists = calloc(target_count, sizeof(struct render_light_samples *));
    while (parts.size < view->size_px + shift || parts.size < 1 << (view->levels + PART_LEVELS))
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

/* Sort by one digit; false: there is nothing to do. */
static bool sort_digit(const struct render_z_key *keys, size_t count, int shift,
                       struct render_z_key *sorted)
{
    size_t starts[DIGIT_COUNT] = { 0 };
    for (size_t i = 0; i < count; i++)
        starts[digit_of(&keys[i], shift)]++;
    if (starts[digit_of(&keys[0], shift)] == count)
        return false;
    size_t sum = 0;
    for (size_t d = 0; d < DIGIT_COUNT; d++) {
        const size_t here = starts[d];
        starts[d] = sum;
        sum += here;
    }
    for (size_t i = 0; i < count; i++)
        sorted[starts[digit_of(&keys[i], shift)]++] = keys[i];
    return true;
}

struct render_z_key *render_light_samples_sort_keys(struct render_z_key *keys, struct render_z_key *spare,
                                                    size_t count)
{
    static const int shifts[] = { 0, 11, 22, 33, 44, 55, 64, 75, 86 };
    for (size_t s = 0; s < sizeof shifts / sizeof *shifts; s++) {
        if (!sort_digit(keys, count, shifts[s], spare))
            continue;
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
    double flux_w[3] = { 0, 0, 0 }, moment[3] = { 0, 0, 0 }, weight_sum = 0, diagonal2 = 0;
    float min[3], max[3], footprint_mm = 0;
    for (int k = 0; k < 3; k++)
        min[k] = max[k] = samples->samples[keys[0].index].position_mm[k];
    for (size_t i = 0; i < count; i++) {
        const struct render_light_sample *const sample = &samples->samples[keys[i].index];
        const double weight = weight_of(sample);
        weight_sum += weight;
        footprint_mm = fmaxf(footprint_mm, sample->footprint_mm);
        for (int k = 0; k < 3; k++) {
            flux_w[k] += (double)sample->flux_w[k];
            moment[k] += weight * (double)sample->position_mm[k];
            min[k] = fminf(min[k], sample->position_mm[k]);
            max[k] = fmaxf(max[k], sample->position_mm[k]);
        }
    }
    struct render_light_sample merged = { .object = keys[0].object };
    for (int k = 0; k < 3; k++) {
        merged.position_mm[k] = (float)(moment[k] / weight_sum);
        merged.flux_w[k] = (float)flux_w[k];
        diagonal2 += (double)(max[k] - min[k]) * (double)(max[k] - min[k]);
    }
    merged.footprint_mm = (float)sqrt(diagonal2) + footprint_mm;
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
