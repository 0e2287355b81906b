#include "lutgen/figure.h"

#include "plot/plot.h"
#include "plot/sheet.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* More texels than NODE_LIMIT would be a smear. */
enum { POINT_COUNT = 400, NODE_LIMIT = 200, ROW_LIMIT = 8, GREEN = 1 };

static bool fail_without_memory(dipole_status *status)
{
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a picture");
}

/* ---- curves ------------------------------------------------------------------------------------- */

/* One line with its texels. */
struct curve {
    double x[POINT_COUNT], y[POINT_COUNT];
    double *node_x, *node_y; /* node_count each, in one allocation */
    char label[160];
};

static bool curve_init(const struct lut_splat *lut, size_t row, int channel, struct curve *curve)
{
    const struct lut_splat_row *const at = &lut->rows[row];
    const size_t count = (size_t)lut->node_count;
    double rgb[IO_CHANNEL_COUNT];
    curve->node_x = malloc(2 * count * sizeof *curve->node_x);
    if (!curve->node_x)
        return false;
    curve->node_y = curve->node_x + count;
    for (int i = 0; i < lut->node_count; i++) {
        curve->node_x[i] = lut_axis_r_mm(&at->axis, i);
        lut_splat_sample(lut, row, curve->node_x[i], rgb);
        curve->node_y[i] = rgb[channel];
    }
    const double first_mm = lut_axis_r_mm(&at->axis, 0.5), last_mm = at->axis.r_max_mm;
    for (int i = 0; i < POINT_COUNT; i++) {
        curve->x[i] = fmin(first_mm * pow(last_mm / first_mm, i / (POINT_COUNT - 1.0)), last_mm);
        lut_splat_sample(lut, row, curve->x[i], rgb);
        curve->y[i] = rgb[channel];
    }
    return true;
}

/* Two series for each curve: the line, and its texels. */
static void series_init(const struct curve *curve, size_t node_count, const char *color,
                        enum plot_dash dash, struct plot_series series[2])
{
    series[0] = (struct plot_series){ .label = curve->label,
                                      .count = POINT_COUNT,
                                      .x = curve->x,
                                      .y = curve->y,
                                      .color = color,
                                      .dash = dash };
    series[1] = (struct plot_series){ .kind = PLOT_POINTS,
                                      .count = node_count,
                                      .x = curve->node_x,
                                      .y = curve->node_y,
                                      .color = color,
                                      .is_hollow = true };
}

static struct plot plot_of(const struct lut_splat *lut, const struct plot_series *series, size_t count,
                           char title[192], char caption[512])
{
    const struct lut_splat_row *const first = &lut->rows[0];
    double worst = 0;
    for (size_t i = 0; i < lut->row_count; i++)
        worst = fmax(worst, lut->rows[i].error.max);
    if (lut->row_count == 1)
        snprintf(title, 192, "%s, splat table of %d texels", first->material.name, lut->node_count);
    else
        snprintf(title, 192, "Splat table of %zu materials, %d texels each: green", lut->row_count,
                 lut->node_count);
    snprintf(caption, 512,
             "As the table gives it back, interpolated between its texels%s. Stored in %s. Largest "
             "relative error %.2g, %.2g were asked.%s",
             lut->node_count <= NODE_LIMIT ? " (circles; the first, at r = 0, is not shown)" : "",
             lut->is_half ? "half" : "float", worst, lut->epsilon,
             lut->row_count > ROW_LIMIT ? " Only the first materials are drawn." : "");
    return (
        struct plot){ .title = title,
                      .caption = caption,
                      .x = { .title = "distance r from where the light entered, mm", .scale = PLOT_LOG },
                      .y = { .title = "R_d, 1/mm\xc2\xb2", .scale = PLOT_LOG },
                      .series = series,
                      .series_count = count,
                      .has_legend = true };
}

