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
    float min_mm[3], max_mm[3];
    double flux_w[3], area_mm2;
    struct render_spread_sums sums;
    struct render_patch largest;
};

struct waiting {
    struct render_patch patch;
    double rgb[3];
};

struct render_patches {
    const struct render_irradiance_table *irradiance;
    double min_mm[3], spacing_mm;
    struct cell *cells;
    size_t cell_count, cell_capacity;
    uint32_t *slots; /* 1 + index into cells; twice as many as cells, a power of two */
    struct waiting *waiting;
    int waiting_count;
    const struct render_visibility *visibility; /* of finish */
};

bool render_patches_create(const struct render_irradiance_table *irradiance, const double min_mm[3],
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

/* Of a patch about its middle: a twelfth of its area, both ways along it, as a square's is. */
static void add_own_spread(struct render_spread_sums *sums, double weight, const struct render_patch *patch)
{
    const double *const n = patch->facet_normal, along = weight * patch->area_mm2 / 12;
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        sums->second[k] += along * (1 - n[k] * n[k]);
        sums->second[3 + k] -= along * n[a] * n[b];
    }
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
    render_spread_add(&cell->sums, weight, patch->position_mm[0], patch->position_mm[1],
                      patch->position_mm[2]);
    add_own_spread(&cell->sums, weight, patch);
    cell->area_mm2 += patch->area_mm2;
    if (!(patch->area_mm2 <= cell->largest.area_mm2))
        cell->largest = *patch;
    for (int k = 0; k < 3; k++) {
        cell->flux_w[k] += patch->area_mm2 * lit->rgb[k];
        cell->min_mm[k] = patch->min_mm[k] < cell->min_mm[k] ? patch->min_mm[k] : cell->min_mm[k];
        cell->max_mm[k] = patch->max_mm[k] > cell->max_mm[k] ? patch->max_mm[k] : cell->max_mm[k];
    }
    return true;
}

static void light_some(void *context, int part)
{
    struct render_patches *const patches = context;
    for (int i = part * LIT_AT_ONCE; i < (part + 1) * LIT_AT_ONCE && i < patches->waiting_count; i++)
        render_irradiance_table_at(patches->irradiance, patches->waiting[i].patch.normal,
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

/* Of a part of a triangle: weights of the triangle's corners, and where that is, in cubes. */
struct corner {
    double weights[3], at[3];
    int64_t cube[3];
};

/* Pieces of one triangle that fall one after the other into one cube have one normal for their light: it
 * hardly differs. */
struct cutter {
    struct render_patches *patches;
    double cube_mm, limit2; /* square of the longest side, in cubes, that need not be cut */
    double corners_mm[3][3], normals[3][3], facet_normal[3];
    int64_t cube[3]; /* of the pieces gathered */
    double gathered_mm2, weights[3], min[3], max[3];
    dipole_status *status;
};

static void place(struct corner *corner)
{
    for (int k = 0; k < 3; k++)
        corner->cube[k] = (int64_t)corner->at[k];
}

static bool add_gathered(struct cutter *cutter)
{
    if (!(cutter->gathered_mm2 > 0))
        return true;
    struct render_patch patch = { .area_mm2 = cutter->gathered_mm2 };
    memcpy(patch.facet_normal, cutter->facet_normal, sizeof patch.facet_normal);
    for (int i = 0; i < 3; i++) {
        const double weight = cutter->weights[i] / cutter->gathered_mm2;
        for (int k = 0; k < 3; k++) {
            patch.position_mm[k] += weight * cutter->corners_mm[i][k];
            patch.normal[k] += weight * cutter->normals[i][k];
        }
    }
    for (int k = 0; k < 3; k++) {
        patch.min_mm[k] = (float)(cutter->patches->min_mm[k] + cutter->cube_mm * cutter->min[k]);
        patch.max_mm[k] = (float)(cutter->patches->min_mm[k] + cutter->cube_mm * cutter->max[k]);
    }
    const double length2 = render_dot(patch.normal, patch.normal);
    if (length2 > 0) {
        for (int k = 0; k < 3; k++)
            patch.normal[k] /= sqrt(length2);
    } else { /* normals of the corners that cancel */
        memcpy(patch.normal, patch.facet_normal, sizeof patch.normal);
    }
    cutter->gathered_mm2 = 0;
    return render_patches_add(cutter->patches, &patch, cutter->status);
}

/* Begin to gather in a cube. */
static void begin_cube(struct cutter *cutter, const int64_t cube[3])
{
    for (int k = 0; k < 3; k++) {
        cutter->cube[k] = cube[k];
        cutter->weights[k] = 0;
        cutter->min[k] = INFINITY;
        cutter->max[k] = -INFINITY;
    }
}

static bool gather(struct cutter *cutter, const struct corner *const corners[3], const int64_t cube[3],
                   double area_mm2)
{
    if (!(cutter->gathered_mm2 > 0) || memcmp(cube, cutter->cube, sizeof cutter->cube) != 0) {
        if (!add_gathered(cutter))
            return false;
        begin_cube(cutter, cube);
    }
    cutter->gathered_mm2 += area_mm2;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++) {
            cutter->weights[k] += area_mm2 / 3 * corners[i]->weights[k];
            cutter->min[k] = corners[i]->at[k] < cutter->min[k] ? corners[i]->at[k] : cutter->min[k];
            cutter->max[k] = corners[i]->at[k] > cutter->max[k] ? corners[i]->at[k] : cutter->max[k];
        }
    }
    return true;
}

