#include "fit/comparison.h"

#include "fit/report_color.h"

#include <math.h>
#include <stdlib.h>

enum { SCALE_RADIUS_PX = 3 };
static const double white_level = 0.8;

static size_t pixel_count(const struct io_image *image)
{
    return (size_t)image->width_px * (size_t)image->height_px;
}

/* ---- making pictures smaller --------------------------------------------------------------------------
 */

static int parts(int size, int factor)
{
    return (size + factor - 1) / factor;
}

/* The smallest that keeps the limits. */
static int factor_find(int width_px, int height_px, size_t pixel_limit)
{
    int factor = 1;
    while (parts(width_px, factor) > FIT_COMPARISON_SIDE_LIMIT_PX ||
           parts(height_px, factor) > FIT_COMPARISON_SIDE_LIMIT_PX ||
           ((size_t)parts(width_px, factor) * (size_t)parts(height_px, factor) > pixel_limit &&
            (parts(width_px, factor) > 1 || parts(height_px, factor) > 1)))
        factor++;
    return factor;
}

/* Sums over a box in one channel. */
struct sums {
    double target, model, used_target, used_model;
    int target_count, model_count, used_count;
};

static void box_add(struct sums *sums, float target, float model, bool is_used)
{
    if (isfinite(target)) {
        sums->target += target;
        sums->target_count++;
    }
    if (isfinite(model)) {
        sums->model += model;
        sums->model_count++;
    }
    if (is_used && isfinite(target) && isfinite(model)) {
        sums->used_target += target;
        sums->used_model += model;
        sums->used_count++;
    }
}

static float mean(double sum, int count)
{
    return count > 0 ? (float)(sum / count) : NAN;
}

/* Means over one box. used becomes the target over what is used, differences what the model is above it. */
static void box_reduce(const struct fit_report_picture *picture, int x, int y,
                       struct fit_comparison *comparison, struct io_image *used)
{
    const struct io_image *const image = picture->image, *const model = picture->model;
    const int factor = comparison->factor;
    struct sums sums[3] = { 0 };
    for (int v = y * factor; v < (y + 1) * factor && v < image->height_px; v++)
        for (int u = x * factor; u < (x + 1) * factor && u < image->width_px; u++) {
            const size_t i = (size_t)v * (size_t)image->width_px + (size_t)u;
            const float *const target_pixel = image->pixels + i * (size_t)image->channel_count;
            const float *const model_pixel = model->pixels + i * (size_t)model->channel_count;
            comparison->use_counts[picture->uses[i]]++;
            for (int c = 0; c < 3; c++)
                box_add(&sums[c], target_pixel[c], model_pixel[c], picture->uses[i] == FIT_USE_OK);
        }
    const size_t out = 3 * ((size_t)y * (size_t)used->width_px + (size_t)x);
    for (size_t c = 0; c < 3; c++) {
        const struct sums *const sum = &sums[c];
        comparison->target->pixels[out + c] = mean(sum->target, sum->target_count);
        comparison->model->pixels[out + c] = mean(sum->model, sum->model_count);
        used->pixels[out + c] = mean(sum->used_target, sum->used_count);
        comparison->differences->pixels[out + c] =
            mean(sum->used_model - sum->used_target, sum->used_count);
    }
}

/* ---- levels -------------------------------------------------------------------------------------------
 */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* values are sorted; 0 when there are none. */
static double percentile(float *values, size_t count, double part)
{
    if (count == 0)
        return 0;
    qsort(values, count, sizeof *values, compare_floats);
    return values[(size_t)(part * (double)(count - 1) + 0.5)];
}

/* The 99th percentile of the brightest channel; scratch holds a value for each pixel. */
static double level_find(const struct io_image *image, float *scratch)
{
    size_t count = 0;
    for (size_t i = 0; i < pixel_count(image); i++) {
        const float *const pixel = image->pixels + 3 * i;
        const float brightest = fmaxf(pixel[0], fmaxf(pixel[1], pixel[2]));
        if (!isnan(brightest))
            scratch[count++] = brightest;
    }
    return percentile(scratch, count, 0.99);
}

static double exposure_find(const struct io_image *used, const struct io_image *target, float *scratch)
{
    double level = level_find(used, scratch);
    if (!(level > 0))
        level = level_find(target, scratch);
    const double exposure = white_level / level;
    return level > 0 && isfinite(exposure) ? exposure : 1;
}

/* Room for 98 % of the differences. */
static double limit_find(const struct io_image *differences, float *scratch)
{
    static const double limits[] = { 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1 };
    size_t count = 0;
    for (size_t i = 0; i < 3 * pixel_count(differences); i++)
        if (!isnan(differences->pixels[i]))
            scratch[count++] = fabsf(differences->pixels[i]);
    const double needed = percentile(scratch, count, 0.98);
    size_t i = 0;
    while (i + 1 < sizeof limits / sizeof limits[0] && limits[i] < needed)
        i++;
    return limits[i];
}

