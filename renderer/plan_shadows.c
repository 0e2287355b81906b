/* What shadows are made of: whether blockers let light through, lights have a size; and what the views of
 * shadows hold. theory.md T67. */
#include "renderer/area_light.h"
#include "renderer/crossings.h"
#include "renderer/light_distance.h"
#include "renderer/plan_internal.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* Blockers may come as near to a light, as part of how far it reaches. */
#define NEAREST_SHARE 1e-3

/* Faces of a cube are so much wider at the most, 71 degrees to the side: what is farther to the side is
 * taken not to block. */
#define FACE_MARGIN 3.0

static void look_at_caster(const struct io_blocker *blocker, bool is_object,
                           struct render_plan_shadows *shadows)
{
    if (!render_blocker_is_there(blocker))
        return;
    const bool is_opaque = render_blocker_is_opaque(blocker);
    shadows->blocker_count += !is_object;
    shadows->object_count += is_object;
    shadows->translucent_count += !is_opaque;
    shadows->coloured_count += !is_opaque && render_blocker_is_coloured(blocker);
    const size_t triangle_count =
        blocker->mesh->triangle_count + 2 * (blocker->particle_mm > 0 ? blocker->mesh->vertex_count : 0);
    shadows->triangle_count += triangle_count;
    shadows->opaque_triangle_count += is_opaque ? triangle_count : 0;
}

/* What a capture is of is not known, so its objects let nothing through. */
static bool look_at_casters(const struct render_request *request, struct render_plan *plan,
                            dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    struct render_plan_shadows *const shadows = &plan->shadows;
    const double epsilon = request->is_captured ? INFINITY : plan->epsilon;
    if (!render_casters_init(scene, plan->media, epsilon, &shadows->casters, status))
        return false;
    for (size_t i = 0; i < shadows->casters.count; i++)
        look_at_caster(&shadows->casters.casters[i], i >= shadows->casters.blocker_count, shadows);
    for (size_t i = 0; i < scene->light_count; i++) {
        if (!render_light_shines(&scene->lights[i]))
            continue;
        shadows->soft_light_count += render_light_has_size(&scene->lights[i]);
        shadows->spot_count += scene->lights[i].is_spot;
    }
    shadows->is_called_for =
        shadows->blocker_count + shadows->object_count + shadows->soft_light_count + shadows->spot_count >
        0;
    return true;
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

/* How far to the side, at distance 1, the light's disc reaches that faces what is side away from the axis,
 * and is seen as wide as reach to each side. T67 */
static double widened(double side, double reach)
{
    return (side + reach) / fmax(1 - reach * side, 0.1);
}

/* The light's view, so much wider that all of a penumbra's blockers are in it, and no wider than blockers
 * are. distance_mm: from the light to the nearest surface, for faces of a cube alone. */
static struct render_plan_shadow shadow_of(const struct io_scene *scene, const struct render_plan *plan,
                                           const struct render_plan_view *view, double distance_mm,
                                           int size_px)
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
        const double nearest_mm = view->is_cube_face ? fmax(distance_mm, least_mm) : shadow.nearest_mm;
        const double reach = shadow.light_size / 2 * fmax(1 / nearest_mm - 1 / projection->far_mm, 0);
        const double narrow = projection->half_width;
        const double wide =
            view->is_cube_face ? widened(sqrt(2) * narrow, reach) / sqrt(2) : widened(narrow, reach);
        const double most = view->is_cube_face ? FACE_MARGIN * narrow : narrow + 1;
        projection->half_width = fmin(wide, fmax(extent.side, narrow));
        projection->half_width = fmin(projection->half_width, most);
    }
    projection->half_height = projection->half_width;
    projection->near_mm = fmin(projection->near_mm, fmax(shadow.nearest_mm / 2, least_mm / 2));
    return shadow;
}

/* ---- how much there is to do: for predictions of its time ------------------------------------------ */

/* Triangles of a mesh that are looked at: others are as large. */
enum { LOOKED_AT = 4096 };

