#include "dipole/inspect.h"
#include "plot/plot.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    POINT_COUNT = 400,
    FACE_COUNT = 2,
    LINE_LIMIT = INSPECTOR_CURVE_LIMIT * IO_CHANNEL_COUNT * FACE_COUNT,
    DRAWN_LIMIT = 60, /* points of a table: more would be a smear */
};

/* Values that far below the largest are not worth decades of an axis. */
#define AXIS_DEPTH 1e-15

static const char *const colors[IO_CHANNEL_COUNT] = { PLOT_RED, PLOT_GREEN, PLOT_BLUE };
static const char data_color[] = "#333333";
static const char *const dash_names[] = { "solid", "dashed", "dash-dotted", "dotted" };

/* The points of a table that are drawn. */
struct points {
    size_t count;
    double x[DRAWN_LIMIT + 1], y[DRAWN_LIMIT + 1], low[DRAWN_LIMIT + 1], high[DRAWN_LIMIT + 1];
    char label[128];
};

struct limits {
    double x_min, x_max, y_min, y_max;
};

/* Everything the plot points to. */
struct figure {
    double x[POINT_COUNT], y[LINE_LIMIT][POINT_COUNT];
    char labels[LINE_LIMIT][192];
    size_t line_count;
    double dots_x[IO_CHANNEL_COUNT][2], dots_y[IO_CHANNEL_COUNT][2];
    char marker_labels[2 * IO_CHANNEL_COUNT][64];
    struct points points[INSPECTOR_DATA_LIMIT];
    double data_scale;
    char title[192], caption[4096];
    struct plot_series series[LINE_LIMIT + INSPECTOR_DATA_LIMIT + IO_CHANNEL_COUNT];
    struct plot_marker markers[2 * IO_CHANNEL_COUNT];
    struct plot plot;
};

/* Add printf text to a buffer; what does not fit is cut. */
static void append(char *buffer, size_t size, const char *format, ...) DIPOLE_PRINTF(3, 4);

static void append(char *buffer, size_t size, const char *format, ...)
{
    const size_t length = strlen(buffer);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(buffer + length, size - length, format, arguments);
    va_end(arguments);
}

static bool has_one_name(const struct inspector_figure *request)
{
    for (size_t i = 1; i < request->result_count; i++)
        if (strcmp(request->results[i].material.name, request->results[0].material.name) != 0)
            return false;
    return true;
}

static bool has_one_model(const struct inspector_figure *request)
{
    for (size_t i = 1; i < request->result_count; i++)
        if (request->results[i].material.model != request->results[0].material.model)
            return false;
    return true;
}

static bool has_any_far_face(const struct inspector_figure *request)
{
    for (size_t i = 0; i < request->result_count; i++)
        if (inspector_has_far_face(&request->results[i]))
            return true;
    return false;
}

/* ---- axes ---------------------------------------------------------------------------------------- */

/* The profiles of a channel: from where they are flat, or nearly so, to a little beyond where they end. */
static void limits_extend(const struct inspector_channel *channel, bool has_far_face, double epsilon,
                          struct limits *limits)
{
    const double mean_free_path_mm = channel->coefficients.mean_free_path_mm;
    limits->x_min = fmin(limits->x_min, mean_free_path_mm / 20);
    limits->x_max = fmax(limits->x_max, 4 * mean_free_path_mm);
    if (channel->diffuse_reflectance > 0) {
        limits->x_max = fmax(limits->x_max, 1.4 * channel->r_max_mm);
        limits->y_min = fmin(limits->y_min, inspector_rd_per_mm2(channel, channel->r_max_mm) / 6);
        limits->y_max = fmax(limits->y_max, inspector_rd_per_mm2(channel, mean_free_path_mm / 20) * 2);
    }
    if (has_far_face && channel->diffuse_transmittance > 0) {
        const double r_max_mm = dipole_stack_r_max_mm(channel->stack, DIPOLE_FACE_FAR, epsilon);
        limits->x_max = fmax(limits->x_max, 1.4 * r_max_mm);
        limits->y_min = fmin(limits->y_min, inspector_td_per_mm2(channel, r_max_mm) / 6);
        limits->y_max = fmax(limits->y_max, inspector_td_per_mm2(channel, 0) * 2);
    }
}

