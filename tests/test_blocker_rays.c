/* renderer/crossings.c, renderer/area_light.c and the rays of renderer/reference_trace.c: what blockers
 * leave exactly. */
#include "blockers.h"
#include "check.h"
#include "renderer/area_light.h"
#include "renderer/blocker.h"
#include "renderer/crossings.h"
#include "renderer/reference_pixel.h"
#include "scenes.h"

static struct render_crossing crossing(double depth_mm, unsigned blocker, bool is_entry)
{
    return (
        struct render_crossing){ .depth_mm = (float)depth_mm, .blocker = blocker, .is_entry = is_entry };
}

/* Oracle: by hand. */
static void crossings_become_ways(void **state)
{
    (void)state;
    const struct io_blocker blockers[] = {
        { .opacity = { 0.3, 0.3, 0.3 } },
        { .has_extinction = true, .extinction_per_mm = { 0.5, 1, 2 } },
        { .is_sheet = true, .opacity = { 0.1, 0.1, 0.1 } },
    };
    struct render_segment segments[8];
    /* two ways through the first, one of them around another within it; through the second; two sheets */
    struct render_crossing mixed[] = { crossing(9, 0, false), crossing(8, 0, true),  crossing(1, 0, true),
                                       crossing(2, 0, true),  crossing(3, 0, false), crossing(4, 0, false),
                                       crossing(6, 1, false), crossing(5, 1, true) };
    assert_int_equal(render_crossings_pair(blockers, mixed, 8, 0, 1.5, segments), 3);
    assert_true(segments[0].z0_mm == 1 && segments[0].ze_mm == 4 && segments[0].alpha[0] == 0.3);
    assert_true(segments[1].z0_mm == 8 && segments[1].ze_mm == 9 && segments[1].alpha[1] == 0.3);
    assert_true(segments[2].z0_mm == 5 && segments[2].ze_mm == 6);
    assert_close(segments[2].alpha[2], 1 - exp(-2 * 1.5), 1e-14, "1 mm of depth is 1.5 mm of the ray");
    struct render_crossing sheets[] = { crossing(2, 2, false), crossing(1, 2, true) };
    assert_int_equal(render_crossings_pair(blockers, sheets, 2, 0, 1, segments), 2);
    assert_true(segments[0].ze_mm == 1 && segments[1].z0_mm == 2 && segments[1].alpha[0] == 0.1);
    /* the light within; a surface that is never left; an exit that belongs to nothing */
    struct render_crossing inside[] = { crossing(3, 1, false) };
    assert_int_equal(render_crossings_pair(blockers, inside, 1, 1, 1, segments), 1);
    assert_true(segments[0].z0_mm == 1 && segments[0].ze_mm == 3);
    struct render_crossing open[] = { crossing(3, 0, true) };
    assert_int_equal(render_crossings_pair(blockers, open, 1, 0, 1, segments), 1);
    assert_true(segments[0].z0_mm == 3 && segments[0].ze_mm == 3 && segments[0].alpha[0] == 0.3);
    /* rounding at a silhouette, then another way */
    struct render_crossing early[] = { crossing(5, 0, false), crossing(5.001, 0, true),
                                       crossing(8, 0, true), crossing(9, 0, false) };
    assert_int_equal(render_crossings_pair(blockers, early, 4, 0, 1, segments), 2);
    assert_true(segments[0].z0_mm == segments[0].ze_mm && segments[1].z0_mm == 8 && segments[1].ze_mm == 9);
    /* parallel light comes from nowhere: what is left without being entered is a sheet */
    struct render_crossing away[] = { crossing(3, 0, false) };
    assert_int_equal(render_crossings_pair(blockers, away, 1, INFINITY, 1, segments), 1);
    assert_true(segments[0].z0_mm == 3 && segments[0].ze_mm == 3);
    struct render_crossing odd[] = { crossing(1, 0, true), crossing(2, 0, false), crossing(3, 0, false) };
    assert_int_equal(render_crossings_pair(blockers, odd, 3, 0, 1, segments), 1);
    assert_int_equal(render_crossings_pair(blockers, odd, 0, 0, 1, segments), 0);
}

/* Oracle: the disc's moments. The mean of places is the light, their mean square is half the radius
 * squared; all lie across the way to what is lit; a spot's part is 1 within, 0 outside. */
