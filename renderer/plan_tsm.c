/* Translucent shadow maps: how many, where from, how finely, and what is known of their error. */
#include "renderer/frusta.h"
#include "renderer/plan_internal.h"
#include "renderer/volumes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const render_tsm_gather_names[] = { "fragment", "vertex", NULL };
const char *const render_tsm_response_names[] = { "table", "exact", "texels", "profile", NULL };
const char *const render_tsm_part_names[] = { "sum", "global", "local", NULL };

enum {
    MAP_SIDE_MIN = 64,
    MAP_SIDE_MAX = 2048,
    TEXELS_PER_CELL = 2, /* along a cell of the local response, at least             */
};

/* Faces of a cube overlap by so much: what a sample next to an edge averages is seen whole. */
#define CUBE_HALF_WIDTH 2.0

int render_plan_slice_count(int sample_count)
{
    return lut_tsm_slices(sample_count > 0 ? sample_count : RENDER_TSM_USUAL_SAMPLES);
}

static bool is_all_texels(enum render_tsm_response response)
{
    return response == RENDER_TSM_TEXELS || response == RENDER_TSM_PROFILE;
}

static bool check_options(const struct render_request *request, const struct render_plan *plan,
                          dipole_status *status)
{
    const struct render_tsm_options *const tsm = &request->tsm;
    if (render_plan_slice_count(tsm->sample_count) == 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%d samples, expected 13, 21, 53, 117 or 245",
                           tsm->sample_count);
    if (tsm->layer_count < 0 || tsm->layer_count > RENDER_TSM_LAYER_LIMIT || tsm->layer_count % 2 != 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%d layers, expected an even number up to %d",
                           tsm->layer_count, RENDER_TSM_LAYER_LIMIT);
    if (is_all_texels(tsm->response) &&
        (tsm->part != RENDER_TSM_SUM || tsm->gather != RENDER_TSM_FRAGMENT || tsm->layer_count > 0))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "response \"%s\" sums all texels at each fragment: it has no parts, no vertices "
                           "and no layers",
                           render_tsm_response_names[tsm->response]);
    for (size_t m = 0; request->volumes && m < plan->media->count; m++) {
        const struct io_material *const material = plan->media->media[m].material;
        if (request->volumes[m] && strcmp(lut_material_hash(&request->volumes[m]->material).text,
                                          plan->media->media[m].hash.text) != 0)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "the volume is of another medium than material \"%s\"", material->name);
    }
    return true;
}

static void find_patterns(const struct render_request *request, struct render_plan *plan)
{
    for (size_t m = 0; m < plan->media->count; m++) {
        struct render_plan_medium *const planned = &plan->of_medium[m];
        if (!planned->is_visible || !plan->media->media[m].has_scattering)
            continue;
        planned->inner_mm =
            request->volumes
                ? request->volumes[m]->inner_mm
                : lut_tsm_inner_mm(render_medium_r_max_mm(&plan->media->media[m], LUT_TSM_EXTENT_EPSILON),
                                   render_plan_slice_count(request->tsm.sample_count));
    }
}

/* ---- maps --------------------------------------------------------------------------------------- */

/* Texels as fine as the local response asks, and as aliasing allows. */
static double texel_wanted_mm(const struct render_plan *plan, size_t object)
{
    const struct render_plan_medium *const medium = &plan->of_medium[plan->objects[object].medium];
    const double by_pattern_mm = medium->inner_mm / (LUT_TSM_LOCAL_SIDE * TEXELS_PER_CELL);
    return fmin(by_pattern_mm, medium->spacing_mm);
}

/* A power of two, so that levels of detail are means of whole texels. */
static void choose_size(struct render_plan *plan, double width_mm, struct render_plan_view *map)
{
    const double wanted = width_mm / texel_wanted_mm(plan, map->object);
    map->size_px = MAP_SIDE_MIN;
    while (map->size_px < MAP_SIDE_MAX && map->size_px < wanted)
        map->size_px *= 2;
    if (map->size_px < wanted)
        render_plan_add_note(
            plan,
            "texels of a translucent shadow map are %.3g mm wide, %.3g mm were asked: a map "
            "is limited to %d texels a side",
            width_mm / map->size_px, texel_wanted_mm(plan, map->object), MAP_SIDE_MAX);
    const double texel = 2 * map->projection.half_width / map->size_px;
    map->texel_area = texel * texel;
}

/* Sources are fitted to what leaves a flat surface. Those of layers lie deep, and light a curved one
 * wrongly: docs/rendering.md. */
