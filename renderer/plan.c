#include "renderer/plan_internal.h"

#include "renderer/cost.h"
#include "renderer/effects.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { LIGHT_LIMIT = 1024 };

const char *const render_technique_names[] = { "auto", "splat",  "lambert", "reference",
                                               "tsm",  "gather", NULL };
const char *const render_area_names[] = { "flux", "overlap", NULL };

static struct render_decision decision(bool is_active, const char *format, va_list arguments)
    __attribute__((format(printf, 2, 0)));

static struct render_decision decision(bool is_active, const char *format, va_list arguments)
{
    struct render_decision decided = { .is_active = is_active };
    vsnprintf(decided.reason, sizeof decided.reason, format, arguments);
    return decided;
}

struct render_decision render_called_for(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const struct render_decision decided = decision(true, format, arguments);
    va_end(arguments);
    return decided;
}

struct render_decision render_not_called_for(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const struct render_decision decided = decision(false, format, arguments);
    va_end(arguments);
    return decided;
}

void render_plan_add_note(struct render_plan *plan, const char *format, ...)
{
    if (plan->note_count == RENDER_NOTE_LIMIT)
        return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(plan->notes[plan->note_count], sizeof plan->notes[0], format, arguments);
    va_end(arguments);
    plan->note_count++;
}

/* ---- what the scene says ------------------------------------------------------------------------ */

/* Name of the first coefficient that differs, its values in *a_out and *b_out; NULL when none does. */
static const char *media_difference(const struct io_material *a, const struct io_material *b, int *channel,
                                    double *a_out, double *b_out)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const x = &a->layers[c][0].medium, *const y = &b->layers[c][0].medium;
        const struct {
            const char *name;
            double x, y;
        } rows[] = {
            { "sigma_a_per_mm", x->sigma_a_per_mm, y->sigma_a_per_mm },
            { "sigma_s_prime_per_mm", x->sigma_s_prime_per_mm, y->sigma_s_prime_per_mm },
            { "eta", x->eta, y->eta },
            { "fdr", x->fdr_kind, y->fdr_kind },
        };
        for (size_t i = 0; i < COUNT(rows); i++) {
            if (rows[i].x != rows[i].y) {
                *channel = c;
                *a_out = rows[i].x;
                *b_out = rows[i].y;
                return rows[i].name;
            }
        }
    }
    return NULL;
}

bool render_plan_check_table(const struct render_table *table, const struct io_material *material,
                             const dipole_place *place, dipole_status *status)
{
    const struct io_material *const baked = &table->lut->rows[table->row].material;
    const struct lut_hash there = lut_material_hash(baked), here = lut_material_hash(material);
    if (strcmp(there.text, here.text) == 0)
        return true;
    int channel;
    double in_table, in_scene;
    const char *const name = media_difference(baked, material, &channel, &in_table, &in_scene);
    if (!name)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, place,
            "the table is of another medium than material \"%s\": its model or layers differ "
            "(material_hash %s, the scene's %s)",
            material->name, there.text, here.text);
    return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                       "the table is of another medium than material \"%s\": its %s in %s is %.9g, the "
                       "scene's %.9g (material_hash %s, the scene's %s)",
                       material->name, name, io_channel_names[channel], in_table, in_scene, there.text,
                       here.text);
}

struct render_band_key render_plan_band_key(const struct render_plan *plan,
                                            const struct render_table *table, size_t medium)
{
    const struct render_plan_medium *const planned = &plan->of_medium[medium];
    struct render_band_key key = { .source = { .table = table->lut,
                                               .row = table->row,
                                               .medium = &plan->media->media[medium],
                                               .spread_mm = planned->spread_mm },
                                   .band_count = planned->band_count };
    memcpy(key.source.blur_mm, planned->blur_mm, sizeof key.source.blur_mm);
    memcpy(key.bands, planned->bands, sizeof key.bands);
    return key;
}

bool render_plan_sums_samples(const struct render_plan *plan)
{
    return plan->technique == RENDER_TECHNIQUE_SPLAT || plan->technique == RENDER_TECHNIQUE_GATHER;
}

double render_plan_pixel_mm(const struct render_plan *plan, const struct render_plan_object *object)
{
    if (plan->camera.is_orthographic)
        return plan->pixel_mm;
    double in_view_mm[3];
    render_projection_to_view(&plan->camera, object->ball.centre_mm, in_view_mm);
    return plan->pixel_mm * fmax(in_view_mm[2] - object->ball.radius_mm, plan->camera.near_mm);
}

