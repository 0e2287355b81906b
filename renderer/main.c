/* render: draw a scene of translucent objects. */
#include "cli/cli.h"
#include "io/json.h"
#include "renderer/output.h"
#include "renderer/plan.h"
#include "renderer/reference.h"
#include "renderer/tables.h"
#include "renderer/volumes.h"
#include "renderer/window/view.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

struct options {
    struct cli_common common;
    struct cli_texts allowed_paths;
    const char *output_path, *table_folder, *camera_name;
    double epsilon, budget_ms;
    int technique, context, area, coherence, gather;
    int tsm_gather, tsm_response, tsm_part, tsm_samples, layer_pairs;
    int environment_samples;
    const char *splat_grid;
    double ambient_visibility;       /* rays */
    double light_points;             /* 0: the usual number */
    int shadow_nodes;                /* index */
    double shadow_taps, shadow_side; /* 0: the usual number */
    int size_px[2];
    int frames[2]; /* first and last; -1 when not given */
    bool is_explained, is_viewed;
};

/* What all frames are drawn with. */
struct job {
    const struct cli_tool *tool;
    const struct options *options;
    struct io_scene *scene;
    const struct io_scene_options *reading; /* of the scene */
    struct renderer *renderer; /* NULL: the reference, without OpenGL: works where there is none */
    struct render_options drawing;
    struct cli_progress progress;
    int frame_count, drawn_count;
    struct render_report report; /* of the last frame drawn */
};

/* In the order of enum render_context_kind, without the default. */
static const char *const context_names[] = { "osmesa", "egl", "window", NULL };

/* Index i: 2 i surfaces, which come in pairs. */
static const char *const layer_count_names[] = { "0", "2", "4", "6", "8", "10", "12", "14", "16", NULL };

/* Index 0: the usual number, or whatever the volumes of a folder have. */
static const char *const sample_count_names[] = { "usual", "13", "21", "53", "117", "245", NULL };
/* Index 0: the usual number. */
static const char *const node_count_names[] = { "usual", "4", "8", "16", "exact", NULL };
static const int node_counts[] = { 0, 4, 8, 16, INT_MAX };

static const int sample_counts[] = { 0, 13, 21, 53, 117, 245 };

/* ---- results ------------------------------------------------------------------------------------ */

/* The most memory that this process has had at once, so far. */
static json_int_t peak_rss_bytes(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (json_int_t)usage.ru_maxrss * 1024 : 0;
}

/* NULL: no memory, or a path that is not UTF-8. */
static json_t *create_result(const struct render_report *report, const char *path)
{
    json_t *const effects = json_array();
    for (size_t e = 0; e < report->effect_count; e++) {
        const struct render_effect_report *const effect = &report->effects[e];
        json_array_append_new(effects, json_pack("{s:s, s:b, s:s, s:o, s:f, s:o}", "name", effect->name,
                                                 "active", effect->is_active, "reason", effect->reason,
                                                 "predicted_ms", io_json_number(effect->predicted_ms), "ms",
                                                 effect->time_ms, "error", io_json_number(effect->error)));
    }
    return json_pack("{s:s, s:f, s:o*, s:o, s:o, s:o, s:f, s:I, s:s?}", "technique",
                     render_technique_names[report->technique], "epsilon", report->epsilon, "budget_ms",
                     report->budget_ms > 0 ? json_real(report->budget_ms) : NULL, "error_predicted",
                     io_json_number(report->error_predicted), "predicted_ms",
                     io_json_number(report->predicted_ms), "effects", effects, "total_ms", report->total_ms,
                     "peak_rss_bytes", peak_rss_bytes(), "image", path);
}

