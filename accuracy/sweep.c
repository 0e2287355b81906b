#include "accuracy/sweep.h"

#include "accuracy/statistics.h"
#include "io/hash.h"
#include "renderer/reference.h"
#include "renderer/renderer.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The reference errs by a tenth of this. */
#define REFERENCE_EPSILON 0.003

/* For each channel of a material, of the physics ladder. */
enum { LADDER_PHOTONS = 1000000 };

/* Points take turns, so that what disturbs one disturbs all. In its turn a point's picture is drawn so many
 * times after one that does not count, which makes the tables that the point before has replaced. */
enum { TURN_PICTURES = 2 };

/* Pictures that take so long are hardly disturbed, and are drawn fewer times. */
#define SLOW_MS 3000.0
enum { SLOW_REPEATS = 2 };

/* A fit takes a second. */
enum { FIT_REPEATS = 3 };

/* ---- the list of points ------------------------------------------------------------------------- */

/* A program that was built anew may measure otherwise, whatever its version. */
static void hash_program(uint64_t *hash)
{
    struct stat program;
    if (stat("/proc/self/exe", &program) != 0)
        return;
    io_hash_bytes(hash, &program.st_size, sizeof program.st_size);
    io_hash_bytes(hash, &program.st_mtime, sizeof program.st_mtime);
}

/* Of all that a picture depends on, but the meshes' insides. */
static void make_key(struct accuracy_sweep *sweep)
{
    const struct io_scene *const scene = sweep->subject->scene;
    uint64_t hash = IO_HASH_START;
    io_hash_text(&hash, dipole_version());
    hash_program(&hash);
    io_hash_text(&hash, scene->path);
    io_hash_bytes(&hash, &scene->camera.width_px, sizeof scene->camera.width_px);
    io_hash_bytes(&hash, &scene->camera.height_px, sizeof scene->camera.height_px);
    for (size_t m = 0; m < sweep->subject->media->count; m++)
        io_hash_bytes(&hash, &sweep->subject->media->media[m].hash,
                      sizeof sweep->subject->media->media[m].hash);
    for (size_t i = 0; i < scene->object_count; i++)
        io_hash_bytes(&hash, &scene->objects[i].mesh->triangle_count, sizeof(size_t));
    snprintf(sweep->key, sizeof sweep->key, "%016" PRIx64, hash);
}

static bool add_points(struct accuracy_sweep *sweep, const struct accuracy_knob *knob, bool is_quick,
                       dipole_status *status)
{
    for (size_t i = 0; i < knob->value_count; i++) {
        const bool is_skipped = is_quick && i % 2 == 1;
        struct accuracy_point *const point = &sweep->points[sweep->point_count];
        if (is_skipped || sweep->point_count == ACCURACY_POINT_LIMIT)
            continue;
        *point = (struct accuracy_point){ .knob = knob };
        if (knob->format)
            snprintf(point->setting.label, sizeof point->setting.label, knob->format, knob->values[i]);
        if (!knob->set(knob, sweep->subject, knob->values[i], &point->setting, status))
            return false;
        sweep->point_count += point->setting.label[0] != '\0';
    }
    return true;
}

bool accuracy_sweep_init(struct accuracy_subject *subject, bool is_quick, int repeat_count,
                         struct accuracy_sweep *sweep, dipole_status *status)
{
    *sweep = (struct accuracy_sweep){ .subject = subject, .repeat_count = repeat_count };
    sweep->points = calloc(ACCURACY_POINT_LIMIT, sizeof *sweep->points);
    if (!sweep->points)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d points",
                           ACCURACY_POINT_LIMIT);
    make_key(sweep);
    for (const struct accuracy_knob *knob = accuracy_knobs; knob->name; knob++) {
        const char *reason = knob->why_not ? knob->why_not(subject) : NULL;
        if (!reason && is_quick && !knob->is_quick)
            reason = "left out of a quick look";
        if (reason)
            sweep->omissions[sweep->omission_count++] = (struct accuracy_omission){ knob, reason };
        else if (!add_points(sweep, knob, is_quick, status))
            return false;
    }
    return true;
}

void accuracy_sweep_end(struct accuracy_sweep *sweep)
{
    for (size_t i = 0; sweep->points && i < sweep->point_count; i++)
        io_image_destroy(sweep->points[i].picture);
    io_image_destroy(sweep->reference);
    accuracy_ladder_end(&sweep->ladder);
    free(sweep->points);
}

/* ---- drawing ------------------------------------------------------------------------------------ */

static void summarize(struct accuracy_point *point)
{
    point->time_ms = accuracy_spread_of(point->times_ms, point->time_count);
}

