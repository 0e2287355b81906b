/* renderer/light_distance.c: how near to a light anything is. */
#include "blockers.h"
#include "check.h"
#include "renderer/light_distance.h"

/* Oracle: the nearest of many points of the triangle. Some triangles have no area. */
static void triangles_are_as_near_as_their_points(void **state)
{
    (void)state;
    enum { STEPS = 60 };
    struct rng rng = { .seed = 1 };
    for (int i = 0; i < 400; i++) {
        double corners[3][3], position[3], least = INFINITY;
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < 3; k++)
                corners[c][k] = uniform(&rng, -1, 1);
        }
        for (int k = 0; k < 3; k++) {
            position[k] = uniform(&rng, -1.5, 1.5);
            corners[2][k] = i % 5 == 0 ? 2 * corners[1][k] - corners[0][k] : corners[2][k];
            corners[1][k] = i % 25 == 0 ? corners[0][k] : corners[1][k];
            corners[2][k] = i % 25 == 0 ? corners[0][k] : corners[2][k];
        }
        for (int a = 0; a <= STEPS; a++) {
            for (int b = 0; a + b <= STEPS; b++) {
                double away2 = 0;
                for (int k = 0; k < 3; k++) {
                    const double point = corners[0][k] + (corners[1][k] - corners[0][k]) * a / STEPS +
                                         (corners[2][k] - corners[0][k]) * b / STEPS;
                    away2 += (point - position[k]) * (point - position[k]);
                }
                least = fmin(least, sqrt(away2));
            }
        }
        const double found = render_triangle_distance_mm((const double(*)[3])corners, position);
        assert_true(found <= least + 1e-12 && found > least - 3.5 / STEPS); /* edges are 3.5 long at most */
    }
}

/* Oracle: balls. Objects, solids and particles, and what blocks nothing. */
static void scenes_are_as_near_as_what_blocks(void **state)
{
    (void)state;
    static const double at_mm[3] = { 0, 10, 0 };
    struct io_blocker blockers[2] = { blocker_of(IO_PRIMITIVE_SPHERE, 128, 3, 0), { .mesh = NULL } };
    struct io_scene scene = { .blockers = blockers, .blocker_count = 1 };
    assert_true(isinf(render_light_distance_mm(&scene, at_mm)));
    blockers[0].opacity[0] = 1;
    assert_close(render_light_distance_mm(&scene, at_mm), 7, 1e-3, "ball");
    assert_true(io_mesh_create_particles(1, 1, &blockers[1].mesh, NULL));
    blockers[1].particle_mm = 0.5;
    blockers[1].opacity[2] = 0.1;
    for (int k = 0; k < 3; k++)
        blockers[1].mesh->positions[k] = k == 1 ? 8 : 0;
    scene.blocker_count = 2;
    assert_close(render_light_distance_mm(&scene, at_mm), 1.5, 1e-6, "particle");
    struct io_object object = { .mesh = blockers[0].mesh };
    scene.objects = &object;
    scene.object_count = 1;
    scene.blocker_count = 0;
    assert_close(render_light_distance_mm(&scene, at_mm), 7, 1e-3, "object");
    io_mesh_destroy(blockers[0].mesh);
    io_mesh_destroy(blockers[1].mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_are_as_near_as_their_points),
        cmocka_unit_test(scenes_are_as_near_as_what_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
