#include "check.h"

#include "io/mesh.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static struct io_mesh *create(enum io_primitive primitive, int detail)
{
    struct io_mesh *mesh;
    dipole_status status = { 0 };
    if (!io_mesh_create_primitive(primitive, detail, &mesh, &status))
        fail_msg("%s: %s", io_primitive_names[primitive], status.message);
    return mesh;
}

static void corners_of(const struct io_mesh *mesh, size_t triangle, double out[3][3])
{
    for (size_t k = 0; k < 3; k++)
        for (size_t axis = 0; axis < 3; axis++)
            out[k][axis] = (double)mesh->positions[3 * (size_t)mesh->indices[3 * triangle + k] + axis];
}

/* Normal of a triangle times twice its area. */
static void area_of(const struct io_mesh *mesh, size_t triangle, double out[3])
{
    double p[3][3];
    corners_of(mesh, triangle, p);
    for (size_t axis = 0; axis < 3; axis++) {
        const size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        out[axis] = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
    }
}

static double volume_of(const struct io_mesh *mesh)
{
    double volume = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        double p[3][3], area[3];
        corners_of(mesh, i, p);
        area_of(mesh, i, area);
        volume += (p[0][0] * area[0] + p[0][1] * area[1] + p[0][2] * area[2]) / 6;
    }
    return volume;
}

/* ---- topology ------------------------------------------------------------------------------------ */

static const float *sorted_positions;

static int compare_positions(const void *a, const void *b)
{
    const float *p = sorted_positions + 3 * *(const uint32_t *)a,
                *q = sorted_positions + 3 * *(const uint32_t *)b;
    for (int axis = 0; axis < 3; axis++)
        if (p[axis] != q[axis])
            return p[axis] < q[axis] ? -1 : 1;
    return 0;
}

/* Number positions, equal ones alike; returns how many there are. By sorting: nothing shared with the code
 * under test. */
static size_t number_positions(const struct io_mesh *mesh, uint32_t *numbers)
{
    uint32_t *order = malloc(mesh->vertex_count * sizeof *order);
    for (size_t i = 0; i < mesh->vertex_count; i++)
        order[i] = (uint32_t)i;
    sorted_positions = mesh->positions;
    qsort(order, mesh->vertex_count, sizeof *order, compare_positions);
    uint32_t count = 0;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        count += i > 0 && compare_positions(&order[i - 1], &order[i]) != 0;
        numbers[order[i]] = count;
    }
    free(order);
    return count + 1;
}

