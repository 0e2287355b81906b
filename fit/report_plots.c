/* Profiles, what they leave of measured points, and how the searches went. */
#include "fit/report_page.h"

#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Most points of a curve that are drawn, and most searches that are named beside their lines. */
enum { POINT_LIMIT = 1000, SEARCH_POINT_LIMIT = 200, SEARCH_NAME_LIMIT = 8 };
enum { PLOT_WIDTH_PX = 600, PLOT_HEIGHT_PX = 400, RESIDUAL_HEIGHT_PX = 240 };
static const double residual_limit_percent = 100;

static bool add_plot(struct plot_text *page, const struct plot *plot, dipole_status *status)
{
    char *svg;
    size_t size;
    if (!plot_svg_create(plot, &svg, &size, status))
        return false;
    fit_page_add(page, "<div class=\"plot\">");
    plot_text_add(page, svg, size);
    fit_page_add(page, "</div>\n");
    free(svg);
    return true;
}

/* Which of count values stands at place i of the kept ones: evenly, with the first and the last. */
static size_t kept_index(size_t i, size_t count, size_t kept)
{
    return kept < 2 ? 0 : i * (count - 1) / (kept - 1);
}

static size_t kept_count(size_t count, size_t limit)
{
    return count < limit ? count : limit;
}

static void keep(double *out, const double *values, size_t count, size_t limit)
{
    const size_t kept = kept_count(count, limit);
    for (size_t i = 0; i < kept; i++)
        out[i] = values[kept_index(i, count, kept)];
}

/* ---- profiles -----------------------------------------------------------------------------------------
 */

/* A profile with few enough points to be drawn. */
struct curves {
    size_t count, measured_count;
    bool has_sem;
    double r_mm[POINT_LIMIT], rd[POINT_LIMIT], low[POINT_LIMIT], high[POINT_LIMIT];
    double measured_r_mm[POINT_LIMIT], measured[POINT_LIMIT], measured_low[POINT_LIMIT],
        measured_high[POINT_LIMIT];
    /* The same over what was found, less 1, in %. */
    double zero[POINT_LIMIT], band_low[POINT_LIMIT], band_high[POINT_LIMIT];
    double residual[POINT_LIMIT], residual_low[POINT_LIMIT], residual_high[POINT_LIMIT];
};

/* The model between its points, straight in logarithms where there are any; NaN beyond them. */
static double model_at(const struct curves *curves, double r_mm)
{
    for (size_t i = 0; i + 1 < curves->count; i++) {
        const double *const r = curves->r_mm + i, *const rd = curves->rd + i;
        if (!(r_mm >= r[0] && r_mm <= r[1] && r[1] > r[0]))
            continue;
        const double along = r[0] > 0 ? log(r_mm / r[0]) / log(r[1] / r[0]) : (r_mm - r[0]) / (r[1] - r[0]);
        return rd[0] > 0 && rd[1] > 0 ? rd[0] * pow(rd[1] / rd[0], along) : rd[0] + along * (rd[1] - rd[0]);
    }
    return NAN;
}

static double residual_percent(double measured, double model)
{
    return model > 0 ? 100 * (measured / model - 1) : NAN;
}

static void measured_fill(const struct fit_report_profile *profile, struct curves *curves)
{
    const size_t count = profile->measured_count, kept = kept_count(count, POINT_LIMIT);
    curves->measured_count = kept;
    const double *const sems = profile->measured_sem_per_mm2;
    curves->has_sem = sems != NULL;
    keep(curves->measured_r_mm, profile->measured_r_mm, count, POINT_LIMIT);
    keep(curves->measured, profile->measured_rd_per_mm2, count, POINT_LIMIT);
    for (size_t i = 0; i < kept; i++) {
        const double sem = sems ? sems[kept_index(i, count, kept)] : 0;
        const double model = model_at(curves, curves->measured_r_mm[i]);
        curves->measured_low[i] = curves->measured[i] - sem;
        curves->measured_high[i] = curves->measured[i] + sem;
        curves->residual[i] = residual_percent(curves->measured[i], model);
        curves->residual_low[i] = residual_percent(curves->measured_low[i], model);
        curves->residual_high[i] = residual_percent(curves->measured_high[i], model);
    }
}

