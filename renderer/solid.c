#include "renderer/solid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A connected part: the number that its edges add up to, and six times its volume. */
struct part {
    uint64_t balance;
    double volume;
    bool is_used;
};

/* splitmix64, Steele et al. 2014. */
static uint64_t mix(uint64_t x)
{
    x += 0x9e3779b97f4a7c15;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
}

static uint64_t place_hash(const float position[3])
{
    uint64_t hash = 0;
    for (int k = 0; k < 3; k++) {
        const float coordinate = position[k] + 0.0f; /* -0 is 0 */
        uint32_t bits;
        memcpy(&bits, &coordinate, sizeof bits);
        hash = mix(hash ^ bits);
    }
    return hash;
}

static bool is_same_place(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* owners[v]: the first vertex at the place of v. */
static bool weld(const struct io_mesh *mesh, uint32_t *owners)
{
    size_t slots = 1;
    while (slots < 2 * mesh->vertex_count)
        slots *= 2;
    uint32_t *const table = malloc(slots * sizeof *table);
    if (!table)
        return false;
    memset(table, 0xff, slots * sizeof *table);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        const float *const place = &mesh->positions[3 * v];
        size_t slot = place_hash(place) & (slots - 1);
        while (table[slot] != UINT32_MAX &&
               !is_same_place(&mesh->positions[3 * (size_t)table[slot]], place))
            slot = (slot + 1) & (slots - 1);
        if (table[slot] == UINT32_MAX)
            table[slot] = (uint32_t)v;
        owners[v] = table[slot];
    }
    free(table);
    return true;
}

/* The vertex that stands for all that are connected with v; the way there is halved as it is walked. */
static uint32_t find_root(uint32_t *parents, uint32_t v)
{
    while (parents[v] != v)
        v = parents[v] = parents[parents[v]];
    return v;
}

static void connect(uint32_t *parents, uint32_t a, uint32_t b)
{
    const uint32_t x = find_root(parents, a), y = find_root(parents, b);
    parents[x > y ? x : y] = x > y ? y : x;
}

/* A random number of the edge; its negative for the same edge walked the other way. */
static uint64_t edge_number(uint32_t from, uint32_t to)
{
    const uint32_t low = from < to ? from : to, high = from < to ? to : from;
    const uint64_t number = from == to ? 0 : mix((uint64_t)low << 32 | high);
    return from < to ? number : 0 - number;
}

static double volume_of(const struct io_mesh *mesh, const uint32_t corners[3])
{
    double sides[3][3];
    for (int i = 0; i < 3; i++) {
        for (size_t k = 0; k < 3; k++)
            sides[i][k] = (double)mesh->positions[3 * (size_t)corners[i] + k] - (double)mesh->min[k];
    }
    double volume = 0;
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        volume += sides[0][k] * (sides[1][l] * sides[2][m] - sides[1][m] * sides[2][l]);
    }
    return volume;
}

static bool are_parts_solid(const struct io_mesh *mesh, const uint32_t *owners, uint32_t *parents,
                            struct part *parts)
{
    for (size_t v = 0; v < mesh->vertex_count; v++)
        parents[v] = owners[v];
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        connect(parents, owners[mesh->indices[i]], owners[mesh->indices[i - i % 3]]);
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *const corners = &mesh->indices[3 * t];
        struct part *const part = &parts[find_root(parents, owners[corners[0]])];
        part->is_used = true;
        part->volume += volume_of(mesh, corners);
        for (int k = 0; k < 3; k++)
            part->balance += edge_number(owners[corners[k]], owners[corners[(k + 1) % 3]]);
    }
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        if (parts[v].is_used && (parts[v].balance != 0 || !(parts[v].volume > 0)))
            return false;
    }
    return true;
}

bool render_mesh_is_solid(const struct io_mesh *mesh, bool *is_solid_out, dipole_status *status)
{
    uint32_t *const owners = calloc(mesh->vertex_count + 1, sizeof *owners);
    uint32_t *const parents = calloc(mesh->vertex_count + 1, sizeof *parents);
    struct part *const parts = calloc(mesh->vertex_count + 1, sizeof *parts);
    const bool done = owners && parents && parts && weld(mesh, owners);
    if (done)
        *is_solid_out = are_parts_solid(mesh, owners, parents, parts);
    free(owners);
    free(parents);
    free(parts);
    return done ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                       "no memory to tell whether %zu triangles bound a solid", mesh->triangle_count);
}

/* ---- convex -------------------------------------------------------------------------------------- */

#define BULGE_SHARE 1e-4

