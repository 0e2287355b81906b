#include "renderer/reference_surface.h"

#include "renderer/projection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Levels of halving by area; deeper, where areas differ wildly, by number, so that recursion stays shallow.
 */
enum { AREA_DEPTH = 64 };

/* A triangle is halved so often to place a point in it: to 2^-20 of its sides. */
enum { HALVINGS = 40 };

/* A triangle on its way to its place. */
struct piece {
    float spot[6]; /* middle in mm, then the unit normal */
    uint32_t object, triangle;
    double area_mm2, key;
};

struct place {
    uint32_t object, triangle;
};

struct render_surface {
    const struct io_scene *scene;
    struct place *places;
    double *ends_mm2; /* area up to the end of each place */
    size_t count;
};

/* ---- triangles ---------------------------------------------------------------------------------- */

void render_triangle_corners(const struct io_mesh *mesh, size_t triangle, double corners_mm[3][3])
{
    for (int i = 0; i < 3; i++) {
        const float *const p = mesh->positions + 3 * (size_t)mesh->indices[3 * triangle + (size_t)i];
        for (int k = 0; k < 3; k++)
            corners_mm[i][k] = (double)p[k];
    }
}

void render_triangle_normal(const double corners_mm[3][3], double normal[3])
{
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = corners_mm[1][k] - corners_mm[0][k];
        b[k] = corners_mm[2][k] - corners_mm[0][k];
    }
    normal[0] = a[1] * b[2] - a[2] * b[1];
    normal[1] = a[2] * b[0] - a[0] * b[2];
    normal[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalise(double v[3])
{
    const double length = sqrt(render_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] = length > 0 ? v[k] / length : 0;
}

void render_triangle_point(const struct io_mesh *mesh, size_t triangle, const double weights[3],
                           struct render_surface_point *point)
{
    double corners_mm[3][3];
    render_triangle_corners(mesh, triangle, corners_mm);
    *point = (struct render_surface_point){ .object = 0 };
    render_triangle_normal(corners_mm, point->facet_normal);
    normalise(point->facet_normal);
    for (int i = 0; i < 3; i++) {
        const float *const n = mesh->normals + 3 * (size_t)mesh->indices[3 * triangle + (size_t)i];
        for (int k = 0; k < 3; k++) {
            point->position_mm[k] += weights[i] * corners_mm[i][k];
            point->normal[k] += weights[i] * (double)n[k];
        }
    }
    normalise(point->normal);
}

/* ---- order -------------------------------------------------------------------------------------- */

/* By key, then as in the scene: the same order everywhere. */
static int compare_pieces(const void *a, const void *b)
{
    const struct piece *const x = a, *const y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    if (x->object != y->object)
        return x->object < y->object ? -1 : 1;
    return x->triangle < y->triangle ? -1 : x->triangle > y->triangle;
}

/*
 * Sort across the direction in which the pieces differ most. Normals count beside positions, as lengths of
 * half the extent, so that the two sides of a thin sheet, one lit and one dark, are parted early.
 */
static void sort_widest(struct piece *pieces, size_t count)
{
    float min[6], max[6];
    for (int k = 0; k < 6; k++) {
        min[k] = INFINITY;
        max[k] = -INFINITY;
    }
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 6; k++) {
            const float value = pieces[i].spot[k];
            min[k] = fminf(min[k], value);
            max[k] = fmaxf(max[k], value);
        }
    }
    const float extent_mm = fmaxf(fmaxf(max[0] - min[0], max[1] - min[1]), max[2] - min[2]);
    int widest = 0;
    float width_mm = -1;
    for (int k = 0; k < 6; k++) {
        const float width_here_mm = (max[k] - min[k]) * (k < 3 ? 1 : 0.5F * extent_mm);
        if (width_here_mm > width_mm) {
            width_mm = width_here_mm;
            widest = k;
        }
    }
    for (size_t i = 0; i < count; i++)
        pieces[i].key = (double)pieces[i].spot[widest];
    qsort(pieces, count, sizeof *pieces, compare_pieces);
}

/* Halve by area again and again: parts of 2^-k of the line are compact pieces of surface. */
static void order_pieces(struct piece *pieces, size_t count, int depth)
{
    if (count < 3)
        return;
    sort_widest(pieces, count);
    size_t half = count / 2;
    if (depth < AREA_DEPTH) {
        double total_mm2 = 0, area_mm2 = pieces[0].area_mm2;
        for (size_t i = 0; i < count; i++)
            total_mm2 += pieces[i].area_mm2;
        half = 1;
        while (half + 1 < count && area_mm2 + 0.5 * pieces[half].area_mm2 < 0.5 * total_mm2)
            area_mm2 += pieces[half++].area_mm2;
    }
    order_pieces(pieces, half, depth + 1);
    order_pieces(pieces + half, count - half, depth + 1);
}

/* One object after the other, as they are listed. */
static void order_objects(struct piece *pieces, size_t count)
{
    for (size_t begin = 0, end = 0; begin < count; begin = end) {
        while (end < count && pieces[end].object == pieces[begin].object)
            end++;
        order_pieces(pieces + begin, end - begin, 0);
    }
}

