#include "fit/clusters.h"

#include "check.h"

#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 4000, RECEIVERS = 60 };

/* A point of a bumpy closed surface about 10 mm large, or of a box of thin sheets. */
static void surface_point(struct rng *rng, int kind, float position_mm[3])
{
    const double z = uniform(rng, -1, 1), angle_rad = uniform(rng, 0, 6.283185307179586);
    const double across = sqrt(1 - z * z);
    double p[3] = { across * cos(angle_rad), across * sin(angle_rad), z };
    if (kind == 0) {
        const double radius = 5 * (1 + 0.3 * sin(4 * p[0]) * cos(5 * p[1] + 2 * p[2]));
        for (int a = 0; a < 3; a++)
            p[a] *= radius;
    } else {
        for (int a = 0; a < 3; a++)
            p[a] = uniform(rng, -5, 5);
        p[kind % 3] = (double)((int)uniform(rng, 0, 3)) - 1;
    }
    for (int a = 0; a < 3; a++)
        position_mm[a] = (float)p[a];
}

/* Light that falls on one side and is patchy, in three colours. */
static void random_samples(struct rng *rng, int kind, struct render_light_sample *samples, size_t count)
{
    const double tone = uniform(rng, 0, 3);
    for (size_t i = 0; i < count; i++) {
        float *const at = samples[i].position_mm;
        surface_point(rng, kind, at);
        const double light = fmax((double)at[2], 0) * (1.1 + sin((double)at[0] + tone));
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            samples[i].flux_w[c] = (float)(light * (1 + 0.5 * c));
    }
}

static double distance_mm(const float *position_mm, double x, double y, double z)
{
    return hypot(hypot((double)position_mm[0] - x, (double)position_mm[1] - y), (double)position_mm[2] - z);
}

/* Kernels like the dipole's: its power law, and its fading. */
static double kernel(int which, double r_mm)
{
    return which == 0 ? pow(1 + r_mm * r_mm, -1.5) : exp(-r_mm) / (0.01 + r_mm * r_mm);
}

static double kernel_over_samples(int which, const struct render_light_sample *samples, size_t count,
                                  const float *position_mm, int channel)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const float *const at = samples[i].position_mm;
        sum += (double)samples[i].flux_w[channel] *
               kernel(which, distance_mm(position_mm, (double)at[0], (double)at[1], (double)at[2]));
    }
    return sum;
}

static double kernel_over_points(int which, const struct fit_points *points, const float *position_mm,
                                 int channel)
{
    double sum = 0;
    for (size_t i = 0; i < points->count; i++)
        sum += (double)points->flux_w[channel][i] *
               kernel(which, distance_mm(position_mm, (double)points->x[i], (double)points->y[i],
                                         (double)points->z[i]));
    return sum;
}

/* Oracle: the direct sum over all samples. 1e-3 of each receiver that is lit at all brightly, 1e-4 of the
 * sum over all receivers: what clusters.h says, whose errors have either sign. */
static void what_arrives_is_the_direct_sum(void **state)
{
    (void)state;
    struct rng rng = { .seed = 51 };
    struct render_light_sample *const samples = calloc(SAMPLES, sizeof *samples);
    assert_non_null(samples);
    double worst[2] = { 0, 0 }, worst_sum[2] = { 0, 0 }, share = 0;
    for (int trial = 0; trial < 12; trial++) {
        struct fit_clusters *clusters;
        struct fit_points points = { 0 };
        random_samples(&rng, trial % 4, samples, SAMPLES);
        assert_true(fit_clusters_create(samples, SAMPLES, -1, &clusters, NULL));
        for (int which = 0; which < 2; which++) {
            double sums[2] = { 0, 0 }, found[RECEIVERS], direct[RECEIVERS], brightest = 0;
            for (int j = 0; j < RECEIVERS; j++) {
                float at_mm[3];
                surface_point(&rng, trial % 4, at_mm);
                assert_true(fit_clusters_collect(clusters, at_mm, &points));
                found[j] = kernel_over_points(which, &points, at_mm, j % 3);
                direct[j] = kernel_over_samples(which, samples, SAMPLES, at_mm, j % 3);
                sums[0] += direct[j];
                sums[1] += found[j];
                brightest = fmax(brightest, direct[j]);
                share += (double)points.count / SAMPLES / (2.0 * RECEIVERS * 12);
            }
            for (int j = 0; j < RECEIVERS; j++) {
                if (direct[j] > 1e-3 * brightest)
                    worst[which] = fmax(worst[which], fabs(found[j] / direct[j] - 1));
            }
            worst_sum[which] = fmax(worst_sum[which], fabs(sums[1] / sums[0] - 1));
        }
        fit_points_destroy(&points);
        fit_clusters_destroy(clusters);
    }
    print_message("largest errors %.2g, %.2g; of sums %.2g, %.2g; points %.0f %% of samples\n", worst[0],
                  worst[1], worst_sum[0], worst_sum[1], 100 * share);
    for (int which = 0; which < 2; which++)
        assert_true(worst[which] < 1e-3 && worst_sum[which] < 1e-4);
    assert_true(share < 0.9);
    free(samples);
}

