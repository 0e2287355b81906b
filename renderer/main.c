/* render: draw a scene of translucent objects. */
#include "cli/cli.h"
#include "renderer/output.h"
#include "renderer/plan.h"
#include "renderer/reference.h"
#include "renderer/tables.h"
#include "renderer/view.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

struct options {
    struct cli_common common;
    struct cli_texts allowed_paths;
    const char *output_path, *table_folder;
    double epsilon;
    int technique, context;
    int size_px[2];
    bool is_explained, is_viewed;
};

/* In the order of enum render_context_kind, without the default. */
static const char *const context_names[] = { "osmesa", "egl", "window", NULL };

/* ---- results ------------------------------------------------------------------------------------ */

static bool print_json(const struct render_report *report, const char *path, dipole_status *status)
{
    json_t *const effects = json_array();
    for (size_t e = 0; e < report->effect_count; e++) {
        const struct render_effect_report *const effect = &report->effects[e];
        json_array_append_new(effects, json_pack("{s:s, s:b, s:s, s:f}", "name", effect->name, "active",
                                                 effect->is_active, "reason", effect->reason, "ms",
                                                 effect->time_ms));
    }
    json_t *const result = json_pack("{s:s, s:f, s:o, s:f, s:s?}", "technique",
                                     render_technique_names[report->technique], "epsilon", report->epsilon,
                                     "effects", effects, "total_ms", report->total_ms, "image", path);
    char *const text = result ? io_json_format(result) : NULL;
    if (text)
        fputs(text, stdout);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result (is a path not UTF-8?)");
    const bool done = text != NULL;
    free(text);
    json_decref(result);
    return done;
}

static void print_plan(const struct render_report *report)
{
    printf("technique %s, epsilon %g\n", render_technique_names[report->technique], report->epsilon);
    if (report->r_max_mm > 0) {
        printf("error predicted %.3g = truncation %.3g + aliasing %.3g + banding %.3g + table %.3g\n",
               report->error_predicted, report->truncation_error, report->aliasing_error,
               report->banding_error, report->table_error);
        printf("r_max %.4g mm, spacing %.4g mm, %zu samples, %zu splats in %d bands\n", report->r_max_mm,
               report->spacing_mm, report->sample_count, report->splat_count, report->band_count);
    }
    if (report->doubling_count > 0)
        printf("%12s  estimated error\n", "samples");
    for (size_t i = 0; i < report->doubling_count; i++)
        printf("%12zu  %.3g\n", report->doublings[i].sample_count, report->doublings[i].error);
    printf("%-16s  %-6s  %9s  reason\n%-16s  %-6s  %9s\n", "effect", "active", "time", "", "", "ms");
    for (size_t e = 0; e < report->effect_count; e++) {
        const struct render_effect_report *const effect = &report->effects[e];
        printf("%-16s  %-6s  %9.1f  %s\n", effect->name, effect->is_active ? "yes" : "no", effect->time_ms,
               effect->reason);
    }
}

static bool print_results(const struct cli_tool *tool, const struct options *options,
                          const struct render_report *report, dipole_status *status)
{
    for (size_t i = 0; i < report->note_count; i++)
        cli_note(tool, &options->common, "%s", report->notes[i]);
    if (options->common.json) {
        if (!print_json(report, options->output_path, status))
            return false;
    } else {
        if (options->is_explained)
            print_plan(report);
        printf("%s: %s, epsilon %g, %.0f ms\n", options->output_path,
               render_technique_names[report->technique], report->epsilon, report->total_ms);
    }
    return cli_stdout_finish(status);
}

/* ---- work --------------------------------------------------------------------------------------- */

static bool draw(const struct cli_tool *tool, const struct options *options, struct renderer *renderer,
                 struct io_scene *scene, const struct lut_splat *table, dipole_status *status)
{
    const struct render_options drawing = { .technique = (enum render_technique)options->technique,
                                            .epsilon = options->epsilon,
                                            .table = table };
    if (options->is_viewed) {
        const struct render_view_options view = { .drawing = drawing, .save_path = options->output_path };
        return render_view(renderer, scene, &view, status);
    }
    struct render_report report;
    return render_output_write(renderer, &drawing, options->output_path, &report, status) &&
           print_results(tool, options, &report, status);
}

static void show_progress(void *context, const char *what, double fraction)
{
    cli_progress_show(context, what, fraction);
}

/* Without OpenGL: works where there is none. */
static bool draw_reference(const struct cli_tool *tool, const struct options *options,
                           const struct io_scene *scene, bool is_png, dipole_status *status)
{
    struct cli_progress progress;
    cli_progress_start(&progress, tool, &options->common);
    const struct render_options drawing = { .technique = RENDER_TECHNIQUE_REFERENCE,
                                            .epsilon = options->epsilon,
                                            .is_tone_mapped = is_png,
                                            .progress = { .show = show_progress, .context = &progress } };
    struct io_image *image = NULL;
    struct render_report report;
    const bool done = render_reference_draw(scene, &drawing, &image, &report, status) &&
                      render_output_save(options->output_path, image, status) &&
                      print_results(tool, options, &report, status);
    io_image_destroy(image);
    return done;
}

