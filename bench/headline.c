/*
 * What scripts/bench_headline needs beside render.
 *
 * usage: bench_headline mask SCENE.json WIDTH HEIGHT OUT.exr [ALLOWED FOLDER]
 *
 * Which pixels are compared: 1 where the pixel and all its neighbours show one surface each, at four points
 * and at 64, so that no edge, neither an outline nor one part of an object before another, is judged by how
 * many points a pixel has.
 *
 * usage: bench_headline errors REFERENCE.exr MASK.exr PICTURE.exr
 *
 * Four numbers in %, over those pixels: relative RMSE; the largest |L - L_ref| of any channel as part of
 * that channel's brightest L_ref; the same of 99.9 % of the values; and the largest |L - L_ref|/L_ref where
 * L_ref is above a hundredth of that brightest.
 *
 * usage: bench_headline plot TABLE.tsv OUT.svg X-TITLE Y-TITLE TITLE SUBTITLE CAPTION [Y-MARK LABEL]
 *
 * Lines of the table: kind (line, thin, points), label or -, colour or -, then pairs of x and y. Both axes
 * are logarithmic.
 */
#include "io/exr.h"
#include "io/file.h"
#include "plot/plot.h"
#include "renderer/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of light samples that nobody looks at. */
#define COARSE_MM 5.0

/* ---- mask --------------------------------------------------------------------------------------- */

/* Pixels are also looked at so many times finer to a side: as many points as the reference has, four times.
 */
enum { FINER = 4 };

/* Clear what is not covered by one surface, or within two pixels of it. */
static void clear_mask(const struct render_capture *capture, int finer, struct io_image *mask)
{
    for (int y = 0; y < capture->height_px; y++) {
        for (int x = 0; x < capture->width_px; x++) {
            if (capture->coverage[(size_t)y * (size_t)capture->width_px + (size_t)x] >= 1)
                continue;
            for (int n = 0; n < 25; n++) {
                const int i = x / finer + n % 5 - 2, j = y / finer + n / 5 - 2;
                if (i >= 0 && j >= 0 && i < mask->width_px && j < mask->height_px)
                    mask->pixels[(size_t)j * (size_t)mask->width_px + (size_t)i] = 0;
            }
        }
    }
}

static bool look_at(char **argv, const char *allowed, int finer, struct io_image *mask,
                    dipole_status *status)
{
    const struct io_scene_options reading = { .allowed_paths = &allowed,
                                              .allowed_path_count = allowed ? 1 : 0,
                                              .width_px = finer * mask->width_px,
                                              .height_px = finer * mask->height_px };
    struct io_scene *scene = NULL;
    struct renderer *renderer = NULL;
    struct render_capture *capture = NULL;
    const bool done = io_scene_read(argv[2], &reading, &scene, status) &&
                      render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, status) &&
                      render_capture_create(renderer, COARSE_MM, &capture, status);
    if (done)
        clear_mask(capture, finer, mask);
    render_capture_destroy(capture);
    render_destroy(renderer);
    io_scene_destroy(scene);
    return done;
}

static bool write_mask(int argc, char **argv, dipole_status *status)
{
    const char *const allowed = argc > 6 ? argv[6] : NULL;
    const int width_px = (int)strtol(argv[3], NULL, 10), height_px = (int)strtol(argv[4], NULL, 10);
    struct io_image *mask = NULL;
    bool done = io_image_create(width_px, height_px, 1, &mask, status);
    for (size_t i = 0; done && i < (size_t)width_px * (size_t)height_px; i++)
        mask->pixels[i] = 1;
    done = done && look_at(argv, allowed, 1, mask, status) && look_at(argv, allowed, FINER, mask, status) &&
           io_exr_write(argv[5], mask, false, status);
    io_image_destroy(mask);
    return done;
}

/* ---- errors ------------------------------------------------------------------------------------- */

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

static bool has_size_of(const struct io_image *a, const struct io_image *b)
{
    return a->width_px == b->width_px && a->height_px == b->height_px;
}

static bool print_errors(const struct io_image *reference, const struct io_image *mask,
                         const struct io_image *picture, dipole_status *status)
{
    if (!has_size_of(reference, mask) || !has_size_of(reference, picture))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the pictures are of different sizes");
    const size_t pixel_count = (size_t)reference->width_px * (size_t)reference->height_px;
    const size_t mask_channels = (size_t)mask->channel_count;
    double brightest[3] = { 0, 0, 0 }, error2 = 0, value2 = 0, weber = 0;
    double *const parts = malloc(3 * pixel_count * sizeof *parts);
    if (!parts)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu pixels", pixel_count);
    for (size_t i = 0; i < pixel_count; i++) {
        for (size_t c = 0; c < 3 && mask->pixels[mask_channels * i] > 0; c++)
            brightest[c] = fmax(brightest[c], (double)reference->pixels[4 * i + c]);
    }
    size_t count = 0;
    for (size_t i = 0; i < pixel_count; i++) {
        for (size_t c = 0; c < 3 && mask->pixels[mask_channels * i] > 0; c++) {
            const double expected = (double)reference->pixels[4 * i + c];
            const double error = fabs((double)picture->pixels[4 * i + c] - expected);
            error2 += error * error;
            value2 += expected * expected;
            parts[count++] = brightest[c] > 0 ? error / brightest[c] : 0;
            if (expected > 0.01 * brightest[c])
                weber = fmax(weber, error / expected);
        }
    }
    if (count > 0) {
        qsort(parts, count, sizeof *parts, compare);
        printf("%.4f\t%.4f\t%.4f\t%.4f\n", 100 * sqrt(error2 / value2), 100 * parts[count - 1],
               100 * parts[(count - 1) / 1000 * 999], 100 * weber);
    }
    free(parts);
    return count > 0 || dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the mask counts no pixel");
}

