#include "io/mesh_build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- vectors ------------------------------------------------------------------------------------- */

struct vector {
    double x, y, z;
};

static struct vector load(const float p[3])
{
    return (struct vector){ (double)p[0], (double)p[1], (double)p[2] };
}

static struct vector subtract(struct vector a, struct vector b)
{
    return (struct vector){ a.x - b.x, a.y - b.y, a.z - b.z };
}

static struct vector scale(struct vector a, double factor)
{
    return (struct vector){ a.x * factor, a.y * factor, a.z * factor };
}

static struct vector cross(struct vector a, struct vector b)
{
    return (struct vector){ a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x };
}

static double dot(struct vector a, struct vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static double length(struct vector a)
{
    return sqrt(dot(a, a));
}

struct triangle {
    struct vector corners[3];
    struct vector normal; /* unit, unless degenerate                                      */
    double area;
    bool is_degenerate; /* its height is within the rounding of its corners             */
};

static struct triangle triangle_at(const struct io_mesh_soup *soup, size_t index)
{
    struct triangle t;
    for (size_t k = 0; k < 3; k++)
        t.corners[k] = load(soup->vertices[soup->triangles[3 * index + k]].position);
    const struct vector a = subtract(t.corners[1], t.corners[0]), b = subtract(t.corners[2], t.corners[0]),
                        c = subtract(t.corners[2], t.corners[1]);
    const struct vector product = cross(a, b);
    const double longest = fmax(length(a), fmax(length(b), length(c)));
    t.area = length(product) / 2;
    t.is_degenerate = !(2 * t.area > 1e-9 * longest * longest);
    t.normal = t.is_degenerate ? (struct vector){ 0 } : scale(product, 0.5 / t.area);
    return t;
}

/* ---- equal vertices ------------------------------------------------------------------------------ */

/* Slots for a hash table of count entries, at most half full. */
static size_t slot_count(size_t count)
{
    size_t slots = 16;
    while (slots < 2 * count)
        slots *= 2;
    return slots;
}

static size_t mix(uint64_t hash)
{
    hash ^= hash >> 32;
    hash *= 0x9e3779b97f4a7c15u;
    return (size_t)(hash ^ (hash >> 29));
}

static size_t hash_of(const void *key, size_t key_bytes)
{
    uint64_t hash = 0;
    for (size_t i = 0; i < key_bytes; i += sizeof(uint32_t)) {
        uint32_t bits;
        memcpy(&bits, (const char *)key + i, sizeof bits);
        hash = (hash ^ bits) * 0x100000001b3u;
    }
    return mix(hash);
}

/* Give vertices whose first key_bytes are equal the same id, counted from 0 in the order of appearance. */
static bool weld(const struct io_mesh_soup *soup, size_t key_bytes, uint32_t *ids, size_t *id_count)
{
    const size_t slots = slot_count(soup->vertex_count);
    uint32_t *owner = malloc(slots * sizeof *owner); /* the vertex that took the slot first */
    if (!owner)
        return false;
    memset(owner, 0xff, slots * sizeof *owner);
    *id_count = 0;
    for (size_t i = 0; i < soup->vertex_count; i++) {
        const struct io_mesh_vertex *vertex = &soup->vertices[i];
        size_t slot = hash_of(vertex, key_bytes) & (slots - 1);
        while (owner[slot] != UINT32_MAX && memcmp(&soup->vertices[owner[slot]], vertex, key_bytes) != 0)
            slot = (slot + 1) & (slots - 1);
        const bool is_new = owner[slot] == UINT32_MAX;
        if (is_new)
            owner[slot] = (uint32_t)i;
        ids[i] = is_new ? (uint32_t)(*id_count)++ : ids[owner[slot]];
    }
    free(owner);
    return true;
}

/* ---- inside and outside -------------------------------------------------------------------------- */

struct edge {
    uint32_t low, high; /* its ends                                                  */
    int32_t balance;    /* times it is walked from low to high minus high to low     */
    bool is_used;
};

/*
 * Closed means that every edge is walked as often one way as the other: then, and only then, does the
 * surface bound a volume. Two triangles at each edge is the usual way to it, but not the only one.
 */
static bool find_closed(const struct io_mesh_soup *soup, const uint32_t *ids, bool *is_closed)
{
    const size_t slots = slot_count(3 * soup->triangle_count);
    struct edge *edges = calloc(slots, sizeof *edges);
    if (!edges)
        return false;
    for (size_t i = 0; i < 3 * soup->triangle_count; i++) {
        const uint32_t from = ids[soup->triangles[i]];
        const uint32_t to = ids[soup->triangles[i % 3 == 2 ? i - 2 : i + 1]];
        const uint32_t low = from < to ? from : to, high = from < to ? to : from;
        size_t slot = mix((uint64_t)low << 32 | high) & (slots - 1);
        while (edges[slot].is_used && (edges[slot].low != low || edges[slot].high != high))
            slot = (slot + 1) & (slots - 1);
        edges[slot].low = low;
        edges[slot].high = high;
        edges[slot].is_used = true;
        edges[slot].balance += (from < to) - (to < from);
    }
    *is_closed = true;
    for (size_t slot = 0; slot < slots && *is_closed; slot++)
        *is_closed = edges[slot].balance == 0;
    free(edges);
    return true;
}

static void swap_winding(struct io_mesh_soup *soup)
{
    for (size_t i = 0; i < soup->triangle_count; i++) {
        const uint32_t corner = soup->triangles[3 * i + 1];
        soup->triangles[3 * i + 1] = soup->triangles[3 * i + 2];
        soup->triangles[3 * i + 2] = corner;
    }
}

static void negate_normals(struct io_mesh_soup *soup)
{
    for (size_t i = 0; i < soup->vertex_count; i++)
        for (size_t k = 0; k < 3; k++)
            soup->vertices[i].normal[k] *= -1.0f;
}

static void turn_outwards(struct io_mesh_soup *soup, bool is_closed)
{
    const struct vector origin = load(soup->vertices[soup->triangles[0]].position);
    double volume = 0, agreement = 0; /* of winding with the file's normals */
    for (size_t i = 0; i < soup->triangle_count; i++) {
        const struct triangle t = triangle_at(soup, i);
        volume += t.area * dot(t.normal, subtract(t.corners[0], origin));
        for (size_t k = 0; k < 3; k++)
            agreement += t.area * dot(t.normal, load(soup->vertices[soup->triangles[3 * i + k]].normal));
    }
    const bool is_inward = is_closed ? volume < 0 : agreement < 0;
    if (is_inward)
        swap_winding(soup);
    if (is_inward ? agreement > 0 : agreement < 0)
        negate_normals(soup);
}

/* ---- normals ------------------------------------------------------------------------------------- */

static bool normalize(struct vector v, float out[3])
{
    const double size = length(v);
    if (!(size > 1e-6) || !isfinite(size)) /* sums of angles, or a file's unit vectors: less is nothing */
        return false;
    out[0] = (float)(v.x / size);
    out[1] = (float)(v.y / size);
    out[2] = (float)(v.z / size);
    return true;
}

/* Sum of the normals of the triangles around each position, each weighted by its angle there. */
static void sum_normals(const struct io_mesh_soup *soup, const uint32_t *ids, struct vector *sums)
{
    for (size_t i = 0; i < soup->triangle_count; i++) {
        const struct triangle t = triangle_at(soup, i);
        for (size_t k = 0; k < 3; k++) {
            const struct vector a = subtract(t.corners[(k + 1) % 3], t.corners[k]),
                                b = subtract(t.corners[(k + 2) % 3], t.corners[k]);
            const struct vector share = scale(t.normal, atan2(2 * t.area, dot(a, b)));
            struct vector *sum = &sums[ids[soup->triangles[3 * i + k]]];
            *sum = (struct vector){ sum->x + share.x, sum->y + share.y, sum->z + share.z };
        }
    }
}

/* Every vertex in use gets the file's normal; where there is none, a smooth one; where that cancels, as on
 * a sheet of two faces back to back, that of a triangle. */
static bool fill_normals(struct io_mesh_soup *soup, const uint32_t *ids, size_t id_count)
{
    struct vector *sums = calloc(id_count + 1, sizeof *sums); /* 0 would be no memory */
    if (!sums)
        return false;
    sum_normals(soup, ids, sums);
    for (size_t i = 0; i < 3 * soup->triangle_count; i++) {
        const uint32_t vertex = soup->triangles[i];
        float *normal = soup->vertices[vertex].normal;
        if (!normalize(load(normal), normal) && !normalize(sums[ids[vertex]], normal))
            normalize(triangle_at(soup, i / 3).normal, normal);
    }
    free(sums);
    return true;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

static bool is_finite(const struct io_mesh_soup *soup)
{
    for (size_t i = 0; i < 3 * soup->triangle_count; i++) {
        const float *p = soup->vertices[soup->triangles[i]].position;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]))
            return false;
    }
    return true;
}

