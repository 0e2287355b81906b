#include "accuracy/calibrate.h"

#include "accuracy/statistics.h"
#include "io/file.h"
#include "renderer/renderer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REPEATS = 3, PICTURE_LIMIT = 64, EFFECT_SLOTS = RENDER_EFFECT_LIMIT + 1 };

/* ---- what is drawn ------------------------------------------------------------------------------ */

static const struct {
    const char *scene;
    int frame;
} scenes[] = { { "knot.json", 0 },
               { "environment.json", 0 },
               { "glass.json", 0 },
               { "shadows.json", 0 },
               { "twist.json", 10 } };
enum { SCENE_COUNT = sizeof scenes / sizeof *scenes };

static const int sizes_px[][2] = { { 160, 120 }, { 400, 300 } };
enum { SIZE_COUNT = sizeof sizes_px / sizeof *sizes_px };

static const struct render_options drawings[] = {
    { .technique = RENDER_TECHNIQUE_GATHER, .epsilon = 0.1, .gather = RENDER_GATHER_C },
    { .technique = RENDER_TECHNIQUE_GATHER, .epsilon = 0.003, .gather = RENDER_GATHER_C },
    { .technique = RENDER_TECHNIQUE_GATHER, .epsilon = 0.05, .gather = RENDER_GATHER_GL },
    { .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.1 },
    { .technique = RENDER_TECHNIQUE_TSM, .epsilon = 0.15 },
};
enum { DRAWING_COUNT = sizeof drawings / sizeof *drawings };
_Static_assert(SCENE_COUNT *SIZE_COUNT *DRAWING_COUNT <= PICTURE_LIMIT, "pictures");
_Static_assert((int)PICTURE_LIMIT <= (int)ACCURACY_LINE_POINTS, "points");

/* ---- what was measured -------------------------------------------------------------------------- */

/* Of a picture: its effects, then what it takes beside them. Predicted without start; NAN: did not run. */
struct picture {
    int scene;
    double predicted_ms[EFFECT_SLOTS], measured_ms[EFFECT_SLOTS], first_ms[EFFECT_SLOTS];
};

struct measuring {
    struct picture pictures[PICTURE_LIMIT];
    size_t picture_count;
    char names[EFFECT_SLOTS][32];
    size_t effect_count; /* the last of names follows them */
};

static void read_times(const struct render_report *report, double times_ms[EFFECT_SLOTS])
{
    double sum_ms = 0;
    for (size_t e = 0; e < report->effect_count; e++) {
        times_ms[e] = report->effects[e].time_ms;
        sum_ms += times_ms[e];
    }
    times_ms[report->effect_count] = fmax(report->total_ms - sum_ms, 0);
}

static bool draw(struct renderer *renderer, const struct render_options *drawing,
                 struct render_report *report, dipole_status *status)
{
    struct io_image *image;
    const bool done = render_draw(renderer, drawing, &image, report, status);
    io_image_destroy(image);
    return done;
}

/* A picture of its own renderer, so that the first is one, and some more. */
static bool measure(struct measuring *measuring, int index, const struct io_scene *scene,
                    const struct render_options *drawing, dipole_status *status)
{
    struct picture *const picture = &measuring->pictures[measuring->picture_count++];
    picture->scene = index;
    struct renderer *renderer = NULL;
    struct render_report first, report;
    double times_ms[REPEATS][EFFECT_SLOTS];
    bool done = render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, status);
    if (done) {
        renderer->is_calibrated = false;
        done = draw(renderer, drawing, &first, status);
    }
    if (done)
        read_times(&first, picture->first_ms);
    for (int i = 0; i < REPEATS && done; i++) {
        done = draw(renderer, drawing, &report, status);
        if (done)
            read_times(&report, times_ms[i]);
    }
    render_destroy(renderer);
    if (!done)
        return false;
    measuring->effect_count = report.effect_count;
    double sum_ms = 0;
    for (size_t e = 0; e < report.effect_count; e++) {
        snprintf(measuring->names[e], sizeof measuring->names[e], "%s", report.effects[e].name);
        picture->predicted_ms[e] = report.effects[e].is_active ? report.effects[e].predicted_ms : NAN;
        sum_ms += report.effects[e].predicted_ms;
    }
    picture->predicted_ms[report.effect_count] = report.predicted_ms - sum_ms;
    snprintf(measuring->names[report.effect_count], sizeof *measuring->names, RENDER_BESIDE_EFFECTS);
    for (size_t e = 0; e <= report.effect_count; e++) {
        double values[REPEATS];
        for (int i = 0; i < REPEATS; i++)
            values[i] = times_ms[i][e];
        picture->measured_ms[e] = accuracy_median(values, REPEATS);
    }
    for (size_t e = 0; e < report.effect_count; e++) {
        if (!render_effects[e]->is_kept || !first.effects[e].is_active)
            continue;
        picture->predicted_ms[e] = first.effects[e].predicted_ms; /* later pictures do without it */
        picture->measured_ms[e] = picture->first_ms[e];
    }
    return true;
}