static bool read_errors(char **argv, dipole_status *status)
{
    struct io_image *images[3] = { NULL, NULL, NULL };
    bool done = true;
    for (int i = 0; i < 3 && done; i++)
        done = io_exr_read(argv[2 + i], &images[i], status);
    done = done && print_errors(images[0], images[1], images[2], status);
    for (int i = 0; i < 3; i++)
        io_image_destroy(images[i]);
    return done;
}

/* ---- plot --------------------------------------------------------------------------------------- */

enum { SERIES = 256, POINTS = 512, LINE = 16384 };

struct curve {
    char kind[16], label[64], color[16];
    double x[POINTS], y[POINTS];
    size_t count;
};

static bool read_curve(char *line, struct curve *curve)
{
    line[strcspn(line, "\n")] = '\0';
    curve->count = 0;
    size_t cell = 0;
    for (char *text = strtok(line, "\t"); text; text = strtok(NULL, "\t"), cell++) {
        if (cell == 0)
            snprintf(curve->kind, sizeof curve->kind, "%s", text);
        else if (cell == 1)
            snprintf(curve->label, sizeof curve->label, "%s", text);
        else if (cell == 2)
            snprintf(curve->color, sizeof curve->color, "%s", text);
        else if (cell % 2 == 1 && curve->count < POINTS)
            curve->x[curve->count] = strtod(text, NULL);
        else if (curve->count < POINTS)
            curve->y[curve->count++] = strtod(text, NULL);
    }
    return cell >= 5;
}

static struct plot_series series_of(const struct curve *curve)
{
    return (struct plot_series){ .kind = strcmp(curve->kind, "points") == 0 ? PLOT_POINTS : PLOT_LINE,
                                 .label = strcmp(curve->label, "-") == 0 ? NULL : curve->label,
                                 .color = strcmp(curve->color, "-") == 0 ? NULL : curve->color,
                                 .is_thin = strcmp(curve->kind, "thin") == 0,
                                 .is_hollow = true,
                                 .count = curve->count,
                                 .x = curve->x,
                                 .y = curve->y };
}

static bool write_plot(int argc, char **argv, dipole_status *status)
{
    static struct curve curves[SERIES];
    static struct plot_series series[SERIES];
    static char line[LINE];
    size_t count = 0, size = 0;
    FILE *const file = fopen(argv[2], "r");
    while (file && count < SERIES && fgets(line, sizeof line, file))
        count += read_curve(line, &curves[count]);
    if (file)
        fclose(file);
    for (size_t i = 0; i < count; i++)
        series[i] = series_of(&curves[i]);
    const struct plot_marker mark = { .is_horizontal = true,
                                      .value = argc > 10 ? strtod(argv[9], NULL) : 1,
                                      .label = argc > 10 ? argv[10] : NULL,
                                      .dash = PLOT_DASHED };
    const struct plot plot = { .width_px = 960,
                               .height_px = 680,
                               .title = argv[6],
                               .subtitle = argv[7],
                               .caption = argv[8],
                               .x = { .title = argv[4], .scale = PLOT_LOG },
                               .y = { .title = argv[5], .scale = PLOT_LOG },
                               .series = series,
                               .series_count = count,
                               .markers = &mark,
                               .marker_count = argc > 10 ? 1 : 0,
                               .has_legend = true };
    char *svg = NULL;
    const bool done =
        count > 0 ? plot_svg_create(&plot, &svg, &size, status) && io_file_write(argv[3], svg, size, status)
                  : dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s has no curve", argv[2]);
    free(svg);
    return done;
}

int main(int argc, char **argv)
{
    dipole_status status = { 0 };
    bool done = false;
    if (argc >= 6 && strcmp(argv[1], "mask") == 0) {
        done = write_mask(argc, argv, &status);
    } else if (argc == 5 && strcmp(argv[1], "errors") == 0) {
        done = read_errors(argv, &status);
    } else if (argc >= 9 && strcmp(argv[1], "plot") == 0) {
        done = write_plot(argc, argv, &status);
    } else {
        fputs("usage: bench_headline mask|errors|plot ...; the source says more\n", stderr);
        return 2;
    }
    if (!done)
        fprintf(stderr, "bench_headline: %s\n", status.message);
    return done ? 0 : 1;
}
