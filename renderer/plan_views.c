/* What the lights see: how many views, where from, how finely. */
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Cells of a light's view are so wide, as part of the spacing: surfaces up to 45 degrees from facing the
 * light need not be split, and few are sampled more densely than they need. */
#define CELL_SHARE 0.7

enum {
    VIEW_SIDE_WANTED = 768, /* shadows are drawn from the same view, so it never is coarser if it can */
    LEVELS_WANTED = 2,
    LEVELS_LIMIT = 12,
    BLOCK_LEVELS_LIMIT = 7, /* blocks are searched once for each level: larger ones save few samples */
};

/* A point light this wide or less, seen from it, gets one view; a wider scene six. */
#define SINGLE_VIEW_ANGLE_RAD (100 * PI / 180)

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
 * the surface is nearer, blocks of more of them are as wide. */
static void choose_view_size(const struct render_plan *plan, struct render_plan_view *view)
{
    const struct render_projection *const projection = &view->projection;
    const double width_mm =
        2 * projection->half_width * (projection->is_orthographic ? 1 : projection->far_mm);
    const double cells = ceil(width_mm / (CELL_SHARE * plan->spacing_mm) * (1 - 1e-9));
    const int limit_px = side_limit_px(plan);
    const int cell_count = cells >= limit_px ? limit_px : cells < 1 ? 1 : (int)cells;
    int levels = LEVELS_WANTED;
    while (levels < LEVELS_LIMIT && cell_count << levels < VIEW_SIDE_WANTED)
        levels++;
    while (levels > 0 && cell_count << levels > limit_px)
        levels--;
    view->size_px = cell_count << levels;
    const double nearer =
        projection->is_orthographic ? 0 : ceil(log2(projection->far_mm / projection->near_mm));
    view->levels = (int)fmin(levels + levels_of_coarsest(plan) + nearer, BLOCK_LEVELS_LIMIT);
    const double texel = 2 * projection->half_width / view->size_px;
    view->texel_area = texel * texel;
}

static struct render_plan_view directional_view(const struct io_scene *scene,
                                                const struct render_plan *plan, size_t light)
{
    struct render_plan_view view = { .light = light, .projection = { .is_orthographic = true } };
    const double up[3] = { 0, 1, 0 };
    render_projection_aim(&view.projection, scene->lights[light].direction, up);
    double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_mesh *const mesh = scene->objects[i].mesh;
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            const float *const p = &mesh->positions[3 * v];
            const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
            double in_view[3];
            render_projection_to_view(&view.projection, position_mm, in_view);
            for (int k = 0; k < 3; k++) {
                min[k] = fmin(min[k], in_view[k]);
                max[k] = fmax(max[k], in_view[k]);
            }
        }
    }
    /* A texel of margin on each side, so that no edge is lost to rounding. */
    const double margin = 1 + 2.0 / VIEW_SIDE_WANTED, slack_mm = 1e-3 * plan->ball.radius_mm;
    const double half = 0.5 * fmax(max[0] - min[0], max[1] - min[1]) * margin;
    view.projection.half_width = view.projection.half_height = fmax(half, slack_mm);
    view.projection.near_mm = slack_mm;
    view.projection.far_mm = max[2] - min[2] + 3 * slack_mm;
    for (int k = 0; k < 3; k++)
        view.projection.eye_mm[k] = 0.5 * (min[0] + max[0]) * view.projection.right[k] +
                                    0.5 * (min[1] + max[1]) * view.projection.up[k] +
                                    (min[2] - 2 * slack_mm) * view.projection.forward[k];
    return view;
}

/* Fill one view or six; returns how many. */
static size_t point_views(const struct io_scene *scene, const struct render_plan *plan, size_t light,
                          struct render_plan_view views[6])
{
    const double *const position_mm = scene->lights[light].position_mm;
    double toward[3], up[3] = { 0, 1, 0 };
    for (int k = 0; k < 3; k++)
        toward[k] = plan->ball.centre_mm[k] - position_mm[k];
    const double distance_mm = sqrt(render_dot(toward, toward)), radius_mm = plan->ball.radius_mm;
    struct render_plan_view view = { .light = light };
    memcpy(view.projection.eye_mm, position_mm, sizeof view.projection.eye_mm);
    view.projection.far_mm = (distance_mm + radius_mm) * 1.001;
    view.projection.near_mm = fmax((distance_mm - radius_mm) * 0.999, 1e-4 * radius_mm);

    if (distance_mm > radius_mm && 2 * asin(radius_mm / distance_mm) <= SINGLE_VIEW_ANGLE_RAD) {
        for (int k = 0; k < 3; k++)
            toward[k] /= distance_mm;
        render_projection_aim(&view.projection, toward, up);
        view.projection.half_width = view.projection.half_height =
            tan(asin(radius_mm / distance_mm)) * (1 + 2.0 / VIEW_SIDE_WANTED);
        views[0] = view;
        return 1;
    }
    view.is_cube_face = true;
    view.projection.near_mm *= 0.577; /* the corner of a face is sqrt(3) times as far away as it is deep */
    view.projection.half_width = view.projection.half_height = 1;
    for (int face = 0; face < 6; face++) {
        double forward[3] = { 0, 0, 0 };
        forward[face / 2] = face % 2 ? -1 : 1;
        up[1] = face / 2 != 1;
        up[2] = face / 2 == 1;
        views[face] = view;
        views[face].face = face;
        render_projection_aim(&views[face].projection, forward, up);
    }
    return 6;
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
        if (!render_light_shines(&scene->lights[i]))
            continue;
        struct render_plan_view *const view = &plan->views[plan->view_count];
        if (scene->lights[i].kind == IO_LIGHT_POINT) {
            plan->view_count += point_views(scene, plan, i, view);
        } else {
            *view = directional_view(scene, plan, i);
            plan->view_count++;
        }
    }
    for (size_t i = 0; i < plan->view_count; i++)
        choose_view_size(plan, &plan->views[i]);
    return true;
}