bool render_light_shines(const struct io_light *light)
{
    return light->rgb[0] > 0 || light->rgb[1] > 0 || light->rgb[2] > 0;
}

bool render_plan_check_request(const struct io_scene *scene, double epsilon, dipole_status *status)
{
    const struct io_camera *const camera = &scene->camera;
    const dipole_place place = { .source = scene->path };
    if (!(epsilon >= RENDER_EPSILON_MIN && epsilon <= RENDER_EPSILON_MAX))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "epsilon is %g, expected %g to %g", epsilon,
                           RENDER_EPSILON_MIN, RENDER_EPSILON_MAX);
    if (camera->width_px < 1 || camera->height_px < 1 || camera->width_px > RENDER_SIDE_LIMIT ||
        camera->height_px > RENDER_SIDE_LIMIT ||
        (size_t)camera->width_px * (size_t)camera->height_px > RENDER_PIXEL_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "the picture is %dx%d, expected sides of 1 to %d and at most %zu pixels",
                           camera->width_px, camera->height_px, RENDER_SIDE_LIMIT, RENDER_PIXEL_LIMIT);
    if (scene->light_count > LIGHT_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "%zu lights, expected at most %d",
                           scene->light_count, LIGHT_LIMIT);
    return true;
}

static bool take_media(const struct render_request *request, struct render_plan *plan,
                       dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (!request->media && !render_media_create(scene, &plan->own_media, status))
        return false;
    plan->media = request->media ? request->media : plan->own_media;
    for (size_t m = 0; request->tables && m < plan->media->count; m++) {
        if (request->tables[m].lut &&
            !render_plan_check_table(&request->tables[m], plan->media->media[m].material, NULL, status))
            return false;
    }
    plan->objects = calloc(scene->object_count + 1, sizeof *plan->objects);
    plan->of_medium = calloc(plan->media->count + 1, sizeof *plan->of_medium);
    return (plan->objects && plan->of_medium) ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to plan %zu objects",
                       scene->object_count);
}

/* Of the disc in the ball's rectangle. */
static double pixels_of_ball(const struct render_plan *plan, const double rectangle[4])
{
    const double width = fmin(rectangle[2], 1) - fmax(rectangle[0], -1);
    const double height = fmin(rectangle[3], 1) - fmax(rectangle[1], -1);
    const double share = fmax(width, 0) * fmax(height, 0) / 4;
    return PI / 4 * share * plan->width_px * plan->height_px;
}

/* Of a surface of that area: a convex one shows a quarter of it, on average over all sides. */
static double pixels_of_area(const struct render_plan *plan, const struct render_ball *ball,
                             double area_mm2)
{
    double in_view_mm[3];
    render_projection_to_view(&plan->camera, ball->centre_mm, in_view_mm);
    const double pixel_mm = plan->camera.is_orthographic
                                ? plan->pixel_mm
                                : plan->pixel_mm * fmax(in_view_mm[2], ball->radius_mm);
    return 0.25 * area_mm2 / (pixel_mm * pixel_mm);
}

/* A capture keeps the light of objects out of sight, too. */
static void look_at_objects(const struct render_request *request, struct render_plan *plan)
{
    const struct io_scene *const scene = request->scene;
    for (size_t i = 0; i < scene->object_count; i++) {
        struct render_plan_object *const object = &plan->objects[i];
        double rectangle[4] = { 0, 0, 0, 0 };
        object->medium = plan->media->of_object[i];
        object->ball = scene->object_count == 1 ? plan->ball : render_ball_of_mesh(scene->objects[i].mesh);
        object->is_visible =
            request->is_captured || render_projection_bound_sphere(&plan->camera, object->ball.centre_mm,
                                                                   object->ball.radius_mm, rectangle);
        plan->triangle_count += scene->objects[i].mesh->triangle_count;
        if (!object->is_visible)
            continue;
        object->pixel_count = fmin(pixels_of_ball(plan, rectangle),
                                   pixels_of_area(plan, &object->ball, plan->media->area_mm2[i]));
        plan->covered_px += object->pixel_count;
        struct render_plan_medium *const medium = &plan->of_medium[object->medium];
        medium->is_visible = true;
        medium->diameter_mm = fmax(medium->diameter_mm, 2 * object->ball.radius_mm);
        plan->has_scattering |= plan->media->media[object->medium].has_scattering;
    }
    plan->covered_px = fmin(plan->covered_px, (double)plan->width_px * plan->height_px);
}

