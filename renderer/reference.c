#include "renderer/reference.h"

#include "lutgen/parallel.h"
#include "renderer/reference_sum.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI 3.14159265358979323846

enum {
    FIRST_CELLS = 1024,  /* of each half                                        */
    DOUBLINGS_LEAST = 3, /* sums that are compared before one can be trusted    */
    ROWS_AT_ONCE = 16,   /* between two reports of progress                     */
};

/* An estimate that falls to less than this in a doubling did so by luck. Measured falls are 0.3 to 0.5. */
#define FALL_LIMIT 0.25

/* Points of a pixel within so much of a mean free path share a sum. Radiosity is as smooth as the profile:
 * this errs by about (0.2)^2 / 8 of its curvature over a mean free path, where a pixel is as wide at all.
 */
#define GROUP_SHARE 0.2

enum row { ROW_SURFACE, ROW_VISIBILITY, ROW_INTEGRAL, ROW_SPECULAR, ROW_TONE_MAP, ROW_COUNT };
static const char *const row_names[ROW_COUNT] = { "surface", "visibility", "surface_integral", "specular",
                                                  "tone_map" };

struct reference {
    const struct io_scene *scene;
    const struct render_options *options;
    struct render_plan plan; /* of what the scene says; no passes */
    struct render_tracer *tracer;
    struct render_surface *surface;
    struct render_pixel_view view;
    struct render_sum *sum;
    struct io_image *image;
    double *halves[2], *last; /* radiance, three to a pixel: by each half; mean of the sums before */
    double wanted_error;
    size_t cell_count;  /* of each half */
    double shown_count; /* so many are expected to do, for progress */
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
    const int width_px = reference->plan.width_px;
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
    const int width_px = reference->plan.width_px;
    struct render_pixel pixel;
    for (int x = 0; x < width_px; x++) {
        float *const rgba = reference->image->pixels + 4 * ((size_t)y * (size_t)width_px + (size_t)x);
        double radiance[3] = { 0 };
        if (!(rgba[3] > 0))
            continue;
        render_pixel_trace(&reference->view, x, y, &pixel);
        for (int g = 0; g < pixel.group_count; g++) {
            for (int i = 0; i < pixel.groups[g].count; i++)
                render_pixel_add_specular(&reference->view, &pixel.groups[g].points[i], radiance);
        }
        for (int c = 0; c < 3; c++)
            rgba[c] += (float)(radiance[c] / RENDER_PIXEL_RAYS);
    }
}

static bool see(struct reference *reference, dipole_status *status)
{
    const double start_ms = now_ms();
    if (!io_image_create(reference->plan.width_px, reference->plan.height_px, 4, &reference->image, status))
        return false;
    lut_parallel_for(reference->plan.height_px, reference->options->thread_count, see_row, reference);
    reference->report.effects[ROW_SURFACE].time_ms += now_ms() - start_ms;
    explain(reference, ROW_SURFACE, true, "%zu object%s in the scene, %d rays to a pixel",
            reference->scene->object_count, reference->scene->object_count == 1 ? "" : "s",
            RENDER_PIXEL_RAYS);
    return true;
}

static bool is_anything_seen(const struct reference *reference)
{
    const size_t pixel_count = (size_t)reference->plan.width_px * (size_t)reference->plan.height_px;
    for (size_t i = 0; i < pixel_count; i++) {
        if (reference->image->pixels[4 * i + 3] > 0)
            return true;
    }
    return false;
}

/* ---- the integral ------------------------------------------------------------------------------- */

/* Sum over that many cells, in both halves. */
static void sum_cells(struct reference *reference, size_t cell_count)
{
    const int height_px = reference->plan.height_px;
    const size_t value_count = 3 * (size_t)reference->plan.width_px * (size_t)height_px;
    struct render_effect_report *const effects = reference->report.effects;
    for (size_t i = 0; i < value_count; i++) {
        reference->last[i] = 0.5 * (reference->halves[0][i] + reference->halves[1][i]);
        reference->halves[0][i] = reference->halves[1][i] = 0;
    }
    for (size_t first = 0; first < cell_count; first += RENDER_SUM_CHUNK) {
        const size_t rest = cell_count - first, chunk = rest < RENDER_SUM_CHUNK ? rest : RENDER_SUM_CHUNK;
        const double start_ms = now_ms();
        render_sum_take(reference->sum, cell_count, first, chunk);
        const double taken_ms = now_ms();
        for (int y = 0; y < height_px; y += ROWS_AT_ONCE) {
            const int rows = height_px - y < ROWS_AT_ONCE ? height_px - y : ROWS_AT_ONCE;
            render_sum_add_rows(reference->sum, y, rows, reference->halves);
            /* all sums before took as long as this one will */
            const double done = (double)(cell_count + first) + (double)chunk * (y + rows) / height_px;
            show(reference, "surface integral", fmin(done / (2 * reference->shown_count), 0.99));
        }
        effects[ROW_VISIBILITY].time_ms += taken_ms - start_ms;
        effects[ROW_INTEGRAL].time_ms += now_ms() - taken_ms;
    }
    reference->cell_count = cell_count;
}

