/* io/scatter.c: particles and fibres. */
#include "check.h"
#include "io/scatter.h"

#include <string.h>

/* Oracle: the moments of a ball of radius 1 filled evenly: mean 0, mean square of a coordinate 1/5. */
static void particles_fill_the_ball(void **state)
{
    (void)state;
    enum { COUNT = 100000 };
    struct io_mesh *mesh, *again;
    assert_true(io_mesh_create_particles(COUNT, 3, &mesh, NULL));
    assert_true(io_mesh_create_particles(COUNT, 3, &again, NULL));
    assert_memory_equal(mesh->positions, again->positions, 3 * COUNT * sizeof(float));
    for (size_t k = 0; k < 3; k++) {
        double mean = 0, square = 0;
        for (size_t i = 0; i < COUNT; i++) {
            const double x = (double)mesh->positions[3 * i + k];
            mean += x / COUNT;
            square += x * x / COUNT;
        }
        assert_true(fabs(mean) < 5 * sqrt(0.2 / COUNT)); /* five standard deviations */
        assert_close(square, 0.2, 0.02, "axis %zu: the same", k);
    }
    io_mesh_destroy(mesh);
    io_mesh_destroy(again);
}

/* Oracle: a closed surface wound outwards: facet normals add up to 0, the volume is that of tubes,
 * triangles and an edge count of 3/2 each; normals agree with facets. */
static void fibres_are_closed_tubes(void **state)
{
    (void)state;
    enum { COUNT = 20, SEGMENTS = 60 };
    struct io_mesh *mesh;
    assert_true(io_mesh_create_fibres(COUNT, SEGMENTS, 0.01, 5, &mesh, NULL));
    assert_int_equal(mesh->triangle_count, COUNT * (6 * SEGMENTS + 2));
    double volume = 0, sum[3] = { 0, 0, 0 };
    size_t agree_count = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        double p[3][3], n[3] = { 0, 0, 0 };
        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < 3; k++) {
                p[c][k] = (double)mesh->positions[3 * mesh->indices[3 * i + c] + k];
                n[k] += (double)mesh->normals[3 * mesh->indices[3 * i + c] + k];
            }
        }
        double facing = 0;
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            const double area =
                (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
            sum[k] += area;
            volume += p[0][k] * area / 6;
            facing += area * n[k];
        }
        agree_count += facing > 0;
    }
    for (int k = 0; k < 3; k++)
        assert_true(fabs(sum[k]) < 1e-6);
    assert_true(volume > 0);
    assert_true(agree_count + 2 * COUNT >= mesh->triangle_count); /* but for the caps */
    io_mesh_destroy(mesh);
    dipole_status status;
    assert_false(io_mesh_create_fibres(1000000, 4096, 0.01, 5, &mesh, &status));
    assert_null(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(particles_fill_the_ball),
        cmocka_unit_test(fibres_are_closed_tubes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
