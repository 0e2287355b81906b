/*
 * How often intervals hold the truth: one rendered picture of which neither the exposure nor its noise is
 * known, fitted again and again with new noise.
 * usage: bench_fit_coverage SCENE.json PICTURE.exr equal|relative SEED COUNT
 *
 *   equal, relative  noise of 1 % of the mean value over what objects cover, or of each value
 *
 * The scene's light states no brightness; each trial's picture is multiplied by an exposure between 1/10
 * and 10. The search begins where the scene's material is, the truth, multiplied by 1/10 to 10. Prints a
 * line of JSON for each trial: intervals by channels, {"a": sigma_a, "s": sigma_s'}.
 */
#include "cli/cli.h"
#include "fit/fit.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct trial {
    struct io_scene *scene;
    const struct fit_photo *photo;
    const float *clean; /* its pixels without noise */
    struct fit_picture *picture;
    bool is_relative;
    uint64_t seed;
};

static const double noise = 0.01;

/* SplitMix64 */
struct rng {
    uint64_t seed;
};

static uint64_t random_bits(struct rng *rng)
{
    uint64_t z = rng->seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* lo <= value < hi */
static double uniform(struct rng *rng, double lo, double hi)
{
    return lo + (hi - lo) * ((double)(random_bits(rng) >> 11) * 0x1p-53);
}

static double log_uniform(struct rng *rng, double lo, double hi)
{
    return exp(uniform(rng, log(lo), log(hi)));
}

/* A normal random number (Box and Muller). */
static double normal(struct rng *rng)
{
    const double radius = sqrt(-2 * log1p(-uniform(rng, 0, 1)));
    return radius * cos(6.283185307179586 * uniform(rng, 0, 1));
}

/* The mean of a channel over what objects cover. */
static double covered_mean(const struct io_image *image, size_t channel)
{
    double sum = 0, count = 0;
    for (size_t i = 0; i < (size_t)image->width_px * (size_t)image->height_px; i++) {
        if (image->pixels[4 * i + 3] >= 1.0f) {
            sum += (double)image->pixels[4 * i + channel];
            count += 1;
        }
    }
    return sum / fmax(count, 1);
}

static void disturb(struct io_image *image, const struct trial *trial, double exposure, struct rng *rng)
{
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double mean = covered_mean(image, c);
        for (size_t i = 0; i < (size_t)image->width_px * (size_t)image->height_px; i++) {
            float *const value = &image->pixels[4 * i + c];
            const double sigma = noise * (trial->is_relative ? (double)*value : mean);
            *value = (float)(exposure * ((double)*value + sigma * normal(rng)));
        }
    }
}

static void print_interval(const char *name, const struct fit_interval *interval)
{
    printf("\"%s\": {\"value\": %.9g, \"ci95\": [%.9g, %.9g]}", name, interval->value, interval->ci95[0],
           fmin(interval->ci95[1], 1e300));
}

static void print_trial(const struct trial *trial, double exposure, const struct fit_result *result,
                        double seconds)
{
    printf("{\"seed\": %llu, \"exposure\": %.9g, \"converged\": %s, ", (unsigned long long)trial->seed,
           exposure, result->has_converged ? "true" : "false");
    print_interval("gain", &result->estimates.gains[0]);
    printf(", \"channels\": [");
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        printf("%s{", c > 0 ? ", " : "");
        print_interval("a", &result->estimates.channels[c].sigma_a_per_mm);
        printf(", ");
        print_interval("s", &result->estimates.channels[c].sigma_s_prime_per_mm);
        printf(", \"identifiable\": %s}", result->estimates.channels[c].is_identifiable ? "true" : "false");
    }
    printf("], \"seconds\": %.3g}\n", seconds);
    fflush(stdout);
}

static void init_form(const struct io_scene *scene, struct rng *rng, struct fit_form *form)
{
    *form = (struct fit_form){ .model = DIPOLE_MODEL_DIPOLE,
                               .channel_count = FIT_CHANNEL_COUNT,
                               .layer_count = 1 };
    memcpy(form->layers, scene->objects[0].material.layers, sizeof form->layers);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        form->layers[c][0].medium.sigma_a_per_mm *= log_uniform(rng, 0.1, 10);
        form->layers[c][0].medium.sigma_s_prime_per_mm *= log_uniform(rng, 0.1, 10);
    }
}

/* New noise, and a fit. The picture is drawn anew each time, but by one renderer. */
static bool run_trial(const struct trial *trial, dipole_status *status)
{
    struct rng rng = { .seed = trial->seed };
    struct fit_form form;
    struct fit_result result;
    const double exposure = log_uniform(&rng, 0.1, 10);
    const double start_s = cli_now_s();
    struct io_image *const image = trial->photo->image;
    init_form(trial->scene, &rng, &form);
    memcpy(image->pixels, trial->clean,
           4 * (size_t)image->width_px * (size_t)image->height_px * sizeof *image->pixels);
    disturb(image, trial, exposure, &rng);
    const struct fit_request fit = { .form = &form, .pictures = &trial->picture, .picture_count = 1 };
    if (!fit_run(&fit, &result, status))
        return false;
    print_trial(trial, exposure, &result, cli_now_s() - start_s);
    fit_result_destroy(&result);
    return true;
}

static bool run_trials(struct trial *trial, const char *path, uint64_t count, dipole_status *status)
{
    struct fit_photo photo;
    if (!fit_photo_read(path, false, 1, &photo, status))
        return false;
    const size_t size =
        4 * (size_t)photo.image->width_px * (size_t)photo.image->height_px * sizeof *photo.image->pixels;
    float *const clean = malloc(size);
    const struct fit_picture_request request = {
        .scene = trial->scene, .photo = &photo, .photo_path = path, .is_gain_free = true
    };
    bool is_done = photo.image->channel_count == 4 && clean
                       ? fit_picture_create(&request, &trial->picture, status)
                       : dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s has no alpha, or no memory", path);
    if (is_done)
        memcpy(clean, photo.image->pixels, size);
    trial->photo = &photo;
    trial->clean = clean;
    for (const uint64_t end = trial->seed + count; is_done && trial->seed < end; trial->seed++)
        is_done = run_trial(trial, status);
    fit_picture_destroy(trial->picture);
    fit_photo_destroy(&photo);
    free(clean);
    trial->photo = NULL;
    trial->clean = NULL;
    return is_done;
}

int main(int argc, char **argv)
{
    if (argc != 6) {
        fprintf(stderr, "usage: bench_fit_coverage SCENE.json PICTURE.exr equal|relative SEED COUNT\n");
        return EXIT_USAGE;
    }
    const struct io_scene_options options = { .camera_name = NULL };
    struct trial trial = { .is_relative = strcmp(argv[3], "relative") == 0,
                           .seed = strtoull(argv[4], NULL, 10) };
    dipole_status status;
    const bool is_done = io_scene_read(argv[1], &options, &trial.scene, &status) &&
                         run_trials(&trial, argv[2], strtoull(argv[5], NULL, 10), &status);
    io_scene_destroy(trial.scene);
    if (is_done)
        return EXIT_DONE;
    fprintf(stderr, "bench_fit_coverage: %s\n", status.message);
    return EXIT_FAILED;
}
