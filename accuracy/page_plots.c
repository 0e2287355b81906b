#include "accuracy/page_internal.h"

#include "plot/plot.h"

#include "renderer/plan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { TIP_SIZE = 160, SERIES_LIMIT = 2 * ACCURACY_SETTING_LIMIT };

size_t accuracy_knob_count(void)
{
    size_t count = 0;
    while (accuracy_knobs[count].name)
        count++;
    return count;
}

static const char *const norm_titles[] = { "relative RMSE", "Weber error, 99th percentile",
                                           "largest error over the brightest" };

static double error_of(const struct accuracy_point *point, enum accuracy_norm norm)
{
    return norm == ACCURACY_RMSE    ? point->error.rmse
           : norm == ACCURACY_WEBER ? point->error.weber_99
                                    : point->error.max;
}

/* What a plot shows, series by series. */
struct curves {
    double x[ACCURACY_POINT_LIMIT], y[ACCURACY_POINT_LIMIT];
    char tips[ACCURACY_POINT_LIMIT][TIP_SIZE];
    const char *tip_of[ACCURACY_POINT_LIMIT];
    size_t count;
    struct plot_series series[SERIES_LIMIT];
    size_t series_count;
};

static struct plot_series *begin_series(struct curves *curves, enum plot_kind kind, const char *label)
{
    struct plot_series *const series = &curves->series[curves->series_count++];
    *series = (struct plot_series){
        .kind = kind, .label = label, .x = curves->x + curves->count, .y = curves->y + curves->count
    };
    if (kind == PLOT_POINTS)
        series->tips = curves->tip_of + curves->count;
    return series;
}

static void add_to(struct curves *curves, struct plot_series *series, double x, double y,
                   const struct accuracy_point *point)
{
    if (curves->count == ACCURACY_POINT_LIMIT)
        return;
    curves->x[curves->count] = x;
    curves->y[curves->count] = y;
    snprintf(curves->tips[curves->count], TIP_SIZE,
             "%s, %s: %.3g ms, RMSE %.3g %%, Weber %.3g %%, max %.3g %%", point->knob->title,
             point->setting.label, point->time_ms.median, 100 * point->error.rmse,
             100 * point->error.weber_99, 100 * point->error.max);
    curves->tip_of[curves->count] = curves->tips[curves->count];
    curves->count++;
    series->count++;
}

size_t accuracy_list_points(const struct accuracy_sweep *sweep, const struct accuracy_knob *knob,
                            const struct accuracy_point **list)
{
    size_t count = 0;
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        const bool is_asked = knob ? point->knob == knob : accuracy_point_is_best(sweep, i, true);
        if (!point->is_drawn || point->time_count == 0 || !is_asked)
            continue;
        size_t place = count++;
        for (; place > 0 && list[place - 1]->time_ms.median > point->time_ms.median; place--)
            list[place] = list[place - 1];
        list[place] = point;
    }
    return count;
}

bool accuracy_draw_main_plot(const struct accuracy_sweep *sweep, enum accuracy_norm norm, char **svg_out,
                             size_t *size_out, dipole_status *status)
{
    static const enum plot_mark marks[] = { PLOT_DISC, PLOT_SQUARE, PLOT_DIAMOND, PLOT_TRIANGLE };
    const struct accuracy_point *list[ACCURACY_POINT_LIMIT];
    struct curves *const curves = calloc(1, sizeof *curves);
    *svg_out = NULL;
    if (!curves)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a plot");
    if (norm == ACCURACY_RMSE) {
        struct plot_series *const front = begin_series(curves, PLOT_LINE, "best of all");
        front->color = PLOT_GREY;
        front->dash = PLOT_DASHED;
        const size_t count = accuracy_list_points(sweep, NULL, list);
        for (size_t i = 0; i < count; i++)
            add_to(curves, front, list[i]->time_ms.median, list[i]->error.rmse, list[i]);
    }
    for (size_t k = 0; k < accuracy_knob_count(); k++) {
        const size_t count = accuracy_list_points(sweep, &accuracy_knobs[k], list);
        if (count == 0)
            continue;
        struct plot_series *const series = begin_series(curves, PLOT_POINTS, accuracy_knobs[k].title);
        series->mark = marks[k % 4];
        series->is_hollow = k / 4 % 2 == 1;
        for (size_t i = 0; i < count; i++)
            add_to(curves, series, list[i]->time_ms.median, error_of(list[i], norm), list[i]);
    }
    const struct plot plot = { .title = norm == ACCURACY_RMSE ? "What accuracy costs in time"
                                                              : norm_titles[norm],
                               .x = { .title = "time of a picture, ms", .scale = PLOT_LOG },
                               .y = { .title = norm_titles[norm], .scale = PLOT_LOG },
                               .series = curves->series,
                               .series_count = curves->series_count,
                               .has_legend = true };
    const bool done = plot_svg_create(&plot, svg_out, size_out, status);
    free(curves);
    return done;
}