static bool read_scene(const struct render_request *request, struct render_plan *plan,
                       dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (!render_plan_check_request(scene, request->epsilon, status) ||
        !render_plan_check_grid(request, status) || !take_media(request, plan, status) ||
        !render_plan_take_environment(request, plan, status))
        return false;
    plan->epsilon = request->epsilon;
    plan->width_px = scene->camera.width_px;
    plan->height_px = scene->camera.height_px;
    plan->ball = render_ball_of_scene(scene);
    render_projection_of_camera(&scene->camera, &plan->ball, &plan->camera);
    plan->pixel_mm = 2 * plan->camera.half_height / plan->height_px;
    for (size_t i = 0; i < scene->light_count; i++)
        plan->lit_count += render_light_shines(&scene->lights[i]);
    look_at_objects(request, plan);
    render_plan_look_at_gloss(request, plan);
    render_plan_look_at_motion(request, plan);
    return true;
}

/* Whether light of one object could be taken for another's, or be spread by another's profile. */
static void tell_objects_apart(const struct render_request *request, struct render_plan *plan)
{
    const struct io_scene *const scene = request->scene;
    plan->ids_reason =
        scene->object_count == 1 ? "one object" : "one medium, objects farther apart than r_max";
    if (request->is_captured && scene->object_count > 1) {
        plan->has_object_ids = true;
        plan->ids_reason = "several objects, of a medium that is not known";
        return;
    }
    if (plan->media->count > 1) {
        plan->has_object_ids = true;
        plan->ids_reason = "objects of different media";
        return;
    }
    for (size_t i = 0; i < scene->object_count && !plan->has_object_ids; i++) {
        for (size_t j = 0; j < i && !plan->has_object_ids; j++)
            plan->has_object_ids =
                render_mesh_gap_mm(scene->objects[i].mesh, scene->objects[j].mesh) <= plan->r_max_mm;
    }
    if (plan->has_object_ids)
        plan->ids_reason = "objects within r_max of each other";
}

/* Gathering costs a part of what splats do (docs/rendering.md), whatever the scene. */
static enum render_technique fastest_technique(const struct render_request *request,
                                               const struct render_plan *plan)
{
    if (plan->has_scattering && plan->r_max_px < 1 && !request->keeps_negligible)
        return RENDER_TECHNIQUE_LAMBERT;
    if (request->area != RENDER_AREA_FLUX || request->splat_grid != 0 ||
        plan->epsilon < RENDER_GATHER_EPSILON_MIN)
        return RENDER_TECHNIQUE_SPLAT;
    return RENDER_TECHNIQUE_GATHER;
}

static void choose_technique(const struct render_request *request, struct render_plan *plan)
{
    plan->technique = request->technique;
    plan->area = request->is_captured ? RENDER_AREA_FLUX : request->area;
    if (request->is_captured)
        plan->technique = RENDER_TECHNIQUE_SPLAT;
    else if (plan->technique == RENDER_TECHNIQUE_AUTO)
        plan->technique = fastest_technique(request, plan);
    if (plan->technique != RENDER_TECHNIQUE_SPLAT)
        plan->area = RENDER_AREA_FLUX;
    plan->has_grid = request->splat_grid != 0 && plan->technique == RENDER_TECHNIQUE_SPLAT &&
                     !request->is_captured && plan->lit_count > 0;
}

/* ---- costs -------------------------------------------------------------------------------------- */

static size_t program_count(const struct render_effect *effect)
{
    size_t count = 0;
    for (size_t p = 0; p < effect->pass_count; p++)
        count += effect->passes[p].draw != RENDER_DRAW_NOTHING;
    return count;
}

/* What an effect takes on this machine, of what it takes on that of cost.h. */
static double predict_ms(const struct render_request *request, const struct render_plan *plan,
                         const struct render_effect *effect, double cost_ms)
{
    if (effect->is_kept && request->is_warm && plan->deformed_vertex_count + plan->moved_vertex_count == 0)
        return 0;
    const struct render_effect_calibration *const here =
        render_calibration_find(request->calibration, effect->name);
    const double start_ms =
        here ? here->start_ms : effect->start_ms + RENDER_COST_PROGRAM_MS * (double)program_count(effect);
    const double here_ms = here ? here->fixed_ms + here->scale * cost_ms : cost_ms;
    return here_ms + (request->is_warm ? 0 : start_ms);
}

/* The same of what no effect does. */
static double predict_beside_ms(const struct render_request *request, const struct render_plan *plan)
{
    const struct render_effect_calibration *const here =
        render_calibration_find(request->calibration, RENDER_BESIDE_EFFECTS);
    const double cost_ms = render_cost_ms(RENDER_COST_BESIDE_PIXEL, render_cost_pixels(plan));
    const double here_ms = here ? here->fixed_ms + here->scale * cost_ms : cost_ms;
    return here_ms + (request->is_warm ? 0 : here ? here->start_ms : RENDER_COST_BESIDE_MS);
}

