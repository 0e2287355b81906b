#include "accuracy/page_internal.h"

#include "accuracy/calibrate.h"
#include "accuracy/statistics.h"
#include "renderer/plan.h"

#include <math.h>
#include <stdlib.h>

/* What a prediction is to be: an upper bound, and within this factor. */
#define FACTOR 3.0

/* ---- errors ------------------------------------------------------------------------------------- */

struct tally {
    size_t count, bounded, within;
    double ratios[ACCURACY_POINT_LIMIT]; /* predicted over measured */
};

static void add_to(struct tally *tally, const struct accuracy_sweep *sweep,
                   const struct accuracy_knob *knob)
{
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        if (point->knob != knob || !point->is_drawn || !isfinite(point->error_predicted))
            continue;
        /* what lies below the reference's own error cannot be told from none */
        const double measured = fmax(point->error.rmse, sweep->reference_error);
        const bool is_bound = measured <= point->error_predicted + sweep->reference_error;
        tally->ratios[tally->count++] = point->error_predicted / measured;
        tally->bounded += is_bound;
        tally->within += is_bound && point->error_predicted <= FACTOR * measured;
    }
}

/* Why predictions of a knob are no bound, or a loose one. */
static const char *explain(const struct tally *tally)
{
    if (tally->bounded < tally->count)
        return "no bound in some: the model or an edge of a shadow is not part of what is predicted";
    return tally->within < tally->count ? "loose in some: each part is bounded for the worst "
                                          "surface and light, and the RMSE is a mean"
                                        : "";
}

static void add_error_row(struct plot_text *page, const char *title, struct tally *tally)
{
    plot_text_print(page, "<tr><td>%s</td><td class=\"number\">%d</td><td class=\"number\">%d</td>", title,
                    (int)tally->count, (int)tally->bounded);
    plot_text_print(page, "<td class=\"number\">%d</td>", (int)tally->within);
    const char *const reason = explain(tally);
    accuracy_page_add_cell(page, accuracy_median(tally->ratios, tally->count), 2);
    plot_text_print(page, "<td class=\"note\">%s</td></tr>\n", reason);
}

static void add_errors(struct plot_text *page, const struct accuracy_sweep *sweep)
{
    struct tally all = { .count = 0 };
    size_t silent = 0;
    for (size_t i = 0; i < sweep->point_count; i++)
        silent += sweep->points[i].is_drawn && !isfinite(sweep->points[i].error_predicted);
    for (size_t k = 0; k < accuracy_knob_count(); k++)
        add_to(&all, sweep, &accuracy_knobs[k]);
    plot_text_print(page,
                    "<p>Of %d points that predict their error, the prediction is an upper bound of the "
                    "relative RMSE in %d, and within a factor of 3 of it in %d. %d points predict none: "
                    "nothing bounds what translucent shadow maps miss.</p>\n",
                    (int)all.count, (int)all.bounded, (int)all.within, (int)silent);
    fit_page_add(page, "<div class=\"wide\"><table>\n<tr><th>knob</th><th class=\"number\">points</th><th "
                       "class=\"number\">bound holds</th><th class=\"number\">within 3</th><th "
                       "class=\"number\">predicted over measured, median</th><th>where not</th></tr>\n");
    for (size_t k = 0; k < accuracy_knob_count(); k++) {
        struct tally tally = { .count = 0 };
        add_to(&tally, sweep, &accuracy_knobs[k]);
        if (tally.count > 0)
            add_error_row(page, accuracy_knobs[k].title, &tally);
    }
    fit_page_add(page, "</table></div>\n");
}

/* ---- times -------------------------------------------------------------------------------------- */

static void add_time_row(struct plot_text *page, const char *name, double *errors, size_t count)
{
    plot_text_print(page, "<tr><td>%s</td><td class=\"number\">%d</td>", name, (int)count);
    accuracy_page_add_cell(page, 100 * accuracy_median(errors, count), 2);
    fit_page_add(page, "</tr>\n");
}

static bool add_times(struct plot_text *page, const struct accuracy_sweep *sweep, dipole_status *status)
{
    double errors[ACCURACY_POINT_LIMIT];
    size_t count = 0, size, effect_count = 0;
    char *svg;
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        if (point->time_count > 0 && isfinite(point->predicted_ms))
            errors[count++] = fabs(point->predicted_ms / point->time_ms.median - 1);
        if (point->effect_count > effect_count)
            effect_count = point->effect_count;
    }
    plot_text_print(page,
                    "<p>Times of pictures are predicted to within %f %% in half of %d points, %s.</p>\n",
                    100 * accuracy_median(errors, count), (int)count,
                    sweep->subject->renderer->is_calibrated
                        ? "by a calibration of this machine"
                        : "as on another machine: accuracy --calibrate measures this one");
    if (!accuracy_draw_time_plot(sweep, &svg, &size, status) || !accuracy_page_add_plot(page, svg, size))
        return false;
    fit_page_add(page,
                 "<div class=\"wide\"><table>\n<tr><th>effect</th><th class=\"number\">pictures</th><th "
                 "class=\"number\">median error of its time, %</th></tr>\n");
    for (size_t e = 0; e < effect_count; e++) {
        size_t times = 0;
        for (size_t i = 0; i < sweep->point_count; i++) {
            const struct accuracy_effect_time *const effect = &sweep->points[i].effects[e];
            if (effect->is_active && effect->measured_ms > 0 &&
                fmax(effect->predicted_ms, effect->measured_ms) > ACCURACY_TOLD_MS)
                errors[times++] = fabs(effect->predicted_ms / effect->measured_ms - 1);
        }
        if (times > 0)
            add_time_row(page, render_effects[e]->name, errors, times);
    }
    fit_page_add(page, "</table></div>\n");
    return true;
}

bool accuracy_page_add_predictions(struct plot_text *page, const struct accuracy_sweep *sweep,
                                   dipole_status *status)
{
    fit_page_add(page, "<h2 id=\"predictions\">How well it is predicted</h2>\n");
    add_errors(page, sweep);
    return add_times(page, sweep, status);
}

/* ---- what is not run ---------------------------------------------------------------------------- */

void accuracy_page_add_plan(struct plot_text *page, const struct accuracy_sweep *sweep)
{
    const struct render_request request =
        render_request_for(sweep->subject->renderer, &(struct render_options){ .epsilon = 0 });
    struct render_plan *plan;
    struct render_request asked = request;
    asked.environment = sweep->subject->renderer->environment;
    asked.has_gpu = sweep->subject->renderer->has_gpu;
    if (!render_plan_create(&asked, &plan, NULL))
        return;
    fit_page_add(page, "<h2 id=\"plan\">What is run for \u03b5 = 1 %, and what is not</h2>\n<div "
                       "class=\"wide\"><table>\n<tr><th>effect</th><th>run</th><th>why</th></tr>\n");
    for (int active = 1; active >= 0; active--) {
        for (size_t e = 0; e < plan->effect_count; e++) {
            if (plan->decisions[e].is_active != (active == 1))
                continue;
            plot_text_print(page, "<tr><td>%s</td><td>%s</td><td class=\"note\">%s</td></tr>\n",
                            render_effects[e]->name, active ? "yes" : "no", plan->decisions[e].reason);
        }
    }
    fit_page_add(page, "</table></div>\n");
    render_plan_destroy(plan);
}
