#include "accuracy/fits.h"
#include "io/json.h"
#include "plot/plot.h"

#include <stdio.h>

json_t *accuracy_fits_to_json(const struct accuracy_fits *fits)
{
    json_t *const points = json_array();
    for (size_t i = 0; i < fits->point_count; i++) {
        const struct accuracy_fit_point *const point = &fits->points[i];
        json_t *const times = json_array();
        for (size_t t = 0; t < point->time_count; t++)
            json_array_append_new(times, json_real(point->times_s[t]));
        json_array_append_new(points, json_pack("{s:s, s:i, s:i, s:i, s:o, s:o, s:o, s:f}", "knob",
                                                accuracy_fit_knobs[point->knob].name, "value", point->value,
                                                "told", point->told_count, "inside", point->inside_count,
                                                "error", io_json_number(point->error), "half_width",
                                                io_json_number(point->half_width), "times_s", times,
                                                "median_s", point->time_s.median));
    }
    return fits->refusal[0] ? json_pack("{s:o, s:s}", "points", points, "refusal", fits->refusal)
                            : json_pack("{s:o}", "points", points);
}

enum { TIP_SIZE = 160 };

struct curves {
    double time_s[ACCURACY_FIT_POINTS], error[ACCURACY_FIT_POINTS], half_width[ACCURACY_FIT_POINTS];
    char tips[ACCURACY_FIT_POINTS][TIP_SIZE];
    const char *tip_of[ACCURACY_FIT_POINTS];
};

static void fill(const struct accuracy_fits *fits, struct curves *curves)
{
    for (size_t i = 0; i < fits->point_count; i++) {
        const struct accuracy_fit_point *const point = &fits->points[i];
        curves->time_s[i] = point->time_s.median;
        curves->error[i] = point->error;
        curves->half_width[i] = point->half_width;
        snprintf(curves->tips[i], TIP_SIZE, "%s, %d: %.3g s, error %.3g %%, interval \u00b1 %.3g %%",
                 accuracy_fit_knobs[point->knob].title, point->value, point->time_s.median,
                 100 * point->error, 100 * point->half_width);
        curves->tip_of[i] = curves->tips[i];
    }
}

bool accuracy_fits_plot_create(const struct accuracy_fits *fits, char **svg_out, size_t *size_out,
                               dipole_status *status)
{
    static const enum plot_mark marks[ACCURACY_FIT_KNOBS] = { PLOT_DISC, PLOT_SQUARE };
    static const char *const colors[ACCURACY_FIT_KNOBS] = { PLOT_BLUE, PLOT_RED };
    static const char *const labels[ACCURACY_FIT_KNOBS][2] = { { "pixels", "pixels: interval" },
                                                               { "radii", "radii: interval" } };
    struct curves curves;
    struct plot_series series[2 * ACCURACY_FIT_KNOBS];
    size_t first = 0, count = 0;
    fill(fits, &curves);
    for (size_t k = 0; k < ACCURACY_FIT_KNOBS; k++) {
        for (int is_interval = 0; is_interval < 2; is_interval++)
            series[count++] = (struct plot_series){
                .kind = PLOT_POINTS,
                .label = labels[k][is_interval],
                .count = accuracy_fit_knobs[k].value_count,
                .x = curves.time_s + first,
                .y = (is_interval ? curves.half_width : curves.error) + first,
                .color = colors[k],
                .mark = marks[k],
                .is_hollow = is_interval,
                .tips = curves.tip_of + first,
            };
        first += accuracy_fit_knobs[k].value_count;
    }
    const struct plot plot = { .title = "What accuracy of a fit costs in time",
                               .x = { .title = "time of a fit, s", .scale = PLOT_LOG },
                               .y = { .title = "relative error of the worst coefficient",
                                      .scale = PLOT_LOG },
                               .series = series,
                               .series_count = count,
                               .has_legend = true };
    return plot_svg_create(&plot, svg_out, size_out, status);
}
