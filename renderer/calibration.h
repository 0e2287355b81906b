/*
 * How much longer effects take here than on the machine that cost.h was measured on: made by accuracy
 * --calibrate, kept in a file of the machine's own, and taken up by every renderer of that machine.
 */
#ifndef RENDERER_CALIBRATION_H
#define RENDERER_CALIBRATION_H

#include "renderer/render.h"

enum { RENDER_MACHINE_TEXT = 256 };

/* What times depend on. */
struct render_machine {
    char cpu[RENDER_MACHINE_TEXT];
    int core_count;
    char driver[RENDER_MACHINE_TEXT]; /* what OpenGL calls itself */
};

void render_machine_identify(const char *driver, struct render_machine *machine);

struct render_effect_calibration {
    char name[32];
    double fixed_ms; /* what it takes whatever there is to do                            */
    double scale;    /* times what is predicted: the rest, of pictures after the first   */
    double start_ms; /* by which the first picture takes longer                          */
};

struct render_calibration {
    struct render_effect_calibration effects[RENDER_EFFECT_LIMIT + 1];
    size_t effect_count;
};

/* Stands among the effects for what a picture takes beside them: planning, tables, reading it back. */
#define RENDER_BESIDE_EFFECTS "picture"

/* NULL: none, or the effect was not measured. */
const struct render_effect_calibration *render_calibration_find(
    const struct render_calibration *calibration, const char *effect);

/* Where the machine's calibration is kept: a name of its own in $DIPOLE_CACHE, or else in libdipole/ of
 * $XDG_CACHE_HOME, or of ~/.cache. Fails with DIPOLE_NOT_FOUND where there is no such folder to be known,
 * or DIPOLE_BAD_VALUE for a path too long. */
DIPOLE_CHECKED bool render_calibration_path(const struct render_machine *machine, char *out, size_t size,
                                            dipole_status *status);

/* Fails as io_json_read and its getters do, with DIPOLE_NOT_FOUND where there is none, and with
 * DIPOLE_BAD_VALUE where it is of another machine or version. */
DIPOLE_CHECKED bool render_calibration_read(const char *path, const struct render_machine *machine,
                                            struct render_calibration *calibration_out,
                                            dipole_status *status);

/* Makes its folder, too. Fails as io_folder_make and io_file_write do. */
DIPOLE_CHECKED bool render_calibration_write(const char *path, const struct render_machine *machine,
                                             const struct render_calibration *calibration,
                                             dipole_status *status);

#endif
