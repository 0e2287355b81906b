/* shaders/common/light.glsl: shadows of all techniques, against rays in closed form. */
#include "drawing.h"

#include <stdio.h>

enum { WIDTH = 200, HEIGHT = 150 };

/* A ball of radius BALL_MM stands on a slab, at the origin. */
#define BALL_MM 5.0

static const double eye_mm[3] = { 3, 26, 34 };

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void towards(const struct io_light *light, const double from_mm[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = light->kind == IO_LIGHT_POINT ? light->position_mm[k] - from_mm[k] : -light->direction[k];
    const double scale = 1 / length(out);
    for (int k = 0; k < 3; k++)
        out[k] *= scale;
}

/* How far the ray passes the middle of the ball, if the ball is ahead; else INFINITY. */
static double miss_mm(const double from_mm[3], const double direction[3])
{
    double to[3] = { -from_mm[0], BALL_MM - from_mm[1], -from_mm[2] }, along = 0, left[3];
    for (int k = 0; k < 3; k++)
        along += to[k] * direction[k];
    for (int k = 0; k < 3; k++)
        left[k] = to[k] - along * direction[k];
    return along > 0 ? length(left) : INFINITY;
}

struct count {
    int lit, dark, acne, leaks;
    double nearest_dark_mm; /* to the point of contact, on the slab */
};

/* Compare the slab's and the ball's pixels with what rays say, but for those within margin_mm of a shadow's
 * edge; the slab lies at y = 0. Pixels show Lambert's radiance, compared with that of the open surface at
 * their middle, from which they differ by some per cent at silhouettes. */
static struct count compare(const struct io_image *image, const struct render_capture *captured,
                            const struct io_light *light, double margin_mm)
{
    struct count count = { .nearest_dark_mm = INFINITY };
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const float *const p = captured->position_mm + 3 * i;
        const double here_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
        double normal[3] = { 0, 1, 0 }, to_light[3];
        if (captured->coverage[i] < 1 ||
            (here_mm[1] < 0.01 && fmax(fabs(here_mm[0]), fabs(here_mm[2])) > 19))
            continue;
        const bool is_ball = here_mm[1] > 0.01;
        if (is_ball) {
            for (int k = 0; k < 3; k++)
                normal[k] = (here_mm[k] - (k == 1 ? BALL_MM : 0)) / BALL_MM;
        }
        towards(light, here_mm, to_light);
        const double cosine = normal[0] * to_light[0] + normal[1] * to_light[1] + normal[2] * to_light[2];
        const double miss = is_ball ? INFINITY : miss_mm(here_mm, to_light);
        if (fabs(miss - BALL_MM) < margin_mm || fabs(cosine) < 0.08)
            continue;
        const bool is_lit = cosine > 0 && miss > BALL_MM;
        const double falloff = light->kind == IO_LIGHT_POINT
                                   ? 1 / pow(length((double[3]){ light->position_mm[0] - here_mm[0],
                                                                 light->position_mm[1] - here_mm[1],
                                                                 light->position_mm[2] - here_mm[2] }),
                                             2)
                                   : 1;
        dipole_coefficients k;
        const struct io_material material = marble();
        if (!dipole_coefficients_init(&material.layers[0][0].medium, &k, NULL))
            continue;
        const double open = (double)captured->exit_per_sr[i] * dipole_diffuse_reflectance(&k) *
                            light->rgb[0] * falloff * cosine *
                            (1 - dipole_fresnel_reflectance(1.5, cosine));
        const double part = cosine > 0 ? (double)image->pixels[4 * i] / open : (double)image->pixels[4 * i];
        count.lit += is_lit;
        count.dark += !is_lit;
        count.acne += is_lit && part < 0.85;
        count.leaks += !is_lit && part > 0.15;
        if (!is_ball && !is_lit)
            count.nearest_dark_mm = fmin(count.nearest_dark_mm, length(here_mm));
    }
    return count;
}

/* Oracle: rays in closed form. A ball on a slab, light high, low and grazing, parallel and from points: all
 * that is lit is lit, and dark is dark, down to the point of contact. */
static void shadows_are_where_rays_say(void **state)
{
    (void)state;
    static const double directions[][3] = {
        { 0.2, -1, 0.1 }, { 1, -1, 0.3 }, { 1, -0.35, 0.2 }, { 1, -0.15, 0 }, { -1, -1, -1.2 }
    };
    static const double points[][3] = { { -12, 16, 4 }, { -60, 40, 30 }, { 2, 13, 9 } };
    for (int i = 0; i < 8; i++) {
        struct test_scene test;
        const struct io_material material = marble();
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 20, 0, &material));
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 256, BALL_MM, 0, &material));
        struct io_mesh *const ball = test.objects[1].mesh;
        for (size_t v = 0; v < ball->vertex_count; v++)
            ball->positions[3 * v + 1] += (float)BALL_MM;
        ball->min[1] += (float)BALL_MM;
        ball->max[1] += (float)BALL_MM;
        test.scene.max_mm[1] = 2 * BALL_MM;
        if (i < 5)
            scene_add_directional(&test, directions[i][0], directions[i][1], directions[i][2], 3);
        else
            scene_add_point(&test, points[i - 5][0], points[i - 5][1], points[i - 5][2], 300);
        memcpy(test.scene.camera.eye_mm, eye_mm, sizeof eye_mm);
        test.scene.camera.width_px = WIDTH;
        test.scene.camera.height_px = HEIGHT;
        test.scene.camera.fov_y_rad = 0.75;
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct io_image *const image =
            draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, NULL);
        struct render_capture *const captured = capture(renderer, 1);
        /* three texels of the light's view, and the width of a pixel on the slab at these angles */
        const struct count count = compare(image, captured, &test.lights[0], 0.5);
        print_message(
            "  light %d: %d lit, %d dark, %d acne, %d leaks; dark from %.2f mm beside the contact\n", i,
            count.lit, count.dark, count.acne, count.leaks, count.nearest_dark_mm);
        assert_true(count.lit > 1000 && count.dark > 300);
        assert_int_equal(count.acne, 0);
        assert_int_equal(count.leaks, 0);
        render_capture_destroy(captured);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shadows_are_where_rays_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
