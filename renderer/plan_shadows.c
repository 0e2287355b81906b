/* What shadows are made of: whether blockers let light through, lights have a size; and what the views of
 * shadows hold. theory.md T67. */
#include "renderer/area_light.h"
#include "renderer/crossings.h"
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdlib.h>

/* Blockers may come as near to a light, as part of how far it reaches. */
#define NEAREST_SHARE 1e-3

/* Faces of a cube are so much wider at the most: what is farther to the side is taken not to block. */
#define FACE_MARGIN 1.25

static void look_at_blockers(const struct io_scene *scene, struct render_plan *plan)
{
    struct render_plan_shadows *const shadows = &plan->shadows;
    for (size_t i = 0; i < scene->blocker_count; i++) {
        const struct io_blocker *const blocker = &scene->blockers[i];
        if (!render_blocker_is_there(blocker))
            continue;
        const bool is_opaque = render_blocker_is_opaque(blocker);
        shadows->blocker_count++;
        shadows->translucent_count += !is_opaque;
        shadows->coloured_count += !is_opaque && render_blocker_is_coloured(blocker);
        shadows->triangle_count += blocker->mesh->triangle_count +
                                   2 * (blocker->particle_mm > 0 ? blocker->mesh->vertex_count : 0);
    }
    for (size_t i = 0; i < scene->light_count; i++) {
        if (!render_light_shines(&scene->lights[i]))
            continue;
        shadows->soft_light_count += render_light_has_size(&scene->lights[i]);
        shadows->spot_count += scene->lights[i].is_spot;
    }
    shadows->is_called_for = shadows->blocker_count + shadows->soft_light_count + shadows->spot_count > 0;
}

/* How near to the light anything is, and how far to the side blockers are, in view units, about a
 * projection. */
struct extent {
    double nearest_mm, side;
};

static void add_ball(const struct render_projection *view, const struct render_ball *ball,
                     struct extent *extent)
{
    double in_view[3];
    render_projection_to_view(view, ball->centre_mm, in_view);
    const double near_mm = in_view[2] - ball->radius_mm, least_mm = NEAREST_SHARE * view->far_mm;
    const double aside_mm = fmax(fabs(in_view[0]), fabs(in_view[1])) + ball->radius_mm;
    extent->nearest_mm = fmin(extent->nearest_mm, near_mm);
    extent->side =
        fmax(extent->side, view->is_orthographic ? aside_mm : aside_mm / fmax(near_mm, least_mm));
}

static struct extent extent_of(const struct io_scene *scene, const struct render_plan *plan,
                               const struct render_projection *view)
{
    struct extent extent = { .nearest_mm = view->far_mm };
    for (size_t i = 0; i < scene->object_count; i++)
        add_ball(view, &plan->objects[i].ball, &extent);
    for (size_t i = 0; i < scene->blocker_count; i++) {
        struct render_ball ball = render_ball_of_mesh(scene->blockers[i].mesh);
        ball.radius_mm += scene->blockers[i].particle_mm * sqrt(2.0);
        if (render_blocker_is_there(&scene->blockers[i]))
            add_ball(view, &ball, &extent);
    }
    return extent;
}

/* The light's view, so much wider that all of a penumbra's blockers are in it, and no wider than blockers
 * are. */
static struct render_plan_shadow shadow_of(const struct io_scene *scene, const struct render_plan *plan,
                                           const struct render_plan_view *view, int size_px)
{
    const struct io_light *const light = &scene->lights[view->light];
    struct render_plan_shadow shadow = { .projection = view->projection, .size_px = size_px };
    struct render_projection *const projection = &shadow.projection;
    const struct extent extent = extent_of(scene, plan, projection);
    const double least_mm = NEAREST_SHARE * projection->far_mm;
    shadow.light_size = light->kind == IO_LIGHT_POINT ? light->size_mm : 2 * tan(light->size_rad / 2);
    if (projection->is_orthographic) {
        const double back_mm = fmax(least_mm - extent.nearest_mm, 0);
        for (int k = 0; k < 3; k++)
            projection->eye_mm[k] -= back_mm * projection->forward[k];
        projection->far_mm += back_mm;
        shadow.nearest_mm = extent.nearest_mm + back_mm;
        const double reach_mm = shadow.light_size / 2 * (projection->far_mm - shadow.nearest_mm);
        projection->half_width =
            fmin(projection->half_width + reach_mm, fmax(extent.side, projection->half_width));
    } else {
        shadow.nearest_mm = fmax(extent.nearest_mm, least_mm);
        const double reach = shadow.light_size / 2 * (1 / shadow.nearest_mm - 1 / projection->far_mm);
        projection->half_width =
            fmin(projection->half_width + fmax(reach, 0), fmax(extent.side, projection->half_width));
        const double most = view->is_cube_face ? FACE_MARGIN * view->projection.half_width
                                               : view->projection.half_width + 1;
        projection->half_width = fmin(projection->half_width, most);
    }
    projection->half_height = projection->half_width;
    projection->near_mm = fmin(projection->near_mm, fmax(shadow.nearest_mm / 2, least_mm / 2));
    return shadow;
}

