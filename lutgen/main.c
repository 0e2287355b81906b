/* lutgen: bake the tables that a renderer needs. */
#include "cli/cli.h"
#include "io/file.h"
#include "lutgen/job.h"

#include <jansson.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

/* Largest relative errors by default: a volume of the usual size errs by less. */
#define SPLAT_EPSILON 0.001
#define TSM_EPSILON 0.15

struct options {
    struct cli_common common;
    const char *folder, *size_text;
    double epsilon; /* 0: by kind */
    unsigned kinds, formats;
    int node_count, volume[3]; /* 0: chosen */
    bool is_half, is_forced, is_plotted;
    double thread_count;
};

/* All that is asked for: the materials, and a table or several of each. */
struct batch {
    int material_count, job_count;
    char **paths;
    struct io_material *materials;
    struct lut_job *jobs;
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

/* ---- what is asked for -------------------------------------------------------------------------- */

/* "N": nodes of splat tables; "SxTxR": a volume. */
static bool size_parse(struct options *options, dipole_status *status)
{
    int size[3], end = 0;
    const char *const text = options->size_text;
    const bool has_volume = (options->kinds >> LUT_TSM & 1U) != 0,
               has_splat = (options->kinds & ~(1U << LUT_TSM)) != 0;
    if (!text)
        return true;
    if (sscanf(text, "%5dx%5dx%5d%n", &size[0], &size[1], &size[2], &end) == 3 && text[end] == '\0') {
        memcpy(options->volume, size, sizeof size);
        return has_volume ||
               dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--size is \"%.100s\", that of a volume, but --kind has no tsm", text);
    }
    end = 0;
    if (sscanf(text, "%5d%n", &size[0], &end) == 1 && text[end] == '\0') {
        options->node_count = size[0];
        return has_splat ||
               dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--size is \"%.100s\", that of a splat table, but --kind is tsm: expected SxTxR",
                           text);
    }
    return dipole_fail(
        status, DIPOLE_BAD_VALUE, NULL,
        "--size is \"%.100s\", expected a number of texels (splat1d, splat2d) or SxTxR (tsm)", text);
}

static bool job_add(const struct options *options, struct batch *batch, enum lut_kind kind, int first,
                    int count, dipole_status *status)
{
    struct lut_job *const job = &batch->jobs[batch->job_count];
    const char *stem = "materials";
    const size_t length = kind == LUT_SPLAT2D ? strlen(stem) : stem_find(batch->paths[first], &stem);
    const int *const volume = options->volume;
    *job = (struct lut_job){
        .request = { .kind = kind,
                     .materials = &batch->materials[first],
                     .material_count = (size_t)count,
                     .epsilon = options->epsilon > 0 ? options->epsilon
                                : kind == LUT_TSM    ? TSM_EPSILON
                                                     : SPLAT_EPSILON,
                     .is_half = options->is_half },
        .source = kind == LUT_SPLAT2D ? NULL : batch->paths[first],
        .formats = options->formats,
        .is_plotted = options->is_plotted,
        .is_forced = options->is_forced,
        .thread_count = (int)options->thread_count,
    };
    if (kind == LUT_TSM)
        memcpy(job->request.size, volume, sizeof job->request.size);
    else
        job->request.size[0] = options->node_count;
    const int size = snprintf(job->stem, sizeof job->stem, "%s/%.*s.%s", options->folder, (int)length, stem,
                              lut_kind_names[kind]);
    if (size < 0 || (size_t)size >= sizeof job->stem - 16)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the path of the table of %.200s is too long",
                           batch->paths[first]);
    for (int i = 0; i < batch->job_count; i++)
        if (strcmp(batch->jobs[i].stem, job->stem) == 0) {
            char path[sizeof job->stem + 16];
            lut_job_path(job, lut_job_first_format(job), path, sizeof path);
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "%.100s and %.100s would both become %.100s, expected different file names",
                               batch->jobs[i].source, batch->paths[first], path);
        }
    batch->job_count++;
    return true;
}

/* Everything that can be wrong with the inputs, before anything is written. */
static bool batch_read(const struct cli_tool *tool, const struct options *options, struct batch *batch,
                       dipole_status *status)
{
    for (int kind = 0; kind < LUT_KIND_COUNT; kind++) {
        if (!(options->kinds >> kind & 1U))
            continue;
        const bool is_joint = kind == LUT_SPLAT2D;
        for (int i = 0; i < (is_joint ? 1 : batch->material_count); i++)
            if (!job_add(options, batch, (enum lut_kind)kind, i, is_joint ? batch->material_count : 1,
                         status))
                return false;
    }
    for (int i = 0; i < batch->material_count; i++) {
        if (!io_material_open(batch->paths[i], &batch->materials[i], status))
            return false;
        if (batch->materials[i].warning[0])
            cli_note(tool, &options->common, "%s: %s", batch->paths[i], batch->materials[i].warning);
    }
    return true;
}

