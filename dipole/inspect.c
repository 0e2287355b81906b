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
        const struct inspector_channel *const channel = &result->channels[c];
        for (size_t i = 0; i < result->material.layer_count; i++)
            low = fmin(low, inspector_layer(channel, i)->mean_free_path_mm / 10);
        high = fmax(high, channel->r_max_mm);
    }
    high = fmax(high, 10 * low); /* where nothing is scattered, r_max is 0 */
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

static bool derive_dipole(const struct inspector_result *result, const dipole_layer *layer,
                          struct inspector_channel *channel, dipole_status *status)
{
    const dipole_coefficients *const coefficients = &channel->coefficients;
    if (!dipole_coefficients_init(&layer->medium, &channel->coefficients, status))
        return false;
    channel->diffuse_reflectance = dipole_diffuse_reflectance(coefficients);
    channel->r_max_mm = dipole_r_max_mm(coefficients, result->epsilon);
    channel->splat_spacing_mm = dipole_splat_spacing_mm(coefficients, result->epsilon);
    return true;
}

/* Rounding may leave -0, or a tiny negative number where next to nothing passes. */
static double part(double value)
{
    return value > 0 ? value : 0;
}

static bool derive_stack(const struct inspector_result *result, const dipole_layer *layers,
                         struct inspector_channel *channel, dipole_status *status)
{
    const struct io_material *const material = &result->material;
    if (!dipole_stack_create(layers, material->layer_count, material->model, result->side, &channel->stack,
                             status))
        return false;
    const dipole_stack *const stack = channel->stack;
    channel->coefficients = *dipole_stack_coefficients(stack, 0);
    channel->diffuse_reflectance = part(dipole_stack_total(stack, DIPOLE_FACE_LIT));
    channel->diffuse_transmittance = part(dipole_stack_total(stack, DIPOLE_FACE_FAR));
    channel->unscattered_reflectance = part(dipole_stack_unscattered(stack, DIPOLE_FACE_LIT));
    channel->unscattered_transmittance = part(dipole_stack_unscattered(stack, DIPOLE_FACE_FAR));
    channel->r_max_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, result->epsilon);
    channel->splat_spacing_mm = dipole_stack_splat_spacing_mm(stack, DIPOLE_FACE_LIT, result->epsilon);
    return true;
}

bool inspector_result_derive(struct inspector_result *result, dipole_status *status)
{
    const struct io_material *const material = &result->material;
    const bool is_dipole = material->model == DIPOLE_MODEL_DIPOLE && !io_material_has_layers(material);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        struct inspector_channel *const channel = &result->channels[c];
        *channel = (struct inspector_channel){ .name = io_channel_names[c] };
        if (!(is_dipole ? derive_dipole : derive_stack)(result, material->layers[c], channel, status))
            return false;
        channel->diffuse_mean_free_path_mm = 1 / channel->coefficients.sigma_tr_per_mm;
    }
    if (result->radius_count == 0)
        radii_choose(result);
    return true;
}

void inspector_result_end(struct inspector_result *result)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_stack_destroy(result->channels[c].stack);
        result->channels[c].stack = NULL;
    }
}

bool inspector_has_far_face(const struct inspector_result *result)
{
    return isfinite(result->material.layers[0][result->material.layer_count - 1].thickness_mm);
}

const dipole_coefficients *inspector_layer(const struct inspector_channel *channel, size_t index)
{
    return channel->stack ? dipole_stack_coefficients(channel->stack, index) : &channel->coefficients;
}

double inspector_rd_per_mm2(const struct inspector_channel *channel, double r_mm)
{
    if (!channel->stack)
        return dipole_rd_per_mm2(&channel->coefficients, r_mm);
    double value;
    dipole_stack_profile_per_mm2(channel->stack, DIPOLE_FACE_LIT, &r_mm, 1, &value);
    return value;
}

double inspector_td_per_mm2(const struct inspector_channel *channel, double r_mm)
{
    if (!channel->stack)
        return 0;
    double value;
    dipole_stack_profile_per_mm2(channel->stack, DIPOLE_FACE_FAR, &r_mm, 1, &value);
    return value;
}

const char *inspector_model_name(dipole_model model)
{
    return model == DIPOLE_MODEL_BETTER_DIPOLE ? "better dipole" : io_model_names[model];
}
