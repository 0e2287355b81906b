/*
 * What work costs, for the plan's predictions: measured with llvmpipe on two cores of an AMD EPYC, quiet.
 * Another machine is faster or slower, not in all alike: a calibration says how (calibration.h).
 */
#ifndef RENDERER_COST_H
#define RENDERER_COST_H

#include "renderer/gather.h"
#include "renderer/plan.h"

#include <math.h>

/* Of the first picture alone: a program that is compiled or found in a cache, and first run; what makes the
 * levels of maps, the same. */
#define RENDER_COST_PROGRAM_MS 5.0
#define RENDER_COST_LEVELS_MS 60.0

#define RENDER_COST_BESIDE_MS 20.0 /* beside effects: tables baked, functions of OpenGL loaded */

/* Nanoseconds each. */
#define RENDER_COST_BESIDE_PIXEL 30.0  /* read back and put into the picture           */
#define RENDER_COST_TRIANGLE 90.0      /* drawn once, whatever it covers               */
#define RENDER_COST_TRIANGLE_4 170.0   /* the same, where pixels have four points      */
#define RENDER_COST_EMPTY_PIXEL 12.0   /* cleared and looked at                        */
#define RENDER_COST_SURFACE_PIXEL 80.0 /* covered: four points found, one resolved     */
#define RENDER_COST_VIEW_TEXEL 0.5     /* of a light's view, cleared                   */
#define RENDER_COST_LIT_TEXEL 17.0     /* the same, drawn                              */
#define RENDER_COST_REST_TEXEL 9.0     /* and where it is at rest                      */
#define RENDER_COST_SAMPLED_TEXEL 6.5  /* of the view, put into samples                */
#define RENDER_COST_TOLD_TEXEL 3.0     /* and told apart by its object                 */
#define RENDER_COST_CELL_TEXEL 11.0    /* and sorted into cubes at rest                */
#define RENDER_COST_READ_TEXEL 2.0     /* and read back: each texture of them          */
#define RENDER_COST_PICTURE_TEXEL 12.0 /* of one drawn in memory, and the same    */
#define RENDER_COST_PICTURE_TRIANGLE 30.0
#define RENDER_COST_WHOLE_TEXEL 7.0       /* of a whole one, kept and taken to OpenGL */
#define RENDER_COST_DRAWN_TEXEL 12.0      /* the same, where it shows an object       */
#define RENDER_COST_DRAWN_REST 6.0        /* and where it is at rest                  */
#define RENDER_COST_SHADOW_PIXEL 100.0    /* covered, lit and shaded at one point         */
#define RENDER_COST_GLOSS_PIXEL 260.0     /* the same, some at four                       */
#define RENDER_COST_COMPOSITE_PIXEL 45.0  /* covered                                      */
#define RENDER_COST_SPLAT_EVALUATION 2.8  /* one sample at one pixel                      */
#define RENDER_COST_SPLAT_FRAGMENT 12.0   /* one pixel of a splat of one sample    */
#define RENDER_COST_GATHER_EVALUATION 0.9 /* one merged sample at one place               */
#define RENDER_COST_GREY_SHARE 0.6        /* of an evaluation, where channels are alike */
#define RENDER_COST_GATHER_PIXEL 30.0     /* interpolated                                 */
#define RENDER_COST_GATHER_SAMPLE 135.0   /* ordered and merged                           */
#define RENDER_COST_GATHER_PLACE 85.0     /* read back, its tile's lists made     */
#define RENDER_COST_GATHER_GL 6.5         /* one merged sample at one place, by llvmpipe        */
#define RENDER_COST_MAP_TEXEL 37.0        /* of a translucent shadow map: drawn, levels made  */
#define RENDER_COST_MAP_SAMPLE 66.0       /* one sample of a map at one point             */
#define RENDER_COST_MAP_LAYER 25.0        /* each layer that it looks into                */
#define RENDER_COST_MAP_CELL 40.0         /* one cell of the local response at one pixel  */
#define RENDER_COST_MAP_EVALUATION 20.0   /* one texel of a map at one pixel              */
#define RENDER_COST_DEFORMED_VERTEX 50.0  /* posed once for all passes                    */
#define RENDER_COST_MOVED_VERTEX 40.0
#define RENDER_COST_SKY_SAMPLE 2600.0      /* of the environment: its patches cut and put together */
#define RENDER_COST_SKY_TRIANGLE 95.0      /* that is cut, at the least                  */
#define RENDER_COST_SKY_PATCH 140.0        /* one texel of a peeled layer put into a sample */
#define RENDER_COST_PEEL_TRIANGLE 60.0     /* drawn into a layer                         */
#define RENDER_COST_PEEL_TEXEL 125.0       /* of a layer, drawn, read back and looked at */
#define RENDER_COST_SKY_NODE 10.0          /* of a table of irradiance, put in its place */
#define RENDER_COST_SKY_TERM 0.9           /* of the orders m that each of them sums     */
#define RENDER_COST_SKY_PIXEL 35.0         /* irradiance looked up by a shader           */
#define RENDER_COST_RAY 125.0              /* through the scene's triangles              */
#define RENDER_COST_TREE_TRIANGLE 330.0    /* of the tree that they are traced through */
#define RENDER_COST_BLOCKER_TRIANGLE 155.0 /* drawn into a map or a list               */
#define RENDER_COST_BLOCKER_SURFACE 120.0  /* in one texel: listed, sorted, its curve made */
#define RENDER_COST_CURVE_TEXEL 10.0       /* of a map of curves, taken to OpenGL          */
#define RENDER_COST_SHADOW_TEXEL 4.0       /* of a map, cleared and drawn; looked at       */
#define RENDER_COST_SHADOW_POINT 60.0      /* whose shadow is asked for                    */
#define RENDER_COST_CURVE_POINT 120.0      /* the same, more where there are curves        */
#define RENDER_COST_SHADOW_BLOCK 120.0     /* of a light's view: its point and normal      */
#define RENDER_COST_SHADOW_TAP 20.0        /* of the search or of the filter               */
#define RENDER_COST_CURVE_TAP 60.0         /* the same through curves                      */
#define RENDER_COST_HARD_TEXEL 5.0         /* one of those that a hard shadow is filtered over */
#define RENDER_COST_SCREEN_PIXEL 6.0       /* touched by a simple pass                     */
#define RENDER_COST_POINTS_PIXEL 180.0     /* whose four points are looked at */

