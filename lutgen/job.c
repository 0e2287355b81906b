#include "lutgen/job.h"

#include "io/dds.h"
#include "io/file.h"
#include "io/raw.h"
#include "lutgen/figure.h"
#include "lutgen/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

const char *const lut_format_names[] = { "exr", "dds", "raw", NULL };

void lut_job_path(const struct lut_job *job, enum lut_format format, char *out, size_t size)
{
    snprintf(out, size, "%s.%s", job->stem, lut_format_names[format]);
}

enum lut_format lut_job_first_format(const struct lut_job *job)
{
    int i = 0;
    while (!(job->formats >> i & 1U))
        i++;
    return (enum lut_format)i;
}

void lut_job_end(struct lut_job *job)
{
    io_image_destroy(job->image);
    job->image = NULL;
}

/* ---- up to date --------------------------------------------------------------------------------- */

/* A table of the kind that is asked for, in either form; end it with table_end. */
struct table {
    struct lut_splat *splat;
    struct lut_tsm *tsm;
};

static void table_end(struct table *table)
{
    lut_splat_destroy(table->splat);
    lut_tsm_destroy(table->tsm);
}

static bool table_from_image(const struct lut_job *job, const struct io_image *image, const char *path,
                             struct table *table, dipole_status *status)
{
    return job->request.kind == LUT_TSM ? lut_tsm_from_image(image, path, &table->tsm, status)
                                        : lut_splat_from_image(image, path, &table->splat, status);
}

static struct lut_error table_error(const struct table *table)
{
    struct lut_error worst = table->tsm ? table->tsm->error : (struct lut_error){ 0 };
    for (size_t i = 0; table->splat && i < table->splat->row_count; i++) {
        const struct lut_error *const error = &table->splat->rows[i].error;
        worst.max = error->max > worst.max ? error->max : worst.max;
        worst.p99 = error->p99 > worst.p99 ? error->p99 : worst.p99;
    }
    return worst;
}

static bool has_input_hash(const struct io_image *image, const char *hash)
{
    const struct io_attribute *const there = io_image_find(image, "dipole:input_hash");
    return there && there->kind == IO_ATTRIBUTE_TEXT && strcmp(there->text, hash) == 0;
}

static bool exr_is_current(struct lut_job *job, const char *hash)
{
    char path[sizeof job->stem + 16];
    lut_job_path(job, LUT_EXR, path, sizeof path);
    struct io_image *image = NULL;
    struct table table = { 0 };
    const bool is_current = io_exr_read(path, &image, NULL) && has_input_hash(image, hash) &&
                            table_from_image(job, image, path, &table, NULL);
    if (is_current) {
        job->error = table_error(&table);
        job->depth = table.tsm ? table.tsm->size[2] : 1;
        job->image = image;
        image = NULL;
    }
    table_end(&table);
    io_image_destroy(image);
    return is_current;
}

/* Only an EXR file can be read back as a table; without one it is baked, and then compared: lut_job_write.
 */
void lut_job_find_current(struct lut_job *job)
{
    const struct lut_hash hash = lut_request_hash(&job->request);
    job->is_current = (job->formats >> LUT_EXR & 1U) && exr_is_current(job, hash.text);
    for (int i = LUT_EXR + 1; i < LUT_FORMAT_COUNT && job->is_current; i++) {
        char path[sizeof job->stem + 16];
        lut_job_path(job, (enum lut_format)i, path, sizeof path);
        job->is_current = !(job->formats >> i & 1U) ||
                          io_sidecar_is_current(path, job->image, job->depth, job->request.is_half);
    }
    if (!job->is_current)
        lut_job_end(job);
}

/* ---- baking ------------------------------------------------------------------------------------- */

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static bool bake(struct lut_job *job, dipole_status *status)
{
    struct table table = { 0 };
    const double start_ms = now_ms();
    bool is_done;
    if (job->request.kind == LUT_TSM) {
        is_done = lut_tsm_bake(&job->request, job->thread_count, &table.tsm, status);
        job->bake_ms = now_ms() - start_ms;
        job->depth = is_done ? table.tsm->size[2] : 1;
        is_done = is_done && lut_tsm_to_image(table.tsm, &job->image, status);
    } else {
        is_done = lut_splat_bake(&job->request, &table.splat, status);
        job->bake_ms = now_ms() - start_ms;
        job->depth = 1;
        is_done = is_done && lut_splat_to_image(table.splat, job->request.kind, &job->image, status);
    }
    if (is_done)
        job->error = table_error(&table);
    table_end(&table);
    return is_done;
}

