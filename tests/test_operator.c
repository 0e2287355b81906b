#include "fit_scenes.h"

#include <string.h>

enum { PIXELS = 400, SAMPLES = 700, FEW_SAMPLES = 6 };

/* What interpolation may change, operator.h; and clusters of samples on top, clusters.h. So few samples are
 * not put together. */
static const double interpolation_error = 1e-4, cluster_error = 1e-3;

static double predicted(const struct fit_operator *op, const dipole_coefficients *coefficients, int channel,
                        size_t pixel)
{
    const double *row = fit_operator_row(op, channel, pixel);
    double sum = 0.0;
    for (size_t k = 0; k < op->node_count; k++)
        sum += row[k] * dipole_rd_per_mm2(coefficients, op->node_r_mm[k]);
    return op->colour[channel] * sum;
}

/* Relative differences to the direct sum: the largest over the pixels that are lit at all brightly, and
 * that of the sum over all pixels. */
struct difference {
    double worst, sum;
};

static struct difference compare(const struct fit_scene *scene, const struct fit_operator *op,
                                 const dipole_coefficients *coefficients, int channel)
{
    double direct[PIXELS], brightest = 0, sums[2] = { 0, 0 };
    struct difference found = { 0 };
    for (size_t j = 0; j < PIXELS; j++) {
        direct[j] = direct_radiosity(scene, coefficients, channel, j);
        brightest = fmax(brightest, direct[j]);
    }
    for (size_t j = 0; j < PIXELS; j++) {
        const double value = predicted(op, coefficients, channel, j);
        if (direct[j] > 1e-4 * brightest)
            found.worst = fmax(found.worst, fabs(value / direct[j] - 1));
        sums[0] += direct[j];
        sums[1] += value;
    }
    found.sum = sums[0] > 0 ? fabs(sums[1] / sums[0] - 1) : 0;
    return found;
}

static double worst_error(const struct fit_scene *scene, const struct fit_operator *op,
                          const dipole_coefficients *coefficients, int channel)
{
    return compare(scene, op, coefficients, channel).worst;
}

/* Largest differences over random spheres of random media. */
static struct difference sweep(size_t sample_count)
{
    struct rng rng = { .seed = 1 };
    struct difference worst = { 0 };
    for (int i = 0; i < 60; i++) {
        const double finest_mm = log_uniform(&rng, 0.02, 1.0);
        const double mean_free_path_mm = finest_mm * log_uniform(&rng, 1.0, 100.0);
        /* 700 samples are 0.1 to 2 mean free paths apart */
        struct fit_scene scene;
        fit_scene_sphere(&scene, mean_free_path_mm * log_uniform(&rng, 1.0, 20.0), PIXELS, sample_count);
        scene.geometry.finest_mm = finest_mm;
        const double absorbed = log_uniform(&rng, 1e-6, 0.9);
        const dipole_medium medium = { .sigma_a_per_mm = absorbed / mean_free_path_mm,
                                       .sigma_s_prime_per_mm = (1.0 - absorbed) / mean_free_path_mm,
                                       .eta = uniform(&rng, 1.0, 1.6) };
        dipole_coefficients coefficients;
        assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
        struct fit_operator *op;
        assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
        const struct difference found = compare(&scene, op, &coefficients, 0);
        worst.worst = fmax(worst.worst, found.worst);
        worst.sum = fmax(worst.sum, found.sum);
        fit_operator_destroy(op);
        fit_scene_free(&scene);
    }
    print_message("largest difference to the direct sum %.2g, of a whole picture %.2g\n", worst.worst,
                  worst.sum);
    return worst;
}

/* Oracle: the sum over all pairs, R_d evaluated at each distance. Tolerance: what operator.h promises. */
static void interpolation_agrees_with_the_direct_sum(void **state)
{
    (void)state;
    assert_true(sweep(FEW_SAMPLES).worst <= interpolation_error);
}

/* Oracle: the same of samples that are put together. Tolerances: what clusters.h promises, of a pixel and
 * of all. */
static void operator_agrees_with_the_direct_sum(void **state)
{
    (void)state;
    const struct difference found = sweep(SAMPLES);
    assert_true(found.worst <= cluster_error);
    assert_true(found.sum <= 1e-4);
}

