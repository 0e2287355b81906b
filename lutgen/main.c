/* lutgen: bake the tables that a renderer needs. */
#include "cli/cli.h"
#include "io/file.h"
#include "lutgen/lut.h"

#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct options {
    struct cli_common common;
    const char *folder;
    double epsilon;
    int kind;
    bool is_half;
};

static const char *const kinds[] = { "splat1d", NULL };

/* One material on its way to a table. */
struct job {
    const char *material_path;
    char path[4096]; /* of the table */
    struct io_material material;
    struct lut_splat1d *lut;
    double bake_ms;
};

/* Length of a path's file name without folder and ".json". */
static size_t stem_find(const char *path, const char **stem_out)
{
    const char *const slash = strrchr(path, '/');
    *stem_out = slash ? slash + 1 : path;
    const size_t length = strlen(*stem_out);
    const bool is_json = length > 5 && strcmp(*stem_out + length - 5, ".json") == 0;
    return is_json ? length - 5 : length;
}

/* ---- steps -------------------------------------------------------------------------------------- */

/* Everything that can be wrong with the inputs, before anything is written. */
static bool jobs_read(const struct cli_tool *tool, const struct options *options, struct job *jobs,
                      int count, dipole_status *status)
{
    for (int i = 0; i < count; i++) {
        struct job *const job = &jobs[i];
        const char *stem;
        const size_t length = stem_find(job->material_path, &stem);
        const int size = snprintf(job->path, sizeof job->path, "%s/%.*s.splat1d.exr", options->folder,
                                  (int)length, stem);
        if (size < 0 || (size_t)size >= sizeof job->path)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "the path of the table of %.200s is too long", job->material_path);
        for (int j = 0; j < i; j++)
            if (strcmp(jobs[j].path, job->path) == 0)
                return dipole_fail(
                    status, DIPOLE_BAD_VALUE, NULL,
                    "%.100s and %.100s would both become %.100s, expected different file names",
                    jobs[j].material_path, job->material_path, job->path);
        if (!io_material_open(job->material_path, &job->material, status) ||
            !io_material_check_classical(&job->material, status))
            return false;
        if (job->material.warning[0])
            cli_note(tool, &options->common, "%s: %s", job->material_path, job->material.warning);
    }
    return true;
}

static bool job_bake(const struct options *options, struct job *job, dipole_status *status)
{
    const double start_s = cli_now_s();
    dipole_status why = { 0 };
    if (!(options->is_half ? lut_splat1d_bake_half : lut_splat1d_bake)(&job->material, options->epsilon,
                                                                       &job->lut, &why)) {
        const dipole_place place = { .source = job->material_path };
        return dipole_fail(status, why.code, &place, "%s", why.message);
    }
    job->bake_ms = (cli_now_s() - start_s) * 1000;
    return true;
}

/* Read the written table back and audit it at points of its own. */
static bool table_check(const char *path, double epsilon, dipole_status *status)
{
    struct lut_splat1d *lut = NULL;
    if (!lut_splat1d_read(path, &lut, status))
        return false;
    const double error = lut_splat1d_audit(lut, (size_t)lut->axis.node_count * 16, 3);
    lut_splat1d_destroy(lut);
    return error <= epsilon ||
           dipole_fail(status, DIPOLE_IO_FAILED, NULL,
                       "read back, the table errs by %.3g, expected at most %g", error, epsilon);
}

/* Write under another name, check what is on disk, then give it its name. */
static bool job_write(const struct options *options, const struct job *job, dipole_status *status)
{
    char unchecked[sizeof job->path + 16];
    snprintf(unchecked, sizeof unchecked, "%s.unchecked", job->path);
    dipole_status why = { 0 };
    bool is_done = lut_splat1d_write(job->lut, unchecked, options->is_half, &why);
    if (is_done) {
        is_done = table_check(unchecked, options->epsilon, &why);
        if (is_done && rename(unchecked, job->path) != 0)
            is_done = dipole_fail(&why, DIPOLE_IO_FAILED, NULL, "cannot be written: %s", strerror(errno));
        if (!is_done)
            unlink(unchecked);
    }
    const dipole_place place = { .source = job->path };
    return is_done || dipole_fail(status, why.code, &place, "%s", why.message);
}

static bool jobs_run(const struct cli_tool *tool, const struct options *options, struct job *jobs,
                     int count, dipole_status *status)
{
    struct cli_progress progress;
    cli_progress_start(&progress, tool, &options->common);
    bool is_done = jobs_read(tool, options, jobs, count, status);
    for (int i = 0; i < count && is_done; i++) {
        is_done = job_bake(options, &jobs[i], status);
        cli_progress_show(&progress, "baking", 0.5 * (i + 1) / count);
    }
    is_done = is_done && io_folder_make(options->folder, status);
    for (int i = 0; i < count && is_done; i++) {
        is_done = job_write(options, &jobs[i], status);
        cli_progress_show(&progress, "writing", 0.5 + 0.5 * (i + 1) / count);
    }
    cli_progress_show(&progress, "writing", 1);
    return is_done;
}