static bool measure_scene(struct measuring *measuring, int index, const struct render_progress *progress,
                          dipole_status *status)
{
    char relative[64], path[4096];
    snprintf(relative, sizeof relative, "scenes/%s", scenes[index].scene);
    if (!io_data_path(relative, path, sizeof path, status))
        return false;
    bool done = true;
    for (int s = 0; s < SIZE_COUNT && done; s++) {
        struct io_scene *scene = NULL;
        const struct io_scene_options reading = { .width_px = sizes_px[s][0], .height_px = sizes_px[s][1] };
        done = io_scene_read(path, &reading, &scene, status);
        if (done)
            io_scene_set_frame(scene, scenes[index].frame);
        for (int d = 0; d < DRAWING_COUNT && done; d++) {
            const double step = (index * SIZE_COUNT + s) * DRAWING_COUNT + d;
            if (progress->show)
                progress->show(progress->context, scenes[index].scene,
                               step / (SCENE_COUNT * SIZE_COUNT * DRAWING_COUNT));
            /* shadow maps see no light from around: there would be nothing to draw */
            const bool is_dark = scene->light_count == 0 && drawings[d].technique == RENDER_TECHNIQUE_TSM;
            done = is_dark || measure(measuring, index, scene, &drawings[d], status);
        }
        io_scene_destroy(scene);
    }
    return done;
}

/* ---- what it says ------------------------------------------------------------------------------- */

enum { NO_SCENE = -1 };

static bool is_told(const struct picture *picture, size_t e)
{
    return picture->predicted_ms[e] > 0 && picture->measured_ms[e] > ACCURACY_TOLD_MS;
}

/* Of all scenes but one, if others have it. */
static struct accuracy_line fit_times(const struct measuring *measuring, size_t e, int left_out)
{
    double predicted_ms[PICTURE_LIMIT], measured_ms[PICTURE_LIMIT];
    size_t count = 0;
    for (size_t i = 0; i < measuring->picture_count; i++) {
        const struct picture *const picture = &measuring->pictures[i];
        if (picture->scene == left_out || !is_told(picture, e))
            continue;
        predicted_ms[count] = picture->predicted_ms[e];
        measured_ms[count++] = picture->measured_ms[e];
    }
    if (count == 0 && left_out != NO_SCENE)
        return fit_times(measuring, e, NO_SCENE);
    return accuracy_fit_line(predicted_ms, measured_ms, count);
}

static double predict_ms(struct accuracy_line line, double predicted_ms)
{
    return line.intercept + line.slope * predicted_ms;
}