/* Ends the result, which may be NULL. */
static bool print_json(json_t *result, dipole_status *status)
{
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
    printf("technique %s, epsilon %.3g", render_technique_names[report->technique], report->epsilon);
    if (report->budget_ms > 0)
        printf(", chosen for %g ms", report->budget_ms);
    printf("\n");
    if (report->r_max_mm > 0) {
        printf(
            "error predicted %.3g = truncation %.3g + table %.3g + root of the squares of aliasing %.3g, "
            "blur %.3g, banding %.3g",
            report->error_predicted, report->truncation_error, report->table_error, report->aliasing_error,
            report->blur_error, report->banding_error);
        if (report->environment_error > 0)
            printf(", environment %.3g", report->environment_error);
        printf("\n");
        printf("r_max %.4g mm, spacing %.4g mm, %zu samples, %zu splats in %d bands\n", report->r_max_mm,
               report->spacing_mm, report->sample_count, report->splat_count, report->band_count);
    }
    if (report->map_count > 0)
        printf(
            "error not bounded; of the table %.3g\n%d translucent shadow map%s, up to %d texels a side\n",
            report->table_error, report->map_count, report->map_count == 1 ? "" : "s", report->map_side_px);
    if (report->doubling_count > 0)
        printf("%12s  estimated error\n", "samples");
    for (size_t i = 0; i < report->doubling_count; i++)
        printf("%12zu  %.3g\n", report->doublings[i].sample_count, report->doublings[i].error);
    int width = 0; /* of the longest name */
    for (size_t e = 0; e < report->effect_count; e++)
        width =
            strlen(report->effects[e].name) > (size_t)width ? (int)strlen(report->effects[e].name) : width;
    printf("%-*s  %-6s  %9s  %9s  %8s  reason\n%-*s  %-6s  %9s  %9s\n", width, "effect", "active",
           "predicted", "time", "error", width, "", "", "ms", "ms");
    for (size_t e = 0; e < report->effect_count; e++) {
        const struct render_effect_report *const effect = &report->effects[e];
        char error[16] = "unbound.";
        if (isfinite(effect->error))
            snprintf(error, sizeof error, "%.2g", effect->error);
        char predicted[16] = "-";
        if (isfinite(effect->predicted_ms))
            snprintf(predicted, sizeof predicted, "%.1f", effect->predicted_ms);
        printf("%-*s  %-6s  %9s  %9.1f  %8s  %s\n", width, effect->name, effect->is_active ? "yes" : "no",
               predicted, effect->time_ms, error, effect->reason);
    }
}

/* What is said of each picture; with --json nothing. */
static void print_report(const struct options *options, const struct render_report *report,
                         const char *path)
{
    if (options->common.json)
        return;
    if (options->is_explained)
        print_plan(report);
    printf("%s: %s, epsilon %.3g, %.0f ms\n", path, render_technique_names[report->technique],
           report->epsilon, report->total_ms);
}

/* Notes of a picture, but those that the one before it had already. */
static void print_notes(const struct job *job, const struct render_report *before)
{
    for (size_t i = 0; i < job->report.note_count; i++) {
        bool is_new = true;
        for (size_t k = 0; k < before->note_count; k++)
            is_new = is_new && strcmp(before->notes[k], job->report.notes[i]) != 0;
        if (is_new)
            cli_note(job->tool, &job->options->common, "%s", job->report.notes[i]);
    }
}

/* ---- work --------------------------------------------------------------------------------------- */

static void show_progress(void *context, const char *what, double fraction)
{
    struct job *const job = context;
    char text[64];
    snprintf(text, sizeof text, "frame %d of %d", job->drawn_count + 1, job->frame_count);
    cli_progress_show(&job->progress, job->frame_count > 1 ? text : what,
                      (job->drawn_count + fraction) / job->frame_count);
}

static bool draw_reference(struct job *job, const char *path, dipole_status *status)
{
    struct io_image *image = NULL;
    const bool done = render_output_check(path, &job->drawing.is_tone_mapped, status) &&
                      render_reference_draw(job->scene, &job->drawing, &image, &job->report, status) &&
                      render_output_save(path, image, status);
    io_image_destroy(image);
    return done;
}

/* Draw the scene as it stands, write the picture and tell of it. */
static bool draw_picture(struct job *job, const char *path, dipole_status *status)
{
    const struct render_report before = job->report;
    if (job->frame_count > 1)
        show_progress(job, NULL, 0);
    if (job->renderer ? !render_output_write(job->renderer, &job->drawing, path, &job->report, status)
                      : !draw_reference(job, path, status))
        return false;
    if (job->frame_count > 1)
        cli_progress_show(&job->progress, "", 1); /* other lines follow */
    print_notes(job, &before);
    print_report(job->options, &job->report, path);
    job->drawn_count++;
    return true;
}

/* "a/name.png" becomes "a/name.0012.png". The path ends in a suffix: that was checked. */
static void number_path(const char *path, int frame, char *out, size_t size)
{
    const char *const suffix = strrchr(path, '.');
    snprintf(out, size, "%.*s.%04d%s", (int)(suffix - path), path, frame, suffix);
}