bool lut_job_bake(struct lut_job *job, dipole_status *status)
{
    dipole_status why = { 0 };
    if (bake(job, &why))
        return true;
    const dipole_place place = { .source = job->source };
    return dipole_fail(status, why.code, job->source ? &place : NULL, "%s", why.message);
}

/* ---- writing ------------------------------------------------------------------------------------ */

/* Points of the last audit: others than those of the bake. */
enum { SPLAT_POINTS = 16, TSM_DEPTHS = 64 };

static bool table_audit(const struct table *table, struct lut_error *worst, dipole_status *status)
{
    if (table->tsm) {
        const bool is_done = lut_tsm_audit(table->tsm, TSM_DEPTHS, LUT_SEED_CHECK, worst, status);
        worst->max += table->tsm->source_error;
        return is_done;
    }
    *worst = (struct lut_error){ 0 };
    for (size_t i = 0; i < table->splat->row_count; i++) {
        struct lut_error error;
        if (!lut_splat_audit(table->splat, i, SPLAT_POINTS, LUT_SEED_CHECK, &error, status))
            return false;
        worst->max = error.max > worst->max ? error.max : worst->max;
    }
    return true;
}

/* A picture's table against direct evaluation, once more. */
static bool image_audit(const struct lut_job *job, const struct io_image *image, const char *path,
                        dipole_status *status)
{
    struct table table = { 0 };
    struct lut_error error;
    const double stated = job->error.max;
    const bool is_done =
        table_from_image(job, image, path, &table, status) && table_audit(&table, &error, status) &&
        (error.max <= stated ||
         dipole_fail(status, DIPOLE_IO_FAILED, NULL,
                     "read back, the table errs by %.3g, which is more than the stated %.3g", error.max,
                     stated));
    table_end(&table);
    return is_done;
}

/* An io_file_check. */
static bool file_audit(void *context, const char *path, dipole_status *status)
{
    const struct lut_job *const job = context;
    struct io_image *image = NULL;
    const bool is_done = io_exr_read(path, &image, status) && image_audit(job, image, path, status);
    io_image_destroy(image);
    return is_done;
}

static bool format_write(struct lut_job *job, enum lut_format format, dipole_status *status)
{
    char path[sizeof job->stem + 16];
    lut_job_path(job, format, path, sizeof path);
    const bool is_half = job->request.is_half;
    switch (format) {
    case LUT_EXR:
        return io_exr_write_checked(path, job->image, is_half, file_audit, job, status);
    case LUT_DDS:
        return io_dds_write(path, job->image, job->depth, is_half, status) &&
               io_dds_sidecar_write(path, job->image, job->depth, is_half, status);
    case LUT_RAW:
    case LUT_FORMAT_COUNT:
        break;
    }
    return io_raw_write(path, job->image, job->depth, is_half, status);
}

static bool is_left(const struct lut_job *job, enum lut_format format)
{
    char path[sizeof job->stem + 16];
    lut_job_path(job, format, path, sizeof path);
    return !job->is_forced && format != LUT_EXR &&
           io_sidecar_is_current(path, job->image, job->depth, job->request.is_half);
}

bool lut_job_write(struct lut_job *job, dipole_status *status)
{
    if (!(job->formats >> LUT_EXR & 1U) && !image_audit(job, job->image, job->stem, status))
        return false;
    job->is_current = true;
    for (int i = 0; i < LUT_FORMAT_COUNT; i++) {
        const enum lut_format format = (enum lut_format)i;
        if (!(job->formats >> i & 1U) || is_left(job, format))
            continue;
        job->is_current = false;
        if (!format_write(job, format, status))
            return false;
    }
    return true;
}

bool lut_job_plot(const struct lut_job *job, dipole_status *status)
{
    char path[sizeof job->stem + 16], *svg = NULL;
    size_t size;
    struct table table = { 0 };
    snprintf(path, sizeof path, "%s.svg", job->stem);
    const bool is_done = table_from_image(job, job->image, path, &table, status) &&
                         (table.tsm ? lut_tsm_figure_create(table.tsm, &svg, &size, status)
                                    : lut_splat_figure_create(table.splat, &svg, &size, status)) &&
                         io_file_write(path, svg, size, status);
    free(svg);
    table_end(&table);
    return is_done;
}
