/* One table on its way to disk. */
#ifndef LUTGEN_JOB_H
#define LUTGEN_JOB_H

#include "lutgen/lut.h"

enum lut_format { LUT_EXR = 0, LUT_DDS, LUT_RAW, LUT_FORMAT_COUNT };
extern const char *const lut_format_names[]; /* "exr", "dds", "raw"; ends with NULL */

struct lut_job {
    struct lut_request request;
    const char *source; /* the material's file, for messages; NULL when there are several */
    char stem[4096];    /* path of the files without the format's ending                  */
    unsigned formats;   /* bit i for lut_format i                                         */
    bool is_plotted, is_forced;
    int thread_count;

    /* After lut_job_find_current or lut_job_bake: */
    bool is_current; /* the files were there, made of the same inputs, and whole */
    struct io_image *image;
    int depth; /* slices side by side in the image */
    struct lut_error error;
    double bake_ms;
};

/* Whether all files of the job are there, were baked from the same request by this version, and hold what
 * they say. */
void lut_job_find_current(struct lut_job *job);

/* Bake in memory. Fails with the material's file, or as lut_splat_bake and lut_tsm_bake do. */
DIPOLE_CHECKED bool lut_job_bake(struct lut_job *job, dipole_status *status);

/* Write all files; an EXR file is read back and audited before it gets its name. Others that hold the same
 * bytes already are left as they are, unless is_forced: engines import again what has a new date. */
DIPOLE_CHECKED bool lut_job_write(struct lut_job *job, dipole_status *status);

/* Write DIR/NAME.KIND.svg: curves, or the contact sheet of a volume. */
DIPOLE_CHECKED bool lut_job_plot(const struct lut_job *job, dipole_status *status);

/* Path of the job's file in a format; the first of its formats. */
void lut_job_path(const struct lut_job *job, enum lut_format format, char *out, size_t size);
enum lut_format lut_job_first_format(const struct lut_job *job);

void lut_job_end(struct lut_job *job);

#endif
