/* A material's profile as tables hold it: any model, any layers, with a finite value at r = 0. T31. */
#include "lutgen/internal.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Part of the light, in units of epsilon, that leaves within the core. */
static const double core_share = 1.0 / 16;

/* Whether a model's profile has no bound at r = 0: a logarithm (beam), 1/r (modes). */
static bool is_singular(dipole_model model)
{
    return model == DIPOLE_MODEL_BEAM || model == DIPOLE_MODEL_MODES;
}

/* Radius within which a part of what leaves leaves: by bisection in its logarithm, to 1e-3. */
static double radius_of(const dipole_stack *stack, double part, double shortest_mm, double longest_mm)
{
    const double power = part * dipole_stack_total(stack, DIPOLE_FACE_LIT);
    double low = log(1e-8 * shortest_mm), high = log(longest_mm);
    while (high - low > 1e-3) {
        const double middle = 0.5 * (low + high);
        if (dipole_stack_within(stack, DIPOLE_FACE_LIT, exp(middle)) < power)
            low = middle;
        else
            high = middle;
    }
    return exp(high);
}

static double value_at(const dipole_stack *stack, double r_mm)
{
    double value;
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r_mm, 1, &value);
    return value;
}

/* The quadratic in t = (r/core)^2 that continues value and slope at t = 1 and carries the same power. */
static void core_init(struct lut_profile *profile, double epsilon)
{
    const double h = 1e-3, pi = 3.14159265358979323846;
    profile->core_mm =
        radius_of(profile->stack, core_share * epsilon, profile->shortest_mm, profile->r_max_mm);
    const double value = value_at(profile->stack, profile->core_mm);
    const double slope = (value_at(profile->stack, profile->core_mm * (1 + h)) -
                          value_at(profile->stack, profile->core_mm * (1 - h))) /
                         (4 * h); /* dR/dt = r/2 dR/dr */
    const double mean = dipole_stack_within(profile->stack, DIPOLE_FACE_LIT, profile->core_mm) /
                        (pi * profile->core_mm * profile->core_mm);
    profile->core[2] = 3 * (mean - value + 0.5 * slope);
    profile->core[1] = slope - 2 * profile->core[2];
    profile->core[0] = value - profile->core[1] - profile->core[2];
    profile->shortest_mm = profile->core_mm;
}

static bool profile_init(const struct io_material *material, int channel, double epsilon,
                         struct lut_profile *profile, dipole_status *status)
{
    dipole_status why = { 0 };
    const dipole_layer *const layers = material->layers[channel];
    if (!dipole_stack_create(layers, material->layer_count, material->model, DIPOLE_FROM_ABOVE,
                             &profile->stack, &why))
        return dipole_fail(status, why.code, NULL, "channel %s: %s", io_channel_names[channel],
                           why.message);
    profile->shortest_mm = INFINITY;
    for (size_t i = 0; i < material->layer_count; i++)
        profile->shortest_mm =
            fmin(profile->shortest_mm, dipole_stack_coefficients(profile->stack, i)->mean_free_path_mm);
    profile->mean_free_path_mm = profile->shortest_mm;
    if (dipole_stack_total(profile->stack, DIPOLE_FACE_LIT) > 0) {
        profile->r_max_mm = dipole_stack_r_max_mm(profile->stack, DIPOLE_FACE_LIT, epsilon);
        profile->floor_per_mm2 = value_at(profile->stack, profile->r_max_mm);
        if (!(profile->floor_per_mm2 > 0))
            return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                               "channel %s: the model's profile is not positive at r_max = %.4g mm, so no "
                               "relative error can be kept; use the model \"beam\"",
                               io_channel_names[channel], profile->r_max_mm);
        if (is_singular(material->model))
            core_init(profile, epsilon);
        return true;
    }
    profile->r_max_mm = profile->shortest_mm;
    dipole_stack_destroy(profile->stack);
    profile->stack = NULL;
    return true;
}

