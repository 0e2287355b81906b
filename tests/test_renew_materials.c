/* renderer/render.c, execute.c: materials that change while a renderer lives. */
#include "drawing.h"

static const enum render_technique techniques[] = { RENDER_TECHNIQUE_SPLAT, RENDER_TECHNIQUE_LAMBERT,
                                                    RENDER_TECHNIQUE_TSM };

static void make_scene(struct test_scene *test, const struct io_material *first,
                       const struct io_material *second)
{
    scene_init(test, 60);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 24, 8, -9, first));
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 24, 8, 9, second));
    scene_add_directional(test, -1, -0.5, -0.7, 4);
    for (int i = 0; i < 2; i++)
        test->objects[i].has_specular = true;
}

static void assert_same_picture(struct renderer *found, struct renderer *expected,
                                enum render_technique technique)
{
    const struct render_options options = { .technique = technique, .epsilon = 0.05 };
    struct io_image *const a = draw(found, &options, NULL), *const b = draw(expected, &options, NULL);
    assert_memory_equal(a->pixels, b->pixels,
                        (size_t)a->width_px * (size_t)a->height_px * 4 * sizeof(float));
    io_image_destroy(a);
    io_image_destroy(b);
}

/* Oracle: a renderer made for the new materials draws the same, bit for bit. Media become one, and two
 * again; addresses of tables that were freed may be given again, which must not be taken for knowing them.
 */
static void a_renewed_renderer_draws_as_a_new_one(void **state)
{
    (void)state;
    const struct io_material a = marble(), b = skin1();
    struct io_material c = skin1();
    c.layers[0][0].medium.sigma_a_per_mm = 0.2;
    const struct {
        const struct io_material *first, *second;
        double roughness;
        bool has_specular;
    } steps[] = { { &a, &b, 0.3, true },
                  { &a, &c, 0.3, true },
                  { &b, &b, 0.7, true },
                  { &c, &c, 0.7, false },
                  { &b, &a, 0.1, true } };
    struct test_scene test;
    make_scene(&test, &a, &b);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        struct test_scene fresh;
        make_scene(&fresh, steps[i].first, steps[i].second);
        test.objects[0].material = *steps[i].first;
        test.objects[1].material = *steps[i].second;
        test.objects[0].roughness = fresh.objects[0].roughness = steps[i].roughness;
        test.objects[1].has_specular = fresh.objects[1].has_specular = steps[i].has_specular;
        assert_true(render_renew_materials(renderer, NULL));
        for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++) {
            struct renderer *const expected = renderer_of(&fresh, RENDER_CONTEXT_DEFAULT);
            assert_same_picture(renderer, expected, techniques[t]);
            render_destroy(expected);
        }
        scene_end(&fresh);
    }
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the picture before. A medium that cannot be leaves the renderer as it was. */
static void a_refused_material_changes_nothing(void **state)
{
    (void)state;
    const struct io_material a = marble(), b = skin1();
    struct test_scene test, fresh;
    dipole_status status = { 0 };
    make_scene(&test, &a, &b);
    make_scene(&fresh, &a, &b);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct renderer *const expected = renderer_of(&fresh, RENDER_CONTEXT_DEFAULT);
    test.objects[1].material.layers[1][0].medium.sigma_a_per_mm = -1;
    assert_false(render_renew_materials(renderer, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    test.objects[1].material = b;
    for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++)
        assert_same_picture(renderer, expected, techniques[t]);
    render_destroy(renderer);
    render_destroy(expected);
    scene_end(&test);
    scene_end(&fresh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_renewed_renderer_draws_as_a_new_one),
        cmocka_unit_test(a_refused_material_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