static bool draw_frames(struct job *job, dipole_status *status)
{
    const int first = job->options->frames[0];
    json_t *const results = json_array();
    double total_ms = 0;
    bool is_done = true;
    for (int frame = first; frame < first + job->frame_count && is_done; frame++) {
        char path[PATH_MAX + 16];
        number_path(job->options->output_path, frame, path, sizeof path);
        io_scene_set_frame(job->scene, frame);
        is_done = draw_picture(job, path, status);
        if (is_done && job->drawing.budget_ms > 0) { /* all frames alike */
            job->drawing.budget_ms = 0;
            job->drawing.epsilon = job->report.epsilon;
        }
        total_ms += job->report.total_ms;
        if (job->options->common.json && is_done)
            json_array_append_new(results, create_result(&job->report, path));
    }
    if (!is_done || !job->options->common.json) {
        json_decref(results);
        return is_done;
    }
    const bool is_whole = json_array_size(results) == (size_t)job->frame_count;
    json_t *const result = json_pack("{s:o, s:f}", "frames", results, "total_ms", total_ms);
    if (is_whole)
        return print_json(result, status);
    json_decref(result);
    return print_json(NULL, status);
}

/* The pictures that were asked for: one, or numbered frames. */
static bool draw(struct job *job, dipole_status *status)
{
    const struct options *const options = job->options;
    if (options->is_viewed) {
        const struct render_view_options view = { .drawing = job->drawing,
                                                  .reading = job->reading,
                                                  .save_path = options->output_path };
        return render_view(job->renderer, job->scene, &view, status);
    }
    cli_progress_start(&job->progress, job->tool, &options->common);
    job->drawing.progress = (struct render_progress){ .show = show_progress, .context = job };
    if (options->frames[0] >= 0)
        return draw_frames(job, status) && cli_stdout_finish(status);
    return draw_picture(job, options->output_path, status) &&
           (!options->common.json ||
            print_json(create_result(&job->report, options->output_path), status)) &&
           cli_stdout_finish(status);
}

/* What the technique asks of the folder that was named, if one was. */
static bool find_tables(const struct job *job, struct render_tables **tables_out,
                        struct render_volumes **volumes_out, dipole_status *status)
{
    const char *const folder = job->options->table_folder;
    struct render_media *media = NULL;
    bool is_done = !folder || render_media_create(job->scene, &media, status);
    if (folder && is_done)
        is_done = job->options->technique == RENDER_TECHNIQUE_TSM
                      ? render_volumes_find(folder, media, sample_counts[job->options->tsm_samples],
                                            volumes_out, status)
                      : render_tables_find(folder, media, tables_out, status);
    render_media_destroy(media);
    return is_done;
}

static bool draw_by_opengl(struct job *job, dipole_status *status)
{
    const struct options *const options = job->options;
    const enum render_context_kind kind =
        options->is_viewed ? RENDER_CONTEXT_WINDOW : (enum render_context_kind)(options->context + 1);
    struct render_tables *tables = NULL;
    struct render_volumes *volumes = NULL;
    bool is_done = find_tables(job, &tables, &volumes, status);
    job->drawing.tables = tables ? tables->of_medium : NULL;
    job->drawing.volumes = volumes ? (const struct lut_tsm *const *)volumes->volumes : NULL;
    is_done = is_done && render_create(job->scene, kind, &job->renderer, status) && draw(job, status);
    render_destroy(job->renderer);
    render_tables_destroy(tables);
    render_volumes_destroy(volumes);
    return is_done;
}

static bool check_frames(const struct options *options, const struct io_scene *scene, dipole_status *status)
{
    const dipole_place place = { .source = scene->path };
    const int count = scene->frames.count;
    return options->frames[1] < count ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place, "frames %d to %d are asked for, expected 0 to %d",
                       options->frames[0], options->frames[1], count - 1);
}

/* What --splat-grid says; false: no such number. */
static bool parse_grid(const char *text, int *grid_out)
{
    *grid_out = text && strcmp(text, "auto") == 0 ? RENDER_SPLAT_GRID_AUTO : 0;
    if (!text || *grid_out == RENDER_SPLAT_GRID_AUTO)
        return true;
    char *end = NULL;
    const long number = strtol(text, &end, 10);
    const bool is_grid =
        number == 0 || (number >= RENDER_SPLAT_GRID_MIN && number <= RENDER_SPLAT_GRID_MAX);
    if (*text < '0' || *text > '9' || *end != '\0' || !is_grid)
        return false;
    *grid_out = (int)number;
    return true;
}

