#include "accuracy/error.h"

#include "accuracy/interior.h"
#include "accuracy/statistics.h"

#include <math.h>
#include <stdlib.h>

/* Values below this part of the brightest are too dark to be seen. */
#define VISIBLE_PART 1e-4

static size_t pixel_count_of(const struct io_image *image)
{
    return (size_t)image->width_px * (size_t)image->height_px;
}

static double brightest_of(const struct io_image *image)
{
    double brightest = 0;
    for (size_t i = 0; i < pixel_count_of(image); i++) {
        for (size_t c = 0; c < 3; c++)
            brightest = fmax(brightest, (double)image->pixels[4 * i + c]);
    }
    return brightest;
}

static bool check_sizes(const struct io_image *reference, const struct io_image *picture,
                        dipole_status *status)
{
    return (reference->width_px == picture->width_px && reference->height_px == picture->height_px &&
            reference->channel_count == 4 && picture->channel_count == 4) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "a picture of %dx%d beside a reference of %dx%d",
                       picture->width_px, picture->height_px, reference->width_px, reference->height_px);
}

bool accuracy_error_measure(const struct io_image *reference, const struct io_image *picture,
                            const unsigned char *kinds, struct accuracy_error *error_out,
                            dipole_status *status)
{
    *error_out = (struct accuracy_error){ .pixel_count = 0 };
    if (!check_sizes(reference, picture, status))
        return false;
    double *const relative = calloc(3 * pixel_count_of(reference) + 1, sizeof *relative);
    if (!relative)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the errors of %zu pixels",
                           pixel_count_of(reference));
    const double brightest = brightest_of(reference);
    double error2[2] = { 0 }, value2[2] = { 0 }, largest = 0; /* of edges, of the rest */
    size_t count = 0;
    for (size_t i = 0; i < pixel_count_of(reference); i++) {
        const int is_interior = kinds[i] == ACCURACY_INTERIOR;
        if (kinds[i] == ACCURACY_EMPTY)
            continue;
        error_out->pixel_count += (size_t)is_interior;
        for (size_t c = 0; c < 3; c++) {
            const double expected = (double)reference->pixels[4 * i + c],
                         error = (double)picture->pixels[4 * i + c] - expected;
            error2[is_interior] += error * error;
            value2[is_interior] += expected * expected;
            if (!is_interior)
                continue;
            largest = fmax(largest, fabs(error));
            if (expected > VISIBLE_PART * brightest)
                relative[count++] = fabs(error) / expected;
        }
    }
    qsort(relative, count, sizeof *relative, accuracy_compare_numbers);
    if (count > 0) {
        error_out->rmse = sqrt(error2[1] / value2[1]);
        error_out->rmse_all = sqrt((error2[0] + error2[1]) / (value2[0] + value2[1]));
        error_out->weber_99 = relative[(count - 1) * 99 / 100];
        error_out->max = largest / brightest;
    }
    free(relative);
    return count > 0 || dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                                    "the reference shows nothing that is lit and wider than two pixels");
}

bool accuracy_difference_create(const struct io_image *reference, const struct io_image *picture,
                                double limit, struct io_image **image_out, dipole_status *status)
{
    *image_out = NULL;
    if (!check_sizes(reference, picture, status) ||
        !io_image_create(reference->width_px, reference->height_px, 3, image_out, status))
        return false;
    const double full = limit * brightest_of(reference);
    for (size_t i = 0; i < pixel_count_of(reference); i++) {
        double step = 0;
        for (size_t c = 0; c < 3; c++)
            step += ((double)picture->pixels[4 * i + c] - (double)reference->pixels[4 * i + c]) / 3;
        const double part = full > 0 ? fmin(fmax(step / full, -1), 1) : 0;
        float *const rgb = (*image_out)->pixels + 3 * i;
        rgb[0] = (float)(part > 0 ? 1 : 1 + part);
        rgb[1] = (float)(1 - fabs(part));
        rgb[2] = (float)(part < 0 ? 1 : 1 - part);
    }
    return true;
}
