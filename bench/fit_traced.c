/*
 * A picture that no diffusion model made: the one convex body of a scene by Monte Carlo
 * (tests/path_tracer.h), as an EXR that says nothing about itself.
 * usage: bench_fit_traced SCENE.json sphere|box radiosity|exact PHOTONS SEED PICTURE.exr
 *
 * The body is what the scene's box holds, the light its first, the medium its material with isotropic
 * scattering. Prints the median standard error of the pixels that are above a hundredth of the brightest,
 * in %.
 */
#include "cli/cli.h"
#include "io/exr.h"
#include "tests/path_tracer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void scene_of(const struct io_scene *scene, bool is_sphere, struct tracer_scene *out)
{
    *out = (struct tracer_scene){ .body = { .kind = is_sphere ? TRACER_SPHERE : TRACER_BOX } };
    for (int a = 0; a < 3; a++) {
        out->body.centre_mm[a] = 0.5 * (scene->min_mm[a] + scene->max_mm[a]);
        out->body.half_size_mm[a] = 0.5 * (scene->max_mm[a] - scene->min_mm[a]);
        out->light.direction[a] = scene->lights[0].direction[a];
        out->light.position_mm[a] = scene->lights[0].position_mm[a];
    }
    out->body.radius_mm = out->body.half_size_mm[1];
    out->light.kind = scene->lights[0].kind == IO_LIGHT_POINT ? TRACER_POINT : TRACER_DIRECTIONAL;
}

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Median of error/value over bright pixels; scratch: count. */
static double median_error(const float *values, const float *errors, size_t count, double *scratch)
{
    double brightest = 0;
    size_t bright = 0;
    for (size_t i = 0; i < count; i++)
        brightest = fmax(brightest, (double)values[i]);
    for (size_t i = 0; i < count; i++) {
        if ((double)values[i] > 0.01 * brightest)
            scratch[bright++] = (double)errors[i] / (double)values[i];
    }
    qsort(scratch, bright, sizeof *scratch, compare);
    return bright > 0 ? scratch[bright / 2] : 0;
}

static bool trace(const struct io_scene *scene, struct tracer_scene *traced, size_t photon_count,
                  uint64_t seed, struct io_image *image, dipole_status *status)
{
    const size_t count = (size_t)image->width_px * (size_t)image->height_px;
    float *const radiance = malloc(2 * count * sizeof *radiance);
    double *const scratch = malloc(count * sizeof *scratch);
    bool is_done = radiance && scratch;
    if (!is_done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a picture");
    for (size_t c = 0; is_done && c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &scene->objects[0].material.layers[c][0].medium;
        traced->medium = (struct tracer_medium){ .sigma_a_per_mm = medium->sigma_a_per_mm,
                                                 .sigma_s_per_mm = medium->sigma_s_prime_per_mm,
                                                 .eta = medium->eta };
        traced->light.strength = scene->lights[0].rgb[c];
        is_done = tracer_picture(traced, photon_count, seed + c, 0, radiance, radiance + count, status);
        for (size_t i = 0; is_done && i < count; i++)
            image->pixels[IO_CHANNEL_COUNT * i + c] = radiance[i];
        if (is_done)
            printf("%s%.2f", c > 0 ? ", " : "",
                   100 * median_error(radiance, radiance + count, count, scratch));
    }
    printf("\n");
    free(scratch);
    free(radiance);
    return is_done;
}

int main(int argc, char **argv)
{
    if (argc != 7) {
        fprintf(stderr, "usage: bench_fit_traced SCENE.json sphere|box radiosity|exact PHOTONS SEED "
                        "PICTURE.exr\n");
        return EXIT_USAGE;
    }
    const struct io_scene_options options = { .camera_name = NULL };
    struct io_scene *scene = NULL;
    struct io_image *image = NULL;
    struct tracer_scene traced;
    struct tracer_view view;
    dipole_status status;
    bool is_done = io_scene_read(argv[1], &options, &scene, &status);
    if (is_done) {
        scene_of(scene, strcmp(argv[2], "sphere") == 0, &traced);
        view = (struct tracer_view){ .camera = scene->camera,
                                     .estimator = strcmp(argv[3], "exact") == 0 ? TRACER_NEXT_EVENT
                                                                                : TRACER_RADIOSITY };
        traced.view = &view;
    }
    is_done =
        is_done &&
        io_image_create(scene->camera.width_px, scene->camera.height_px, IO_CHANNEL_COUNT, &image,
                        &status) &&
        trace(scene, &traced, (size_t)strtod(argv[4], NULL), strtoull(argv[5], NULL, 10), image, &status) &&
        io_exr_write(argv[6], image, false, &status);
    io_image_destroy(image);
    io_scene_destroy(scene);
    if (is_done)
        return EXIT_DONE;
    fprintf(stderr, "bench_fit_traced: %s\n", status.message);
    return EXIT_FAILED;
}
