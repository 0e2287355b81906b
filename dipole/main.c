/* dipole: print or plot everything that follows from a material. */
#include "cli/cli.h"
#include "dipole/inspect.h"
#include "io/file.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { MODEL_LIMIT = 5 };

struct options {
    struct cli_common common;
    double epsilon;
    struct cli_numbers at_mm;
    const char *plot_path;
    struct cli_texts model_lists, data_paths;
    dipole_model models[MODEL_LIMIT]; /* asked for by model_lists */
    size_t model_count;
    int side;
    bool is_per_incident;
};

/* Everything that is read and derived. */
struct job {
    struct inspector_result *results;
    size_t result_count;
    struct inspector_data data[INSPECTOR_DATA_LIMIT];
    struct io_profile *profiles[INSPECTOR_DATA_LIMIT];
};

static bool has_suffix(const char *text, const char *suffix)
{
    const size_t length = strlen(text), suffix_length = strlen(suffix);
    return length > suffix_length && strcmp(text + length - suffix_length, suffix) == 0;
}

/* ---- options -------------------------------------------------------------------------------------- */

static bool add_model(struct options *options, const char *name, size_t length, dipole_status *status)
{
    size_t model = 0;
    while (io_model_names[model] &&
           (strlen(io_model_names[model]) != length || strncmp(io_model_names[model], name, length) != 0))
        model++;
    if (!io_model_names[model])
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, NULL,
            "--model has \"%.*s\", expected dipole, better_dipole, multipole, beam or modes, "
            "with commas between",
            (int)(length < 100 ? length : 100), name);
    for (size_t i = 0; i < options->model_count; i++)
        if (options->models[i] == (dipole_model)model)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "--model has \"%s\" twice",
                               io_model_names[model]);
    options->models[options->model_count++] = (dipole_model)model;
    return true;
}

static bool parse_models(struct options *options, dipole_status *status)
{
    for (size_t i = 0; i < options->model_lists.count; i++)
        for (const char *p = options->model_lists.values[i];; p++) {
            const size_t length = strcspn(p, ",");
            if (!add_model(options, p, length, status))
                return false;
            p += length;
            if (*p == '\0')
                break;
        }
    return true;
}

/* What no single option can tell is wrong. */
static bool check_options(struct options *options, int material_count, dipole_status *status)
{
    if (!parse_models(options, status))
        return false;
    const size_t curve_count =
        (size_t)material_count * (options->model_count > 0 ? options->model_count : 1);
    if (!options->plot_path && (options->data_paths.count > 0 || options->is_per_incident))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s is given without --plot",
                           options->data_paths.count > 0 ? "--data" : "--per-incident");
    if (options->is_per_incident && options->data_paths.count == 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "--per-incident is given without --data");
    if (!options->plot_path)
        return true;
    if (!has_suffix(options->plot_path, ".svg") && !has_suffix(options->plot_path, ".png"))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--plot is \"%.200s\", expected a name that ends in .svg or .png",
                           options->plot_path);
    if (curve_count > INSPECTOR_CURVE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--plot would show %zu materials or models, expected at most %d", curve_count,
                           (int)INSPECTOR_CURVE_LIMIT);
    return options->data_paths.count <= INSPECTOR_DATA_LIMIT ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "--data is given %zu times, expected at most %d",
                       options->data_paths.count, (int)INSPECTOR_DATA_LIMIT);
}

/* ---- steps ---------------------------------------------------------------------------------------- */

/* One material with one model; model NULL for its own. */
static bool add_result(const struct options *options, const char *path, const struct io_material *material,
                       const dipole_model *model, struct job *job, dipole_status *status)
{
    const dipole_place place = { .source = path };
    struct inspector_result *const result = &job->results[job->result_count++];
    *result = (struct inspector_result){ .material = *material,
                                         .side = (dipole_side)options->side,
                                         .epsilon = options->epsilon,
                                         .radius_count = options->at_mm.count };
    memcpy(result->radii_mm, options->at_mm.values, sizeof result->radii_mm);
    if (model)
        result->material.model = *model;
    if (result->side == DIPOLE_FROM_BELOW && !inspector_has_far_face(result))
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "cannot be lit from below, expected layers of which the last has a thickness");
    dipole_status why = { 0 };
    return inspector_result_derive(result, &why) ||
           dipole_fail(status, why.code, &place, "%s%s%s%s", model ? "--model " : "",
                       model ? io_model_names[*model] : "", model ? ": " : "", why.message);
}

static bool read_material(const struct cli_tool *tool, const struct options *options, const char *path,
                          struct job *job, dipole_status *status)
{
    struct io_material material;
    if (!io_material_open(path, &material, status))
        return false;
    if (material.warning[0])
        cli_note(tool, &options->common, "%s: %s", path, material.warning);
    if (options->model_count == 0)
        return add_result(options, path, &material, NULL, job, status);
    for (size_t i = 0; i < options->model_count; i++)
        if (!add_result(options, path, &material, &options->models[i], job, status))
            return false;
    return true;
}

static bool read_data(const struct options *options, struct job *job, dipole_status *status)
{
    for (size_t i = 0; i < options->data_paths.count; i++) {
        const char *const path = options->data_paths.values[i], *const slash = strrchr(path, '/');
        if (!io_profile_read(path, &job->profiles[i], status))
            return false;
        job->data[i] =
            (struct inspector_data){ .label = slash ? slash + 1 : path, .profile = job->profiles[i] };
    }
    return true;
}