const char *const render_gather_names[] = { "auto", "c", "gl", NULL };

/* Whether everything that scatters in the picture does so alike in all channels. */
static bool is_grey(const struct render_plan *plan)
{
    bool is_grey = true;
    for (size_t m = 0; m < plan->media->count; m++)
        is_grey = is_grey && (!plan->of_medium[m].is_visible || !plan->media->media[m].has_scattering ||
                              render_medium_is_grey(&plan->media->media[m]));
    return is_grey;
}

/* Needs the bands. */
static void choose_gather(const struct render_request *request, struct render_plan *plan)
{
    const double c_ms = render_cost_gather_ms(plan, RENDER_GATHER_C, request->has_gpu),
                 gl_ms = render_cost_gather_ms(plan, RENDER_GATHER_GL, request->has_gpu);
    const double by_c_ms = predict_ms(request, plan, &render_effect_gather, c_ms),
                 by_gl_ms = predict_ms(request, plan, &render_effect_gather_gl, gl_ms);
    plan->has_gpu = request->has_gpu;
    plan->gather = by_gl_ms < by_c_ms ? RENDER_GATHER_GL : RENDER_GATHER_C;
    if (plan->technique != RENDER_TECHNIQUE_GATHER)
        plan->gather = RENDER_GATHER_C;
    else if (request->gather != RENDER_GATHER_AUTO)
        plan->gather = request->gather;
    snprintf(plan->gather_reason, sizeof plan->gather_reason, "%s%s: %.3g ms in C, %.3g by %sOpenGL",
             plan->gather == RENDER_GATHER_C && is_grey(plan) ? "grey: one profile for all channels; " : "",
             request->gather == RENDER_GATHER_AUTO ? "predicted" : "asked for; predicted", by_c_ms,
             by_gl_ms, request->has_gpu ? "" : "software ");
}

/* ---- the plan ----------------------------------------------------------------------------------- */

static void decide(const struct render_request *request, struct render_plan *plan)
{
    for (size_t e = 0; render_effects[e]; e++) {
        struct render_decision *const decision = &plan->decisions[e];
        *decision = render_effects[e]->decide(request, plan);
        if (decision->is_active && render_effects[e]->cost_ms)
            decision->cost_ms =
                predict_ms(request, plan, render_effects[e], render_effects[e]->cost_ms(plan));
        if (decision->is_active && render_effects[e]->error)
            decision->error = render_effects[e]->error(plan);
        plan->effect_count++;
    }
    plan->beside_ms = predict_beside_ms(request, plan);
}

bool render_plan_create(const struct render_request *request, struct render_plan **plan_out,
                        dipole_status *status)
{
    *plan_out = NULL;
    struct render_plan *const plan = calloc(1, sizeof *plan);
    if (!plan)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a plan");
    bool done = read_scene(request, plan, status);
    if (done) {
        render_plan_spend_epsilon(request, plan);
        tell_objects_apart(request, plan);
        choose_technique(request, plan);
        render_plan_space_samples(request, plan);
        render_plan_spend_on_gathering(request, plan);
        render_plan_choose_cells(request, plan);
        done = render_plan_light_from_around(request, plan, status) &&
               render_plan_make_views(request, plan, status) &&
               render_plan_make_shadows(request, plan, status) &&
               render_plan_make_maps(request, plan, status);
    }
    if (done) {
        render_plan_settle_spacing(request, plan);
        if (!plan->has_object_ids) /* footprints may reach farther than the profile */
            tell_objects_apart(request, plan);
        render_plan_predict_error(request, plan);
        render_plan_predict_map_error(request, plan);
        choose_gather(request, plan);
        decide(request, plan);
        render_plan_note_budget(request, plan);
        done = render_plan_add_passes(plan, render_effects, status);
    }
    if (done)
        *plan_out = plan;
    else
        render_plan_destroy(plan);
    return done;
}

void render_plan_destroy(struct render_plan *plan)
{
    if (!plan)
        return;
    render_plan_forget_environment(plan);
    render_media_destroy(plan->own_media);
    free(plan->objects);
    free(plan->of_medium);
    free(plan->views);
    free(plan->shadows.of_view);
    free(plan->shadows.of_map);
    render_casters_end(&plan->shadows.casters);
    free(plan->maps);
    free(plan->passes);
    free(plan);
}
