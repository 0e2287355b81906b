/* fit: the scattering coefficients of a material from a picture of it. */
#include "cli/cli.h"
#include "fit/picture.h"
#include "io/file.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

struct options {
    struct cli_common common;
    const char *scene_path, *picture_path, *material_path, *start_path;
    struct cli_texts allowed_paths;
};

/* What is read before, and told after. */
struct job {
    struct io_scene *scene;
    struct io_image *picture;
    struct io_material
        material; /* eta and fdr of the scene's, first with the start's sigmas, then those found */
    struct fit_picture_result result;
    double seconds;
};

static const char details[] =
    "SCENE.json says where camera, lights and objects are; its material gives eta. TARGET.exr is the "
    "picture "
    "of that scene, linear radiance in the scene's units, of the camera's size. MATERIAL.json will be a "
    "material like any other, with a block \"fit\" that holds the 95 % intervals.\n"
    "\n"
    "Pictures written by render say how far their splats reach and how exact their table is. Of others, 1 "
    "% of "
    "uncertain exposure is taken into the intervals.\n"
    "\n"
    "  fit scenes/knot.json knot.exr --start materials/skin1.json -o found.json\n";

/* ---- steps ------------------------------------------------------------------------------------------- */

static bool job_read(const struct cli_tool *tool, const struct options *options, struct job *job,
                     dipole_status *status)
{
    const struct io_scene_options scene_options = { .allowed_paths = options->allowed_paths.values,
                                                    .allowed_path_count = options->allowed_paths.count };
    struct io_material start;
    if (!io_file_check_writable(options->material_path, status) ||
        !io_scene_read(options->scene_path, &scene_options, &job->scene, status) ||
        !io_exr_read(options->picture_path, &job->picture, status))
        return false;
    const dipole_place place = { .source = options->scene_path };
    if (job->scene->object_count == 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "the scene has no object to fit");
    if (job->scene->has_environment)
        return dipole_fail(
            status, DIPOLE_NOT_SUPPORTED, &place,
            "the scene has an environment, which cannot be fitted to, expected lights alone");
    job->material = job->scene->objects[0].material;
    if (!io_material_check_classical(&job->material, status))
        return false;
    if (!options->start_path)
        return true;
    if (!io_material_open(options->start_path, &start, status) ||
        !io_material_check_classical(&start, status))
        return false;
    if (start.warning[0])
        cli_note(tool, &options->common, "%s: %s", options->start_path, start.warning);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        job->material.layers[c][0].medium.sigma_a_per_mm = start.layers[c][0].medium.sigma_a_per_mm;
        job->material.layers[c][0].medium.sigma_s_prime_per_mm =
            start.layers[c][0].medium.sigma_s_prime_per_mm;
    }
    return true;
}

static void show_progress(void *context, const char *what, double fraction)
{
    cli_progress_show(context, what, fraction);
}

static bool job_fit(const struct cli_tool *tool, const struct options *options, struct job *job,
                    dipole_status *status)
{
    struct cli_progress progress;
    cli_progress_start(&progress, tool, &options->common);
    const double start_s = cli_now_s();
    dipole_medium start[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        start[c] = job->material.layers[c][0].medium;
    const struct fit_picture_request request = {
        .scene = job->scene,
        .picture = job->picture,
        .picture_path = options->picture_path,
        .start = start,
        .progress = { .show = show_progress, .context = &progress },
    };
    const bool done = fit_picture(&request, &job->result, status);
    cli_progress_show(&progress, "done", 1.0);
    job->seconds = cli_now_s() - start_s;
    if (!done)
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        job->material.layers[c][0].medium.sigma_a_per_mm = job->result.channels[c].sigma_a_per_mm;
        job->material.layers[c][0].medium.sigma_s_prime_per_mm =
            job->result.channels[c].sigma_s_prime_per_mm;
    }
    if (job->result.note[0])
        cli_note(tool, &options->common, "%s", job->result.note);
    return true;
}

/* ---- results ------------------------------------------------------------------------------------------
 */

/* The "fit" block; NULL without memory. The caller ends it with json_decref. */
static json_t *fit_block(const struct job *job)
{
    json_t *channels = json_array();
    for (int c = 0; channels && c < FIT_CHANNEL_COUNT; c++) {
        const struct fit_estimate *channel = &job->result.channels[c];
        json_t *entry =
            json_pack("{s:f, s:[f, f], s:f, s:[f, f], s:b, s:s}", "sigma_a_per_mm", channel->sigma_a_per_mm,
                      "sigma_a_ci95", channel->sigma_a_ci95[0], channel->sigma_a_ci95[1],
                      "sigma_s_prime_per_mm", channel->sigma_s_prime_per_mm, "sigma_s_prime_ci95",
                      channel->sigma_s_prime_ci95[0], channel->sigma_s_prime_ci95[1], "identifiable",
                      channel->is_identifiable, "note", channel->note);
        if (!entry || json_array_append_new(channels, entry) != 0) {
            json_decref(channels);
            channels = NULL;
        }
    }
    return channels
               ? json_pack("{s:b, s:f, s:o, s:f}", "converged", job->result.has_converged, "rms_residual",
                           job->result.rms_residual, "channels", channels, "seconds", job->seconds)
               : NULL;
}