static void note_layers(struct render_plan *plan)
{
    for (size_t m = 0; m < plan->media->count; m++) {
        const struct io_material *const material = plan->media->media[m].material;
        if (plan->of_medium[m].is_visible && material->layer_count > 1)
            render_plan_add_note(
                plan,
                "material \"%.60s\" has layers, whose response in translucent shadow maps is right "
                "on flat surfaces alone: splats draw it on any",
                material->name);
    }
}

static double distance_mm(const double a_mm[3], const double b_mm[3])
{
    const double step_mm[3] = { a_mm[0] - b_mm[0], a_mm[1] - b_mm[1], a_mm[2] - b_mm[2] };
    return sqrt(render_dot(step_mm, step_mm));
}

/* One map or six of an object; returns how many. */
static size_t object_maps(const struct io_scene *scene, struct render_plan *plan, size_t light,
                          size_t object, struct render_plan_view *maps)
{
    const struct io_light *const source = &scene->lights[light];
    const struct render_ball *const ball = &plan->objects[object].ball;
    const double margin = 1 + 2.0 / MAP_SIDE_MIN; /* a texel on each side */
    struct render_projection frusta[RENDER_FACES];
    struct render_plan_view map = { .light = light, .object = object };
    size_t count = 1;
    double sized_at_mm = 1; /* distance at which texels are as fine as wanted */
    if (source->kind == IO_LIGHT_POINT) {
        count = render_frusta_of_point(source->position_mm, ball, margin, CUBE_HALF_WIDTH, frusta);
        sized_at_mm = fmax(distance_mm(source->position_mm, ball->centre_mm), ball->radius_mm);
    } else {
        render_frustum_of_parallel(source->direction, &scene->objects[object], 1, ball, margin, frusta);
    }
    map.is_cube_face = count > 1;
    map.projection = frusta[0];
    choose_size(plan, 2 * map.projection.half_width * sized_at_mm, &map); /* alike for all faces */
    for (size_t i = 0; i < count; i++) {
        maps[i] = map;
        maps[i].projection = frusta[i];
        maps[i].face = (int)i;
    }
    return count;
}

static bool takes_maps(const struct render_plan *plan, size_t object)
{
    return plan->objects[object].is_visible &&
           plan->media->media[plan->objects[object].medium].has_scattering;
}

bool render_plan_make_maps(const struct render_request *request, struct render_plan *plan,
                           dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (plan->technique != RENDER_TECHNIQUE_TSM)
        return true;
    if (!check_options(request, plan, status))
        return false;
    plan->tsm = request->tsm;
    find_patterns(request, plan);
    note_layers(plan);
    if (request->tsm.gather == RENDER_TSM_VERTEX)
        for (size_t i = 0; i < scene->object_count; i++)
            plan->vertex_count += scene->objects[i].mesh->vertex_count;
    const size_t most = 6 * plan->lit_count * scene->object_count;
    if (most == 0 || !plan->has_scattering)
        return true;
    plan->maps = calloc(most, sizeof *plan->maps);
    if (!plan->maps)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the maps of %zu objects",
                           scene->object_count);
    for (size_t light = 0; light < scene->light_count; light++) {
        for (size_t object = 0; object < scene->object_count; object++) {
            if (!render_light_shines(&scene->lights[light]) || !takes_maps(plan, object))
                continue;
            plan->map_count += object_maps(scene, plan, light, object, &plan->maps[plan->map_count]);
        }
    }
    return render_plan_make_map_shadows(request, plan, status);
}

int render_plan_map_side_px(const struct render_plan *plan)
{
    int largest = 0;
    for (size_t i = 0; i < plan->map_count; i++)
        largest = plan->maps[i].size_px > largest ? plan->maps[i].size_px : largest;
    return largest;
}

/* ---- error -------------------------------------------------------------------------------------- */

void render_plan_predict_map_error(const struct render_request *request, struct render_plan *plan)
{
    if (plan->map_count == 0)
        return;
    for (size_t m = 0; m < plan->media->count; m++) {
        if (request->tsm.response == RENDER_TSM_TABLE && plan->of_medium[m].inner_mm > 0)
            plan->table_error =
                fmax(plan->table_error, request->volumes ? request->volumes[m]->error.max
                                                         : render_volume_epsilon(plan->epsilon));
    }
    /* Nothing bounds what so few samples, or texels of any size, make of an arbitrary shape. */
    plan->error_predicted = INFINITY;
}