static void places_fill_the_disc(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    const double here_mm[3] = { 3, -5, 7 };
    const struct io_light light = { .kind = IO_LIGHT_POINT, .position_mm = { 1, 2, 3 }, .size_mm = 4 };
    double mean[3] = { 0 }, square = 0, aside = 0;
    for (int i = 0; i < COUNT; i++) {
        const struct io_light place = render_light_place(&light, here_mm, i, COUNT);
        double along = 0;
        for (int k = 0; k < 3; k++) {
            const double step = place.position_mm[k] - light.position_mm[k];
            mean[k] += step / COUNT;
            square += step * step / COUNT;
            along += step * (here_mm[k] - light.position_mm[k]);
        }
        aside = fmax(aside, fabs(along));
        assert_false(render_light_has_size(&place));
    }
    assert_true(fabs(mean[0]) < 0.01 && fabs(mean[1]) < 0.01 && fabs(mean[2]) < 0.01 && aside < 1e-12);
    assert_close(square, 2, 1e-12, "half of 2 mm squared");
    const struct io_light sun = { .direction = { 0, 0, -1 }, .size_rad = 0.2 };
    double least = 1;
    for (int i = 0; i < COUNT; i++)
        least = fmin(least, -render_light_place(&sun, here_mm, i, COUNT).direction[2]);
    assert_close(acos(least), 0.1, 2e-3, "half the angle, but for half a ring");
    assert_memory_equal(render_light_place(&light, here_mm, 0, 1).position_mm, light.position_mm,
                        sizeof mean);
    const struct io_light spot = {
        .kind = IO_LIGHT_POINT, .is_spot = true, .direction = { 0, 0, 1 }, .cone_rad = 1, .cone_blend = 0.5
    };
    assert_true(render_light_spot_part(&spot, (double[3]){ 0, sin(0.24), cos(0.24) }) == 1);
    assert_true(render_light_spot_part(&spot, (double[3]){ 0, sin(0.51), cos(0.51) }) == 0);
    assert_true(render_light_spot_part(&light, (double[3]){ 0, 1, 0 }) == 1);
}

/* What a scene of one slab and some blockers leaves at a point of it. */
static void left_at(struct test_scene *test, double x_mm, double z_mm, int count, double left[3])
{
    struct render_tracer *tracer;
    assert_true(render_tracer_create(&test->scene, &tracer, NULL));
    const struct render_surface_point point = { .position_mm = { x_mm, 0, z_mm },
                                                .facet_normal = { 0, 1, 0 },
                                                .normal = { 0, 1, 0 } };
    render_light_left(tracer, &test->lights[0], &point, count, left);
    render_tracer_destroy(tracer);
}

static void slab_under(struct test_scene *test)
{
    const struct io_material material = marble();
    scene_init(test, 100);
    assert_true(scene_add(test, IO_PRIMITIVE_SLAB, 8, 20, 0, &material));
}

/* Oracle: chords of a ball in closed form; a ball stands for a solid that is cut in the middle by the
 * receiver, too. */
static void rays_see_chords_of_a_ball(void **state)
{
    (void)state;
    struct test_scene test;
    slab_under(&test);
    scene_add_directional(&test, 0, -1, 0, 1);
    struct io_blocker ball = blocker_of(IO_PRIMITIVE_SPHERE, 512, 4, 10);
    ball.has_extinction = true;
    for (int c = 0; c < 3; c++)
        ball.extinction_per_mm[c] = 0.1 * (c + 1);
    test.scene.blockers = &ball;
    test.scene.blocker_count = 1;
    double left[3];
    for (double x_mm = 0; x_mm < 3.9; x_mm += 0.7) {
        left_at(&test, x_mm, 0.3, 1, left);
        const double chord_mm = 2 * sqrt(16 - x_mm * x_mm - 0.09);
        for (int c = 0; c < 3; c++) /* a ball of 512 facets around */
            assert_close(left[c], exp(-ball.extinction_per_mm[c] * chord_mm), 2e-3, "at %g", x_mm);
    }
    left_at(&test, 4.1, 0, 1, left);
    assert_true(left[0] == 1);
    /* constant opacity on each way */
    ball.has_extinction = false;
    for (int c = 0; c < 3; c++)
        ball.opacity[c] = 0.25 * (c + 1);
    left_at(&test, 1, 0.3, 1, left);
    for (int c = 0; c < 3; c++)
        assert_close(left[c], 1 - 0.25 * (c + 1), 1e-6, "opacity of channel %d", c);
    ball.is_sheet = true;
    left_at(&test, 1, 0.3, 1, left);
    assert_close(left[1], 0.25, 1e-6, "two sheets");
    io_mesh_destroy(ball.mesh);
    /* half of it lies under the receiver */
    ball = blocker_of(IO_PRIMITIVE_SPHERE, 512, 4, 0);
    ball.has_extinction = true;
    ball.extinction_per_mm[0] = 0.2;
    left_at(&test, 1, 0.3, 1, left);
    assert_close(left[0], exp(-0.2 * sqrt(16 - 1.09)), 2e-3, "the upper half");
    assert_true(left[1] == 1 && left[2] == 1);
    io_mesh_destroy(ball.mesh);
    scene_end(&test);
}

