/* The measurements: every setting of every knob, drawn and timed in turns, kept in a file as they come. */
#ifndef ACCURACY_SWEEP_H
#define ACCURACY_SWEEP_H

#include "accuracy/error.h"
#include "accuracy/fits.h"
#include "accuracy/knob.h"
#include "accuracy/ladder.h"

#include <signal.h>

enum { ACCURACY_POINT_LIMIT = 256 };

struct accuracy_effect_time {
    bool is_active;
    double predicted_ms, measured_ms;
};

struct accuracy_point {
    const struct accuracy_knob *knob;
    struct accuracy_setting setting;
    bool is_drawn; /* then error is known */
    struct accuracy_error error;
    double error_predicted, predicted_ms;   /* NAN: nothing is predicted */
    double times_ms[ACCURACY_REPEAT_LIMIT]; /* of the picture, after a first that is not counted */
    size_t time_count;
    struct accuracy_spread time_ms; /* of those */
    char refusal[384];              /* why the renderer does not draw it; "": it does */
    struct io_image *picture;       /* NULL: not drawn in this run */
    struct accuracy_effect_time effects[RENDER_EFFECT_LIMIT]; /* of the last picture */
    size_t effect_count;
};

/* A knob that the scene does not call for. */
struct accuracy_omission {
    const struct accuracy_knob *knob;
    const char *reason;
};

struct accuracy_sweep {
    struct accuracy_subject *subject;
    struct io_image *reference;
    double reference_error; /* estimated */
    char key[64];           /* of scene, size and program: what was measured of another is not taken over */
    int repeat_count;
    struct accuracy_point *points;
    size_t point_count;
    struct accuracy_omission omissions[ACCURACY_SETTING_LIMIT];
    size_t omission_count;
    struct accuracy_ladder ladder; /* of the scene's materials; without cases until it is climbed */
    struct accuracy_fits fits;     /* to the reference; without points until they are measured    */
};

/* List the points; is_quick: few knobs, every other setting. Bakes what settings need. End with
 * accuracy_sweep_end. */
DIPOLE_CHECKED bool accuracy_sweep_init(struct accuracy_subject *subject, bool is_quick, int repeat_count,
                                        struct accuracy_sweep *sweep, dipole_status *status);
void accuracy_sweep_end(struct accuracy_sweep *sweep);

/*
 * Draw the reference and all points, then time in turns what has not been timed often enough. Results are
 * kept in folder/accuracy.json as they come, the reference beside them, and both are taken up again. Stops
 * early, with success, once *stop is set.
 */
DIPOLE_CHECKED bool accuracy_sweep_run(struct accuracy_sweep *sweep, const char *folder,
                                       const volatile sig_atomic_t *stop,
                                       const struct render_progress *progress, dipole_status *status);

/* Measure the physics ladder of the scene's materials, and write it to the results, too. */
DIPOLE_CHECKED bool accuracy_sweep_climb(struct accuracy_sweep *sweep, const volatile sig_atomic_t *stop,
                                         const char *folder, const struct render_progress *progress,
                                         dipole_status *status);

/* Measure what a fit to the reference costs, and write it to the results, too. */
DIPOLE_CHECKED bool accuracy_sweep_fit(struct accuracy_sweep *sweep, const volatile sig_atomic_t *stop,
                                       const char *folder, const struct render_progress *progress,
                                       dipole_status *status);

/* Whether every point is drawn and timed. */
bool accuracy_sweep_is_complete(const struct accuracy_sweep *sweep);

/* Whether none other of the same knob, or of all knobs, is as exact and faster, by relative RMSE. */
bool accuracy_point_is_best(const struct accuracy_sweep *sweep, size_t index, bool is_of_all);

/* accuracy_halving_of a knob's best points. */
double accuracy_halving_cost(const struct accuracy_sweep *sweep, const struct accuracy_knob *knob);

/* ---- accuracy.json (results.c) ------------------------------------------------------------------ */

DIPOLE_CHECKED bool accuracy_results_write(const struct accuracy_sweep *sweep, const char *path,
                                           dipole_status *status);

/* Take over what was measured of the same scene; a file that is not there is no failure. */
DIPOLE_CHECKED bool accuracy_results_resume(struct accuracy_sweep *sweep, const char *path,
                                            dipole_status *status);

#endif