static void summarize(const struct measuring *measuring, size_t e, struct accuracy_effect_times *out)
{
    const struct accuracy_line line = fit_times(measuring, e, NO_SCENE);
    double starts_ms[PICTURE_LIMIT], errors[PICTURE_LIMIT];
    size_t count = 0, told_count = 0;
    snprintf(out->name, sizeof out->name, "%s", measuring->names[e]);
    for (size_t i = 0; i < measuring->picture_count; i++) {
        const struct picture *const picture = &measuring->pictures[i];
        if (isnan(picture->predicted_ms[e]))
            continue;
        starts_ms[count++] = fmax(picture->first_ms[e] - picture->measured_ms[e], 0);
        if (is_told(picture, e))
            errors[told_count++] =
                fabs(predict_ms(line, picture->predicted_ms[e]) / picture->measured_ms[e] - 1);
    }
    out->count = count;
    out->fixed_ms = line.intercept;
    out->scale = line.slope;
    out->start_ms = accuracy_median(starts_ms, count);
    out->median_error = accuracy_median(errors, told_count);
}

/* Errors of whole pictures, by calibrations that have seen their scenes or have not. */
static void measure_errors(const struct measuring *measuring, bool is_seen, double errors[PICTURE_LIMIT])
{
    for (size_t i = 0; i < measuring->picture_count; i++) {
        const struct picture *const picture = &measuring->pictures[i];
        double predicted_ms = 0, measured_ms = 0;
        for (size_t e = 0; e <= measuring->effect_count; e++) {
            if (isnan(picture->predicted_ms[e]))
                continue;
            const struct accuracy_line line = fit_times(measuring, e, is_seen ? NO_SCENE : picture->scene);
            predicted_ms += predict_ms(line, picture->predicted_ms[e]);
            measured_ms += picture->measured_ms[e];
        }
        errors[i] = fabs(predicted_ms / measured_ms - 1);
    }
}

static void summarize_pictures(const struct measuring *measuring, struct accuracy_calibration *calibration)
{
    double errors[PICTURE_LIMIT];
    measure_errors(measuring, false, errors);
    calibration->unseen_error = accuracy_median(errors, measuring->picture_count);
    measure_errors(measuring, true, errors);
    calibration->picture_count = measuring->picture_count;
    calibration->median_error = accuracy_median(errors, measuring->picture_count); /* sorts them */
    calibration->largest_error = errors[measuring->picture_count - 1];
}

bool accuracy_calibrate(const struct render_progress *progress,
                        struct accuracy_calibration *calibration_out, dipole_status *status)
{
    struct measuring *const measuring = calloc(1, sizeof *measuring);
    struct io_scene *scene = NULL;
    struct renderer *renderer = NULL;
    char path[4096];
    *calibration_out = (struct accuracy_calibration){ .effect_count = 0 };
    if (!measuring)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a calibration");
    bool done = io_data_path("scenes/knot.json", path, sizeof path, status) &&
                io_scene_read(path, NULL, &scene, status) &&
                render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, status);
    if (done)
        calibration_out->machine = renderer->machine;
    render_destroy(renderer);
    io_scene_destroy(scene);
    for (int i = 0; i < SCENE_COUNT && done; i++)
        done = measure_scene(measuring, i, progress, status);
    for (size_t e = 0; e <= measuring->effect_count && done; e++) {
        struct accuracy_effect_times *const effect =
            &calibration_out->effects[calibration_out->effect_count];
        summarize(measuring, e, effect);
        calibration_out->effect_count += effect->count > 0;
    }
    if (done)
        summarize_pictures(measuring, calibration_out);
    free(measuring);
    return done;
}

bool accuracy_calibration_keep(const struct accuracy_calibration *calibration, char *path_out, size_t size,
                               dipole_status *status)
{
    struct render_calibration kept = { .effect_count = calibration->effect_count };
    for (size_t i = 0; i < calibration->effect_count; i++) {
        const struct accuracy_effect_times *const effect = &calibration->effects[i];
        snprintf(kept.effects[i].name, sizeof kept.effects[i].name, "%s", effect->name);
        kept.effects[i].fixed_ms = effect->fixed_ms;
        kept.effects[i].scale = effect->scale;
        kept.effects[i].start_ms = effect->start_ms;
    }
    return render_calibration_path(&calibration->machine, path_out, size, status) &&
           render_calibration_write(path_out, &calibration->machine, &kept, status);
}
