/* renderer/window/camera.c */
#include "check.h"

#include "renderer/window/camera.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static double distance(const struct io_camera *camera)
{
    const double v[3] = { camera->eye_mm[0] - camera->target_mm[0],
                          camera->eye_mm[1] - camera->target_mm[1],
                          camera->eye_mm[2] - camera->target_mm[2] };
    return length_of(v);
}

static struct io_camera some_camera(void)
{
    return (struct io_camera){ .eye_mm = { 1, 2, 33 },
                               .target_mm = { 1, 2, 3 },
                               .up = { 0, 2, 0 }, /* of any length */
                               .fov_y_rad = 0.5,
                               .width_px = 8,
                               .height_px = 6 };
}

/* Oracle: geometry. To the right by a quarter of a turn at 0.008 rad a pixel, the eye comes from the left.
 */
static void a_drag_turns_the_eye_about_the_target(void **state)
{
    (void)state;
    struct io_camera camera = some_camera();
    window_camera_turn(&camera, PI / 2 / 0.008, 0);
    const double expected[3] = { 1 - 30, 2, 3 };
    for (int k = 0; k < 3; k++)
        assert_true(fabs(camera.eye_mm[k] - expected[k]) < 1e-12);
}

/* Oracle: invariants under random drags: the distance stays, the pole is never reached, the target rests.
 */
static void drags_keep_the_distance_and_never_reach_the_pole(void **state)
{
    (void)state;
    struct io_camera camera = some_camera();
    struct rng rng = { .seed = 2 };
    const double before = distance(&camera);
    for (int i = 0; i < 5000; i++) {
        window_camera_turn(&camera, log_uniform(&rng, 0.01, 100) - 5, log_uniform(&rng, 0.01, 100) - 5);
        assert_close(distance(&camera), before, 1e-9, "drag %d", i); /* 5000 roundings */
        assert_true(fabs(camera.eye_mm[1] - camera.target_mm[1]) <= 0.9951 * before);
    }
    assert_true(camera.target_mm[0] == 1 && camera.target_mm[1] == 2 && camera.target_mm[2] == 3);
}

/* Oracle: a tenth nearer by each notch, and back by the opposite ones; limits of what a scene can say. */
static void the_wheel_comes_nearer_and_goes_back(void **state)
{
    (void)state;
    struct io_camera camera = some_camera(), plan = some_camera();
    plan.is_orthographic = true;
    plan.height_mm = 40;
    window_camera_zoom(&camera, 1);
    window_camera_zoom(&plan, 1);
    assert_close(distance(&camera), 27, 1e-14, "nearer");
    assert_close(plan.height_mm, 36, 1e-14, "smaller");
    assert_close(distance(&plan), 30, 1e-14, "parallel views do not move");
    window_camera_zoom(&camera, -1);
    assert_close(distance(&camera), 30, 1e-14, "back");
    window_camera_zoom(&camera, 1e6);
    assert_close(distance(&camera), 1e-3, 1e-10, "nearest");
    window_camera_zoom(&camera, -1e6);
    assert_close(distance(&camera), 1e5, 1e-10, "farthest");
}

/* Oracle: a light at the eye's side follows the same drag the other way round: what is dragged is its
 * front. */
static void lights_turn_with_the_drag(void **state)
{
    (void)state;
    const struct io_camera camera = some_camera();
    const double centre_mm[3] = { 1, 2, 3 };
    struct io_light sun = { .kind = IO_LIGHT_DIRECTIONAL, .direction = { 0, 0, -1 } };
    struct io_light lamp = { .kind = IO_LIGHT_POINT, .position_mm = { 1, 2, 13 } };
    window_light_turn(&sun, &camera, centre_mm, PI / 2 / 0.008, 0);
    window_light_turn(&lamp, &camera, centre_mm, PI / 2 / 0.008, 0);
    assert_true(fabs(sun.direction[0] + 1) < 1e-12);
    assert_true(fabs(lamp.position_mm[0] - 11) < 1e-12);
    for (int i = 0; i < 1000; i++)
        window_light_turn(&sun, &camera, centre_mm, 7, -3);
    assert_close(length_of(sun.direction), 1, 1e-14, "a direction stays a unit vector");
}

/* Oracle: the axes, and each the other's inverse. */
static void angles_and_directions_are_inverse(void **state)
{
    (void)state;
    static const double axes[][5] = {
        { 0, 0, 0, 0, -1 }, { 90, 0, -1, 0, 0 }, { -90, 0, 1, 0, 0 }, { 0, 90, 0, -1, 0 }
    };
    for (size_t i = 0; i < 4; i++) {
        double direction[3];
        window_direction_of_angles(axes[i][0], axes[i][1], direction);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(direction[k] - axes[i][2 + k]) < 1e-15);
    }
    for (int turn = -170; turn <= 180; turn += 10) {
        for (int height = -80; height <= 80; height += 10) {
            double direction[3], turn_deg, height_deg;
            window_direction_of_angles(turn, height, direction);
            assert_close(length_of(direction), 1, 1e-15, "unit");
            window_angles_of_direction(direction, &turn_deg, &height_deg);
            assert_true(fabs(remainder(turn_deg - turn, 360)) < 1e-12);
            assert_true(fabs(height_deg - height) < 1e-12);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_drag_turns_the_eye_about_the_target),
        cmocka_unit_test(drags_keep_the_distance_and_never_reach_the_pole),
        cmocka_unit_test(the_wheel_comes_nearer_and_goes_back),
        cmocka_unit_test(lights_turn_with_the_drag),
        cmocka_unit_test(angles_and_directions_are_inverse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