static int compare_edges(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Check that each edge joins exactly two triangles that walk it in opposite ways, and that V - E + F is as
 * expected. */
static void check_topology(const struct io_mesh *mesh, const char *name, long expected_characteristic)
{
    const size_t walk_count = 3 * mesh->triangle_count;
    uint32_t *numbers = malloc(mesh->vertex_count * sizeof *numbers);
    uint64_t *walks = malloc(walk_count * sizeof *walks), *returns = malloc(walk_count * sizeof *returns);
    const size_t position_count = number_positions(mesh, numbers);
    for (size_t i = 0; i < walk_count; i++) {
        const uint64_t from = numbers[mesh->indices[i]];
        const uint64_t to = numbers[mesh->indices[i % 3 == 2 ? i - 2 : i + 1]];
        walks[i] = from << 32 | to;
        returns[i] = to << 32 | from;
    }
    qsort(walks, walk_count, sizeof *walks, compare_edges);
    qsort(returns, walk_count, sizeof *returns, compare_edges);
    for (size_t i = 0; i < walk_count; i++) {
        if (i > 0 && walks[i] == walks[i - 1])
            fail_msg("%s: an edge is walked twice the same way", name);
        if (walks[i] != returns[i])
            fail_msg("%s: an edge has one triangle only", name);
    }
    const long characteristic = (long)position_count - (long)(walk_count / 2) + (long)mesh->triangle_count;
    if (characteristic != expected_characteristic)
        fail_msg("%s: V - E + F = %ld, expected %ld", name, characteristic, expected_characteristic);
    free(numbers);
    free(walks);
    free(returns);
}

static const long characteristics[IO_PRIMITIVE_COUNT] = {
    [IO_PRIMITIVE_SPHERE] = 2,  [IO_PRIMITIVE_CUBE] = 2,    [IO_PRIMITIVE_SLAB] = 2,
    [IO_PRIMITIVE_TORUS] = 0,   [IO_PRIMITIVE_KNOT] = 0,    [IO_PRIMITIVE_BOWL] = 2,
    [IO_PRIMITIVE_TERRAIN] = 2, [IO_PRIMITIVE_LANTERN] = 4, /* two surfaces */
};

/* Oracle: a closed orientable surface has two triangles at each edge, and V - E + F = 2 - 2 genus. */
static void every_primitive_is_closed(void **state)
{
    (void)state;
    static const int details[] = { 4, 5, 7, 16, 33, 100, 200 };
    for (int primitive = 0; primitive < IO_PRIMITIVE_COUNT; primitive++)
        for (size_t i = 0; i < sizeof details / sizeof details[0]; i++) {
            char name[64];
            snprintf(name, sizeof name, "%s, detail %d", io_primitive_names[primitive], details[i]);
            struct io_mesh *mesh = create((enum io_primitive)primitive, details[i]);
            check_topology(mesh, name, characteristics[primitive]);
            io_mesh_destroy(mesh);
        }
}

/* ---- volume -------------------------------------------------------------------------------------- */

/* Length of the trefoil on the torus of radii 0.6 and 0.26, by the trapezium rule, which for a periodic
 * function converges faster than any power. */
static double trefoil_length(void)
{
    const int steps = 1000;
    double length = 0;
    for (int i = 0; i < steps; i++) {
        const double r = 0.6 + 0.26 * cos(3 * 2 * PI * i / steps);
        length += sqrt(4 * r * r + 9 * 0.26 * 0.26) * 2 * PI / steps;
    }
    return length;
}

static double exact_volume(enum io_primitive primitive)
{
    switch (primitive) {
    case IO_PRIMITIVE_SPHERE:
        return 4 * PI / 3;
    case IO_PRIMITIVE_CUBE:
        return 8;
    case IO_PRIMITIVE_SLAB:
        return 4;
    case IO_PRIMITIVE_TORUS: /* Pappus */
        return 2 * PI * PI * 0.35 * 0.35;
    case IO_PRIMITIVE_KNOT: /* a tube has its section's area times its curve's length */
        return PI * 0.14 * 0.14 * trefoil_length();
    case IO_PRIMITIVE_BOWL: /* half a hollow ball, and half a ring of radius 0.95 for the lip */
        return 2 * PI / 3 * (1 - 0.9 * 0.9 * 0.9) + PI * PI * 0.95 * 0.05 * 0.05;
    case IO_PRIMITIVE_TERRAIN: /* base, hills, fins: int exp(-s^4) ds = 2 Gamma(5/4), int (1-z^2)^2 dz =
                                  16/15 */
        return 4 * 0.3 + 4 * 0.05 + 0.65 * (0.12 + 0.06 + 0.03 + 0.015) * 2 * tgamma(1.25) * 16 / 15;
    case IO_PRIMITIVE_LANTERN: /* int r^3/3 over directions: means of (1 - cos)/2 to the powers 1, 2, 3 are
                                  1/2, 3/8, 5/16, integrals of sin^3, sin^5, sin^7 are 4/3, 16/15, 32/35 */
        return 2 * PI / 3 *
               (2 - 2 * 0.12 + 1.2 * 0.12 * 0.12 - 2.0 / 7 * 0.12 * 0.12 * 0.12 - 2 * 0.8 * 0.8 * 0.8);
    case IO_PRIMITIVE_COUNT:
        break;
    }
    return NAN;
}

/* Oracle: closed forms of the volumes. Flat faces are exact but for the rounding of coordinates to float
 * (relative 6e-8); round ones err by a second-order term, which falls fourfold when the detail doubles
 * (within 10 %: the next order; 320 makes all subdivisions double). The points of the terrain move with the
 * detail, so its error, 1e-5 already, falls less evenly: at least threefold. */
static void volumes_converge_to_closed_forms(void **state)
{
    (void)state;
    for (int i = 0; i < IO_PRIMITIVE_COUNT; i++) {
        const enum io_primitive primitive = (enum io_primitive)i;
        const char *name = io_primitive_names[i];
        const double exact = exact_volume(primitive);
        struct io_mesh *coarse = create(primitive, 320), *fine = create(primitive, 640);
        const double coarse_error = fabs(volume_of(coarse) / exact - 1);
        const double fine_error = fabs(volume_of(fine) / exact - 1);
        if (primitive == IO_PRIMITIVE_CUBE || primitive == IO_PRIMITIVE_SLAB) {
            assert_close(volume_of(coarse), exact, 1e-6, "%s", name);
        } else {
            if (primitive == IO_PRIMITIVE_TERRAIN)
                assert_true(coarse_error < 1e-4 && fine_error < coarse_error / 3);
            else
                assert_close(coarse_error / fine_error, 4.0, 0.1, "%s: errors %g and %g", name,
                             coarse_error, fine_error);
            assert_close(volume_of(fine), exact, 3e-3, "%s", name);
        }
        io_mesh_destroy(coarse);
        io_mesh_destroy(fine);
    }
}

/* ---- triangles and normals ----------------------------------------------------------------------- */

/* Oracle: the definition. A triangle has an area; a normal has length 1 (rounded to float) and lies on the
 * outer side of the triangles around it; the box given is that of the vertices. */
static void triangles_and_normals_agree(void **state)
{
    (void)state;
    static const int details[] = { 4, 80, 200 };
    for (int primitive = 0; primitive < IO_PRIMITIVE_COUNT; primitive++)
        for (size_t d = 0; d < sizeof details / sizeof details[0]; d++) {
            struct io_mesh *mesh = create((enum io_primitive)primitive, details[d]);
            const char *name = io_primitive_names[primitive];
            for (size_t i = 0; i < mesh->triangle_count; i++) {
                double area[3];
                area_of(mesh, i, area);
                const double size = sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
                if (!(size > 1e-9))
                    fail_msg("%s, detail %d: triangle %zu has no area", name, details[d], i);
                for (size_t k = 0; k < 3; k++) {
                    const float *n = mesh->normals + 3 * (size_t)mesh->indices[3 * i + k];
                    const double x = (double)n[0], y = (double)n[1], z = (double)n[2];
                    assert_close(x * x + y * y + z * z, 1.0, 4e-7, "%s: normal", name);
                    /* coarse tubes and the foot of a fin may turn further */
                    if (details[d] >= 80 && primitive != IO_PRIMITIVE_TERRAIN &&
                        !(x * area[0] + y * area[1] + z * area[2] > 0.3 * size))
                        fail_msg("%s, detail %d: triangle %zu turns from its normal", name, details[d], i);
                }
            }
            for (size_t i = 0; i < 3 * mesh->vertex_count; i++) {
                assert_true(mesh->positions[i] >= mesh->min[i % 3]);
                assert_true(mesh->positions[i] <= mesh->max[i % 3]);
            }
            io_mesh_destroy(mesh);
        }
}

/* Mean of 1 - cosine between a triangle's normal and those of its corners, weighted by area. */
static double mean_turn(const struct io_mesh *mesh)
{
    double turn = 0, total = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        double area[3];
        area_of(mesh, i, area);
        const double size = sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
        total += 3 * size;
        for (size_t k = 0; k < 3; k++) {
            const float *n = mesh->normals + 3 * (size_t)mesh->indices[3 * i + k];
            turn += size - ((double)n[0] * area[0] + (double)n[1] * area[1] + (double)n[2] * area[2]);
        }
    }
    return turn / total;
}