/*
 * Largest over the channels of the relative RMSE over the picture. Two halves of independent error differ
 * by twice that of their mean. What errs alike in both, because a cell's light stands at one point, changes
 * with the size of cells: by as much as is left, if it falls by half in a doubling, and by more if it falls
 * faster.
 */
static double estimate_error(const struct reference *reference)
{
    const size_t value_count = 3 * (size_t)reference->plan.width_px * (size_t)reference->plan.height_px;
    double largest = 0;
    for (size_t c = 0; c < 3; c++) {
        double halves2 = 0, change2 = 0, value2 = 0;
        for (size_t i = c; i < value_count; i += 3) {
            const double a = reference->halves[0][i], b = reference->halves[1][i], mean = 0.5 * (a + b);
            halves2 += 0.25 * (a - b) * (a - b);
            if (reference->report.doubling_count > 0)
                change2 += (mean - reference->last[i]) * (mean - reference->last[i]);
            value2 += mean * mean;
        }
        if (value2 > 0)
            largest = fmax(largest, sqrt(fmax(halves2, change2) / value2));
    }
    return largest;
}

/* Shortest mean free path of the channels that scatter. */
static double shortest_path_mm(const struct render_plan *plan)
{
    double shortest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (plan->coefficients[c].alpha_prime > 0)
            shortest_mm = fmin(shortest_mm, plan->coefficients[c].mean_free_path_mm);
    }
    return shortest_mm;
}

static double spacing_mm(const struct reference *reference)
{
    return sqrt(render_surface_area_mm2(reference->surface) / (double)reference->cell_count);
}

static void add_doubling(struct reference *reference)
{
    struct render_report *const report = &reference->report;
    double error = estimate_error(reference);
    if (report->doubling_count > 0)
        error = fmax(error, FALL_LIMIT * report->doublings[report->doubling_count - 1].error);
    report->sample_count = 2 * reference->cell_count;
    report->error_predicted = error;
    report->spacing_mm = spacing_mm(reference);
    report->doublings[report->doubling_count++] =
        (struct render_doubling){ .sample_count = report->sample_count, .error = error };
    /* The error halves from here on; the spacing takes a factor of four in number. */
    const double spread = report->spacing_mm / shortest_path_mm(&reference->plan);
    const double more = fmax(fmax(error / reference->wanted_error, spread * spread), 1);
    reference->shown_count = (double)reference->cell_count * exp2(ceil(log2(more)));
}

static bool is_converged(const struct reference *reference)
{
    const struct render_report *const report = &reference->report;
    return report->doubling_count >= DOUBLINGS_LEAST &&
           report->error_predicted <= reference->wanted_error &&
           report->spacing_mm <= shortest_path_mm(&reference->plan);
}

static void note_shortfall(struct reference *reference)
{
    struct render_report *const report = &reference->report;
    snprintf(
        report->notes[report->note_count++], sizeof report->notes[0],
        "the reference stopped at %zu samples: error estimated %.2g, %.2g was wanted; samples are %.3g mm "
        "apart, the shortest mean free path is %.3g mm",
        report->sample_count, report->error_predicted, reference->wanted_error, report->spacing_mm,
        shortest_path_mm(&reference->plan));
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
    explain(reference, ROW_VISIBILITY, true, "%zu of %zu lights shine; objects shade themselves and others",
            reference->plan.lit_count, reference->scene->light_count);
}

static bool integrate(struct reference *reference, dipole_status *status)
{
    const struct render_plan *const plan = &reference->plan;
    const size_t pixel_count = (size_t)plan->width_px * (size_t)plan->height_px;
    const size_t limit = reference->options->sample_limit > 0 ? reference->options->sample_limit
                                                              : RENDER_REFERENCE_SAMPLE_LIMIT;
    for (int half = 0; half < 2; half++)
        reference->halves[half] = calloc(pixel_count, 3 * sizeof *reference->halves[half]);
    reference->last = calloc(pixel_count, 3 * sizeof *reference->last);
    if (!reference->halves[0] || !reference->halves[1] || !reference->last)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to sum a picture of %dx%d",
                           plan->width_px, plan->height_px);
    if (!render_surface_create(reference->scene, &reference->surface, status) ||
        !render_sum_create(&reference->view, reference->surface, reference->options->thread_count,
                           &reference->sum, status))
        return false;
    reference->shown_count = 100.0 * FIRST_CELLS;
    sum_cells(reference, FIRST_CELLS);
    add_doubling(reference);
    while (!is_converged(reference) && 4 * reference->cell_count <= limit &&
           reference->report.doubling_count < RENDER_DOUBLING_LIMIT) {
        sum_cells(reference, 2 * reference->cell_count);
        add_doubling(reference);
    }
    if (!is_converged(reference))
        note_shortfall(reference);
    explain_integral(reference);
    for (size_t i = 0; i < pixel_count; i++) {
        for (size_t c = 0; c < 3; c++) {
            const double sum = reference->halves[0][3 * i + c] + reference->halves[1][3 * i + c];
            reference->image->pixels[4 * i + c] = (float)(0.5 * sum);
        }
    }
    return true;
}

