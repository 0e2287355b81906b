/*
 * Soft shadows of blockers: how far the shadow factor is from that of rays, what it costs, how it flickers.
 *
 * usage: bench_shadows edges PLOT             the edge of an extended blocker
 *        bench_shadows scenes PLOT SCENE...   error and time over nodes, taps and sides of the maps, and of
 *                                             hard and soft shadows
 *        bench_shadows costs SCENE...         time of each effect beside what is predicted
 *        bench_shadows taps SCENE...          error of sets of taps and of ways to turn them
 *        bench_shadows flicker PLOT TITLE SCENE   of ways to turn taps, where something moves
 *
 * Rows of Markdown on stdout; plots PLOT_NAME.svg.
 */
#include "bench/shadows.h"

#include "io/file.h"
#include "lutgen/parallel.h"
#include "renderer/execute.h"
#include "renderer/reference_pixel.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool bench_write_plot(const struct plot *plot, const char *stem, const char *name, dipole_status *status)
{
    char path[512], *svg;
    size_t size;
    snprintf(path, sizeof path, "%s_%s.svg", stem, name);
    if (!plot_svg_create(plot, &svg, &size, status))
        return false;
    const bool done = io_file_write(path, svg, size, status);
    free(svg);
    return done;
}

const char *bench_shadows_name(const char *path)
{
    static char names[8][64]; /* plots keep as many */
    static int next;
    char *const name = names[next++ % 8];
    const char *const slash = strrchr(path, '/'), *start = slash ? slash + 1 : path;
    start += strncmp(start, "shadow_", 7) == 0 ? 7 : 0;
    snprintf(name, sizeof names[0], "%.*s", (int)strcspn(start, "."), start);
    return name;
}

#define EPSILON 0.01

bool bench_shadows_begin(const char *path, int width_px, int height_px, struct bench_shadows *bench,
                         dipole_status *status)
{
    const struct io_scene_options options = { .width_px = width_px, .height_px = height_px };
    const size_t pixels = (size_t)width_px * (size_t)height_px;
    *bench = (struct bench_shadows){ .width_px = width_px, .height_px = height_px };
    bench->shadow = malloc(4 * pixels * sizeof *bench->shadow);
    bench->position_mm = malloc(4 * pixels * sizeof *bench->position_mm);
    bench->normal = malloc(4 * pixels * sizeof *bench->normal);
    bench->truth = calloc(3 * pixels, sizeof *bench->truth);
    if (!bench->shadow || !bench->position_mm || !bench->normal || !bench->truth)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu pixels", pixels);
    return io_scene_read(path, &options, &bench->scene, status) &&
           render_create(bench->scene, RENDER_CONTEXT_DEFAULT, &bench->renderer, status);
}

void bench_shadows_end(struct bench_shadows *bench)
{
    render_destroy(bench->renderer);
    io_scene_destroy(bench->scene);
    free(bench->shadow);
    free(bench->position_mm);
    free(bench->normal);
    free(bench->truth);
}

bool bench_shadows_has(const char *name)
{
    return strncmp(name, "shadow", 6) == 0 || strncmp(name, "avsm", 4) == 0 ||
           strcmp(name, "soft_shadow") == 0 || strcmp(name, "light_shadow") == 0;
}

bool bench_shadows_draw(struct bench_shadows *bench, const struct render_shadow_options *options,
                        int run_count, double *ms_out, dipole_status *status)
{
    const struct render_request request = { .scene = bench->scene,
                                            .media = bench->renderer->media,
                                            .technique = RENDER_TECHNIQUE_LAMBERT,
                                            .shadows = *options,
                                            .epsilon = EPSILON };
    struct render_executor *const executor = bench->renderer->executor;
    double least_ms = INFINITY;
    for (int i = 0; i < run_count; i++) {
        struct render_plan *plan;
        double time_ms[RENDER_EFFECT_LIMIT], ms = 0;
        if (!render_run(bench->renderer, &request, &plan, time_ms, status))
            return false;
        for (size_t e = 0; e < plan->effect_count; e++)
            ms += bench_shadows_has(render_effects[e]->name) ? time_ms[e] : 0;
        least_ms = fmin(least_ms, ms);
        render_plan_destroy(plan);
    }
    if (ms_out)
        *ms_out = least_ms;
    return render_executor_read(executor, "shadow", bench->shadow, status) &&
           render_executor_read(executor, "position_mm", bench->position_mm, status) &&
           render_executor_read(executor, "normal", bench->normal, status);
}

bool bench_shadows_begin_rays(struct bench_shadows *bench, dipole_status *status)
{
    return render_casters_init(bench->scene, bench->renderer->media, EPSILON, &bench->casters, status) &&
           render_tracer_create_with(bench->scene, &bench->casters, &bench->tracer, status);
}