/* ---- steps -------------------------------------------------------------------------------------- */

static bool batch_run(const struct cli_tool *tool, const struct options *options, struct batch *batch,
                      dipole_status *status)
{
    struct cli_progress progress;
    cli_progress_start(&progress, tool, &options->common);
    bool is_done = batch_read(tool, options, batch, status);
    const int count = batch->job_count;
    for (int i = 0; i < count && is_done; i++) {
        struct lut_job *const job = &batch->jobs[i];
        cli_progress_show(&progress, job->stem, 0.7 * i / count);
        if (!options->is_forced)
            lut_job_find_current(job);
        is_done = job->is_current || lut_job_bake(job, status);
    }
    is_done = is_done && io_folder_make(options->folder, status);
    for (int i = 0; i < count && is_done; i++) {
        struct lut_job *const job = &batch->jobs[i];
        cli_progress_show(&progress, "writing", 0.7 + 0.3 * i / count);
        is_done = (job->is_current || lut_job_write(job, status)) &&
                  (!job->is_plotted || lut_job_plot(job, status));
    }
    cli_progress_show(&progress, "writing", 1);
    return is_done;
}

/* ---- results ------------------------------------------------------------------------------------ */

/* A number of texels, or [width, rows], or [S, T, R]. */
static json_t *size_to_json(const struct lut_job *job)
{
    const int width = job->image->width_px, height = job->image->height_px;
    switch (job->request.kind) {
    case LUT_SPLAT2D:
        return json_pack("[ii]", width, height);
    case LUT_TSM:
        return json_pack("[iii]", width / job->depth, height, job->depth);
    case LUT_SPLAT1D:
    case LUT_KIND_COUNT:
        break;
    }
    return json_integer(width);
}

