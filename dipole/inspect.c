#include "dipole/inspect.h"

#include <assert.h>
#include <math.h>

/* Values are powers of ten times 1, 2, 5, written so that they print as what they are. */
static double step_value(int step)
{
    static const double mantissas[] = { 1, 2, 5 };
    const int decade = (int)floor(step / 3.0);
    const double mantissa = mantissas[step - 3 * decade];
    return decade < 0 ? mantissa / pow(10, -decade) : mantissa * pow(10, decade);
}

static void radii_choose(struct inspector_result *result)
{
    double low = INFINITY, high = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        low = fmin(low, result->channels[c].coefficients.mean_free_path_mm / 10);
        high = fmax(high, result->channels[c].r_max_mm);
    }
    result->radii_mm[result->radius_count++] = 0;
    int step = 3 * (int)floor(log10(low));
    while (step_value(step + 1) <= low)
        step++;
    for (; step_value(step - 1) < high; step++) {
        /* The legal range of coefficients spans 100 decades, r_max a few more. */
        assert(result->radius_count < INSPECTOR_RADIUS_LIMIT);
        result->radii_mm[result->radius_count++] = step_value(step);
    }
}

bool inspector_result_derive(struct inspector_result *result, dipole_status *status)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        struct inspector_channel *const channel = &result->channels[c];
        dipole_coefficients *const coefficients = &channel->coefficients;
        if (!dipole_coefficients_init(&result->material.layers[c][0].medium, coefficients, status))
            return false;
        channel->name = io_channel_names[c];
        channel->diffuse_mean_free_path_mm = 1 / coefficients->sigma_tr_per_mm;
        channel->diffuse_reflectance = dipole_diffuse_reflectance(coefficients);
        channel->r_max_mm = dipole_r_max_mm(coefficients, result->epsilon);
        channel->splat_spacing_mm = dipole_splat_spacing_mm(coefficients, result->epsilon);
    }
    if (result->radius_count == 0)
        radii_choose(result);
    return true;
}
