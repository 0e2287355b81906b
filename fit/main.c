/* fit: the scattering coefficients of a material from pictures of it and other measurements. */
#include "fit/batch.h"
#include "fit/job.h"

#include <stdio.h>
#include <string.h>

static const char details[] =
    "SCENE.json says where camera, lights and objects are; its material gives eta. TARGET is a picture of "
    "that scene, of the camera's size, or two, three, ... times as large: EXR, HDR, TIFF, PNG or JPEG. "
    "Several pairs are fitted together: "
    "other "
    "views, other lights, front and back. MATERIAL.json will be a material like any other, with a block "
    "\"fit\" that holds the 95 % intervals.\n"
    "\n"
    "What is free besides the coefficients is said by --free; where a scene's light has no stated "
    "brightness, the exposure is free by itself. Of a material with layers the first is sought, with its "
    "thickness; the others are known. docs/fit.md says how to take pictures that tell a material.\n"
    "\n"
    "  fit scenes/knot.json knot.exr --start materials/skin1.json -o found.json --report found\n"
    "  fit front.json front.jpg back.json back.jpg --free exposure,white-balance -o wax.json\n"
    "  fit --profile R.csv --eta 1.4 -o milk.json\n"
    "\n" FIT_BATCH_DETAILS;

static volatile sig_atomic_t stop;

/* The first Ctrl-C ends the fit with the best so far, a second one the program. */
static void handle_interrupt(int number)
{
    stop = 1;
    signal(number, SIG_DFL);
}

static bool run(const struct cli_tool *tool, const struct fit_job_options *options, dipole_status *status)
{
    struct fit_job job;
    if (signal(SIGINT, handle_interrupt) == SIG_IGN)
        signal(SIGINT, SIG_IGN); /* as a row of a batch, which is ended by another signal */
    bool done = fit_job_read(tool, options, &job, status);
    done = done && fit_job_run(&job, &stop, status) && fit_job_write(&job, status);
    if (done && !job.result.has_converged) {
        const dipole_place place = { .source = options->photo_paths.count > 0
                                                   ? options->photo_paths.values[0]
                                                   : options->material_path };
        done = dipole_fail(status, DIPOLE_NOT_CONVERGED, &place, "the fit %s; %s has the best so far",
                           job.result.is_interrupted ? "was interrupted" : "did not converge",
                           options->material_path);
    }
    fit_job_destroy(&job);
    return done;
}

/* What of the options contradicts itself; NULL: nothing. */
static const char *refusal_of(const struct fit_job_options *options, int operand_count)
{
    const size_t pair_count = (size_t)operand_count / 2;
    const size_t other_count = options->profile_paths.count + options->totals_paths.count;
    const bool has_target = operand_count > 0 || other_count > 0;
    const struct {
        bool is_wrong;
        const char *text;
    } rules[] = {
        { operand_count % 2 != 0, "expected SCENE.json and TARGET in pairs" },
        { !has_target, "no target was given: SCENE.json TARGET, --profile or --totals" },
        { !options->material_path, "no --output (-o) MATERIAL.json was given" },
        { pair_count + other_count > FIT_TARGET_LIMIT, "expected at most 16 targets" },
        { options->mask_paths.count > pair_count, "expected at most one --mask for each TARGET" },
        { options->camera_names.count > 1 && options->camera_names.count != pair_count,
          "expected one --camera, or one for each TARGET" },
        { pair_count == 0 && !(options->eta > 0) && !options->start_path,
          "nothing says what eta is: expected --eta or --start" },
        { pair_count > 0 && options->eta > 0,
          "--eta cannot be used with a scene, whose material states it" },
        { pair_count > 0 && options->profile_paths.count % FIT_CHANNEL_COUNT != 0,
          "expected a --profile for each of red, green and blue beside pictures" },
        { pair_count == 0 && options->profile_paths.count > 1 &&
              options->profile_paths.count % FIT_CHANNEL_COUNT != 0,
          "expected one --profile, or one for each of red, green and blue" },
    };
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++) {
        if (rules[i].is_wrong)
            return rules[i].text;
    }
    return NULL;
}

