#include "renderer/environment_samples.h"

#include "lutgen/parallel.h"
#include "renderer/projection.h"
#include "renderer/reference_surface.h"
#include "renderer/render.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cubes are so wide, as part of the spacing: with a patch sticking out by two thirds of its extent on
 * either side, no sample is wider than the spacing. */
#define CUBE_SHARE 0.7

enum {
    FIRST_CELLS = 1 << 12,
    WAITING_PATCHES = 1 << 14, /* are lit together, by all threads              */
    LIT_AT_ONCE = 256,         /* by one thread                                 */
    CUT_DEPTH = 64,            /* of a triangle: halved no more often than this */
};

/* Patches of a cube that face one way. */
struct cell {
    uint64_t code; /* of the cube, on the curve                              */
    int face;      /* axis that the facets face most, times 2; plus 1: down it */
    float min_mm[3], max_mm[3], extent_mm;
    double flux_w[3], moment[3], weight, area_mm2;
    struct render_patch largest;
};

struct waiting {
    struct render_patch patch;
    double rgb[3];
};

struct render_patches {
    const struct render_irradiance *irradiance;
    double min_mm[3], spacing_mm;
    struct cell *cells;
    size_t cell_count, cell_capacity;
    uint32_t *slots; /* 1 + index into cells; twice as many as cells, a power of two */
    struct waiting *waiting;
    int waiting_count;
    const struct render_visibility *visibility; /* of finish */
};

bool render_patches_create(const struct render_irradiance *irradiance, const double min_mm[3],
                           double spacing_mm, struct render_patches **patches_out, dipole_status *status)
{
    *patches_out = NULL;
    struct render_patches *const patches = calloc(1, sizeof *patches);
    if (patches) {
        patches->irradiance = irradiance;
        patches->spacing_mm = spacing_mm;
        memcpy(patches->min_mm, min_mm, sizeof patches->min_mm);
        patches->cell_capacity = FIRST_CELLS;
        patches->cells = malloc(FIRST_CELLS * sizeof *patches->cells);
        patches->slots = calloc(2 * (size_t)FIRST_CELLS, sizeof *patches->slots);
        patches->waiting = malloc(WAITING_PATCHES * sizeof *patches->waiting);
    }
    if (!patches || !patches->cells || !patches->slots || !patches->waiting) {
        render_patches_destroy(patches);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for patches of surface");
    }
    *patches_out = patches;
    return true;
}

void render_patches_destroy(struct render_patches *patches)
{
    if (!patches)
        return;
    free(patches->cells);
    free(patches->slots);
    free(patches->waiting);
    free(patches);
}

/* ---- cells -------------------------------------------------------------------------------------- */

static int face_of(const double normal[3])
{
    int axis = 0;
    for (int k = 1; k < 3; k++)
        axis = fabs(normal[k]) > fabs(normal[axis]) ? k : axis;
    return 2 * axis + (normal[axis] < 0);
}

static size_t slot_of(const struct render_patches *patches, uint64_t code, int face)
{
    const size_t mask = 2 * patches->cell_capacity - 1;
    uint64_t x = (code * 8 + (uint64_t)face) * 0x9e3779b97f4a7c15u;
    size_t slot = (size_t)(x ^ (x >> 32)) & mask;
    while (patches->slots[slot]) {
        const struct cell *const cell = &patches->cells[patches->slots[slot] - 1];
        if (cell->code == code && cell->face == face)
            break;
        slot = (slot + 1) & mask;
    }
    return slot;
}

static bool grow(struct render_patches *patches, dipole_status *status)
{
    const size_t capacity = 2 * patches->cell_capacity;
    if (capacity > RENDER_LIGHT_SAMPLE_LIMIT)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, NULL,
            "the surface has more than %zu light samples %.3g mm wide: a larger epsilon needs "
            "fewer",
            RENDER_LIGHT_SAMPLE_LIMIT, patches->spacing_mm);
    struct cell *const cells = realloc(patches->cells, capacity * sizeof *cells);
    if (cells)
        patches->cells = cells;
    uint32_t *const slots = calloc(2 * capacity, sizeof *slots);
    if (!cells || !slots) {
        free(slots);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples", capacity);
    }
    free(patches->slots);
    patches->slots = slots;
    patches->cell_capacity = capacity;
    for (size_t i = 0; i < patches->cell_count; i++)
        slots[slot_of(patches, cells[i].code, cells[i].face)] = (uint32_t)(i + 1);
    return true;
}

static uint64_t code_of(const struct render_patches *patches, const double position_mm[3])
{
    return render_cube_code(position_mm, patches->min_mm, CUBE_SHARE * patches->spacing_mm);
}

