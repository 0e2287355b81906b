/* renderer/plan_shadows.c and the effects of shadows: what each scene calls for. */
#include "blockers.h"
#include "plans.h"
#include "scenes.h"

enum { EFFECTS = 7 };
static const char *const names[EFFECTS] = { "shadow_map", "avsm",           "avsm_colour", "soft_shadow",
                                            "shadow",     "shadow_nearest", "light_shadow" };

/* Oracle: docs/shadows.md. */
static void each_effect_is_called_for_by_what_it_is_for(void **state)
{
    (void)state;
    static const double clear[3] = { 0, 0, 0 }, grey[3] = { 0.5, 0.5, 0.5 }, coloured[3] = { 0.5, 0.5, 1 },
                        opaque[3] = { 1, 1, 1 };
    const struct {
        const double *opacity; /* NULL: no blocker */
        bool has_size, is_spot, is_lambert;
        const char *active; /* of names, in their order */
    } cases[] = {
        { NULL, false, false, true, "-------" },   { clear, false, false, true, "-------" },
        { opaque, false, false, true, "x---x--" }, { opaque, false, false, false, "x-----x" },
        { grey, false, false, true, "xx--x--" },   { coloured, false, false, false, "xxx---x" },
        { NULL, true, false, true, "x--xxx-" },    { grey, true, false, false, "xx-x-xx" },
        { NULL, false, true, true, "x---x--" },    { coloured, true, true, true, "xxxxxx-" },
    };
    const struct io_material material = marble();
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct test_scene test;
        struct render_plan *plan;
        dipole_status status;
        scene_init(&test, 40);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 8, 0, &material));
        scene_add_point(&test, 0, 100, 0, 1);
        test.lights[0].size_mm = cases[i].has_size ? 1 : 0;
        test.lights[0].is_spot = cases[i].is_spot;
        struct io_blocker blocker = blocker_of(IO_PRIMITIVE_CUBE, 4, 2, 30);
        for (int c = 0; c < 3 && cases[i].opacity; c++)
            blocker.opacity[c] = cases[i].opacity[c];
        test.scene.blockers = &blocker;
        test.scene.blocker_count = cases[i].opacity != NULL;
        const struct render_request request = { .scene = &test.scene,
                                                .technique = cases[i].is_lambert ? RENDER_TECHNIQUE_LAMBERT
                                                                                 : RENDER_TECHNIQUE_GATHER,
                                                .epsilon = 0.01 };
        if (!render_plan_create(&request, &plan, &status))
            fail_msg("%s", status.message);
        char active[EFFECTS + 1] = "";
        for (int e = 0; e < EFFECTS; e++)
            strcat(active, decision_of(plan, names[e])->is_active ? "x" : "-");
        if (strcmp(active, cases[i].active) != 0)
            print_error("case %zu\n", i);
        assert_string_equal(active, cases[i].active);
        render_plan_destroy(plan);
        io_mesh_destroy(blocker.mesh);
        scene_end(&test);
    }
}

/* Oracle: geometry. The map sees what the light's view does, and as far to the side as blockers at their
 * nearest throw penumbras, but no farther than they reach. */
static void maps_are_as_wide_as_penumbras(void **state)
{
    (void)state;
    const struct io_material material = marble();
    for (int i = 0; i < 4; i++) {
        struct test_scene test;
        struct render_plan *plan;
        scene_init(&test, 40);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 32, 8, 0, &material));
        scene_add_directional(&test, 0, -1, 0, 1);
        test.lights[0].size_rad = i % 2 ? 0.2 : 0;
        /* within the view; and to the side of it */
        struct io_blocker blocker = blocker_of(IO_PRIMITIVE_SPHERE, 32, i < 2 ? 1 : 100, 300);
        for (int c = 0; c < 3; c++)
            blocker.opacity[c] = 0.5;
        test.scene.blockers = &blocker;
        test.scene.blocker_count = 1;
        const struct render_request request = { .scene = &test.scene, .epsilon = 0.01 };
        assert_true(render_plan_create(&request, &plan, NULL));
        const struct render_plan_shadow *const shadow = &plan->shadows.of_view[0];
        const double view_mm = plan->views[0].projection.half_width;
        const double nearest_mm =
            shadow->projection.eye_mm[1] - (i < 2 ? 301 : 400); /* from the light's side */
        assert_true(shadow->nearest_mm > 0 && shadow->nearest_mm < nearest_mm + 1e-3);
        if (i % 2 == 0 || i == 1) /* no penumbra; or blockers that are no wider than what is lit */
            assert_close(shadow->projection.half_width, view_mm, 1e-12, "case %d", i);
        else
            assert_close(shadow->projection.half_width, view_mm + tan(0.1) * (400 + 8), 0.01, "case %d", i);
        render_plan_destroy(plan);
        io_mesh_destroy(blocker.mesh);
        scene_end(&test);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_effect_is_called_for_by_what_it_is_for),
        cmocka_unit_test(maps_are_as_wide_as_penumbras),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
