#include "fit/estimate.h"

#include "fit/internal.h"
#include "fit_scenes.h"

#include <string.h>

enum { PIXELS = 600, SAMPLES = 900 };

static struct fit_measurement measure(const struct fit_scene *scene, double scale_error, double tile_error)
{
    return (struct fit_measurement){ .radiosity_w_per_mm2 = scene->radiosity_w_per_mm2,
                                     .tiles = scene->tiles,
                                     .tile_count = FIT_SCENE_TILES,
                                     .scale_error = scale_error,
                                     .tile_error = tile_error };
}

/* A sphere of a medium: a few tens of mean free paths, no more than a few diffuse ones. */
static void draw_sphere(struct fit_scene *scene, const dipole_medium *medium, double finest_mm)
{
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(medium, &coefficients, NULL));
    const double thick_mm = fmin(2.0 / coefficients.sigma_tr_per_mm, 30.0 * coefficients.mean_free_path_mm);
    fit_scene_sphere(scene, fmax(thick_mm, 4.0 * coefficients.mean_free_path_mm), PIXELS, SAMPLES);
    scene->geometry.finest_mm = finest_mm;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        fit_scene_draw(scene, medium, c);
}

static const dipole_medium marble_red = { .sigma_a_per_mm = 0.0021,
                                          .sigma_s_prime_per_mm = 2.19,
                                          .eta = 1.5 };