/* Oracle: where normals are those of the smooth surface, the angle to the faces shrinks like the faces, so
 * 1 - cosine falls fourfold (within 10 %) when the detail doubles; near threefold where the finest edge of
 * a fin is just resolved. A wrong slope would stay. */
static void normals_are_those_of_the_smooth_surface(void **state)
{
    (void)state;
    for (int i = 0; i < IO_PRIMITIVE_COUNT; i++) {
        const enum io_primitive primitive = (enum io_primitive)i;
        struct io_mesh *coarse = create(primitive, 480), *fine = create(primitive, 960);
        const double coarse_turn = mean_turn(coarse), fine_turn = mean_turn(fine);
        if (primitive == IO_PRIMITIVE_CUBE || primitive == IO_PRIMITIVE_SLAB)
            assert_true(fabs(coarse_turn) < 1e-7);
        else if (primitive == IO_PRIMITIVE_TERRAIN)
            assert_true(coarse_turn < 0.003 && fine_turn < coarse_turn / 2.8);
        else
            assert_close(coarse_turn / fine_turn, 4.0, 0.1, "%s: %g and %g", io_primitive_names[i],
                         coarse_turn, fine_turn);
        io_mesh_destroy(coarse);
        io_mesh_destroy(fine);
    }
}

/* Oracle: the surfaces' equations. A point of the unit sphere is its own normal; one of the torus is its
 * ring's point plus 0.35 normals. Rounding to float leaves 1e-7. */
