/* How long effects take on this machine, of what the plan would predict: measured on bundled scenes. */
#ifndef ACCURACY_CALIBRATE_H
#define ACCURACY_CALIBRATE_H

#include "renderer/calibration.h"

/* What is too short for its time to tell of more than the clock. */
#define ACCURACY_TOLD_MS 0.05

/* One effect, over all pictures that ran it. */
struct accuracy_effect_times {
    char name[32];
    size_t count;        /* of pictures                                                 */
    double fixed_ms;     /* what it takes whatever there is to do                         */
    double scale;        /* times what is predicted without calibration                   */
    double start_ms;     /* median of what the first picture took more                    */
    double median_error; /* median of |predicted - measured| / measured; NAN: too short to tell */
};

struct accuracy_calibration {
    struct render_machine machine;
    struct accuracy_effect_times effects[RENDER_EFFECT_LIMIT + 1]; /* with RENDER_BESIDE_EFFECTS */
    size_t effect_count, picture_count;
    double median_error, largest_error; /* the same of whole pictures */
    double unseen_error; /* median of whole pictures, calibrated by the pictures of all other scenes */
};

/* Draw the bundled scenes by several techniques, sizes and epsilons, and compare: a minute or two.
 * Fails as io_data_path, io_scene_read and render_create do. */
DIPOLE_CHECKED bool accuracy_calibrate(const struct render_progress *progress,
                                       struct accuracy_calibration *calibration_out, dipole_status *status);

/* Keep it where renderers of this machine look for it, which path_out (of size bytes) is told. */
DIPOLE_CHECKED bool accuracy_calibration_keep(const struct accuracy_calibration *calibration,
                                              char *path_out, size_t size, dipole_status *status);

#endif
