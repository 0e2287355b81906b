#include "renderer/render.h"

#include "renderer/context.h"
#include "renderer/execute.h"
#include "renderer/reference.h"
#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* By the file that accuracy --calibrate left, if it did; a damaged one is none. */
static void calibrate(struct renderer *renderer)
{
    char path[4096], driver[RENDER_MACHINE_TEXT];
    snprintf(driver, sizeof driver, "%s, OpenGL %s", (const char *)glGetString(GL_RENDERER),
             (const char *)glGetString(GL_VERSION));
    render_machine_identify(driver, &renderer->machine);
    renderer->is_calibrated =
        render_calibration_path(&renderer->machine, path, sizeof path, NULL) &&
        render_calibration_read(path, &renderer->machine, &renderer->calibration, NULL);
}

bool render_create(const struct io_scene *scene, enum render_context_kind kind,
                   struct renderer **renderer_out, dipole_status *status)
{
    *renderer_out = NULL;
    struct renderer *const renderer = calloc(1, sizeof *renderer);
    if (!renderer)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a renderer");
    renderer->scene = scene;
    const bool done = render_media_create(scene, &renderer->media, status) &&
                      (!scene->has_environment ||
                       render_environment_read(&scene->environment, &renderer->environment, status)) &&
                      render_context_create(kind, &renderer->context, status) &&
                      renderer->context->make_current(renderer->context, status) &&
                      render_gl_start(renderer->context->load, &renderer->errors, status) &&
                      render_executor_create(scene, &renderer->errors, &renderer->executor, status);
    if (done) {
        renderer->has_gpu = !render_gl_is_software();
        calibrate(renderer);
        *renderer_out = renderer;
    } else {
        render_destroy(renderer);
    }
    return done;
}

void render_destroy(struct renderer *renderer)
{
    if (!renderer)
        return;
    if (renderer->executor && render_make_current(renderer, NULL))
        render_executor_destroy(renderer->executor);
    render_context_destroy(renderer->context);
    render_tables_destroy(renderer->tables);
    render_volumes_destroy(renderer->volumes);
    render_media_destroy(renderer->media);
    render_environment_destroy(renderer->environment);
    free(renderer);
}

bool render_renew_materials(struct renderer *renderer, dipole_status *status)
{
    struct render_media *media = NULL;
    if (!render_media_create(renderer->scene, &media, status) || !render_make_current(renderer, status)) {
        render_media_destroy(media);
        return false;
    }
    render_executor_renew_materials(renderer->executor, renderer->scene);
    render_tables_destroy(renderer->tables);
    render_volumes_destroy(renderer->volumes);
    render_media_destroy(renderer->media);
    renderer->tables = NULL;
    renderer->volumes = NULL;
    renderer->media = media;
    return true;
}

bool render_make_current(struct renderer *renderer, dipole_status *status)
{
    /* Functions of one kind of context are not those of another: load them again each time. */
    return renderer->context->make_current(renderer->context, status) &&
           render_gl_start(renderer->context->load, &renderer->errors, status);
}

/* The tables that the plan splats with: the caller's, or some baked now and kept for later calls. */
static bool tables_for(struct renderer *renderer, const struct render_request *request,
                       const struct render_plan *plan, const struct render_table **tables_out,
                       dipole_status *status)
{
    *tables_out = request->tables;
    if (request->tables || !render_plan_reads(plan, "light_samples"))
        return true;
    if (!renderer->tables || renderer->tables->epsilon > plan->table_epsilon) {
        render_executor_forget_tables(renderer->executor);
        render_tables_destroy(renderer->tables);
        renderer->tables = NULL;
        if (!render_tables_bake(renderer->media, plan->table_epsilon, &renderer->tables, status))
            return false;
    }
    *tables_out = renderer->tables->of_medium;
    return true;
}

/* Volumes for the request, if it has none and may need some: baked now and kept for later calls. */
static bool add_volumes(struct renderer *renderer, struct render_request *request, dipole_status *status)
{
    if (request->technique != RENDER_TECHNIQUE_TSM || request->volumes || request->is_captured)
        return true;
    const double epsilon = render_volume_epsilon(request->epsilon);
    const int slice_count = render_plan_slice_count(request->tsm.sample_count);
    if (slice_count == 0) /* the plan tells */
        return true;
    if (!renderer->volumes || renderer->volumes->epsilon > epsilon ||
        renderer->volumes->slice_count != slice_count) {
        if (!render_make_current(renderer, status))
            return false;
        render_executor_forget_tables(renderer->executor);
        render_volumes_destroy(renderer->volumes);
        renderer->volumes = NULL;
        if (!render_volumes_bake(renderer->media, epsilon, slice_count, &renderer->volumes, status))
            return false;
    }
    request->volumes = (const struct lut_tsm *const *)renderer->volumes->volumes;
    return true;
}