/* The triangles at each place: of vertex v those from ends[v - 1] to ends[v], of the first at a place. */
struct neighbours {
    const struct io_mesh *mesh;
    const uint32_t *owners;
    uint32_t *ends, *triangles;
};

static void list_neighbours(struct neighbours *neighbours)
{
    const struct io_mesh *const mesh = neighbours->mesh;
    uint32_t *const ends = neighbours->ends;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        ends[neighbours->owners[mesh->indices[i]]]++;
    for (size_t v = 1; v < mesh->vertex_count; v++)
        ends[v] += ends[v - 1];
    for (size_t i = 3 * mesh->triangle_count; i-- > 0;)
        neighbours->triangles[--ends[neighbours->owners[mesh->indices[i]]]] = (uint32_t)(i / 3);
    /* each end has become a beginning */
    memmove(ends, ends + 1, (mesh->vertex_count - 1) * sizeof *ends);
    ends[mesh->vertex_count - 1] = (uint32_t)(3 * mesh->triangle_count);
}

/* Unit normal, times how far above its plane nothing may be; false where the triangle has no area. */
static bool plane_of(const struct io_mesh *mesh, size_t triangle, double normal[3], double *limit)
{
    const uint32_t *const corners = &mesh->indices[3 * triangle];
    double sides[2][3], square = 0, longest = 0;
    for (int i = 0; i < 2; i++) {
        double length2 = 0;
        for (size_t k = 0; k < 3; k++) {
            sides[i][k] = (double)mesh->positions[3 * (size_t)corners[i + 1] + k] -
                          (double)mesh->positions[3 * (size_t)corners[0] + k];
            length2 += sides[i][k] * sides[i][k];
        }
        longest = fmax(longest, sqrt(length2));
    }
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        normal[k] = sides[0][l] * sides[1][m] - sides[0][m] * sides[1][l];
        square += normal[k] * normal[k];
    }
    *limit = BULGE_SHARE * longest * sqrt(square);
    return square > 0;
}

static bool bulges(const struct neighbours *neighbours, size_t triangle)
{
    const struct io_mesh *const mesh = neighbours->mesh;
    const uint32_t *const corners = &mesh->indices[3 * triangle];
    double normal[3], limit;
    if (!plane_of(mesh, triangle, normal, &limit))
        return false;
    for (int i = 0; i < 3; i++) {
        const uint32_t v = neighbours->owners[corners[i]];
        for (uint32_t n = v > 0 ? neighbours->ends[v - 1] : 0; n < neighbours->ends[v]; n++) {
            const uint32_t *const others = &mesh->indices[3 * (size_t)neighbours->triangles[n]];
            for (int j = 0; j < 3; j++) {
                double height = 0;
                for (size_t k = 0; k < 3; k++)
                    height += normal[k] * ((double)mesh->positions[3 * (size_t)others[j] + k] -
                                           (double)mesh->positions[3 * (size_t)corners[0] + k]);
                if (height > limit)
                    return true;
            }
        }
    }
    return false;
}

static bool is_one_part(const struct io_mesh *mesh, const uint32_t *owners, uint32_t *parents)
{
    for (size_t v = 0; v < mesh->vertex_count; v++)
        parents[v] = owners[v];
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        connect(parents, owners[mesh->indices[i]], owners[mesh->indices[i - i % 3]]);
    for (size_t i = 1; i < 3 * mesh->triangle_count; i++) {
        if (find_root(parents, owners[mesh->indices[i]]) != find_root(parents, owners[mesh->indices[0]]))
            return false;
    }
    return true;
}

bool render_mesh_is_convex(const struct io_mesh *mesh, bool *is_convex_out, dipole_status *status)
{
    uint32_t *const owners = calloc(mesh->vertex_count + 1, sizeof *owners);
    uint32_t *const parents = calloc(mesh->vertex_count + 1, sizeof *parents);
    struct neighbours neighbours = { .mesh = mesh, .owners = owners };
    neighbours.ends = calloc(mesh->vertex_count + 1, sizeof *neighbours.ends);
    neighbours.triangles = calloc(3 * mesh->triangle_count + 1, sizeof *neighbours.triangles);
    const bool done = owners && parents && neighbours.ends && neighbours.triangles && weld(mesh, owners);
    if (done) {
        bool is_convex = is_one_part(mesh, owners, parents);
        if (is_convex)
            list_neighbours(&neighbours);
        for (size_t t = 0; is_convex && t < mesh->triangle_count; t++)
            is_convex = !bulges(&neighbours, t);
        *is_convex_out = is_convex;
    }
    free(owners);
    free(parents);
    free(neighbours.ends);
    free(neighbours.triangles);
    return done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                               "no memory to tell whether %zu triangles are convex", mesh->triangle_count);
}