static bool run(const struct cli_tool *tool, const struct options *options, const char *scene_path,
                dipole_status *status)
{
    const struct io_scene_options reading = { .allowed_paths = options->allowed_paths.values,
                                              .allowed_path_count = options->allowed_paths.count,
                                              .camera_name = options->camera_name,
                                              .width_px = options->size_px[0],
                                              .height_px = options->size_px[1] };
    struct job job = {
        .tool = tool,
        .options = options,
        .reading = &reading,
        .drawing = { .technique = (enum render_technique)options->technique,
                     .area = (enum render_area)options->area,
                     .coherence = (enum render_coherence)options->coherence,
                     .gather = (enum render_gather)options->gather,
                     .epsilon = options->epsilon,
                     .budget_ms = options->budget_ms,
                     .is_warm = options->is_viewed || options->frames[1] > options->frames[0],
                     .environment_samples = (enum render_environment_samples)options->environment_samples,
                     .ambient_visibility = (int)options->ambient_visibility,
                     .light_place_count = (int)options->light_points,
                     .shadows = { .node_limit = node_counts[options->shadow_nodes],
                                  .tap_count = (int)options->shadow_taps,
                                  .side_px = (int)options->shadow_side },
                     .tsm = { .gather = (enum render_tsm_gather)options->tsm_gather,
                              .response = (enum render_tsm_response)options->tsm_response,
                              .part = (enum render_tsm_part)options->tsm_part,
                              .sample_count = sample_counts[options->tsm_samples],
                              .layer_count = 2 * options->layer_pairs } },
        .frame_count = options->frames[1] - options->frames[0] + 1
    };
    bool is_png = false, done = false;
    parse_grid(options->splat_grid, &job.drawing.splat_grid);
    if ((!options->output_path || render_output_check(options->output_path, &is_png, status)) &&
        io_scene_read(scene_path, &reading, &job.scene, status) && check_frames(options, job.scene, status))
        done = options->technique == RENDER_TECHNIQUE_REFERENCE ? draw(&job, status)
                                                                : draw_by_opengl(&job, status);
    io_scene_destroy(job.scene);
    return done;
}

/* No option may be given that would do nothing. In the window every technique can be chosen. */
static bool check_usage(const struct options *options, dipole_status *status)
{
    const enum render_technique technique = (enum render_technique)options->technique;
    const bool is_splat = technique == RENDER_TECHNIQUE_AUTO || technique == RENDER_TECHNIQUE_SPLAT;
    const bool has_samples = is_splat || technique == RENDER_TECHNIQUE_GATHER;
    const bool may_gather = technique == RENDER_TECHNIQUE_AUTO || technique == RENDER_TECHNIQUE_GATHER;
    const bool is_reference = technique == RENDER_TECHNIQUE_REFERENCE;
    int grid;
    if (!parse_grid(options->splat_grid, &grid))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--splat-grid is \"%.40s\", expected auto, 0 or a whole number from %d to %d",
                           options->splat_grid, RENDER_SPLAT_GRID_MIN, RENDER_SPLAT_GRID_MAX);
    const bool has_tsm_options = options->tsm_gather || options->tsm_response || options->tsm_part ||
                                 options->tsm_samples || options->layer_pairs;
    const struct {
        bool is_wrong;
        const char *what;
    } rules[] = {
        { !options->output_path && !options->is_viewed, "no --output (-o) IMG was given; try --help" },
        { options->is_viewed && options->frames[0] >= 0, "--view cannot be used with --frames" },
        { options->is_viewed && options->is_explained, "--view cannot be used with --explain" },
        { options->is_viewed && options->context >= 0, "--view cannot be used with --context" },
        { is_reference && options->is_viewed, "--technique reference cannot be used with --view" },
        { is_reference && options->table_folder, "--technique reference cannot be used with --luts" },
        { is_reference && options->context >= 0, "--technique reference cannot be used with --context" },
        { options->area != RENDER_AREA_FLUX && !is_splat && !options->is_viewed,
          "--splat-area is of --technique splat alone" },
        { grid != 0 && !is_splat && !options->is_viewed, "--splat-grid is of --technique splat alone" },
        { grid != 0 && options->coherence > RENDER_COHERENCE_NONE,
          "--splat-grid cannot be used with --coherence two-pass or surface: its samples are texels of the "
          "light's view" },
        { options->coherence != RENDER_COHERENCE_AUTO && !has_samples && !options->is_viewed,
          "--coherence is of --technique gather and splat alone" },
        { options->gather != RENDER_GATHER_AUTO && !may_gather && !options->is_viewed,
          "--gather is of --technique gather alone" },
        { options->budget_ms > 0 && options->epsilon > 0, "--budget-ms cannot be used with --epsilon" },
        { options->budget_ms > 0 && !has_samples && !options->is_viewed,
          "--budget-ms is of --technique gather and splat alone: no error is predicted of others" },
        { options->environment_samples && !has_samples && !options->is_viewed,
          "--environment-samples is of --technique gather and splat alone" },
        { options->ambient_visibility != floor(options->ambient_visibility),
          "--ambient-visibility is not a whole number of rays" },
        { options->ambient_visibility > 0 && !has_samples && !is_reference && !options->is_viewed,
          "--ambient-visibility is of --technique gather, splat and reference alone" },
        { options->shadow_taps != floor(options->shadow_taps),
          "--shadow-taps is not a whole number of taps" },
        { options->shadow_side != floor(options->shadow_side),
          "--shadow-side is not a whole number of texels" },
        { (options->shadow_nodes || options->shadow_taps > 0 || options->shadow_side > 0) && is_reference,
          "--shadow-nodes, --shadow-taps and --shadow-side are not of --technique reference, which is "
          "exact" },
        { options->light_points != floor(options->light_points),
          "--light-points is not a whole number of points" },
        { options->light_points > 0 && !is_reference, "--light-points is of --technique reference alone" },
        { has_tsm_options && technique != RENDER_TECHNIQUE_TSM && !options->is_viewed,
          "--tsm, --tsm-response, --tsm-part, --tsm-samples and --peel are of --technique tsm alone" },
    };
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++) {
        if (rules[i].is_wrong)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s", rules[i].what);
    }
    return true;
}

