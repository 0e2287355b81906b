#include "renderer/cell_samples.h"

#include "lutgen/parallel.h"
#include "renderer/z_order.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the cube that the coordinates begin in: a multiple of this many cubes from the world's origin, so that
 * meshes of a sequence share their cubes. */
#define ORIGIN_CELLS 128.0

/* ---- texels by their cubes ----------------------------------------------------------------------- */

/* Cubes of an object at rest. */
struct grid {
    double min_mm[3], cell_mm;
};

/* Lit texels: those of a row that lie in one cube behind each other have one key. */
struct lit_texels {
    const struct render_light_target *targets;
    const struct render_light_view *view;
    size_t *first_of_row; /* room for keys, a lit texel each; and one past the last */
    size_t *count_of_row; /* keys that there are */
    struct render_z_key *keys;
};

static struct grid grid_of(const struct render_light_target *target)
{
    struct grid grid = { .cell_mm = target->cell_mm };
    const double step_mm = ORIGIN_CELLS * target->cell_mm;
    for (int k = 0; k < 3; k++)
        grid.min_mm[k] = step_mm * floor(target->origin_mm[k] / step_mm);
    return grid;
}

static uint64_t code_of(const struct grid *grid, const float rest_mm[3])
{
    double cell[3];
    for (int k = 0; k < 3; k++)
        cell[k] = ((double)rest_mm[k] - grid->min_mm[k]) / grid->cell_mm;
    return render_z_order(cell);
}

/* The object that a texel gives a sample to; -1: to none. */
static int lit_object(const struct lit_texels *lit, size_t texel)
{
    const struct render_light_view *const view = lit->view;
    const int object = view->objects ? (int)view->objects[texel] - 1 : 0;
    return view->texels[4 * texel + 3] > 0 && object >= 0 && lit->targets[object].samples ? object : -1;
}

static void count_row(void *context, int row)
{
    const struct lit_texels *const lit = context;
    const size_t side_px = (size_t)lit->view->size_px, first = (size_t)row * side_px;
    size_t count = 0;
    for (size_t i = first; i < first + side_px; i++)
        count += lit_object(lit, i) >= 0;
    lit->first_of_row[row + 1] = count;
}

static void fill_row(void *context, int row)
{
    const struct lit_texels *const lit = context;
    const size_t side_px = (size_t)lit->view->size_px, first = (size_t)row * side_px;
    struct render_z_key *const keys = lit->keys + lit->first_of_row[row];
    struct grid grid;
    size_t count = 0;
    for (size_t i = first, of_grid = SIZE_MAX; i < first + side_px; i++) {
        const int object = lit_object(lit, i);
        if (object < 0)
            continue;
        if (of_grid != (size_t)object) {
            grid = grid_of(&lit->targets[object]);
            of_grid = (size_t)object;
        }
        const uint64_t code = code_of(&grid, lit->view->rest_mm + 4 * i);
        struct render_z_key *const last = &keys[count > 0 ? count - 1 : 0];
        if (count > 0 && last->code == code && (int)last->object == object &&
            last->index + (size_t)last->count == i)
            last->count++;
        else
            keys[count++] =
                (struct render_z_key){ .code = code, .index = i, .object = (float)object, .count = 1 };
    }
    lit->count_of_row[row] = count;
}

/* Put the rows' keys one behind the other; returns how many there are. */
static size_t close_up(const struct lit_texels *lit)
{
    size_t count = 0;
    for (int row = 0; row < lit->view->size_px; row++) {
        memmove(lit->keys + count, lit->keys + lit->first_of_row[row],
                lit->count_of_row[row] * sizeof *lit->keys);
        count += lit->count_of_row[row];
    }
    return count;
}

/* ---- cubes --------------------------------------------------------------------------------------- */

/* What a cube has gathered. */
struct cell {
    int object, texel_count;
    double irradiance, arriving[3];
    struct render_spread_sums sums;
    float min[3], max[3];
};

/* A sample for each cube. */
struct cells {
    const struct render_light_target *targets;
    const struct render_light_view *view;
    const struct render_z_key *keys; /* of texels, cube by cube */
    size_t *first_keys;              /* of each cube, and one past the last */
    size_t count;
    struct render_light_sample *samples;
};

static bool is_new_cell(const struct render_z_key *keys, size_t i)
{
    return i == 0 || keys[i].code != keys[i - 1].code || keys[i].object != keys[i - 1].object;
}