/* Oracle: Ceres' numeric derivative of the residuals. 1e-5: what its steps resolve. */
static void jacobian_of_a_channel_is_right(void **state)
{
    (void)state;
    struct rng rng = { .seed = 4 };
    struct fit_scene scene;
    draw_sphere(&scene, &marble_red, 0.1);
    const struct fit_measurement measurement = measure(&scene, 0.0, 0.0);
    struct fit_operator *op;
    struct fit_channel_system system;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    assert_true(fit_channel_system_init(op, 0, &measurement, &marble_red, &system, NULL));
    const struct fit_least_squares problem = { .residuals = fit_channel_residuals,
                                               .context = &system,
                                               .residual_count = op->node_count + 1,
                                               .parameter_count = 2 };
    for (int i = 0; i < 20; i++) {
        const double point[] = { log(log_uniform(&rng, 1e-4, 3.0)), log(log_uniform(&rng, 0.1, 5.0)) };
        const double error = fit_least_squares_jacobian_error(&problem, point);
        if (error > 1e-5)
            print_error("case %d: error %g at sigma_a %g, sigma_s' %g\n", i, error, exp(point[0]),
                        exp(point[1]));
        assert_true(error <= 1e-5);
    }
    fit_channel_system_destroy(&system);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* Residuals of all pixels, without folding. */
struct unfolded {
    const struct fit_operator *op;
    const struct fit_channel_system *system;
    const struct fit_scene *scene;
};

static bool unfolded_residuals(const void *context, const double *parameters, double *residuals,
                               double *jacobian)
{
    const struct unfolded *all = context;
    const dipole_medium medium = { .sigma_a_per_mm = exp(parameters[0]),
                                   .sigma_s_prime_per_mm = exp(parameters[1]),
                                   .eta = all->system->eta };
    dipole_coefficients coefficients;
    if (!dipole_coefficients_init(&medium, &coefficients, NULL))
        return false;
    for (size_t j = 0; j < all->op->pixel_count; j++) {
        const double b = (double)all->scene->radiosity_w_per_mm2[3 * j];
        const double weight = 1.0 / (b + all->system->floor_w_per_mm2) / sqrt((double)all->op->pixel_count);
        double sums[3] = { -b, 0.0, 0.0 };
        for (size_t k = 0; k < all->op->node_count; k++) {
            const double h = fit_operator_row(all->op, 0, j)[k], r_mm = all->op->node_r_mm[k];
            const dipole_gradient gradient = dipole_rd_gradient(&coefficients, r_mm);
            sums[0] += h * dipole_rd_per_mm2(&coefficients, r_mm);
            sums[1] += h * gradient.d_log_sigma_a;
            sums[2] += h * gradient.d_log_sigma_s_prime;
        }
        residuals[j] = weight * sums[0];
        if (jacobian) {
            jacobian[2 * j] = weight * sums[1];
            jacobian[2 * j + 1] = weight * sums[2];
        }
    }
    return true;
}

/* Oracle: the same problem with a residual for every pixel, on a noisy picture so that something is left
 * over. 1e-6: what is promised; the two differ by rounding. */
static void folding_does_not_change_the_answer(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    struct fit_scene scene;
    draw_sphere(&scene, &marble_red, 0.1);
    for (size_t i = 0; i < 3 * PIXELS; i++)
        scene.radiosity_w_per_mm2[i] *= (float)uniform(&rng, 0.9, 1.1);
    const struct fit_measurement measurement = measure(&scene, 0.0, 0.0);
    struct fit_operator *op;
    struct fit_channel_system system;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    assert_true(fit_channel_system_init(op, 0, &measurement, &marble_red, &system, NULL));
    const struct unfolded all = { .op = op, .system = &system, .scene = &scene };
    struct fit_least_squares problem = { .residuals = fit_channel_residuals,
                                         .context = &system,
                                         .residual_count = op->node_count + 1,
                                         .parameter_count = 2,
                                         .lower = { -20.0, -20.0 },
                                         .upper = { 2.0, 2.0 } };
    const double start[] = { log(0.01), log(1.0) };
    struct fit_minimum folded, unfolded;
    assert_true(fit_least_squares_solve(&problem, start, &folded, NULL));
    problem.residuals = unfolded_residuals;
    problem.context = &all;
    problem.residual_count = op->pixel_count;
    assert_true(fit_least_squares_solve(&problem, start, &unfolded, NULL));
    for (int p = 0; p < 2; p++)
        assert_true(fabs(folded.parameters[p] - unfolded.parameters[p]) <= 1e-6);
    assert_close(folded.sum_of_squares, unfolded.sum_of_squares, 1e-6, "sum of squares");
    fit_channel_system_destroy(&system);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* Coefficients in 1/mm, Jensen et al. 2001, red, green, blue; eta 1.3, marble 1.5. */
struct measured {
    const char *name;
    double sigma_a_per_mm[3], sigma_s_prime_per_mm[3], eta;
};
static const struct measured measured[] = {
    { "apple", { 0.0030, 0.0034, 0.046 }, { 2.29, 2.39, 1.97 }, 1.3 },
    { "chicken1", { 0.015, 0.077, 0.19 }, { 0.15, 0.21, 0.38 }, 1.3 },
    { "chicken2", { 0.018, 0.088, 0.20 }, { 0.19, 0.25, 0.32 }, 1.3 },
    { "cream", { 0.0002, 0.0028, 0.0163 }, { 7.38, 5.47, 3.15 }, 1.3 },
    { "ketchup", { 0.061, 0.97, 1.45 }, { 0.18, 0.07, 0.03 }, 1.3 },
    { "marble", { 0.0021, 0.0041, 0.0071 }, { 2.19, 2.62, 3.00 }, 1.5 },
    { "potato", { 0.0024, 0.0090, 0.12 }, { 0.68, 0.70, 0.55 }, 1.3 },
    { "skimmilk", { 0.0014, 0.0025, 0.0142 }, { 0.70, 1.22, 1.90 }, 1.3 },
    { "skin1", { 0.032, 0.17, 0.48 }, { 0.74, 0.88, 1.01 }, 1.3 },
    { "skin2", { 0.013, 0.070, 0.145 }, { 1.09, 1.59, 1.79 }, 1.3 },
    { "wholemilk", { 0.0011, 0.0024, 0.014 }, { 2.55, 3.21, 3.77 }, 1.3 },
};

static bool lies_within(double value, const double interval[2])
{
    return interval[0] <= value && value <= interval[1];
}

/* Oracle: the coefficients that the picture, a direct sum, was made with; the search starts ten times off,
 * up and down. 0.2 %: the operator's 1e-4 in brightness is ten times that in sigma_a. */
static void coefficients_come_back_from_an_exact_picture(void **state)
{
    (void)state;
    double worst = 0.0;
    for (size_t m = 0; m < sizeof measured / sizeof *measured; m++) {
        for (int c = 0; c < 3; c++) {
            const dipole_medium truth = { .sigma_a_per_mm = measured[m].sigma_a_per_mm[c],
                                          .sigma_s_prime_per_mm = measured[m].sigma_s_prime_per_mm[c],
                                          .eta = measured[m].eta };
            struct fit_scene scene;
            const double finest_mm = 0.3 / (truth.sigma_a_per_mm + truth.sigma_s_prime_per_mm);
            draw_sphere(&scene, &truth, finest_mm);
            const struct fit_measurement measurement = measure(&scene, 1e-4, 1e-4);
            struct fit_operator *op;
            assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
            dipole_medium start = truth;
            start.sigma_a_per_mm *= c % 2 ? 10.0 : 0.1;
            start.sigma_s_prime_per_mm *= m % 2 ? 10.0 : 0.1;
            struct fit_estimate estimate;
            assert_true(fit_estimate_channel(op, c, &measurement, &start, finest_mm, &estimate, NULL));
            const char *name = measured[m].name;
            assert_true(estimate.has_converged);
            assert_true(estimate.is_identifiable);
            assert_close(estimate.sigma_a_per_mm, truth.sigma_a_per_mm, 2e-3, "%s %d sigma_a", name, c);
            assert_close(estimate.sigma_s_prime_per_mm, truth.sigma_s_prime_per_mm, 2e-3, "%s %d sigma_s'",
                         name, c);
            assert_true(lies_within(truth.sigma_a_per_mm, estimate.sigma_a_ci95));
            assert_true(lies_within(truth.sigma_s_prime_per_mm, estimate.sigma_s_prime_ci95));
            worst = fmax(worst, fabs(estimate.sigma_a_per_mm / truth.sigma_a_per_mm - 1.0));
            fit_operator_destroy(op);
            fit_scene_free(&scene);
        }
    }
    print_message("largest relative error of sigma_a %.2g\n", worst);
}

/* A standard normal deviate (Box and Muller). */
static double normal(struct rng *rng)
{
    const double radius = sqrt(-2.0 * log(1.0 - uniform(rng, 0.0, 1.0)));
    return radius * cos(6.283185307179586 * uniform(rng, 0.0, 1.0));
}

/* Oracle: the stated probability. Noise of every kind that the intervals claim to cover is drawn anew for
 * each of 100 pictures; 95 % of the intervals should hold the truth. Fewer than 88 would happen to
 * 95 % intervals once in 700 times, more than all never: they must not be far too wide either, so the
 * deviations are compared with the stated widths as well (root mean square of z: 1, +- 0.25). */
static void intervals_hold_the_truth_as_often_as_they_say(void **state)
{
    (void)state;
    enum { TRIALS = 100 };
    const double scale_error = 0.003, offset_error = 0.002, tile_error = 0.004, pixel_error = 0.03;
    struct rng rng = { .seed = 6 };
    struct fit_scene scene;
    draw_sphere(&scene, &marble_red, 0.1);
    struct fit_operator *op;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    float *exact = malloc(3 * PIXELS * sizeof *exact);
    assert_non_null(exact);
    memcpy(exact, scene.radiosity_w_per_mm2, 3 * PIXELS * sizeof *exact);
    double mean = 0.0;
    for (size_t j = 0; j < PIXELS; j++)
        mean += (double)exact[3 * j] / PIXELS;
    int held[2] = { 0, 0 };
    double z2[2] = { 0.0, 0.0 };
    for (int trial = 0; trial < TRIALS; trial++) {
        double tiles[FIT_SCENE_TILES];
        for (int t = 0; t < FIT_SCENE_TILES; t++)
            tiles[t] = 1.0 + tile_error * normal(&rng);
        const double scale = 1.0 + scale_error * normal(&rng);
        const double offset = offset_error * mean * normal(&rng);
        for (size_t j = 0; j < PIXELS; j++)
            scene.radiosity_w_per_mm2[3 * j] =
                (float)(offset + (double)exact[3 * j] * scale * tiles[scene.tiles[j]] *
                                     (1.0 + pixel_error * normal(&rng)));
        /* what varies from tile to tile shows in the residuals; what is common to all does not */
        struct fit_measurement measurement = measure(&scene, scale_error, 0.0);
        measurement.offset_error = offset_error;
        struct fit_estimate estimate;
        assert_true(fit_estimate_channel(op, 0, &measurement, &marble_red, 0.1, &estimate, NULL));
        held[0] += lies_within(marble_red.sigma_a_per_mm, estimate.sigma_a_ci95);
        held[1] += lies_within(marble_red.sigma_s_prime_per_mm, estimate.sigma_s_prime_ci95);
        const double found[] = { estimate.sigma_a_per_mm, estimate.sigma_s_prime_per_mm };
        const double true_values[] = { marble_red.sigma_a_per_mm, marble_red.sigma_s_prime_per_mm };
        const double *intervals[] = { estimate.sigma_a_ci95, estimate.sigma_s_prime_ci95 };
        for (int p = 0; p < 2; p++) {
            const double deviation = log(intervals[p][1] / intervals[p][0]) / 2.0 / 1.96;
            z2[p] += pow(log(found[p] / true_values[p]) / deviation, 2.0) / TRIALS;
        }
    }
    print_message("truth held %d and %d times of %d; z %.2f and %.2f\n", held[0], held[1], TRIALS,
                  sqrt(z2[0]), sqrt(z2[1]));
    for (int p = 0; p < 2; p++) {
        assert_true(held[p] >= 88);
        assert_true(sqrt(z2[p]) > 0.75 && sqrt(z2[p]) < 1.25);
    }
    free(exact);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* The middle of a large flat face, evenly lit: a square grid of samples 0.5 mm apart, 100 x 100. */
static void flat_face(struct fit_scene *scene, const dipole_medium *medium)
{
    enum { SIDE = 100 };
    struct rng rng = { .seed = 7 };
    fit_scene_allocate(scene, PIXELS, SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int column = i % SIDE - SIDE / 2, row = i / SIDE - SIDE / 2;
        scene->samples[i].position_mm[0] = 0.5f * (float)column;
        scene->samples[i].position_mm[1] = 0.5f * (float)row;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            scene->samples[i].flux_w[c] = 0.25f;
    }
    for (size_t j = 0; j < PIXELS; j++) {
        for (int a = 0; a < 2; a++)
            scene->positions_mm[3 * j + (size_t)a] = (float)uniform(&rng, -4.0, 4.0);
        scene->tiles[j] =
            (int)(4.0f + scene->positions_mm[3 * j]) + 8 * (int)(4.0f + scene->positions_mm[3 * j + 1]);
    }
    scene->geometry.finest_mm = 0.3;
    fit_scene_draw(scene, medium, 0);
}

/* Oracle: scale invariance. On an endless face R_d integrates to a function of alpha' alone, so sigma_a and
 * sigma_s' may grow together; alpha' itself is found. */
static void an_even_face_tells_only_the_albedo(void **state)
{
    (void)state;
    const dipole_medium truth = { .sigma_a_per_mm = 0.03, .sigma_s_prime_per_mm = 0.97, .eta = 1.3 };
    struct fit_scene scene;
    flat_face(&scene, &truth);
    const struct fit_measurement measurement = measure(&scene, 0.002, 0.002);
    struct fit_operator *op;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    dipole_medium start = truth;
    start.sigma_a_per_mm *= 2.0;
    start.sigma_s_prime_per_mm *= 0.7;
    struct fit_estimate estimate;
    assert_true(fit_estimate_channel(op, 0, &measurement, &start, 0.3, &estimate, NULL));
    assert_false(estimate.is_identifiable);
    assert_non_null(strstr(estimate.note, "only the albedo"));
    const double albedo =
        estimate.sigma_s_prime_per_mm / (estimate.sigma_a_per_mm + estimate.sigma_s_prime_per_mm);
    assert_close(albedo, 0.97, 2e-3, "albedo");
    assert_true(lies_within(truth.sigma_a_per_mm, estimate.sigma_a_ci95));
    assert_true(lies_within(truth.sigma_s_prime_per_mm, estimate.sigma_s_prime_ci95));
    assert_true(estimate.sigma_a_ci95[1] > 2.0 * estimate.sigma_a_ci95[0]);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* Oracle: spectralon absorbs nothing; an upper bound is all there is to find, and pictures with less and
 * with more absorption than it agree with it. */
static void no_absorption_gives_an_upper_bound(void **state)
{
    (void)state;
    const dipole_medium truth = { .sigma_a_per_mm = 0.0, .sigma_s_prime_per_mm = 11.6, .eta = 1.3 };
    struct fit_scene scene;
    fit_scene_sphere(&scene, 2.0, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 0.03;
    fit_scene_draw(&scene, &truth, 0);
    const struct fit_measurement measurement = measure(&scene, 0.002, 0.002);
    struct fit_operator *op;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    const dipole_medium start = { .sigma_a_per_mm = 0.1, .sigma_s_prime_per_mm = 1.0, .eta = 1.3 };
    struct fit_estimate estimate;
    assert_true(fit_estimate_channel(op, 0, &measurement, &start, 0.03, &estimate, NULL));
    assert_false(estimate.is_identifiable);
    assert_non_null(strstr(estimate.note, "may be anything up to"));
    const double most_per_mm = estimate.sigma_a_ci95[1];
    assert_true(lies_within(11.6, estimate.sigma_s_prime_ci95));
    assert_close(estimate.sigma_s_prime_per_mm, 11.6, 0.01, "sigma_s'");

    /* a third of what may hide does hide; three times as much shows */
    dipole_medium more = truth;
    more.sigma_a_per_mm = most_per_mm / 3.0;
    fit_scene_draw(&scene, &more, 0);
    assert_true(fit_estimate_channel(op, 0, &measurement, &start, 0.03, &estimate, NULL));
    assert_false(estimate.is_identifiable);
    assert_true(lies_within(more.sigma_a_per_mm, estimate.sigma_a_ci95));
    more.sigma_a_per_mm = most_per_mm * 3.0;
    fit_scene_draw(&scene, &more, 0);
    assert_true(fit_estimate_channel(op, 0, &measurement, &start, 0.03, &estimate, NULL));
    assert_true(estimate.is_identifiable);
    assert_true(lies_within(more.sigma_a_per_mm, estimate.sigma_a_ci95));
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* Oracle: nothing can be learnt from a channel without light; the start stands, finite and unsure. */
static void a_dark_channel_tells_nothing(void **state)
{
    (void)state;
    struct fit_scene scene;
    fit_scene_sphere(&scene, 5.0, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 0.1;
    const struct fit_measurement measurement = measure(&scene, 0.002, 0.002); /* the picture is black */
    struct fit_operator *op;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    struct fit_estimate estimate;
    assert_true(fit_estimate_channel(op, 0, &measurement, &marble_red, 0.1, &estimate, NULL));
    assert_false(estimate.is_identifiable);
    assert_true(strlen(estimate.note) > 0);
    assert_close(estimate.sigma_a_per_mm, marble_red.sigma_a_per_mm, 0.0, "start");
    assert_true(isfinite(estimate.sigma_a_ci95[1]) && estimate.sigma_a_ci95[0] < estimate.sigma_a_ci95[1]);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

/* Oracle: the range of eta in dipole.h. */
static void a_start_that_is_no_medium_is_refused(void **state)
{
    (void)state;
    struct fit_scene scene;
    fit_scene_sphere(&scene, 5.0, PIXELS, SAMPLES);
    scene.geometry.finest_mm = 0.1;
    const struct fit_measurement measurement = measure(&scene, 0.0, 0.0);
    struct fit_operator *op;
    assert_true(fit_operator_create(&scene.geometry, NULL, &op, NULL));
    dipole_medium start = marble_red;
    start.eta = -1.0;
    struct fit_estimate estimate;
    dipole_status status;
    assert_false(fit_estimate_channel(op, 0, &measurement, &start, 0.1, &estimate, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    fit_operator_destroy(op);
    fit_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jacobian_of_a_channel_is_right),
        cmocka_unit_test(folding_does_not_change_the_answer),
        cmocka_unit_test(coefficients_come_back_from_an_exact_picture),
        cmocka_unit_test(intervals_hold_the_truth_as_often_as_they_say),
        cmocka_unit_test(an_even_face_tells_only_the_albedo),
        cmocka_unit_test(no_absorption_gives_an_upper_bound),
        cmocka_unit_test(a_dark_channel_tells_nothing),
        cmocka_unit_test(a_start_that_is_no_medium_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
