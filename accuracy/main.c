/* accuracy: what accuracy costs in time. */
#include "accuracy/calibrate.h"
#include "accuracy/page.h"
#include "accuracy/simulation.h"
#include "cli/cli.h"
#include "io/file.h"
#include "io/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char details[] =
    "Draws the scene, by default a bundled one, with every knob of the renderer "
    "turned from coarse to fine, all others "
    "fine, and with the automatic choice; measures each picture against the "
    "converged reference, and how long it "
    "takes. DIR/report.html shows it on one page, DIR/accuracy.json has the "
    "numbers. The scene's coefficients are fitted to the reference, with few and many pixels and "
    "radii. Pictures are timed in turns, so "
    "that noise hits all alike. What was interrupted is taken up again.\n"
    "\n"
    "  accuracy -o report\n"
    "  accuracy scenes/layers.json -o layers --size 400x300\n"
    "  accuracy --calibrate\n"
    "  accuracy --monte-carlo marble --photons 1e7\n";

struct options {
    struct cli_common common;
    const char *folder;
    struct cli_texts allowed_paths;
    double repeat_count;
    int size_px[2];
    double photon_count, seed, g;
    bool is_quick, is_calibrating, is_simulating;
};

static volatile sig_atomic_t stop;

/* The first Ctrl-C ends it with what there is, a second one the program. */
static void handle_interrupt(int number)
{
    stop = 1;
    signal(number, SIG_DFL);
}

static void show(void *context, const char *what, double fraction)
{
    cli_progress_show(context, what, fraction);
}

static bool measure(const struct cli_tool *tool, const struct options *options,
                    struct accuracy_subject *subject, dipole_status *status)
{
    struct accuracy_sweep sweep;
    struct cli_progress bar;
    const int repeat_count = options->is_quick ? 2 : (int)options->repeat_count;
    const struct render_progress progress = { .show = show, .context = &bar };
    cli_progress_start(&bar, tool, &options->common);
    bool done = accuracy_sweep_init(subject, options->is_quick, repeat_count, &sweep, status) &&
                accuracy_sweep_run(&sweep, options->folder, &stop, &progress, status);
    if (done && stop)
        cli_note(tool, &options->common,
                 "interrupted: run it again to go on; the report has what there is");
    if (done && !stop && !options->is_quick)
        done = accuracy_sweep_fit(&sweep, &stop, options->folder, &progress, status) &&
               accuracy_sweep_climb(&sweep, &stop, options->folder, &progress, status);
    done = done && accuracy_page_write(&sweep, options->folder, status);
    cli_progress_show(&bar, "done", 1);
    if (done && !options->common.json)
        printf("%s/report.html: %zu points\n", options->folder, sweep.point_count);
    accuracy_sweep_end(&sweep);
    return done;
}

static bool run(const struct cli_tool *tool, const struct options *options, const char *scene_path,
                dipole_status *status)
{
    char bundled[4096];
    const int usual_px[2] = { options->is_quick ? 160 : 400, options->is_quick ? 120 : 300 };
    const int *const size_px = options->size_px[0] > 0 ? options->size_px : usual_px;
    const struct io_scene_options reading = { .allowed_paths = options->allowed_paths.values,
                                              .allowed_path_count = options->allowed_paths.count,
                                              .width_px = size_px[0],
                                              .height_px = size_px[1] };
    struct accuracy_subject subject;
    if (!scene_path && !io_data_path("scenes/knot.json", bundled, sizeof bundled, status))
        return false;
    signal(SIGINT, handle_interrupt);
    const bool done =
        accuracy_subject_init(scene_path ? scene_path : bundled, &reading, &subject, status) &&
        io_folder_make(options->folder, status) && measure(tool, options, &subject, status);
    accuracy_subject_end(&subject);
    return done;
}

static bool print_json(json_t *result, dipole_status *status)
{
    char *const text = result ? io_json_format(result) : NULL;
    if (text)
        fputs(text, stdout);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result");
    json_decref(result);
    const bool done = text != NULL;
    free(text);
    return done;
}

