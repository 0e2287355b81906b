/*
 * Soft shadows of blockers: how far the shadow factor is from that of rays, and what it costs.
 *
 * usage: bench_shadows edges PLOT        the edge of an extended blocker: one replacement against many thin
 * sheets; plots PLOT_thickness.svg and PLOT_alpha.svg, and a row for each case bench_shadows scene
 * SCENE.json NAME WIDTH HEIGHT PLACES error over nodes, taps and sides of the maps, and time of hard and
 * soft shadows
 */
#include "io/file.h"
#include "plot/plot.h"
#include "renderer/blocker.h"
#include "renderer/execute.h"
#include "renderer/reference_pixel.h"
#include "renderer/renderer.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- an edge ------------------------------------------------------------------------------------- */

enum { ACROSS = 400, CASES = 4 };

/* A light one wide, ten away from the receiver; the blocker fills z0 to zE from the light, and x > 0. */
#define RECEIVER 10.0
#define LIGHT 1.0

/* Part of the light that comes to x past an edge at depth z, if nothing comes through what it hides. */
static double open_part(double x, double z)
{
    const double seen_at = x + (0 - x) * RECEIVER / (RECEIVER - z); /* the edge, on the light's plane */
    return fmin(fmax((seen_at + LIGHT / 2) / LIGHT, 0), 1);
}

static double factor_of_sheet(double x, double z, double alpha)
{
    return 1 - alpha * (1 - open_part(x, z));
}

/* Light from a place comes through as many sheets as its ray meets behind their edges: those beyond one
 * depth. */
static double factor_of_sheets(double x, double z0, double ze, double alpha)
{
    enum { PLACES = 2000 };
    double sum = 0;
    for (int i = 0; i < PLACES; i++) {
        const double from = LIGHT * ((i + 0.5) / PLACES - 0.5);
        double part = 0; /* of the way within the blocker that is at x > 0 */
        if (from > 0 && x > 0)
            part = 1;
        else if (from > 0 || x > 0) {
            const double zero = RECEIVER * from / (from - x); /* where the ray passes the edge's plane */
            part = from > 0 ? (zero - z0) / (ze - z0) : (ze - zero) / (ze - z0);
        }
        sum += 1 - alpha * render_blocker_part(alpha, fmin(fmax(part, 0), 1));
    }
    return sum / PLACES;
}

/* The same sheets as an algorithm takes them that knows how much of the light stays where: each keeps its
 * part of what the sheets before it leave, and has a penumbra of its own. */
static double factor_of_sheets_in_order(double x, double z0, double ze, double alpha)
{
    enum { SHEETS = 1000 };
    double left = 1;
    for (int k = 0; k < SHEETS; k++) {
        const double stays = alpha * (render_blocker_part(alpha, (k + 1.0) / SHEETS) -
                                      render_blocker_part(alpha, (double)k / SHEETS));
        left -= stays * (1 - open_part(x, z0 + (ze - z0) * (k + 0.5) / SHEETS));
    }
    return left;
}

static bool write_plot(const struct plot *plot, const char *stem, const char *name, dipole_status *status)
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

struct edge_case {
    double z0, ze, alpha;
};