static bool draw_by_opengl(const struct cli_tool *tool, const struct options *options,
                           struct io_scene *scene, dipole_status *status)
{
    const enum render_context_kind kind =
        options->is_viewed ? RENDER_CONTEXT_WINDOW : (enum render_context_kind)(options->context + 1);
    struct lut_splat *table = NULL;
    struct renderer *renderer = NULL;
    const bool done =
        (!options->table_folder ||
         render_table_find(options->table_folder, &scene->objects[0].material, &table, status)) &&
        render_create(scene, kind, &renderer, status) &&
        draw(tool, options, renderer, scene, table, status);
    render_destroy(renderer);
    lut_splat_destroy(table);
    return done;
}

static bool run(const struct cli_tool *tool, const struct options *options, const char *scene_path,
                dipole_status *status)
{
    const struct io_scene_options reading = { .allowed_paths = options->allowed_paths.values,
                                              .allowed_path_count = options->allowed_paths.count,
                                              .width_px = options->size_px[0],
                                              .height_px = options->size_px[1] };
    struct io_scene *scene = NULL;
    bool is_png = false, done = false;
    if ((!options->output_path || render_output_check(options->output_path, &is_png, status)) &&
        io_scene_read(scene_path, &reading, &scene, status) && render_plan_check_media(scene, status))
        done = options->technique == RENDER_TECHNIQUE_REFERENCE
                   ? draw_reference(tool, options, scene, is_png, status)
                   : draw_by_opengl(tool, options, scene, status);
    io_scene_destroy(scene);
    return done;
}

int main(int argc, char **argv)
{
    struct options options = { .epsilon = RENDER_EPSILON_DEFAULT, .context = -1 };
    const struct cli_option table[] = {
        { .name = "output",
          .letter = 'o',
          .kind = CLI_TEXT,
          .target = &options.output_path,
          .argument = "IMG",
          .help = "Picture to write: .exr holds linear radiance with alpha, .png the tone mapped picture. "
                  "Required without --view." },
        { .name = "luts",
          .kind = CLI_TEXT,
          .target = &options.table_folder,
          .argument = "DIR",
          .help = "Folder of tables by lutgen; the one of the scene's medium is used. Default: bake one in "
                  "memory." },
        { .name = "technique",
          .letter = 't',
          .kind = CLI_CHOICE,
          .target = &options.technique,
          .argument = "NAME",
          .help = "splat: subsurface scattering; lambert: light leaves where it enters; auto: splat, or "
                  "lambert where scattering stays within a pixel; reference: the integral over the surface "
                  "on the "
                  "CPU, slow, its error a tenth of epsilon, no OpenGL, no tables. Default auto.",
          .choices = render_technique_names },
        { .name = "epsilon",
          .letter = 'e',
          .kind = CLI_NUMBER,
          .target = &options.epsilon,
          .argument = "E",
          .help = "Relative error allowed, 1e-5 to 0.5, default 0.01.",
          .min = RENDER_EPSILON_MIN,
          .max = RENDER_EPSILON_MAX },
        { .name = "explain",
          .kind = CLI_FLAG,
          .target = &options.is_explained,
          .help = "Print what was done, why, and how long it took." },
        { .name = "size",
          .kind = CLI_SIZE,
          .target = options.size_px,
          .argument = "WxH",
          .help = "Size of the picture in pixels, sides 1 to 16384; default the scene's.",
          .min = 1,
          .max = RENDER_SIDE_LIMIT },
        { .name = "context",
          .kind = CLI_CHOICE,
          .target = &options.context,
          .argument = "KIND",
          .help =
              "Where OpenGL comes from: osmesa, egl or window (needs a display). Default osmesa, else egl.",
          .choices = context_names },
        { .name = "allow-path",
          .kind = CLI_TEXTS,
          .target = &options.allowed_paths,
          .argument = "DIR",
          .help = "Folder beside the scene's own that the scene may refer to; may be repeated." },
        { .name = "view",
          .kind = CLI_FLAG,
          .target = &options.is_viewed,
          .help = "Show the scene in a window: left drag turns the camera, right drag the light, the wheel "
                  "zooms; T changes the technique, R resets, S saves to IMG, Q quits." },
        { .name = NULL },
    };
    const struct cli_tool tool = {
        .name = "render",
        .summary = "Draw scenes of translucent objects",
        .usage = "SCENE.json -o IMG",
        .details =
            "Every effect runs only when the scene calls for it; --explain says which do and why. The "
            "error allowed is shared out among what is cut off beyond r_max, the spacing of the light "
            "samples and the table.",
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
    if (!options.output_path && !options.is_viewed) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "no --output (-o) IMG was given; try --help");
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    if (options.technique == RENDER_TECHNIQUE_REFERENCE && (options.is_viewed || options.table_folder)) {
        dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "--technique reference cannot be used with %s",
                    options.is_viewed ? "--view" : "--luts");
        return cli_report(&tool, &status, EXIT_USAGE);
    }
    if (!run(&tool, &options, operands[0], &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