static size_t list_pieces(const struct io_scene *scene, struct piece *pieces)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_mesh *const mesh = scene->objects[i].mesh;
        for (size_t t = 0; t < mesh->triangle_count; t++) {
            double corners_mm[3][3], normal[3];
            render_triangle_corners(mesh, t, corners_mm);
            render_triangle_normal(corners_mm, normal);
            const double area_mm2 = 0.5 * sqrt(render_dot(normal, normal));
            if (!(area_mm2 > 0))
                continue;
            struct piece *const piece = &pieces[count++];
            *piece = (struct piece){ .object = (uint32_t)i, .triangle = (uint32_t)t, .area_mm2 = area_mm2 };
            for (int k = 0; k < 3; k++) {
                const double sum_mm = corners_mm[0][k] + corners_mm[1][k] + corners_mm[2][k];
                piece->spot[k] = (float)(sum_mm / 3);
                piece->spot[3 + k] = (float)(0.5 * normal[k] / area_mm2);
            }
        }
    }
    return count;
}

bool render_surface_create(const struct io_scene *scene, struct render_surface **surface_out,
                           dipole_status *status)
{
    *surface_out = NULL;
    size_t count = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        count += scene->objects[i].mesh->triangle_count;
    if (count > UINT32_MAX)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%zu triangles, expected at most %u", count,
                           UINT32_MAX);
    struct render_surface *const surface = calloc(1, sizeof *surface);
    struct piece *const pieces = malloc((count + 1) * sizeof *pieces);
    if (surface) {
        surface->scene = scene;
        surface->places = malloc((count + 1) * sizeof *surface->places);
        surface->ends_mm2 = malloc((count + 1) * sizeof *surface->ends_mm2);
    }
    const bool done = surface && pieces && surface->places && surface->ends_mm2;
    if (done) {
        surface->count = list_pieces(scene, pieces);
        order_objects(pieces, surface->count);
        double end_mm2 = 0;
        for (size_t i = 0; i < surface->count; i++) {
            end_mm2 += pieces[i].area_mm2;
            surface->ends_mm2[i] = end_mm2;
            surface->places[i] = (struct place){ pieces[i].object, pieces[i].triangle };
        }
        *surface_out = surface;
    } else {
        render_surface_destroy(surface);
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to order %zu triangles", count);
    }
    free(pieces);
    return done;
}

void render_surface_destroy(struct render_surface *surface)
{
    if (!surface)
        return;
    free(surface->places);
    free(surface->ends_mm2);
    free(surface);
}

double render_surface_area_mm2(const struct render_surface *surface)
{
    return surface->count > 0 ? surface->ends_mm2[surface->count - 1] : 0;
}

/* ---- points ------------------------------------------------------------------------------------- */

/* The corner that lies across from the longest side. */
static int tip(const struct io_mesh *mesh, size_t triangle)
{
    double corners_mm[3][3], longest2 = -1;
    int found = 0;
    render_triangle_corners(mesh, triangle, corners_mm);
    for (int i = 0; i < 3; i++) {
        double length2 = 0;
        for (int k = 0; k < 3; k++) {
            const double d = corners_mm[(i + 1) % 3][k] - corners_mm[(i + 2) % 3][k];
            length2 += d * d;
        }
        if (length2 > longest2) {
            longest2 = length2;
            found = i;
        }
    }
    return found;
}

/*
 * Weights of the corners at a place 0..1 along a curve through the triangle (Sierpinski's): the triangle
 * (a, b, c) is halved from the tip c to the middle of ab; the curve runs from a through the first half to
 * c, and from there through the second to b.
 */
static void weights_at(double place, int tip_corner, double weights[3])
{
    double a[3] = { 0 }, b[3] = { 0 }, c[3] = { 0 }, middle[3];
    a[(tip_corner + 1) % 3] = b[(tip_corner + 2) % 3] = c[tip_corner] = 1;
    for (int level = 0; level < HALVINGS; level++) {
        for (int k = 0; k < 3; k++)
            middle[k] = 0.5 * (a[k] + b[k]);
        place *= 2;
        if (place < 1) {
            memcpy(b, c, sizeof b);
        } else {
            memcpy(a, c, sizeof a);
            place -= 1;
        }
        memcpy(c, middle, sizeof c);
    }
    for (int k = 0; k < 3; k++)
        weights[k] = (a[k] + b[k] + c[k]) / 3;
}

void render_surface_at(const struct render_surface *surface, double place,
                       struct render_surface_point *point)
{
    const double area_mm2 = place * render_surface_area_mm2(surface);
    size_t low = 0, high = surface->count - 1; /* the first place that ends beyond */
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (surface->ends_mm2[middle] > area_mm2)
            high = middle;
        else
            low = middle + 1;
    }
    const double begin_mm2 = low > 0 ? surface->ends_mm2[low - 1] : 0;
    const double part = (area_mm2 - begin_mm2) / (surface->ends_mm2[low] - begin_mm2);
    const struct place *const found = &surface->places[low];
    const struct io_mesh *const mesh = surface->scene->objects[found->object].mesh;
    double weights[3];
    weights_at(fmin(fmax(part, 0), 1), tip(mesh, found->triangle), weights);
    render_triangle_point(mesh, found->triangle, weights, point);
    point->object = found->object;
}
