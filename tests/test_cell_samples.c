/* renderer/cell_samples.c: light views made by hand, gathered in cubes of the object at rest. */
#include "check.h"

#include "renderer/cell_samples.h"

#include <stdlib.h>
#include <string.h>

enum { SIDE = 64 };

struct view {
    float texels[4 * SIDE * SIDE], rest_mm[4 * SIDE * SIDE], objects[SIDE * SIDE];
};

static struct render_light_view view_of(const struct view *view)
{
    return (struct render_light_view){ .texels = view->texels,
                                       .objects = view->objects,
                                       .rest_mm = view->rest_mm,
                                       .size_px = SIDE,
                                       .forward = { 0, 0, -1 },
                                       .rgb = { 1, 2, 4 } };
}

/* Points of two objects anywhere in a box at rest, moved by a step; a third of the texels is dark. */
static void fill(struct rng *rng, const double step_mm[3], struct view *view)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        for (int k = 0; k < 3; k++) {
            view->rest_mm[4 * i + k] = (float)uniform(rng, -4, 4);
            view->texels[4 * i + k] = (float)((double)view->rest_mm[4 * i + k] + step_mm[k]);
        }
        view->rest_mm[4 * i + 3] = 1;
        view->texels[4 * i + 3] = uniform(rng, 0, 1) < 0.3 ? 0.0f : (float)uniform(rng, 0.1, 1);
        view->objects[i] = uniform(rng, 0, 1) < 0.5 ? 1 : 2;
    }
}

static void total(const struct render_light_samples *samples, double *flux_w, double moment[3])
{
    for (size_t i = 0; i < samples->count; i++) {
        *flux_w += (double)samples->samples[i].flux_w[0];
        for (int k = 0; k < 3; k++)
            moment[k] += (double)samples->samples[i].flux_w[0] * (double)samples->samples[i].position_mm[k];
    }
}

/* Oracle: flux and its first moment are conserved, at every level of merging; each float is rounded once.
 */
static void flux_and_its_middle_are_conserved(void **state)
{
    (void)state;
    static struct view view;
    struct rng rng = { .seed = 8 };
    const double step_mm[3] = { 1, -2, 3 };
    fill(&rng, step_mm, &view);
    double flux_w = 0, moment[3] = { 0, 0, 0 };
    for (int i = 0; i < SIDE * SIDE; i++) {
        flux_w += (double)view.texels[4 * i + 3];
        for (int k = 0; k < 3; k++)
            moment[k] += (double)view.texels[4 * i + 3] * (double)view.texels[4 * i + k];
    }
    const struct render_light_view reduced = view_of(&view);
    struct render_light_samples levels[4] = { { .count = 0 } };
    const struct render_light_target targets[2] = { { &levels[0], 1, 0.25, { -4, -4, -4 } },
                                                    { &levels[0], 1, 0.5, { -4, -4, -4 } } };
    assert_true(render_cell_samples_append(targets, &reduced, NULL));
    for (int level = 0; level < 4; level++) {
        const int shifts[2] = { level, level > 1 ? level - 1 : 0 };
        if (level > 0)
            assert_true(render_cell_samples_merge(&levels[level - 1], shifts, &levels[level], NULL));
        double found_w = 0, found_moment[3] = { 0, 0, 0 };
        total(&levels[level], &found_w, found_moment);
        assert_close(found_w, flux_w, 1e-6, "flux, level %d", level);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(found_moment[k] - moment[k]) < 1e-6 * 5 * flux_w);
        assert_true(level == 0 || levels[level].count < levels[level - 1].count);
    }
    assert_true(levels[3].count == 2 * 4 * 4 * 4); /* cubes of 2 mm in a box of 8 mm, of each object */
    for (int level = 0; level < 4; level++)
        render_light_samples_destroy(&levels[level]);
}

/* Oracle: the same texels. Samples of a moved object are those at rest, moved, one by one and in order; so
 * are merged ones. Positions are floats of up to 13 mm. */
static void samples_move_with_the_surface(void **state)
{
    (void)state;
    static struct view view;
    const double steps_mm[2][3] = { { 0, 0, 0 }, { 1.2345, -5.4321, 8 } };
    struct render_light_samples found[2][2] = { { { .count = 0 } } };
    const int shifts[2] = { 2, 2 };
    for (int i = 0; i < 2; i++) {
        struct rng rng = { .seed = 9 };
        fill(&rng, steps_mm[i], &view);
        const struct render_light_view reduced = view_of(&view);
        const struct render_light_target targets[2] = { { &found[i][0], 1, 0.3, { -4, -4, -4 } },
                                                        { &found[i][0], 1, 0.3, { -4, -4, -4 } } };
        assert_true(render_cell_samples_append(targets, &reduced, NULL));
        assert_true(render_cell_samples_merge(&found[i][0], shifts, &found[i][1], NULL));
    }
    for (int level = 0; level < 2; level++) {
        assert_int_equal(found[0][level].count, found[1][level].count);
        for (size_t s = 0; s < found[0][level].count; s++) {
            const struct render_light_sample *const a = &found[0][level].samples[s], *const b =
                                                                                         &found[1][level]
                                                                                              .samples[s];
            assert_true(a->object == b->object);
            assert_memory_equal(a->flux_w, b->flux_w, sizeof a->flux_w);
            for (int k = 0; k < 3; k++)
                assert_true(fabs((double)a->position_mm[k] + steps_mm[1][k] - (double)b->position_mm[k]) <
                            3e-6);
        }
    }
    for (int i = 0; i < 4; i++)
        render_light_samples_destroy(&found[i / 2][i % 2]);
}

