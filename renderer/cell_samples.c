#include "renderer/cell_samples.h"

#include "renderer/z_order.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_SLOTS = 1 << 14 };

/* Of the cube that the coordinates begin in: a multiple of this many cubes from the world's origin, so that
 * meshes of a sequence share their cubes. */
#define ORIGIN_CELLS 128.0

/* What a cube has gathered. */
struct cell {
    uint64_t code;
    int object; /* -1: a free slot */
    int texel_count;
    double irradiance, arriving[3];
    struct render_spread_sums sums;
    float min[3], max[3];
};

/* An open hash table. */
struct cells {
    struct cell *slots;
    size_t slot_count, used_count; /* slot_count: a power of two */
};

static uint64_t mix(uint64_t x)
{
    x ^= x >> 31;
    x *= 0x9e3779b97f4a7c15u;
    x ^= x >> 29;
    x *= 0xbf58476d1ce4e5b9u;
    return x ^ x >> 32;
}

uint64_t render_cell_hash(uint64_t code, int object)
{
    return mix(code ^ (uint64_t)object << 48);
}

static struct cell *find_slot(const struct cells *cells, uint64_t code, int object)
{
    size_t i = (size_t)render_cell_hash(code, object) & (cells->slot_count - 1);
    while (cells->slots[i].object >= 0 &&
           (cells->slots[i].code != code || cells->slots[i].object != object))
        i = (i + 1) & (cells->slot_count - 1);
    return &cells->slots[i];
}

/* Room for twice as many. */
static bool grow(struct cells *cells, dipole_status *status)
{
    struct cells grown = { .slot_count = cells->slot_count ? 2 * cells->slot_count : FIRST_SLOTS,
                           .used_count = cells->used_count };
    grown.slots = calloc(grown.slot_count, sizeof *grown.slots);
    if (!grown.slots)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                           grown.slot_count);
    for (size_t i = 0; i < grown.slot_count; i++)
        grown.slots[i].object = -1;
    for (size_t i = 0; i < cells->slot_count; i++) {
        if (cells->slots[i].object >= 0)
            *find_slot(&grown, cells->slots[i].code, cells->slots[i].object) = cells->slots[i];
    }
    free(cells->slots);
    *cells = grown;
    return true;
}

static bool find_cell(struct cells *cells, uint64_t code, int object, struct cell **cell_out,
                      dipole_status *status)
{
    if (2 * (cells->used_count + 1) > cells->slot_count && !grow(cells, status))
        return false;
    struct cell *const cell = find_slot(cells, code, object);
    if (cell->object < 0) {
        *cell = (struct cell){ .code = code,
                               .object = object,
                               .min = { INFINITY, INFINITY, INFINITY },
                               .max = { -INFINITY, -INFINITY, -INFINITY } };
        cells->used_count++;
    }
    *cell_out = cell;
    return true;
}

static uint64_t code_of(const struct render_light_target *target, const float rest_mm[3])
{
    double cell[3];
    for (int k = 0; k < 3; k++) {
        const double step_mm = ORIGIN_CELLS * target->cell_mm;
        const double origin_mm = step_mm * floor(target->origin_mm[k] / step_mm);
        cell[k] = floor(((double)rest_mm[k] - origin_mm) / target->cell_mm);
    }
    return render_z_order(cell);
}

static void add_texel(struct cell *cell, const float texel[4], double irradiance)
{
    render_spread_add(&cell->sums, (double)texel[3], (double)texel[0], (double)texel[1], (double)texel[2]);
    cell->irradiance += irradiance;
    cell->texel_count++;
    for (int k = 0; k < 3; k++) {
        cell->min[k] = fminf(cell->min[k], texel[k]);
        cell->max[k] = fmaxf(cell->max[k], texel[k]);
    }
}

static bool gather(const struct render_light_target *targets, const struct render_light_view *view,
                   struct cells *cells, dipole_status *status)
{
    const size_t texel_count = (size_t)view->size_px * (size_t)view->size_px;
    for (size_t i = 0; i < texel_count; i++) {
        const float *const texel = view->texels + 4 * i;
        const int object = view->objects ? (int)view->objects[i] - 1 : 0;
        if (!(texel[3] > 0) || object < 0 || !targets[object].samples)
            continue;
        struct cell *cell;
        if (!find_cell(cells, code_of(&targets[object], view->rest_mm + 4 * i), object, &cell, status))
            return false;
        add_texel(cell, texel, view->irradiance ? (double)view->irradiance[i] : 0);
        render_light_view_add_shadow(view, (int)(i % (size_t)view->size_px),
                                     (int)(i / (size_t)view->size_px), (double)texel[3], cell->arriving);
    }
    return true;
}

