#include "renderer/reference.h"

#include "lutgen/parallel.h"
#include "renderer/environment_visibility.h"
#include "renderer/plan.h"
#include "renderer/reference_sum.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI 3.14159265358979323846

enum {
    FIRST_POINTS = 1 << 13, /* of each half                                                 */
    DOUBLINGS_LEAST = 3,    /* sums that are compared before one can be trusted             */
    BANDS_AT_ONCE = 8,      /* between two reports of progress                              */
    PROBED_PIXELS = 800,    /* from which errors are estimated, at least; few pixels: all   */
    POINTS_PER_PIXEL = 150, /* are found in the time in which a pixel is summed, for progress */
};

/* An estimate that falls to less than this in a doubling did so by luck. Measured falls are 0.4 to 0.6. */
#define FALL_LIMIT 0.25

/* Points of a pixel within so much of a mean free path share a sum. Radiosity is as smooth as the profile:
 * this errs by about (0.2)^2 / 8 of its curvature over a mean free path, where a pixel is as wide at all.
 */
#define GROUP_SHARE 0.2

/* Radiance this far below the picture's root mean square may err by the tree's error of this. */
#define LEAST_SHARE 1e-3

enum row {
    ROW_SURFACE,
    ROW_VISIBILITY,
    ROW_ENVIRONMENT,
    ROW_INTEGRAL,
    ROW_SPECULAR,
    ROW_TONE_MAP,
    ROW_COUNT
};
static const char *const row_names[ROW_COUNT] = { "surface",          "visibility", "environment",
                                                  "surface_integral", "specular",   "tone_map" };

struct reference {
    const struct io_scene *scene;
    const struct render_options *options;
    struct render_media *media;
    struct render_pixel_medium *pixel_media; /* of each object */
    double path_mm;                          /* shortest mean free path of all that scatters */
    size_t lit_count;                        /* lights that shine */
    struct render_environment *environment;  /* NULL: none, or black */
    struct render_casters casters;
    struct render_tracer *tracer;
    struct render_surface *surface;
    struct render_pixel_view view;
    struct render_sum *sum;
    struct io_image *image;
    double *halves[2], *last; /* radiance, three to a pixel: by each half; mean of the sums before */
    double last_halves2[IO_CHANNEL_COUNT]; /* square of what those halves differ by */
    double wanted_error;
    double least[IO_CHANNEL_COUNT]; /* radiance that is little in this picture */
    size_t point_count;             /* of each half */
    int step_px;                    /* between pixels from which errors are estimated */
    double work_done, work_shown;   /* in points: so far, and expected in all, for progress */
    struct render_report report;
};

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static void show(const struct reference *reference, const char *what, double fraction)
{
    const struct render_progress *const progress = &reference->options->progress;
    if (progress->show)
        progress->show(progress->context, what, fraction);
}

static void explain(struct reference *reference, enum row row, bool is_active, const char *format, ...)
    DIPOLE_PRINTF(4, 5);

static void explain(struct reference *reference, enum row row, bool is_active, const char *format, ...)
{
    struct render_effect_report *const effect = &reference->report.effects[row];
    effect->is_active = is_active;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(effect->reason, sizeof effect->reason, format, arguments);
    va_end(arguments);
}

/* ---- what is seen ------------------------------------------------------------------------------- */

static void see_row(void *context, int y)
{
    const struct reference *const reference = context;
    const int width_px = reference->view.width_px;
    struct render_pixel pixel;
    for (int x = 0; x < width_px; x++) {
        render_pixel_trace(&reference->view, x, y, &pixel);
        float *const rgba = reference->image->pixels + 4 * ((size_t)y * (size_t)width_px + (size_t)x);
        rgba[3] = (float)pixel.hit_count / RENDER_PIXEL_RAYS;
    }
}

static void add_specular_row(void *context, int y)
{
    const struct reference *const reference = context;
    const int width_px = reference->view.width_px;
    struct render_pixel pixel;
    for (int x = 0; x < width_px; x++) {
        float *const rgba = reference->image->pixels + 4 * ((size_t)y * (size_t)width_px + (size_t)x);
        uint64_t number = ((uint64_t)y * (uint64_t)width_px + (uint64_t)x) * RENDER_PIXEL_RAYS;
        double radiance[3] = { 0 };
        if (!(rgba[3] > 0))
            continue;
        render_pixel_trace(&reference->view, x, y, &pixel);
        for (int g = 0; g < pixel.group_count; g++) {
            for (int i = 0; i < pixel.groups[g].count; i++, number++)
                render_pixel_add_specular(&reference->view, &pixel.groups[g].points[i], number, radiance);
        }
        for (int c = 0; c < 3; c++)
            rgba[c] += (float)(radiance[c] / RENDER_PIXEL_RAYS);
    }
}

