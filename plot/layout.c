#include "plot/layout.h"

#include "plot/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- wrapped text ------------------------------------------------------------------------------- */

size_t plot_line_break(const char *s, double font_px, double limit_px, const char **next_out)
{
    size_t best = 0, i = 0;
    while (s[i] && s[i] != '\n') {
        if (s[i] == ' ')
            best = i;
        if (best > 0 && plot_text_width_px(s, i + 1, font_px) > limit_px) {
            *next_out = s + best + 1;
            return best;
        }
        i++;
    }
    *next_out = s + i + (s[i] == '\n');
    return i;
}

int plot_line_count(const char *s, double font_px, double limit_px)
{
    int count = 0;
    for (; s && *s; count++)
        plot_line_break(s, font_px, limit_px, &s);
    return count;
}

double plot_head_height_px(const char *title, const char *subtitle, double limit_px)
{
    return PLOT_PAD_PX +
           PLOT_LINE_HEIGHT * PLOT_TITLE_PX * plot_line_count(title, PLOT_TITLE_PX, limit_px) +
           PLOT_LINE_HEIGHT * PLOT_SUBTITLE_PX * plot_line_count(subtitle, PLOT_SUBTITLE_PX, limit_px) + 10;
}

/* ---- ranges ------------------------------------------------------------------------------------- */

static void extend(enum plot_scale scale, const double *values, size_t index, double *low, double *high)
{
    if (values && plot_value_is_drawable(scale, values[index])) {
        *low = fmin(*low, values[index]);
        *high = fmax(*high, values[index]);
    }
}

static struct plot_range range_find(const struct plot *plot, bool is_x)
{
    const struct plot_axis *const axis = is_x ? &plot->x : &plot->y;
    if (axis->min < axis->max && plot_value_is_drawable(axis->scale, axis->min) &&
        plot_value_is_drawable(axis->scale, axis->max))
        return (struct plot_range){ .scale = axis->scale, .min = axis->min, .max = axis->max };
    double low = INFINITY, high = -INFINITY;
    for (size_t s = 0; s < plot->series_count; s++) {
        const struct plot_series *const series = &plot->series[s];
        for (size_t i = 0; i < series->count; i++) {
            if (is_x) {
                extend(axis->scale, series->x, i, &low, &high);
                continue;
            }
            if (series->kind != PLOT_BAND)
                extend(axis->scale, series->y, i, &low, &high);
            extend(axis->scale, series->y_low, i, &low, &high);
            extend(axis->scale, series->y_high, i, &low, &high);
        }
    }
    for (size_t i = 0; i < plot->marker_count; i++)
        if (plot->markers[i].is_horizontal != is_x)
            extend(axis->scale, &plot->markers[i].value, 0, &low, &high);
    return plot_range_round(axis->scale, low, high);
}

/* ---- positions ---------------------------------------------------------------------------------- */

double plot_layout_x_px(const struct plot_layout *layout, double x)
{
    return layout->left + plot_range_position(&layout->x, x) * (layout->right - layout->left);
}

double plot_layout_y_px(const struct plot_layout *layout, double y)
{
    return layout->bottom - plot_range_position(&layout->y, y) * (layout->bottom - layout->top);
}

static double label_width_px(const char *label, double font_px)
{
    return label ? plot_text_width_px(label, strlen(label), font_px) : 0;
}

static double tick_label_width_px(const struct plot_tick_label *label)
{
    return label_width_px(label->base, PLOT_LABEL_PX) +
           label_width_px(label->exponent, PLOT_LABEL_PX * 0.75);
}

double plot_ticks_width_px(const struct plot_ticks *ticks)
{
    double width = 0;
    for (size_t i = 0; i < ticks->count; i++) {
        struct plot_tick_label label;
        plot_tick_label_init(ticks, &ticks->ticks[i], &label);
        if (ticks->ticks[i].has_label)
            width = fmax(width, tick_label_width_px(&label));
    }
    return width;
}