static bool put(struct render_patches *patches, const struct waiting *lit, dipole_status *status)
{
    const struct render_patch *const patch = &lit->patch;
    const uint64_t code = code_of(patches, patch->position_mm);
    const int face = face_of(patch->facet_normal);
    size_t slot = slot_of(patches, code, face);
    if (!patches->slots[slot]) {
        if (patches->cell_count == patches->cell_capacity) {
            if (!grow(patches, status))
                return false;
            slot = slot_of(patches, code, face);
        }
        struct cell *const cell = &patches->cells[patches->cell_count++];
        *cell = (struct cell){ .code = code, .face = face };
        for (int k = 0; k < 3; k++) {
            cell->min_mm[k] = INFINITY;
            cell->max_mm[k] = -INFINITY;
        }
        patches->slots[slot] = (uint32_t)patches->cell_count;
    }
    struct cell *const cell = &patches->cells[patches->slots[slot] - 1];
    const double weight = patch->area_mm2 * (lit->rgb[0] + lit->rgb[1] + lit->rgb[2]);
    cell->weight += weight;
    cell->area_mm2 += patch->area_mm2;
    cell->extent_mm = fmaxf(cell->extent_mm, (float)patch->extent_mm);
    if (!(patch->area_mm2 <= cell->largest.area_mm2))
        cell->largest = *patch;
    for (int k = 0; k < 3; k++) {
        cell->flux_w[k] += patch->area_mm2 * lit->rgb[k];
        cell->moment[k] += weight * patch->position_mm[k];
        cell->min_mm[k] = fminf(cell->min_mm[k], (float)patch->position_mm[k]);
        cell->max_mm[k] = fmaxf(cell->max_mm[k], (float)patch->position_mm[k]);
    }
    return true;
}

static void light_some(void *context, int part)
{
    struct render_patches *const patches = context;
    for (int i = part * LIT_AT_ONCE; i < (part + 1) * LIT_AT_ONCE && i < patches->waiting_count; i++)
        render_irradiance_at(patches->irradiance, patches->waiting[i].patch.normal,
                             patches->waiting[i].rgb);
}

static bool flush(struct render_patches *patches, dipole_status *status)
{
    bool done = true;
    lut_parallel_for((patches->waiting_count + LIT_AT_ONCE - 1) / LIT_AT_ONCE, 0, light_some, patches);
    for (int i = 0; done && i < patches->waiting_count; i++)
        done = put(patches, &patches->waiting[i], status);
    patches->waiting_count = 0;
    return done;
}

bool render_patches_add(struct render_patches *patches, const struct render_patch *patch,
                        dipole_status *status)
{
    if (!(patch->area_mm2 > 0))
        return true;
    patches->waiting[patches->waiting_count++].patch = *patch;
    return patches->waiting_count < WAITING_PATCHES || flush(patches, status);
}

/* ---- triangles ---------------------------------------------------------------------------------- */

/* Part of a triangle, by the weights of its corners. */
struct piece {
    double weights[3][3];
};

/* Pieces of one triangle that fall one after the other into one cube have one normal for their light: it
 * hardly differs. */
struct cutter {
    struct render_patches *patches;
    const struct io_mesh *mesh;
    size_t triangle;
    double corners_mm[3][3], area_mm2, limit_mm;
    uint64_t code; /* of the pieces gathered                        */
    double gathered_mm2, weights[3], extent_mm;
    dipole_status *status;
};

static bool add_gathered(struct cutter *cutter)
{
    if (!(cutter->gathered_mm2 > 0))
        return true;
    struct render_surface_point point;
    for (int i = 0; i < 3; i++)
        cutter->weights[i] /= cutter->gathered_mm2;
    render_triangle_point(cutter->mesh, cutter->triangle, cutter->weights, &point);
    struct render_patch patch = { .area_mm2 = cutter->gathered_mm2, .extent_mm = cutter->extent_mm };
    memcpy(patch.position_mm, point.position_mm, sizeof patch.position_mm);
    memcpy(patch.normal, point.normal, sizeof patch.normal);
    memcpy(patch.facet_normal, point.facet_normal, sizeof patch.facet_normal);
    if (!(render_dot(patch.normal, patch.normal) > 0)) /* normals of the corners that cancel */
        memcpy(patch.normal, patch.facet_normal, sizeof patch.normal);
    cutter->gathered_mm2 = cutter->extent_mm = 0;
    memset(cutter->weights, 0, sizeof cutter->weights);
    return render_patches_add(cutter->patches, &patch, cutter->status);
}

static bool gather(struct cutter *cutter, const struct piece *piece, double extent_mm, double area_mm2)
{
    double middle[3], position_mm[3];
    for (int i = 0; i < 3; i++)
        middle[i] = (piece->weights[0][i] + piece->weights[1][i] + piece->weights[2][i]) / 3;
    for (int k = 0; k < 3; k++)
        position_mm[k] = middle[0] * cutter->corners_mm[0][k] + middle[1] * cutter->corners_mm[1][k] +
                         middle[2] * cutter->corners_mm[2][k];
    const uint64_t code = code_of(cutter->patches, position_mm);
    if (code != cutter->code && !add_gathered(cutter))
        return false;
    cutter->code = code;
    cutter->gathered_mm2 += area_mm2;
    cutter->extent_mm = fmax(cutter->extent_mm, extent_mm);
    for (int i = 0; i < 3; i++)
        cutter->weights[i] += area_mm2 * middle[i];
    return true;
}