static bool see(struct reference *reference, dipole_status *status)
{
    const double start_ms = now_ms();
    if (!io_image_create(reference->view.width_px, reference->view.height_px, 4, &reference->image, status))
        return false;
    lut_parallel_for(reference->view.height_px, reference->options->thread_count, see_row, reference);
    reference->report.effects[ROW_SURFACE].time_ms += now_ms() - start_ms;
    explain(reference, ROW_SURFACE, true, "%zu object%s in the scene, %d rays to a pixel",
            reference->scene->object_count, reference->scene->object_count == 1 ? "" : "s",
            RENDER_PIXEL_RAYS);
    return true;
}

static bool is_anything_seen(const struct reference *reference)
{
    const size_t count = (size_t)reference->view.width_px * (size_t)reference->view.height_px;
    for (size_t i = 0; i < count; i++) {
        if (reference->image->pixels[4 * i + 3] > 0)
            return true;
    }
    return false;
}

/* ---- the integral ------------------------------------------------------------------------------- */

static size_t pixel_count(const struct reference *reference)
{
    return (size_t)reference->view.width_px * (size_t)reference->view.height_px;
}

/* Work of a pass, in points. */
static double work_of(const struct reference *reference, size_t point_count, int step_px)
{
    return 2 * (double)point_count +
           POINTS_PER_PIXEL * (double)pixel_count(reference) / (double)(step_px * step_px);
}

/* Sum over that many points of either half, for every pixel or for a part of them. */
static bool sum_points(struct reference *reference, struct render_sum_pass *pass, dipole_status *status)
{
    const size_t value_count = 3 * pixel_count(reference), point_count = pass->point_count;
    const double work = work_of(reference, point_count, pass->step_px);
    struct render_effect_report *const effects = reference->report.effects;
    for (size_t i = 0; i < value_count; i++)
        reference->halves[0][i] = reference->halves[1][i] = 0;
    memcpy(pass->least, reference->least, sizeof pass->least);
    for (size_t first = 0; first < point_count; first += RENDER_SUM_CHUNK) {
        const size_t rest = point_count - first, chunk = rest < RENDER_SUM_CHUNK ? rest : RENDER_SUM_CHUNK;
        const double start_ms = now_ms();
        if (!render_sum_take(reference->sum, pass, first, chunk, status))
            return false;
        const double taken_ms = now_ms(), part = (double)chunk / (double)point_count;
        const int band_count = render_sum_band_count(reference->sum, pass);
        for (int band = 0; band < band_count; band += BANDS_AT_ONCE) {
            const int bands = band_count - band < BANDS_AT_ONCE ? band_count - band : BANDS_AT_ONCE;
            render_sum_add_bands(reference->sum, pass, band, bands, reference->halves);
            reference->work_done += work * part * bands / band_count;
            show(reference, "surface integral", fmin(reference->work_done / reference->work_shown, 0.99));
        }
        effects[ROW_VISIBILITY].time_ms += taken_ms - start_ms;
        effects[ROW_INTEGRAL].time_ms += now_ms() - taken_ms;
    }
    return true;
}

/*
 * Largest over the channels of the relative RMSE over the picture. Two halves of independent error differ
 * by twice that of their mean. What errs alike in both changes with the number of points: by as much as is
 * left, if it falls by half in a doubling, and by more if it falls faster; but the change holds the
 * independent errors of both sums, too.
 */
static double estimate_error(struct reference *reference)
{
    const size_t value_count = 3 * pixel_count(reference);
    double largest = 0;
    size_t seen_count = 0;
    for (size_t i = 0; i < value_count; i += 3) {
        const double *const a = reference->halves[0] + i;
        seen_count += a[0] + a[1] + a[2] > 0;
    }
    for (size_t c = 0; c < 3; c++) {
        double halves2 = 0, change2 = 0, value2 = 0;
        for (size_t i = c; i < value_count; i += 3) {
            const double a = reference->halves[0][i], b = reference->halves[1][i], mean = 0.5 * (a + b);
            halves2 += 0.25 * (a - b) * (a - b);
            change2 += (mean - reference->last[i]) * (mean - reference->last[i]);
            value2 += mean * mean;
            reference->last[i] = mean;
        }
        const double alike2 = fmax(change2 - halves2 - reference->last_halves2[c], 0);
        if (value2 > 0) {
            largest = fmax(largest,
                           sqrt((halves2 + (reference->report.doubling_count > 0 ? alike2 : 0)) / value2));
            reference->least[c] = LEAST_SHARE * sqrt(value2 / (double)seen_count);
        }
        reference->last_halves2[c] = halves2;
    }
    return largest;
}