/* ---- differences --------------------------------------------------------------------------------------
 */

/* The mean of a channel round about a pixel; the pixel itself is used. */
static double local_scale(const struct io_image *used, int x, int y, size_t channel)
{
    double sum = 0;
    int count = 0;
    for (int v = y - SCALE_RADIUS_PX; v <= y + SCALE_RADIUS_PX; v++)
        for (int u = x - SCALE_RADIUS_PX; u <= x + SCALE_RADIUS_PX; u++) {
            if (u < 0 || u >= used->width_px || v < 0 || v >= used->height_px)
                continue;
            const float value =
                used->pixels[3 * ((size_t)v * (size_t)used->width_px + (size_t)u) + channel];
            if (isnan(value))
                continue;
            sum += value;
            count++;
        }
    return sum / count;
}

static void differences_scale(struct fit_comparison *comparison, const struct io_image *used)
{
    const double least = 0.01 * white_level / comparison->exposure;
    double sums[3] = { 0 };
    size_t counts[3] = { 0 };
    float *value = comparison->differences->pixels;
    for (int y = 0; y < used->height_px; y++)
        for (int x = 0; x < used->width_px; x++)
            for (size_t c = 0; c < 3; c++, value++) {
                if (isnan(*value))
                    continue;
                const double relative = *value / fmax(local_scale(used, x, y, c), least);
                *value = (float)relative;
                sums[c] += relative;
                counts[c]++;
            }
    for (int c = 0; c < 3; c++)
        comparison->mean_differences[c] = counts[c] > 0 ? sums[c] / (double)counts[c] : NAN;
}

static void expose(struct io_image *image, double exposure)
{
    for (size_t i = 0; i < 3 * pixel_count(image); i++)
        image->pixels[i] = (float)(image->pixels[i] * exposure);
}

/* used and scratch (3 floats a pixel) are of the comparison's size. */
static void compare(const struct fit_report_picture *picture, struct fit_comparison *comparison,
                    struct io_image *used, float *scratch)
{
    for (int y = 0; y < used->height_px; y++)
        for (int x = 0; x < used->width_px; x++)
            box_reduce(picture, x, y, comparison, used);
    comparison->exposure = exposure_find(used, comparison->target, scratch);
    differences_scale(comparison, used);
    comparison->limit = limit_find(comparison->differences, scratch);
    expose(comparison->target, comparison->exposure);
    expose(comparison->model, comparison->exposure);
}

bool fit_comparison_create(const struct fit_report_picture *picture, size_t pixel_limit,
                           struct fit_comparison **comparison_out, dipole_status *status)
{
    *comparison_out = NULL;
    struct fit_comparison *const comparison = calloc(1, sizeof *comparison);
    if (!comparison)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    comparison->factor = factor_find(picture->image->width_px, picture->image->height_px, pixel_limit);
    const int width = parts(picture->image->width_px, comparison->factor),
              height = parts(picture->image->height_px, comparison->factor);
    struct io_image *used = NULL;
    bool done = io_image_create(width, height, 3, &comparison->target, status) &&
                io_image_create(width, height, 3, &comparison->model, status) &&
                io_image_create(width, height, 3, &comparison->differences, status) &&
                io_image_create(width, height, 3, &used, status);
    float *const scratch = done ? calloc(3 * pixel_count(used), sizeof *scratch) : NULL;
    if (done && !scratch)
        done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    if (done)
        compare(picture, comparison, used, scratch);
    free(scratch);
    io_image_destroy(used);
    if (done)
        *comparison_out = comparison;
    else
        fit_comparison_destroy(comparison);
    return done;
}

void fit_comparison_destroy(struct fit_comparison *comparison)
{
    if (!comparison)
        return;
    io_image_destroy(comparison->target);
    io_image_destroy(comparison->model);
    io_image_destroy(comparison->differences);
    free(comparison);
}

bool fit_differences_draw(const struct fit_comparison *comparison, int channel, struct io_image **image_out,
                          dipole_status *status)
{
    const struct io_image *const differences = comparison->differences;
    if (!io_image_create(differences->width_px, differences->height_px, 3, image_out, status))
        return false;
    for (size_t i = 0; i < pixel_count(differences); i++) {
        const float *const pixel = differences->pixels + 3 * i;
        const double value =
            channel < 0 ? ((double)pixel[0] + pixel[1] + pixel[2]) / 3 : (double)pixel[channel];
        unsigned char rgb[3];
        fit_difference_color(value / comparison->limit, rgb);
        fit_pixel_set(*image_out, i, rgb);
    }
    return true;
}
