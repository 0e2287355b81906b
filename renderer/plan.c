#include "renderer/plan.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof *(array))

/*
 * How epsilon is shared out. Little may be cut off beyond r_max: where an object is lit from behind, light
 * from afar is all there is, a cut would show as a black patch, and another band costs little. A fifth is
 * left for what has no bound of its own, the texels of the lights' views and bands on curved surfaces.
 */
#define TRUNCATION_SHARE 0.1
#define ALIASING_SHARE 0.58
#define BANDING_SHARE 0.02
#define TABLE_SHARE 0.1

/* Rings of so many spacings keep the bands' error under their share of epsilon = 0.01; for a tenth of that,
 * so many more are needed (bands.h). */
#define RING_SPACINGS 6
#define RING_SPACINGS_PER_DECADE 2.3
#define RING_EPSILON 0.01

/* Cells of a light's view are so wide, as part of the spacing: surfaces up to 45 degrees from facing the
 * light need not be split, and few are sampled more densely than they need. */
#define CELL_SHARE 0.7

enum {
    VIEW_SIDE_LIMIT = 4096, /* every OpenGL 4.5 has 16384; six floats32x4 of this take 268 MB each   */
    VIEW_SIDE_WANTED = 768, /* shadows are drawn from the same view, so it never is coarser if it can */
    LEVELS_WANTED = 2,
    LEVELS_LIMIT = 12,
    LIGHT_LIMIT = 1024,
};

/* A sampled shape is followed by at least so many samples, however far the light scatters. */
#define SAMPLES_ACROSS 32

/* A point light this wide or less, seen from it, gets one view; a wider scene six. */
#define SINGLE_VIEW_ANGLE_RAD (100 * PI / 180)

const char *const render_technique_names[] = { "auto", "splat", "lambert", "reference", NULL };

/* Every texture of the renderer. */
static const struct render_texture textures[] = {
    { .name = "surface_position_mm", .is_multisampled = true }, /* xyz; w = 1 where an object is    */
    { .name = "surface_normal", .is_multisampled = true },      /* xyz; w = roughness, 0: no gloss  */
    { .name = "surface_depth", .format = RENDER_DEPTH32F, .is_multisampled = true },
    { .name = "position_mm" }, /* one point of the surface per pixel, w = 1                         */
    { .name = "normal" },
    { .name = "position_depth", .format = RENDER_DEPTH32F }, /* 0 where no object is                */
    { .name = "light_view", .size = RENDER_SIZE_LIGHT_VIEW },
    { .name = "light_depth", .format = RENDER_DEPTH32F, .size = RENDER_SIZE_LIGHT_VIEW },
    { .name = "light_samples", .format = RENDER_ON_CPU },
    { .name = "radiosity" }, /* W/mm^2                                                              */
    { .name = "specular" },  /* radiance, already averaged over the pixel                           */
    { .name = "radiance" },  /* premultiplied by a = coverage                                       */
    { .name = "capture" },   /* exit per sr, coverage, part of it that shows the pixel's own surface */
    { .name = "display" },   /* tone mapped, 0..1, linear                                           */
};

const struct render_texture *render_texture_find(const char *name)
{
    for (size_t i = 0; i < COUNT(textures); i++) {
        if (strcmp(textures[i].name, name) == 0)
            return &textures[i];
    }
    return NULL;
}

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

static void add_note(struct render_plan *plan, const char *format, ...) DIPOLE_PRINTF(2, 3);

static void add_note(struct render_plan *plan, const char *format, ...)
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

bool render_plan_check_media(const struct io_scene *scene, dipole_status *status)
{
    const dipole_place place = { .source = scene->path };
    const struct io_object *const first = &scene->objects[0];
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_object *const other = &scene->objects[i];
        if (!io_material_check_classical(&other->material, status))
            return false;
        int channel;
        double a, b;
        const char *const name = media_difference(&first->material, &other->material, &channel, &a, &b);
        if (name)
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                               "objects \"%s\" and \"%s\" are of different media (%s in %s: %g and %g), "
                               "expected one material in the whole scene",
                               first->name, other->name, name, io_channel_names[channel], a, b);
        const dipole_layer(*const layers)[DIPOLE_LAYER_LIMIT] = other->material.layers;
        const double eta[] = { layers[0][0].medium.eta, layers[1][0].medium.eta, layers[2][0].medium.eta };
        if (eta[1] != eta[0] || eta[2] != eta[0])
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                               "object \"%s\" has an eta per channel (%g, %g, %g), expected one",
                               other->name, eta[0], eta[1], eta[2]);
    }
    return true;
}