static double spacing_mm(const struct reference *reference)
{
    return sqrt(render_surface_area_mm2(reference->surface) / (double)reference->point_count);
}

static void expect_work(struct reference *reference, double error)
{
    const double spread = reference->report.spacing_mm / reference->path_mm;
    const double more = fmax(fmax(error / reference->wanted_error, spread * spread), 1);
    double point_count = (double)reference->point_count;
    reference->work_shown = reference->work_done;
    for (double left = more; left > 1; left /= 2) {
        point_count *= 2;
        reference->work_shown += 2 * point_count;
    }
    reference->work_shown += work_of(reference, (size_t)point_count, 1);
}

static void add_doubling(struct reference *reference)
{
    struct render_report *const report = &reference->report;
    double error = estimate_error(reference);
    if (report->doubling_count > 0)
        error = fmax(error, FALL_LIMIT * report->doublings[report->doubling_count - 1].error);
    report->sample_count = 2 * reference->point_count;
    report->error_predicted = error;
    report->effects[ROW_INTEGRAL].error = error;
    report->spacing_mm = spacing_mm(reference);
    report->doublings[report->doubling_count++] =
        (struct render_doubling){ .sample_count = report->sample_count, .error = error };
    expect_work(reference, error);
}

static bool is_converged(const struct reference *reference)
{
    const struct render_report *const report = &reference->report;
    return report->doubling_count >= DOUBLINGS_LEAST &&
           report->error_predicted <= reference->wanted_error && report->spacing_mm <= reference->path_mm;
}

static bool is_glossy(const struct io_scene *scene)
{
    bool is_glossy = false;
    for (size_t i = 0; i < scene->object_count; i++)
        is_glossy |= scene->objects[i].has_specular;
    return is_glossy;
}

static void explain_environment(struct reference *reference)
{
    struct render_report *const report = &reference->report;
    const int ray_count = reference->options->ambient_visibility;
    if (!reference->environment) {
        explain(reference, ROW_ENVIRONMENT, false,
                reference->scene->has_environment ? "the environment is black" : "the scene has none");
        return;
    }
    if (ray_count > 0)
        explain(reference, ROW_ENVIRONMENT, true, "summed without harmonics; %d rays from each sample",
                ray_count);
    else
        explain(reference, ROW_ENVIRONMENT, true, "summed without harmonics; nothing stands in its way");
    if (is_glossy(reference->scene))
        snprintf(report->notes[report->note_count++], sizeof report->notes[0],
                 "gloss does not mirror the environment");
}

static void note_shortfall(struct reference *reference)
{
    struct render_report *const report = &reference->report;
    snprintf(
        report->notes[report->note_count++], sizeof report->notes[0],
        "the reference stopped at %zu samples: error estimated %.2g, %.2g was wanted; samples are %.3g mm "
        "apart, the shortest mean free path is %.3g mm",
        report->sample_count, report->error_predicted, reference->wanted_error, report->spacing_mm,
        reference->path_mm);
}

/* The last errors, as many as the reason holds. */
static void explain_integral(struct reference *reference)
{
    const struct render_report *const report = &reference->report;
    char errors[64] = "";
    const size_t shown = report->doubling_count < 5 ? report->doubling_count : 5;
    for (size_t i = report->doubling_count - shown; i < report->doubling_count; i++) {
        const size_t length = strlen(errors);
        snprintf(errors + length, sizeof errors - length, "%s%.2g", length > 0 ? ", " : "",
                 report->doublings[i].error);
    }
    explain(reference, ROW_INTEGRAL, true, "%zu samples, %.3g mm apart; estimated error by doublings: %s",
            report->sample_count, report->spacing_mm, errors);
    const struct render_casters *const casters = &reference->casters;
    explain(reference, ROW_VISIBILITY, true,
            "%zu of %zu lights shine; objects shade themselves and others; %zu let light through",
            reference->lit_count, reference->scene->light_count, casters->count - casters->blocker_count);
}

/* Double the points until the error is small enough in some of the pixels. */
static bool converge(struct reference *reference, dipole_status *status)
{
    const size_t limit = reference->options->sample_limit > 0 ? reference->options->sample_limit
                                                              : RENDER_REFERENCE_SAMPLE_LIMIT;
    struct render_sum_pass pass = { .point_count = FIRST_POINTS, .step_px = reference->step_px };
    reference->work_shown = 100 * work_of(reference, FIRST_POINTS, 1);
    for (;;) {
        reference->point_count = pass.point_count;
        if (!sum_points(reference, &pass, status))
            return false;
        add_doubling(reference);
        if (is_converged(reference) || 4 * pass.point_count > limit ||
            reference->report.doubling_count == RENDER_DOUBLING_LIMIT)
            return true;
        pass.point_count *= 2;
    }
}

