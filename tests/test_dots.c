/* renderer/plan_budget.c, footprint.c: light samples never show as dots. theory.md T34. */
#include "drawing.h"

#include "renderer/plan.h"
#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

/* Blue's mean free path as told, green's and red's some times as long. */
static struct io_material medium_of(double path_mm, dipole_model model)
{
    struct io_material material = { .name = "narrow", .model = model };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++) {
        const double per_mm = 1 / (path_mm * (3 - c));
        media[c] = (dipole_medium){ .sigma_a_per_mm = 0.2 * per_mm,
                                    .sigma_s_prime_per_mm = 0.8 * per_mm,
                                    .eta = 1.4 };
    }
    io_material_set_media(&material, media);
    return material;
}

/* What is seen of an evenly lit slab: how far radiosity is from what enters times the reflectance. */
struct evenness {
    double darkest, brightest, rms, spacing_mm, blur_mm;
    size_t sample_count;
};

static void measure(struct renderer *renderer, const struct test_scene *test, double epsilon,
                    double spacing_mm, struct evenness *found)
{
    const struct render_request request = { .scene = &test->scene,
                                            .media = renderer->media,
                                            .technique = RENDER_TECHNIQUE_GATHER,
                                            .epsilon = epsilon,
                                            .spacing_mm = spacing_mm };
    const struct io_light *const light = &test->lights[0];
    const int count = test->scene.camera.width_px * test->scene.camera.height_px;
    const double cosine = -light->direction[1];
    const double entering = light->rgb[0] * cosine * (1 - dipole_fresnel_reflectance(1.4, cosine));
    float *const radiosity = malloc(4 * (size_t)count * sizeof *radiosity);
    struct render_plan *plan;
    double time_ms[RENDER_EFFECT_LIMIT];
    dipole_status status;
    if (!render_run(renderer, &request, &plan, time_ms, &status))
        fail_msg("%s", status.message);
    assert_non_null(radiosity);
    assert_true(render_executor_read(renderer->executor, "radiosity", radiosity, NULL));
    *found = (struct evenness){ .darkest = INFINITY,
                                .spacing_mm = plan->spacing_mm,
                                .blur_mm = plan->of_medium[0].blur_mm[2],
                                .sample_count = render_splatter_sample_count(
                                    render_executor_splatter(renderer->executor)) };
    for (int i = 0; i < 4 * count; i++) {
        if (i % 4 == 3)
            continue;
        const double share =
            (double)radiosity[i] / entering / renderer->media->media[0].diffuse_reflectance[i % 4];
        found->darkest = fmin(found->darkest, share);
        found->brightest = fmax(found->brightest, share);
        found->rms += (share - 1) * (share - 1) / (3 * count);
    }
    found->rms = sqrt(found->rms);
    free(radiosity);
    render_plan_destroy(plan);
}

/* An evenly lit slab of that medium, seen from above, wider by margin_mm to each side than what is seen. */
static void slab_init(struct test_scene *test, const struct io_material *material, int width_px,
                      double margin_mm)
{
    scene_init(test, 0);
    assert_true(scene_add(test, IO_PRIMITIVE_SLAB, 8, 0.5 * width_px + margin_mm, 0, material));
    scene_add_directional(test, 0.31, -1, 0.17, 2);
    test->scene.camera = (struct io_camera){ .eye_mm = { 0, 2e5, 0 },
                                             .up = { 0.2, 0, 1 },
                                             .is_orthographic = true,
                                             .height_mm = 6,
                                             .width_px = width_px,
                                             .height_px = 6 };
}

/* Oracle: conservation. Every pixel of an evenly lit slab is as bright as what enters makes it: by epsilon
 * in the root mean square, by two at the worst, whether paths are a hundredth of a pixel or a hundred
 * pixels long, with samples as far apart as the plan sets them or much farther. Pixels are 1 mm apart; the
 * light's grid lies askew. */
static void no_sample_shows(void **state)
{
    (void)state;
    static const double paths_mm[] = { 0.01, 0.1, 1, 10, 100 };
    static const double epsilons[] = { 0.003, 0.01, 0.03, 0.1, 0.3 };
    static const struct {
        double spacing, margin; /* in paths; 0: by the plan */
    } cases[] = { { 0, 60 }, { 3, 60 }, { 30, 250 } };
    for (size_t p = 0; p < sizeof paths_mm / sizeof *paths_mm; p++) {
        const int width_px = paths_mm[p] < 1 ? 8 : paths_mm[p] < 100 ? 64 : 256;
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            const struct io_material material =
                medium_of(paths_mm[p], (p + i) % 2 ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE);
            struct test_scene test;
            slab_init(&test, &material, width_px, cases[i].margin * paths_mm[p]);
            struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
            for (size_t e = 0; e < sizeof epsilons / sizeof *epsilons; e++) {
                struct evenness found;
                measure(renderer, &test, epsilons[e], cases[i].spacing * paths_mm[p], &found);
                print_message("  %-6s path %5g mm, epsilon %5g, %7zu samples %.3g mm apart, blur %.2g mm: "
                              "%+.3f to %+.3f, rms %.3f %%\n",
                              io_model_names[material.model], paths_mm[p], epsilons[e], found.sample_count,
                              found.spacing_mm, found.blur_mm, 100 * (found.darkest - 1),
                              100 * (found.brightest - 1), 100 * found.rms);
                const bool is_coarse = cases[i].spacing > 0;
                const double worst = is_coarse ? epsilons[e] + 0.025 : 2.5 * epsilons[e];
                assert_true(found.rms < epsilons[e] + (is_coarse ? 0.007 : 0));
                assert_true(found.darkest > 1 - worst && found.brightest < 1 + worst);
                assert_true(!is_coarse || found.blur_mm > 0);
            }
            render_destroy(renderer);
            scene_end(&test);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(no_sample_shows) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