static bool job_write(const struct options *options, struct job *job, dipole_status *status)
{
    char name[sizeof job->material.name + 16];
    snprintf(name, sizeof name, "%s, fitted", job->material.name);
    snprintf(job->material.name, sizeof job->material.name, "%.*s", (int)sizeof job->material.name - 1,
             name);
    snprintf(job->material.source, sizeof job->material.source,
             "recovered from a picture by fit, libdipole %s", dipole_version());
    json_t *block = fit_block(job);
    const bool done = block ? io_material_write(options->material_path, &job->material, block, status)
                            : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result");
    json_decref(block);
    return done;
}

static bool print_json(const struct job *job, dipole_status *status)
{
    json_t *block = fit_block(job);
    char *text = block ? io_json_format(block) : NULL;
    json_decref(block);
    if (!text)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result");
    fputs(text, stdout);
    free(text);
    return true;
}

static void print_table(const struct job *job)
{
    const struct fit_picture_result *result = &job->result;
    printf("channel     sigma_a                  95 %%    sigma_s'                  95 %%\n");
    printf("               1/mm                  1/mm        1/mm                  1/mm\n");
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        const struct fit_estimate *channel = &result->channels[c];
        char intervals[2][32];
        snprintf(intervals[0], sizeof intervals[0], "[%.4g, %.4g]", channel->sigma_a_ci95[0],
                 channel->sigma_a_ci95[1]);
        snprintf(intervals[1], sizeof intervals[1], "[%.4g, %.4g]", channel->sigma_s_prime_ci95[0],
                 channel->sigma_s_prime_ci95[1]);
        printf("%-7s %11.4g  %20s  %10.4g  %20s\n", io_channel_names[c], channel->sigma_a_per_mm,
               intervals[0], channel->sigma_s_prime_per_mm, intervals[1]);
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (result->channels[c].note[0])
            printf("%s: %s\n", io_channel_names[c], result->channels[c].note);
    }
    printf("rms residual %.2g %%; %zu of %zu pixels, %zu light samples %.3g mm apart, %d round%s, %.1f s\n",
           100.0 * result->rms_residual, result->pixel_count, result->usable_pixel_count,
           result->sample_count, result->spacing_mm, result->round_count,
           result->round_count == 1 ? "" : "s", job->seconds);
}

static bool job_print(const struct options *options, const struct job *job, dipole_status *status)
{
    if (options->common.json) {
        if (!print_json(job, status))
            return false;
    } else {
        print_table(job);
    }
    return cli_stdout_finish(status);
}

static bool run(const struct cli_tool *tool, const struct options *options, dipole_status *status)
{
    struct job job = { 0 };
    bool done = job_read(tool, options, &job, status) && job_fit(tool, options, &job, status) &&
                job_write(options, &job, status) && job_print(options, &job, status);
    if (done && !job.result.has_converged) {
        const dipole_place place = { .source = options->picture_path };
        done = dipole_fail(status, DIPOLE_NOT_CONVERGED, &place,
                           "the fit did not converge; %s says where it stopped", options->material_path);
    }
    io_image_destroy(job.picture);
    io_scene_destroy(job.scene);
    return done;
}

int main(int argc, char **argv)
{
    struct options options = { 0 };
    const struct cli_option table[] = {
        { .name = "output",
          .letter = 'o',
          .kind = CLI_TEXT,
          .target = &options.material_path,
          .argument = "MATERIAL.json",
          .help = "File to write the material to (required)." },
        { .name = "start",
          .kind = CLI_TEXT,
          .target = &options.start_path,
          .argument = "MATERIAL.json",
          .help = "Begin the search at the coefficients of this material, a file or a bundled name such as "
                  "skin1 (default: the scene's)." },
        { .name = "allow-path",
          .kind = CLI_TEXTS,
          .target = &options.allowed_paths,
          .argument = "DIR",
          .help = "Let the scene refer to files under this folder, too; may be repeated." },
        { .name = NULL },
    };
    const struct cli_tool tool = { .name = "fit",
                                   .summary = "recover a material's scattering coefficients from a picture",
                                   .usage =
                                       "SCENE.json TARGET.exr -o MATERIAL.json [--start MATERIAL.json]",
                                   .details = details,
                                   .options = table,
                                   .operand_min = 2,
                                   .operand_max = 2 };
    char **operands;
    int operand_count;
    cli_start();
    const enum cli_outcome outcome =
        cli_parse(&tool, argc, argv, &options.common, &operands, &operand_count);
    if (outcome != CLI_RUN)
        return outcome == CLI_STOP_DONE ? EXIT_DONE : EXIT_USAGE;
    options.scene_path = operands[0];
    options.picture_path = operands[1];
    dipole_status status = { 0 };
    if (!options.material_path) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL,
                    "no --output (-o) MATERIAL.json was given; try --help");
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    return run(&tool, &options, &status) ? EXIT_DONE : cli_report(&tool, &status, EXIT_FAILED);
}