/* Tables widen the axes, but a few far points do not squeeze the curves. */
static void limits_extend_by_data(const struct io_profile *profile, double scale, struct limits *limits)
{
    const struct limits curves = *limits;
    for (size_t i = 0; i < profile->count; i++) {
        const double r_mm = io_profile_r_mm(profile, i), value = scale * profile->rd_per_mm2[i];
        if (!(value > 0) || r_mm < curves.x_min / 3 || r_mm > curves.x_max * 3)
            continue;
        limits->x_min = fmin(limits->x_min, r_mm / 1.1);
        limits->x_max = fmax(limits->x_max, r_mm * 1.1);
        limits->y_min = fmin(limits->y_min, fmax(value / 2, curves.y_min / 10));
        limits->y_max = fmax(limits->y_max, fmin(value * 2, curves.y_max * 10));
    }
}

static struct limits limits_find(const struct inspector_figure *request, double data_scale)
{
    struct limits limits = { .x_min = INFINITY, .y_min = INFINITY };
    for (size_t i = 0; i < request->result_count; i++)
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            limits_extend(&request->results[i].channels[c], inspector_has_far_face(&request->results[i]),
                          request->results[i].epsilon, &limits);
    for (size_t i = 0; i < request->data_count; i++)
        limits_extend_by_data(request->data[i].profile, data_scale, &limits);
    limits.y_min = fmax(limits.y_min, limits.y_max * AXIS_DEPTH);
    return limits;
}

static void axes_init(const struct inspector_figure *request, const struct limits *limits,
                      struct figure *figure)
{
    figure->plot.x = (struct plot_axis){ .title = "distance r from where the light entered, mm",
                                         .scale = PLOT_LOG,
                                         .min = limits->x_min,
                                         .max = limits->x_max };
    figure->plot.y = (struct plot_axis){ .title = has_any_far_face(request)
                                                      ? "reflected Rd(r) and transmitted Td(r), 1/mm²"
                                                      : "diffuse reflectance profile Rd(r), 1/mm²",
                                         .scale = PLOT_LOG,
                                         .min = limits->y_min,
                                         .max = limits->y_max };
    for (int i = 0; i < POINT_COUNT; i++)
        figure->x[i] = limits->x_min * pow(limits->x_max / limits->x_min, i / (POINT_COUNT - 1.0));
}

/* ---- curves -------------------------------------------------------------------------------------- */

/* Bytes of the first count characters of UTF-8 text, or of all of it. */
static size_t bytes_of(const char *text, size_t count)
{
    size_t length = 0;
    for (size_t i = 0; text[length] && i < count; i++)
        for (length++; ((unsigned char)text[length] & 0xc0) == 0x80;)
            length++;
    return length;
}

/* A name of more than 24 characters loses its middle: names of a kind differ at their ends. */
static void append_name(char *buffer, size_t size, const char *name)
{
    enum { HEAD = 12, TAIL = 11 };
    size_t count = 0;
    for (const char *p = name; *p; p++)
        count += ((unsigned char)*p & 0xc0) != 0x80;
    if (count <= HEAD + 1 + TAIL)
        append(buffer, size, "%s", name);
    else
        append(buffer, size, "%.*s…%s", (int)bytes_of(name, HEAD), name,
               name + bytes_of(name, count - TAIL));
}

static void label_init(const struct inspector_figure *request, const struct inspector_result *result,
                       const struct inspector_channel *channel, dipole_face face, char *out, size_t size)
{
    const double total =
        face == DIPOLE_FACE_LIT ? channel->diffuse_reflectance : channel->diffuse_transmittance;
    snprintf(out, size, "%s", channel->name);
    if (!has_one_name(request)) {
        append(out, size, ", ");
        append_name(out, size, result->material.name);
    }
    if (!has_one_model(request))
        append(out, size, ", %s", inspector_model_name(result->material.model));
    if (!(total > 0))
        append(out, size, face == DIPOLE_FACE_LIT ? ", Rd = 0" : ", Td = 0");
    else if (has_any_far_face(request))
        append(out, size, ", %s %.3g %%", face == DIPOLE_FACE_LIT ? "reflected" : "transmitted",
               100 * total);
    else
        append(out, size, ", total %.3g %%", 100 * total);
}

