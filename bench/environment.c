/*
 * What each order of harmonics leaves of a map's irradiance, and takes.
 * usage: bench_environment MAP.exr ETA EPSILON
 *        bench_environment --plot OUTPUT.svg ETA EPSILON MAP.exr...
 *
 * Markdown rows: order, with a star where the plan takes it at that epsilon; predicted error, largest error
 * and root mean square over 500 normals, by the mean irradiance, in %; the lowest irradiance before it is
 * kept above 0, the same; microseconds for each normal by the sum of harmonics and by the table, the least
 * of several rounds in turns, and the ratio; rows of the table and milliseconds to make it. The plot has
 * the root mean square against order.
 */
#include "io/file.h"
#include "plot/plot.h"
#include "renderer/irradiance_table.h"
#include "renderer/reference_environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { NORMALS = 500, ROUNDS = 7, MAPS = 3, ORDERS = 13 };

/* As renderer/plan_internal.h shares epsilon out. */
#define HARMONICS_SHARE 0.08
#define TABLE_SHARE 0.02

static const int orders[ORDERS] = { 0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64 };

static double now_us(void)
{
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec * 1e-3;
}

static double normals[NORMALS][3];

/* Even over the sphere: a spiral. */
static void find_normals(void)
{
    for (int i = 0; i < NORMALS; i++) {
        const double y = 1 - (2 * i + 1.0) / NORMALS, s = sqrt(1 - y * y), phi = 2.39996322972865332 * i;
        normals[i][0] = s * sin(phi);
        normals[i][1] = y;
        normals[i][2] = s * cos(phi);
    }
}

struct row {
    double predicted, largest, rms, lowest;
    double sum_us, table_us, make_ms;
    int table_rows;
};

static void find_errors(const struct render_irradiance *irradiance, double (*exact)[3], struct row *row)
{
    double square = 0;
    *row = (struct row){ .predicted = irradiance->error, .lowest = INFINITY };
    for (int i = 0; i < NORMALS; i++) {
        double rgb[3];
        render_harmonics_sum(&irradiance->environment->harmonics, irradiance->order,
                             (const double(*)[3])irradiance->coefficients, normals[i], rgb);
        for (int c = 0; c < 3; c++) {
            const double error = (rgb[c] - exact[i][c]) / irradiance->mean[c];
            row->largest = fmax(row->largest, fabs(error));
            square += error * error / (3 * NORMALS);
            row->lowest = fmin(row->lowest, rgb[c] / irradiance->mean[c]);
        }
    }
    row->rms = sqrt(square);
}

/* Both ways in turns; the sum of what they find is kept, so that none of it is left out. */
static bool find_times(const struct render_irradiance *irradiance, double epsilon, struct row *row)
{
    static volatile double kept;
    row->sum_us = row->table_us = row->make_ms = INFINITY;
    for (int round = 0; round < ROUNDS; round++) {
        struct render_irradiance_table *table;
        double rgb[3], sum = 0;
        const double start_us = now_us();
        if (!render_irradiance_table_create(irradiance, TABLE_SHARE * epsilon, &table, NULL))
            return false;
        const double made_us = now_us();
        for (int i = 0; i < NORMALS; i++) {
            render_irradiance_at(irradiance, normals[i], rgb);
            sum += rgb[0];
        }
        const double summed_us = now_us();
        for (int i = 0; i < NORMALS; i++) {
            render_irradiance_table_at(table, normals[i], rgb);
            sum += rgb[0];
        }
        const double end_us = now_us();
        kept = sum;
        row->make_ms = fmin(row->make_ms, (made_us - start_us) / 1e3);
        row->sum_us = fmin(row->sum_us, (summed_us - made_us) / NORMALS);
        row->table_us = fmin(row->table_us, (end_us - summed_us) / NORMALS);
        row->table_rows = table->rows;
        render_irradiance_table_destroy(table);
    }
    return kept >= 0;
}

struct probe {
    struct render_environment *environment;
    double exact[NORMALS][3];
    int chosen;
};

static bool probe_init(const char *path, double eta, double epsilon, struct probe *probe,
                       dipole_status *status)
{
    struct io_environment source = { .rgb = { 1, 1, 1 } };
    struct render_exact_irradiance *exact;
    struct render_irradiance *irradiance;
    snprintf(source.path, sizeof source.path, "%s", path);
    if (!render_environment_read(&source, &probe->environment, status) ||
        !render_exact_irradiance_create(probe->environment, eta, 0, &exact, status))
        return false;
    for (int i = 0; i < NORMALS; i++)
        render_exact_irradiance_sum(exact, normals[i], probe->exact[i]);
    render_exact_irradiance_destroy(exact);
    if (!render_irradiance_create(probe->environment, eta, HARMONICS_SHARE * epsilon, &irradiance, status))
        return false;
    probe->chosen = irradiance->order;
    render_irradiance_destroy(irradiance);
    return true;
}