bool lut_splat_figure_create(const struct lut_splat *lut, char **svg_out, size_t *size_out,
                             dipole_status *status)
{
    static const char *const channel_colors[] = { PLOT_RED, PLOT_GREEN, PLOT_BLUE };
    static const char *const row_colors[ROW_LIMIT] = { PLOT_BLUE, "#d55e00", PLOT_GREEN, "#aa4499",
                                                       "#999933", "#332288", PLOT_RED,   PLOT_GREY };
    const bool is_one = lut->row_count == 1;
    const size_t rows = lut->row_count < ROW_LIMIT ? lut->row_count : ROW_LIMIT;
    const size_t count = is_one ? IO_CHANNEL_COUNT : rows;
    struct curve *const curves = calloc(ROW_LIMIT, sizeof *curves);
    struct plot_series series[2 * ROW_LIMIT];
    char title[192], caption[512];
    *svg_out = NULL;
    bool is_done = curves != NULL;
    for (size_t i = 0; i < count && is_done; i++) {
        struct curve *const curve = &curves[i];
        is_done = curve_init(lut, is_one ? 0 : i, is_one ? (int)i : GREEN, curve);
        snprintf(curve->label, sizeof curve->label, "%s",
                 is_one ? io_channel_names[i] : lut->rows[i].material.name);
        series_init(curve, lut->node_count <= NODE_LIMIT ? (size_t)lut->node_count : 0,
                    is_one ? channel_colors[i] : row_colors[i], (enum plot_dash)(i % (PLOT_DOTTED + 1)),
                    &series[2 * i]);
    }
    if (is_done) {
        const struct plot plot = plot_of(lut, series, 2 * count, title, caption);
        is_done = plot_svg_create(&plot, svg_out, size_out, status);
    } else {
        fail_without_memory(status);
    }
    for (size_t i = 0; i < count && curves; i++)
        free(curves[i].node_x);
    free(curves);
    return is_done;
}

/* ---- contact sheet ------------------------------------------------------------------------------ */

/* Values of one slice, T downwards. */
static void tile_fill(const struct lut_tsm *lut, int slice, double *values)
{
    const size_t width = (size_t)lut->size[0] * (size_t)lut->size[2];
    for (int t = 0; t < lut->size[1]; t++)
        for (int s = 0; s < lut->size[0]; s++) {
            const size_t at = (size_t)t * width + (size_t)slice * (size_t)lut->size[0] + (size_t)s;
            values[t * lut->size[0] + s] =
                (double)lut->rgb[at * IO_CHANNEL_COUNT + GREEN] * lut->scale[GREEN];
        }
}

bool lut_tsm_figure_create(const struct lut_tsm *lut, char **svg_out, size_t *size_out,
                           dipole_status *status)
{
    const size_t count = (size_t)lut->sample_count, texels = (size_t)lut->size[0] * (size_t)lut->size[1];
    struct plot_tile *const tiles = calloc(count, sizeof *tiles);
    double *const values = calloc(count * texels, sizeof *values);
    char(*const labels)[48] = calloc(count, sizeof *labels);
    char title[192], subtitle[256];
    double most = 0;
    *svg_out = NULL;
    bool is_done = (tiles && values && labels) || fail_without_memory(status);
    for (size_t i = 0; i < count && is_done; i++) {
        const double *const offset = lut->samples[i].offset_mm;
        snprintf(labels[i], sizeof labels[i], "%zu: %.3g, %.3g mm", i, offset[0], offset[1]);
        tiles[i] = (struct plot_tile){ labels[i], lut->size[0], lut->size[1], values + i * texels };
        tile_fill(lut, (int)i, values + i * texels);
        for (size_t k = 0; k < texels; k++)
            most = fmax(most, values[i * texels + k]);
    }
    if (is_done) {
        snprintf(title, sizeof title, "%s, volume of %d \xc3\x97 %d \xc3\x97 %d: green", lut->material.name,
                 lut->size[0], lut->size[1], lut->size[2]);
        snprintf(
            subtitle, sizeof subtitle,
            "Across: cosine of the normal and the way out, -1 to 1. Down: how much deeper the point lies, "
            "%.3g to %.3g mm.",
            -lut->depth_max_mm, lut->depth_max_mm);
        const struct plot_sheet sheet = {
            .width_px = count > 13 ? 1240 : 960,
            .title = title,
            .subtitle = subtitle,
            .caption = "A tile for each sample of the pattern, with its place beside "
                       "the point. The five nearest leave to the local response what "
                       "lies about as deep as the point.",
            .tiles = tiles,
            .tile_count = count,
            .columns = count == 21 ? 7 : 0,
            .scale = PLOT_LOG,
            .min = most > 0 ? most * 1e-6 : 1e-6,
            .max = most > 0 ? most : 1,
            .value_title = "response, 1/mm\xc2\xb2",
            .x_title = "cosine",
            .y_title = "depth"
        };
        is_done = plot_sheet_svg_create(&sheet, svg_out, size_out, status);
    }
    free(labels);
    free(values);
    free(tiles);
    return is_done;
}