/* Colour says the channel. The dash says the material or model; when there is but one, the face, or the
 * channel once more. */
static void curve_add(const struct inspector_figure *request, size_t index, int c, dipole_face face,
                      struct figure *figure)
{
    const struct inspector_result *const result = &request->results[index];
    const struct inspector_channel *const channel = &result->channels[c];
    const bool is_alone = request->result_count == 1, is_far = face == DIPOLE_FACE_FAR;
    const size_t line = figure->line_count++;
    double *const y = figure->y[line];
    for (int i = 0; i < POINT_COUNT; i++)
        y[i] = (is_far ? inspector_td_per_mm2 : inspector_rd_per_mm2)(channel, figure->x[i]);
    label_init(request, result, channel, face, figure->labels[line], sizeof figure->labels[line]);
    const int dash = !is_alone ? (int)index : inspector_has_far_face(result) ? (int)is_far : c;
    figure->series[figure->plot.series_count++] = (struct plot_series){ .label = figure->labels[line],
                                                                        .count = POINT_COUNT,
                                                                        .x = figure->x,
                                                                        .y = y,
                                                                        .color = colors[c],
                                                                        .dash = (enum plot_dash)dash,
                                                                        .is_thin = !is_alone && is_far };
}

static void curves_add(const struct inspector_figure *request, struct figure *figure)
{
    for (size_t i = 0; i < request->result_count; i++)
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            curve_add(request, i, c, DIPOLE_FACE_LIT, figure);
            if (inspector_has_far_face(&request->results[i]))
                curve_add(request, i, c, DIPOLE_FACE_FAR, figure);
        }
}

/* Mean free path and r_max of a channel: a flag above the frame for each, and a dot on the curve. */
static void markers_add(const struct inspector_channel *channel, int c, struct figure *figure)
{
    const double ends[2] = { channel->coefficients.mean_free_path_mm, channel->r_max_mm };
    const char *const names[2] = { "ℓ", "r_max" };
    const enum plot_dash dashes[2] = { PLOT_DOTTED, PLOT_DASHED };
    const int end_count = channel->diffuse_reflectance > 0 ? 2 : 1;
    for (int i = 0; i < end_count; i++) {
        char *const label = figure->marker_labels[2 * c + i];
        snprintf(label, sizeof *figure->marker_labels, "%s %s %.3g mm", channel->name, names[i], ends[i]);
        figure->markers[figure->plot.marker_count++] =
            (struct plot_marker){ .value = ends[i], .label = label, .color = colors[c], .dash = dashes[i] };
        figure->dots_x[c][i] = ends[i];
        figure->dots_y[c][i] = inspector_rd_per_mm2(channel, ends[i]);
    }
    figure->series[figure->plot.series_count++] =
        (struct plot_series){ .kind = PLOT_POINTS,
                              .count = channel->diffuse_reflectance > 0 ? 2 : 0,
                              .x = figure->dots_x[c],
                              .y = figure->dots_y[c],
                              .color = colors[c] };
}

/* ---- tables -------------------------------------------------------------------------------------- */

static int compare_numbers(const void *a, const void *b)
{
    const double *const x = a, *const y = b;
    return (*x > *y) - (*x < *y);
}

struct row {
    double r_mm; /* first, for compare_numbers */
    size_t index;
};

/* The rows within the axes, thinned so that no two stand closer than a symbol is wide. */
static void points_fill(const struct io_profile *profile, double scale, const struct limits *limits,
                        const struct row *rows, struct points *points)
{
    const double step = pow(limits->x_max / limits->x_min, 1.0 / DRAWN_LIMIT);
    double next_mm = limits->x_min;
    for (size_t i = 0; i < profile->count && points->count < DRAWN_LIMIT; i++) {
        const size_t row = rows[i].index;
        const double value = scale * profile->rd_per_mm2[row];
        if (!(value >= limits->y_min && value <= limits->y_max) || rows[i].r_mm < next_mm ||
            rows[i].r_mm > limits->x_max)
            continue;
        const double error = profile->sem_per_mm2 ? scale * profile->sem_per_mm2[row] : 0;
        const size_t k = points->count++;
        points->x[k] = rows[i].r_mm;
        points->y[k] = value;
        points->low[k] = value - error;
        points->high[k] = value + error;
        next_mm = rows[i].r_mm * step;
    }
}