/* Oracle: a disc of light half hidden by a long straight edge: the circle's segment in closed form. */
static void penumbra_is_the_segment_of_a_disc(void **state)
{
    (void)state;
    struct test_scene test;
    slab_under(&test);
    scene_add_point(&test, 0, 20, 0, 1);
    test.lights[0].size_mm = 4;
    struct io_blocker half = blocker_of(IO_PRIMITIVE_CUBE, 4, 100, 10);
    for (size_t i = 0; i < half.mesh->vertex_count; i++) { /* x > 0, 10 mm high, thin */
        half.mesh->positions[3 * i] = half.mesh->positions[3 * i] > 0 ? 200.0f : 0.0f;
        half.mesh->positions[3 * i + 1] = half.mesh->positions[3 * i + 1] > 10 ? 10.001f : 10.0f;
    }
    half.opacity[0] = 1;
    half.opacity[1] = 0.5;
    test.scene.blockers = &half;
    test.scene.blocker_count = 1;
    for (double x_mm = -3; x_mm <= 3; x_mm += 0.5) {
        double left[3];
        left_at(&test, x_mm, 0, 4096, left);
        /* light at -l x/20.. the edge as seen from the receiver: at -x on the light's plane */
        const double edge = fmin(fmax(-x_mm / 2, -1), 1);
        const double lit = 0.5 + (asin(edge) + edge * sqrt(1 - edge * edge)) / 3.14159265358979323846;
        /* 4096 places; the disc is turned to face the point by up to 0.15 rad, and its edge nearer */
        assert_true(fabs(left[0] - lit) < 0.02);
        assert_close(left[1], (1 + left[0]) / 2, 1e-6, "half as opaque at %g", x_mm);
        assert_true(left[2] == 1);
    }
    io_mesh_destroy(half.mesh);
    scene_end(&test);
}

/* Oracle: the area of the discs. Particles keep what lies before them, whichever way light comes. */
static void particles_face_the_light(void **state)
{
    (void)state;
    struct test_scene test;
    slab_under(&test);
    scene_add_directional(&test, 0.6, -0.8, 0, 1);
    struct io_mesh *mesh;
    assert_true(io_mesh_create_particles(1, 1, &mesh, NULL));
    mesh->positions[0] = mesh->positions[2] = 0;
    mesh->positions[1] = 8;
    for (int k = 0; k < 3; k++)
        mesh->min[k] = mesh->max[k] = mesh->positions[k];
    struct io_blocker particle = { .mesh = mesh, .particle_mm = 2, .opacity = { 0.5, 1, 0 } };
    test.scene.blockers = &particle;
    test.scene.blocker_count = 1;
    double left[3];
    left_at(&test, 6, 0, 1, left);
    assert_true(left[0] == 0.5 && left[1] == 0 && left[2] == 1);
    left_at(&test, 6, 1.95, 1, left);
    assert_true(left[0] == 0.5);
    left_at(&test, 6 + 1.95 / 0.8, 0, 1, left); /* a disc across the light is wider on the slab */
    assert_true(left[0] == 0.5);
    left_at(&test, 6, 2.05, 1, left);
    assert_true(left[0] == 1);
    left_at(&test, 6 + 2.05 / 0.8, 0, 1, left);
    assert_true(left[0] == 1);
    io_mesh_destroy(mesh);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crossings_become_ways),     cmocka_unit_test(places_fill_the_disc),
        cmocka_unit_test(rays_see_chords_of_a_ball), cmocka_unit_test(penumbra_is_the_segment_of_a_disc),
        cmocka_unit_test(particles_face_the_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
