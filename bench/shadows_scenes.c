/* What accuracy of shadows costs: error against time over nodes, taps and sides of the maps; hard and soft
 * shadows. */
#include "bench/shadows.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH_PX = 400, HEIGHT_PX = 300, PLACES = 256, SCENES = 8, RUNS = 4 };

/* Nodes first, then taps, then sides. */
enum { NODE_ROWS = 4, TAP_ROWS = 5, SIDE_ROWS = 2, ROWS = NODE_ROWS + TAP_ROWS + SIDE_ROWS };
static const struct render_shadow_options asked[ROWS] = {
    { .node_limit = 4, .tap_count = 25 },
    { .node_limit = 8, .tap_count = 25 },
    { .node_limit = 16, .tap_count = 25 },
    { .node_limit = INT_MAX, .tap_count = 25 },
    { .node_limit = 8, .tap_count = 9 },
    { .node_limit = 8, .tap_count = 16 },
    { .node_limit = 8, .tap_count = 25 },
    { .node_limit = 8, .tap_count = 49 },
    { .node_limit = 8, .tap_count = 100 },
    { .node_limit = 8, .tap_count = 25, .side_px = 512 },
    { .node_limit = 8, .tap_count = 25, .side_px = 2048 },
};

struct measured {
    double error[ROWS], ms[ROWS], hard_ms, soft_ms;
};

static void print_row(const char *name, int row, struct bench_shadows_error error, double ms)
{
    char nodes[16];
    snprintf(nodes, sizeof nodes, asked[row].node_limit == INT_MAX ? "all" : "%d", asked[row].node_limit);
    printf("| %s | %s | %d | %d | %.2f | %.2f | %.0f |\n", name, nodes, asked[row].tap_count,
           asked[row].side_px > 0 ? asked[row].side_px : RENDER_SHADOW_SIDE, 100 * error.factor,
           100 * error.irradiance, ms);
    fflush(stdout);
}

/* Soft and hard in turns: what else the machine does meets both. */
static bool measure_ratio(struct bench_shadows *bench, struct measured *found, dipole_status *status)
{
    struct io_light *const light = &bench->scene->lights[0];
    const struct io_light soft = *light;
    double ms;
    bool done = true;
    for (int i = 0; done && i < RUNS; i++) {
        done = bench_shadows_draw(bench, &asked[1], 1, &ms, status);
        found->soft_ms = i == 0 || ms < found->soft_ms ? ms : found->soft_ms;
        light->size_mm = light->size_rad = 0;
        done = done && bench_shadows_draw(bench, &asked[1], i == 0 ? 2 : 1, &ms, status);
        found->hard_ms = i == 0 || ms < found->hard_ms ? ms : found->hard_ms;
        *light = soft;
    }
    return done;
}

static bool run_scene(const char *path, struct measured *found, dipole_status *status)
{
    struct bench_shadows bench;
    bool done = bench_shadows_begin(path, WIDTH_PX, HEIGHT_PX, &bench, status);
    for (int row = 0; done && row < ROWS; row++) {
        double ms;
        done = bench_shadows_draw(&bench, &asked[row], RUNS, &ms, status) &&
               (row > 0 || bench_shadows_trace_all(&bench, PLACES, status));
        if (!done)
            break;
        const struct bench_shadows_error error = bench_shadows_compare(&bench);
        found->error[row] = 100 * error.factor;
        found->ms[row] = ms;
        print_row(bench_shadows_name(path), row, error, ms);
    }
    done = done && measure_ratio(&bench, found, status);
    bench_shadows_end(&bench);
    return done;
}

static bool plot(char *const *paths, int count, const struct measured *found, int first, int row_count,
                 const char *stem, const char *name, const char *title, const char *subtitle,
                 dipole_status *status)
{
    struct plot_series series[2 * SCENES];
    static const enum plot_mark marks[] = { PLOT_DISC, PLOT_SQUARE, PLOT_DIAMOND, PLOT_TRIANGLE };
    static const char *const colors[] = { PLOT_BLUE, PLOT_RED, PLOT_GREEN, "#e69f00", PLOT_GREY };
    for (int i = 0; i < count; i++) {
        series[2 * i] = (struct plot_series){ .label = bench_shadows_name(paths[i]),
                                              .count = (size_t)row_count,
                                              .x = found[i].ms + first,
                                              .y = found[i].error + first,
                                              .color = colors[i % 5] };
        series[2 * i + 1] = series[2 * i];
        series[2 * i + 1].kind = PLOT_POINTS;
        series[2 * i + 1].label = NULL;
        series[2 * i + 1].mark = marks[i % 4];
    }
    const struct plot chart = { .title = title,
                                .subtitle = subtitle,
                                .x = { .title = "ms of all effects of shadows", .scale = PLOT_LOG },
                                .y = { .title = "relative RMSE of the shadow factor, %",
                                       .scale = PLOT_LOG },
                                .series = series,
                                .series_count = 2 * (size_t)count };
    return bench_write_plot(&chart, stem, name, status);
}

bool bench_shadows_scenes(char *const *paths, int count, const char *stem, dipole_status *status)
{
    static struct measured found[SCENES];
    /* of the paper's scenes of these kinds, on a graphics processor */
    static const char *const kinds[] = { "solid", "particles", "hair", "mixed" };
    static const double papers[] = { 2.0, 2.5, 1.3, 2.5 };
    if (count > SCENES)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%d scenes, expected at most %d", count, SCENES);
    puts("| scene | nodes | taps | side | factor % | irradiance % | ms |\n|---|---|---|---|---|---|---|");
    for (int i = 0; i < count; i++) {
        if (!run_scene(paths[i], &found[i], status))
            return false;
    }
    puts("\n| scene | hard ms | soft ms | ratio | the paper's |\n|---|---|---|---|---|");
    for (int i = 0; i < count; i++) {
        printf("| %s | %.0f | %.0f | %.2f |", bench_shadows_name(paths[i]), found[i].hard_ms,
               found[i].soft_ms, found[i].soft_ms / found[i].hard_ms);
        for (int k = 0; k < 4; k++) {
            if (strcmp(kinds[k], bench_shadows_name(paths[i])) == 0)
                printf(" %.1f", papers[k]);
        }
        puts(" |");
    }
    return plot(paths, count, found, 0, NODE_ROWS, stem, "nodes", "Error and time by the number of nodes",
                "4, 8, 16 and all nodes of each texel's transmittance; 25 taps.", status) &&
           plot(paths, count, found, NODE_ROWS, TAP_ROWS, stem, "taps",
                "Error and time by the number of taps",
                "9, 16, 25, 49 and 100 taps that search, and as many that filter; 8 nodes.", status);
}