/* What a mesh's surfaces cover, seen from all around, in the mean: half of their area. */
static double surface_mm2(const struct io_blocker *blocker)
{
    const struct io_mesh *const mesh = blocker->mesh;
    const size_t step = 1 + mesh->triangle_count / LOOKED_AT;
    double sum = 0, count = 0;
    if (blocker->particle_mm > 0)
        return PI * blocker->particle_mm * blocker->particle_mm * (double)mesh->vertex_count;
    for (size_t t = 0; t < mesh->triangle_count; t += step) {
        double sides[2][3], area2 = 0;
        for (size_t k = 0; k < 3; k++) {
            const double first = (double)mesh->positions[3 * (size_t)mesh->indices[3 * t] + k];
            for (size_t s = 0; s < 2; s++)
                sides[s][k] = (double)mesh->positions[3 * (size_t)mesh->indices[3 * t + 1 + s] + k] - first;
        }
        for (int k = 0; k < 3; k++)
            area2 += pow(sides[0][(k + 1) % 3] * sides[1][(k + 2) % 3] -
                             sides[0][(k + 2) % 3] * sides[1][(k + 1) % 3],
                         2);
        sum += sqrt(area2) / 2;
        count++;
    }
    return count > 0 ? 0.5 * sum / count * (double)mesh->triangle_count : 0;
}

/* What the box about a mesh covers. */
static double box_mm2(const struct io_mesh *mesh, const double forward[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const int x = (k + 1) % 3, y = (k + 2) % 3;
        sum += fabs(forward[k]) * ((double)mesh->max[x] - (double)mesh->min[x]) *
               ((double)mesh->max[y] - (double)mesh->min[y]);
    }
    return sum;
}

/* What is lit is about a third of what the view holds. */
#define LIT_SHARE 0.33

static void count_blockers(const struct render_casters *casters, struct render_plan_shadow *shadow)
{
    const struct render_projection *const view = &shadow->projection;
    const double view_area = 4 * view->half_width * view->half_width;
    for (size_t i = 0; i < casters->count; i++) {
        const struct io_blocker *const blocker = &casters->casters[i];
        const struct render_ball ball = render_ball_of_mesh(blocker->mesh);
        double in_view[3];
        render_projection_to_view(view, ball.centre_mm, in_view);
        if (!render_blocker_is_there(blocker) || in_view[2] + ball.radius_mm < 0)
            continue;
        const double depth_mm = fmax(in_view[2], ball.radius_mm);
        const double part = 1 / (view_area * (view->is_orthographic ? 1 : depth_mm * depth_mm));
        shadow->share += part * box_mm2(blocker->mesh, view->forward) / LIT_SHARE;
        if (!render_blocker_is_opaque(blocker))
            shadow->surface_count += part * surface_mm2(blocker) * shadow->size_px * shadow->size_px;
    }
    shadow->share = fmin(shadow->share, 1);
}

/* Scenes of more objects have one view of each light, in which objects hide each other. */
enum { OBJECT_VIEWS_LIMIT = 16 };

/* Light that enters a knot where only the knot itself hides the light's middle is so much of all, for each
 * rad that the light is seen under: measured. */
#define SELF_SHARE 0.2

static bool has_view(const struct render_plan *plan, size_t object)
{
    return plan->objects[object].is_visible &&
           plan->media->media[plan->objects[object].medium].has_scattering;
}

/* The angle that a light is seen under from the object. */
static double light_angle_rad(const struct io_light *light, const struct render_ball *ball)
{
    double away2_mm2 = 0;
    if (light->kind != IO_LIGHT_POINT)
        return light->size_rad;
    for (int k = 0; k < 3; k++)
        away2_mm2 += pow(light->position_mm[k] - ball->centre_mm[k], 2);
    return light->size_mm / fmax(sqrt(away2_mm2), ball->radius_mm);
}

/* Surfaces of an object behind each other that light of a view may enter: one where the object hides all of
 * the light from itself, or none. */
static int layers_of(const struct render_plan *plan, const struct io_light *light, size_t object)
{
    const double lost = SELF_SHARE * light_angle_rad(light, &plan->objects[object].ball);
    if (plan->media->is_convex[object])
        return 1;
    return plan->shadows.casters.lets_through[object] || lost > plan->epsilon / 4 ? 2 : 1;
}