/* By object and code, which no two cells share. */
static int compare_cells(const void *a, const void *b)
{
    const struct cell *const x = a, *const y = b;
    if (x->object != y->object)
        return x->object < y->object ? -1 : 1;
    return x->code < y->code ? -1 : x->code > y->code;
}

static bool append(struct render_light_samples *samples, const struct render_light_sample *sample,
                   uint64_t code, dipole_status *status)
{
    if (!render_light_samples_add(samples, sample, status))
        return false;
    if (samples->code_capacity < samples->capacity) {
        uint64_t *const grown = realloc(samples->codes, samples->capacity * sizeof *grown);
        if (!grown)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                               samples->capacity);
        samples->codes = grown;
        samples->code_capacity = samples->capacity;
    }
    samples->codes[samples->count - 1] = code;
    return true;
}

static bool append_cell(const struct render_light_target *targets, const struct render_light_view *view,
                        const struct cell *cell, dipole_status *status)
{
    const double share = cell->sums.weight, texel_count = cell->texel_count;
    const double flux = view->irradiance ? cell->irradiance / texel_count : share;
    struct render_light_sample sample = { .object = (float)cell->object };
    double diagonal2 = 0;
    for (int k = 0; k < 3; k++) {
        const double extent = (double)cell->max[k] - (double)cell->min[k];
        diagonal2 += extent * extent;
        sample.position_mm[k] = (float)(cell->sums.first[k] / share);
        sample.flux_w[k] = (float)(flux * view->rgb[k] * (view->shadows ? cell->arriving[k] / share : 1));
    }
    sample.footprint_mm = (float)sqrt(diagonal2);
    /* of texels as wide as they are, not of their middles alone */
    render_spread_of(&cell->sums, texel_count > 1 ? texel_count / (texel_count - 1) : 0,
                     targets[cell->object].spacing_mm, sample.spread_mm2);
    return append(targets[cell->object].samples, &sample, cell->code, status);
}

bool render_cell_samples_append(const struct render_light_target *targets,
                                const struct render_light_view *view, dipole_status *status)
{
    struct cells cells = { .slots = NULL };
    assert(view->rest_mm);
    bool done = gather(targets, view, &cells, status);
    size_t count = 0;
    for (size_t i = 0; done && i < cells.slot_count; i++) {
        if (cells.slots[i].object >= 0)
            cells.slots[count++] = cells.slots[i];
    }
    if (count > 0)
        qsort(cells.slots, count, sizeof *cells.slots, compare_cells);
    for (size_t i = 0; done && i < count; i++)
        done = append_cell(targets, view, &cells.slots[i], status);
    free(cells.slots);
    return done;
}

bool render_cell_samples_merge(const struct render_light_samples *samples, const int *levels,
                               struct render_light_samples *merged, dipole_status *status)
{
    const size_t count = samples->count;
    struct render_z_key *const unsorted =
        count > SIZE_MAX / 4 / sizeof *unsorted ? NULL : malloc(2 * (count + 1) * sizeof *unsorted);
    if (!unsorted)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to merge %zu light samples",
                           count);
    for (size_t i = 0; i < count; i++) {
        const float object = samples->samples[i].object;
        unsorted[i] = (struct render_z_key){ .code = samples->codes[i] >> 3 * levels[(int)object],
                                             .index = i,
                                             .object = object };
    }
    const struct render_z_key *const keys =
        count > 0 ? render_light_samples_sort_keys(unsorted, unsorted + count, count) : unsorted;
    bool done = true;
    for (size_t first = 0, end; done && first < count; first = end) {
        end = first + 1;
        while (end < count && keys[end].code == keys[first].code && keys[end].object == keys[first].object)
            end++;
        const struct render_light_sample sample =
            render_light_samples_merge_run(samples, keys + first, end - first);
        done = append(merged, &sample, samples->codes[keys[first].index], status);
    }
    free(unsorted);
    return done;
}
