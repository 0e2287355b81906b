#include "dipole/inspect.h"
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POINT_COUNT = 400 };

static const char *const colors[IO_CHANNEL_COUNT] = { PLOT_RED, PLOT_GREEN, PLOT_BLUE };
static const enum plot_dash dashes[IO_CHANNEL_COUNT] = { PLOT_SOLID, PLOT_DASHED, PLOT_DASH_DOTTED };

/* Everything the plot points to. */
struct figure {
    double x[POINT_COUNT], y[IO_CHANNEL_COUNT][POINT_COUNT];
    double dots_x[IO_CHANNEL_COUNT][2], dots_y[IO_CHANNEL_COUNT][2];
    char labels[IO_CHANNEL_COUNT][64], marker_labels[2 * IO_CHANNEL_COUNT][64];
    char title[192], caption[1024];
    struct plot_series series[2 * IO_CHANNEL_COUNT];
    struct plot_marker markers[2 * IO_CHANNEL_COUNT];
    struct plot plot;
};

static bool has_scattering(const struct inspector_channel *channel)
{
    return channel->coefficients.alpha_prime > 0;
}

/* From where every curve is flat to a little beyond where the last ends; down to the lowest end. */
static void axes_init(const struct inspector_result *result, struct figure *figure)
{
    double x_min = INFINITY, x_max = 0, y_min = INFINITY, y_max = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct inspector_channel *const channel = &result->channels[c];
        const dipole_coefficients *const coefficients = &channel->coefficients;
        x_min = fmin(x_min, coefficients->mean_free_path_mm / 20);
        x_max = fmax(x_max, 4 * coefficients->mean_free_path_mm);
        if (has_scattering(channel)) {
            x_max = fmax(x_max, 1.4 * channel->r_max_mm);
            y_min = fmin(y_min, dipole_rd_per_mm2(coefficients, channel->r_max_mm) / 6);
            y_max = fmax(y_max, dipole_rd_per_mm2(coefficients, 0) * 2);
        }
    }
    figure->plot.x = (struct plot_axis){ .title = "distance r from where the light entered, mm",
                                         .scale = PLOT_LOG,
                                         .min = x_min,
                                         .max = x_max };
    figure->plot.y = (struct plot_axis){
        .title = "diffuse reflectance profile Rd(r), 1/mm²", .scale = PLOT_LOG, .min = y_min, .max = y_max
    };
    for (int i = 0; i < POINT_COUNT; i++)
        figure->x[i] = x_min * pow(x_max / x_min, i / (POINT_COUNT - 1.0));
}

static void channel_init(const struct inspector_result *result, int c, struct figure *figure)
{
    const struct inspector_channel *const channel = &result->channels[c];
    const dipole_coefficients *const coefficients = &channel->coefficients;
    const bool is_scattering = has_scattering(channel);
    for (int i = 0; i < POINT_COUNT; i++)
        figure->y[c][i] = dipole_rd_per_mm2(coefficients, figure->x[i]);
    if (is_scattering)
        snprintf(figure->labels[c], sizeof *figure->labels, "%s, total %.3g %%", channel->name,
                 100 * channel->diffuse_reflectance);
    else
        snprintf(figure->labels[c], sizeof *figure->labels, "%s, Rd = 0", channel->name);
    figure->series[figure->plot.series_count++] = (struct plot_series){ .label = figure->labels[c],
                                                                        .count = POINT_COUNT,
                                                                        .x = figure->x,
                                                                        .y = figure->y[c],
                                                                        .color = colors[c],
                                                                        .dash = dashes[c] };

    const double ends[2] = { coefficients->mean_free_path_mm, channel->r_max_mm };
    const char *const names[2] = { "ℓ", "r_max" };
    const enum plot_dash end_dashes[2] = { PLOT_DOTTED, PLOT_DASHED };
    const int end_count = is_scattering ? 2 : 1;
    for (int i = 0; i < end_count; i++) {
        char *const label = figure->marker_labels[2 * c + i];
        snprintf(label, sizeof *figure->marker_labels, "%s %s %.3g mm", channel->name, names[i], ends[i]);
        figure->markers[figure->plot.marker_count++] = (struct plot_marker){
            .value = ends[i], .label = label, .color = colors[c], .dash = end_dashes[i]
        };
        figure->dots_x[c][i] = ends[i];
        figure->dots_y[c][i] = dipole_rd_per_mm2(coefficients, ends[i]);
    }
}

static void captions_init(const struct inspector_result *result, struct figure *figure)
{
    snprintf(figure->title, sizeof figure->title, "%s: how far light spreads under the surface",
             result->material.name);
    int size = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_coefficients *const coefficients = &result->channels[c].coefficients;
        size += snprintf(figure->caption + size, sizeof figure->caption - (size_t)size,
                         "%s: σa %.4g /mm, σ′s %.4g /mm%s", result->channels[c].name,
                         coefficients->sigma_a_per_mm, coefficients->sigma_s_prime_per_mm,
                         c + 1 < IO_CHANNEL_COUNT ? ";  " : "\n");
    }
    snprintf(
        figure->caption + size, sizeof figure->caption - (size_t)size,
        "η %.4g, dipole model. Dotted: mean free path ℓ = 1/(σa + σ′s). Dashed: r_max, the radius that "
        "holds all but %.3g %% of the light that leaves. Total: diffuse reflectance.",
        result->material.layers[0][0].medium.eta, 100 * result->epsilon);
    figure->plot.title = figure->title;
    figure->plot.subtitle = result->material.source;
    figure->plot.caption = figure->caption;
}

static void figure_init(const struct inspector_result *result, struct figure *figure)
{
    *figure = (struct figure){ .plot = { .series = figure->series, .markers = figure->markers } };
    axes_init(result, figure);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        channel_init(result, c, figure);
    /* Dots come last, so that no line covers one. */
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        figure->series[figure->plot.series_count++] =
            (struct plot_series){ .kind = PLOT_POINTS,
                                  .count = has_scattering(&result->channels[c]) ? 2 : 0,
                                  .x = figure->dots_x[c],
                                  .y = figure->dots_y[c],
                                  .color = colors[c] };
    captions_init(result, figure);
}

bool inspector_result_draw(const struct inspector_result *result, bool is_png, void **data_out,
                           size_t *size_out, dipole_status *status)
{
    *data_out = NULL;
    struct figure *const figure = malloc(sizeof *figure);
    if (!figure)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the plot");
    figure_init(result, figure);
    char *svg = NULL;
    size_t svg_size = 0;
    unsigned char *png = NULL;
    const bool is_done = plot_svg_create(&figure->plot, &svg, &svg_size, status) &&
                         (!is_png || plot_png_create(svg, svg_size, 2, &png, size_out, status));
    free(figure);
    if (is_done && !is_png) {
        *data_out = svg;
        *size_out = svg_size;
        return true;
    }
    free(svg);
    *data_out = png;
    return is_done;
}
