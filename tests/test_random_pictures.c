/* Random scenes through OpenGL: no pixel that is not a number, no error, no leak (asan), bounded work.
 * Arguments: a seed, that scene alone; or the first seed and how many. */
#include "random_scenes.h"

#include "renderer/renderer.h"

#include <float.h>
#include <time.h>

#if defined(__SANITIZE_ADDRESS__)
enum { SCENE_COUNT = 40 };
#elif defined(__SANITIZE_THREAD__)
enum { SCENE_COUNT = 10 };
#else
enum { SCENE_COUNT = 130 };
#endif

static const struct random_shares shares = { .slow = 0.05, .wild = 0.02 };

static uint64_t first_seed = 1, seed_count = SCENE_COUNT;
static bool is_alone;

#define assert_scene(condition, ...)                                                                       \
    do {                                                                                                   \
        if (!(condition)) {                                                                                \
            print_error("seed %llu: ", (unsigned long long)seed);                                          \
            fail_msg(__VA_ARGS__);                                                                         \
        }                                                                                                  \
    } while (0)

static void check_numbers(const float *values, size_t count, float limit, uint64_t seed, const char *what)
{
    for (size_t i = 0; i < count; i++)
        assert_scene(values[i] >= 0 && values[i] <= limit, "%s %zu is %g", what, i, (double)values[i]);
}

/* Premultiplied radiance, or what a screen shows. */
static void check_picture(const struct io_image *image, bool is_tone_mapped, uint64_t seed)
{
    const size_t pixel_count = (size_t)image->width_px * (size_t)image->height_px;
    for (size_t i = 0; i < pixel_count; i++) {
        check_numbers(image->pixels + 4 * i, 3, is_tone_mapped ? 1 : FLT_MAX, seed, "channel");
        check_numbers(image->pixels + 4 * i + 3, 1, 1, seed, "alpha");
    }
}

static void check_capture(const struct render_capture *captured, uint64_t seed)
{
    const size_t pixel_count = (size_t)captured->width_px * (size_t)captured->height_px;
    for (size_t i = 0; i < 3 * pixel_count; i++)
        assert_scene(isfinite(captured->position_mm[i]), "position %zu", i);
    check_numbers(captured->coverage, pixel_count, 1, seed, "coverage");
    check_numbers(captured->exit_per_sr, pixel_count, FLT_MAX, seed, "exit");
    check_numbers(captured->specular, 3 * pixel_count, FLT_MAX, seed, "specular");
    for (size_t i = 0; i < captured->samples.count; i++) {
        const struct render_light_sample *const sample = &captured->samples.samples[i];
        check_numbers(sample->flux_w, 3, FLT_MAX, seed, "flux");
        check_numbers(&sample->footprint_mm, 1, FLT_MAX, seed, "footprint");
        for (int k = 0; k < 3; k++)
            assert_scene(isfinite(sample->position_mm[k]), "sample %zu", i);
    }
}

static bool draw(const struct random_scene *random, struct render_report *report, dipole_status *status)
{
    struct renderer *renderer = NULL;
    struct io_image *image = NULL;
    struct render_capture *captured = NULL;
    const struct render_options options = { .technique = random->technique,
                                            .area = random->area,
                                            .epsilon = random->epsilon,
                                            .is_tone_mapped = random->is_tone_mapped };
    bool done = render_create(&random->scene, RENDER_CONTEXT_DEFAULT, &renderer, status);
    if (done && random->is_captured && renderer->media->count == 1) {
        done = render_capture_create(renderer, random->spacing_mm, &captured, status);
        if (done)
            check_capture(captured, random->seed);
    } else if (done) {
        done = render_draw(renderer, &options, &image, report, status);
        if (done)
            check_picture(image, random->is_tone_mapped, random->seed);
    }
    render_capture_destroy(captured);
    io_image_destroy(image);
    render_destroy(renderer);
    return done;
}

/* Oracle: what a picture is. */
static void a_random_scene_is_drawn_or_refused(void **state)
{
    (void)state;
    size_t drawn_count = 0;
    for (uint64_t seed = first_seed; seed < first_seed + seed_count; seed++) {
        struct random_scene random;
        struct render_report report = { 0 };
        dipole_status status = { .code = DIPOLE_OK };
        random_scene_init(&random, seed, &shares);
        const clock_t start = clock();
        const bool is_drawn = draw(&random, &report, &status);
        drawn_count += is_drawn;
        if (is_alone)
            print_message("  %zu samples in %d bands, %zu splats, %zu views, %.0f ms\n",
                          report.sample_count, report.band_count, report.splat_count, report.view_count,
                          1e3 * (double)(clock() - start) / CLOCKS_PER_SEC);
        if (!is_drawn) {
            print_message("  seed %llu: %s\n", (unsigned long long)seed, status.message);
            assert_scene(status.code == DIPOLE_BAD_VALUE || status.code == DIPOLE_NOT_SUPPORTED ||
                             status.code == DIPOLE_NOT_CONVERGED || status.code == DIPOLE_OUT_OF_MEMORY,
                         "code %d", status.code);
            assert_scene(!strstr(status.message, "OpenGL error"), "%s", status.message);
        }
        random_scene_end(&random);
    }
    print_message("  %zu of %llu scenes were drawn\n", drawn_count, (unsigned long long)seed_count);
    assert_true((double)drawn_count >= 0.9 * (double)seed_count || is_alone);
}

int main(int argc, char **argv)
{
    is_alone = argc == 2;
    if (argc > 1) {
        first_seed = strtoull(argv[1], NULL, 10);
        seed_count = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_random_scene_is_drawn_or_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
