#include "fit_scenes.h"

#include <string.h>

enum { PIXELS = 400, SAMPLES = 700 };

static double predicted(const struct fit_operator *op, const dipole_coefficients *coefficients, int channel,
                        size_t pixel)
{
    const double *row = fit_operator_row(op, channel, pixel);
    double sum = 0.0;
    for (size_t k = 0; k < op->node_count; k++)
        sum += row[k] * dipole_rd_per_mm2(coefficients, op->node_r_mm[k]);
    return op->colour[channel] * sum;
}

/* Largest relative difference to the direct sum over the pixels that are lit at all brightly. */
static double worst_error(const struct fit_scene *scene, const struct fit_operator *op,
                          const dipole_coefficients *coefficients, int channel)
{
    double direct[PIXELS], brightest = 0.0, worst = 0.0;
    for (size_t j = 0; j < PIXELS; j++) {
        direct[j] = direct_radiosity(scene, coefficients, channel, j);
        brightest = fmax(brightest, direct[j]);
    }
    for (size_t j = 0; j < PIXELS; j++) {
        if (direct[j] > 1e-4 * brightest)
            worst = fmax(worst, fabs(predicted(op, coefficients, channel, j) / direct[j] - 1.0));
    }
    return worst;
}

/* Oracle: the sum over all pairs, R_d evaluated at each distance. Tolerance: what operator.h promises. */
static void operator_agrees_with_the_direct_sum(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    double worst = 0.0;
    for (int i = 0; i < 60; i++) {
        const double finest_mm = log_uniform(&rng, 0.02, 1.0);
        const double mean_free_path_mm = finest_mm * log_uniform(&rng, 1.0, 100.0);
        /* samples 0.1 to 2 mean free paths apart */
        struct fit_scene scene;
        fit_scene_sphere(&scene, mean_free_path_mm * log_uniform(&rng, 1.0, 20.0), PIXELS, SAMPLES);
        scene.geometry.finest_mm = finest_mm;
        const double absorbed = log_uniform(&rng, 1e-6, 0.9);
        const dipole_medium medium = { .sigma_a_per_mm = absorbed / mean_free_path_mm,
                                       .sigma_s_prime_per_mm = (1.0 - absorbed) / mean_free_path_mm,
                                       .eta = uniform(&rng, 1.0, 1.6) };
        dipole_coefficients coefficients;
        assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
        struct fit_operator *op;
        assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
        const double error = worst_error(&scene, op, &coefficients, 0);
        if (error > 1e-4)
            print_error("case %d: error %g, sigma_a %g, sigma_s' %g, finest %g\n", i, error,
                        medium.sigma_a_per_mm, medium.sigma_s_prime_per_mm, scene.geometry.finest_mm);
        assert_true(error <= 1e-4);
        worst = fmax(worst, error);
        fit_operator_destroy(op);
        fit_scene_free(&scene);
    }
    print_message("largest difference to the direct sum %.2g\n", worst);
}

/* Oracle: the direct sum that leaves out pairs farther apart than the cut. A pair within float rounding of
 * the cut may fall on either side: one pair's share at the cut, 1e-4 of the sum, is the tolerance. */
static void light_beyond_the_cut_is_left_out(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 0.01, .sigma_s_prime_per_mm = 1.0, .eta = 1.3 };
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
    struct fit_scene scene;
    fit_scene_sphere(&scene, 10.0, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 0.5;
    struct fit_operator *whole, *cut;
    assert_true(fit_operator_create(&scene.geometry, NULL, &whole, NULL));
    scene.geometry.cut_mm = 6.0;
    assert_true(fit_operator_create(&scene.geometry, NULL, &cut, NULL));
    assert_true(worst_error(&scene, cut, &coefficients, 0) <= 1e-4);
    assert_true(worst_error(&scene, whole, &coefficients, 0) > 1e-2);
    fit_operator_destroy(whole);
    fit_operator_destroy(cut);
    fit_scene_free(&scene);
}

/* Oracle: the direct sum, channel by channel, under two lights of different colours and under lights whose
 * colours are multiples of one. */
static void light_of_many_colours_takes_a_set_each(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 0.05, .sigma_s_prime_per_mm = 2.0, .eta = 1.3 };
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
    for (int colours = 1; colours <= 2; colours++) {
        struct fit_scene scene;
        fit_scene_sphere(&scene, 8.0, PIXELS, SAMPLES);
        scene.geometry.finest_mm = 0.3;
        for (size_t i = 0; i < SAMPLES; i++) {
            scene.samples[i].flux_w[1] *= 0.5f;
            scene.samples[i].flux_w[2] *= colours == 2 && i % 2 ? 3.0f : 0.0f;
        }
        struct fit_operator *op;
        assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
        assert_int_equal(op->set_count, colours == 1 ? 1 : 3);
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            assert_true(worst_error(&scene, op, &coefficients, c) <= 1e-4);
        if (colours == 1)
            assert_close(predicted(op, &coefficients, 2, 0), 0.0, 0.0, "a channel without light");
        fit_operator_destroy(op);
        fit_scene_free(&scene);
    }
}

/* Oracle: itself; rows are shared between threads as they come, the numbers must not depend on it. */
static void operator_is_the_same_bit_for_bit(void **state)
{
    (void)state;
    struct fit_scene scene;
    fit_scene_sphere(&scene, 8.0, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 0.3;
    struct fit_operator *one, *two;
    assert_true(fit_operator_create(&scene.geometry, NULL, &one, NULL));
    assert_true(fit_operator_create(&scene.geometry, NULL, &two, NULL));
    assert_memory_equal(one->rows, two->rows, PIXELS * one->node_count * sizeof(double));
    fit_operator_destroy(one);
    fit_operator_destroy(two);
    fit_scene_free(&scene);
}

/* Oracle: the stated range of the axis. */
static void a_scene_too_large_for_its_detail_is_refused(void **state)
{
    (void)state;
    struct fit_scene scene;
    fit_scene_sphere(&scene, 1e6, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 1e-4;
    struct fit_operator *op;
    dipole_status status;
    assert_false(fit_operator_create(&scene.geometry, NULL, &op, &status));
    assert_null(op);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    fit_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(operator_agrees_with_the_direct_sum),
        cmocka_unit_test(light_beyond_the_cut_is_left_out),
        cmocka_unit_test(light_of_many_colours_takes_a_set_each),
        cmocka_unit_test(operator_is_the_same_bit_for_bit),
        cmocka_unit_test(a_scene_too_large_for_its_detail_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