bool lut_profiles_init(const struct io_material *material, double epsilon,
                       struct lut_profile out[IO_CHANNEL_COUNT], dipole_status *status)
{
    memset(out, 0, IO_CHANNEL_COUNT * sizeof *out);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (!profile_init(material, c, epsilon, &out[c], status))
            return false;
    return true;
}

void lut_profiles_end(struct lut_profile profiles[IO_CHANNEL_COUNT])
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        dipole_stack_destroy(profiles[c].stack);
}

void lut_profile_evaluate(const struct lut_profile *profile, const double *r_mm, size_t count,
                          double *values)
{
    if (!profile->stack) {
        memset(values, 0, count * sizeof *values);
        return;
    }
    dipole_stack_profile_per_mm2(profile->stack, DIPOLE_FACE_LIT, r_mm, count, values);
    for (size_t i = 0; i < count; i++)
        if (r_mm[i] < profile->core_mm) {
            const double x = r_mm[i] / profile->core_mm, t = x * x;
            values[i] = profile->core[0] + t * (profile->core[1] + t * profile->core[2]);
        }
}

/* A table in float keeps its digits only inside float's normal range. */
bool lut_profiles_check_range(const struct lut_profile profiles[IO_CHANNEL_COUNT], dipole_status *status)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double r_mm = 0;
        double most;
        lut_profile_evaluate(&profiles[c], &r_mm, 1, &most);
        if (profiles[c].stack && (most > (double)FLT_MAX || profiles[c].floor_per_mm2 < (double)FLT_MIN))
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "channel %s falls from %.3g to %.3g per mm^2 within r_max, expected %.2g to "
                               "%.2g (float)",
                               io_channel_names[c], most, profiles[c].floor_per_mm2, (double)FLT_MAX,
                               (double)FLT_MIN);
    }
    return true;
}

bool lut_request_check(const struct lut_request *request, dipole_status *status)
{
    if (!(request->epsilon >= LUT_EPSILON_MIN && request->epsilon <= LUT_EPSILON_MAX))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "epsilon is %g, expected %g to %g",
                           request->epsilon, LUT_EPSILON_MIN, LUT_EPSILON_MAX);
    if (request->is_half && request->epsilon <= LUT_HALF_ROUNDING)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "epsilon is %g, expected > %.2g for a half table (half rounds by as much); use "
                           "float",
                           request->epsilon, LUT_HALF_ROUNDING);
    const size_t limit = request->kind == LUT_SPLAT2D ? LUT_ROW_LIMIT : 1;
    return (request->material_count >= 1 && request->material_count <= limit) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%zu materials, expected 1 to %zu",
                       request->material_count, limit);
}

/* ---- numbers ------------------------------------------------------------------------------------ */

double lut_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/* The value that would stand at index if values were sorted (Hoare's selection); reorders them. */
static double select_at(double *values, size_t count, size_t index)
{
    size_t low = 0, high = count - 1;
    while (low < high) {
        const double pivot = values[low + (high - low) / 2];
        size_t i = low, j = high;
        while (i <= j) {
            while (values[i] < pivot)
                i++;
            while (values[j] > pivot)
                j--;
            if (i > j)
                break;
            const double value = values[i];
            values[i++] = values[j];
            values[j] = value;
            if (j == 0)
                break;
            j--;
        }
        if (index <= j)
            high = j;
        else if (index >= i)
            low = i;
        else
            return values[index];
    }
    return values[index];
}

struct lut_error lut_error_of(double *errors, size_t count)
{
    assert(count > 0);
    double most = 0;
    for (size_t i = 0; i < count; i++) {
        errors[i] = isnan(errors[i]) ? INFINITY : errors[i]; /* no value is the worst one */
        most = fmax(most, errors[i]);
    }
    return (struct lut_error){ .max = most, .p99 = select_at(errors, count, (count * 99 + 99) / 100 - 1) };
}