/* Append the views of one object, or of all in one. */
static size_t add_views(const struct render_request *request, struct render_plan *plan,
                        const struct render_plan_view *view, size_t object, struct render_plan_view *views)
{
    const struct io_light *const light = &request->scene->lights[view->light];
    const int layer_count = layers_of(plan, light, object);
    for (int layer = 0; layer < layer_count; layer++) {
        views[layer] = *view;
        views[layer].is_of_object = true;
        views[layer].object = object;
        views[layer].layer = layer;
    }
    plan->shadows.layer_count += (size_t)layer_count - 1;
    return (size_t)layer_count;
}

/* Whether others hide no more of a light from an object than a part. */
static bool is_apart(const struct io_scene *scene, const struct render_plan *plan, size_t light)
{
    return render_light_has_size(&scene->lights[light]) || plan->shadows.object_count > 0;
}

/* In place of each view of a light that objects hide in part only, one or more for each object that it may
 * enter. */
static bool tell_objects_apart(const struct render_request *request, struct render_plan *plan,
                               dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    const bool is_sampled = request->is_captured || render_plan_sums_samples(plan);
    if (plan->shadows.soft_light_count + plan->shadows.object_count == 0 || !is_sampled)
        return true;
    if (scene->object_count > OBJECT_VIEWS_LIMIT) {
        render_plan_add_note(
            plan,
            "light that objects let through, or that comes past them, is drawn on others' surfaces, but "
            "does not enter where they hide the light's middle: there are more than %d objects",
            OBJECT_VIEWS_LIMIT);
        return true;
    }
    struct render_plan_view *const views =
        calloc(2 * plan->view_count * scene->object_count, sizeof *views);
    if (!views)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for views of %zu objects",
                           scene->object_count);
    size_t count = 0;
    for (size_t v = 0; v < plan->view_count; v++) {
        const size_t first = count;
        for (size_t i = 0; is_apart(scene, plan, plan->views[v].light) && i < scene->object_count; i++)
            count += has_view(plan, i) ? add_views(request, plan, &plan->views[v], i, &views[count]) : 0;
        if (count == first)
            views[count++] = plan->views[v];
        for (size_t i = first + 1; i < count; i++)
            views[i].is_repeated = true;
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
    if (!look_at_casters(request, plan, status))
        return false;
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
    double distance_mm = 0;
    for (size_t i = 0; i < plan->view_count; i++) {
        const struct render_plan_view *const view = &plan->views[i];
        if (view->is_cube_face && (i == 0 || view[-1].light != view->light))
            distance_mm = render_light_distance_mm(request->scene, view->projection.eye_mm);
        plan->shadows.of_view[i] =
            shadow_of(request->scene, plan, view, distance_mm, plan->shadows.size_px);
        count_blockers(&plan->shadows.casters, &plan->shadows.of_view[i]);
    }
    return true;
}

/* Objects have maps of their own, in which others do not hide them. */
bool render_plan_make_map_shadows(const struct render_request *request, struct render_plan *plan,
                                  dipole_status *status)
{
    if (!plan->shadows.is_called_for || plan->map_count == 0)
        return true;
    plan->shadows.of_map = calloc(plan->map_count, sizeof *plan->shadows.of_map);
    if (!plan->shadows.of_map)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the shadows of %zu maps",
                           plan->map_count);
    for (size_t i = 0; i < plan->map_count; i++) {
        plan->maps[i].is_of_object = true;
        plan->shadows.of_map[i] = shadow_of(request->scene, plan, &plan->maps[i], 0, plan->shadows.size_px);
        count_blockers(&plan->shadows.casters, &plan->shadows.of_map[i]);
    }
    return true;
}

bool render_plan_shades_maps_alone(const struct render_plan *plan)
{
    return plan->shadows.of_map && !plan->has_specular;
}

/* Penumbras are as wide as samples are apart, or so: one factor for each sample will do. Edges of hard
 * shadows are met better by blocks half as wide. */
int render_plan_shadow_block_px(const struct render_plan *plan)
{
    const int divisor = plan->shadows.soft_light_count > 0 ? 1 : 2;
    int block_px = 8 / divisor;
    for (size_t i = 0; i < plan->view_count; i++)
        block_px =
            plan->views[i].block_px / divisor < block_px ? plan->views[i].block_px / divisor : block_px;
    return block_px > 0 ? block_px : 1;
}

size_t render_plan_shadow_map_count(const struct render_plan *plan)
{
    size_t count = 0;
    for (size_t i = 0; i < plan->view_count; i++)
        count += !plan->views[i].is_repeated;
    return count;
}