/* What a shader takes with a GPU, of what llvmpipe takes: assumed, none was at hand. */
#define RENDER_COST_GPU_SHARE 0.02

static inline double render_cost_ms(double ns_each, double count)
{
    return 1e-6 * ns_each * count;
}

static inline double render_cost_pixels(const struct render_plan *plan)
{
    return (double)plan->width_px * plan->height_px;
}

/* Texels of all lights' views. */
static inline double render_cost_view_texels(const struct render_plan *plan)
{
    double count = 0;
    for (size_t i = 0; i < plan->view_count; i++)
        count += (double)plan->views[i].size_px * plan->views[i].size_px;
    return count;
}

/* Those of them that show an object, about: a quarter of a convex surface is what light sees of it. */
static inline double render_cost_lit_texels(const struct render_plan *plan)
{
    double count = 0;
    for (size_t v = 0; v < plan->view_count; v++) {
        const struct render_plan_view *const view = &plan->views[v];
        const double most = (double)view->size_px * view->size_px;
        double of_view = 0;
        for (size_t i = 0; i < plan->media->object_count; i++) {
            double in_view_mm[3], texel_mm2 = view->texel_area;
            render_projection_to_view(&view->projection, plan->objects[i].ball.centre_mm, in_view_mm);
            if (!view->projection.is_orthographic)
                texel_mm2 *= in_view_mm[2] * in_view_mm[2];
            if (in_view_mm[2] > 0)
                of_view += 0.25 * plan->media->area_mm2[i] / texel_mm2;
        }
        count += fmin(of_view, most);
    }
    return count;
}

/* Shadow factors at so many points of each view, of those that something may hide. */
static inline double render_cost_shadow_points_ms(const struct render_plan *plan, size_t view,
                                                  double point_count)
{
    const struct render_plan_shadow *const shadow = &plan->shadows.of_view[view];
    const double tap = plan->shadows.translucent_count > 0 ? RENDER_COST_CURVE_TAP : RENDER_COST_SHADOW_TAP;
    const double taps = shadow->light_size > 0 ? tap * shadow->share * 2 * plan->shadows.tap_count
                                               : RENDER_COST_HARD_TEXEL * 16;
    const double curves = plan->shadows.translucent_count > 0 ? RENDER_COST_CURVE_POINT : 0;
    return render_cost_ms(RENDER_COST_SHADOW_POINT + curves + taps, point_count);
}

/* Texels of all translucent shadow maps; the time of the pattern's samples at some points; and pixels that
 * gather from them, of each map its object's. */