/* Oracle: what has no target, no light or no object gives no samples; nothing at all none. */
static void what_is_not_lit_gives_none(void **state)
{
    (void)state;
    static struct view view;
    struct rng rng = { .seed = 10 };
    const double step_mm[3] = { 0, 0, 0 };
    fill(&rng, step_mm, &view);
    struct render_light_samples samples = { .count = 0 };
    const struct render_light_target targets[2] = { { NULL, 0, 0, { 0, 0, 0 } },
                                                    { &samples, 1, 100, { -4, -4, -4 } } };
    struct render_light_view reduced = view_of(&view);
    assert_true(render_cell_samples_append(targets, &reduced, NULL));
    assert_int_equal(samples.count, 8); /* cubes about the world's origin, far larger than the box */
    for (size_t i = 0; i < samples.count; i++)
        assert_true(samples.samples[i].object == 1);
    samples.count = 0;
    for (int i = 0; i < SIDE * SIDE; i++)
        view.texels[4 * i + 3] = 0;
    assert_true(render_cell_samples_append(targets, &reduced, NULL));
    assert_int_equal(samples.count, 0);
    render_light_samples_destroy(&samples);
}

/* Oracle: by hand. Two objects whose texels lie in the same cubes get samples of their own, each with the
 * flux of its texels. */
static void objects_in_the_same_cube_stay_apart(void **state)
{
    (void)state;
    static struct view view;
    struct rng rng = { .seed = 11 };
    const double step_mm[3] = { 0, 0, 0 };
    fill(&rng, step_mm, &view);
    double flux_w[2] = { 0, 0 };
    for (int i = 0; i < SIDE * SIDE; i++)
        flux_w[view.objects[i] > 1] += (double)view.texels[4 * i + 3];
    struct render_light_samples samples = { .count = 0 };
    const struct render_light_target target = {
        .samples = &samples, .spacing_mm = 1, .cell_mm = 8, .origin_mm = { -4, -4, -4 }
    };
    const struct render_light_target targets[2] = { target, target };
    const struct render_light_view reduced = view_of(&view);
    assert_true(render_cell_samples_append(targets, &reduced, NULL));
    assert_int_equal(samples.count, 16); /* eight cubes meet at the world's origin */
    double found_w[2] = { 0, 0 };
    for (size_t i = 0; i < samples.count; i++)
        found_w[samples.samples[i].object > 0] += (double)samples.samples[i].flux_w[0];
    for (int object = 0; object < 2; object++)
        assert_close(found_w[object], flux_w[object], 1e-6, "object %d", object);
    render_light_samples_destroy(&samples);
}

/* Oracle: each object alone. Both have surface in the same cubes, of which the table's search meets one in
 * place of the other every few views. */
static void objects_are_not_taken_for_each_other(void **state)
{
    (void)state;
    static struct view view;
    struct rng rng = { .seed = 12 };
    const double step_mm[3] = { 0, 0, 0 };
    for (int round = 0; round < 200; round++) {
        struct render_light_samples lists[3] = { { .count = 0 } };
        fill(&rng, step_mm, &view);
        for (int i = 0; i < SIDE * SIDE; i += 2) {
            memcpy(view.rest_mm + 4 * (i + 1), view.rest_mm + 4 * i, 4 * sizeof *view.rest_mm);
            view.texels[4 * i + 3] = view.texels[4 * i + 7] = 1;
            view.objects[i] = 1;
            view.objects[i + 1] = 2;
        }
        const struct render_light_view reduced = view_of(&view);
        for (int list = 0; list < 3; list++) { /* object 0, object 1, both */
            struct render_light_target targets[2];
            for (int object = 0; object < 2; object++)
                targets[object] =
                    (struct render_light_target){ .samples =
                                                      list == object || list == 2 ? &lists[list] : NULL,
                                                  .spacing_mm = 1,
                                                  .cell_mm = 0.05,
                                                  .origin_mm = { -4, -4, -4 } };
            assert_true(render_cell_samples_append(targets, &reduced, NULL));
        }
        assert_int_equal(lists[2].count, lists[0].count + lists[1].count);
        for (int list = 0; list < 3; list++)
            render_light_samples_destroy(&lists[list]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(objects_in_the_same_cube_stay_apart),
        cmocka_unit_test(objects_are_not_taken_for_each_other),
        cmocka_unit_test(flux_and_its_middle_are_conserved),
        cmocka_unit_test(samples_move_with_the_surface),
        cmocka_unit_test(what_is_not_lit_gives_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