bool render_plan_check_table(const struct lut_splat *table, const struct io_material *material,
                             const dipole_place *place, dipole_status *status)
{
    const struct io_material *const baked = &table->rows[0].material;
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

bool render_light_shines(const struct io_light *light)
{
    return light->rgb[0] > 0 || light->rgb[1] > 0 || light->rgb[2] > 0;
}

bool render_scene_check(const struct io_scene *scene, double epsilon, dipole_status *status)
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

bool render_plan_read_scene(const struct render_request *request, struct render_plan *plan,
                            dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    const struct io_camera *const camera = &scene->camera;
    const struct io_material *const material = &scene->objects[0].material;
    if (!render_scene_check(scene, request->epsilon, status) || !render_plan_check_media(scene, status) ||
        (request->table && !render_plan_check_table(request->table, material, NULL, status)))
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!dipole_coefficients_init(&material->layers[c][0].medium, &plan->coefficients[c], status))
            return false;
        plan->diffuse_reflectance[c] = dipole_diffuse_reflectance(&plan->coefficients[c]);
        plan->has_scattering |= plan->coefficients[c].alpha_prime > 0;
    }
    plan->eta = material->layers[0][0].medium.eta;
    for (size_t i = 0; i < scene->object_count; i++)
        plan->has_specular |= scene->objects[i].has_specular;
    for (size_t i = 0; i < scene->light_count; i++)
        plan->lit_count += render_light_shines(&scene->lights[i]);
    plan->epsilon = request->epsilon;
    plan->width_px = camera->width_px;
    plan->height_px = camera->height_px;
    plan->ball = render_ball_of_scene(scene);
    render_projection_of_camera(camera, &plan->ball, &plan->camera);
    plan->pixel_mm = 2 * plan->camera.half_height / plan->height_px;
    return true;
}

/* ---- accuracy ----------------------------------------------------------------------------------- */

/* Largest over the channels that scatter. */
static double worst(const struct render_plan *plan,
                    double (*quantity)(const dipole_coefficients *coefficients, double argument),
                    double argument)
{
    double largest = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (plan->coefficients[c].alpha_prime > 0)
            largest = fmax(largest, quantity(&plan->coefficients[c], argument));
    }
    return largest;
}

static double aliasing(const dipole_coefficients *coefficients, double spacing_mm)
{
    return 4 * dipole_spectrum(coefficients, 2 * PI / spacing_mm) / dipole_spectrum(coefficients, 0);
}

static void spend_epsilon(const struct render_request *request, struct render_plan *plan)
{
    plan->truncation_epsilon = TRUNCATION_SHARE * plan->epsilon;
    plan->aliasing_epsilon = ALIASING_SHARE * plan->epsilon;
    plan->banding_epsilon = BANDING_SHARE * plan->epsilon;
    plan->table_epsilon = TABLE_SHARE * plan->epsilon;
    const double diameter_mm = 2 * plan->ball.radius_mm;
    plan->r_max_mm = worst(plan, dipole_r_max_mm, plan->truncation_epsilon);
    plan->table_error = plan->table_epsilon;
    if (request->table) {
        plan->r_max_mm = fmin(plan->r_max_mm, request->table->rows[0].axis.r_max_mm);
        plan->table_error = request->table->rows[0].error.max;
    }
    if (plan->r_max_mm >= diameter_mm)
        plan->r_max_mm = diameter_mm; /* every pair of points is near enough: nothing is cut off */
    else
        plan->truncation_error = worst(plan, dipole_tail_fraction, plan->r_max_mm);

    plan->spacing_mm = request->spacing_mm;
    if (!(plan->spacing_mm > 0)) {
        plan->spacing_mm = diameter_mm / SAMPLES_ACROSS;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const dipole_coefficients *const k = &plan->coefficients[c];
            if (k->alpha_prime > 0)
                plan->spacing_mm =
                    fmin(plan->spacing_mm, dipole_splat_spacing_mm(k, plan->aliasing_epsilon));
        }
    }
    const struct render_projection *const camera = &plan->camera;
    double nearest_mm = 1;
    if (!camera->is_orthographic) {
        double centre_mm[3];
        render_projection_to_view(camera, plan->ball.centre_mm, centre_mm);
        nearest_mm = fmax(sqrt(render_dot(centre_mm, centre_mm)) - plan->ball.radius_mm, camera->near_mm);
    }
    plan->r_max_px = plan->r_max_mm / (plan->pixel_mm * nearest_mm);
}