static int pole_compare(const void *a, const void *b)
{
    const struct plot_pole *const p = a, *const q = b;
    if (p->position != q->position)
        return p->position < q->position ? -1 : 1;
    return p->index < q->index ? -1 : 1;
}

/*
 * Flags fly to the right of their poles. From the right: a flag goes above every pole it would cross, so
 * that neither flags nor poles touch another's text. Returns the number of lanes.
 */
static int flags_place(struct plot_layout *layout)
{
    int lane_count = 0;
    for (size_t i = layout->pole_count; i-- > 0;) {
        struct plot_pole *const pole = &layout->poles[i];
        pole->lane = 0;
        for (size_t j = i + 1; j < layout->pole_count; j++)
            if (layout->poles[j].x_px < pole->x_px + pole->width_px && layout->poles[j].lane >= pole->lane)
                pole->lane = layout->poles[j].lane + 1;
        if (pole->lane >= lane_count)
            lane_count = pole->lane + 1;
    }
    return lane_count;
}

static int row_compare(const void *a, const void *b)
{
    const struct plot_row *const p = a, *const q = b;
    if (p->wanted_px != q->wanted_px)
        return p->wanted_px < q->wanted_px ? -1 : 1;
    if (p->is_marker != q->is_marker)
        return p->is_marker ? 1 : -1;
    return p->index < q->index ? -1 : 1;
}

/* Push rows apart, down first and then up from the bottom, keeping their order. */
static void rows_spread(struct plot_layout *layout)
{
    const size_t count = layout->row_count;
    qsort(layout->rows, count, sizeof *layout->rows, row_compare);
    const double gap =
        fmin(PLOT_LABEL_PX * PLOT_LINE_HEIGHT, (layout->bottom - layout->top) / (double)(count + 1));
    double free_px = -INFINITY;
    for (size_t i = 0; i < count; i++) {
        struct plot_row *const row = &layout->rows[i];
        row->y_px = fmax(row->wanted_px, free_px);
        free_px = row->y_px + gap;
    }
    free_px = layout->bottom;
    for (size_t i = count; i-- > 0;) {
        struct plot_row *const row = &layout->rows[i];
        row->y_px = fmin(row->y_px, free_px);
        free_px = row->y_px - gap;
    }
}

/* Beside the last point, or where the line left the frame; one that ends at the right edge gets a leader.
 */
static void row_init_series(const struct plot *plot, const struct plot_layout *layout, size_t index,
                            struct plot_row *row)
{
    const struct plot_series *const series = &plot->series[index];
    *row = (struct plot_row){ .index = index, .wanted_px = layout->bottom };
    for (size_t i = 0; i < series->count; i++) {
        const double x_px = plot_layout_x_px(layout, series->x[i]);
        const double y_px = series->kind == PLOT_BAND ? (plot_layout_y_px(layout, series->y_low[i]) +
                                                         plot_layout_y_px(layout, series->y_high[i])) /
                                                            2
                                                      : plot_layout_y_px(layout, series->y[i]);
        if (x_px >= layout->left - 0.5 && x_px <= layout->right + 0.5 && !isnan(y_px)) {
            row->wanted_px = fmin(fmax(y_px, layout->top), layout->bottom);
            row->has_leader = x_px > layout->right - 2 && fabs(row->wanted_px - y_px) < 0.5;
        }
    }
}