/* Halve across the longest side until it is short enough. */
static bool cut(struct cutter *cutter, const struct piece *piece, double area_mm2, int depth)
{
    double longest2 = -1;
    int tip = 0;
    for (int i = 0; i < 3; i++) {
        double side_mm[3] = { 0 };
        for (int j = 0; j < 3; j++) {
            const double part = piece->weights[(i + 1) % 3][j] - piece->weights[(i + 2) % 3][j];
            for (int k = 0; k < 3; k++)
                side_mm[k] += part * cutter->corners_mm[j][k];
        }
        const double length2 = render_dot(side_mm, side_mm);
        if (length2 > longest2) {
            longest2 = length2;
            tip = i;
        }
    }
    if (longest2 <= cutter->limit_mm * cutter->limit_mm || depth == 0)
        return gather(cutter, piece, sqrt(longest2), area_mm2);
    struct piece first, second;
    for (int j = 0; j < 3; j++) {
        const double middle = 0.5 * (piece->weights[(tip + 1) % 3][j] + piece->weights[(tip + 2) % 3][j]);
        first.weights[0][j] = piece->weights[tip][j];
        first.weights[1][j] = piece->weights[(tip + 1) % 3][j];
        first.weights[2][j] = second.weights[1][j] = middle;
        second.weights[0][j] = piece->weights[tip][j];
        second.weights[2][j] = piece->weights[(tip + 2) % 3][j];
    }
    return cut(cutter, &first, 0.5 * area_mm2, depth - 1) &&
           cut(cutter, &second, 0.5 * area_mm2, depth - 1);
}

bool render_patches_add_mesh(struct render_patches *patches, const struct io_mesh *mesh,
                             dipole_status *status)
{
    const struct piece whole = { .weights = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        struct cutter cutter = { .patches = patches,
                                 .mesh = mesh,
                                 .triangle = t,
                                 .limit_mm = RENDER_PATCH_SHARE * patches->spacing_mm,
                                 .status = status };
        double normal[3];
        render_triangle_corners(mesh, t, cutter.corners_mm);
        render_triangle_normal((const double(*)[3])cutter.corners_mm, normal);
        cutter.area_mm2 = 0.5 * sqrt(render_dot(normal, normal));
        if (cutter.area_mm2 > 0 &&
            (!cut(&cutter, &whole, cutter.area_mm2, CUT_DEPTH) || !add_gathered(&cutter)))
            return false;
    }
    return true;
}

/* ---- samples ------------------------------------------------------------------------------------ */

/* By the curve, then by the way they face: the same order everywhere. */
static int compare_cells(const void *a, const void *b)
{
    const struct cell *const x = a, *const y = b;
    if (x->code != y->code)
        return x->code < y->code ? -1 : 1;
    return x->face - y->face;
}

static void hide_some(void *context, int part)
{
    struct render_patches *const patches = context;
    const size_t begin = (size_t)part * LIT_AT_ONCE;
    for (size_t i = begin; i < begin + LIT_AT_ONCE && i < patches->cell_count; i++) {
        struct cell *const cell = &patches->cells[i];
        double share[3];
        render_visibility_share(patches->visibility, cell->largest.position_mm, cell->largest.normal,
                                cell->largest.facet_normal, cell->code * 8 + (uint64_t)cell->face, share);
        for (int c = 0; c < 3; c++)
            cell->flux_w[c] *= share[c];
    }
}

bool render_patches_finish(struct render_patches *patches, float object,
                           const struct render_visibility *visibility, struct render_light_samples *samples,
                           dipole_status *status)
{
    bool done = flush(patches, status);
    if (!done)
        return false;
    qsort(patches->cells, patches->cell_count, sizeof *patches->cells, compare_cells);
    patches->visibility = visibility;
    if (visibility)
        lut_parallel_for((int)((patches->cell_count + LIT_AT_ONCE - 1) / LIT_AT_ONCE), 0, hide_some,
                         patches);
    for (size_t i = 0; done && i < patches->cell_count; i++) {
        const struct cell *const cell = &patches->cells[i];
        struct render_light_sample sample = { .object = object };
        double diagonal2 = 0;
        if (!(cell->flux_w[0] + cell->flux_w[1] + cell->flux_w[2] > 0))
            continue;
        for (int k = 0; k < 3; k++) {
            const double width_mm = (double)cell->max_mm[k] - (double)cell->min_mm[k];
            sample.position_mm[k] = (float)(cell->moment[k] / cell->weight);
            sample.flux_w[k] = (float)cell->flux_w[k];
            diagonal2 += width_mm * width_mm;
        }
        sample.footprint_mm = (float)sqrt(diagonal2) + cell->extent_mm;
        done = render_light_samples_add(samples, &sample, status);
    }
    return done;
}