static bool data_add(const struct inspector_data *data, size_t index, const struct limits *limits,
                     struct figure *figure, dipole_status *status)
{
    const struct io_profile *const profile = data->profile;
    struct points *const points = &figure->points[index];
    struct row *const rows = malloc(profile->count * sizeof *rows);
    if (!rows)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for %zu points",
                           profile->count);
    for (size_t i = 0; i < profile->count; i++)
        rows[i] = (struct row){ io_profile_r_mm(profile, i), i };
    qsort(rows, profile->count, sizeof *rows, compare_numbers);
    points_fill(profile, figure->data_scale, limits, rows, points);
    free(rows);
    append_name(points->label, sizeof points->label, data->label);
    if (points->count < profile->count)
        append(points->label, sizeof points->label, ", %zu of %zu", points->count, profile->count);
    const bool has_errors = profile->sem_per_mm2 != NULL;
    figure->series[figure->plot.series_count++] =
        (struct plot_series){ .kind = PLOT_POINTS,
                              .label = points->label,
                              .count = points->count,
                              .x = points->x,
                              .y = points->y,
                              .y_low = has_errors ? points->low : NULL,
                              .y_high = has_errors ? points->high : NULL,
                              .color = data_color,
                              .mark = (enum plot_mark)index,
                              .is_hollow = true };
    return true;
}

/* ---- texts --------------------------------------------------------------------------------------- */

static void append_layers(const struct io_material *material, char *out, size_t size)
{
    append(out, size, "Layers from the top: ");
    for (size_t i = 0; i < material->layer_count; i++) {
        const double thickness_mm = material->layers[0][i].thickness_mm;
        append(out, size, "%s%s%s", i > 0 ? ", " : "", material->layer_names[i],
               material->layer_names[i][0] ? " " : "");
        if (isfinite(thickness_mm))
            append(out, size, "%.4g mm", thickness_mm);
        else
            append(out, size, "without end");
        append(out, size, " (η %.4g)", material->layers[0][i].medium.eta);
    }
    append(out, size, "; ");
}

static void caption_of_one(const struct inspector_result *result, char *out, size_t size)
{
    const struct io_material *const material = &result->material;
    const bool has_layers = io_material_has_layers(material);
    for (int c = 0; c < IO_CHANNEL_COUNT && !has_layers; c++) {
        const dipole_coefficients *const coefficients = &result->channels[c].coefficients;
        append(out, size, "%s: σa %.4g /mm, σ′s %.4g /mm%s", result->channels[c].name,
               coefficients->sigma_a_per_mm, coefficients->sigma_s_prime_per_mm,
               c + 1 < IO_CHANNEL_COUNT ? ";  " : "\n");
    }
    if (has_layers)
        append_layers(material, out, size);
    else
        append(out, size, "η %.4g, ", material->layers[0][0].medium.eta);
    append(out, size, "%s model%s. ", inspector_model_name(material->model),
           !inspector_has_far_face(result) ? ""
           : result->side == DIPOLE_FROM_ABOVE
               ? ", lit from above; solid lines: reflected, dashed: transmitted"
               : ", lit from below; solid lines: reflected, dashed: transmitted");
    append(
        out, size,
        "Dotted: mean free path ℓ = 1/(σa + σ′s)%s. Dashed: r_max, the radius that holds all but %.3g %% "
        "of the light that %s. ",
        material->layer_count > 1 ? " of the top layer" : "", 100 * result->epsilon,
        inspector_has_far_face(result) ? "is reflected" : "leaves");
    if (!inspector_has_far_face(result))
        append(out, size, "Total: diffuse reflectance. ");
}