/* Take the scene's map again if its scale or turn have changed. */
static bool follow_environment(struct renderer *renderer, dipole_status *status)
{
    const struct io_environment *const wanted = &renderer->scene->environment;
    struct render_environment *const known = renderer->environment, *renewed;
    if (!known || (known->rotate_rad == wanted->rotate_rad && known->rgb[0] == wanted->rgb[0] &&
                   known->rgb[1] == wanted->rgb[1] && known->rgb[2] == wanted->rgb[2]))
        return true;
    if (!render_environment_read(wanted, &renewed, status))
        return false;
    render_environment_destroy(known);
    renderer->environment = renewed;
    return true;
}

bool render_run(struct renderer *renderer, const struct render_request *request_in,
                struct render_plan **plan_out, double time_ms[RENDER_EFFECT_LIMIT], dipole_status *status)
{
    const struct render_table *tables;
    struct render_request request = *request_in;
    *plan_out = NULL;
    if (!follow_environment(renderer, status))
        return false;
    request.environment = renderer->environment;
    request.has_gpu = renderer->has_gpu;
    request.calibration = renderer->is_calibrated ? &renderer->calibration : NULL;
    request.is_warm = request_in->is_warm || renderer->is_warm;
    struct render_plan *plan = NULL;
    render_media_measure(renderer->scene, renderer->media);
    const bool done =
        render_plan_check_request(request.scene, request.epsilon, status) &&
        render_plan_spend_budget(&request, status) && add_volumes(renderer, &request, status) &&
        render_plan_create(&request, &plan, status) && render_make_current(renderer, status) &&
        tables_for(renderer, &request, plan, &tables, status) &&
        render_executor_run(renderer->executor, &request, plan, tables, request.volumes, time_ms, status);
    if (done)
        *plan_out = plan;
    else
        render_plan_destroy(plan);
    renderer->is_warm = renderer->is_warm || done;
    return done;
}

void render_fill_report(const struct renderer *renderer, const struct render_plan *plan,
                        const double time_ms[RENDER_EFFECT_LIMIT], struct render_report *report)
{
    const bool is_splatted = render_plan_reads(plan, "light_samples");
    const struct render_splatter *const splatter = render_executor_splatter(renderer->executor);
    *report = (struct render_report){
        .technique = plan->technique,
        .epsilon = plan->epsilon,
        .budget_ms = plan->budget_ms,
        .predicted_ms = render_plan_cost_ms(plan),
        .error_predicted = plan->error_predicted,
        .truncation_error = plan->truncation_error,
        .aliasing_error = plan->aliasing_error,
        .blur_error = plan->blur_error,
        .banding_error = plan->banding_error,
        .table_error = plan->table_error,
        .environment_error = plan->environment_error,
        .band_count = plan->band_count,
        .r_max_mm = is_splatted ? plan->r_max_mm : 0,
        .spacing_mm = !is_splatted     ? 0
                      : plan->has_grid ? plan->grid_texel_mm
                                       : plan->spacing_mm,
        .sample_count = splatter ? render_splatter_sample_count(splatter) : 0,
        .splat_count = splatter ? render_splatter_splat_count(splatter) : 0,
        .view_count = plan->view_count,
        .map_count = (int)plan->map_count,
        .map_side_px = render_plan_map_side_px(plan),
        .effect_count = plan->effect_count,
        .note_count = plan->note_count,
    };
    for (size_t e = 0; e < plan->effect_count; e++) {
        report->effects[e].name = render_effects[e]->name;
        report->effects[e].is_active = plan->decisions[e].is_active;
        report->effects[e].predicted_ms = plan->decisions[e].cost_ms;
        report->effects[e].error = plan->decisions[e].error;
        report->effects[e].time_ms = time_ms[e];
        memcpy(report->effects[e].reason, plan->decisions[e].reason, sizeof report->effects[e].reason);
    }
    memcpy(report->notes, plan->notes, sizeof report->notes);
}