static void choose_bands(const struct render_request *request, struct render_plan *plan)
{
    const double decades = log10(RING_EPSILON / plan->epsilon);
    const double ring_spacings = RING_SPACINGS + RING_SPACINGS_PER_DECADE * fmax(decades, 0);
    if (plan->technique != RENDER_TECHNIQUE_SPLAT)
        return;
    /* What is captured is summed by others, from the finest samples alone. */
    const double reach_mm = request->is_captured ? 0 : plan->r_max_mm;
    plan->band_count = render_bands_make(plan->spacing_mm, reach_mm, ring_spacings, plan->bands);
}

static void choose_technique(const struct render_request *request, struct render_plan *plan)
{
    plan->technique = request->technique;
    if (request->is_captured)
        plan->technique = RENDER_TECHNIQUE_SPLAT;
    else if (plan->technique == RENDER_TECHNIQUE_AUTO)
        plan->technique =
            plan->has_scattering && plan->r_max_px < 1 ? RENDER_TECHNIQUE_LAMBERT : RENDER_TECHNIQUE_SPLAT;
}

/* ---- the lights' views -------------------------------------------------------------------------- */

/* Texels of a view so wide (at its far end) that blocks of them are at most the spacing wide there. */
static void choose_view_size(const struct render_plan *plan, double width_mm, struct render_plan_view *view)
{
    const double cells = ceil(width_mm / (CELL_SHARE * plan->spacing_mm) * (1 - 1e-9));
    const int cell_count = cells >= VIEW_SIDE_LIMIT ? VIEW_SIDE_LIMIT : cells < 1 ? 1 : (int)cells;
    view->levels = LEVELS_WANTED;
    while (view->levels < LEVELS_LIMIT && cell_count << view->levels < VIEW_SIDE_WANTED)
        view->levels++;
    while (view->levels > 0 && cell_count << view->levels > VIEW_SIDE_LIMIT)
        view->levels--;
    view->size_px = cell_count << view->levels;
    const double texel = 2 * view->projection.half_width / view->size_px;
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
    choose_view_size(plan, 2 * view.projection.half_width, &view);
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
        choose_view_size(plan, 2 * view.projection.half_width * view.projection.far_mm, &view);
        const double nearer = log2(view.projection.far_mm / view.projection.near_mm);
        view.levels += (int)ceil(fmin(nearer, LEVELS_LIMIT - view.levels));
        views[0] = view;
        return 1;
    }
    view.is_cube_face = true;
    view.projection.half_width = view.projection.half_height = 1;
    choose_view_size(plan, 2 * view.projection.far_mm, &view);
    view.levels = LEVELS_LIMIT; /* the surface may be as near as it likes */
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

/* How far apart samples of the view may be: as asked, or as the coarsest texels allow. */
static double widest_spacing_mm(const struct render_plan *plan, const struct render_plan_view *view)
{
    const double far_mm = view->projection.is_orthographic ? 1 : view->projection.far_mm;
    return fmax(plan->spacing_mm, 2 * view->projection.half_width * far_mm / view->size_px);
}

static bool make_views(const struct render_request *request, struct render_plan *plan,
                       dipole_status *status)
{
    const struct io_scene *const scene = request->scene;
    if (plan->lit_count == 0)
        return true;
    plan->views = calloc(6 * plan->lit_count, sizeof *plan->views);
    if (!plan->views)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the views of %zu lights",
                           plan->lit_count);
    double widest_mm = plan->spacing_mm;
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
        widest_mm = fmax(widest_mm, widest_spacing_mm(plan, view));
    }
    if (plan->technique != RENDER_TECHNIQUE_SPLAT || request->is_captured)
        return true;
    plan->aliasing_error = worst(plan, aliasing, widest_mm);
    if (widest_mm > plan->spacing_mm * (1 + 1e-6))
        add_note(plan,
                 "light samples are %.3g mm apart, %.3g mm were asked: a light's view is limited to %d "
                 "texels a side; predicted aliasing is %.2g",
                 widest_mm, plan->spacing_mm, VIEW_SIDE_LIMIT, plan->aliasing_error);
    return true;
}

static void predict_error(const struct render_request *request, struct render_plan *plan)
{
    if (plan->technique != RENDER_TECHNIQUE_SPLAT || request->is_captured || !plan->has_scattering)
        return;
    plan->banding_error = plan->band_count > 1 ? plan->banding_epsilon : 0;
    plan->error_predicted =
        plan->truncation_error + plan->aliasing_error + plan->banding_error + plan->table_error;
    if (request->table && plan->table_error + plan->truncation_error >
                              (plan->table_epsilon + plan->truncation_epsilon) * 1.001)
        add_note(plan,
                 "the table was baked with epsilon %.3g: the predicted error is %.2g, %.3g was asked; one "
                 "baked with %.3g keeps it",
                 request->table->epsilon, plan->error_predicted, plan->epsilon, plan->table_epsilon);
}