static bool draw(struct accuracy_sweep *sweep, struct accuracy_point *point, double *time_ms,
                 struct io_image **image_out, dipole_status *status)
{
    struct render_report report;
    *image_out = NULL;
    struct renderer *const own = point->setting.renderer;
    if (!render_draw(own ? own : sweep->subject->renderer, &point->setting.drawing, image_out, &report,
                     status))
        return false;
    point->effect_count = report.effect_count;
    for (size_t e = 0; e < report.effect_count; e++)
        point->effects[e] =
            (struct accuracy_effect_time){ report.effects[e].is_active, report.effects[e].predicted_ms,
                                           report.effects[e].time_ms };
    *time_ms = report.total_ms;
    point->predicted_ms = report.predicted_ms;
    point->error_predicted = isfinite(report.error_predicted) ? report.error_predicted : NAN;
    if (report.technique == RENDER_TECHNIQUE_TSM || report.technique == RENDER_TECHNIQUE_LAMBERT)
        point->error_predicted = NAN;
    return true;
}

/* The first picture of a point compiles, bakes and warms up: its time does not count. */
static bool measure_error(struct accuracy_sweep *sweep, struct accuracy_point *point, dipole_status *status)
{
    double time_ms;
    dipole_status why = { .code = DIPOLE_OK };
    if (!draw(sweep, point, &time_ms, &point->picture, &why)) {
        /* what asks for too much is refused, which is no failure of others */
        if (why.code == DIPOLE_NOT_CONVERGED || why.code == DIPOLE_BAD_VALUE ||
            why.code == DIPOLE_NOT_SUPPORTED) {
            snprintf(point->refusal, sizeof point->refusal, "%s", why.message);
            return true;
        }
        if (status)
            *status = why;
        return false;
    }
    if (!accuracy_error_measure(sweep->reference, point->picture, sweep->subject->kinds, &point->error,
                                status))
        return false;
    point->is_drawn = true;
    return true;
}

static bool measure_time(struct accuracy_sweep *sweep, struct accuracy_point *point, double *time_ms,
                         dipole_status *status)
{
    struct io_image *image;
    const bool done = draw(sweep, point, time_ms, &image, status);
    io_image_destroy(image);
    return done;
}

/* Read the reference of an earlier run of the same. */
static bool has_reference(struct accuracy_sweep *sweep, const char *path)
{
    if (!io_exr_read(path, &sweep->reference, NULL))
        return false;
    const struct io_attribute *const key = io_image_find(sweep->reference, "dipole:accuracy_key");
    const struct io_attribute *const error = io_image_find(sweep->reference, "dipole:error_estimated");
    if (key && key->text && strcmp(key->text, sweep->key) == 0 && sweep->reference->channel_count == 4) {
        sweep->reference_error = error ? error->numbers[0] : NAN;
        return true;
    }
    io_image_destroy(sweep->reference);
    sweep->reference = NULL;
    return false;
}

static bool draw_reference(struct accuracy_sweep *sweep, const char *path,
                           const struct render_progress *progress, dipole_status *status)
{
    if (has_reference(sweep, path))
        return true;
    const struct render_options drawing = { .technique = RENDER_TECHNIQUE_REFERENCE,
                                            .epsilon = REFERENCE_EPSILON,
                                            .progress = *progress };
    struct render_report report;
    if (!render_reference_draw(sweep->subject->scene, &drawing, &sweep->reference, &report, status))
        return false;
    sweep->reference_error = report.error_predicted;
    io_image_set_text(sweep->reference, "dipole:accuracy_key", sweep->key);
    return io_exr_write(path, sweep->reference, false, status);
}

static bool is_slow(const struct accuracy_point *point)
{
    return point->time_count > 0 && point->time_ms.median > SLOW_MS;
}

/* Whether its picture was drawn so many times, or as often as it will be. */
static bool is_timed(const struct accuracy_sweep *sweep, const struct accuracy_point *point, int count)
{
    const int most =
        is_slow(point) && sweep->repeat_count > SLOW_REPEATS ? SLOW_REPEATS : sweep->repeat_count;
    return point->time_count >= (size_t)(count < most ? count : most);
}

/* Until its picture was drawn so many times, or *stop. */
static bool take_turn(struct accuracy_sweep *sweep, struct accuracy_point *point, int count,
                      const volatile sig_atomic_t *stop, dipole_status *status)
{
    double time_ms = 0;
    bool done = true;
    if (!point->picture)
        done = measure_error(sweep, point, status);
    else if (!is_slow(point))
        done = measure_time(sweep, point, &time_ms, status);
    while (done && point->is_drawn && !*stop && !is_timed(sweep, point, count)) {
        done = measure_time(sweep, point, &time_ms, status);
        if (done)
            point->times_ms[point->time_count++] = time_ms;
        summarize(point);
    }
    return done;
}

bool accuracy_sweep_is_complete(const struct accuracy_sweep *sweep)
{
    for (size_t i = 0; i < sweep->point_count; i++) {
        if (sweep->points[i].refusal[0])
            continue;
        if (!sweep->points[i].is_drawn || !is_timed(sweep, &sweep->points[i], sweep->repeat_count))
            return false;
    }
    return true;
}