/* Scenes of more objects have one view of each light, in which objects hide each other. */
enum { OBJECT_VIEWS_LIMIT = 16 };

/* Whether light of a view enters an object: where its light has a size, others hide no more than a part of
 * it. */
static bool has_view(const struct render_plan *plan, size_t object)
{
    return plan->objects[object].is_visible &&
           plan->media->media[plan->objects[object].medium].has_scattering;
}

/* In place of each view of a light with a size one for each object that it may enter. */
static bool tell_objects_apart(const struct render_request *request, struct render_plan *plan,
                               dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    const bool is_sampled = request->is_captured || render_plan_sums_samples(plan);
    if (plan->shadows.soft_light_count == 0 || scene->object_count < 2 || !is_sampled)
        return true;
    if (scene->object_count > OBJECT_VIEWS_LIMIT) {
        render_plan_add_note(
            plan, "penumbras of objects on what scatters are narrow: there are more than %d objects",
            OBJECT_VIEWS_LIMIT);
        return true;
    }
    struct render_plan_view *const views = calloc(plan->view_count * scene->object_count, sizeof *views);
    if (!views)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for views of %zu objects",
                           scene->object_count);
    size_t count = 0;
    for (size_t v = 0; v < plan->view_count; v++) {
        const size_t first = count;
        for (size_t i = 0;
             render_light_has_size(&scene->lights[plan->views[v].light]) && i < scene->object_count; i++) {
            if (!has_view(plan, i))
                continue;
            views[count] = plan->views[v];
            views[count].is_of_object = true;
            views[count].object = i;
            views[count].is_repeated = count > first;
            count++;
        }
        if (count == first)
            views[count++] = plan->views[v];
    }
    free(plan->views);
    plan->views = views;
    plan->view_count = count;
    return true;
}

bool render_plan_make_shadows(const struct render_request *request, struct render_plan *plan,
                              dipole_status *status)
{
    const struct render_shadow_options *const asked = &request->shadows;
    look_at_blockers(request->scene, plan);
    plan->shadows.node_limit = asked->node_limit > 0 ? asked->node_limit : RENDER_SHADOW_NODES;
    plan->shadows.tap_count = asked->tap_count > 0 ? asked->tap_count : RENDER_SHADOW_TAPS;
    if (!plan->shadows.is_called_for || plan->view_count == 0)
        return true;
    plan->has_light_pictures = false; /* shadows are laid over the lights' views */
    if (!tell_objects_apart(request, plan, status))
        return false;
    plan->shadows.of_view = calloc(plan->view_count, sizeof *plan->shadows.of_view);
    if (!plan->shadows.of_view)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the shadows of %zu views",
                           plan->view_count);
    plan->shadows.size_px = asked->side_px > 0 ? asked->side_px : RENDER_SHADOW_SIDE;
    for (size_t i = 0; i < plan->view_count; i++)
        plan->shadows.of_view[i] = shadow_of(request->scene, plan, &plan->views[i], plan->shadows.size_px);
    if (plan->technique == RENDER_TECHNIQUE_TSM && plan->has_scattering)
        render_plan_add_note(
            plan, "translucent shadow maps show hard shadows of objects alone, not of blockers, and "
                  "spots as point lights");
    return true;
}

int render_plan_shadow_block_px(const struct render_plan *plan)
{
    int levels = 2;
    for (size_t i = 0; i < plan->view_count; i++)
        levels = plan->views[i].levels - 1 < levels ? plan->views[i].levels - 1 : levels;
    return levels > 0 ? 1 << levels : 1;
}
