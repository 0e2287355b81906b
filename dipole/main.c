/* dipole: print or plot everything that follows from a material. */
#include "cli/cli.h"
#include "dipole/inspect.h"
#include "io/file.h"

#include <stdlib.h>
#include <string.h>

struct options {
    struct cli_common common;
    double epsilon;
    struct cli_numbers at_mm;
    const char *plot_path;
};

static bool has_suffix(const char *text, const char *suffix)
{
    const size_t length = strlen(text), suffix_length = strlen(suffix);
    return length > suffix_length && strcmp(text + length - suffix_length, suffix) == 0;
}

static bool write_plot(const struct inspector_result *result, const char *path, dipole_status *status)
{
    void *data = NULL;
    size_t size = 0;
    const bool is_done = inspector_result_draw(result, has_suffix(path, ".png"), &data, &size, status) &&
                         io_file_write(path, data, size, status);
    free(data);
    return is_done;
}

static bool print_result(const struct inspector_result *result, bool is_json, dipole_status *status)
{
    if (!is_json) {
        inspector_result_print(result);
        return cli_stdout_finish(status);
    }
    char *text = NULL;
    if (!inspector_result_format_json(result, &text, status))
        return false;
    fputs(text, stdout);
    free(text);
    return cli_stdout_finish(status);
}

static bool run(const struct cli_tool *tool, const struct options *options, const char *material,
                dipole_status *status)
{
    struct inspector_result *const result = calloc(1, sizeof *result);
    if (!result)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory");
    result->epsilon = options->epsilon;
    result->radius_count = options->at_mm.count;
    memcpy(result->radii_mm, options->at_mm.values, sizeof result->radii_mm);
    bool is_done = io_material_open(material, &result->material, status);
    if (is_done && result->material.warning[0])
        cli_note(tool, &options->common, "%s: %s", material, result->material.warning);
    is_done = is_done && inspector_result_derive(result, status) &&
              (!options->plot_path || write_plot(result, options->plot_path, status)) &&
              print_result(result, options->common.json, status);
    free(result);
    return is_done;
}

int main(int argc, char **argv)
{
    static struct options options = { .epsilon = 0.01 };
    _Static_assert(sizeof options.at_mm.values == sizeof((struct inspector_result *)NULL)->radii_mm,
                   "every --at has room");
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
          .help = "Draw the profile as FILE.svg or FILE.png." },
        { .name = NULL },
    };
    const struct cli_tool tool = {
        .name = "dipole",
        .summary = "Show every quantity that follows from a translucent material",
        .usage = "MATERIAL.json [--epsilon E] [--at R,R,...] [--plot FILE.svg|png]",
        .details =
            "MATERIAL.json is a file or the name of a bundled material, such as marble.\n\n"
            "mean_free_path is 1/(sigma_a + sigma_s'), diffuse_mean_free_path is 1/sigma_tr: renderers "
            "call either of them radius. rd is the diffuse reflectance profile: power leaving per mm^2 "
            "for one unit of power entering; diffuse_reflectance is its integral, r_max the radius "
            "beyond which the part epsilon of it lies, splat_spacing the largest distance of light "
            "samples.",
        .options = table,
        .operand_min = 1,
        .operand_max = 1,
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
    if (options.plot_path && !has_suffix(options.plot_path, ".svg") &&
        !has_suffix(options.plot_path, ".png")) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL,
                    "--plot is \"%.200s\", expected a name that ends in .svg or "
                    ".png",
                    options.plot_path);
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    if (!run(&tool, &options, operands[0], &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