static inline double render_cost_map_texels(const struct render_plan *plan)
{
    double count = 0;
    for (size_t i = 0; i < plan->map_count; i++)
        count += (double)plan->maps[i].size_px * plan->maps[i].size_px;
    return count;
}

static inline double render_cost_map_samples_ms(const struct render_plan *plan, double point_count)
{
    const int samples = plan->tsm.sample_count > 0 ? plan->tsm.sample_count : RENDER_TSM_USUAL_SAMPLES;
    return render_cost_ms(RENDER_COST_MAP_SAMPLE + RENDER_COST_MAP_LAYER * plan->tsm.layer_count,
                          samples * point_count);
}

static inline double render_cost_map_pixels(const struct render_plan *plan)
{
    double count = 0;
    for (size_t i = 0; i < plan->map_count; i++)
        count += plan->objects[plan->maps[i].object].pixel_count;
    return count;
}

/* Samples that pixels sum, band by band: those within the band's reach of a pixel, on the lit half of its
 * object, for each light. Splats reach farther than each of their samples; samples lie closer than asked.
 */
static inline double render_cost_splat_evaluations(const struct render_plan *plan)
{
    const double pi = 3.14159265358979323846, excess = 2.5, sky_excess = 5;
    const double excess_by_lights = excess * (double)plan->lit_count;
    const double around = plan->has_environment ? sky_excess : 0;
    double count = 0;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const struct render_plan_object *const object = &plan->objects[i];
        const struct render_plan_medium *const medium = &plan->of_medium[object->medium];
        const double lit_mm2 = 0.5 * plan->media->area_mm2[i];
        for (int b = 0; b < medium->band_count; b++) {
            const struct render_band *const band = &medium->bands[b];
            const double reached_mm2 = pi * band->r_outer_mm * band->r_outer_mm;
            const double area_mm2 = reached_mm2 < lit_mm2 ? reached_mm2 : lit_mm2;
            const double around_mm2 = reached_mm2 < 2 * lit_mm2 ? reached_mm2 : 2 * lit_mm2;
            count += object->pixel_count * (excess_by_lights * area_mm2 + around * around_mm2) /
                     (band->spacing_mm * band->spacing_mm);
        }
    }
    return count;
}

static inline double render_cost_splats_ms(const struct render_plan *plan)
{
    return plan->has_grid
               ? render_cost_ms(RENDER_COST_SPLAT_FRAGMENT, render_plan_grid_fragments(plan))
               : render_cost_ms(RENDER_COST_SPLAT_EVALUATION, render_cost_splat_evaluations(plan));
}

/* Surface in squares as wide as the samples' spacing. */
static inline double render_cost_sky_squares(const struct render_plan *plan)
{
    double count = 0;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const double spacing_mm = plan->objects[i].spacing_mm;
        if (spacing_mm > 0)
            count += plan->media->area_mm2[i] / (spacing_mm * spacing_mm);
    }
    return count;
}

/* Samples of the environment's light: cubes of 0.7 of the spacing that a curved surface passes through, two
 * to a square on a plane along the axes. */
static inline double render_cost_sky_samples(const struct render_plan *plan)
{
    return plan->has_environment ? 3 * render_cost_sky_squares(plan) : 0;
}

static inline double render_cost_rays_ms(const struct render_plan *plan, int ray_count)
{
    return render_cost_ms(RENDER_COST_RAY * ray_count, render_cost_sky_samples(plan));
}

/* Of triangles; and what hides the environment from their samples, if that is asked for. */
static inline double render_cost_sky_samples_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_SKY_SAMPLE, render_cost_sky_samples(plan)) +
           render_cost_ms(RENDER_COST_SKY_TRIANGLE, (double)plan->triangle_count) +
           render_cost_rays_ms(plan, plan->visibility_ray_count);
}

/* The same of layers peeled along so many axes: of a convex body three, the last of which shows nothing.
 * Along three, texels of facets that face another axis more are left out. */
static inline double render_cost_sky_peel_ms(const struct render_plan *plan)
{
    const double views = 3 * plan->peel_axis_count;
    const double share = RENDER_PEEL_SHARE * RENDER_PEEL_SHARE;
    double texels = 0;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const double side_px = render_plan_peel_side_px(plan, i);
        texels += side_px * side_px;
    }
    return render_cost_ms(views * RENDER_COST_PEEL_TEXEL, texels) +
           render_cost_ms(views * RENDER_COST_PEEL_TRIANGLE, (double)plan->triangle_count) +
           render_cost_ms((plan->peel_axis_count == 1 ? 0.5 : 0.83) / share * RENDER_COST_SKY_PATCH,
                          render_cost_sky_squares(plan)) +
           render_cost_rays_ms(plan, plan->visibility_ray_count);
}