/* Oracle: the direct sum. Twice as many nodes bring interpolation by six points nearer by 2^6 in the limit,
 * by 4 at least from so few on, down to what bins err by. */
static void more_nodes_are_nearer(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 0.01, .sigma_s_prime_per_mm = 1.0, .eta = 1.3 };
    dipole_coefficients coefficients;
    struct fit_scene scene;
    double before = INFINITY;
    assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
    fit_scene_sphere(&scene, 10.0, PIXELS, FEW_SAMPLES);
    scene.geometry.finest_mm = 0.5;
    for (int nodes = 1; nodes <= 16; nodes *= 2) {
        struct fit_operator *op;
        scene.geometry.nodes_per_octave = nodes;
        assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
        const double worst = worst_error(&scene, op, &coefficients, 0);
        print_message("  %d nodes an octave, %zu in all: %.2g\n", nodes, op->node_count, worst);
        assert_true(worst <= fmax(before / 4, interpolation_error));
        before = worst;
        fit_operator_destroy(op);
    }
    fit_scene_free(&scene);
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

/* Oracle: the direct sum, channel by channel, under lights whose colours are multiples of one and under two
 * of different colours, one of which ends within the picture. Where it ends a cluster's points have the
 * mean of both, which costs single pixels more: 1 %; of the whole, 1e-4. */
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
            scene.samples[i].flux_w[2] *=
                colours == 2 && scene.samples[i].position_mm[0] > 1.0f ? 3.0f : 0.0f;
        }
        struct fit_operator *op;
        assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
        assert_int_equal(op->set_count, colours == 1 ? 1 : 3);
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            const struct difference found = compare(&scene, op, &coefficients, c);
            assert_true(found.worst <= (colours == 1 ? cluster_error : 1e-2));
            assert_true(found.sum <= 1e-4);
        }
        if (colours == 1)
            assert_close(predicted(op, &coefficients, 2, 0), 0.0, 0.0, "a channel without light");
        fit_operator_destroy(op);
        fit_scene_free(&scene);
    }
}

/* Oracle: the direct sum over the samples of the pixel's own object; so few that none are put
 * together. 1e-3: dark pixels count as well. */
static void light_stays_in_its_object(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 0.05, .sigma_s_prime_per_mm = 2.0, .eta = 1.3 };
    dipole_coefficients coefficients;
    struct fit_scene scene;
    struct fit_operator *op;
    int objects[PIXELS];
    assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
    fit_scene_sphere(&scene, 8.0, PIXELS, FEW_SAMPLES);
    scene.geometry.finest_mm = 0.3;
    scene.geometry.objects = objects;
    for (size_t j = 0; j < PIXELS; j++)
        objects[j] = (int)(j % 3); /* the last has no light */
    for (size_t i = 0; i < FEW_SAMPLES; i++)
        scene.samples[i].object = (float)(i % 2);
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    for (int object = 0; object < 3; object++) {
        struct render_light_sample own[FEW_SAMPLES];
        struct fit_scene alone = scene;
        alone.samples = own;
        alone.geometry.sample_count = 0;
        for (size_t i = 0; i < FEW_SAMPLES; i++) {
            if (scene.samples[i].object == (float)object)
                own[alone.geometry.sample_count++] = scene.samples[i];
        }
        for (size_t j = (size_t)object; j < PIXELS; j += 3)
            assert_close(predicted(op, &coefficients, 0, j), direct_radiosity(&alone, &coefficients, 0, j),
                         cluster_error, "object %d, pixel %zu", object, j);
    }
    fit_operator_destroy(op);
    fit_scene_free(&scene);
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
        cmocka_unit_test(interpolation_agrees_with_the_direct_sum),
        cmocka_unit_test(operator_agrees_with_the_direct_sum),
        cmocka_unit_test(more_nodes_are_nearer),
        cmocka_unit_test(light_beyond_the_cut_is_left_out),
        cmocka_unit_test(light_of_many_colours_takes_a_set_each),
        cmocka_unit_test(light_stays_in_its_object),
        cmocka_unit_test(operator_is_the_same_bit_for_bit),
        cmocka_unit_test(a_scene_too_large_for_its_detail_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
