/* renderer/frusta.c: what a light must look at to see objects. */
#include "check.h"
#include "scenes.h"

#include "renderer/frusta.h"

/* A light and a ball of some objects, so far apart that one view sees all. */
static size_t view_from(struct rng *rng, const struct render_ball *ball, struct render_projection *view)
{
    struct render_projection views[RENDER_FACES];
    double position_mm[3], away[3], length2 = 0;
    for (int k = 0; k < 3; k++) {
        away[k] = uniform(rng, -1, 1);
        length2 += away[k] * away[k];
    }
    const double distance_mm = ball->radius_mm * log_uniform(rng, 1.35, 100);
    for (int k = 0; k < 3; k++)
        position_mm[k] = ball->centre_mm[k] + distance_mm * away[k] / sqrt(length2);
    const size_t count = render_frusta_of_point(position_mm, ball, 1, 1, views);
    *view = views[0];
    return count;
}

/* Oracle: all vertices are in the view and between its planes, and touch it: on both sides where it is
 * widest, nearly, as the middle of the angles is looked at. It is no wider than that of the ball.
 */
static void narrow_views_hold_all_and_touch_it(void **state)
{
    (void)state;
    struct rng rng = { .seed = 31 };
    for (int round = 0; round < 40; round++) {
        const struct io_material material = marble();
        struct test_scene test;
        struct render_projection view;
        double reach[2][2] = { { 0, 0 }, { 0, 0 } }, nearest_mm = INFINITY, farthest_mm = 0;
        scene_init(&test, 60);
        assert_true(
            scene_add(&test, IO_PRIMITIVE_KNOT, 48, uniform(&rng, 1, 5), uniform(&rng, -9, 0), &material));
        assert_true(
            scene_add(&test, IO_PRIMITIVE_CUBE, 8, uniform(&rng, 1, 5), uniform(&rng, 0, 9), &material));
        const struct render_ball ball = render_ball_of_scene(&test.scene);
        assert_int_equal(view_from(&rng, &ball, &view), 1);
        const struct render_projection before = view;
        render_frustum_narrow(test.scene.objects, 2, 1.01, &view);
        assert_true(view.half_width == view.half_height && view.half_width < 1.02 * before.half_width);
        assert_memory_equal(view.eye_mm, before.eye_mm, sizeof view.eye_mm);
        for (size_t i = 0; i < 2; i++) {
            const struct io_mesh *const mesh = test.objects[i].mesh;
            for (size_t v = 0; v < mesh->vertex_count; v++) {
                double position_mm[3], at_mm[3];
                for (size_t k = 0; k < 3; k++)
                    position_mm[k] = (double)mesh->positions[3 * v + k];
                render_projection_to_view(&view, position_mm, at_mm);
                nearest_mm = fmin(nearest_mm, at_mm[2]);
                farthest_mm = fmax(farthest_mm, at_mm[2]);
                for (int k = 0; k < 2; k++) {
                    reach[k][0] = fmax(reach[k][0], -at_mm[k] / at_mm[2] / view.half_width);
                    reach[k][1] = fmax(reach[k][1], at_mm[k] / at_mm[2] / view.half_width);
                }
            }
        }
        const int wide = reach[0][0] + reach[0][1] > reach[1][0] + reach[1][1] ? 0 : 1;
        for (int k = 0; k < 2; k++) {
            assert_true(reach[k][0] < 1 && reach[k][1] < 1);
            assert_true(reach[wide][k] > 0.75);
        }
        assert_true(view.near_mm < nearest_mm && nearest_mm < 1.01 * view.near_mm);
        assert_true(view.far_mm > farthest_mm && farthest_mm > 0.99 * view.far_mm);
        scene_end(&test);
    }
}

/* Oracle: an object that has shrunk to a point has a view; what is behind the eye has none, so the view
 * stays as it was. */
static void points_and_what_is_behind_do_no_harm(void **state)
{
    (void)state;
    const struct io_material material = marble();
    struct test_scene test;
    struct render_projection views[RENDER_FACES];
    const double position_mm[3] = { 1, 20, 3 };
    scene_init(&test, 60);
    assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 8, 0, 4, &material));
    const struct render_ball ball = render_ball_of_scene(&test.scene);
    assert_int_equal(render_frusta_of_point(position_mm, &ball, 1, 1, views), 1);
    render_frustum_narrow(test.scene.objects, 1, 1.01, &views[0]);
    assert_true(views[0].half_width > 0 && views[0].near_mm > 0 && views[0].far_mm > views[0].near_mm);
    scene_end(&test);
    scene_init(&test, 60);
    assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 8, 30, 4, &material));
    const struct render_projection before = views[0];
    render_frustum_narrow(test.scene.objects, 1, 1.01, &views[0]);
    assert_memory_equal(&views[0], &before, sizeof before);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(narrow_views_hold_all_and_touch_it),
        cmocka_unit_test(points_and_what_is_behind_do_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
