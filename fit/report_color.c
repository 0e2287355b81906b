#include "fit/report_color.h"

#include "fit/report.h"
#include "io/image.h"

#include <math.h>

const unsigned char fit_use_colors[FIT_USE_COUNT][3] = {
    [FIT_USE_OK] = { 255, 255, 255 },         /* white          */
    [FIT_USE_NOT_COVERED] = { 34, 34, 34 },   /* nearly black   */
    [FIT_USE_MASKED] = { 150, 150, 150 },     /* grey           */
    [FIT_USE_NOT_FINITE] = { 0, 158, 115 },   /* bluish green   */
    [FIT_USE_CLIPPED] = { 213, 94, 0 },       /* vermilion      */
    [FIT_USE_DARK] = { 0, 114, 178 },         /* blue           */
    [FIT_USE_SPECULAR] = { 230, 159, 0 },     /* orange         */
    [FIT_USE_SHADOW_EDGE] = { 86, 180, 233 }, /* sky blue       */
    [FIT_USE_OUTLIER] = { 204, 121, 167 },    /* reddish purple */
};

const unsigned char fit_no_difference_color[3] = { 150, 150, 150 };

void fit_difference_color(double position, unsigned char rgb[3])
{
    static const double ends[2][3] = { { 16, 96, 182 }, { 170, 60, 56 } };
    for (int c = 0; c < 3; c++) {
        const double end = ends[position > 0][c], amount = fmin(fabs(position), 1);
        rgb[c] = isnan(position) ? fit_no_difference_color[c]
                                 : (unsigned char)lround(255 + (end - 255) * amount);
    }
}

/* IEC 61966-2-1. */
static float linear_from_byte(unsigned char byte)
{
    const double srgb = byte / 255.0;
    return (float)(srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4));
}

void fit_pixel_set(struct io_image *image, size_t index, const unsigned char rgb[3])
{
    for (size_t c = 0; c < 3; c++)
        image->pixels[3 * index + c] = linear_from_byte(rgb[c]);
}

static enum fit_use commonest(const unsigned char *uses, int width_px, int height_px, int factor, int x,
                              int y)
{
    int counts[FIT_USE_COUNT] = { 0 };
    for (int v = y * factor; v < (y + 1) * factor && v < height_px; v++)
        for (int u = x * factor; u < (x + 1) * factor && u < width_px; u++)
            counts[uses[(size_t)v * (size_t)width_px + (size_t)u]]++;
    enum fit_use use = FIT_USE_OK;
    for (int i = 1; i < FIT_USE_COUNT; i++)
        if (counts[i] > counts[use])
            use = (enum fit_use)i;
    return use;
}

bool fit_uses_draw(const unsigned char *uses, int width_px, int height_px, int factor,
                   struct io_image **image_out, dipole_status *status)
{
    const int columns = (width_px + factor - 1) / factor, rows = (height_px + factor - 1) / factor;
    float palette[FIT_USE_COUNT][3];
    for (int i = 0; i < FIT_USE_COUNT; i++)
        for (int c = 0; c < 3; c++)
            palette[i][c] = linear_from_byte(fit_use_colors[i][c]);
    if (!io_image_create(columns, rows, 3, image_out, status))
        return false;
    float *pixel = (*image_out)->pixels;
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < columns; x++) {
            const enum fit_use use = commonest(uses, width_px, height_px, factor, x, y);
            for (int c = 0; c < 3; c++)
                *pixel++ = palette[use][c];
        }
    return true;
}

bool fit_mask_write(const char *path, const unsigned char *uses, int width_px, int height_px,
                    dipole_status *status)
{
    const dipole_place place = { .source = path };
    if (width_px < 1 || width_px > IO_IMAGE_SIDE_LIMIT || height_px < 1 || height_px > IO_IMAGE_SIDE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "a mask of %d x %d pixels, expected 1 to %d",
                           width_px, height_px, IO_IMAGE_SIDE_LIMIT);
    const size_t count = (size_t)width_px * (size_t)height_px;
    if (count > IO_IMAGE_PIXEL_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "a mask of %zu pixels, expected at most %zu",
                           count, IO_IMAGE_PIXEL_LIMIT);
    for (size_t i = 0; i < count; i++)
        if (uses[i] >= FIT_USE_COUNT)
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "use of pixel %zu is %d, expected 0 to %d",
                               i, uses[i], FIT_USE_COUNT - 1);
    struct io_image *image = NULL;
    const bool done =
        fit_uses_draw(uses, width_px, height_px, 1, &image, status) && io_png_write(path, image, status);
    io_image_destroy(image);
    return done;
}