static bool print_order(struct probe *probe, double eta, double epsilon, int order, dipole_status *status)
{
    struct render_irradiance *irradiance;
    struct row row;
    if (!render_irradiance_create_of_order(probe->environment, eta, order, &irradiance, status))
        return false;
    find_errors(irradiance, probe->exact, &row);
    const bool done = find_times(irradiance, epsilon, &row);
    printf("%d%s | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g | %d | %.2g\n", order,
           order == probe->chosen ? " *" : "", 100 * row.predicted, 100 * row.largest, 100 * row.rms,
           100 * row.lowest, row.sum_us, row.table_us, row.sum_us / row.table_us, row.table_rows,
           row.make_ms);
    render_irradiance_destroy(irradiance);
    return done;
}

static bool print_orders(const char *path, double eta, double epsilon, dipole_status *status)
{
    static struct probe probe;
    bool done = probe_init(path, eta, epsilon, &probe, status);
    for (int i = 0; done && i < ORDERS; i++) {
        done = print_order(&probe, eta, epsilon, orders[i], status);
        if (done && orders[i] < probe.chosen && i + 1 < ORDERS && orders[i + 1] > probe.chosen)
            done = print_order(&probe, eta, epsilon, probe.chosen, status);
    }
    render_environment_destroy(probe.environment);
    return done;
}

/* ---- the plot ----------------------------------------------------------------------------------- */

static const char *name_of(const char *path, char name[64])
{
    const char *const slash = strrchr(path, '/');
    snprintf(name, 64, "%s", slash ? slash + 1 : path);
    name[strcspn(name, ".")] = '\0';
    return name;
}

static bool plot_maps(const char *output, double eta, double epsilon, int count, char *const *paths,
                      dipole_status *status)
{
    static struct probe probe;
    static double x[RENDER_HARMONIC_LIMIT + 1], y[MAPS][RENDER_HARMONIC_LIMIT + 1], chosen[MAPS][2];
    static char names[MAPS][64];
    static const char *const colors[MAPS] = { PLOT_BLUE, PLOT_GREEN, PLOT_RED };
    struct plot_series series[2 * MAPS] = { { .kind = PLOT_LINE } };
    bool done = true;
    for (int p = 0; done && p < count; p++) {
        done = probe_init(paths[p], eta, epsilon, &probe, status);
        for (int order = 0; done && order <= RENDER_HARMONIC_LIMIT; order++) {
            struct render_irradiance *irradiance;
            struct row row;
            done = render_irradiance_create_of_order(probe.environment, eta, order, &irradiance, status);
            if (!done)
                break;
            find_errors(irradiance, probe.exact, &row);
            render_irradiance_destroy(irradiance);
            x[order] = order;
            y[p][order] = 100 * row.rms;
        }
        chosen[p][0] = probe.chosen;
        chosen[p][1] = y[p][probe.chosen];
        series[2 * p] = (struct plot_series){ .label = name_of(paths[p], names[p]),
                                              .count = RENDER_HARMONIC_LIMIT + 1,
                                              .x = x,
                                              .y = y[p],
                                              .dash = (enum plot_dash)p,
                                              .color = colors[p] };
        series[2 * p + 1] = (struct plot_series){
            .kind = PLOT_POINTS, .count = 1, .x = &chosen[p][0], .y = &chosen[p][1], .color = colors[p]
        };
        render_environment_destroy(probe.environment);
    }
    const struct plot_marker bar = {
        .is_horizontal = true, .value = 2, .label = "2 %", .dash = PLOT_DOTTED
    };
    const struct plot plot = {
        .title = "What orders of harmonics leave of a map's irradiance",
        .subtitle =
            "root mean square over 500 normals, against the map itself; points: the order that is taken",
        .x = { .title = "order", .min = 0, .max = RENDER_HARMONIC_LIMIT },
        .y = { .title = "error, % of the mean irradiance", .scale = PLOT_LOG },
        .series = series,
        .series_count = (size_t)(2 * count),
        .markers = &bar,
        .marker_count = 1,
    };
    char *svg = NULL;
    size_t size;
    done = done && plot_svg_create(&plot, &svg, &size, status) && io_file_write(output, svg, size, status);
    free(svg);
    return done;
}

int main(int argc, char **argv)
{
    dipole_status status = { 0 };
    const bool is_plot = argc > 5 && argc <= 5 + MAPS && strcmp(argv[1], "--plot") == 0;
    if (!is_plot && argc != 4) {
        fputs("usage: bench_environment MAP.exr ETA EPSILON\n"
              "       bench_environment --plot OUTPUT.svg ETA EPSILON MAP.exr...\n",
              stderr);
        return 2;
    }
    find_normals();
    const bool done =
        is_plot
            ? plot_maps(argv[2], strtod(argv[3], NULL), strtod(argv[4], NULL), argc - 5, argv + 5, &status)
            : print_orders(argv[1], strtod(argv[2], NULL), strtod(argv[3], NULL), &status);
    if (!done)
        fprintf(stderr, "bench_environment: %s\n", status.message);
    return done ? 0 : 1;
}