static void set_attributes(struct io_image *image, const struct render_plan *plan)
{
    char names[512];
    io_image_set_text(image, "dipole:kind", "picture");
    io_image_set_text(image, "dipole:version", dipole_version());
    io_image_set_text(image, "dipole:technique", render_technique_names[plan->technique]);
    io_image_set_text(image, "dipole:material", render_media_list_names(plan->media, names, sizeof names));
    if (plan->media->count == 1)
        io_image_set_text(image, "dipole:model", io_model_names[plan->media->media[0].material->model]);
    io_image_set_number(image, "dipole:epsilon", plan->epsilon);
    if (render_plan_reads(plan, "light_samples")) {
        io_image_set_number(image, "dipole:error_predicted", plan->error_predicted);
        io_image_set_number(image, "dipole:r_max_mm", plan->r_max_mm);
        io_image_set_number(image, "dipole:spacing_mm",
                            plan->has_grid ? plan->grid_texel_mm : plan->spacing_mm);
        io_image_set_number(image, "dipole:blur_error", plan->blur_error);
        if (plan->media->count == 1 && plan->blur_error > 0)
            io_image_set_numbers(image, "dipole:blur_mm", plan->of_medium[0].blur_mm);
        io_image_set_number(image, "dipole:banding_error", plan->banding_error);
        io_image_set_number(image, "dipole:table_error", plan->table_error);
    }
}

struct render_request render_request_for(const struct renderer *renderer,
                                         const struct render_options *options)
{
    return (struct render_request){
        .scene = renderer->scene,
        .technique = options->technique,
        .area = options->area,
        .coherence = options->coherence,
        .splat_grid = options->splat_grid,
        .gather = options->gather,
        .epsilon = options->epsilon > 0 ? options->epsilon : RENDER_EPSILON_DEFAULT,
        .budget_ms = options->budget_ms,
        .is_warm = options->is_warm,
        .limits = options->limits,
        .media = renderer->media,
        .tables = options->tables,
        .volumes = options->volumes,
        .tsm = options->tsm,
        .shadows = options->shadows,
        .environment_samples = options->environment_samples,
        .ambient_visibility = options->ambient_visibility,
        .is_tone_mapped = options->is_tone_mapped,
        .keeps_negligible = options->keeps_negligible,
    };
}

bool render_draw(struct renderer *renderer, const struct render_options *options,
                 struct io_image **image_out, struct render_report *report_out, dipole_status *status)
{
    if (options->technique == RENDER_TECHNIQUE_REFERENCE)
        return false;
    const double start_ms = now_ms();
    const struct render_request request = render_request_for(renderer, options);
    double time_ms[RENDER_EFFECT_LIMIT];
    struct render_plan *plan = NULL;
    struct io_image *image = NULL;
    *image_out = NULL;
    const bool done =
        render_run(renderer, &request, &plan, time_ms, status) &&
        io_image_create(plan->width_px, plan->height_px, 4, &image, status) &&
        render_executor_read(renderer->executor, options->is_tone_mapped ? "display" : "radiance",
                             image->pixels, status);
    if (done) {
        set_attributes(image, plan);
        if (options->is_tone_mapped)
            io_image_set_number(image, "dipole:linear_limit", RENDER_TONE_KNEE);
        *image_out = image;
    } else {
        io_image_destroy(image);
    }
    if (done && report_out) {
        render_fill_report(renderer, plan, time_ms, report_out);
        report_out->total_ms = now_ms() - start_ms;
    }
    render_plan_destroy(plan);
    return done;
}

/* ---- capture ------------------------------------------------------------------------------------ */

static struct render_capture *capture_create(int width_px, int height_px)
{
    const size_t pixel_count = (size_t)width_px * (size_t)height_px;
    struct render_capture *const capture = calloc(1, sizeof *capture);
    if (!capture)
        return NULL;
    capture->width_px = width_px;
    capture->height_px = height_px;
    capture->position_mm = calloc(pixel_count, 3 * sizeof *capture->position_mm);
    capture->object = calloc(pixel_count, sizeof *capture->object);
    capture->coverage = calloc(pixel_count, sizeof *capture->coverage);
    capture->exit_per_sr = calloc(pixel_count, sizeof *capture->exit_per_sr);
    capture->specular = calloc(pixel_count, 3 * sizeof *capture->specular);
    if (capture->position_mm && capture->object && capture->coverage && capture->exit_per_sr &&
        capture->specular)
        return capture;
    render_capture_destroy(capture);
    return NULL;
}

