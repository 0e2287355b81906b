#include "renderer/light_picture.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    STEPS =
        256, /* places of corners in a texel, along x and y: as in OpenGL, edges then meet without gaps */
    BAND_ROWS = 16,   /* of texels, drawn by one thread at a time */
    BLOCK_SIZE = 4096 /* of vertices or triangles, the same       */
};

/* A vertex in the picture: steps from its lower left corner, and mm along the light. */
struct corner {
    int32_t x, y;
    float depth_mm;
};

/* Rows whose middles a triangle may cover; none: last < first. */
struct rows {
    int16_t first, last;
};

/* A triangle of a mesh. */
struct entry {
    uint32_t mesh, triangle;
};

/* What a texel shows: which entry of the band, from 1, and weights of its second and third corner. It is
 * kept where the texel itself comes to be. */
struct seen {
    float b, c, depth_mm;
    uint32_t entry;
};
_Static_assert(sizeof(struct seen) == 4 * sizeof(float), "as large as a texel");

struct drawing {
    const struct render_light_picture *picture;
    float *texels, *objects;
    struct corner *corners;                   /* of all meshes */
    struct rows *rows;                        /* of all triangles */
    size_t *first_corner, *first_triangle;    /* of each mesh, and one past the last */
    size_t mesh;                              /* that is being placed */
    size_t band_count, *first_entry, *placed; /* of each band */
    struct entry *entries;
};

/* ---- corners ------------------------------------------------------------------------------------ */

static void place_corners(void *context, int block)
{
    const struct drawing *const drawing = context;
    const struct render_light_picture *const picture = drawing->picture;
    const struct render_projection *const view = picture->projection;
    const struct io_mesh *const mesh = picture->meshes[drawing->mesh].mesh;
    struct corner *const corners = drawing->corners + drawing->first_corner[drawing->mesh];
    const double scale = 0.5 * picture->size_px * STEPS, side = (double)picture->size_px * STEPS;
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t v = first; v < mesh->vertex_count && v < first + BLOCK_SIZE; v++) {
        const float *const at = &mesh->positions[3 * v];
        const double position_mm[3] = { (double)at[0], (double)at[1], (double)at[2] };
        double place_mm[3];
        render_projection_to_view(view, position_mm, place_mm);
        const double x = scale * (place_mm[0] / view->half_width + 1),
                     y = scale * (place_mm[1] / view->half_height + 1);
        corners[v] = (struct corner){ .x = (int32_t)lrint(fmin(fmax(x, 0), side)),
                                      .y = (int32_t)lrint(fmin(fmax(y, 0), side)),
                                      .depth_mm = (float)place_mm[2] };
    }
}

/* ---- triangles ---------------------------------------------------------------------------------- */

static int32_t least(int32_t a, int32_t b, int32_t c)
{
    const int32_t of_two = a < b ? a : b;
    return of_two < c ? of_two : c;
}

static int32_t most(int32_t a, int32_t b, int32_t c)
{
    return -least(-a, -b, -c);
}

/* The first texel whose middle is not before a place, and the last that is not after it. */
static int32_t texel_from(int32_t place)
{
    return (place + STEPS / 2 - 1) / STEPS;
}

static int32_t texel_to(int32_t place)
{
    return (place + STEPS / 2) / STEPS - 1;
}

/* Twice the area, in steps^2; > 0: counter-clockwise, seen from the front. */
static int64_t area_of(const struct corner *a, const struct corner *b, const struct corner *c)
{
    return (int64_t)(b->x - a->x) * (c->y - a->y) - (int64_t)(c->x - a->x) * (b->y - a->y);
}

static void place_triangles(void *context, int block)
{
    const struct drawing *const drawing = context;
    const struct render_light_mesh *const of = &drawing->picture->meshes[drawing->mesh];
    const struct corner *const corners = drawing->corners + drawing->first_corner[drawing->mesh];
    struct rows *const rows = drawing->rows + drawing->first_triangle[drawing->mesh];
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t t = first; t < of->mesh->triangle_count && t < first + BLOCK_SIZE; t++) {
        const uint32_t *const index = &of->mesh->indices[3 * t];
        const struct corner *const a = &corners[index[0]], *const b = &corners[index[1]],
                                   *const c = &corners[index[2]];
        const int64_t area = area_of(a, b, c);
        rows[t] = (struct rows){ .first = 0, .last = -1 };
        if (area == 0 || (area < 0 && of->has_hidden_inside) ||
            texel_from(least(a->x, b->x, c->x)) > texel_to(most(a->x, b->x, c->x)))
            continue;
        rows[t].first = (int16_t)texel_from(least(a->y, b->y, c->y));
        rows[t].last = (int16_t)texel_to(most(a->y, b->y, c->y));
    }
}

