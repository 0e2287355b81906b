/* Where everything in a plot stands: decided before anything is drawn. */
#ifndef PLOT_LAYOUT_H
#define PLOT_LAYOUT_H

#include "plot/axis.h"

enum {
    PLOT_PAD_PX = 20,
    PLOT_TITLE_PX = 21,
    PLOT_SUBTITLE_PX = 14,
    PLOT_LABEL_PX = 13,
    PLOT_CAPTION_PX = 12,
    PLOT_SWATCH_PX = 26,
    PLOT_FLAG_PX = 17, /* height of one row of marker labels */
};
#define PLOT_LINE_HEIGHT 1.35 /* in font sizes */

/* A label beside the frame and the row it got. */
struct plot_row {
    size_t index; /* into series, or into markers */
    bool is_marker;
    double wanted_px, y_px;
    bool has_leader;
};

/* A vertical marker: a pole through the frame with a flag above it. */
struct plot_pole {
    size_t index;
    double position, x_px, width_px;
    int lane;
};

struct plot_layout {
    double width_px, height_px, left, top, right, bottom;
    struct plot_range x, y;
    struct plot_ticks x_ticks, y_ticks;
    struct plot_row *rows;
    size_t row_count;
    struct plot_pole *poles;
    size_t pole_count;
};

DIPOLE_CHECKED bool plot_layout_create(const struct plot *plot, struct plot_layout **layout_out,
                                       dipole_status *status);
void plot_layout_destroy(struct plot_layout *layout);

/* Positions of values; NaN when the axis cannot show them. */
double plot_layout_x_px(const struct plot_layout *layout, double x);
double plot_layout_y_px(const struct plot_layout *layout, double y);

/* Bytes of the first line of s when it may be limit_px wide; *next_out is where the following begins. */
size_t plot_line_break(const char *s, double font_px, double limit_px, const char **next_out);

/* Number of lines of s (may be NULL) broken so. */
int plot_line_count(const char *s, double font_px, double limit_px);

/* From the top edge to where the picture begins, below its title and subtitle (either may be NULL). */
double plot_head_height_px(const char *title, const char *subtitle, double limit_px);

/* Width of the widest label. */
double plot_ticks_width_px(const struct plot_ticks *ticks);

#endif