void render_capture_destroy(struct render_capture *capture)
{
    if (!capture)
        return;
    free(capture->position_mm);
    free(capture->object);
    free(capture->coverage);
    free(capture->exit_per_sr);
    free(capture->specular);
    render_light_samples_destroy(&capture->samples);
    free(capture);
}

static void copy_rgb(const float *rgba, size_t pixel_count, float *rgb)
{
    for (size_t i = 0; i < pixel_count; i++)
        memcpy(rgb + 3 * i, rgba + 4 * i, 3 * sizeof *rgb);
}

/* Whether pixel (x, y) and its neighbours are covered by four points of one surface each. */
static bool is_interior(const float *parts, int width_px, int height_px, int x, int y)
{
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < height_px; j++) {
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < width_px; i++) {
            if (parts[4 * ((size_t)j * (size_t)width_px + (size_t)i) + 1] < 1)
                return false;
        }
    }
    return parts[4 * ((size_t)y * (size_t)width_px + (size_t)x) + 2] >= 1;
}

static void take_parts(const float *parts, struct render_capture *capture)
{
    /* Three of four points covered: what a pixel that is not exact claims at most. */
    const float inexact = 0.75f;
    for (int y = 0; y < capture->height_px; y++) {
        for (int x = 0; x < capture->width_px; x++) {
            const size_t i = (size_t)y * (size_t)capture->width_px + (size_t)x;
            const bool is_exact = is_interior(parts, capture->width_px, capture->height_px, x, y);
            capture->exit_per_sr[i] = parts[4 * i];
            capture->coverage[i] = is_exact ? 1 : fminf(parts[4 * i + 1], inexact);
        }
    }
}

static bool capture_read(struct renderer *renderer, const struct render_plan *plan, float *rgba,
                         struct render_capture *capture, dipole_status *status)
{
    const size_t pixel_count = (size_t)capture->width_px * (size_t)capture->height_px;
    if (!render_executor_read(renderer->executor, "position_mm", rgba, status))
        return false;
    copy_rgb(rgba, pixel_count, capture->position_mm);
    for (size_t i = 0; i < pixel_count; i++)
        capture->object[i] = rgba[4 * i + 3];
    if (!render_executor_read(renderer->executor, "capture", rgba, status))
        return false;
    take_parts(rgba, capture);
    if (!render_plan_writes(plan, "specular"))
        return true;
    if (!render_executor_read(renderer->executor, "specular", rgba, status))
        return false;
    copy_rgb(rgba, pixel_count, capture->specular);
    return true;
}

bool render_capture_create(struct renderer *renderer, double spacing_mm,
                           struct render_capture **capture_out, dipole_status *status)
{
    *capture_out = NULL;
    if (!(spacing_mm > 0))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "spacing_mm is %g, expected > 0", spacing_mm);
    if (renderer->media->count > 1)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &(dipole_place){ .source = renderer->scene->path },
                           "the scene's objects are of %zu different materials, expected one",
                           renderer->media->count);
    const struct render_request request = { .scene = renderer->scene,
                                            .media = renderer->media,
                                            .technique = RENDER_TECHNIQUE_SPLAT,
                                            .epsilon = RENDER_EPSILON_DEFAULT,
                                            .spacing_mm = spacing_mm,
                                            .is_captured = true };
    const struct io_camera *const camera = &renderer->scene->camera;
    double time_ms[RENDER_EFFECT_LIMIT];
    struct render_plan *plan = NULL;
    if (!render_run(renderer, &request, &plan, time_ms, status))
        return false;
    struct render_capture *const capture = capture_create(camera->width_px, camera->height_px);
    float *const rgba = calloc((size_t)camera->width_px * (size_t)camera->height_px, 4 * sizeof *rgba);
    bool done = capture && rgba;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to capture a picture of %dx%d",
                    camera->width_px, camera->height_px);
    done = done && capture_read(renderer, plan, rgba, capture, status);
    if (done) {
        /* The executor makes new samples in its next run: these are the capture's now. */
        struct render_splatter *const splatter = render_executor_splatter(renderer->executor);
        if (splatter) { /* else no light shines */
            struct render_light_samples *const samples = render_splatter_samples(splatter, 0);
            capture->samples = *samples;
            *samples = (struct render_light_samples){ 0 };
        }
        *capture_out = capture;
    } else {
        render_capture_destroy(capture);
    }
    free(rgba);
    render_plan_destroy(plan);
    return done;
}
