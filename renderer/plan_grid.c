/* Splats over a uniform grid of each light's view, as Shah, Konttinen and Pattanaik 2009 draw them: how
 * fine it is, and what error it leaves. theory.md T44. */
#include "renderer/plan_internal.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Slopes that are looked at: cosines of 2^(-i/SLOPE_STEPS), down to 1/64, where little light enters any
 * more. */
enum { SLOPE_STEPS = 8, SLOPE_COUNT = 6 * SLOPE_STEPS };

/* Waves that are added up: each way at most so many, and until one is so small a part of the sum. */
enum { WAVE_LIMIT = 256 };
#define WAVE_PART 1e-4

/* All waves of a grid but the mean, where all are at their crests. */
static double sum_waves(const dipole_stack *stack, double along_per_mm, double across_per_mm)
{
    double sum = 0;
    for (int n = 0; n < WAVE_LIMIT; n++) {
        double row = 0;
        for (int m = n == 0; m < WAVE_LIMIT; m++) {
            const double count = (m > 0 ? 2 : 1) * (n > 0 ? 2 : 1);
            const double wave = count * dipole_stack_spectrum(stack, DIPOLE_FACE_LIT,
                                                              hypot(m * along_per_mm, n * across_per_mm));
            row += wave;
            if (m > 0 && wave <= WAVE_PART * (sum + row))
                break;
        }
        sum += row;
        if (n > 0 && row <= WAVE_PART * sum)
            break;
    }
    return sum;
}

double render_plan_grid_aliasing(const dipole_stack *stack, double texel_mm)
{
    const double k_per_mm = 2 * PI / texel_mm, eta = dipole_stack_layer(stack, 0)->medium.eta;
    double worst = 0;
    for (int i = 0; i <= SLOPE_COUNT; i++) {
        const double cosine = exp2(-(double)i / SLOPE_STEPS);
        const double enters =
            (1 - dipole_fresnel_reflectance(eta, cosine)) / (1 - dipole_fresnel_reflectance(eta, 1));
        worst = fmax(worst, cosine * enters * sum_waves(stack, k_per_mm * cosine, k_per_mm));
    }
    return worst / dipole_stack_total(stack, DIPOLE_FACE_LIT);
}

/* Of the channels that scatter, the largest. */
static double medium_aliasing(const struct render_medium *medium, double texel_mm)
{
    double worst = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            worst = fmax(worst, render_plan_grid_aliasing(medium->stacks[c], texel_mm));
    }
    return worst;
}

/* The texel that keeps aliasing at epsilon on all slopes. */
static double texel_for_slopes_mm(const struct render_medium *medium, double epsilon, double facing_mm)
{
    double low_mm = facing_mm, high_mm = facing_mm;
    for (int i = 0; i < 40 && medium_aliasing(medium, low_mm) > epsilon; i++) {
        high_mm = low_mm;
        low_mm *= 0.5;
    }
    while (high_mm > 1.01 * low_mm) {
        const double middle_mm = sqrt(low_mm * high_mm);
        if (medium_aliasing(medium, middle_mm) > epsilon)
            high_mm = middle_mm;
        else
            low_mm = middle_mm;
    }
    return low_mm;
}

/* What surfaces that face the light need: T11, without the blur that may replace it, and as many samples
 * across a shape as ever. */
static double facing_mm(const struct render_plan *plan, size_t medium)
{
    return fmin(render_medium_spacing_mm(&plan->media->media[medium], plan->aliasing_epsilon, 0),
                plan->of_medium[medium].wanted_mm);
}

/* Of the narrowest medium that is seen. */
static double narrowest_mm(const struct render_plan *plan)
{
    double narrowest = INFINITY;
    for (size_t m = 0; m < plan->media->count; m++) {
        if (plan->of_medium[m].wanted_mm > 0)
            narrowest = fmin(narrowest, facing_mm(plan, m));
    }
    return isinf(narrowest) ? plan->spacing_mm : narrowest;
}

/* Of a view, at its far end. */
static double width_mm(const struct render_projection *projection)
{
    return 2 * projection->half_width * (projection->is_orthographic ? 1 : projection->far_mm);
}

bool render_plan_check_grid(const struct render_request *request, dipole_status *status)
{
    const int n = request->splat_grid;
    return n == 0 || n == RENDER_SPLAT_GRID_AUTO ||
           (n >= RENDER_SPLAT_GRID_MIN && n <= RENDER_SPLAT_GRID_MAX) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                       "splat_grid is %d, expected auto, 0 or %d to %d texels a side", n,
                       RENDER_SPLAT_GRID_MIN, RENDER_SPLAT_GRID_MAX);
}