/* One chart: what many sheets leave, one at half absorption and one in the middle, of each case. */
static bool draw_edges(const struct edge_case *cases, const char *stem, const char *name, const char *title,
                       dipole_status *status)
{
    static double x[ACROSS], y[3 * CASES][ACROSS];
    static char labels[CASES][64];
    struct plot_series series[3 * CASES];
    const char *const colors[CASES] = { PLOT_BLUE, PLOT_GREEN, PLOT_RED, PLOT_GREY };
    for (int k = 0; k < CASES; k++) {
        const struct edge_case *const c = &cases[k];
        const double depths[2] = { render_blocker_half_mm(c->z0, c->ze, c->alpha), (c->z0 + c->ze) / 2 };
        double error2[2] = { 0, 0 }, ray_error2[2] = { 0, 0 };
        for (int i = 0; i < ACROSS; i++) {
            x[i] = -3 + 5.0 * i / (ACROSS - 1);
            const double by_rays = factor_of_sheets(x[i], c->z0, c->ze, c->alpha);
            y[3 * k][i] = factor_of_sheets_in_order(x[i], c->z0, c->ze, c->alpha);
            for (int j = 0; j < 2; j++) {
                y[3 * k + 1 + j][i] = factor_of_sheet(x[i], depths[j], c->alpha);
                error2[j] += pow(y[3 * k + 1 + j][i] - y[3 * k][i], 2) / ACROSS;
                ray_error2[j] += pow(y[3 * k + 1 + j][i] - by_rays, 2) / ACROSS;
            }
        }
        snprintf(labels[k], sizeof labels[k], "%g to %g, α = %g", c->z0, c->ze, c->alpha);
        for (int j = 0; j < 3; j++)
            series[3 * k + j] = (struct plot_series){ .label = j == 0 ? labels[k] : NULL,
                                                      .count = ACROSS,
                                                      .x = x,
                                                      .y = y[3 * k + j],
                                                      .color = colors[k],
                                                      .dash = j == 0   ? PLOT_SOLID
                                                              : j == 1 ? PLOT_DASHED
                                                                       : PLOT_DOTTED,
                                                      .is_thin = j > 0 };
        printf("| %g to %g | %g | %.2e | %.2e | %.2f | %.2e | %.2e | %.2f |\n", c->z0, c->ze, c->alpha,
               error2[0], error2[1], error2[0] / error2[1], ray_error2[0], ray_error2[1],
               ray_error2[0] / ray_error2[1]);
    }
    const struct plot plot = {
        .title = title,
        .subtitle =
            "Solid: 1000 thin sheets, each with what those before it leave. Dashed: one sheet at half "
            "absorption. Dotted: one in the middle.",
        .x = { .title = "place on the receiver, in widths of the light" },
        .y = { .title = "shadow factor", .min = 0, .max = 1 },
        .series = series,
        .series_count = 3 * CASES,
        .has_legend = true
    };
    return write_plot(&plot, stem, name, status);
}

static bool run_edges(const char *stem, dipole_status *status)
{
    static const struct edge_case thickness[CASES] = {
        { 4.5, 5.5, 0.8 }, { 4, 6, 0.8 }, { 3, 7, 0.8 }, { 2, 8, 0.8 }
    };
    static const struct edge_case alpha[CASES] = {
        { 3, 7, 0.1 }, { 3, 7, 0.5 }, { 3, 7, 0.9 }, { 3, 7, 0.99 }
    };
    return draw_edges(thickness, stem, "thickness", "The edge of a blocker, by its thickness", status) &&
           draw_edges(alpha, stem, "alpha", "The edge of a blocker, by its opacity", status);
}

/* ---- scenes -------------------------------------------------------------------------------------- */

struct bench {
    struct io_scene *scene;
    struct renderer *renderer;
    int width_px, height_px;
    float *position_mm, *normal;
    double *truth; /* three for each pixel */
};

/* Time of the shadows' effects, the least of several, and the factor of each pixel. */
static bool draw_once(struct bench *bench, const struct render_shadow_options *options, float *shadow,
                      double *ms_out, dipole_status *status)
{
    enum { RUNS = 4 };
    const struct render_request request = { .scene = bench->scene,
                                            .media = bench->renderer->media,
                                            .technique = RENDER_TECHNIQUE_LAMBERT,
                                            .shadows = *options,
                                            .epsilon = 0.01 };
    *ms_out = INFINITY;
    for (int i = 0; i < RUNS; i++) {
        struct render_plan *plan;
        double time_ms[RENDER_EFFECT_LIMIT], ms = 0;
        if (!render_run(bench->renderer, &request, &plan, time_ms, status))
            return false;
        for (size_t e = 0; e < plan->effect_count; e++) {
            const char *const name = render_effects[e]->name;
            if (strncmp(name, "shadow", 6) == 0 || strncmp(name, "avsm", 4) == 0 ||
                strcmp(name, "soft_shadow") == 0)
                ms += time_ms[e];
        }
        *ms_out = fmin(*ms_out, ms);
        render_plan_destroy(plan);
    }
    return render_executor_read(bench->renderer->executor, "shadow", shadow, status);
}

/* A pixel's surface is the mean of points of it, which may lie below its facets. */
#define LIFT_MM 0.03

static bool trace_truth(struct bench *bench, int place_count, dipole_status *status)
{
    struct render_tracer *tracer;
    if (!render_tracer_create(bench->scene, &tracer, status))
        return false;
    for (int i = 0; i < bench->width_px * bench->height_px; i++) {
        struct render_surface_point point = { .object = 0 };
        for (int k = 0; k < 3; k++) {
            point.facet_normal[k] = point.normal[k] = (double)bench->normal[4 * i + k];
            point.position_mm[k] = (double)bench->position_mm[4 * i + k] + LIFT_MM * point.normal[k];
        }
        if (bench->position_mm[4 * i + 3] > 0)
            render_light_left(tracer, &bench->scene->lights[0], &point, place_count,
                              bench->truth + 3 * (size_t)i);
    }
    render_tracer_destroy(tracer);
    return true;
}