static bool write_plot(const struct options *options, const struct job *job, dipole_status *status)
{
    const struct inspector_figure figure = { .results = job->results,
                                             .result_count = job->result_count,
                                             .data = job->data,
                                             .data_count = options->data_paths.count,
                                             .is_per_incident = options->is_per_incident };
    void *data = NULL;
    size_t size = 0;
    const bool is_done =
        inspector_figure_draw(&figure, has_suffix(options->plot_path, ".png"), &data, &size, status) &&
        io_file_write(options->plot_path, data, size, status);
    free(data);
    return is_done;
}

static bool print_results(const struct job *job, bool is_json, dipole_status *status)
{
    if (!is_json) {
        for (size_t i = 0; i < job->result_count; i++) {
            if (i > 0)
                printf("\n");
            inspector_result_print(&job->results[i]);
        }
        return cli_stdout_finish(status);
    }
    char *text = NULL;
    if (!inspector_results_format_json(job->results, job->result_count, &text, status))
        return false;
    fputs(text, stdout);
    free(text);
    return cli_stdout_finish(status);
}

static bool run(const struct cli_tool *tool, const struct options *options, char **materials,
                int material_count, dipole_status *status)
{
    const size_t model_count = options->model_count > 0 ? options->model_count : 1;
    struct job job = { .results = calloc((size_t)material_count * model_count, sizeof *job.results) };
    bool is_done =
        job.results || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the results");
    for (int i = 0; i < material_count && is_done; i++)
        is_done = read_material(tool, options, materials[i], &job, status);
    is_done = is_done && read_data(options, &job, status) &&
              (!options->plot_path || write_plot(options, &job, status)) &&
              print_results(&job, options->common.json, status);
    for (size_t i = 0; i < job.result_count; i++)
        inspector_result_end(&job.results[i]);
    free(job.results);
    for (size_t i = 0; i < INSPECTOR_DATA_LIMIT; i++)
        io_profile_destroy(job.profiles[i]);
    return is_done;
}

int main(int argc, char **argv)
{
    static struct options options = { .epsilon = 0.01 };
    _Static_assert(sizeof options.at_mm.values == sizeof((struct inspector_result *)NULL)->radii_mm,
                   "every --at has room");
    static const char *const sides[] = { "above", "below", NULL };
    const struct cli_option table[] = {
        { .name = "epsilon",
          .letter = 'e',
          .kind = CLI_NUMBER,
          .target = &options.epsilon,
          .argument = "E",
          .min = 1e-9,
          .max = 0.5,
          .help =
              "Part of the light left beyond r_max, and aliasing at splat_spacing; 1e-9 to 0.5, default "
              "0.01." },
        { .name = "at",
          .kind = CLI_NUMBERS,
          .target = &options.at_mm,
          .argument = "R,R,...",
          .min = 0,
          .max = DIPOLE_SIGMA_MAX_PER_MM,
          .help = "Distances in mm at which the profile is printed; default 1, 2, 5 per decade." },
        { .name = "plot",
          .letter = 'p',
          .kind = CLI_TEXT,
          .target = &options.plot_path,
          .argument = "FILE",
          .help = "Draw the profiles as FILE.svg or FILE.png, of up to 4 materials and models together." },
        { .name = "model",
          .letter = 'm',
          .kind = CLI_TEXTS,
          .target = &options.model_lists,
          .argument = "NAME,...",
          .help = "Show the materials by these models in place of their own, with the same coefficients: "
                  "dipole, better_dipole, multipole, beam, modes; may be repeated." },
        { .name = "lit-from",
          .kind = CLI_CHOICE,
          .target = &options.side,
          .argument = "SIDE",
          .choices = sides,
          .help =
              "above or below: the side the light comes from; below needs a last layer that ends. Default "
              "above." },
        { .name = "data",
          .letter = 'd',
          .kind = CLI_TEXTS,
          .target = &options.data_paths,
          .argument = "FILE.csv",
          .help =
              "Draw this measured or simulated profile as points into the plot; may be repeated, 4 times "
              "at most." },
        { .name = "per-incident",
          .kind = CLI_FLAG,
          .target = &options.is_per_incident,
          .help =
              "The data are per light that falls on the surface, as those of MCML are, not per light that "
              "enters: divide them by 1 - Rsp of the first material." },
        { .name = NULL },
    };
    const struct cli_tool tool = {
        .name = "dipole",
        .summary = "Show every quantity that follows from a translucent material",
        .usage = "MATERIAL.json... [--model NAME,...] [--epsilon E] [--at R,R,...] [--plot FILE.svg|png] "
                 "[--data FILE.csv]",
        .details =
            "MATERIAL.json is a file or the name of a bundled material, such as marble.\n\n"
            "mean_free_path is 1/(sigma_a + sigma_s'), diffuse_mean_free_path is 1/sigma_tr: renderers "
            "call either of them radius. rd is the diffuse reflectance profile: power leaving per mm^2 "
            "for one unit of power entering; diffuse_reflectance is its integral, r_max the radius "
            "beyond which the part epsilon of it lies, splat_spacing the largest distance of light "
            "samples. td and diffuse_transmittance are the same for light that leaves by the far face of "
            "a material with layers; what leaves without scattering is counted apart.\n\n"
            "FILE.csv has a header line and the columns r_mm,rd_per_mm2[,sem] or, for means over rings, "
            "r_lo_mm,r_hi_mm,rd_per_mm2[,sem]; tables of MCML runs with R_per_mm2 and R_sem_per_mm2 are "
            "read as well. Lines that begin with # are comments.\n\n"
            "  dipole marble --model dipole,beam --plot models.svg\n"
            "  dipole layered/marble_slab --lit-from below --at 0,1,5\n",
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
    if (!check_options(&options, operand_count, &status))
        return cli_report(&tool, &status, EXIT_USAGE);
    if (!run(&tool, &options, operands, operand_count, &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