static void add_texel(const struct render_light_view *view, size_t index, struct cell *cell)
{
    const float *const texel = view->texels + 4 * index;
    const size_t side_px = (size_t)view->size_px;
    render_spread_add(&cell->sums, (double)texel[3], (double)texel[0], (double)texel[1], (double)texel[2]);
    cell->irradiance += view->irradiance ? (double)view->irradiance[index] : 0;
    cell->texel_count++;
    for (int k = 0; k < 3; k++) {
        cell->min[k] = fminf(cell->min[k], texel[k]);
        cell->max[k] = fmaxf(cell->max[k], texel[k]);
    }
    render_light_view_add_shadow(view, (int)(index % side_px), (int)(index / side_px), (double)texel[3],
                                 cell->arriving);
}

static struct render_light_sample sample_of(const struct render_light_target *target,
                                            const struct render_light_view *view, const struct cell *cell)
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
    render_spread_of(&cell->sums, texel_count > 1 ? texel_count / (texel_count - 1) : 0, target->spacing_mm,
                     sample.spread_mm2);
    return sample;
}

static void fill_cell(const struct cells *cells, size_t index)
{
    const struct render_light_view *const view = cells->view;
    const size_t first = cells->first_keys[index], end = cells->first_keys[index + 1];
    struct cell cell = { .object = (int)cells->keys[first].object,
                         .min = { INFINITY, INFINITY, INFINITY },
                         .max = { -INFINITY, -INFINITY, -INFINITY } };
    for (size_t i = first; i < end; i++) {
        const size_t texel_first = cells->keys[i].index;
        for (size_t texel = texel_first; texel < texel_first + (size_t)cells->keys[i].count; texel++)
            add_texel(view, texel, &cell);
    }
    cells->samples[index] = sample_of(&cells->targets[cell.object], view, &cell);
}

/* So many cubes are filled by one thread at a time. */
enum { BLOCK_SIZE = 1024 };

static void fill_block(void *context, int block)
{
    const struct cells *const cells = context;
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t i = first; i < cells->count && i < first + BLOCK_SIZE; i++)
        fill_cell(cells, i);
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

static bool append_cells(struct cells *cells, size_t key_count, dipole_status *status)
{
    for (size_t i = 0; i < key_count; i++)
        cells->count += is_new_cell(cells->keys, i);
    cells->first_keys = malloc((cells->count + 1) * sizeof *cells->first_keys);
    cells->samples = malloc((cells->count + 1) * sizeof *cells->samples);
    if (!cells->first_keys || !cells->samples)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                           cells->count);
    for (size_t i = 0, next = 0; i < key_count; i++) {
        if (is_new_cell(cells->keys, i))
            cells->first_keys[next++] = i;
    }
    cells->first_keys[cells->count] = key_count;
    lut_parallel_for((int)((cells->count + BLOCK_SIZE - 1) / BLOCK_SIZE), 0, fill_block, cells);
    bool done = true;
    for (size_t i = 0; done && i < cells->count; i++) {
        const struct render_z_key *const key = &cells->keys[cells->first_keys[i]];
        done = append(cells->targets[(int)key->object].samples, &cells->samples[i], key->code, status);
    }
    return done;
}

static bool append_texels(struct lit_texels *lit, dipole_status *status)
{
    const int side_px = lit->view->size_px;
    lut_parallel_for(side_px, 0, count_row, lit);
    for (int row = 0; row < side_px; row++)
        lit->first_of_row[row + 1] += lit->first_of_row[row];
    const size_t texel_count = lit->first_of_row[side_px];
    lit->keys = malloc(2 * (texel_count + 1) * sizeof *lit->keys);
    if (!lit->keys)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu lit texels", texel_count);
    lut_parallel_for(side_px, 0, fill_row, lit);
    const size_t count = close_up(lit);
    struct cells cells = { .targets = lit->targets,
                           .view = lit->view,
                           .keys = render_light_samples_sort_keys(lit->keys, lit->keys + count, count) };
    const bool done = append_cells(&cells, count, status);
    free(cells.first_keys);
    free(cells.samples);
    return done;
}

bool render_cell_samples_append(const struct render_light_target *targets,
                                const struct render_light_view *view, dipole_status *status)
{
    const size_t side_px = (size_t)view->size_px;
    struct lit_texels lit = { .targets = targets,
                              .view = view,
                              .first_of_row = calloc(side_px + 1, sizeof *lit.first_of_row),
                              .count_of_row = calloc(side_px + 1, sizeof *lit.count_of_row) };
    assert(view->rest_mm);
    const bool done = lit.first_of_row && lit.count_of_row
                          ? append_texels(&lit, status)
                          : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                                        "no memory for a light's view of %d texels a side", view->size_px);
    free(lit.first_of_row);
    free(lit.count_of_row);
    free(lit.keys);
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