/* One knob: measured with its spread, and predicted. */
bool accuracy_draw_knob_plot(const struct accuracy_sweep *sweep, const struct accuracy_knob *knob,
                             char **svg_out, size_t *size_out, dipole_status *status)
{
    const struct accuracy_point *list[ACCURACY_POINT_LIMIT];
    struct curves *const curves = calloc(1, sizeof *curves);
    *svg_out = NULL;
    if (!curves)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a plot");
    const size_t count = accuracy_list_points(sweep, knob, list);
    struct plot_series *const line = begin_series(curves, PLOT_LINE, NULL);
    line->color = PLOT_BLUE;
    line->is_thin = true;
    for (size_t i = 0; i < count; i++)
        add_to(curves, line, list[i]->time_ms.median, list[i]->error.rmse, list[i]);
    struct plot_series *const measured = begin_series(curves, PLOT_POINTS, "measured");
    measured->color = PLOT_BLUE;
    for (size_t i = 0; i < count; i++)
        add_to(curves, measured, list[i]->time_ms.median, list[i]->error.rmse, list[i]);
    struct plot_series *const predicted = begin_series(curves, PLOT_POINTS, "predicted");
    predicted->color = PLOT_RED;
    predicted->is_hollow = true;
    for (size_t i = 0; i < count; i++)
        add_to(curves, predicted, list[i]->predicted_ms, list[i]->error_predicted, list[i]);
    const struct plot plot = { .width_px = 640,
                               .height_px = 400,
                               .title = knob->title,
                               .x = { .title = "time of a picture, ms", .scale = PLOT_LOG },
                               .y = { .title = "relative RMSE", .scale = PLOT_LOG },
                               .series = curves->series,
                               .series_count = curves->series_count };
    const bool done = plot_svg_create(&plot, svg_out, size_out, status);
    free(curves);
    return done;
}

bool accuracy_draw_time_plot(const struct accuracy_sweep *sweep, char **svg_out, size_t *size_out,
                             dipole_status *status)
{
    enum { LIMIT = 4096 };
    struct times {
        double predicted[LIMIT], measured[LIMIT], line[2];
        char tips[LIMIT][TIP_SIZE];
        const char *tip_of[LIMIT];
    } *const times = calloc(1, sizeof *times);
    size_t count = 0;
    *svg_out = NULL;
    if (!times)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a plot");
    times->line[0] = 1e9;
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        for (size_t e = 0; e < point->effect_count && count < LIMIT; e++) {
            const struct accuracy_effect_time *const effect = &point->effects[e];
            if (!effect->is_active || !(effect->predicted_ms > 0) || !(effect->measured_ms > 0))
                continue;
            times->predicted[count] = effect->predicted_ms;
            times->measured[count] = effect->measured_ms;
            times->line[0] = fmin(times->line[0], effect->measured_ms);
            times->line[1] = fmax(times->line[1], effect->measured_ms);
            snprintf(times->tips[count], TIP_SIZE, "%s (%s, %s): predicted %.3g ms, measured %.3g ms",
                     render_effects[e]->name, point->knob->title, point->setting.label,
                     effect->predicted_ms, effect->measured_ms);
            times->tip_of[count] = times->tips[count];
            count++;
        }
    }
    const struct plot_series series[] = {
        { .kind = PLOT_LINE,
          .label = "as predicted",
          .x = times->line,
          .y = times->line,
          .count = 2,
          .color = PLOT_GREY,
          .dash = PLOT_DASHED },
        { .kind = PLOT_POINTS,
          .label = "an effect in a picture",
          .x = times->measured,
          .y = times->predicted,
          .count = count,
          .color = PLOT_BLUE,
          .is_hollow = true,
          .tips = times->tip_of },
    };
    const struct plot plot = { .width_px = 640,
                               .height_px = 400,
                               .title = "Times of effects",
                               .x = { .title = "measured, ms", .scale = PLOT_LOG },
                               .y = { .title = "predicted, ms", .scale = PLOT_LOG },
                               .series = series,
                               .series_count = 2,
                               .has_legend = true };
    const bool done = plot_svg_create(&plot, svg_out, size_out, status);
    free(times);
    return done;
}
