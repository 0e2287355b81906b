/*
 * The factor by which a picture must be multiplied so that a given share of the pixels that objects cover
 * has a channel above 1, as in a photograph that was exposed too long.
 * usage: bench_fit_exposure PICTURE.exr SHARE
 */
#include "cli/cli.h"
#include "io/exr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

static double brightest(const float *pixel)
{
    return fmax((double)pixel[0], fmax((double)pixel[1], (double)pixel[2]));
}

static bool print_exposure(const struct io_image *image, double share, dipole_status *status)
{
    const size_t pixel_count = (size_t)image->width_px * (size_t)image->height_px;
    double *const values = malloc(pixel_count * sizeof *values);
    if (!values)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu values", pixel_count);
    size_t count = 0;
    for (size_t i = 0; i < pixel_count; i++) {
        if (image->pixels[4 * i + 3] >= 1.0f)
            values[count++] = brightest(image->pixels + 4 * i);
    }
    qsort(values, count, sizeof *values, compare);
    if (count > 0)
        printf("%.9g\n", 1 / values[(size_t)((1 - share) * (double)(count - 1))]);
    free(values);
    return count > 0 || dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "no pixel shows an object");
}

int main(int argc, char **argv)
{
    dipole_status status;
    struct io_image *image = NULL;
    if (argc != 3) {
        fprintf(stderr, "usage: bench_fit_exposure PICTURE.exr SHARE\n");
        return EXIT_USAGE;
    }
    bool is_done = io_exr_read(argv[1], &image, &status) &&
                   (image->channel_count == 4 ||
                    dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "%s has no alpha channel", argv[1])) &&
                   print_exposure(image, strtod(argv[2], NULL), &status);
    io_image_destroy(image);
    if (is_done)
        return EXIT_DONE;
    fprintf(stderr, "bench_fit_exposure: %s\n", status.message);
    return EXIT_FAILED;
}