/* Each triangle to every band that it may show in, in the order of the meshes. */
static bool share_out(struct drawing *drawing)
{
    const struct render_light_picture *const picture = drawing->picture;
    for (int is_placing = 0; is_placing < 2; is_placing++) {
        for (size_t m = 0; m < picture->mesh_count; m++) {
            for (size_t t = 0; t < picture->meshes[m].mesh->triangle_count; t++) {
                const struct rows rows = drawing->rows[drawing->first_triangle[m] + t];
                if (rows.last < rows.first)
                    continue;
                for (int band = rows.first / BAND_ROWS; band <= rows.last / BAND_ROWS; band++) {
                    if (is_placing)
                        drawing->entries[drawing->placed[band]++] =
                            (struct entry){ .mesh = (uint32_t)m, .triangle = (uint32_t)t };
                    else
                        drawing->first_entry[band + 1]++;
                }
            }
        }
        for (size_t band = 0; !is_placing && band < drawing->band_count; band++) {
            drawing->first_entry[band + 1] += drawing->first_entry[band];
            drawing->placed[band] = drawing->first_entry[band];
        }
        if (!is_placing)
            drawing->entries =
                calloc(drawing->first_entry[drawing->band_count] + 1, sizeof *drawing->entries);
        if (!drawing->entries)
            return false;
    }
    return true;
}

/* ---- texels ------------------------------------------------------------------------------------- */

/* Twice the area of an edge and a texel's middle, in steps^2: how it changes from texel to texel. */
struct edge {
    int64_t here, by_x, by_y;
};

/* From a to b, at the middle of texel (x, y). Middles that lie on an edge belong to the triangle on one
 * side of it.
 */
static struct edge edge_of(const struct corner *a, const struct corner *b, int32_t x, int32_t y)
{
    const int64_t dx = b->x - a->x, dy = b->y - a->y;
    const bool is_owner = dy < 0 || (dy == 0 && dx < 0);
    const int64_t from_x = (int64_t)x * STEPS + STEPS / 2 - a->x,
                  from_y = (int64_t)y * STEPS + STEPS / 2 - a->y;
    return (struct edge){ .here = dx * from_y - dy * from_x - (is_owner ? 0 : 1),
                          .by_x = -dy * STEPS,
                          .by_y = dx * STEPS };
}

/* Rows from low to high, of which seen has the first. */
static void draw_triangle(const struct drawing *drawing, const struct entry *entry, uint32_t number,
                          int low, int high, struct seen *seen)
{
    const struct render_light_picture *const picture = drawing->picture;
    const struct corner *const corners = drawing->corners + drawing->first_corner[entry->mesh];
    const uint32_t *const index = &picture->meshes[entry->mesh].mesh->indices[3 * (size_t)entry->triangle];
    const struct corner *const a = &corners[index[0]];
    const struct corner *b = &corners[index[1]], *c = &corners[index[2]];
    const struct rows rows = drawing->rows[drawing->first_triangle[entry->mesh] + entry->triangle];
    const bool is_behind = area_of(a, b, c) < 0;
    if (is_behind) {
        const struct corner *const swap = b;
        b = c;
        c = swap;
    }
    const int32_t left = texel_from(least(a->x, b->x, c->x)), right = texel_to(most(a->x, b->x, c->x));
    const int first = rows.first > low ? rows.first : low, last = rows.last < high ? rows.last : high;
    struct edge of_a = edge_of(b, c, left, first), of_b = edge_of(c, a, left, first),
                of_c = edge_of(a, b, left, first);
    const float scale = 1 / (float)area_of(a, b, c);
    const float b_mm = b->depth_mm - a->depth_mm, c_mm = c->depth_mm - a->depth_mm;
    for (int y = first; y <= last; y++) {
        struct seen *const row = seen + (size_t)(y - low) * (size_t)picture->size_px;
        int64_t at_a = of_a.here, at_b = of_b.here, at_c = of_c.here;
        for (int32_t x = left; x <= right; x++) {
            if ((at_a | at_b | at_c) >= 0) {
                const float part_b = scale * (float)at_b, part_c = scale * (float)at_c;
                const float depth_mm = a->depth_mm + part_b * b_mm + part_c * c_mm;
                if (row[x].entry == 0 || depth_mm < row[x].depth_mm)
                    row[x] = (struct seen){ .entry = number,
                                            .b = is_behind ? part_c : part_b,
                                            .c = is_behind ? part_b : part_c,
                                            .depth_mm = depth_mm };
            }
            at_a += of_a.by_x;
            at_b += of_b.by_x;
            at_c += of_c.by_x;
        }
        of_a.here += of_a.by_y;
        of_b.here += of_b.by_y;
        of_c.here += of_c.by_y;
    }
}