/* -0 becomes 0, so that equal numbers have equal bits. */
static void clear_signs_of_zero(struct io_mesh_soup *soup)
{
    for (size_t i = 0; i < soup->vertex_count; i++)
        for (size_t k = 0; k < 3; k++) {
            soup->vertices[i].position[k] += 0.0f;
            soup->vertices[i].normal[k] += 0.0f;
        }
}

static void drop_degenerate(struct io_mesh_soup *soup)
{
    size_t kept = 0;
    for (size_t i = 0; i < soup->triangle_count; i++)
        if (!triangle_at(soup, i).is_degenerate)
            memmove(soup->triangles + 3 * kept++, soup->triangles + 3 * i, 3 * sizeof *soup->triangles);
    soup->triangle_count = kept;
}

/* Number vertices by their ids, in the order in which triangles first use them. */
static bool renumber(struct io_mesh_soup *soup, const uint32_t *ids, size_t id_count)
{
    uint32_t *numbers = malloc(id_count * sizeof *numbers);
    struct io_mesh_vertex *vertices = malloc(id_count * sizeof *vertices);
    if (!numbers || !vertices) {
        free(numbers);
        free(vertices);
        return false;
    }
    size_t count = 0;
    memset(numbers, 0xff, id_count * sizeof *numbers);
    for (size_t i = 0; i < 3 * soup->triangle_count; i++) {
        const uint32_t vertex = soup->triangles[i];
        uint32_t *number = &numbers[ids[vertex]];
        if (*number == UINT32_MAX) {
            vertices[count] = soup->vertices[vertex];
            *number = (uint32_t)count++;
        }
        soup->triangles[i] = *number;
    }
    free(numbers);
    free(soup->vertices);
    soup->vertices = vertices;
    soup->vertex_count = count;
    return true;
}

enum io_mesh_outcome io_mesh_build(struct io_mesh_soup *soup)
{
    if (soup->triangle_count == 0)
        return IO_MESH_NO_TRIANGLES;
    if (!is_finite(soup))
        return IO_MESH_NOT_FINITE;
    clear_signs_of_zero(soup);

    size_t id_count;
    bool is_closed;
    uint32_t *ids = malloc(soup->vertex_count * sizeof *ids);
    bool has_memory = ids && weld(soup, sizeof soup->vertices->position, ids, &id_count) &&
                      find_closed(soup, ids, &is_closed);
    if (has_memory) {
        turn_outwards(soup, is_closed); /* before dropping: without its slivers a surface may have gaps */
        drop_degenerate(soup);
        has_memory = fill_normals(soup, ids, id_count) &&
                     weld(soup, sizeof *soup->vertices, ids, &id_count) && renumber(soup, ids, id_count);
    }
    free(ids);
    if (!has_memory)
        return IO_MESH_NO_MEMORY;
    return soup->triangle_count > 0 ? IO_MESH_BUILT : IO_MESH_ALL_DEGENERATE;
}