/* Light samples of all lights, about. */
static inline double render_cost_samples(const struct render_plan *plan)
{
    const double excess = 2;
    double count = 0;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const double spacing_mm = plan->objects[i].spacing_mm;
        if (spacing_mm > 0)
            count += 0.5 * plan->media->area_mm2[i] / (spacing_mm * spacing_mm);
    }
    return excess * (double)plan->lit_count * count + render_cost_sky_samples(plan);
}

/* Places at which a band is summed, for each pixel of an object: at the level that how far apart they may
 * be (T43) leads to, and at each below it where surfaces are at a slant or end. For the bounds, third
 * derivatives are taken for 1/cap^3 of what is lit and 1/change^3 of what is there, second ones for
 * 0.4/cap^2 and 1/change^2. */
static inline double render_cost_gather_places(const struct render_plan *plan, enum render_gather gather,
                                               const struct render_plan_object *object, int band)
{
    const double edge_px = 6; /* times the square root of the pixels: those that lie at edges */
    const struct render_plan_medium *const medium = &plan->of_medium[object->medium];
    const double pixel_mm = render_plan_pixel_mm(plan, object);
    const double lit_mm = medium->bands[band].cap_mm, own_mm = medium->change_mm[band];
    const double lit_epsilon = plan->interpolation_epsilon, own_epsilon = plan->own_epsilon;
    const double apart_mm = gather == RENDER_GATHER_C
                                ? fmin(cbrt(12 * lit_epsilon) * lit_mm, cbrt(12 * own_epsilon) * own_mm)
                                : fmin(sqrt(5 * lit_epsilon) * lit_mm, sqrt(2 * own_epsilon) * own_mm);
    const double apart_px = apart_mm / pixel_mm;
    if (apart_px < 2)
        return 1;
    const int level = (int)fmin(floor(log2(apart_px)), RENDER_GATHER_LEVELS - 1);
    const double at_edges = 2 * (1 - ldexp(1, -level)) * edge_px / sqrt(fmax(object->pixel_count, 1));
    return fmin(ldexp(1, -2 * level) + level / (apart_px * apart_px) + at_edges, 1);
}

/* The same of gathering, band by band. */
static inline double render_cost_gather_evaluations(const struct render_plan *plan,
                                                    enum render_gather gather)
{
    const double pi = 3.14159265358979323846, excess = 1.1, around = plan->has_environment ? 1 : 0;
    double count = 0;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const struct render_plan_object *const object = &plan->objects[i];
        const struct render_plan_medium *const medium = &plan->of_medium[object->medium];
        const double lit_mm2 = 0.5 * plan->media->area_mm2[i];
        const double share =
            gather == RENDER_GATHER_C && render_medium_is_grey(&plan->media->media[object->medium])
                ? RENDER_COST_GREY_SHARE
                : 1;
        for (int b = 0; b < medium->band_count; b++) {
            const struct render_band *const band = &medium->bands[b];
            const double reached_mm2 = pi * band->r_outer_mm * band->r_outer_mm;
            const double area_mm2 = (plan->lit_count > 0 || around == 0 ? fmin(reached_mm2, lit_mm2) : 0) +
                                    around * fmin(reached_mm2, 2 * lit_mm2);
            count += share * render_cost_gather_places(plan, gather, object, b) * object->pixel_count *
                     area_mm2 / (band->spacing_mm * band->spacing_mm);
        }
    }
    return excess * count;
}

static inline double render_cost_gather_ms(const struct render_plan *plan, enum render_gather gather,
                                           bool has_gpu)
{
    const double evaluations = render_cost_gather_evaluations(plan, gather);
    const double samples_ms = render_cost_ms(RENDER_COST_GATHER_SAMPLE, render_cost_samples(plan));
    if (gather == RENDER_GATHER_GL)
        return samples_ms + render_cost_ms(RENDER_COST_GATHER_PLACE, plan->covered_px) +
               render_cost_ms((has_gpu ? RENDER_COST_GPU_SHARE : 1) * RENDER_COST_GATHER_GL, evaluations);
    return samples_ms + render_cost_ms(RENDER_COST_GATHER_PIXEL, plan->covered_px) +
           render_cost_ms(RENDER_COST_GATHER_EVALUATION, evaluations) +
           render_cost_ms(RENDER_COST_SCREEN_PIXEL, 4 * render_cost_pixels(plan));
}

#endif
