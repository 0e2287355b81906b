#include "renderer/bands.h"

#include <math.h>
#include <stdlib.h>

/* Steps of less than 0.2 % of the distance: interpolation errs by some 1e-5 of the profile. */
enum { NODE_COUNT = 8193 };

/* 0 to 1 over start..2 start in the squared distance, with two continuous derivatives: in the squared
 * distance it turns more gently where the profile is high, and aliases half as much as in log distance. */
static double rise(double start_mm, double r_mm)
{
    const double ratio = r_mm / start_mm;
    const double x = fmin(fmax((ratio * ratio - 1) / 3, 0), 1);
    return x * x * x * (x * (6 * x - 15) + 10);
}

int render_bands_make(double spacing_mm, double r_max_mm, double ring_spacings,
                      struct render_band bands[RENDER_BAND_LIMIT])
{
    int count = 0;
    double start_mm = 0;
    for (bool is_last = false; !is_last; count++) {
        const double end_mm = count == 0 ? ring_spacings * spacing_mm : 2 * start_mm;
        is_last = count + 1 == RENDER_BAND_LIMIT || end_mm >= r_max_mm;
        bands[count] = (struct render_band){ .spacing_mm = ldexp(spacing_mm, count),
                                             .r_inner_mm = start_mm,
                                             .r_outer_mm = is_last ? r_max_mm : fmin(2 * end_mm, r_max_mm),
                                             .rise_mm = start_mm,
                                             .fall_mm = is_last ? 0 : end_mm };
        start_mm = end_mm;
    }
    return count;
}

double render_band_weight(const struct render_band *band, double r_mm)
{
    const double risen = band->rise_mm > 0 ? rise(band->rise_mm, r_mm) : 1;
    return band->fall_mm > 0 ? risen - rise(band->fall_mm, r_mm) : risen;
}

struct lut_axis render_bands_axis(const struct lut_splat *table)
{
    struct lut_axis axis = table->rows[0].axis;
    axis.power = 0;
    axis.node_count = NODE_COUNT;
    return axis;
}

float *render_bands_bake(const struct lut_splat *table, const struct render_band *bands, int band_count)
{
    const struct lut_axis axis = render_bands_axis(table);
    float *const rgb = calloc((size_t)band_count * (size_t)axis.node_count, 4 * sizeof *rgb);
    for (int i = 0; rgb && i < axis.node_count; i++) {
        /* The last node may round to beyond the axis, where the table is 0. */
        const double r_mm = fmin(lut_axis_r_mm(&axis, i), axis.r_max_mm);
        double profile[IO_CHANNEL_COUNT];
        lut_splat_sample(table, 0, r_mm, profile);
        for (int b = 0; b < band_count; b++) {
            const double weight = render_band_weight(&bands[b], r_mm);
            float *const node = rgb + 4 * ((size_t)b * (size_t)axis.node_count + (size_t)i);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                node[c] = (float)(weight * profile[c]);
        }
    }
    return rgb;
}
