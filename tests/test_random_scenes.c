/* Random scenes through the plan: whatever a scene file may say, a plan is finite, bounded and can be run.
 * With an argument, a seed, that scene alone. */
#include "random_scenes.h"

#include <time.h>

#if defined(__SANITIZE_ADDRESS__)
enum { SCENE_COUNT = 1500 };
#elif defined(__SANITIZE_THREAD__)
enum { SCENE_COUNT = 300 };
#else
enum { SCENE_COUNT = 10000 };
#endif

static const struct random_shares shares = { .slow = 0.05, .wild = 0.5 };

static uint64_t only_seed;

#define assert_plan(condition)                                                                             \
    do {                                                                                                   \
        if (!(condition))                                                                                  \
            fail_msg("seed %llu: %s is false", (unsigned long long)seed, #condition);                      \
    } while (0)

static bool is_finite_vector(const double v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static void check_projection(const struct render_projection *projection, uint64_t seed)
{
    float matrix[16];
    render_projection_matrix(projection, matrix);
    for (int i = 0; i < 16; i++)
        assert_plan(isfinite(matrix[i]));
    assert_plan(is_finite_vector(projection->eye_mm) && is_finite_vector(projection->right) &&
                is_finite_vector(projection->up) && is_finite_vector(projection->forward));
    assert_plan(projection->half_width > 0 && projection->half_height > 0);
    assert_plan(projection->far_mm > projection->near_mm);
    assert_plan(projection->is_orthographic || projection->near_mm > 0);
}

static void check_views(const struct render_plan *plan, uint64_t seed)
{
    const size_t of_light = plan->shadows.object_count > 0 ? 12 * plan->media->object_count : 6;
    assert_plan(plan->view_count <= of_light * plan->lit_count);
    for (size_t i = 0; i < plan->view_count; i++) {
        const struct render_plan_view *const view = &plan->views[i];
        check_projection(&view->projection, seed);
        assert_plan(view->size_px >= 1 && view->size_px <= 4096);
        assert_plan(view->block_px >= 1 && view->block_px <= 128);
        assert_plan(isfinite(view->texel_area) && view->texel_area > 0);
    }
}

static void check_media(const struct render_plan *plan, uint64_t seed)
{
    for (size_t m = 0; m < plan->media->count; m++) {
        const struct render_plan_medium *const medium = &plan->of_medium[m];
        assert_plan(isfinite(medium->diameter_mm) && isfinite(medium->r_max_mm) &&
                    isfinite(medium->spacing_mm));
        assert_plan(medium->r_max_mm >= 0 && medium->spacing_mm >= 0);
        assert_plan(isfinite(medium->truncation_error) && isfinite(medium->aliasing_error) &&
                    isfinite(medium->blur_error) && isfinite(medium->table_error));
        assert_plan(medium->band_count >= 0 && medium->band_count <= RENDER_BAND_LIMIT);
        assert_plan(is_finite_vector(medium->blur_mm));
        for (int b = 0; b < medium->band_count; b++)
            assert_plan(medium->bands[b].spacing_mm > 0 && isfinite(medium->bands[b].r_outer_mm));
    }
}

/* Every texture that a pass needs is written before it: render_plan_add_passes has checked it, so a plan
 * that was made has at least the surface and what becomes the picture. */
static void check_passes(const struct random_scene *random, const struct render_plan *plan)
{
    const uint64_t seed = random->seed;
    assert_plan(plan->pass_count >= 3);
    for (size_t i = 0; i < plan->pass_count; i++) {
        assert_plan(plan->passes[i].pass != NULL);
        assert_plan(!plan->passes[i].pass->is_per_view || plan->passes[i].view < plan->view_count);
        assert_plan(plan->decisions[plan->passes[i].effect].is_active);
    }
    assert_plan(render_plan_writes(plan, random->is_captured ? "capture" : "radiance"));
    assert_plan(render_plan_writes(plan, "display") == (random->is_tone_mapped && !random->is_captured));
}

static void check_plan(const struct random_scene *random, const struct render_plan *plan)
{
    const uint64_t seed = random->seed;
    check_projection(&plan->camera, seed);
    check_views(plan, seed);
    check_media(plan, seed);
    check_passes(random, plan);
    assert_plan(plan->technique != RENDER_TECHNIQUE_AUTO);
    assert_plan(plan->error_predicted >= 0);
    assert_plan(isfinite(plan->error_predicted) || plan->technique == RENDER_TECHNIQUE_TSM);
    assert_plan(plan->table_epsilon >= LUT_EPSILON_MIN);
    assert_plan(isfinite(plan->r_max_mm) && plan->r_max_mm >= 0);
    assert_plan(isfinite(plan->r_max_px) && plan->r_max_px >= 0);
    assert_plan(isfinite(plan->spacing_mm) && plan->spacing_mm > 0);
    assert_plan(isfinite(plan->pixel_mm) && plan->pixel_mm > 0);
    for (size_t i = 0; i < random->scene.object_count; i++)
        assert_plan(isfinite(plan->objects[i].ball.radius_mm) && isfinite(plan->objects[i].spacing_mm));
}

/* Oracle: what a plan promises (plan.h). It is made, or the failure has a documented code and a message. */
static void a_random_scene_is_planned_or_refused(void **state)
{
    (void)state;
    size_t made_count = 0;
    const uint64_t first = only_seed ? only_seed : 1, count = only_seed ? 1 : SCENE_COUNT;
    for (uint64_t seed = first; seed < first + count; seed++) {
        struct random_scene random;
        random_scene_init(&random, seed, &shares);
        const struct render_request request = random_scene_request(&random);
        struct render_plan *plan = NULL;
        dipole_status status = { .code = DIPOLE_OK };
        const clock_t start = clock();
        if (render_plan_create(&request, &plan, &status)) {
            check_plan(&random, plan);
            made_count++;
        } else {
            assert_plan(!plan && status.message[0] != '\0');
            assert_plan(status.code == DIPOLE_BAD_VALUE || status.code == DIPOLE_NOT_SUPPORTED ||
                        status.code == DIPOLE_OUT_OF_MEMORY);
            print_message("  seed %llu: %s\n", (unsigned long long)seed, status.message);
        }
        if (only_seed)
            print_message("  %.0f ms\n", 1e3 * (double)(clock() - start) / CLOCKS_PER_SEC);
        render_plan_destroy(plan);
        random_scene_end(&random);
    }
    print_message("  %zu of %llu scenes were planned\n", made_count, (unsigned long long)count);
    assert_true((double)made_count >= 0.95 * (double)count || only_seed);
}

int main(int argc, char **argv)
{
    only_seed = argc > 1 ? strtoull(argv[1], NULL, 10) : 0;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_random_scene_is_planned_or_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