static void print_effect(const struct accuracy_effect_times *effect)
{
    printf("%-22s %4zu pictures  x %-6.3g + %4.1f ms, %5.1f at first", effect->name, effect->count,
           effect->scale, effect->fixed_ms, effect->start_ms);
    if (isnan(effect->median_error))
        printf("  too short to tell\n");
    else
        printf("  predicted to within %.0f %%\n", 100 * effect->median_error);
}

static bool print_calibration(const struct accuracy_calibration *calibration, const char *path,
                              bool is_json, dipole_status *status)
{
    json_t *const effects = json_array();
    for (size_t i = 0; i < calibration->effect_count; i++) {
        const struct accuracy_effect_times *const effect = &calibration->effects[i];
        if (!is_json)
            print_effect(effect);
        json_array_append_new(
            effects,
            json_pack("{s:s, s:I, s:f, s:f, s:f, s:o}", "name", effect->name, "pictures",
                      (json_int_t)effect->count, "fixed_ms", effect->fixed_ms, "scale", effect->scale,
                      "start_ms", effect->start_ms, "median_error",
                      isnan(effect->median_error) ? json_null() : json_real(effect->median_error)));
    }
    json_t *const result =
        json_pack("{s:s, s:o, s:I, s:f, s:f, s:f}", "calibration", path, "effects", effects, "pictures",
                  (json_int_t)calibration->picture_count, "median_error", calibration->median_error,
                  "largest_error", calibration->largest_error, "unseen_error", calibration->unseen_error);
    if (is_json)
        return print_json(result, status);
    json_decref(result);
    printf(
        "%s: %zu pictures are predicted to within %.0f %% in half of them, %.0f %% at most; to within %.0f "
        "%% in half of them by what pictures of other scenes tell\n",
        path, calibration->picture_count, 100 * calibration->median_error, 100 * calibration->largest_error,
        100 * calibration->unseen_error);
    return true;
}

static bool simulate(const struct options *options, const char *material, dipole_status *status)
{
    const struct accuracy_simulation_options request = {
        .material = material,
        .g = isnan(options->g) ? 0 : options->g,
        .run = { .photon_count = options->photon_count > 0 ? (size_t)options->photon_count : 1000000,
                 .seed = options->seed >= 0 ? (uint64_t)options->seed : 1 }
    };
    struct accuracy_simulation *const simulation = calloc(1, sizeof *simulation);
    if (!simulation)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a simulation");
    bool done = accuracy_simulation_run(&request, simulation, status);
    if (done && options->common.json)
        done = print_json(accuracy_simulation_to_json(simulation), status);
    else if (done)
        accuracy_simulation_print(simulation, stdout);
    free(simulation);
    return done && cli_stdout_finish(status);
}

static bool calibrate(const struct cli_tool *tool, const struct options *options, dipole_status *status)
{
    struct cli_progress bar;
    struct accuracy_calibration calibration;
    char path[4096];
    const struct render_progress progress = { .show = show, .context = &bar };
    cli_progress_start(&bar, tool, &options->common);
    const bool done = accuracy_calibrate(&progress, &calibration, status) &&
                      accuracy_calibration_keep(&calibration, path, sizeof path, status);
    cli_progress_show(&bar, "done", 1);
    return done && print_calibration(&calibration, path, options->common.json, status) &&
           cli_stdout_finish(status);
}