static void layout_init(const struct plot *plot, struct plot_layout *layout)
{
    layout->width_px = plot->width_px > 0 ? plot->width_px : 960;
    layout->height_px = plot->height_px > 0 ? plot->height_px : 640;
    layout->x = range_find(plot, true);
    layout->y = range_find(plot, false);

    /* Sides. The labels of the y axis depend a little on the height, which depends on nothing wide. */
    const double text_px = layout->width_px - 2 * PLOT_PAD_PX;
    double right = PLOT_PAD_PX, flag_width = 0;
    for (size_t i = 0; i < plot->series_count; i++)
        if (plot->series[i].label)
            right = fmax(right, PLOT_PAD_PX + 24 + PLOT_SWATCH_PX +
                                    label_width_px(plot->series[i].label, PLOT_LABEL_PX));
    layout->pole_count = 0;
    for (size_t i = 0; i < plot->marker_count; i++) {
        const struct plot_marker *const marker = &plot->markers[i];
        const double width = label_width_px(marker->label, PLOT_CAPTION_PX) + 12;
        const double position = plot_range_position(&layout->x, marker->value);
        if (marker->is_horizontal) {
            if (marker->label)
                right = fmax(right, PLOT_PAD_PX + 24 + PLOT_SWATCH_PX +
                                        label_width_px(marker->label, PLOT_LABEL_PX));
        } else if (position >= 0 && position <= 1) {
            layout->poles[layout->pole_count++] =
                (struct plot_pole){ .index = i, .position = position, .width_px = width };
            flag_width = fmax(flag_width, width);
        }
    }
    right = fmin(fmax(right, flag_width), layout->width_px / 2);
    qsort(layout->poles, layout->pole_count, sizeof *layout->poles, pole_compare);

    const double head = plot_head_height_px(plot->title, plot->subtitle, text_px);
    const double foot =
        PLOT_PAD_PX + 8 + 1.6 * PLOT_LABEL_PX + (plot->x.title ? 1.9 * PLOT_LABEL_PX : 0) +
        PLOT_LINE_HEIGHT * PLOT_CAPTION_PX * plot_line_count(plot->caption, PLOT_CAPTION_PX, text_px);
    layout->right = layout->width_px - right;
    layout->bottom = fmax(layout->height_px - foot, head + 20);
    plot_ticks_place(&layout->y, (int)fmax(2, (layout->bottom - head) / 36), &layout->y_ticks);
    layout->left = PLOT_PAD_PX + (plot->y.title ? 1.9 * PLOT_LABEL_PX : 0) +
                   plot_ticks_width_px(&layout->y_ticks) + 12;
    layout->left = fmin(layout->left, layout->right - 20);
    const double width = layout->right - layout->left;
    plot_ticks_place(&layout->x, (int)fmax(2, width / 80), &layout->x_ticks);

    for (size_t i = 0; i < layout->pole_count; i++)
        layout->poles[i].x_px = layout->left + layout->poles[i].position * width;
    layout->top = fmin(head + flags_place(layout) * PLOT_FLAG_PX, layout->bottom - 10);

    layout->row_count = 0;
    for (size_t i = 0; i < plot->series_count; i++)
        if (plot->series[i].label) {
            struct plot_row *const row = &layout->rows[layout->row_count++];
            if (plot->has_legend)
                *row = (struct plot_row){ .index = i, .wanted_px = layout->top + 12 };
            else
                row_init_series(plot, layout, i, row);
        }
    for (size_t i = 0; i < plot->marker_count; i++) {
        const struct plot_marker *const marker = &plot->markers[i];
        const double position = plot_range_position(&layout->y, marker->value);
        if (marker->is_horizontal && marker->label && position >= 0 && position <= 1)
            layout->rows[layout->row_count++] =
                (struct plot_row){ .index = i,
                                   .is_marker = true,
                                   .wanted_px = plot_layout_y_px(layout, marker->value),
                                   .has_leader = true };
    }
    rows_spread(layout);
}

bool plot_layout_create(const struct plot *plot, struct plot_layout **layout_out, dipole_status *status)
{
    struct plot_layout *const layout = calloc(1, sizeof *layout);
    *layout_out = layout;
    if (layout) {
        layout->rows = calloc(plot->series_count + plot->marker_count + 1, sizeof *layout->rows);
        layout->poles = calloc(plot->marker_count + 1, sizeof *layout->poles);
    }
    if (!layout || !layout->rows || !layout->poles) {
        plot_layout_destroy(layout);
        *layout_out = NULL;
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory while drawing a plot");
    }
    layout_init(plot, layout);
    return true;
}

void plot_layout_destroy(struct plot_layout *layout)
{
    if (layout) {
        free(layout->rows);
        free(layout->poles);
    }
    free(layout);
}
