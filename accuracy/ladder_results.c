/* The ladder as JSON and as a picture. */
#include "accuracy/ladder_parts.h"
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *accuracy_rung_name(size_t rung)
{
    return ladder_kinds[rung].name;
}

bool accuracy_rung_summarize(const struct accuracy_ladder *ladder, size_t rung,
                             struct accuracy_rung_summary *out)
{
    double *const values = malloc((2 * ladder->case_count + 1) * sizeof *values);
    *out = (struct accuracy_rung_summary){ .error_low = INFINITY };
    for (size_t i = 0; values && i < ladder->case_count; i++) {
        const struct accuracy_rung *const at = &ladder->cases[i].rungs[rung];
        if (!at->is_known)
            continue;
        values[out->count] = at->error;
        values[ladder->case_count + out->count++] = at->time_ns;
        out->error_low = fmin(out->error_low, at->error);
        out->error_high = fmax(out->error_high, at->error);
    }
    if (out->count > 0) {
        out->error = accuracy_median(values, out->count);
        out->time_ns = accuracy_median(values + ladder->case_count, out->count);
    }
    free(values);
    return out->count > 0;
}

/* ---- JSON ----------------------------------------------------------------------------------------- */

static json_t *numbers(const double *values, size_t count)
{
    json_t *const array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(array, json_real(values[i]));
    return array;
}

static json_t *case_to_json(const struct accuracy_ladder_case *at)
{
    json_t *const rungs = json_array();
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        const struct accuracy_rung *const rung = &at->rungs[i];
        if (rung->is_known)
            json_array_append_new(rungs, json_pack("{s:s, s:f, s:f, s:f, s:f}", "rung",
                                                   accuracy_rung_name(i), "error", rung->error,
                                                   "total_error", rung->total_error, "ns_per_radius",
                                                   rung->time_ns, "prepare_ns", rung->prepare_ns));
    }
    return json_pack("{s:s, s:s, s:f, s:f, s:o, s:o, s:o, s:o}", "case", at->name, "truth",
                     at->is_own_truth ? "own Monte Carlo" : "MCML", "diffuse_reflectance", at->reflected,
                     "error_of_truth", at->floor, "edges_mm", numbers(at->edges_mm, at->ring_count + 1),
                     "rd_per_mm2", numbers(at->rd_per_mm2, at->ring_count), "rd_error_per_mm2",
                     numbers(at->rd_error, at->ring_count), "rungs", rungs);
}

static json_t *totals_to_json(const struct accuracy_ladder *ladder, int is_forward)
{
    json_t *const rungs = json_array();
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        const struct accuracy_rung *const rung = &ladder->totals[is_forward][i];
        if (rung->is_known)
            json_array_append_new(rungs,
                                  json_pack("{s:s, s:f, s:f, s:I}", "rung", accuracy_rung_name(i), "error",
                                            rung->error, "ns_per_slab", rung->time_ns, "numbers",
                                            (json_int_t)ladder->total_counts[is_forward][i]));
    }
    return json_pack("{s:f, s:o}", "g", is_forward ? 0.8 : 0.0, "rungs", rungs);
}

static json_t *agreement_to_json(const struct accuracy_agreement *agreement)
{
    return json_pack("{s:I, s:I, s:f, s:f}", "numbers", (json_int_t)agreement->count, "beyond_3",
                     (json_int_t)agreement->beyond_count, "worst_z", agreement->worst, "mean_square_z",
                     agreement->mean_square);
}

json_t *accuracy_ladder_to_json(const struct accuracy_ladder *ladder)
{
    json_t *const cases = json_array(), *const rungs = json_array();
    for (size_t i = 0; i < ladder->case_count; i++)
        json_array_append_new(cases, case_to_json(&ladder->cases[i]));
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        struct accuracy_rung_summary all;
        if (accuracy_rung_summarize(ladder, i, &all))
            json_array_append_new(
                rungs, json_pack("{s:s, s:f, s:f, s:f, s:f, s:I}", "rung", accuracy_rung_name(i), "error",
                                 all.error, "error_low", all.error_low, "error_high", all.error_high,
                                 "ns_per_radius", all.time_ns, "cases", (json_int_t)all.count));
    }
    return json_pack("{s:o, s:o, s:[o, o], s:{s:o, s:o}}", "rungs", rungs, "cases", cases, "totals",
                     totals_to_json(ladder, 0), totals_to_json(ladder, 1), "monte_carlo_z", "totals",
                     agreement_to_json(&ladder->agreement_totals), "rings",
                     agreement_to_json(&ladder->agreement_rings));
}

/* ---- picture -------------------------------------------------------------------------------------- */

