/*
 * How far pictures are from a reference.
 * usage: bench_pictures errors REFERENCE.exr PICTURE.exr
 *
 * Markdown cells in %, within objects, then with their edges: relative RMSE, Weber's 99th percentile, and
 * that of values above 1e-4 of the brightest.
 *
 * usage: bench_pictures brief REFERENCE.exr PICTURE.exr
 *
 * Two numbers in %, within objects: relative RMSE, and the largest error of a pixel's channel over the root
 * mean square of the reference.
 *
 * usage: bench_pictures difference REFERENCE.exr PICTURE.exr OUT.ppm
 *
 * Signed: red is too bright, blue too dark, full colour at 10 % of the brightest.
 */
#include "io/exr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_covered(const struct io_image *image, int x, int y)
{
    return x >= 0 && y >= 0 && x < image->width_px && y < image->height_px &&
           image->pixels[4 * ((size_t)y * (size_t)image->width_px + (size_t)x) + 3] >= 1.0f;
}

/* The pixel and its neighbours show objects all over: no edge of an object against the background. */
static bool is_within(const struct io_image *image, int x, int y)
{
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            if (!is_covered(image, x + i, y + j))
                return false;
        }
    }
    return true;
}

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

static float brightest_of(const struct io_image *image)
{
    const size_t value_count = 4 * (size_t)image->width_px * (size_t)image->height_px;
    float brightest = 0;
    for (size_t i = 0; i < value_count; i++)
        brightest = i % 4 == 3 ? brightest : fmaxf(brightest, image->pixels[i]);
    return brightest;
}

/* In per cent: relative RMSE, and the 99th percentile of |L - L_ref|/L_ref where L_ref is above a part of
 * the brightest. */
static bool errors(const struct io_image *reference, const struct io_image *picture, bool with_edges,
                   double part, double *rmse, double *weber)
{
    const float least = (float)part * brightest_of(reference);
    const size_t pixel_count = (size_t)reference->width_px * (size_t)reference->height_px;
    double *const relative = malloc(3 * pixel_count * sizeof *relative);
    double error2 = 0, value2 = 0;
    size_t count = 0;
    if (!relative)
        return false;
    for (size_t i = 0; i < pixel_count; i++) {
        const float *const expected = reference->pixels + 4 * i, *const found = picture->pixels + 4 * i;
        const int x = (int)(i % (size_t)reference->width_px), y = (int)(i / (size_t)reference->width_px);
        if (with_edges ? !(expected[3] > 0.0f) : !is_within(reference, x, y))
            continue;
        for (int c = 0; c < 3; c++) {
            const double error = (double)found[c] - (double)expected[c];
            error2 += error * error;
            value2 += (double)expected[c] * (double)expected[c];
            if (expected[c] > least)
                relative[count++] = fabs(error) / (double)expected[c];
        }
    }
    qsort(relative, count, sizeof *relative, compare);
    *rmse = 100 * sqrt(error2 / value2);
    *weber = count > 0 ? 100 * relative[(count - 1) * 99 / 100] : 0;
    free(relative);
    return true;
}

static bool print_errors(const struct io_image *reference, const struct io_image *picture)
{
    for (int i = 0; i < 2; i++) {
        double rmse, weber, visible;
        if (!errors(reference, picture, i == 1, 0, &rmse, &weber) ||
            !errors(reference, picture, i == 1, 1e-4, &rmse, &visible))
            return false;
        printf("%.2f | %.2f | %.2f%s", rmse, weber, visible, i == 0 ? " | " : "\n");
    }
    return true;
}

static bool print_brief(const struct io_image *reference, const struct io_image *picture)
{
    const size_t pixel_count = (size_t)reference->width_px * (size_t)reference->height_px;
    double error2 = 0, value2 = 0, largest2 = 0;
    size_t count = 0;
    for (size_t i = 0; i < pixel_count; i++) {
        if (!is_within(reference, (int)(i % (size_t)reference->width_px),
                       (int)(i / (size_t)reference->width_px)))
            continue;
        for (size_t c = 0; c < 3; c++) {
            const double expected = (double)reference->pixels[4 * i + c];
            const double error = (double)picture->pixels[4 * i + c] - expected;
            error2 += error * error;
            value2 += expected * expected;
            largest2 = fmax(largest2, error * error);
            count++;
        }
    }
    printf("%.2f %.2f\n", 100 * sqrt(error2 / value2), 100 * sqrt(largest2 / value2 * (double)count));
    return true;
}

static bool write_difference(const struct io_image *reference, const struct io_image *picture,
                             const char *path)
{
    const size_t pixel_count = (size_t)reference->width_px * (size_t)reference->height_px;
    const float brightest = brightest_of(reference);
    FILE *const file = fopen(path, "wb");
    if (!file)
        return false;
    fprintf(file, "P6\n%d %d\n255\n", reference->width_px, reference->height_px);
    for (size_t i = 0; i < pixel_count; i++) {
        double step = 0;
        for (size_t c = 0; c < 3; c++)
            step += ((double)picture->pixels[4 * i + c] - (double)reference->pixels[4 * i + c]) / 3;
        const double part = fmin(fmax(step / (0.1 * (double)brightest), -1), 1);
        const double red = part > 0 ? 1 : 1 + part, blue = part < 0 ? 1 : 1 - part, green = 1 - fabs(part);
        const double rgb[3] = { red, green, blue };
        for (int c = 0; c < 3; c++)
            fputc((int)lround(255 * rgb[c]), file);
    }
    return fclose(file) == 0;
}

int main(int argc, char **argv)
{
    struct io_image *reference = NULL, *picture = NULL;
    dipole_status status = { 0 };
    if (argc < 4) {
        fputs("usage: bench_pictures errors|brief|difference REFERENCE.exr PICTURE.exr [OUT.ppm]\n",
              stderr);
        return 2;
    }
    bool done = io_exr_read(argv[2], &reference, &status) && io_exr_read(argv[3], &picture, &status);
    if (done && (reference->width_px != picture->width_px || reference->height_px != picture->height_px))
        done = dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "the pictures are of different sizes");
    if (done && strcmp(argv[1], "errors") == 0)
        done = print_errors(reference, picture);
    else if (done && strcmp(argv[1], "brief") == 0)
        done = print_brief(reference, picture);
    else if (done)
        done = argc > 4 && write_difference(reference, picture, argv[4]);
    if (!done)
        fprintf(stderr, "bench_pictures: %s\n", status.message);
    io_image_destroy(reference);
    io_image_destroy(picture);
    return done ? 0 : 1;
}