static bool integrate(struct reference *reference, dipole_status *status)
{
    const size_t count = pixel_count(reference);
    for (int half = 0; half < 2; half++)
        reference->halves[half] = calloc(count, 3 * sizeof *reference->halves[half]);
    reference->last = calloc(count, 3 * sizeof *reference->last);
    if (!reference->halves[0] || !reference->halves[1] || !reference->last)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to sum a picture of %dx%d",
                           reference->view.width_px, reference->view.height_px);
    reference->step_px = (int)fmax(sqrt((double)count / PROBED_PIXELS), 1);
    if (!render_surface_create(reference->scene, &reference->surface, status) ||
        !render_sum_create(
            &reference->view, reference->surface, reference->media,
            &(struct render_sum_sky){ reference->environment, reference->options->ambient_visibility },
            reference->options->thread_count, &reference->sum, status) ||
        !converge(reference, status))
        return false;
    const double *sum = reference->last;
    if (reference->step_px > 1) {
        struct render_sum_pass pass = { .point_count = reference->point_count,
                                        .is_joined = true,
                                        .step_px = 1 };
        if (!sum_points(reference, &pass, status))
            return false;
        sum = reference->halves[0];
    }
    if (!is_converged(reference))
        note_shortfall(reference);
    explain_integral(reference);
    for (size_t i = 0; i < count; i++) {
        for (size_t c = 0; c < 3; c++)
            reference->image->pixels[4 * i + c] = (float)sum[3 * i + c];
    }
    return true;
}

/* ---- the picture -------------------------------------------------------------------------------- */

/* Why there is nothing to sum; NULL when there is. */
static const char *why_no_integral(const struct reference *reference)
{
    if (reference->lit_count == 0 && !reference->environment)
        return "no light shines";
    if (!reference->media->has_scattering)
        return "no channel scatters";
    return is_anything_seen(reference) ? NULL : "no object is in the picture";
}

static void mirror(struct reference *reference)
{
    if (!is_glossy(reference->scene)) {
        explain(reference, ROW_SPECULAR, false, "no object is glossy");
        return;
    }
    if (reference->lit_count == 0) {
        explain(reference, ROW_SPECULAR, false, "no light shines");
        return;
    }
    const double start_ms = now_ms();
    lut_parallel_for(reference->view.height_px, reference->options->thread_count, add_specular_row,
                     reference);
    reference->report.effects[ROW_SPECULAR].time_ms = now_ms() - start_ms;
    explain(reference, ROW_SPECULAR, true, "an object is glossy");
}

static void tone_map(struct reference *reference)
{
    if (!reference->options->is_tone_mapped) {
        explain(reference, ROW_TONE_MAP, false, "linear radiance is asked for");
        return;
    }
    const double start_ms = now_ms();
    for (size_t i = 0; i < pixel_count(reference); i++)
        render_tone_map(reference->scene, reference->image->pixels + 4 * i);
    reference->report.effects[ROW_TONE_MAP].time_ms = now_ms() - start_ms;
    explain(reference, ROW_TONE_MAP, true, "the picture is for a screen, exposure %+g EV",
            reference->scene->exposure_ev);
}

static bool draw(struct reference *reference, dipole_status *status)
{
    explain_environment(reference);
    if (!see(reference, status))
        return false;
    const char *const why_not = why_no_integral(reference);
    if (why_not) {
        explain(reference, ROW_INTEGRAL, false, "%s", why_not);
        explain(reference, ROW_VISIBILITY, false, "%s", why_not);
    } else if (!integrate(reference, status)) {
        return false;
    }
    mirror(reference);
    tone_map(reference);
    show(reference, "surface integral", 1);
    return true;
}

static void set_attributes(const struct reference *reference)
{
    struct io_image *const image = reference->image;
    io_image_set_text(image, "dipole:kind", "picture");
    io_image_set_text(image, "dipole:version", dipole_version());
    io_image_set_text(image, "dipole:technique", render_technique_names[RENDER_TECHNIQUE_REFERENCE]);
    char names[512];
    io_image_set_text(image, "dipole:material",
                      render_media_list_names(reference->media, names, sizeof names));
    if (reference->media->count == 1)
        io_image_set_text(image, "dipole:model",
                          io_model_names[reference->media->media[0].material->model]);
    if (reference->options->is_tone_mapped)
        io_image_set_number(image, "dipole:linear_limit", RENDER_TONE_KNEE);
    io_image_set_number(image, "dipole:epsilon", reference->report.epsilon);
    io_image_set_number(image, "dipole:error_estimated", reference->report.error_predicted);
    io_image_set_number(image, "dipole:sample_count", (double)reference->report.sample_count);
}