/* What is interpolated over a triangle: position and normal of its first corner, and steps to the others.
 */
struct surface {
    float position_mm[3][3], normal[3][3];
    float eta, size_mm2; /* of a texel; 0: seen from behind */
    float object;
};

static void find_surface(const struct drawing *drawing, const struct entry *entry, struct surface *surface)
{
    const struct render_light_picture *const picture = drawing->picture;
    const struct render_light_mesh *const of = &picture->meshes[entry->mesh];
    const struct corner *const corners = drawing->corners + drawing->first_corner[entry->mesh];
    const uint32_t *const index = &of->mesh->indices[3 * (size_t)entry->triangle];
    for (int k = 0; k < 3; k++) {
        for (int i = 2; i >= 0; i--) {
            const size_t at = 3 * (size_t)index[i] + (size_t)k, from = 3 * (size_t)index[0] + (size_t)k;
            surface->position_mm[i][k] = of->mesh->positions[at] - (i > 0 ? of->mesh->positions[from] : 0);
            surface->normal[i][k] = of->mesh->normals[at] - (i > 0 ? of->mesh->normals[from] : 0);
        }
    }
    const bool is_front = area_of(&corners[index[0]], &corners[index[1]], &corners[index[2]]) > 0;
    surface->eta = (float)of->eta;
    surface->size_mm2 = is_front ? (float)picture->texel_area_mm2 : 0;
    surface->object = (float)(entry->mesh + 1);
}

/* Texels of which all but the share of power is known. */
enum { RUN_SIZE = 64 };
struct run {
    float along[RUN_SIZE], length2[RUN_SIZE]; /* of the normal: times the way to the light, and squared */
    float eta[RUN_SIZE], size_mm2[RUN_SIZE];
    float *texels[RUN_SIZE];
    size_t count;
};

static void find_position(const struct surface *surface, const struct seen *seen, const float to_light[3],
                          float texel[4], struct run *run)
{
    float length2 = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        const float normal =
            surface->normal[0][k] + seen->b * surface->normal[1][k] + seen->c * surface->normal[2][k];
        texel[k] = surface->position_mm[0][k] + seen->b * surface->position_mm[1][k] +
                   seen->c * surface->position_mm[2][k];
        length2 += normal * normal;
        along += normal * to_light[k];
    }
    run->along[run->count] = along;
    run->length2[run->count] = length2;
    run->eta[run->count] = surface->eta;
    run->size_mm2[run->count] = surface->size_mm2;
    run->texels[run->count++] = texel;
}

/* 1 less the reflectance of a smooth surface (common/fresnel.glsl), times the size; without branches, so
 * that several are computed at a time. */
static void find_shares(struct run *run)
{
    float shares[RUN_SIZE];
    for (size_t i = 0; i < run->count; i++) {
        const float eta = run->eta[i];
        const float unit = run->along[i] / sqrtf(run->length2[i]);
        const float held = run->length2[i] > 1e-30f ? unit : 1; /* 1 where the corners' normals cancel */
        const float above = held > 0 ? held : 0, cosine = above < 1 ? above : 1;
        const float cosine2_refracted = 1 - (1 - cosine * cosine) / (eta * eta);
        const float refracted = sqrtf(cosine2_refracted > 0 ? cosine2_refracted : 0);
        const float s = (cosine - eta * refracted) / (cosine + eta * refracted);
        const float p = (eta * cosine - refracted) / (eta * cosine + refracted);
        const float share = run->size_mm2[i] * (1 - 0.5f * (s * s + p * p));
        shares[i] = cosine2_refracted > 0 ? share : 0;
    }
    for (size_t i = 0; i < run->count; i++)
        run->texels[i][3] = shares[i];
    run->count = 0;
}

