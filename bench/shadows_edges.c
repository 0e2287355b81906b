/* The edge of an extended blocker: one replacement against many thin sheets, and against rays. */
#include "bench/shadows.h"

#include "renderer/blocker.h"

#include <math.h>
#include <stdio.h>

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
    return bench_write_plot(&plot, stem, name, status);
}

bool bench_shadows_edges(const char *stem, dipole_status *status)
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