/* Flux, mean and second moments about the origin, all by brightness. */
struct moments {
    double flux_w[3], mean_mm[3], square_mm2[3][3];
};

static void moments_add(struct moments *all, const double at_mm[3], const double flux_w[3])
{
    const double brightness = flux_w[0] + flux_w[1] + flux_w[2];
    for (int a = 0; a < 3; a++) {
        all->flux_w[a] += flux_w[a];
        all->mean_mm[a] += brightness * at_mm[a];
        for (int b = 0; b < 3; b++)
            all->square_mm2[a][b] += brightness * at_mm[a] * at_mm[b];
    }
}

/* Oracle: the sums over the samples themselves; from far away one cluster stands for all. 1e-5 of the
 * largest: points are floats. */
static void a_cluster_keeps_flux_mean_and_second_moments(void **state)
{
    (void)state;
    static const float far_mm[3] = { 1000, 200, -300 };
    struct rng rng = { .seed = 52 };
    struct render_light_sample samples[500];
    for (int trial = 0; trial < 40; trial++) {
        const size_t count = trial < 10 ? (size_t)trial + 1 : 500;
        struct fit_clusters *clusters;
        struct fit_points points = { 0 };
        struct moments expected = { { 0 }, { 0 }, { { 0 } } }, found = { { 0 }, { 0 }, { { 0 } } };
        random_samples(&rng, trial % 4, samples, count);
        for (size_t i = 0; i < count; i++) {
            samples[i].flux_w[0] += 0.1f; /* some light on each */
            double at_mm[3], flux_w[3];
            for (int a = 0; a < 3; a++) {
                at_mm[a] = (double)samples[i].position_mm[a];
                flux_w[a] = (double)samples[i].flux_w[a];
            }
            moments_add(&expected, at_mm, flux_w);
        }
        assert_true(fit_clusters_create(samples, count, -1, &clusters, NULL));
        assert_true(fit_clusters_collect(clusters, far_mm, &points));
        assert_int_equal(points.count, count > 6 ? 6 : count);
        for (size_t i = 0; i < points.count; i++) {
            const double at_mm[3] = { (double)points.x[i], (double)points.y[i], (double)points.z[i] };
            const double flux_w[3] = { (double)points.flux_w[0][i], (double)points.flux_w[1][i],
                                       (double)points.flux_w[2][i] };
            moments_add(&found, at_mm, flux_w);
        }
        const double all_w = expected.flux_w[0] + expected.flux_w[1] + expected.flux_w[2];
        for (int a = 0; a < 3; a++) {
            assert_close(found.flux_w[a], expected.flux_w[a], 1e-5, "flux, trial %d", trial);
            assert_true(fabs(found.mean_mm[a] - expected.mean_mm[a]) < 1e-5 * 10 * all_w);
            for (int b = 0; b < 3; b++)
                assert_true(fabs(found.square_mm2[a][b] - expected.square_mm2[a][b]) < 1e-5 * 100 * all_w);
        }
        fit_points_destroy(&points);
        fit_clusters_destroy(clusters);
    }
}

/* Oracle: near the samples nothing is put together: the points are the samples, in some order. */
static void near_samples_stand_for_themselves(void **state)
{
    (void)state;
    struct rng rng = { .seed = 53 };
    struct render_light_sample samples[200];
    struct fit_clusters *clusters;
    struct fit_points points = { 0 };
    for (size_t i = 0; i < 200; i++) {
        for (int a = 0; a < 3; a++)
            samples[i].position_mm[a] = (float)uniform(&rng, -1, 1);
        for (int c = 0; c < 3; c++)
            samples[i].flux_w[c] = (float)(i + 1);
    }
    static const float middle_mm[3] = { 0, 0, 0 };
    assert_true(fit_clusters_create(samples, 200, -1, &clusters, NULL));
    assert_true(fit_clusters_collect(clusters, middle_mm, &points));
    bool is_seen[201] = { false };
    assert_int_equal(points.count, 200);
    for (size_t i = 0; i < 200; i++) {
        const size_t which = (size_t)(points.flux_w[1][i] + 0.5f);
        assert_in_range(which, 1, 200);
        assert_false(is_seen[which]);
        is_seen[which] = true;
        assert_true(points.x[i] == samples[which - 1].position_mm[0]);
        assert_true(points.z[i] == samples[which - 1].position_mm[2]);
    }
    fit_points_destroy(&points);
    fit_clusters_destroy(clusters);
}

