/* What the lights see: how many views, where from, how finely. */
#include "renderer/frusta.h"
#include "renderer/light_samples.h"
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdlib.h>

/* Cells of a light's view are so wide, as part of the spacing: surfaces up to 45 degrees from facing the
 * light need not be split, and few are sampled more densely than they need. */
#define CELL_SHARE 0.7

enum {
    VIEW_SIDE_WANTED = 768, /* shadows are drawn from the same view, so it never is coarser if it can */
    CELL_WANTED = 4, /* texels a side of a cell in the middle of the depths: slopes are sampled by fewer */
};

/* A texel of margin on each side, so that no edge is lost to rounding. */
static const double margin = 1 + 2.0 / VIEW_SIDE_WANTED;

/* By how many levels the blocks of the coarsest medium may be larger than those of the narrowest. */
static int levels_of_coarsest(const struct render_plan *plan)
{
    double coarsest_mm = plan->spacing_mm;
    for (size_t m = 0; m < plan->media->count; m++)
        coarsest_mm = fmax(coarsest_mm, plan->of_medium[m].spacing_mm);
    return (int)log2(coarsest_mm / plan->spacing_mm);
}

/* Views of all lights together must not have too many texels; but shadows want some. */
static int side_limit_px(const struct render_plan *plan)
{
    const double share_px = sqrt((double)RENDER_LIGHT_SAMPLE_LIMIT / (double)plan->view_count);
    return (int)fmin(fmax(share_px, VIEW_SIDE_WANTED), RENDER_VIEW_SIDE_LIMIT);
}

/* Texels of a view so wide (at its far end) that blocks of them are at most the spacing wide there; where
 * the surface is nearer, blocks of more of them are as wide. T45 */
static void choose_view_size(const struct render_plan *plan, struct render_plan_view *view)
{
    const struct render_projection *const projection = &view->projection;
    const double width_mm =
        2 * projection->half_width * (projection->is_orthographic ? 1 : projection->far_mm);
    /* shadows alone want no more than a picture shows of them */
    const double spacing_mm =
        render_plan_sums_samples(plan) ? plan->spacing_mm : fmax(plan->spacing_mm, plan->least_pixel_mm);
    const double cells = ceil(width_mm / (CELL_SHARE * spacing_mm) * (1 - 1e-9));
    const int limit_px = side_limit_px(plan);
    const int cell_count = cells >= limit_px ? limit_px : cells < 1 ? 1 : (int)cells;
    const bool is_narrow = !projection->is_orthographic && !view->is_cube_face;
    const double middle = is_narrow ? sqrt(projection->near_mm / projection->far_mm) : 1;
    const int wanted_px = (int)fmax(round(CELL_WANTED * middle), 2);
    int cell_px = (VIEW_SIDE_WANTED + cell_count - 1) / cell_count;
    cell_px = cell_px > wanted_px ? cell_px : wanted_px;
    cell_px = cell_px * cell_count > limit_px ? limit_px / cell_count : cell_px;
    view->size_px = cell_count * cell_px;
    const double nearer =
        projection->is_orthographic ? 0 : ceil(log2(projection->far_mm / projection->near_mm));
    double block_px = cell_px * exp2(levels_of_coarsest(plan) + nearer);
    while (block_px > RENDER_LIGHT_BLOCK_LIMIT)
        block_px /= 2;
    view->block_px = (int)ceil(block_px);
    const double texel = 2 * projection->half_width / view->size_px;
    view->texel_area = texel * texel;
}

/* One view or six of a light; returns how many. */
static size_t light_views(const struct io_scene *scene, const struct render_plan *plan, size_t light,
                          struct render_plan_view *views)
{
    const struct io_light *const source = &scene->lights[light];
    struct render_projection frusta[RENDER_FACES];
    size_t count = 1;
    if (source->kind == IO_LIGHT_POINT)
        count = render_frusta_of_point(source->position_mm, &plan->ball, margin, 1, frusta);
    if (count == 1 && source->kind == IO_LIGHT_POINT)
        render_frustum_narrow(scene->objects, scene->object_count, margin, &frusta[0]);
    else if (source->kind != IO_LIGHT_POINT)
        render_frustum_of_parallel(source->direction, scene->objects, scene->object_count, &plan->ball,
                                   margin, frusta);
    for (size_t i = 0; i < count; i++)
        views[i] = (struct render_plan_view){
            .light = light, .projection = frusta[i], .is_cube_face = count > 1, .face = (int)i
        };
    return count;
}

double render_plan_widest_spacing_mm(const struct render_plan *plan)
{
    double widest_mm = 0;
    for (size_t i = 0; i < plan->view_count; i++) {
        const struct render_plan_view *const view = &plan->views[i];
        const double far_mm = view->projection.is_orthographic ? 1 : view->projection.far_mm;
        widest_mm = fmax(widest_mm, 2 * view->projection.half_width * far_mm / view->size_px);
    }
    return widest_mm;
}

/* Where OpenGL is software, drawing in memory is several times faster, and nothing is read back. */
static bool can_draw_in_memory(const struct render_request *request, const struct render_plan *plan)
{
    return !request->has_gpu && plan->area == RENDER_AREA_FLUX;
}

bool render_plan_keeps_pictures(const struct render_plan *plan)
{
    const bool is_read =
        plan->technique == RENDER_TECHNIQUE_LAMBERT || plan->coherence == RENDER_COHERENCE_SURFACE;
    return plan->has_light_pictures && (plan->has_specular || (plan->has_scattering && is_read));
}

bool render_plan_make_views(const struct render_request *request, struct render_plan *plan,
                            dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (plan->lit_count == 0)
        return true;
    plan->views = calloc(6 * plan->lit_count, sizeof *plan->views);
    if (!plan->views)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the views of %zu lights",
                           plan->lit_count);
    for (size_t i = 0; i < scene->light_count; i++) {
        if (render_light_shines(&scene->lights[i]))
            plan->view_count += light_views(scene, plan, i, &plan->views[plan->view_count]);
    }
    if (plan->has_grid)
        return render_plan_choose_grids(request, plan, status);
    for (size_t i = 0; i < plan->view_count; i++)
        choose_view_size(plan, &plan->views[i]);
    plan->has_light_pictures = can_draw_in_memory(request, plan);
    return true;
}
