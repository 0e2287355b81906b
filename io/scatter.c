#include "io/scatter.h"

#include "io/mesh_internal.h"

#include <math.h>

#define PI 3.14159265358979323846

/* SplitMix64; 0 to 1. */
static double next_random(uint64_t *seed)
{
    uint64_t z = *seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static void random_direction(uint64_t *seed, double out[3])
{
    const double z = 2 * next_random(seed) - 1, angle = 2 * PI * next_random(seed), r = sqrt(1 - z * z);
    out[0] = r * cos(angle);
    out[1] = r * sin(angle);
    out[2] = z;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void normalize(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

static void put_vertex(struct io_mesh *mesh, size_t vertex, const double position[3],
                       const double normal[3])
{
    for (size_t k = 0; k < 3; k++) {
        mesh->positions[3 * vertex + k] = (float)position[k];
        mesh->normals[3 * vertex + k] = (float)normal[k];
    }
}

bool io_mesh_create_particles(int count, int seed, struct io_mesh **mesh_out, dipole_status *status)
{
    uint64_t random = (uint64_t)seed;
    struct io_mesh *const mesh = *mesh_out = io_mesh_create((size_t)count, 0);
    if (!mesh)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d particles", count);
    for (size_t i = 0; i < (size_t)count; i++) {
        double direction[3], position[3];
        random_direction(&random, direction);
        const double radius = cbrt(next_random(&random));
        for (int k = 0; k < 3; k++)
            position[k] = radius * direction[k];
        put_vertex(mesh, i, position, direction);
    }
    io_mesh_update_bounds(mesh);
    return true;
}

/* A line from the core outward, with a curl of two frequencies across it. */
struct curl {
    double along[3], side[2][3];
    double length, sway[2], turns[2], phase[2];
};

static struct curl random_curl(uint64_t *random)
{
    struct curl curl;
    random_direction(random, curl.along);
    const double across[3] = { fabs(curl.along[0]) < 0.7, fabs(curl.along[0]) >= 0.7, 0 };
    cross(curl.along, across, curl.side[0]);
    normalize(curl.side[0]);
    cross(curl.along, curl.side[0], curl.side[1]);
    curl.length = 0.45 + 0.25 * next_random(random);
    for (int i = 0; i < 2; i++) {
        curl.sway[i] = 0.1 * next_random(random);
        curl.turns[i] = 1 + 3 * next_random(random);
        curl.phase[i] = 2 * PI * next_random(random);
    }
    return curl;
}

static void point_of_curl(const struct curl *curl, double u, double out[3])
{
    const double outward = 0.25 + curl->length * u;
    for (int k = 0; k < 3; k++) {
        out[k] = outward * curl->along[k];
        for (int i = 0; i < 2; i++)
            out[k] +=
                curl->sway[i] * u * sin(2 * PI * curl->turns[i] * u + curl->phase[i]) * curl->side[i][k];
    }
}

enum { SIDES = 3 };

/* A tube's rings do not turn: they lie across the curl's direction. */
static void add_rings(struct io_mesh *mesh, size_t first_vertex, const struct curl *curl,
                      size_t segment_count, double radius)
{
    for (size_t s = 0; s <= segment_count; s++) {
        const double u = (double)s / (double)segment_count, thick = radius * (1 - 2 * u / 3);
        double middle[3];
        point_of_curl(curl, u, middle);
        for (size_t i = 0; i < SIDES; i++) {
            const double angle = 2 * PI * (double)i / SIDES;
            double normal[3], position[3];
            for (int k = 0; k < 3; k++) {
                normal[k] = cos(angle) * curl->side[0][k] + sin(angle) * curl->side[1][k];
                position[k] = middle[k] + thick * normal[k];
            }
            put_vertex(mesh, first_vertex + SIDES * s + i, position, normal);
        }
    }
}

static uint32_t *add_triangle(uint32_t *index, size_t a, size_t b, size_t c)
{
    index[0] = (uint32_t)a;
    index[1] = (uint32_t)b;
    index[2] = (uint32_t)c;
    return index + 3;
}

static uint32_t *add_tube(uint32_t *index, size_t first_vertex, size_t segment_count)
{
    for (size_t s = 0; s < segment_count; s++) {
        for (size_t i = 0; i < SIDES; i++) {
            const size_t a = first_vertex + SIDES * s + i, b = first_vertex + SIDES * s + (i + 1) % SIDES;
            index = add_triangle(index, a, b, b + SIDES);
            index = add_triangle(index, a, b + SIDES, a + SIDES);
        }
    }
    const size_t last = first_vertex + SIDES * segment_count;
    index = add_triangle(index, first_vertex, first_vertex + 2, first_vertex + 1);
    return add_triangle(index, last, last + 1, last + 2);
}

bool io_mesh_create_fibres(int count, int segment_count, double radius, int seed, struct io_mesh **mesh_out,
                           dipole_status *status)
{
    const size_t segments = (size_t)segment_count, fibres = (size_t)count;
    const size_t vertices_each = SIDES * (segments + 1), triangles_each = 2 * SIDES * segments + 2;
    *mesh_out = NULL;
    if (triangles_each * fibres > IO_MESH_TRIANGLE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "%zu triangles are more than the %u that a mesh may have",
                           triangles_each * fibres, IO_MESH_TRIANGLE_LIMIT);
    struct io_mesh *const mesh = *mesh_out =
        io_mesh_create(vertices_each * fibres, triangles_each * fibres);
    if (!mesh)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d fibres", count);
    uint64_t random = (uint64_t)seed;
    uint32_t *index = mesh->indices;
    for (size_t f = 0; f < fibres; f++) {
        const struct curl curl = random_curl(&random);
        add_rings(mesh, vertices_each * f, &curl, segments, radius);
        index = add_tube(index, vertices_each * f, segments);
    }
    io_mesh_update_bounds(mesh);
    return true;
}