/* All cases of a rung as small points, and their median with its range. */
struct cloud {
    double *time_ns, *error;
    size_t count;
    struct accuracy_rung_summary middle;
};

static bool cloud_init(const struct accuracy_ladder *ladder, size_t rung, struct cloud *out)
{
    *out = (struct cloud){ .time_ns = malloc((2 * ladder->case_count + 1) * sizeof *out->time_ns) };
    if (!out->time_ns)
        return false;
    out->error = out->time_ns + ladder->case_count;
    for (size_t i = 0; i < ladder->case_count; i++) {
        const struct accuracy_rung *const at = &ladder->cases[i].rungs[rung];
        if (!at->is_known)
            continue;
        out->time_ns[out->count] = at->time_ns;
        out->error[out->count++] = at->error;
    }
    return !accuracy_rung_summarize(ladder, rung, &out->middle) || out->middle.count > 0;
}

enum { SERIES_LIMIT = 2 * ACCURACY_RUNG_COUNT + 1 };

/* Of the models; Monte Carlo is grey, and its medians are one line. */
static const struct {
    const char *color, *pale;
    enum plot_mark mark;
} looks[] = {
    { "#cc3311", "#eeb0a4", PLOT_SQUARE },   { "#d55e00", "#f2bf94", PLOT_DIAMOND },
    { "#aa4499", "#dcb4d5", PLOT_TRIANGLE }, { "#0072b2", "#99c7e0", PLOT_SQUARE },
    { "#009e73", "#99d8c7", PLOT_DIAMOND },
};

/* Clouds first, so that the medians are over them. */
static size_t series_init(const struct cloud *clouds, double line[2][ACCURACY_RUNG_COUNT],
                          struct plot_series *series)
{
    size_t count = 0, photons = 0;
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        const bool is_model = i >= LADDER_FIRST_MODEL;
        if (clouds[i].count > 0)
            series[count++] =
                (struct plot_series){ .kind = PLOT_POINTS,
                                      .count = clouds[i].count,
                                      .x = clouds[i].time_ns,
                                      .y = clouds[i].error,
                                      .color = is_model ? looks[i - LADDER_FIRST_MODEL].pale : "#c8c8c8",
                                      .mark = is_model ? looks[i - LADDER_FIRST_MODEL].mark : PLOT_DISC,
                                      .is_hollow = true };
    }
    for (size_t i = LADDER_FIRST_MODEL; i < ACCURACY_RUNG_COUNT; i++)
        if (clouds[i].count > 0)
            series[count++] = (struct plot_series){ .kind = PLOT_POINTS,
                                                    .label = accuracy_rung_name(i),
                                                    .count = 1,
                                                    .x = &clouds[i].middle.time_ns,
                                                    .y = &clouds[i].middle.error,
                                                    .color = looks[i - LADDER_FIRST_MODEL].color,
                                                    .mark = looks[i - LADDER_FIRST_MODEL].mark };
    for (size_t i = 0; i < LADDER_FIRST_MODEL; i++) {
        if (clouds[i].count == 0)
            continue;
        line[0][photons] = clouds[i].middle.time_ns;
        line[1][photons++] = clouds[i].middle.error;
    }
    if (photons > 0)
        series[count++] = (struct plot_series){
            .label = "Monte Carlo", .count = photons, .x = line[0], .y = line[1], .color = PLOT_GREY
        };
    return count;
}

bool accuracy_ladder_plot_create(const struct accuracy_ladder *ladder, char **svg_out, size_t *size_out,
                                 dipole_status *status)
{
    struct cloud clouds[ACCURACY_RUNG_COUNT] = { 0 };
    struct plot_series series[SERIES_LIMIT];
    double line[2][ACCURACY_RUNG_COUNT];
    bool is_done = true;
    *svg_out = NULL;
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT && is_done; i++)
        is_done = cloud_init(ladder, i, &clouds[i]);
    if (is_done) {
        const struct plot plot = {
            .title = "The physics ladder",
            .subtitle = "Error of the profile R_d(r) of a stack against the time of one radius",
            .caption =
                "Pale: one stack each. Full: the median of a model. Line: medians of Monte Carlo "
                "with 10\xc2\xb3, "
                "10\xe2\x81\xb4, 10\xe2\x81\xb5 ... photons, whose time is that of the whole profile over "
                "its rings. Errors relative, weighted by area. One processor.",
            .x = { .title = "time of a radius, ns", .scale = PLOT_LOG },
            .y = { .title = "error of the profile", .scale = PLOT_LOG },
            .series = series,
            .series_count = series_init(clouds, line, series),
            .has_legend = true,
        };
        is_done = plot_svg_create(&plot, svg_out, size_out, status);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a picture");
    }
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++)
        free(clouds[i].time_ns);
    return is_done;
}