bool accuracy_sweep_run(struct accuracy_sweep *sweep, const char *folder, const volatile sig_atomic_t *stop,
                        const struct render_progress *progress, dipole_status *status)
{
    char path[4096], reference_path[4096];
    snprintf(path, sizeof path, "%s/accuracy.json", folder);
    snprintf(reference_path, sizeof reference_path, "%s/reference.exr", folder);

    const int turn_count = (sweep->repeat_count + TURN_PICTURES - 1) / TURN_PICTURES;
    const size_t step_count = sweep->point_count * (size_t)turn_count;
    size_t step = 0;
    if (!accuracy_results_resume(sweep, path, status) ||
        !draw_reference(sweep, reference_path, progress, status))
        return false;
    for (size_t i = 0; i < sweep->point_count; i++)
        summarize(&sweep->points[i]);
    for (int turn = 0; turn < turn_count; turn++) {
        for (size_t i = 0; i < sweep->point_count; i++, step++) {
            struct accuracy_point *const point = &sweep->points[i];
            const int count = (turn + 1) * TURN_PICTURES;
            if (*stop)
                return true;
            if (progress->show)
                progress->show(progress->context, point->knob->name, (double)step / (double)step_count);
            if (point->refusal[0] || (point->picture && is_timed(sweep, point, count)))
                continue;
            if (!take_turn(sweep, point, count, stop, status) ||
                !accuracy_results_write(sweep, path, status))
                return false;
        }
    }
    return true;
}

bool accuracy_sweep_climb(struct accuracy_sweep *sweep, const volatile sig_atomic_t *stop,
                          const char *folder, const struct render_progress *progress, dipole_status *status)
{
    const struct render_media *const media = sweep->subject->media;
    struct io_material *const materials = calloc(media->count + 1, sizeof *materials);
    char path[4096];
    size_t count = 0;
    if (!materials)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu materials", media->count);
    for (size_t m = 0; m < media->count; m++) {
        if (media->media[m].has_scattering)
            materials[count++] = *media->media[m].material;
    }
    const struct accuracy_ladder_options options = { .materials = materials,
                                                     .material_count = count,
                                                     .truth_photon_count = LADDER_PHOTONS,
                                                     .is_quick = true,
                                                     .seed = 1,
                                                     .stop = stop,
                                                     .show = progress->show,
                                                     .context = progress->context };
    snprintf(path, sizeof path, "%s/accuracy.json", folder);
    const bool done = count == 0 || (accuracy_ladder_init(&options, &sweep->ladder, status) &&
                                     accuracy_results_write(sweep, path, status));
    free(materials);
    return done;
}

bool accuracy_sweep_fit(struct accuracy_sweep *sweep, const volatile sig_atomic_t *stop, const char *folder,
                        const struct render_progress *progress, dipole_status *status)
{
    char path[4096], reference_path[4096];
    snprintf(path, sizeof path, "%s/accuracy.json", folder);
    snprintf(reference_path, sizeof reference_path, "%s/reference.exr", folder);
    const struct accuracy_fits_options options = { .scene = sweep->subject->scene,
                                                   .media = sweep->subject->media,
                                                   .picture_path = reference_path,
                                                   .repeat_count = sweep->repeat_count < FIT_REPEATS
                                                                       ? sweep->repeat_count
                                                                       : FIT_REPEATS,
                                                   .stop = stop,
                                                   .show = progress->show,
                                                   .context = progress->context };
    return accuracy_fits_measure(&options, &sweep->fits, status) &&
           accuracy_results_write(sweep, path, status);
}

/* ---- what it shows ------------------------------------------------------------------------------ */

bool accuracy_point_is_best(const struct accuracy_sweep *sweep, size_t index, bool is_of_all)
{
    const struct accuracy_point *const point = &sweep->points[index];
    if (!point->is_drawn || point->time_count == 0)
        return false;
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const other = &sweep->points[i];
        const bool is_alike =
            other->time_ms.median == point->time_ms.median && other->error.rmse == point->error.rmse;
        if (i != index && other->is_drawn && other->time_count > 0 &&
            (is_of_all || other->knob == point->knob) && other->time_ms.median <= point->time_ms.median &&
            other->error.rmse <= point->error.rmse && !(is_alike && i > index))
            return false;
    }
    return true;
}

double accuracy_halving_cost(const struct accuracy_sweep *sweep, const struct accuracy_knob *knob)
{
    double errors[ACCURACY_POINT_LIMIT], times_ms[ACCURACY_POINT_LIMIT];
    size_t count = 0;
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        if (point->knob != knob || !accuracy_point_is_best(sweep, i, false))
            continue;
        errors[count] = point->error.rmse;
        times_ms[count++] = point->time_ms.median;
    }
    return accuracy_halving_of(errors, times_ms, count);
}