int main(int argc, char **argv)
{
    struct options options = { .context = -1, .frames = { -1, -1 } };
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
          .help =
              "gather: subsurface scattering, light samples summed by scale; splat: the same, each sample "
              "drawn over the pixels within its reach; lambert: light leaves where it enters; auto: "
              "gather, splat for "
              "epsilon below 0.003, or lambert where scattering stays within a pixel; tsm: translucent "
              "shadow "
              "maps, fast and rough; reference: the integral over the surface on the CPU, slow, its error "
              "a tenth of "
              "epsilon, no OpenGL, no tables. Default auto.",
          .choices = render_technique_names },
        { .name = "splat-area",
          .kind = CLI_CHOICE,
          .target = &options.area,
          .argument = "NAME",
          .help =
              "Area that a light sample stands for: flux, which needs none, or overlap, counted as in the "
              "paper, for comparison. Default flux.",
          .choices = render_area_names },
        {
            .name = "splat-grid",
            .kind = CLI_TEXT,
            .target = &options.splat_grid,
            .argument = "N",
            .help = "Draw one splat for each lit texel of a uniform grid of N x N texels over each light's "
                    "view, as "
                    "in the paper, for comparison: 2 to 4096, or auto, as many as epsilon asks for on "
                    "surfaces that "
                    "face the light. Default 0: samples follow the surface and are summed in bands.",
        },
        { .name = "tsm",
          .kind = CLI_CHOICE,
          .target = &options.tsm_gather,
          .argument = "WHERE",
          .help =
              "Gather the global response of translucent shadow maps at each fragment, the default, or at "
              "each vertex.",
          .choices = render_tsm_gather_names },
        { .name = "tsm-response",
          .kind = CLI_CHOICE,
          .target = &options.tsm_response,
          .argument = "KIND",
          .help =
              "table: samples looked up in a volume, the default; exact: without a table; texels: the sum "
              "over all texels, slow; profile: the same of the profile at the distance, as splats sum it.",
          .choices = render_tsm_response_names },
        { .name = "tsm-part",
          .kind = CLI_CHOICE,
          .target = &options.tsm_part,
          .argument = "PART",
          .help = "sum, the default, or the global or the local response alone.",
          .choices = render_tsm_part_names },
        { .name = "tsm-samples",
          .kind = CLI_CHOICE,
          .target = &options.tsm_samples,
          .argument = "N",
          .help = "Samples of a translucent shadow map for each point: 13, 21, 53, 117 or 245; usual, the "
                  "default, "
                  "is 21 as in the paper, or what the volumes in the folder of --luts have.",
          .choices = sample_count_names },
        { .name = "peel",
          .kind = CLI_CHOICE,
          .target = &options.layer_pairs,
          .argument = "N",
          .help =
              "Tell material from air by N surfaces behind each other in translucent shadow maps, an even "
              "number up to 16; default 0: all is taken for solid.",
          .choices = layer_count_names },
        { .name = "environment-samples",
          .kind = CLI_CHOICE,
          .target = &options.environment_samples,
          .argument = "WHERE",
          .help =
              "Where light of the scene's environment is sampled: surface, on the triangles, the default; "
              "peel, on layers peeled along y as in the paper; peel3, along x, y and z. For comparison.",
          .choices = render_environment_samples_names },
        { .name = "ambient-visibility",
          .kind = CLI_NUMBER,
          .target = &options.ambient_visibility,
          .argument = "N",
          .help = "Rays from each light sample that tell what hides the environment from it, up to 4096; "
                  "default 0: nothing does.",
          .min = 0,
          .max = 4096 },
        { .name = "shadow-nodes",
          .kind = CLI_CHOICE,
          .target = &options.shadow_nodes,
          .argument = "N",
          .help = "Depths in a texel at which light through blockers is known: 4, 8, the default, 16, or "
                  "exact.",
          .choices = node_count_names },
        { .name = "shadow-taps",
          .kind = CLI_NUMBER,
          .target = &options.shadow_taps,
          .argument = "N",
          .help = "Taps that look for what blocks a light with a size, and as many that filter, 1 to 1024; "
                  "default 25.",
          .min = 1,
          .max = RENDER_SHADOW_TAP_LIMIT },
        { .name = "shadow-side",
          .kind = CLI_NUMBER,
          .target = &options.shadow_side,
          .argument = "N",
          .help = "Texels a side of the maps that shadows of blockers are looked up in, 16 to 2048; "
                  "default 1024.",
          .min = 16,
          .max = RENDER_SHADOW_SIDE_LIMIT },
        { .name = "light-points",
          .kind = CLI_NUMBER,
          .target = &options.light_points,
          .argument = "N",
          .help = "Points that the reference takes a light with a size for, 1 to 4096; default 128.",
          .min = 1,
          .max = RENDER_LIGHT_PLACE_LIMIT },
        { .name = "epsilon",
          .letter = 'e',
          .kind = CLI_NUMBER,
          .target = &options.epsilon,
          .argument = "E",
          .help = "Relative error allowed, 1e-5 to 0.5, default 0.01.",
          .min = RENDER_EPSILON_MIN,
          .max = RENDER_EPSILON_MAX },
        { .name = "budget-ms",
          .kind = CLI_NUMBER,
          .target = &options.budget_ms,
          .argument = "T",
          .help =
              "In place of --epsilon: the least error, down to 0.003, whose picture is predicted to take T "
              "milliseconds or less; with --frames, each picture after the first.",
          .min = RENDER_BUDGET_MS_MIN,
          .max = RENDER_BUDGET_MS_MAX },
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
        { .name = "camera",
          .kind = CLI_TEXT,
          .target = &options.camera_name,
          .argument = "NAME",
          .help = "Which of the scene's cameras; default the first." },
        { .name = "frames",
          .kind = CLI_RANGE,
          .target = options.frames,
          .argument = "A:B",
          .help = "Draw frames A to B, or A alone, of a scene in motion, counted from 0, into numbered "
                  "pictures: name.png becomes name.0000.png and so on. Default: frame 0, not numbered.",
          .min = 0,
          .max = 99999 },
        { .name = "coherence",
          .kind = CLI_CHOICE,
          .target = &options.coherence,
          .argument = "KIND",
          .help =
              "How light samples are kept from flickering in a scene in motion: none; two-pass, each "
              "light's view sampled twice; surface, samples stay on the surface. Default auto: surface, "
              "where light or objects move.",
          .choices = render_coherence_names },
        { .name = "gather",
          .kind = CLI_CHOICE,
          .target = &options.gather,
          .argument = "WHERE",
          .help =
              "What gathers: c, the processor; gl, OpenGL's shaders. Default auto: what is predicted to "
              "be faster.",
          .choices = render_gather_names },
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
          .help =
              "Show the scene in a window with a panel for materials, lights, techniques and their "
              "differences: left drag turns the camera, right drag the light, the wheel zooms; Tab opens "
              "the panel, T changes the technique, C compares, R resets, S saves to IMG, Q quits." },
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
    if (!check_usage(&options, &status))
        return cli_report(&tool, &status, EXIT_USAGE);
    if (!run(&tool, &options, operands[0], &status))
        return cli_report(&tool, &status, EXIT_FAILED);
    return EXIT_DONE;
}
