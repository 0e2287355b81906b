/*
 * What accuracy costs in time: one scene drawn at falling epsilon, each picture against the all-pairs sum
 * in double precision over light samples half as far apart as the finest picture's, without truncation and
 * without the light mirrored at the surface.
 * usage: bench_render SCENE.json [ALLOWED FOLDER]; prints a Markdown table.
 */
#include "renderer/render.h"
#include "cli/cli.h"

#include <math.h>
#include <stdlib.h>

enum { REFERENCE_PIXELS = 400 };

struct reference {
    size_t count;
    size_t pixel[REFERENCE_PIXELS];
    double rgb[REFERENCE_PIXELS][IO_CHANNEL_COUNT];
};

/* Radiance at pixels spread over the object: exit x sum over all samples + specular. */
static void reference_fill(const struct render_capture *capture, const dipole_coefficients *coefficients,
                           struct reference *reference)
{
    const size_t pixel_count = (size_t)capture->width_px * (size_t)capture->height_px;
    size_t covered = 0, next = 0;
    for (size_t i = 0; i < pixel_count; i++)
        covered += capture->coverage[i] >= 1.0f;
    reference->count = 0;
    for (size_t i = 0, seen = 0; i < pixel_count && reference->count < REFERENCE_PIXELS; i++) {
        if (capture->coverage[i] < 1.0f || seen++ < next)
            continue;
        next = (reference->count + 1) * covered / REFERENCE_PIXELS;
        double radiosity[IO_CHANNEL_COUNT] = { 0 };
        const float *const x = capture->position_mm + 3 * i;
        for (size_t k = 0; k < capture->samples.count; k++) {
            const struct render_light_sample *const s = &capture->samples.samples[k];
            const double dx = x[0] - s->position_mm[0], dy = x[1] - s->position_mm[1],
                         dz = x[2] - s->position_mm[2];
            const double r_mm = sqrt(dx * dx + dy * dy + dz * dz);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                radiosity[c] += s->flux_w[c] * dipole_rd_per_mm2(&coefficients[c], r_mm);
        }
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            reference->rgb[reference->count][c] =
                capture->exit_per_sr[i] * radiosity[c] + capture->specular[3 * i + (size_t)c];
        reference->pixel[reference->count++] = i;
    }
}

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Relative RMSE over the pixels, and the 99th percentile of |L - L_ref|/L_ref. */
static void errors(const struct io_image *image, const struct reference *reference, double *rmse,
                   double *weber)
{
    static double relative[REFERENCE_PIXELS * IO_CHANNEL_COUNT];
    double difference2 = 0.0, reference2 = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < reference->count; i++)
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double expected = reference->rgb[i][c];
            const double d = image->pixels[4 * reference->pixel[i] + (size_t)c] - expected;
            difference2 += d * d;
            reference2 += expected * expected;
            relative[count++] = fabs(d) / expected;
        }
    qsort(relative, count, sizeof relative[0], compare);
    *rmse = sqrt(difference2 / reference2);
    *weber = relative[(size_t)(0.99 * (double)(count - 1))];
}

static bool run(const char *path, const struct io_scene_options *options, dipole_status *status)
{
    static const double epsilons[] = { 0.1, 0.03, 0.01, 0.003, 0.001 };
    struct io_scene *scene = NULL;
    struct renderer *renderer = NULL;
    struct render_capture *capture = NULL;
    static struct reference reference;
    dipole_coefficients coefficients[IO_CHANNEL_COUNT];
    double spacing_mm = INFINITY;
    bool is_done = io_scene_read(path, options, &scene, status);
    for (size_t i = 0; is_done && i < scene->object_count; i++)
        scene->objects[i].has_specular =
            false; /* a glint at a shadow's edge would outweigh what is measured */
    is_done = is_done && render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, status);
    for (int c = 0; is_done && c < IO_CHANNEL_COUNT; c++) {
        is_done = dipole_coefficients_init(&scene->objects[0].material.layers[c][0].medium,
                                           &coefficients[c], status);
        if (is_done && coefficients[c].alpha_prime > 0.0)
            spacing_mm = fmin(spacing_mm, dipole_splat_spacing_mm(&coefficients[c], 1e-3));
    }
    is_done = is_done && render_capture_create(renderer, 0.5 * spacing_mm, &capture, status);
    if (is_done) {
        reference_fill(capture, coefficients, &reference);
        printf("| asked | predicted | relative RMSE | 99th percentile | samples | ms | lambert ms |\n"
               "|---|---|---|---|---|---|---|\n");
    }
    for (size_t i = 0; is_done && i < sizeof epsilons / sizeof epsilons[0]; i++) {
        struct render_options draw = { .technique = RENDER_TECHNIQUE_LAMBERT, .epsilon = epsilons[i] };
        struct render_report plain, report;
        struct io_image *image = NULL;
        is_done = render_draw(renderer, &draw, &image, &plain, status);
        io_image_destroy(image);
        image = NULL;
        draw.technique = RENDER_TECHNIQUE_SPLAT;
        is_done = is_done && render_draw(renderer, &draw, &image, &report, status);
        if (is_done) {
            double rmse, weber;
            errors(image, &reference, &rmse, &weber);
            printf("| %g | %.2g | %.2g | %.2g | %zu | %.0f | %.0f |\n", epsilons[i], report.error_predicted,
                   rmse, weber, report.sample_count, report.total_ms, plain.total_ms);
            fflush(stdout);
        }
        io_image_destroy(image);
    }
    render_capture_destroy(capture);
    render_destroy(renderer);
    io_scene_destroy(scene);
    return is_done;
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: bench_render SCENE.json [ALLOWED FOLDER]\n");
        return EXIT_USAGE;
    }
    const char *const allowed[] = { argc > 2 ? argv[2] : "" };
    const struct io_scene_options options = {
        .allowed_paths = allowed, .allowed_path_count = argc > 2, .width_px = 400, .height_px = 300
    };
    dipole_status status;
    if (run(argv[1], &options, &status))
        return EXIT_DONE;
    fprintf(stderr, "bench_render: %s\n", status.message);
    return EXIT_FAILED;
}
