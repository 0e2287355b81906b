#include "plot/draw.h"
#include "plot/layout.h"
#include "plot/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* Okabe and Ito's colours, without the yellow that vanishes on white. */
static const char *const palette[] = { "#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                       "#e69f00", "#56b4e9", "#000000" };

static const char *dash_pattern(enum plot_dash dash)
{
    static const char *const patterns[] = { "none", "9 5", "10 4 2 4", "2 4" };
    return patterns[dash];
}

static const char *series_color(const struct plot *plot, size_t index)
{
    const char *const color = plot->series[index].color;
    return color ? color : palette[index % COUNT(palette)];
}

static void axis_line(struct plot_text *out, const struct plot_layout *layout, double px, bool is_x,
                      const char *style)
{
    plot_text_print(out, "<line x1=\"%f\" y1=\"%f\" x2=\"%f\" y2=\"%f\" ", is_x ? px : layout->left,
                    is_x ? layout->top : px, is_x ? px : layout->right, is_x ? layout->bottom : px);
    plot_text_add(out, style, strlen(style));
    plot_text_print(out, "/>\n");
}

static void axis_draw(struct plot_text *out, const struct plot *plot, const struct plot_layout *layout,
                      bool is_x)
{
    const struct plot_ticks *const ticks = is_x ? &layout->x_ticks : &layout->y_ticks;
    const struct plot_axis *const axis = is_x ? &plot->x : &plot->y;
    for (size_t i = 0; i < ticks->count; i++) {
        const struct plot_tick *const tick = &ticks->ticks[i];
        const double px =
            is_x ? plot_layout_x_px(layout, tick->value) : plot_layout_y_px(layout, tick->value);
        const double length = tick->has_label ? 6 : 3.5;
        if (tick->has_label)
            axis_line(out, layout, px, is_x, "stroke=\"#e4e4e4\"");
        plot_text_print(out, "<line x1=\"%f\" y1=\"%f\" x2=\"%f\" y2=\"%f\" stroke=\"#444444\"/>\n",
                        is_x ? px : layout->left, is_x ? layout->bottom : px,
                        is_x ? px : layout->left - length, is_x ? layout->bottom + length : px);
        if (tick->has_label) {
            struct plot_tick_label label;
            plot_tick_label_init(ticks, tick, &label);
            if (is_x)
                plot_tick_label_draw(out, &label, px, layout->bottom + 9 + PLOT_LABEL_PX, "middle");
            else
                plot_tick_label_draw(out, &label, layout->left - 10, px + 0.36 * PLOT_LABEL_PX, "end");
        }
    }
    if (!axis->title)
        return;
    if (is_x) {
        plot_text_print(out, "<text x=\"%f\" y=\"%f\" text-anchor=\"middle\" font-size=\"%d\">%s</text>\n",
                        (layout->left + layout->right) / 2, layout->bottom + 12 + 2.7 * PLOT_LABEL_PX,
                        PLOT_LABEL_PX + 1, axis->title);
    } else {
        const double y_px = (layout->top + layout->bottom) / 2;
        plot_text_print(out,
                        "<text x=\"%f\" y=\"%f\" transform=\"rotate(-90 %f %f)\" text-anchor=\"middle\" "
                        "font-size=\"%d\">%s</text>\n",
                        (double)PLOT_PAD_PX + PLOT_LABEL_PX, y_px, (double)PLOT_PAD_PX + PLOT_LABEL_PX,
                        y_px, PLOT_LABEL_PX + 1, axis->title);
    }
}

static const char *line_width(const struct plot_series *series)
{
    return series->is_thin ? "1.2" : "2.4";
}

/* One stroke per run of drawable points; a lone point becomes a dot. */
static void line_draw(struct plot_text *out, const struct plot_layout *layout,
                      const struct plot_series *series, const char *color)
{
    plot_text_print(out,
                    "<path fill=\"none\" stroke=\"%s\" stroke-width=\"%s\" stroke-linejoin=\"round\" "
                    "stroke-dasharray=\"%s\" d=\"",
                    color, line_width(series), dash_pattern(series->dash));
    bool is_down = false, is_lone = false;
    for (size_t i = 0; i <= series->count; i++) {
        const double x_px = i < series->count ? plot_layout_x_px(layout, series->x[i]) : NAN;
        const double y_px = i < series->count ? plot_layout_y_px(layout, series->y[i]) : NAN;
        if (isnan(x_px) || isnan(y_px)) {
            if (is_lone)
                plot_text_print(out, "h0.01");
            is_down = is_lone = false;
            continue;
        }
        plot_text_print(out, is_down ? "L%f %f" : "M%f %f", x_px, y_px);
        is_lone = !is_down;
        is_down = true;
    }
    plot_text_print(out, "\"/>\n");
}

static bool band_holds(const struct plot_layout *layout, const struct plot_series *series, size_t i)
{
    return i < series->count && !isnan(plot_layout_x_px(layout, series->x[i])) &&
           !isnan(plot_layout_y_px(layout, series->y_low[i])) &&
           !isnan(plot_layout_y_px(layout, series->y_high[i]));
}

static void band_draw(struct plot_text *out, const struct plot_layout *layout,
                      const struct plot_series *series, const char *color)
{
    for (size_t first = 0, end; first < series->count; first = end + 1) {
        for (end = first; band_holds(layout, series, end);)
            end++;
        if (end - first < 2)
            continue;
        plot_text_print(out, "<path fill=\"%s\" fill-opacity=\"0.22\" d=\"M", color);
        for (size_t i = first; i < end; i++)
            plot_text_print(out, "%f %f ", plot_layout_x_px(layout, series->x[i]),
                            plot_layout_y_px(layout, series->y_high[i]));
        for (size_t i = end; i-- > first;)
            plot_text_print(out, "%f %f ", plot_layout_x_px(layout, series->x[i]),
                            plot_layout_y_px(layout, series->y_low[i]));
        plot_text_print(out, "Z\"/>\n");
    }
}

static void point_draw(struct plot_text *out, double x_px, double y_px, const struct plot_series *series,
                       const char *color, const char *tip)
{
    static const char *const outlines[] = { [PLOT_SQUARE] = "m-3.6 -3.6h7.2v7.2h-7.2z",
                                            [PLOT_DIAMOND] = "m0 -5l5 5l-5 5l-5 -5z",
                                            [PLOT_TRIANGLE] = "m0 -5l4.8 8.4h-9.6z" };
    const char *const fill = series->is_hollow ? "none" : color;
    const char *const stroke = series->is_hollow ? color : "white";
    if (tip)
        plot_text_print(out, "<g><title>%s</title>\n", tip);
    if (series->mark == PLOT_DISC)
        plot_text_print(out,
                        "<circle cx=\"%f\" cy=\"%f\" r=\"4\" fill=\"%s\" stroke=\"%s\" "
                        "stroke-width=\"1.2\"/>\n",
                        x_px, y_px, fill, stroke);
    else
        plot_text_print(out, "<path fill=\"%s\" stroke=\"%s\" stroke-width=\"1.2\" d=\"M%f %f%s\"/>\n",
                        fill, stroke, x_px, y_px, outlines[series->mark]);
    if (tip)
        plot_text_print(out, "</g>\n");
}

/* From one end of an interval to the other. A hollow point's bar is left out where it would lie within. */
static void bar_draw(struct plot_text *out, const struct plot_layout *layout,
                     const struct plot_series *series, size_t i, const char *color)
{
    const double x_px = plot_layout_x_px(layout, series->x[i]),
                 y_px = plot_layout_y_px(layout, series->y[i]);
    double low_px = plot_layout_y_px(layout, series->y_low[i]),
           high_px = plot_layout_y_px(layout, series->y_high[i]);
    if (isnan(low_px)) /* an interval that reaches 0 on a logarithmic axis */
        low_px = layout->bottom + 20;
    if (isnan(high_px))
        high_px = y_px;
    if (series->is_hollow && low_px - y_px < 6 && y_px - high_px < 6)
        return;
    plot_text_print(out,
                    "<path stroke=\"%s\" stroke-width=\"1.4\" fill=\"none\" "
                    "d=\"M%f %fV%fM%f %fh8M%f %fh8\"/>\n",
                    color, x_px, low_px, high_px, x_px - 4, low_px, x_px - 4, high_px);
}

static void points_draw(struct plot_text *out, const struct plot_layout *layout,
                        const struct plot_series *series, const char *color)
{
    for (size_t i = 0; i < series->count; i++) {
        const double x_px = plot_layout_x_px(layout, series->x[i]),
                     y_px = plot_layout_y_px(layout, series->y[i]);
        if (isnan(x_px) || isnan(y_px))
            continue;
        if (series->y_low && series->y_high)
            bar_draw(out, layout, series, i, color);
        point_draw(out, x_px, y_px, series, color, series->tips ? series->tips[i] : NULL);
    }
}

static void series_draw(struct plot_text *out, const struct plot *plot, const struct plot_layout *layout,
                        size_t index)
{
    const struct plot_series *const series = &plot->series[index];
    const char *const color = series_color(plot, index);
    switch (series->kind) {
    case PLOT_LINE:
        line_draw(out, layout, series, color);
        break;
    case PLOT_POINTS:
        points_draw(out, layout, series, color);
        break;
    case PLOT_BAND:
        band_draw(out, layout, series, color);
        break;
    }
}

static void markers_draw(struct plot_text *out, const struct plot *plot, const struct plot_layout *layout)
{
    for (size_t i = 0; i < plot->marker_count; i++) {
        const struct plot_marker *const marker = &plot->markers[i];
        const double y_px = plot_layout_y_px(layout, marker->value);
        if (marker->is_horizontal && y_px >= layout->top - 0.5 && y_px <= layout->bottom + 0.5)
            plot_text_print(
                out,
                "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.3\" stroke-dasharray=\"%s\" "
                "d=\"M%f %fH%f\"/>\n",
                marker->color ? marker->color : PLOT_GREY, dash_pattern(marker->dash), layout->left, y_px,
                layout->right);
    }
    for (size_t i = 0; i < layout->pole_count; i++) {
        const struct plot_pole *const pole = &layout->poles[i];
        const struct plot_marker *const marker = &plot->markers[pole->index];
        const double flag_y_px = layout->top - 5 - pole->lane * PLOT_FLAG_PX;
        plot_text_print(out,
                        "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.3\" stroke-dasharray=\"%s\" "
                        "d=\"M%f %fV%f\"/>\n",
                        marker->color ? marker->color : PLOT_GREY, dash_pattern(marker->dash), pole->x_px,
                        layout->bottom, marker->label ? flag_y_px - 0.8 * PLOT_CAPTION_PX : layout->top);
        if (marker->label)
            plot_text_print(out, "<text x=\"%f\" y=\"%f\" font-size=\"%d\">%s</text>\n", pole->x_px + 5,
                            flag_y_px, PLOT_CAPTION_PX, marker->label);
    }
}

/* The swatch of a line, of a band or of points. */
static void swatch_draw(struct plot_text *out, const struct plot_series *series, const char *color,
                        double x_px, double y_px)
{
    switch (series->kind) {
    case PLOT_BAND:
        plot_text_print(out, "<path fill=\"%s\" fill-opacity=\"0.22\" d=\"M%f %fh%dv10h-%dz\"/>\n", color,
                        x_px, y_px - 5, PLOT_SWATCH_PX, PLOT_SWATCH_PX);
        break;
    case PLOT_POINTS:
        point_draw(out, x_px + PLOT_SWATCH_PX / 2.0, y_px, series, color, NULL);
        break;
    case PLOT_LINE:
        plot_text_print(out,
                        "<path fill=\"none\" stroke=\"%s\" stroke-width=\"%s\" stroke-dasharray=\"%s\" "
                        "d=\"M%f %fh%d\"/>\n",
                        color, line_width(series), dash_pattern(series->dash), x_px, y_px, PLOT_SWATCH_PX);
    }
}

static void row_draw(struct plot_text *out, const struct plot *plot, const struct plot_layout *layout,
                     const struct plot_row *row)
{
    const double x_px = layout->right + 18;
    const char *label;
    if (row->has_leader)
        plot_text_print(out, "<path fill=\"none\" stroke=\"#aaaaaa\" d=\"M%f %fL%f %f\"/>\n",
                        layout->right + 2, row->wanted_px, x_px - 2, row->y_px);
    if (row->is_marker) {
        const struct plot_marker *const marker = &plot->markers[row->index];
        label = marker->label;
        plot_text_print(out,
                        "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.3\" stroke-dasharray=\"%s\" "
                        "d=\"M%f %fh%d\"/>\n",
                        marker->color ? marker->color : PLOT_GREY, dash_pattern(marker->dash), x_px,
                        row->y_px, PLOT_SWATCH_PX);
    } else {
        label = plot->series[row->index].label;
        swatch_draw(out, &plot->series[row->index], series_color(plot, row->index), x_px, row->y_px);
    }
    plot_text_print(out, "<text x=\"%f\" y=\"%f\" font-size=\"%d\">%s</text>\n", x_px + PLOT_SWATCH_PX + 6,
                    row->y_px + 0.36 * PLOT_LABEL_PX, PLOT_LABEL_PX, label);
}

static bool has_data(const struct plot *plot, const struct plot_layout *layout)
{
    for (size_t s = 0; s < plot->series_count; s++)
        for (size_t i = 0; i < plot->series[s].count; i++) {
            const struct plot_series *const series = &plot->series[s];
            const double y = series->kind == PLOT_BAND ? series->y_high[i] : series->y[i];
            if (!isnan(plot_layout_x_px(layout, series->x[i])) && !isnan(plot_layout_y_px(layout, y)))
                return true;
        }
    return false;
}

static void plot_draw(struct plot_text *out, const struct plot *plot, const struct plot_layout *layout)
{
    const struct plot_page page = { .width_px = layout->width_px,
                                    .height_px = layout->height_px,
                                    .title = plot->title,
                                    .subtitle = plot->subtitle,
                                    .caption = plot->caption };
    plot_page_begin(out, &page);

    axis_draw(out, plot, layout, true);
    axis_draw(out, plot, layout, false);
    markers_draw(out, plot, layout);

    /* What lies beyond the axes is cut by an inner <svg>: a clip path would need an id. */
    plot_text_print(out,
                    "<svg x=\"%f\" y=\"%f\" width=\"%f\" height=\"%f\" viewBox=\"%f %f %f %f\" "
                    "overflow=\"hidden\">\n",
                    layout->left, layout->top, layout->right - layout->left, layout->bottom - layout->top,
                    layout->left, layout->top, layout->right - layout->left, layout->bottom - layout->top);
    for (size_t i = 0; i < plot->series_count; i++)
        series_draw(out, plot, layout, i);
    plot_text_print(out, "</svg>\n");
    plot_text_print(out,
                    "<path fill=\"none\" stroke=\"#444444\" stroke-width=\"1.2\" d=\"M%f %fV%fH%f\"/>\n",
                    layout->left, layout->top, layout->bottom, layout->right);
    if (!has_data(plot, layout))
        plot_text_print(out,
                        "<text x=\"%f\" y=\"%f\" text-anchor=\"middle\" font-size=\"%d\" "
                        "fill=\"#888888\" stroke=\"white\" stroke-width=\"8\" paint-order=\"stroke\">"
                        "no values to show</text>\n",
                        (layout->left + layout->right) / 2, (layout->top + layout->bottom) / 2,
                        PLOT_TITLE_PX);
    for (size_t i = 0; i < layout->row_count; i++)
        row_draw(out, plot, layout, &layout->rows[i]);
    plot_text_print(out, "</svg>\n");
}

bool plot_svg_create(const struct plot *plot, char **svg_out, size_t *size_out, dipole_status *status)
{
    *svg_out = NULL;
    struct plot_layout *layout = NULL;
    if (!plot_layout_create(plot, &layout, status))
        return false;
    struct plot_text text = { 0 };
    plot_draw(&text, plot, layout);
    plot_layout_destroy(layout);
    if (text.has_failed) {
        plot_text_destroy(&text);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory while drawing a plot");
    }
    *svg_out = text.data;
    *size_out = text.size;
    return true;
}