static bool read_media(struct reference *reference, dipole_status *status)
{
    const struct io_scene *const scene = reference->scene;
    if (!render_media_create(scene, &reference->media, status))
        return false;
    reference->pixel_media = calloc(scene->object_count, sizeof *reference->pixel_media);
    if (!reference->pixel_media)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the media of %zu objects",
                           scene->object_count);
    reference->path_mm = INFINITY;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct render_medium *const medium = &reference->media->media[reference->media->of_object[i]];
        const double path_mm = render_medium_shortest_path_mm(medium);
        reference->path_mm = fmin(reference->path_mm, path_mm);
        reference->pixel_media[i] = (struct render_pixel_medium){
            .eta = medium->eta,
            .exit_scale_per_sr = 1 / (PI * dipole_fdt_outside(medium->eta)),
            .group_mm = GROUP_SHARE * path_mm,
        };
    }
    return true;
}

/* Check the scene and take from it what is asked again and again. */
static bool begin(struct reference *reference, dipole_status *status)
{
    const struct io_scene *const scene = reference->scene;
    if (!render_plan_check_request(scene, reference->report.epsilon, status) ||
        !read_media(reference, status) ||
        !render_casters_init(scene, reference->media, reference->report.epsilon, &reference->casters,
                             status) ||
        !render_tracer_create_with(scene, &reference->casters, &reference->tracer, status) ||
        !render_plan_check_rays(reference->options->ambient_visibility, status) ||
        (scene->has_environment &&
         !render_environment_read(&scene->environment, &reference->environment, status)))
        return false;
    if (reference->environment && !render_environment_shines(reference->environment)) {
        render_environment_destroy(reference->environment);
        reference->environment = NULL;
    }
    for (size_t i = 0; i < scene->light_count; i++)
        reference->lit_count += render_light_shines(&scene->lights[i]);
    const struct render_ball ball = render_ball_of_scene(scene);
    reference->view = (struct render_pixel_view){
        .scene = scene,
        .tracer = reference->tracer,
        .light_place_count = reference->options->light_place_count > 0
                                 ? reference->options->light_place_count
                                 : RENDER_LIGHT_PLACES,
        .media = reference->pixel_media,
        .width_px = scene->camera.width_px,
        .height_px = scene->camera.height_px,
    };
    render_projection_of_camera(&scene->camera, &ball, &reference->view.camera);
    return true;
}

static void destroy(struct reference *reference)
{
    render_sum_destroy(reference->sum);
    render_surface_destroy(reference->surface);
    render_tracer_destroy(reference->tracer);
    render_casters_end(&reference->casters);
    render_media_destroy(reference->media);
    render_environment_destroy(reference->environment);
    free(reference->pixel_media);
    free(reference->halves[0]);
    free(reference->halves[1]);
    free(reference->last);
    free(reference);
}

bool render_reference_draw(const struct io_scene *scene, const struct render_options *options,
                           struct io_image **image_out, struct render_report *report_out,
                           dipole_status *status)
{
    const double start_ms = now_ms(),
                 epsilon = options->epsilon > 0 ? options->epsilon : RENDER_EPSILON_DEFAULT;
    *image_out = NULL;
    struct reference *const reference = calloc(1, sizeof *reference);
    if (!reference)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a reference");
    reference->scene = scene;
    reference->options = options;
    reference->wanted_error = RENDER_REFERENCE_SHARE * epsilon;
    reference->report = (struct render_report){ .technique = RENDER_TECHNIQUE_REFERENCE,
                                                .predicted_ms = (double)NAN,
                                                .epsilon = epsilon,
                                                .effect_count = ROW_COUNT };
    for (int row = 0; row < ROW_COUNT; row++)
        reference->report.effects[row] =
            (struct render_effect_report){ .name = row_names[row], .predicted_ms = (double)NAN };
    show(reference, "surface integral", 0);
    bool done = begin(reference, status);
    reference->report.effects[ROW_SURFACE].time_ms = now_ms() - start_ms;
    done = done && draw(reference, status);
    if (done) {
        set_attributes(reference);
        *image_out = reference->image;
        reference->report.total_ms = now_ms() - start_ms;
        if (report_out)
            *report_out = reference->report;
    } else {
        io_image_destroy(reference->image);
    }
    destroy(reference);
    return done;
}