/* ---- passes ------------------------------------------------------------------------------------- */

/* Every active pass, effect by effect. */
static size_t list_passes(const struct render_plan *plan, const struct render_effect *const *effects,
                          struct render_plan_pass *rows)
{
    size_t count = 0;
    for (size_t e = 0; effects[e]; e++) {
        for (size_t p = 0; plan->decisions[e].is_active && p < effects[e]->pass_count; p++) {
            if (rows)
                rows[count] = (struct render_plan_pass){ .pass = &effects[e]->passes[p], .effect = e };
            count++;
        }
    }
    return count;
}

static bool writes(const struct render_pass *pass, const char *texture)
{
    for (size_t w = 0; w < RENDER_PASS_WRITES && pass->writes[w]; w++) {
        if (strcmp(pass->writes[w], texture) == 0)
            return true;
    }
    return pass->depth_written && strcmp(pass->depth_written, texture) == 0;
}

static bool writes_before(const struct render_plan *plan, size_t end, const char *texture)
{
    for (size_t i = 0; i < end; i++) {
        if (writes(plan->passes[i].pass, texture))
            return true;
    }
    return false;
}

bool render_plan_writes(const struct render_plan *plan, const char *texture)
{
    return writes_before(plan, plan->pass_count, texture);
}

bool render_plan_reads(const struct render_plan *plan, const char *texture)
{
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        for (size_t r = 0; r < RENDER_PASS_READS && pass->reads[r]; r++) {
            if (strcmp(pass->reads[r], texture) == 0)
                return true;
        }
    }
    return false;
}

static bool check_pass(const struct render_plan *plan, size_t index, dipole_status *status)
{
    const struct render_pass *const pass = plan->passes[index].pass;
    const char *missing = NULL;
    assert(pass);
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads[r]; r++) {
        if (!writes_before(plan, index, pass->reads[r]))
            missing = pass->reads[r];
    }
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads_if_written[r]; r++) {
        if (render_plan_writes(plan, pass->reads_if_written[r]) &&
            !writes_before(plan, index, pass->reads_if_written[r]))
            missing = pass->reads_if_written[r];
    }
    if (pass->depth_tested && !writes_before(plan, index, pass->depth_tested))
        missing = pass->depth_tested;
    if (missing)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "pass \"%s\" reads texture \"%s\" before any pass has written it", pass->name,
                           missing);
    return true;
}

bool render_plan_add_passes(struct render_plan *plan, const struct render_effect *const *effects,
                            dipole_status *status)
{
    const size_t row_count = list_passes(plan, effects, NULL);
    const size_t repeats = plan->view_count > 1 ? plan->view_count : 1;
    struct render_plan_pass *const rows = calloc(row_count + 1, sizeof *rows);
    plan->passes = calloc(row_count * repeats + 1, sizeof *plan->passes);
    bool done = rows && plan->passes;
    if (done)
        list_passes(plan, effects, rows);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu passes", row_count * repeats);
    for (size_t begin = 0, end; done && begin < row_count; begin = end) {
        end = begin + 1;
        if (!rows[begin].pass->is_per_view) {
            plan->passes[plan->pass_count++] = rows[begin];
            continue;
        }
        while (end < row_count && rows[end].pass->is_per_view)
            end++;
        for (size_t view = 0; view < plan->view_count; view++) {
            for (size_t i = begin; i < end; i++) {
                plan->passes[plan->pass_count] = rows[i];
                plan->passes[plan->pass_count++].view = view;
            }
        }
    }
    free(rows);
    for (size_t i = 0; done && i < plan->pass_count; i++)
        done = check_pass(plan, i, status);
    return done;
}

/* ---- the plan ----------------------------------------------------------------------------------- */

static void decide(const struct render_request *request, struct render_plan *plan)
{
    for (size_t e = 0; render_effects[e]; e++) {
        plan->decisions[e] = render_effects[e]->decide(request, plan);
        plan->effect_count++;
    }
}

bool render_plan_create(const struct render_request *request, struct render_plan **plan_out,
                        dipole_status *status)
{
    *plan_out = NULL;
    struct render_plan *const plan = calloc(1, sizeof *plan);
    if (!plan)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a plan");
    bool done = render_plan_read_scene(request, plan, status);
    if (done) {
        spend_epsilon(request, plan);
        choose_technique(request, plan);
        choose_bands(request, plan);
        done = make_views(request, plan, status);
    }
    if (done) {
        predict_error(request, plan);
        decide(request, plan);
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
    free(plan->views);
    free(plan->passes);
    free(plan);
}