static struct curves *curves_create(const struct fit_report_profile *profile, dipole_status *status)
{
    struct curves *const curves = calloc(1, sizeof *curves);
    if (!curves) {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to draw a profile");
        return NULL;
    }
    curves->count = kept_count(profile->count, POINT_LIMIT);
    keep(curves->r_mm, profile->r_mm, profile->count, POINT_LIMIT);
    keep(curves->rd, profile->rd_per_mm2, profile->count, POINT_LIMIT);
    keep(curves->low, profile->low_per_mm2, profile->count, POINT_LIMIT);
    keep(curves->high, profile->high_per_mm2, profile->count, POINT_LIMIT);
    for (size_t i = 0; i < curves->count; i++) {
        curves->band_low[i] = residual_percent(curves->low[i], curves->rd[i]);
        curves->band_high[i] = residual_percent(curves->high[i], curves->rd[i]);
    }
    measured_fill(profile, curves);
    return curves;
}

static const char *channel_color(const char *name)
{
    const bool is_channel = name[0] && (name[1] == '\0' || name[1] == ':');
    return is_channel && name[0] == 'R' ? PLOT_RED : is_channel && name[0] == 'G' ? PLOT_GREEN : PLOT_BLUE;
}

/* What both charts of a profile show: a band, a line and points. */
static void series_fill(const struct curves *curves, const char *color, struct plot_series series[3])
{
    series[0] = (struct plot_series){ .kind = PLOT_BAND,
                                      .label = "95 % band",
                                      .count = curves->count,
                                      .x = curves->r_mm,
                                      .y_low = curves->low,
                                      .y_high = curves->high,
                                      .color = color };
    series[1] = (struct plot_series){
        .label = "found", .count = curves->count, .x = curves->r_mm, .y = curves->rd, .color = color
    };
    series[2] = (struct plot_series){ .kind = PLOT_POINTS,
                                      .label = "measured",
                                      .count = curves->measured_count,
                                      .x = curves->measured_r_mm,
                                      .y = curves->measured,
                                      .y_low = curves->has_sem ? curves->measured_low : NULL,
                                      .y_high = curves->has_sem ? curves->measured_high : NULL,
                                      .color = PLOT_GREY,
                                      .is_hollow = true };
}

static bool add_curves(struct plot_text *page, const char *name, const struct curves *curves,
                       dipole_status *status)
{
    struct plot_series series[3];
    series_fill(curves, channel_color(name), series);
    const struct plot plot = {
        .width_px = PLOT_WIDTH_PX,
        .height_px = PLOT_HEIGHT_PX,
        .title = name,
        .x = { .title = "r in mm", .scale = PLOT_LOG },
        .y = { .title = "R_d(r) in 1/mm²", .scale = PLOT_LOG },
        .series = series,
        .series_count = curves->measured_count > 0 ? 3 : 2,
        .has_legend = true,
    };
    return add_plot(page, &plot, status);
}

/* Limits that hold all residuals, but not those without measure. */
static double residual_range(const struct curves *curves)
{
    double range = 1;
    for (size_t i = 0; i < curves->measured_count; i++)
        range = fmax(range, 1.1 * fabs(curves->residual[i]));
    return fmin(range, residual_limit_percent);
}

/* Of the same distances as the curves above it. */
static bool add_residuals(struct plot_text *page, const char *name, const struct curves *curves,
                          dipole_status *status)
{
    const double range = residual_range(curves);
    struct plot_series series[3];
    series_fill(curves, channel_color(name), series);
    series[0].y_low = curves->band_low;
    series[0].y_high = curves->band_high;
    series[1].y = curves->zero;
    series[2].y = curves->residual;
    if (curves->has_sem) {
        series[2].y_low = curves->residual_low;
        series[2].y_high = curves->residual_high;
    }
    const struct plot plot = {
        .width_px = PLOT_WIDTH_PX,
        .height_px = RESIDUAL_HEIGHT_PX,
        .x = { .title = "r in mm", .scale = PLOT_LOG },
        .y = { .title = "residual in %", .min = -range, .max = range },
        .series = series,
        .series_count = 3,
        .has_legend = true,
    };
    return add_plot(page, &plot, status);
}

/* How many points are not in the chart of residuals. */
static int beyond_count(const struct curves *curves)
{
    const double range = residual_range(curves);
    int count = 0;
    for (size_t i = 0; i < curves->measured_count; i++)
        count += fabs(curves->residual[i]) > range;
    return count;
}

