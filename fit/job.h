/* One run of the program: read what was named, fit, say what was found. */
#ifndef FIT_JOB_H
#define FIT_JOB_H

#include "cli/cli.h"
#include "fit/fit.h"
#include "io/profile_file.h"

/* What may be free beside the coefficients; bits of fit_job_options.free. */
enum fit_free { FIT_FREE_EXPOSURE = 0, FIT_FREE_WHITE_BALANCE, FIT_FREE_AMBIENT, FIT_FREE_BLACK_LEVEL };
extern const char *const fit_free_names[]; /* ends with NULL */

struct fit_job_options {
    struct cli_common common;
    const char *material_path, *start_path, *report_path;
    struct cli_texts scene_paths, photo_paths; /* as many of each */
    struct cli_texts mask_paths, profile_paths, totals_paths, camera_names, allowed_paths;
    double eta; /* 0: not given */
    int model;  /* dipole_model; -1: not given */
    unsigned free;
    double layer; /* counted from 1; 0: not given */
    bool is_linear, is_thickness_known;
};

/* What was read; end it with fit_job_destroy. */
struct fit_job {
    const struct cli_tool *tool;
    const struct fit_job_options *options;
    struct io_material material; /* with where the search begins, later with what was found */
    struct fit_form form;
    bool is_model_open; /* nobody said which one */
    size_t picture_count, profile_count;
    struct io_scene *scenes[FIT_TARGET_LIMIT];
    struct fit_photo photos[FIT_TARGET_LIMIT];
    struct io_image *masks[FIT_TARGET_LIMIT];
    struct fit_picture *pictures[FIT_TARGET_LIMIT];
    struct io_profile *profiles[FIT_TARGET_LIMIT];
    struct io_totals *totals[FIT_TARGET_LIMIT];
    struct fit_target others[FIT_TARGET_LIMIT];
    void *other_memory[FIT_TARGET_LIMIT];
    size_t other_count;
    struct fit_result result;
    bool has_result;
    double seconds;
};

DIPOLE_CHECKED bool fit_job_read(const struct cli_tool *tool, const struct fit_job_options *options,
                                 struct fit_job *job, dipole_status *status);
DIPOLE_CHECKED bool fit_job_run(struct fit_job *job, const volatile sig_atomic_t *stop,
                                dipole_status *status);
/* The material file, the report if one is asked for, and what is printed. */
DIPOLE_CHECKED bool fit_job_write(struct fit_job *job, dipole_status *status);
void fit_job_destroy(struct fit_job *job);

#endif