/* ---- results ------------------------------------------------------------------------------------ */

static bool print_json(const struct job *jobs, int count, dipole_status *status)
{
    json_t *const files = json_array();
    bool is_done = files != NULL;
    for (int i = 0; i < count && is_done; i++)
        is_done = json_array_append_new(
                      files, json_pack("{s:s, s:s, s:i, s:f, s:f}", "path", jobs[i].path, "kind", kinds[0],
                                       "size", jobs[i].lut->axis.node_count, "max_relative_error",
                                       jobs[i].lut->max_relative_error, "bake_ms", jobs[i].bake_ms)) == 0;
    json_t *const result = json_pack("{s:O?}", "files", files);
    char *const text = is_done && result ? io_json_format(result) : NULL;
    if (text)
        fputs(text, stdout);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                    "out of memory for the result (is a path not UTF-8?)");
    is_done = text != NULL;
    free(text);
    json_decref(result);
    json_decref(files);
    return is_done;
}

static void print_table(const struct job *jobs, int count)
{
    int width = 4;
    for (int i = 0; i < count; i++)
        width = (int)strlen(jobs[i].path) > width ? (int)strlen(jobs[i].path) : width;
    printf("%-*s  %-7s  %6s  %18s  %8s\n", width, "path", "kind", "size", "max_relative_error", "bake_ms");
    printf("%-*s  %-7s  %6s  %18s  %8s\n", width, "", "", "texels", "", "ms");
    for (int i = 0; i < count; i++)
        printf("%-*s  %-7s  %6d  %18.3g  %8.1f\n", width, jobs[i].path, kinds[0],
               jobs[i].lut->axis.node_count, jobs[i].lut->max_relative_error, jobs[i].bake_ms);
}

static bool run(const struct cli_tool *tool, const struct options *options, char **material_paths,
                int count, dipole_status *status)
{
    struct job *const jobs = calloc((size_t)count, sizeof *jobs);
    if (!jobs)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for %d materials", count);
    for (int i = 0; i < count; i++)
        jobs[i].material_path = material_paths[i];
    bool is_done = jobs_run(tool, options, jobs, count, status);
    if (is_done && options->common.json)
        is_done = print_json(jobs, count, status);
    else if (is_done)
        print_table(jobs, count);
    is_done = is_done && cli_stdout_finish(status);
    for (int i = 0; i < count; i++)
        lut_splat1d_destroy(jobs[i].lut);
    free(jobs);
    return is_done;
}

int main(int argc, char **argv)
{
    struct options options = { .epsilon = 0.001 };
    const struct cli_option table[] = {
        { .name = "output",
          .letter = 'o',
          .kind = CLI_TEXT,
          .target = &options.folder,
          .argument = "DIR",
          .help = "Folder for the tables; made when missing. Required." },
        { .name = "epsilon",
          .letter = 'e',
          .kind = CLI_NUMBER,
          .target = &options.epsilon,
          .argument = "E",
          .min = 1e-6,
          .max = 0.5,
          .help =
              "Largest relative error of a table, and part of the light left beyond its end r_max; 1e-6 "
              "to 0.5, default 0.001." },
        { .name = "kind",
          .kind = CLI_CHOICE,
          .target = &options.kind,
          .argument = "KIND",
          .choices = kinds,
          .help = "Kind of table; this version bakes splat1d, default splat1d." },
        { .name = "half",
          .kind = CLI_FLAG,
          .target = &options.is_half,
          .help = "Store half instead of float; needs epsilon above 0.00049." },
        { .name = NULL },
    };
    const struct cli_tool tool = {
        .name = "lutgen",
        .summary = "Bake diffusion profiles of materials into EXR tables",
        .usage = "MATERIAL.json... -o DIR",
        .details =
            "Each material becomes DIR/NAME.splat1d.exr: R_d(r) in 1/mm^2 for R, G and B along one row "
            "of texels, from r = 0 to r_max. Mapping of the axis, coefficients and the measured error "
            "stand in attributes that begin with dipole:. A table is read back and audited before it "
            "gets its name.",
        .options = table,
        .operand_min = 1,
        .operand_max = INT_MAX,
    };
    cli_start();
    char **operands;
    int operand_count;
    dipole_status status = { 0 };
    switch (cli_parse(&tool, argc, argv, &options.common, &operands, &operand_count)) {
    case CLI_STOP_DONE:
        return EXIT_DONE;
    case CLI_STOP_USAGE:
        return EXIT_USAGE;
    case CLI_RUN:
        break;
    }
    if (!options.folder) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "no --output (-o) DIR was given; try --help");
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    if (!run(&tool, &options, operands, operand_count, &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