static double distance2(const struct corner *a, const struct corner *b)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (a->at[k] - b->at[k]) * (a->at[k] - b->at[k]);
    return sum;
}

/* Halve across the longest side until all is in one cube, or that side is short enough. */
static bool cut(struct cutter *cutter, const struct corner *const corners[3], double area_mm2, int depth)
{
    if (memcmp(corners[0]->cube, corners[1]->cube, sizeof corners[0]->cube) == 0 &&
        memcmp(corners[0]->cube, corners[2]->cube, sizeof corners[0]->cube) == 0)
        return gather(cutter, corners, corners[0]->cube, area_mm2);
    struct corner middle;
    double longest2 = -1;
    int tip = 0;
    for (int i = 0; i < 3; i++) {
        const double length2 = distance2(corners[(i + 1) % 3], corners[(i + 2) % 3]);
        if (length2 > longest2) {
            longest2 = length2;
            tip = i;
        }
    }
    if (longest2 <= cutter->limit2 || depth == 0) {
        for (int k = 0; k < 3; k++)
            middle.at[k] = (corners[0]->at[k] + corners[1]->at[k] + corners[2]->at[k]) / 3;
        place(&middle);
        return gather(cutter, corners, middle.cube, area_mm2);
    }
    const struct corner *const one = corners[(tip + 1) % 3], *const other = corners[(tip + 2) % 3];
    for (int k = 0; k < 3; k++) {
        middle.at[k] = 0.5 * (one->at[k] + other->at[k]);
        middle.weights[k] = 0.5 * (one->weights[k] + other->weights[k]);
    }
    place(&middle);
    const struct corner *const first[3] = { corners[tip], one, &middle }, *const second[3] = { corners[tip],
                                                                                               &middle,
                                                                                               other };
    return cut(cutter, first, 0.5 * area_mm2, depth - 1) && cut(cutter, second, 0.5 * area_mm2, depth - 1);
}

static bool cut_triangle(struct cutter *cutter, const struct io_mesh *mesh, size_t triangle)
{
    struct corner corners[3];
    double normal[3];
    render_triangle_corners(mesh, triangle, cutter->corners_mm);
    render_triangle_normal((const double(*)[3])cutter->corners_mm, normal);
    const double length = sqrt(render_dot(normal, normal));
    if (!(length > 0))
        return true;
    for (size_t i = 0; i < 3; i++) {
        const float *const n = mesh->normals + 3 * (size_t)mesh->indices[3 * triangle + i];
        cutter->facet_normal[i] = normal[i] / length;
        for (size_t k = 0; k < 3; k++) {
            cutter->normals[i][k] = (double)n[k];
            corners[i].weights[k] = i == k;
            corners[i].at[k] = (cutter->corners_mm[i][k] - cutter->patches->min_mm[k]) / cutter->cube_mm;
        }
        place(&corners[i]);
    }
    const struct corner *const whole[3] = { &corners[0], &corners[1], &corners[2] };
    return cut(cutter, whole, 0.5 * length, CUT_DEPTH) && add_gathered(cutter);
}

bool render_patches_add_mesh(struct render_patches *patches, const struct io_mesh *mesh,
                             dipole_status *status)
{
    const double limit = RENDER_PATCH_SHARE / CUBE_SHARE;
    struct cutter cutter = { .patches = patches,
                             .cube_mm = CUBE_SHARE * patches->spacing_mm,
                             .limit2 = limit * limit,
                             .status = status };
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        if (!cut_triangle(&cutter, mesh, t))
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
            sample.position_mm[k] = (float)(cell->sums.first[k] / cell->sums.weight);
            sample.flux_w[k] = (float)cell->flux_w[k];
            diagonal2 += width_mm * width_mm;
        }
        sample.footprint_mm = (float)sqrt(diagonal2);
        render_spread_of(&cell->sums, 1, patches->spacing_mm, sample.spread_mm2);
        done = render_light_samples_add(samples, &sample, status);
    }
    return done;
}