static void draw_band(void *context, int band)
{
    const struct drawing *const drawing = context;
    const struct render_light_picture *const picture = drawing->picture;
    const size_t width = (size_t)picture->size_px, first = (size_t)band * BAND_ROWS * width;
    const int low = band * BAND_ROWS,
              high = low + BAND_ROWS <= picture->size_px ? low + BAND_ROWS - 1 : picture->size_px - 1;
    const size_t count = (size_t)(high - low + 1) * width;
    struct seen *const seen = (struct seen *)(void *)(drawing->texels + 4 * first);
    const struct entry *const entries = drawing->entries + drawing->first_entry[band];
    const size_t entry_count = drawing->first_entry[band + 1] - drawing->first_entry[band];
    float to_light[3];
    for (int k = 0; k < 3; k++)
        to_light[k] = (float)-picture->projection->forward[k];
    memset(seen, 0, count * sizeof *seen);
    for (size_t e = 0; e < entry_count; e++)
        draw_triangle(drawing, &entries[e], (uint32_t)e + 1, low, high, seen);
    struct surface surface = { .object = 0 };
    uint32_t known = 0;
    struct run run;
    run.count = 0;
    for (size_t i = 0; i < count; i++) {
        const struct seen here = seen[i];
        if (here.entry != known && here.entry > 0) {
            find_surface(drawing, &entries[here.entry - 1], &surface);
            known = here.entry;
        }
        if (here.entry > 0) /* else the texel is 0 already */
            find_position(&surface, &here, to_light, drawing->texels + 4 * (first + i), &run);
        if (run.count == RUN_SIZE)
            find_shares(&run);
        if (drawing->objects)
            drawing->objects[first + i] = here.entry > 0 ? surface.object : 0;
    }
    find_shares(&run);
}

static bool allocate(struct drawing *drawing)
{
    const struct render_light_picture *const picture = drawing->picture;
    drawing->band_count = ((size_t)picture->size_px + BAND_ROWS - 1) / BAND_ROWS;
    drawing->first_corner = calloc(picture->mesh_count + 1, sizeof *drawing->first_corner);
    drawing->first_triangle = calloc(picture->mesh_count + 1, sizeof *drawing->first_triangle);
    drawing->first_entry = calloc(drawing->band_count + 1, sizeof *drawing->first_entry);
    drawing->placed = calloc(drawing->band_count + 1, sizeof *drawing->placed);
    if (!drawing->first_corner || !drawing->first_triangle || !drawing->first_entry || !drawing->placed)
        return false;
    for (size_t m = 0; m < picture->mesh_count; m++) {
        const struct io_mesh *const mesh = picture->meshes[m].mesh;
        drawing->first_corner[m + 1] = drawing->first_corner[m] + mesh->vertex_count;
        drawing->first_triangle[m + 1] = drawing->first_triangle[m] + mesh->triangle_count;
    }
    drawing->corners = calloc(drawing->first_corner[picture->mesh_count] + 1, sizeof *drawing->corners);
    drawing->rows = calloc(drawing->first_triangle[picture->mesh_count] + 1, sizeof *drawing->rows);
    return drawing->corners && drawing->rows;
}

static int blocks_of(size_t count)
{
    return (int)((count + BLOCK_SIZE - 1) / BLOCK_SIZE);
}

bool render_light_picture_draw(const struct render_light_picture *picture, float *texels, float *objects,
                               dipole_status *status)
{
    struct drawing drawing = { .picture = picture };
    drawing.texels = texels;
    drawing.objects = objects;
    assert(picture->projection->is_orthographic && picture->size_px <= INT16_MAX);
    bool done = allocate(&drawing);
    for (drawing.mesh = 0; done && drawing.mesh < picture->mesh_count; drawing.mesh++) {
        const struct io_mesh *const mesh = picture->meshes[drawing.mesh].mesh;
        lut_parallel_for(blocks_of(mesh->vertex_count), picture->thread_count, place_corners, &drawing);
        lut_parallel_for(blocks_of(mesh->triangle_count), picture->thread_count, place_triangles, &drawing);
    }
    done = done && share_out(&drawing);
    if (done)
        lut_parallel_for((int)drawing.band_count, picture->thread_count, draw_band, &drawing);
    free(drawing.corners);
    free(drawing.rows);
    free(drawing.first_corner);
    free(drawing.first_triangle);
    free(drawing.first_entry);
    free(drawing.placed);
    free(drawing.entries);
    return done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                               "no memory to draw what a light sees in %d texels a side", picture->size_px);
}