/* ---- the picture -------------------------------------------------------------------------------- */

/* Why there is nothing to sum; NULL when there is. */
static const char *why_no_integral(const struct reference *reference)
{
    if (reference->plan.lit_count == 0)
        return "no light shines";
    if (!reference->plan.has_scattering)
        return "no channel scatters";
    return is_anything_seen(reference) ? NULL : "no object is in the picture";
}

static void mirror(struct reference *reference)
{
    if (!reference->plan.has_specular) {
        explain(reference, ROW_SPECULAR, false, "no object is glossy");
        return;
    }
    if (reference->plan.lit_count == 0) {
        explain(reference, ROW_SPECULAR, false, "no light shines");
        return;
    }
    const double start_ms = now_ms();
    lut_parallel_for(reference->plan.height_px, reference->options->thread_count, add_specular_row,
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
    const size_t pixel_count = (size_t)reference->plan.width_px * (size_t)reference->plan.height_px;
    for (size_t i = 0; i < pixel_count; i++)
        render_tone_map(reference->scene, reference->image->pixels + 4 * i);
    reference->report.effects[ROW_TONE_MAP].time_ms = now_ms() - start_ms;
    explain(reference, ROW_TONE_MAP, true, "the picture is for a screen, exposure %+g EV",
            reference->scene->exposure_ev);
}

static bool draw(struct reference *reference, dipole_status *status)
{
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
    io_image_set_text(image, "dipole:material", reference->scene->objects[0].material.name);
    io_image_set_number(image, "dipole:epsilon", reference->plan.epsilon);
    io_image_set_number(image, "dipole:error_estimated", reference->report.error_predicted);
    io_image_set_number(image, "dipole:sample_count", (double)reference->report.sample_count);
}

bool render_reference_draw(const struct io_scene *scene, const struct render_options *options,
                           struct io_image **image_out, struct render_report *report_out,
                           dipole_status *status)
{
    const double start_ms = now_ms(),
                 epsilon = options->epsilon > 0 ? options->epsilon : RENDER_EPSILON_DEFAULT;
    const struct render_request request = { .scene = scene,
                                            .technique = RENDER_TECHNIQUE_REFERENCE,
                                            .epsilon = epsilon };
    *image_out = NULL;
    struct reference *const reference = calloc(1, sizeof *reference);
    if (!reference)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a reference");
    reference->scene = scene;
    reference->options = options;
    reference->wanted_error = RENDER_REFERENCE_SHARE * epsilon;
    reference->report = (struct render_report){ .technique = RENDER_TECHNIQUE_REFERENCE,
                                                .epsilon = epsilon,
                                                .effect_count = ROW_COUNT };
    for (int row = 0; row < ROW_COUNT; row++)
        reference->report.effects[row].name = row_names[row];
    show(reference, "surface integral", 0);
    bool done = render_plan_read_scene(&request, &reference->plan, status) &&
                render_tracer_create(scene, &reference->tracer, status);
    if (done) {
        reference->view = (struct render_pixel_view){
            .scene = scene,
            .plan = &reference->plan,
            .tracer = reference->tracer,
            .group_mm = GROUP_SHARE * shortest_path_mm(&reference->plan),
            .exit_scale_per_sr = 1 / (PI * dipole_fdt_outside(reference->plan.eta)),
        };
        reference->report.effects[ROW_SURFACE].time_ms = now_ms() - start_ms;
        done = draw(reference, status);
    }
    if (done) {
        set_attributes(reference);
        *image_out = reference->image;
        reference->report.total_ms = now_ms() - start_ms;
        if (report_out)
            *report_out = reference->report;
    } else {
        io_image_destroy(reference->image);
    }
    render_sum_destroy(reference->sum);
    render_surface_destroy(reference->surface);
    render_tracer_destroy(reference->tracer);
    free(reference->halves[0]);
    free(reference->halves[1]);
    free(reference->last);
    free(reference);
    return done;
}
