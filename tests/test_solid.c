/* renderer/solid.c: meshes made by hand, and primitives. */
#include "check.h"

#include "renderer/solid.h"

#include <string.h>

static bool is_solid(const struct io_mesh *mesh)
{
    bool found = false;
    assert_true(render_mesh_is_solid(mesh, &found, NULL));
    return found;
}

/* Oracle: docs/formats.md: all primitives are closed, and turned outwards; the lantern alone has a cavity.
 */
static void primitives_are_solid(void **state)
{
    (void)state;
    for (int i = 0; i < IO_PRIMITIVE_COUNT; i++) {
        struct io_mesh *mesh;
        assert_true(io_mesh_create_primitive((enum io_primitive)i, 24, &mesh, NULL));
        if (is_solid(mesh) != (i != IO_PRIMITIVE_LANTERN))
            fail_msg("%s", io_primitive_names[i]);
        io_mesh_destroy(mesh);
    }
}

/* Oracle: docs/formats.md: of the primitives balls, cubes and slabs are convex; a dent of a hundredth, or
 * two parts, are not. */
static void some_primitives_are_convex(void **state)
{
    (void)state;
    struct io_mesh *mesh;
    for (int i = 0; i < IO_PRIMITIVE_COUNT; i++) {
        bool is_convex = false;
        assert_true(io_mesh_create_primitive((enum io_primitive)i, 24, &mesh, NULL));
        assert_true(render_mesh_is_convex(mesh, &is_convex, NULL));
        if (is_convex != (i == IO_PRIMITIVE_SPHERE || i == IO_PRIMITIVE_CUBE || i == IO_PRIMITIVE_SLAB))
            fail_msg("%s", io_primitive_names[i]);
        if (i == IO_PRIMITIVE_SPHERE) {
            for (size_t k = 0; k < 3; k++)
                mesh->positions[3 * (size_t)mesh->indices[600] + k] *= 0.99f;
            assert_true(render_mesh_is_convex(mesh, &is_convex, NULL));
            assert_false(is_convex);
        }
        io_mesh_destroy(mesh);
    }
}

/* Oracle: without any one of its triangles, or with it turned, a closed surface is not closed. */
static void one_triangle_makes_the_difference(void **state)
{
    (void)state;
    struct rng rng = { .seed = 7 };
    struct io_mesh *mesh;
    assert_true(io_mesh_create_primitive(IO_PRIMITIVE_KNOT, 40, &mesh, NULL));
    for (int i = 0; i < 100; i++) {
        const size_t which = (size_t)uniform(&rng, 0, (double)mesh->triangle_count - 0.5);
        uint32_t *const corners = &mesh->indices[3 * which];
        const uint32_t kept[3] = { corners[0], corners[1], corners[2] };
        corners[1] = kept[2];
        corners[2] = kept[1];
        assert_false(is_solid(mesh));
        corners[1] = corners[2] = kept[0]; /* nothing is left of it */
        assert_false(is_solid(mesh));
        memcpy(corners, kept, sizeof kept);
    }
    assert_true(is_solid(mesh));
    io_mesh_destroy(mesh);
}

/* Two cubes' corners; the second's triangles as asked. */
static void two_cubes(struct io_mesh *mesh, double scale, double shift_mm, bool is_inward)
{
    static float positions[2 * 8 * 3];
    static uint32_t indices[2 * 12 * 3];
    const size_t vertex_count = 8, triangle_count = 12;
    static const int faces[12][3] = { { 0, 2, 1 }, { 1, 2, 3 }, { 4, 5, 6 }, { 5, 7, 6 },
                                      { 0, 1, 4 }, { 1, 5, 4 }, { 2, 6, 3 }, { 3, 6, 7 },
                                      { 0, 4, 2 }, { 2, 4, 6 }, { 1, 3, 5 }, { 3, 7, 5 } };
    for (size_t v = 0; v < 2 * vertex_count; v++) {
        for (size_t k = 0; k < 3; k++) {
            const float corner = (v >> k & 1) ? 1.0f : -1.0f;
            positions[3 * v + k] =
                v < vertex_count ? corner : (float)(scale * (double)corner + (k == 0 ? shift_mm : 0));
        }
    }
    for (size_t i = 0; i < 2 * triangle_count; i++) {
        for (size_t k = 0; k < 3; k++) {
            const size_t turned = i >= triangle_count && is_inward ? 2 - k : k;
            indices[3 * i + k] = (uint32_t)(faces[i % triangle_count][turned] +
                                            (i >= triangle_count ? (int)vertex_count : 0));
        }
    }
    *mesh = (struct io_mesh){ .vertex_count = 2 * vertex_count,
                              .triangle_count = 2 * triangle_count,
                              .positions = positions,
                              .indices = indices };
}

/* Oracle: a part that is wound inwards, hollow or by mistake, shows triangles from behind, however large
 * the other is. */
static void every_part_counts(void **state)
{
    (void)state;
    struct io_mesh mesh;
    two_cubes(&mesh, 0.5, 4, false);
    assert_true(is_solid(&mesh));
    two_cubes(&mesh, 0.5, 4, true);
    assert_false(is_solid(&mesh));
    two_cubes(&mesh, 0.5, 0, true);
    assert_false(is_solid(&mesh));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(primitives_are_solid),
        cmocka_unit_test(some_primitives_are_convex),
        cmocka_unit_test(one_triangle_makes_the_difference),
        cmocka_unit_test(every_part_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