/* Oracle: flux is kept whatever the positions: one sample, all in one place, on a line, without any light.
 */
static void degenerate_samples_keep_their_flux(void **state)
{
    (void)state;
    static const float receivers_mm[3][3] = { { 0, 0, 0 }, { 1, 2, 3 }, { 500, 0, 0 } };
    static const size_t counts[] = { 1, 2, 6, 7, 8, 9, 100, 3000 };
    struct render_light_sample *const samples = calloc(3000, sizeof *samples);
    assert_non_null(samples);
    for (size_t n = 0; n < sizeof counts / sizeof *counts; n++) {
        for (int kind = 0; kind < 4; kind++) {
            struct fit_clusters *clusters;
            struct fit_points points = { 0 };
            for (size_t i = 0; i < counts[n]; i++) {
                samples[i] = (struct render_light_sample){ .position_mm = { 1, 2, 3 } };
                if (kind == 1)
                    samples[i].position_mm[0] += (float)i;
                if (kind == 2)
                    samples[i].position_mm[2] = i % 2 ? 3.0f : 4.0f;
                for (int c = 0; c < 3 && kind != 3; c++)
                    samples[i].flux_w[c] = 0.5f;
            }
            assert_true(fit_clusters_create(samples, counts[n], -1, &clusters, NULL));
            for (int j = 0; j < 3; j++) {
                double sum = 0;
                assert_true(fit_clusters_collect(clusters, receivers_mm[j], &points));
                assert_in_range(points.count, 1, counts[n]);
                for (size_t i = 0; i < points.count; i++) {
                    sum += (double)points.flux_w[2][i];
                    assert_true(isfinite(points.x[i]) && isfinite(points.y[i]) && isfinite(points.z[i]));
                }
                assert_close(sum, kind == 3 ? 0 : 0.5 * (double)counts[n], 1e-5, "kind %d", kind);
            }
            fit_points_destroy(&points);
            fit_clusters_destroy(clusters);
        }
    }
    free(samples);
}

/* Oracle: a tree of the object's samples alone; of an object that has none nothing is seen. */
static void objects_are_apart(void **state)
{
    (void)state;
    struct rng rng = { .seed = 54 };
    struct render_light_sample samples[300], own[300];
    static const float far_mm[3] = { 30, 0, 0 }, near_mm[3] = { 1, 2, 3 };
    size_t count = 0;
    random_samples(&rng, 0, samples, 300);
    for (size_t i = 0; i < 300; i++) {
        samples[i].object = (float)(i % 3);
        if (i % 3 == 1)
            own[count++] = samples[i];
    }
    struct fit_clusters *one, *alone, *none;
    struct fit_points found = { 0 }, expected = { 0 };
    assert_true(fit_clusters_create(samples, 300, 1, &one, NULL));
    assert_true(fit_clusters_create(own, count, -1, &alone, NULL));
    assert_true(fit_clusters_create(samples, 300, 7, &none, NULL));
    for (int i = 0; i < 2; i++) {
        const float *const at_mm = i ? far_mm : near_mm;
        assert_true(fit_clusters_collect(one, at_mm, &found));
        assert_true(fit_clusters_collect(alone, at_mm, &expected));
        assert_int_equal(found.count, expected.count);
        assert_memory_equal(found.x, expected.x, found.count * sizeof(float));
        assert_memory_equal(found.flux_w[2], expected.flux_w[2], found.count * sizeof(float));
        assert_true(fit_clusters_collect(none, at_mm, &found));
        assert_int_equal(found.count, 0);
    }
    fit_points_destroy(&found);
    fit_points_destroy(&expected);
    fit_clusters_destroy(one);
    fit_clusters_destroy(alone);
    fit_clusters_destroy(none);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_arrives_is_the_direct_sum),
        cmocka_unit_test(a_cluster_keeps_flux_mean_and_second_moments),
        cmocka_unit_test(near_samples_stand_for_themselves),
        cmocka_unit_test(degenerate_samples_keep_their_flux),
        cmocka_unit_test(objects_are_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