void bench_shadows_end_rays(struct bench_shadows *bench)
{
    render_tracer_destroy(bench->tracer);
    render_casters_end(&bench->casters);
    bench->tracer = NULL;
    bench->casters = (struct render_casters){ .count = 0 };
}

/* A pixel's surface is the mean of points of it, which may lie below its facets. */
#define LIFT_MM 0.03

void bench_shadows_trace(const struct bench_shadows *bench, int pixel, int place_count, double left[3])
{
    struct render_surface_point point = { .object = 0 };
    for (int k = 0; k < 3; k++) {
        point.facet_normal[k] = point.normal[k] = (double)bench->normal[4 * pixel + k];
        point.position_mm[k] = (double)bench->position_mm[4 * pixel + k] + LIFT_MM * point.normal[k];
    }
    render_light_left(bench->tracer, &bench->scene->lights[0], &point, place_count, left);
}

struct row_tracer {
    const struct bench_shadows *bench;
    int place_count;
};

static void trace_row(void *context, int row)
{
    const struct row_tracer *const rows = context;
    for (int i = row * rows->bench->width_px; i < (row + 1) * rows->bench->width_px; i++) {
        if (rows->bench->position_mm[4 * i + 3] > 0)
            bench_shadows_trace(rows->bench, i, rows->place_count, rows->bench->truth + 3 * (size_t)i);
    }
}

bool bench_shadows_trace_all(struct bench_shadows *bench, int place_count, dipole_status *status)
{
    struct row_tracer rows = { .bench = bench, .place_count = place_count };
    const bool done = bench_shadows_begin_rays(bench, status);
    if (done)
        lut_parallel_for(bench->height_px, 0, trace_row, &rows);
    bench_shadows_end_rays(bench);
    return done;
}

double bench_shadows_cosine(const struct bench_shadows *bench, int pixel)
{
    const struct io_light *const light = &bench->scene->lights[0];
    double dot = 0, length2 = 0;
    for (int k = 0; k < 3; k++) {
        const double to_light = light->kind == IO_LIGHT_POINT
                                    ? light->position_mm[k] - (double)bench->position_mm[4 * pixel + k]
                                    : -light->direction[k];
        dot += to_light * (double)bench->normal[4 * pixel + k];
        length2 += to_light * to_light;
    }
    return bench->position_mm[4 * pixel + 3] > 0 && dot > 0 ? dot / sqrt(length2) : 0;
}

struct bench_shadows_error bench_shadows_compare(const struct bench_shadows *bench)
{
    double error2[2] = { 0, 0 }, value2[2] = { 0, 0 };
    for (int i = 0; i < bench->width_px * bench->height_px; i++) {
        const double cosine = bench_shadows_cosine(bench, i);
        for (int c = 0; c < 3 && cosine > 0; c++) {
            const double truth = bench->truth[3 * (size_t)i + (size_t)c];
            const double error = (double)bench->shadow[4 * i + c] - truth;
            error2[0] += error * error;
            value2[0] += truth * truth;
            error2[1] += pow(cosine * error, 2);
            value2[1] += pow(cosine * truth, 2);
        }
    }
    return (struct bench_shadows_error){ sqrt(error2[0] / value2[0]), sqrt(error2[1] / value2[1]) };
}

int main(int argc, char **argv)
{
    dipole_status status = { 0 };
    const char *const part = argc > 1 ? argv[1] : "";
    bool done = false;
    if (argc == 3 && strcmp(part, "edges") == 0) {
        done = bench_shadows_edges(argv[2], &status);
    } else if (argc > 3 && strcmp(part, "scenes") == 0) {
        done = bench_shadows_scenes(argv + 3, argc - 3, argv[2], &status);
    } else if (argc > 2 && strcmp(part, "costs") == 0) {
        done = bench_shadows_costs(argv + 2, argc - 2, &status);
    } else if (argc > 2 && strcmp(part, "taps") == 0) {
        done = bench_shadows_taps(argv + 2, argc - 2, &status);
    } else if (argc == 5 && strcmp(part, "flicker") == 0) {
        done = bench_shadows_flicker(argv[4], argv[3], argv[2], &status);
    } else {
        fprintf(stderr, "usage: bench_shadows edges PLOT | scenes PLOT SCENE... | costs SCENE... | "
                        "taps SCENE... | "
                        "flicker PLOT TITLE SCENE\n");
        return 2;
    }
    if (!done)
        fprintf(stderr, "bench_shadows: %s\n", status.message);
    return !done;
}