static bool add_figure(struct plot_text *page, const struct fit_report_profile *profile,
                       const struct curves *curves, dipole_status *status)
{
    fit_page_add(page, "<figure>\n");
    if (!add_curves(page, profile->name, curves, status))
        return false;
    if (curves->measured_count > 0) {
        if (!add_residuals(page, profile->name, curves, status))
            return false;
        fit_page_add(page, "<figcaption>");
        if (curves->measured_count < profile->measured_count)
            plot_text_print(page, "Of %d measured points, %d are drawn. ", (int)profile->measured_count,
                            (int)curves->measured_count);
        fit_page_add(page, "Residual: measured over found, less 1");
        if (beyond_count(curves) > 0)
            plot_text_print(page, "; %d points lie beyond the chart", beyond_count(curves));
        fit_page_add(page, ". ");
        fit_page_add(page, curves->has_sem ? "Bars: one standard error each way.</figcaption>\n"
                                           : "No standard errors were given.</figcaption>\n");
    }
    fit_page_add(page, "</figure>\n");
    return true;
}

bool fit_page_add_profile(struct plot_text *page, const struct fit_report_profile *profile,
                          dipole_status *status)
{
    struct curves *const curves = curves_create(profile, status);
    const bool done = curves && add_figure(page, profile, curves, status);
    free(curves);
    return done;
}

/* ---- searches -----------------------------------------------------------------------------------------
 */

/* The one that ends lowest, of those that compare. */
static size_t best_search(const struct fit_report *report)
{
    size_t best = 0;
    double lowest = INFINITY;
    for (size_t i = 0; i < report->search_count; i++) {
        const struct fit_report_search *const search = &report->searches[i];
        if (search->count > 0 && !search->is_reweighed &&
            search->sum_of_squares[search->count - 1] < lowest) {
            lowest = search->sum_of_squares[search->count - 1];
            best = i;
        }
    }
    return best;
}

/* values has room for 2 x SEARCH_POINT_LIMIT for each search. */
static void searches_fill(const struct fit_report *report, struct plot_series *series, double *values)
{
    const size_t best = best_search(report);
    for (size_t i = 0; i < report->search_count; i++) {
        const struct fit_report_search *const search = &report->searches[i];
        double *const iterations = values + 2 * SEARCH_POINT_LIMIT * i;
        double *const sums = iterations + SEARCH_POINT_LIMIT;
        const size_t kept = kept_count(search->count, SEARCH_POINT_LIMIT);
        for (size_t k = 0; k < kept; k++)
            iterations[k] = (double)kept_index(k, search->count, kept) + 1;
        keep(sums, search->sum_of_squares, search->count, SEARCH_POINT_LIMIT);
        const bool has_name =
            report->search_count <= SEARCH_NAME_LIMIT || i == best || i + 1 == report->search_count;
        series[i] = (struct plot_series){
            .kind = kept == 1 ? PLOT_POINTS : PLOT_LINE,
            .label = has_name ? search->name : NULL,
            .count = kept,
            .x = iterations,
            .y = sums,
            .color = has_name ? NULL : PLOT_GREY,
            .is_thin = i != best,
        };
    }
}

static bool add_search_plot(struct plot_text *page, const struct fit_report *report,
                            const struct plot_series *series, dipole_status *status)
{
    const struct plot plot = {
        .width_px = PLOT_WIDTH_PX,
        .height_px = PLOT_HEIGHT_PX,
        .x = { .title = "iteration" },
        .y = { .title = "sum of squares", .scale = PLOT_LOG },
        .series = series,
        .series_count = report->search_count,
    };
    fit_page_add(page, "<h2>How the search went</h2>\n<figure>\n");
    if (!add_plot(page, &plot, status))
        return false;
    int compared_count = 0;
    for (size_t i = 0; i < report->search_count; i++)
        compared_count += !report->searches[i].is_reweighed;
    if (compared_count > 1)
        plot_text_print(page, "<figcaption>The thick line is the search that ended lowest, of %d.",
                        compared_count);
    else
        fit_page_add(page, "<figcaption>The thick line is the search for the best values.");
    if (compared_count < (int)report->search_count)
        fit_page_add(page, " The lines called weights are the searches that followed, each with weights by "
                           "what the one before it left: their sums do not compare with others.");
    fit_page_add(page, "</figcaption>\n</figure>\n");
    return true;
}

bool fit_page_add_searches(struct plot_text *page, const struct fit_report *report, dipole_status *status)
{
    if (report->search_count == 0)
        return true;
    double *const values = calloc(report->search_count, 2 * SEARCH_POINT_LIMIT * sizeof *values);
    struct plot_series *const series = calloc(report->search_count, sizeof *series);
    bool done = values && series;
    if (done) {
        searches_fill(report, series, values);
        done = add_search_plot(page, report, series, status);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to draw %zu searches",
                    report->search_count);
    }
    free(values);
    free(series);
    return done;
}