static bool print_json(const struct batch *batch, dipole_status *status)
{
    json_t *const files = json_array();
    bool is_done = files != NULL;
    for (int i = 0; i < batch->job_count; i++) {
        const struct lut_job *const job = &batch->jobs[i];
        for (int format = 0; format < LUT_FORMAT_COUNT && is_done; format++) {
            char path[sizeof job->stem + 16];
            if (!(job->formats >> format & 1U))
                continue;
            lut_job_path(job, (enum lut_format)format, path, sizeof path);
            is_done = json_array_append_new(
                          files, json_pack("{s:s, s:s, s:o, s:f, s:f, s:b, s:f}", "path", path, "kind",
                                           lut_kind_names[job->request.kind], "size", size_to_json(job),
                                           "max_relative_error", job->error.max, "p99_relative_error",
                                           job->error.p99, "up_to_date", job->is_current, "bake_ms",
                                           job->bake_ms)) == 0;
        }
    }
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

static void size_to_text(const struct lut_job *job, char out[48])
{
    const int width = job->image->width_px, height = job->image->height_px;
    if (job->request.kind == LUT_TSM)
        snprintf(out, 48, "%dx%dx%d", width / job->depth, height, job->depth);
    else if (job->request.kind == LUT_SPLAT2D)
        snprintf(out, 48, "%dx%d", width, height);
    else
        snprintf(out, 48, "%d", width);
}

static void print_table(const struct batch *batch)
{
    int width = 4;
    char path[sizeof batch->jobs->stem + 16];
    for (int i = 0; i < batch->job_count; i++) {
        lut_job_path(&batch->jobs[i], lut_job_first_format(&batch->jobs[i]), path, sizeof path);
        width = (int)strlen(path) > width ? (int)strlen(path) : width;
    }
    printf("%-*s  %-7s  %10s  %18s  %18s  %10s\n", width, "path", "kind", "size", "max_relative_error",
           "p99_relative_error", "bake_ms");
    printf("%-*s  %-7s  %10s  %18s  %18s  %10s\n", width, "", "", "texels", "", "", "ms");
    for (int i = 0; i < batch->job_count; i++) {
        const struct lut_job *const job = &batch->jobs[i];
        for (int format = 0; format < LUT_FORMAT_COUNT; format++) {
            char size[48], time[32] = "up to date";
            if (!(job->formats >> format & 1U))
                continue;
            lut_job_path(job, (enum lut_format)format, path, sizeof path);
            size_to_text(job, size);
            if (!job->is_current)
                snprintf(time, sizeof time, "%.1f", job->bake_ms);
            printf("%-*s  %-7s  %10s  %18.3g  %18.3g  %10s\n", width, path,
                   lut_kind_names[job->request.kind], size, job->error.max, job->error.p99, time);
        }
    }
}

static bool run(const struct cli_tool *tool, struct options *options, char **paths, int count,
                dipole_status *status)
{
    struct batch batch = { .material_count = count,
                           .paths = paths,
                           .materials = calloc((size_t)count, sizeof *batch.materials),
                           .jobs = calloc((size_t)count * LUT_KIND_COUNT, sizeof *batch.jobs) };
    bool is_done = (batch.materials && batch.jobs) ||
                   dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for %d materials", count);
    is_done = is_done && batch_run(tool, options, &batch, status);
    if (is_done && options->common.json)
        is_done = print_json(&batch, status);
    else if (is_done)
        print_table(&batch);
    is_done = is_done && cli_stdout_finish(status);
    for (int i = 0; i < batch.job_count; i++)
        lut_job_end(&batch.jobs[i]);
    free(batch.jobs);
    free(batch.materials);
    return is_done;
}

int main(int argc, char **argv)
{
    struct options options = { .kinds = 1U << LUT_SPLAT1D, .formats = 1U << LUT_EXR };
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
          .min = LUT_EPSILON_MIN,
          .max = LUT_EPSILON_MAX,
          .help = "Largest relative error of a table; 1e-6 to 0.5, default 0.001, of tsm 0.15. A splat "
                  "table ends where as much of the light is left." },
        { .name = "kind",
          .letter = 'k',
          .kind = CLI_CHOICES,
          .target = &options.kinds,
          .argument = "KIND,...",
          .choices = lut_kind_names,
          .help =
              "Kinds of table, with commas between: splat1d (a row of texels), splat2d (one table with "
              "a row for each material), tsm (a volume for translucent shadow maps); default splat1d." },
        { .name = "format",
          .letter = 'f',
          .kind = CLI_CHOICES,
          .target = &options.formats,
          .argument = "FORMAT,...",
          .choices = lut_format_names,
          .help =
              "Kinds of file, with commas between: exr (attributes inside), dds (DX10 texture or "
              "volume) or raw (bare numbers), each of the latter with a .json beside it; default exr." },
        { .name = "half",
          .kind = CLI_FLAG,
          .target = &options.is_half,
          .help = "Store half instead of float, with the same error; needs epsilon above 0.00049." },
        { .name = "size",
          .letter = 's',
          .kind = CLI_TEXT,
          .target = &options.size_text,
          .argument = "N|SxTxR",
          .help = "Texels of a splat table (8 to 32768; default: the fewest that keep epsilon), or of a "
                  "volume (S, T 8 to 1024, R 16, 32, 64, 128 or 256; default: 64x64x32, S and T doubled "
                  "until epsilon is kept)." },
        { .name = "force",
          .kind = CLI_FLAG,
          .target = &options.is_forced,
          .help = "Bake again what is up to date." },
        { .name = "plot",
          .kind = CLI_FLAG,
          .target = &options.is_plotted,
          .help = "Write DIR/NAME.KIND.svg as well: curves, or a contact sheet of the volume's slices." },
        { .name = "threads",
          .kind = CLI_NUMBER,
          .target = &options.thread_count,
          .argument = "N",
          .min = 0,
          .max = 64,
          .help =
              "Threads that bake a volume; the bytes do not depend on it. Default 0: one per processor." },
        { .name = NULL },
    };
    const struct cli_tool tool = {
        .name = "lutgen",
        .summary = "Bake diffusion profiles of materials into tables for renderers",
        .usage = "MATERIAL.json... -o DIR",
        .details =
            "Each material becomes DIR/NAME.splat1d.exr: R_d(r) for R, G and B along one row of texels, "
            "from r = 0 to r_max; DIR/NAME.tsm.exr: slices of a volume side by side; all materials "
            "together become DIR/materials.splat2d.exr. Mappings of the axes, coefficients and measured "
            "errors stand in attributes that begin with dipole:. A table is read back and audited before "
            "it gets its name, and left alone when it is there already, baked from the same inputs.",
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
    if (!size_parse(&options, &status))
        return cli_report(&tool, &status, EXIT_USAGE);
    if (!run(&tool, &options, operands, operand_count, &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
