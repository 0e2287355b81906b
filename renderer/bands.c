#include "renderer/bands.h"

#include "renderer/footprint.h"

#include <math.h>
#include <stdlib.h>

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

struct lut_axis render_bands_axis(const struct render_band_source *source)
{
    struct lut_axis axis = source->table->rows[source->row].axis;
    axis.power = 0;
    axis.node_count = RENDER_BAND_NODES;
    return axis;
}

/* Put the blurred profile in place of the sharp one, where a channel is to be blurred and they differ. */
static bool blur(const struct render_band_source *source, const struct lut_axis *axis,
                 double (*profile)[IO_CHANNEL_COUNT], dipole_status *status)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        struct render_footprint *footprint = NULL;
        if (!(source->blur_mm[c] > 0))
            continue;
        if (!render_footprint_create(source->medium->stacks[c], source->blur_mm[c], &footprint, status))
            return false;
        for (int i = 0; i < axis->node_count; i++) {
            const double r_mm = fmin(lut_axis_r_mm(axis, i), axis->r_max_mm);
            if (r_mm <= footprint->reach_mm)
                profile[i][c] = render_footprint_sample(footprint, r_mm);
        }
        free(footprint);
    }
    return true;
}

bool render_bands_bake(const struct render_band_source *source, const struct render_band *bands,
                       int band_count, float *rgb, dipole_status *status)
{
    const struct lut_axis axis = render_bands_axis(source);
    double(*const profile)[IO_CHANNEL_COUNT] = malloc((size_t)axis.node_count * sizeof *profile);
    if (!profile)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a profile of %d nodes",
                           axis.node_count);
    /* The last node may round to beyond the axis, where the table is 0. */
    for (int i = 0; i < axis.node_count; i++)
        lut_splat_sample(source->table, source->row, fmin(lut_axis_r_mm(&axis, i), axis.r_max_mm),
                         profile[i]);
    const bool done = blur(source, &axis, profile, status);
    for (int i = 0; done && i < axis.node_count; i++) {
        const double r_mm = fmin(lut_axis_r_mm(&axis, i), axis.r_max_mm);
        for (int b = 0; b < band_count; b++) {
            const double weight = render_band_weight(&bands[b], r_mm);
            float *const node = rgb + 4 * ((size_t)b * (size_t)axis.node_count + (size_t)i);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                node[c] = (float)(weight * profile[i][c]);
            node[3] = 0;
        }
    }
    free(profile);
    return done;
}