/* Cosine between a pixel's normal and the way to the middle of the light; 0 where it looks away. */
static double cosine_of(const struct bench *bench, int pixel)
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

/* Of irradiance, relative to its root mean square, over pixels that show an object: factors count by the
 * cosine. */
static double relative_rmse(const struct bench *bench, const float *shadow)
{
    double error2 = 0, value2 = 0;
    for (int i = 0; i < bench->width_px * bench->height_px; i++) {
        const double cosine = cosine_of(bench, i);
        for (int c = 0; c < 3 && cosine > 0; c++) {
            const double truth = bench->truth[3 * (size_t)i + (size_t)c];
            error2 += pow(cosine * ((double)shadow[4 * i + c] - truth), 2);
            value2 += pow(cosine * truth, 2);
        }
    }
    return sqrt(error2 / value2);
}

static void print_row(const char *name, const char *nodes, int taps, int side_px, double rmse, double ms)
{
    printf("| %s | %s | %d | %d | %.2f | %.0f |\n", name, nodes, taps, side_px, 100 * rmse, ms);
}

static bool run_scene(struct bench *bench, const char *name, int place_count, dipole_status *status)
{
    static const struct {
        const char *nodes;
        struct render_shadow_options options;
    } rows[] = {
        { "8", { 8, 25, 1024 } },         { "4", { 4, 25, 1024 } }, { "16", { 16, 25, 1024 } },
        { "all", { INT_MAX, 25, 1024 } }, { "8", { 8, 9, 1024 } },  { "8", { 8, 64, 1024 } },
        { "8", { 8, 25, 512 } },          { "8", { 8, 25, 2048 } },
    };
    const size_t pixels = (size_t)bench->width_px * (size_t)bench->height_px;
    float *const shadow = malloc(4 * pixels * sizeof *shadow);
    bench->position_mm = malloc(4 * pixels * sizeof *bench->position_mm);
    bench->normal = malloc(4 * pixels * sizeof *bench->normal);
    bench->truth = calloc(3 * pixels, sizeof *bench->truth);
    struct io_light *const light = &bench->scene->lights[0];
    const struct io_light soft = *light;
    double soft_ms, hard_ms, ms;
    bool done =
        shadow && bench->position_mm && bench->normal && bench->truth &&
        draw_once(bench, &rows[0].options, shadow, &soft_ms, status) &&
        render_executor_read(bench->renderer->executor, "position_mm", bench->position_mm, status) &&
        render_executor_read(bench->renderer->executor, "normal", bench->normal, status) &&
        trace_truth(bench, place_count, status);
    for (size_t i = 0; done && i < sizeof rows / sizeof *rows; i++) {
        done = draw_once(bench, &rows[i].options, shadow, &ms, status);
        if (done)
            print_row(name, rows[i].nodes, rows[i].options.tap_count, rows[i].options.side_px,
                      relative_rmse(bench, shadow), ms);
    }
    light->size_mm = light->size_rad = 0;
    done = done && draw_once(bench, &rows[0].options, shadow, &hard_ms, status);
    *light = soft;
    done = done && draw_once(bench, &rows[0].options, shadow, &soft_ms, status);
    if (done)
        fprintf(stderr, "| %s | %.0f | %.0f | %.2f |\n", name, hard_ms, soft_ms, soft_ms / hard_ms);
    free(shadow);
    free(bench->position_mm);
    free(bench->normal);
    free(bench->truth);
    return done;
}

int main(int argc, char **argv)
{
    struct bench bench = { .scene = NULL };
    dipole_status status = { 0 };
    bool done = false;
    if (argc == 3 && strcmp(argv[1], "edges") == 0) {
        done = run_edges(argv[2], &status);
    } else if (argc == 7 && strcmp(argv[1], "scene") == 0) {
        bench.width_px = atoi(argv[4]);
        bench.height_px = atoi(argv[5]);
        const struct io_scene_options options = { .width_px = bench.width_px,
                                                  .height_px = bench.height_px };
        done = io_scene_read(argv[2], &options, &bench.scene, &status) &&
               render_create(bench.scene, RENDER_CONTEXT_DEFAULT, &bench.renderer, &status) &&
               run_scene(&bench, argv[3], atoi(argv[6]), &status);
        render_destroy(bench.renderer);
        io_scene_destroy(bench.scene);
    } else {
        fprintf(stderr, "usage: bench_shadows edges PLOT | scene SCENE.json NAME WIDTH HEIGHT PLACES\n");
        return 2;
    }
    if (!done)
        fprintf(stderr, "bench_shadows: %s\n", status.message);
    return !done;
}