int main(int argc, char **argv)
{
    struct fit_job_options options = { .model = -1 };
    struct fit_batch_request batch = { 0 };
    const struct cli_option table[] = {
        { .name = "output",
          .letter = 'o',
          .kind = CLI_TEXT,
          .target = &options.material_path,
          .argument = "MATERIAL.json",
          .help = "File to write the material to (required); with --batch the folder for all of them." },
        { .name = "profile",
          .kind = CLI_TEXTS,
          .target = &options.profile_paths,
          .argument = "R.csv",
          .help =
              "Fit a radial profile: columns r_mm or r_lo_mm,r_hi_mm, then rd_per_mm2 (per light that "
              "entered) or R_per_mm2 (that arrives), perhaps sem; given three times: red, green, blue." },
        { .name = "totals",
          .kind = CLI_TEXTS,
          .target = &options.totals_paths,
          .argument = "TOTALS.csv",
          .help =
              "Fit what slabs reflect and let through in all: columns thickness_mm, and total_ or diffuse_ "
              "reflectance and transmittance." },
        { .name = "eta",
          .kind = CLI_NUMBER,
          .target = &options.eta,
          .argument = "ETA",
          .min = DIPOLE_ETA_MIN,
          .max = DIPOLE_ETA_MAX,
          .help = "Index of refraction inside over outside, where no scene says it." },
        { .name = "model",
          .kind = CLI_CHOICE,
          .target = &options.model,
          .argument = "MODEL",
          .choices = io_model_names,
          .help = "How light spreads under the surface (default: what a picture by render was drawn with, "
                  "else what the scene's or the start's material states; else modes for totals alone, else "
                  "beam "
                  "unless modes or dipole fit clearly better)." },
        { .name = "start",
          .kind = CLI_TEXT,
          .target = &options.start_path,
          .argument = "MATERIAL.json",
          .help = "Begin the search at these coefficients of the sought layer, a file or a bundled name "
                  "such as "
                  "skin1 (default: the scene's)." },
        { .name = "free",
          .kind = CLI_CHOICES,
          .target = &options.free,
          .argument = "WHAT,...",
          .choices = fit_free_names,
          .help = "Fit these too: exposure (a factor for each picture and profile), white-balance (red and "
                  "blue "
                  "of all pictures), ambient (light from all around), "
                  "black-level (default: nothing)." },
        { .name = "mask",
          .kind = CLI_TEXTS,
          .target = &options.mask_paths,
          .argument = "PICTURE",
          .help =
              "Fit only where this picture is brighter than half, code 128 of 255; one for each TARGET, in "
              "order." },
        { .name = "linear",
          .kind = CLI_FLAG,
          .target = &options.is_linear,
          .help = "Integers in pictures are proportional to light (default: they are sRGB)." },
        { .name = "camera",
          .kind = CLI_TEXTS,
          .target = &options.camera_names,
          .argument = "NAME",
          .help = "Which of the scene's cameras took the picture; one for all, or one for each TARGET." },
        { .name = "layer",
          .kind = CLI_NUMBER,
          .target = &options.layer,
          .argument = "N",
          .min = 1,
          .max = DIPOLE_LAYER_LIMIT,
          .help = "Which layer is sought, from the top (default: 1)." },
        { .name = "known-thickness",
          .kind = CLI_FLAG,
          .target = &options.is_thickness_known,
          .help = "Do not seek the layer's thickness: it is what the material says." },
        { .name = "report",
          .kind = CLI_TEXT,
          .target = &options.report_path,
          .argument = "DIR",
          .help = "Write a page about the fit into this folder: pictures, differences, masks, profiles." },
        { .name = FIT_BATCH_OPTION,
          .kind = CLI_TEXT,
          .target = &batch.list_path,
          .argument = "LIST.csv",
          .help = "Do all the fits of a list, a row each; see below." },
        { .name = FIT_BATCH_SHARD_OPTION,
          .kind = CLI_TEXT,
          .target = &batch.shard,
          .argument = "I/N",
          .help = "Do only the rows of a batch that belong to part I of N." },
        { .name = FIT_BATCH_ROW_SECONDS_OPTION,
          .kind = CLI_NUMBER,
          .target = &batch.row_seconds,
          .argument = "S",
          .min = 0.001,
          .max = 1e9,
          .help = "End a row of a batch that takes longer than this, in s (default: no limit)." },
        { .name = "allow-path",
          .kind = CLI_TEXTS,
          .target = &options.allowed_paths,
          .argument = "DIR",
          .help = "Let the scene refer to files under this folder, too; may be repeated." },
        { .name = NULL },
    };
    const struct cli_tool tool = { .name = "fit",
                                   .summary = "recover a material's scattering coefficients from pictures "
                                              "of it, or from its profile",
                                   .usage = "SCENE.json TARGET [SCENE.json TARGET ...] -o MATERIAL.json\n"
                                            "--profile R.csv --eta ETA -o MATERIAL.json\n"
                                            "--totals TOTALS.csv --eta ETA -o MATERIAL.json\n"
                                            "--batch LIST.csv -o FOLDER [--shard I/N]",
                                   .details = details,
                                   .options = table,
                                   .operand_min = 0,
                                   .operand_max = 2 * FIT_TARGET_LIMIT };
    char **operands;
    int operand_count;
    cli_start();
    const enum cli_outcome outcome =
        cli_parse(&tool, argc, argv, &options.common, &operands, &operand_count);
    if (outcome != CLI_RUN)
        return outcome == CLI_STOP_DONE ? EXIT_DONE : EXIT_USAGE;
    if (fit_batch_is_asked(&batch)) {
        batch.folder = options.material_path;
        return fit_batch_run(&tool, &options.common, argc, argv, &batch);
    }
    dipole_status status = { 0 };
    const char *const refusal = refusal_of(&options, operand_count);
    if (refusal) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "%s; try --help", refusal);
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    for (int i = 0; i + 1 < operand_count; i += 2) {
        options.scene_paths.values[options.scene_paths.count++] = operands[i];
        options.photo_paths.values[options.photo_paths.count++] = operands[i + 1];
    }
    return run(&tool, &options, &status) ? EXIT_DONE : cli_report(&tool, &status, EXIT_FAILED);
}
