#include "renderer/calibration.h"

#include "io/file.h"
#include "io/hash.h"
#include "io/json.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What no machine comes near. */
#define SCALE_MIN 1e-6
#define SCALE_MAX 1e6
#define TIME_MAX_MS 1e7

static void read_cpu(char *out, size_t size)
{
    char line[RENDER_MACHINE_TEXT];
    FILE *const file = fopen("/proc/cpuinfo", "r");
    snprintf(out, size, "unknown processor");
    while (file && fgets(line, sizeof line, file)) {
        const char *const colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || !colon || strlen(colon) < 3)
            continue;
        snprintf(out, size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        break;
    }
    if (file)
        fclose(file);
}

void render_machine_identify(const char *driver, struct render_machine *machine)
{
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    read_cpu(machine->cpu, sizeof machine->cpu);
    machine->core_count = cores > 0 ? (int)cores : 1;
    snprintf(machine->driver, sizeof machine->driver, "%s", driver);
}

const struct render_effect_calibration *render_calibration_find(
    const struct render_calibration *calibration, const char *effect)
{
    for (size_t i = 0; calibration && i < calibration->effect_count; i++) {
        if (strcmp(calibration->effects[i].name, effect) == 0)
            return &calibration->effects[i];
    }
    return NULL;
}

/* ---- the file ----------------------------------------------------------------------------------- */

static bool find_folder(char *out, size_t size, dipole_status *status)
{
    const char *const own = getenv("DIPOLE_CACHE"), *const cache = getenv("XDG_CACHE_HOME"),
                      *const home = getenv("HOME");
    int length = -1;
    if (own && *own)
        length = snprintf(out, size, "%s", own);
    else if (cache && *cache == '/')
        length = snprintf(out, size, "%s/libdipole", cache);
    else if (home && *home == '/')
        length = snprintf(out, size, "%s/.cache/libdipole", home);
    else
        return dipole_fail(
            status, DIPOLE_NOT_FOUND, NULL,
            "none of DIPOLE_CACHE, XDG_CACHE_HOME and HOME says where calibrations are kept");
    return (length >= 0 && (size_t)length < size) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the cache's path is too long");
}

bool render_calibration_path(const struct render_machine *machine, char *out, size_t size,
                             dipole_status *status)
{
    char folder[4096];
    uint64_t hash = IO_HASH_START;
    io_hash_text(&hash, dipole_version());
    io_hash_text(&hash, machine->cpu);
    io_hash_bytes(&hash, &machine->core_count, sizeof machine->core_count);
    io_hash_text(&hash, machine->driver);
    if (!find_folder(folder, sizeof folder, status))
        return false;
    const int length = snprintf(out, size, "%s/calibration-%016" PRIx64 ".json", folder, hash);
    return (length >= 0 && (size_t)length < size) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the cache's path is too long");
}

static const char *const root_keys[] = { "version", "cpu", "cores", "opengl", "effects", NULL };
static const char *const effect_keys[] = { "name", "fixed_ms", "scale", "start_ms", NULL };
enum { ROOT_KEYS = 5, EFFECT_KEYS = 4 };

static bool read_effect(const struct io_json *at, struct render_effect_calibration *effect,
                        dipole_status *status)
{
    return io_json_check_object(at, effect_keys, EFFECT_KEYS, status) &&
           io_json_get_text(at, "name", effect->name, sizeof effect->name, status) &&
           io_json_get_number(at, "fixed_ms", 0, TIME_MAX_MS, &effect->fixed_ms, status) &&
           io_json_get_number(at, "scale", SCALE_MIN, SCALE_MAX, &effect->scale, status) &&
           io_json_get_number(at, "start_ms", 0, TIME_MAX_MS, &effect->start_ms, status);
}

static bool check_machine(const struct io_json *root, const struct render_machine *machine,
                          dipole_status *status)
{
    char version[64] = "", cpu[RENDER_MACHINE_TEXT] = "", driver[RENDER_MACHINE_TEXT] = "";
    double core_count = 0;
    if (!io_json_get_text(root, "version", version, sizeof version, status) ||
        !io_json_get_text(root, "cpu", cpu, sizeof cpu, status) ||
        !io_json_get_number(root, "cores", 1, 1e6, &core_count, status) ||
        !io_json_get_text(root, "opengl", driver, sizeof driver, status))
        return false;
    return (strcmp(version, dipole_version()) == 0 && strcmp(cpu, machine->cpu) == 0 &&
            (int)core_count == machine->core_count && strcmp(driver, machine->driver) == 0) ||
           io_json_fail(root, DIPOLE_BAD_VALUE, status, "is of another machine or version");
}

bool render_calibration_read(const char *path, const struct render_machine *machine,
                             struct render_calibration *calibration_out, dipole_status *status)
{
    struct io_json_document *document = NULL;
    *calibration_out = (struct render_calibration){ .effect_count = 0 };
    if (!io_json_read(path, &document, status))
        return false;
    const struct io_json root = io_json_root(document), effects = io_json_member(&root, "effects");
    size_t count = 0;
    bool done = io_json_check_object(&root, root_keys, ROOT_KEYS, status) &&
                check_machine(&root, machine, status) &&
                io_json_check_array(&effects, 0, RENDER_EFFECT_LIMIT + 1, &count, status);
    for (size_t i = 0; done && i < count; i++) {
        const struct io_json at = io_json_element(&effects, i);
        done = read_effect(&at, &calibration_out->effects[i], status);
    }
    calibration_out->effect_count = done ? count : 0;
    io_json_destroy(document);
    return done;
}

/* NULL: no memory. */
static char *format(const struct render_machine *machine, const struct render_calibration *calibration)
{
    json_t *const effects = json_array();
    for (size_t i = 0; i < calibration->effect_count; i++) {
        const struct render_effect_calibration *const effect = &calibration->effects[i];
        json_array_append_new(effects, json_pack("{s:s, s:f, s:f, s:f}", "name", effect->name, "fixed_ms",
                                                 effect->fixed_ms, "scale", effect->scale, "start_ms",
                                                 effect->start_ms));
    }
    json_t *const root =
        json_pack("{s:s, s:s, s:i, s:s, s:o}", "version", dipole_version(), "cpu", machine->cpu, "cores",
                  machine->core_count, "opengl", machine->driver, "effects", effects);
    char *const text = root ? io_json_format(root) : NULL;
    json_decref(root);
    return text;
}

bool render_calibration_write(const char *path, const struct render_machine *machine,
                              const struct render_calibration *calibration, dipole_status *status)
{
    char folder[4096], *const text = format(machine, calibration);
    const char *const slash = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
    const bool done =
        text ? io_folder_make(folder, status) && io_file_write(path, text, strlen(text), status)
             : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a calibration");
    free(text);
    return done;
}