/* Of all views alike, in texels a side. */
static int side_limit_px(const struct render_plan *plan)
{
    const double share_px = sqrt((double)RENDER_LIGHT_SAMPLE_LIMIT / (double)plan->view_count);
    return (int)fmin(share_px, RENDER_SPLAT_GRID_MAX);
}

bool render_plan_choose_grids(const struct render_request *request, struct render_plan *plan,
                              dipole_status *status)
{
    const int limit_px = side_limit_px(plan);
    if (request->splat_grid > limit_px)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, NULL,
            "splat_grid is %d, expected at most %d: the lights have %zu views, of %zu texels in all",
            request->splat_grid, limit_px, plan->view_count, RENDER_LIGHT_SAMPLE_LIMIT);
    for (size_t i = 0; i < plan->view_count; i++) {
        struct render_plan_view *const view = &plan->views[i];
        double side_px = request->splat_grid;
        if (request->splat_grid == RENDER_SPLAT_GRID_AUTO)
            side_px = ceil(width_mm(&view->projection) / narrowest_mm(plan) * (1 - 1e-9));
        view->size_px = (int)fmax(fmin(side_px, limit_px), RENDER_SPLAT_GRID_MIN);
        view->block_px = 1;
        const double texel = 2 * view->projection.half_width / view->size_px;
        view->texel_area = texel * texel;
    }
    return true;
}

/* Texels a side of the widest view, so that they are texel_mm wide. */
static double side_for(const struct render_plan *plan, double texel_mm)
{
    double widest_mm = 0;
    for (size_t i = 0; i < plan->view_count; i++)
        widest_mm = fmax(widest_mm, width_mm(&plan->views[i].projection));
    return ceil(widest_mm / texel_mm * (1 - 1e-9));
}

void render_plan_settle_grid(struct render_plan *plan, size_t index, double texel_mm)
{
    const struct render_medium *const medium = &plan->media->media[index];
    struct render_plan_medium *const planned = &plan->of_medium[index];
    const double reach_mm = planned->r_max_mm;
    planned->band_count = render_bands_make(planned->spacing_mm, reach_mm, INFINITY, planned->bands);
    plan->band_count = planned->band_count;
    plan->grid_texel_mm = texel_mm;
    planned->aliasing_error = medium_aliasing(medium, texel_mm);
    if (plan->has_environment) /* whose samples follow the surface, but are not blurred either */
        planned->aliasing_error =
            fmax(planned->aliasing_error, medium_aliasing(medium, planned->spacing_mm));
    if (planned->aliasing_error <= plan->aliasing_epsilon * (1 + 1e-6))
        return;
    const double facing = facing_mm(plan, index);
    const double sloped_mm = texel_for_slopes_mm(medium, plan->aliasing_epsilon, facing);
    render_plan_add_note(
        plan,
        "the grid undersamples material \"%.60s\": texels %.3g mm wide leave an error of up to "
        "%.2g, %.2g was asked; surfaces that face the light need N = %.0f, slopes N = %.0f",
        medium->material->name, texel_mm, planned->aliasing_error, plan->aliasing_epsilon,
        side_for(plan, facing), side_for(plan, sloped_mm));
}

double render_plan_grid_fragments(const struct render_plan *plan)
{
    double count = 0;
    for (size_t v = 0; v < plan->view_count; v++) {
        const struct render_plan_view *const view = &plan->views[v];
        for (size_t i = 0; i < plan->media->object_count; i++) {
            const struct render_plan_object *const object = &plan->objects[i];
            const struct render_plan_medium *const medium = &plan->of_medium[object->medium];
            double in_view_mm[3], texel_mm2 = view->texel_area;
            render_projection_to_view(&view->projection, object->ball.centre_mm, in_view_mm);
            if (!view->projection.is_orthographic)
                texel_mm2 *= in_view_mm[2] * in_view_mm[2];
            if (medium->band_count == 0 || in_view_mm[2] < 0 || (view->is_cube_face && !(texel_mm2 > 0)))
                continue;
            /* A convex shape's shadow is a quarter of its surface, on average; a square of r_max a side. */
            const double area_mm2 = plan->media->area_mm2[i];
            const double reached_mm2 = 4 * medium->r_max_mm * medium->r_max_mm;
            count +=
                object->pixel_count * 0.25 * area_mm2 / texel_mm2 * fmin(2 * reached_mm2 / area_mm2, 1);
        }
    }
    return count;
}
