/* Translucent shadow maps: how many, where from, how finely, and what is known of their error. */
#include "renderer/plan_internal.h"
#include "renderer/volumes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof *(array))

const char *const render_tsm_gather_names[] = { "fragment", "vertex", NULL };
const char *const render_tsm_response_names[] = { "table", "exact", "texels", "profile", NULL };
const char *const render_tsm_part_names[] = { "sum", "global", "local", NULL };

enum {
    MAP_SIDE_MIN = 64,
    MAP_SIDE_MAX = 2048,
    TEXELS_PER_CELL = 2, /* along a cell of the local response, at least             */
};

/* Of the light, what comes from beyond the pattern (theory.md T32). */
#define EXTENT_EPSILON 0.03

/* A light that sees an object this wide or less gets one map of it; of a wider one six. */
#define SINGLE_MAP_ANGLE_RAD (100 * PI / 180)

/* Faces of a cube overlap by so much: what a sample next to an edge averages is seen whole. */
#define CUBE_HALF_WIDTH 2.0

/* Patterns (lutgen/tsm_pattern.c): samples, slices of the volume, inner squares side by side. */
static const struct {
    int sample_count, slice_count;
    double extent;
} patterns[] = { { 21, 32, 9 }, { 13, 16, 3 }, { 53, 64, 16 }, { 117, 128, 36 }, { 245, 256, 29 } };

/* The row of that many samples, 0 the usual; the end of the table when there is none. */
static size_t find_pattern(int sample_count)
{
    size_t row = 0;
    while (sample_count != 0 && row < COUNT(patterns) && patterns[row].sample_count != sample_count)
        row++;
    return row;
}

int render_plan_slice_count(int sample_count)
{
    const size_t row = find_pattern(sample_count);
    return row < COUNT(patterns) ? patterns[row].slice_count : 0;
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
        planned->inner_mm = request->volumes
                                ? request->volumes[m]->inner_mm
                                : 2 * render_medium_r_max_mm(&plan->media->media[m], EXTENT_EPSILON) /
                                      patterns[find_pattern(request->tsm.sample_count)].extent;
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

static void directional_map(const struct io_scene *scene, struct render_plan *plan,
                            struct render_plan_view *map)
{
    const double up[3] = { 0, 1, 0 };
    const struct io_mesh *const mesh = scene->objects[map->object].mesh;
    double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };
    map->projection.is_orthographic = true;
    render_projection_aim(&map->projection, scene->lights[map->light].direction, up);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        const float *const p = &mesh->positions[3 * v];
        const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
        double in_view[3];
        render_projection_to_view(&map->projection, position_mm, in_view);
        for (int k = 0; k < 3; k++) {
            min[k] = fmin(min[k], in_view[k]);
            max[k] = fmax(max[k], in_view[k]);
        }
    }
    const double slack_mm = 1e-3 * plan->objects[map->object].ball.radius_mm;
    const double half = 0.5 * fmax(max[0] - min[0], max[1] - min[1]) * (1 + 2.0 / MAP_SIDE_MIN);
    map->projection.half_width = map->projection.half_height = fmax(half, slack_mm);
    map->projection.near_mm = slack_mm;
    map->projection.far_mm = max[2] - min[2] + 3 * slack_mm;
    for (int k = 0; k < 3; k++)
        map->projection.eye_mm[k] = 0.5 * (min[0] + max[0]) * map->projection.right[k] +
                                    0.5 * (min[1] + max[1]) * map->projection.up[k] +
                                    (min[2] - 2 * slack_mm) * map->projection.forward[k];
    choose_size(plan, 2 * map->projection.half_width, map);
}

/* One map or six; returns how many. */
static size_t point_maps(const struct io_scene *scene, struct render_plan *plan,
                         struct render_plan_view *maps)
{
    struct render_plan_view map = maps[0];
    const struct render_ball *const ball = &plan->objects[map.object].ball;
    const double *const position_mm = scene->lights[map.light].position_mm;
    double toward[3], up[3] = { 0, 1, 0 };
    for (int k = 0; k < 3; k++)
        toward[k] = ball->centre_mm[k] - position_mm[k];
    const double distance_mm = sqrt(render_dot(toward, toward)), radius_mm = ball->radius_mm;
    memcpy(map.projection.eye_mm, position_mm, sizeof map.projection.eye_mm);
    map.projection.far_mm = (distance_mm + radius_mm) * 1.001;
    map.projection.near_mm = fmax((distance_mm - radius_mm) * 0.999, 1e-4 * radius_mm);
    if (distance_mm > radius_mm && 2 * asin(radius_mm / distance_mm) <= SINGLE_MAP_ANGLE_RAD) {
        for (int k = 0; k < 3; k++)
            toward[k] /= distance_mm;
        render_projection_aim(&map.projection, toward, up);
        map.projection.half_width = map.projection.half_height =
            tan(asin(radius_mm / distance_mm)) * (1 + 2.0 / MAP_SIDE_MIN);
        choose_size(plan, 2 * map.projection.half_width * distance_mm, &map);
        maps[0] = map;
        return 1;
    }
    map.is_cube_face = true;
    map.projection.near_mm *= 1 / (1 + CUBE_HALF_WIDTH); /* corners are farther away than they are deep */
    map.projection.half_width = map.projection.half_height = CUBE_HALF_WIDTH;
    choose_size(plan, 2 * CUBE_HALF_WIDTH * fmax(distance_mm, radius_mm), &map);
    for (int face = 0; face < 6; face++) {
        double forward[3] = { 0, 0, 0 };
        forward[face / 2] = face % 2 ? -1 : 1;
        up[1] = face / 2 != 1;
        up[2] = face / 2 == 1;
        maps[face] = map;
        maps[face].face = face;
        render_projection_aim(&maps[face].projection, forward, up);
    }
    return 6;
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
            struct render_plan_view *const map = &plan->maps[plan->map_count];
            *map = (struct render_plan_view){ .light = light, .object = object };
            if (scene->lights[light].kind == IO_LIGHT_POINT) {
                plan->map_count += point_maps(scene, plan, map);
            } else {
                directional_map(scene, plan, map);
                plan->map_count++;
            }
        }
    }
    return true;
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