static void sphere_and_torus_obey_their_equations(void **state)
{
    (void)state;
    struct io_mesh *sphere = create(IO_PRIMITIVE_SPHERE, 64), *torus = create(IO_PRIMITIVE_TORUS, 64);
    for (size_t i = 0; i < 3 * sphere->vertex_count; i++)
        assert_true(fabsf(sphere->positions[i] - sphere->normals[i]) < 2e-7f);
    for (size_t i = 0; i < torus->vertex_count; i++) {
        const float *p = torus->positions + 3 * i, *n = torus->normals + 3 * i;
        const double x = (double)p[0] - 0.35 * (double)n[0], y = (double)p[1] - 0.35 * (double)n[1],
                     z = (double)p[2] - 0.35 * (double)n[2];
        assert_true(fabs(x * x + z * z - 1) < 1e-6);
        assert_true(fabs(y) < 1e-6);
    }
    io_mesh_destroy(sphere);
    io_mesh_destroy(torus);
}

/* Oracle: the sizes that mesh.h states. */
static void boxes_are_as_stated(void **state)
{
    (void)state;
    static const struct {
        enum io_primitive primitive;
        double min[3], max[3], tolerance;
    } cases[] = {
        { IO_PRIMITIVE_SPHERE, { -1, -1, -1 }, { 1, 1, 1 }, 1e-7 },
        { IO_PRIMITIVE_CUBE, { -1, -1, -1 }, { 1, 1, 1 }, 0 },
        { IO_PRIMITIVE_SLAB, { -1, -1, -1 }, { 1, 0, 1 }, 0 },
        { IO_PRIMITIVE_TORUS, { -1.35, -0.35, -1.35 }, { 1.35, 0.35, 1.35 }, 1e-6 },
        { IO_PRIMITIVE_KNOT, { -0.83, -0.97, -0.4 }, { 1, 0.97, 0.4 }, 0.02 },
        { IO_PRIMITIVE_BOWL, { -1, -1, -1 }, { 1, 0.05, 1 }, 1e-6 },
        { IO_PRIMITIVE_TERRAIN, { -1, -0.3, -1 }, { 1, 0.75, 1 }, 0.1 },
        { IO_PRIMITIVE_LANTERN, { -1, -1, -1 }, { 1, 1, 1 }, 1e-7 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct io_mesh *mesh = create(cases[i].primitive, 256);
        for (int axis = 0; axis < 3; axis++) {
            if (fabs((double)mesh->min[axis] - cases[i].min[axis]) > cases[i].tolerance ||
                fabs((double)mesh->max[axis] - cases[i].max[axis]) > cases[i].tolerance)
                fail_msg("%s: axis %d from %g to %g", io_primitive_names[cases[i].primitive], axis,
                         (double)mesh->min[axis], (double)mesh->max[axis]);
        }
        io_mesh_destroy(mesh);
    }
}

/* Oracle: the bytes of the first run. */
static void equal_calls_give_equal_bytes(void **state)
{
    (void)state;
    for (int i = 0; i < IO_PRIMITIVE_COUNT; i++) {
        struct io_mesh *a = create((enum io_primitive)i, 50), *b = create((enum io_primitive)i, 50);
        assert_int_equal(a->vertex_count, b->vertex_count);
        assert_memory_equal(a->positions, b->positions, a->vertex_count * 3 * sizeof(float));
        assert_memory_equal(a->normals, b->normals, a->vertex_count * 3 * sizeof(float));
        assert_memory_equal(a->indices, b->indices, a->triangle_count * 3 * sizeof(uint32_t));
        io_mesh_destroy(a);
        io_mesh_destroy(b);
    }
}

/* Oracle: the stated range, and the stated limit on triangles. */
static void detail_outside_its_range_is_refused(void **state)
{
    (void)state;
    struct io_mesh *mesh;
    dipole_status status;
    assert_false(io_mesh_create_primitive(IO_PRIMITIVE_SPHERE, 3, &mesh, &status));
    assert_string_equal(status.message, "detail is 3, expected 4 to 4096");
    assert_null(mesh);
    assert_false(io_mesh_create_primitive(IO_PRIMITIVE_SPHERE, 4097, &mesh, &status));
    assert_string_equal(status.message, "detail is 4097, expected 4 to 4096");
    assert_false(io_mesh_create_primitive(IO_PRIMITIVE_CUBE, 4096, &mesh, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message,
                        "201326592 triangles are more than the 20000000 that a mesh may have");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_primitive_is_closed),
        cmocka_unit_test(volumes_converge_to_closed_forms),
        cmocka_unit_test(triangles_and_normals_agree),
        cmocka_unit_test(normals_are_those_of_the_smooth_surface),
        cmocka_unit_test(sphere_and_torus_obey_their_equations),
        cmocka_unit_test(boxes_are_as_stated),
        cmocka_unit_test(equal_calls_give_equal_bytes),
        cmocka_unit_test(detail_outside_its_range_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
