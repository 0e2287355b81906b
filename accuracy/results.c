#include "accuracy/sweep.h"

#include "io/file.h"
#include "io/json.h"
#include "renderer/plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* NULL: no memory. */
static json_t *point_to_json(const struct accuracy_sweep *sweep, size_t index)
{
    const struct accuracy_point *const point = &sweep->points[index];
    json_t *const times = json_array();
    for (size_t i = 0; i < point->time_count; i++)
        json_array_append_new(times, json_real(point->times_ms[i]));
    const double unknown = point->is_drawn ? 0 : NAN; /* timed in an earlier run, not drawn yet in this */
    json_t *const effects = json_array();
    for (size_t e = 0; e < point->effect_count; e++) {
        const struct accuracy_effect_time *const effect = &point->effects[e];
        if (effect->is_active)
            json_array_append_new(effects, json_pack("{s:s, s:o, s:f}", "name", render_effects[e]->name,
                                                     "predicted_ms", io_json_number(effect->predicted_ms),
                                                     "ms", effect->measured_ms));
    }
    return json_pack(
        "{s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:f, s:f, s:f, s:b, s:o}", "knob", point->knob->name,
        "setting", point->setting.label, "relative_rmse", io_json_number(point->error.rmse + unknown),
        "relative_rmse_with_edges", io_json_number(point->error.rmse_all + unknown), "weber_99",
        io_json_number(point->error.weber_99 + unknown), "max", io_json_number(point->error.max + unknown),
        "error_predicted", io_json_number(point->error_predicted), "predicted_ms",
        io_json_number(point->predicted_ms), "times_ms", times, "median_ms", point->time_ms.median,
        "low_ms", point->time_ms.low, "high_ms", point->time_ms.high, "is_best",
        accuracy_point_is_best(sweep, index, true), "effects", effects);
}

bool accuracy_results_write(const struct accuracy_sweep *sweep, const char *path, dipole_status *status)
{
    const struct io_camera *const camera = &sweep->subject->scene->camera;
    const struct render_machine *const machine = &sweep->subject->renderer->machine;
    json_t *const points = json_array(), *const omitted = json_array();
    for (size_t i = 0; i < sweep->point_count; i++) {
        if (sweep->points[i].is_drawn || sweep->points[i].time_count > 0)
            json_array_append_new(points, point_to_json(sweep, i));
    }
    for (size_t i = 0; i < sweep->omission_count; i++)
        json_array_append_new(omitted, json_pack("{s:s, s:s}", "knob", sweep->omissions[i].knob->name,
                                                 "reason", sweep->omissions[i].reason));
    json_t *const root = json_pack(
        "{s:s, s:s, s:s, s:[i, i], s:f, s:{s:s, s:i, s:s}, s:o, s:o}", "version", dipole_version(), "key",
        sweep->key, "scene", sweep->subject->scene->path, "size", camera->width_px, camera->height_px,
        "reference_error", sweep->reference_error, "machine", "cpu", machine->cpu, "cores",
        machine->core_count, "opengl", machine->driver, "points", points, "not_called_for", omitted);
    if (root && sweep->ladder.case_count > 0)
        json_object_set_new(root, "ladder", accuracy_ladder_to_json(&sweep->ladder));
    if (root && (sweep->fits.point_count > 0 || sweep->fits.refusal[0]))
        json_object_set_new(root, "fits", accuracy_fits_to_json(&sweep->fits));
    char *const text = root ? io_json_format(root) : NULL;
    const bool done = text ? io_file_write(path, text, strlen(text), status)
                           : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the results");
    free(text);
    json_decref(root);
    return done;
}

static struct accuracy_point *find(struct accuracy_sweep *sweep, const char *knob, const char *label)
{
    for (size_t i = 0; i < sweep->point_count; i++) {
        if (strcmp(sweep->points[i].knob->name, knob) == 0 &&
            strcmp(sweep->points[i].setting.label, label) == 0)
            return &sweep->points[i];
    }
    return NULL;
}

static bool read_point(const struct io_json *at, struct accuracy_sweep *sweep, dipole_status *status)
{
    char knob[ACCURACY_LABEL_SIZE] = "", label[ACCURACY_LABEL_SIZE] = "";
    double times_ms[ACCURACY_REPEAT_LIMIT];
    size_t count = 0;
    const struct io_json times = io_json_member(at, "times_ms");
    if (!io_json_get_text(at, "knob", knob, sizeof knob, status) ||
        !io_json_get_text(at, "setting", label, sizeof label, status) ||
        !io_json_check_array(&times, 0, ACCURACY_REPEAT_LIMIT, &count, status) ||
        !io_json_get_numbers(at, "times_ms", count, 0, INFINITY, times_ms, status))
        return false;
    struct accuracy_point *const point = find(sweep, knob, label);
    if (!point) /* of a knob that is not swept this time */
        return true;
    point->time_count = count;
    memcpy(point->times_ms, times_ms, count * sizeof *times_ms);
    return true;
}

bool accuracy_results_resume(struct accuracy_sweep *sweep, const char *path, dipole_status *status)
{
    struct io_json_document *document = NULL;
    char key[sizeof sweep->key] = "", cpu[RENDER_MACHINE_TEXT] = "";
    dipole_status why = { .code = DIPOLE_OK };
    if (!io_json_read(path, &document, &why)) {
        if (why.code == DIPOLE_NOT_FOUND)
            return true;
        if (status)
            *status = why;
        return false;
    }
    const struct io_json root = io_json_root(document), points = io_json_member(&root, "points"),
                         machine = io_json_member(&root, "machine");
    size_t count = 0;
    bool done = io_json_get_text(&root, "key", key, sizeof key, status) &&
                io_json_get_text(&machine, "cpu", cpu, sizeof cpu, status) &&
                io_json_check_array(&points, 0, ACCURACY_POINT_LIMIT, &count, status);
    const bool is_same =
        strcmp(key, sweep->key) == 0 && strcmp(cpu, sweep->subject->renderer->machine.cpu) == 0;
    for (size_t i = 0; done && is_same && i < count; i++) {
        const struct io_json at = io_json_element(&points, i);
        done = read_point(&at, sweep, status);
    }
    io_json_destroy(document);
    return done;
}