static void caption_of_several(const struct inspector_figure *request, char *out, size_t size)
{
    const bool has_one = has_one_name(request);
    append(out, size, "Lines: ");
    for (size_t i = 0; i < request->result_count; i++) {
        const struct io_material *const material = &request->results[i].material;
        append(out, size, "%s %s%s%s model", dash_names[i], has_one ? "" : material->name,
               has_one ? "" : ", ", inspector_model_name(material->model));
        if (!io_material_has_layers(material))
            append(out, size, ", η %.4g", material->layers[0][0].medium.eta);
        append(out, size, i + 1 < request->result_count ? ";  " : ". ");
    }
    if (has_any_far_face(request))
        append(out, size, "Thick lines: reflected, thin lines: transmitted; lit from %s. ",
               request->results[0].side == DIPOLE_FROM_ABOVE ? "above" : "below");
    else
        append(out, size, "Total: diffuse reflectance. ");
}

static void append_data_caption(const struct inspector_figure *request, const struct figure *figure,
                                char *out, size_t size)
{
    bool has_errors = false, has_rings = false;
    for (size_t i = 0; i < request->data_count; i++) {
        has_errors |= request->data[i].profile->sem_per_mm2 != NULL;
        has_rings |= request->data[i].profile->has_rings;
    }
    append(out, size, "\nPoints: the tables");
    if (request->is_per_incident)
        append(out, size, ", which are per incident light, divided by 1 − Rsp = %.4g",
               1 / figure->data_scale);
    if (has_errors)
        append(out, size, "; bars, where they are longer than the mark: one standard error");
    if (has_rings)
        append(out, size, "; a ring stands at the radius that halves its area");
    append(out, size, ".");
}

static void texts_init(const struct inspector_figure *request, struct figure *figure)
{
    snprintf(figure->title, sizeof figure->title, "%s%sow far light spreads under the surface",
             has_one_name(request) ? request->results[0].material.name : "",
             has_one_name(request) ? ": h" : "H");
    if (request->result_count == 1)
        caption_of_one(&request->results[0], figure->caption, sizeof figure->caption);
    else
        caption_of_several(request, figure->caption, sizeof figure->caption);
    if (request->data_count > 0)
        append_data_caption(request, figure, figure->caption, sizeof figure->caption);
    figure->plot.title = figure->title;
    figure->plot.subtitle = has_one_name(request) ? request->results[0].material.source : NULL;
    figure->plot.caption = figure->caption;
}

/* ---- the figure ---------------------------------------------------------------------------------- */

/* Light that enters, of the light that falls on the lit face. */
static double entering_part(const struct inspector_result *result)
{
    const struct io_material *const material = &result->material;
    const size_t lit = result->side == DIPOLE_FROM_ABOVE ? 0 : material->layer_count - 1;
    return 1 - dipole_fresnel_reflectance(material->layers[0][lit].medium.eta, 1);
}

static bool figure_init(const struct inspector_figure *request, struct figure *figure,
                        dipole_status *status)
{
    figure->plot = (struct plot){ .series = figure->series,
                                  .markers = figure->markers,
                                  .has_legend = request->result_count > 1 || request->data_count > 0 };
    figure->data_scale = request->is_per_incident ? 1 / entering_part(&request->results[0]) : 1;
    const struct limits limits = limits_find(request, figure->data_scale);
    axes_init(request, &limits, figure);
    curves_add(request, figure);
    for (size_t i = 0; i < request->data_count; i++)
        if (!data_add(&request->data[i], i, &limits, figure, status))
            return false;
    /* Dots come last, so that no line covers one. */
    for (int c = 0; c < IO_CHANNEL_COUNT && request->result_count == 1; c++)
        markers_add(&request->results[0].channels[c], c, figure);
    texts_init(request, figure);
    return true;
}

bool inspector_figure_draw(const struct inspector_figure *request, bool is_png, void **data_out,
                           size_t *size_out, dipole_status *status)
{
    *data_out = NULL;
    struct figure *const figure = calloc(1, sizeof *figure);
    if (!figure)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the plot");
    char *svg = NULL;
    size_t svg_size = 0;
    unsigned char *png = NULL;
    const bool is_done = figure_init(request, figure, status) &&
                         plot_svg_create(&figure->plot, &svg, &svg_size, status) &&
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