int main(int argc, char **argv)
{
    struct options options = { .repeat_count = 5, .seed = -1, .g = (double)NAN };
    const struct cli_option table[] = {
        { .name = "output",
          .letter = 'o',
          .kind = CLI_TEXT,
          .target = &options.folder,
          .argument = "DIR",
          .help = "Folder for report.html and accuracy.json; made if it is not there." },
        { .name = "size",
          .kind = CLI_SIZE,
          .target = options.size_px,
          .argument = "WxH",
          .help = "Pixels of the pictures, default 400x300, with --quick 160x120.",
          .min = 16,
          .max = 4096 },
        { .name = "repeat",
          .kind = CLI_NUMBER,
          .target = &options.repeat_count,
          .argument = "N",
          .help = "Pictures that are timed for each point, 1 to 32, default 5; two "
                  "where one takes over 3 s.",
          .min = 1,
          .max = ACCURACY_REPEAT_LIMIT },
        { .name = "quick",
          .kind = CLI_FLAG,
          .target = &options.is_quick,
          .help = "Fewer knobs and points, two pictures each: under a minute." },
        { .name = "calibrate",
          .kind = CLI_FLAG,
          .target = &options.is_calibrating,
          .help = "Measure how long effects take on this machine, and keep it for predictions of all "
                  "programs: a minute or two, without other work beside it." },
        { .name = "monte-carlo",
          .kind = CLI_FLAG,
          .target = &options.is_simulating,
          .help = "Follow photons through the layers of MATERIAL.json, or a bundled material, instead: "
                  "where they leave, with standard errors." },
        { .name = "photons",
          .kind = CLI_NUMBER,
          .target = &options.photon_count,
          .argument = "N",
          .help = "How many, for each channel: 1000 to 1e9, default 1e6.",
          .min = 1000,
          .max = 1e9 },
        { .name = "seed",
          .kind = CLI_NUMBER,
          .target = &options.seed,
          .argument = "S",
          .help = "Whole number from 0 to 2^53 that their ways follow from, default 1.",
          .min = 0,
          .max = 9007199254740992.0 },
        { .name = "g",
          .kind = CLI_NUMBER,
          .target = &options.g,
          .argument = "G",
          .help = "Mean cosine of scattering, -0.99 to 0.99, default 0; reduced scattering stays the "
                  "material's.",
          .min = -0.99,
          .max = 0.99 },
        { .name = "allow-path",
          .kind = CLI_TEXTS,
          .target = &options.allowed_paths,
          .argument = "DIR",
          .help = "Let the scene read files of that folder, too. May be repeated." },
        { .name = NULL },
    };
    const struct cli_tool tool = { .name = "accuracy",
                                   .summary = "what accuracy costs in time, as a page with plots",
                                   .usage = "[SCENE.json] -o DIR [OPTION]...\n"
                                            "       --calibrate\n"
                                            "       --monte-carlo MATERIAL.json [--photons N]",
                                   .details = details,
                                   .options = table,
                                   .operand_min = 0,
                                   .operand_max = 1 };
    char **operands;
    int operand_count;
    dipole_status status = { .code = DIPOLE_OK };
    cli_start();
    const enum cli_outcome outcome =
        cli_parse(&tool, argc, argv, &options.common, &operands, &operand_count);
    if (outcome != CLI_RUN)
        return outcome == CLI_STOP_DONE ? EXIT_DONE : EXIT_USAGE;
    if (options.is_simulating && (options.folder || options.is_calibrating || operand_count == 0))
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL,
                    "--monte-carlo takes a MATERIAL.json, and no --output or --calibrate");
    else if (!options.is_simulating && (options.photon_count > 0 || options.seed >= 0 || !isnan(options.g)))
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL,
                    "--photons, --seed and --g are of --monte-carlo alone");
    else if (options.is_calibrating && (options.folder || operand_count > 0))
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "--calibrate takes no scene and no --output");
    else if (!options.is_calibrating && !options.is_simulating && !options.folder)
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "no --output (-o) DIR was given; try --help");
    if (status.code != DIPOLE_OK)
        return cli_report(&tool, &status, EXIT_USAGE);
    const char *const operand = operand_count > 0 ? operands[0] : NULL;
    if (options.is_simulating    ? !simulate(&options, operand, &status)
        : options.is_calibrating ? !calibrate(&tool, &options, &status)
                                 : !run(&tool, &options, operand, &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
