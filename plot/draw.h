/* What charts and sheets draw alike. */
#ifndef PLOT_DRAW_H
#define PLOT_DRAW_H

#include "plot/axis.h"
#include "plot/text.h"

/* A picture and the texts around it; NULL for none. */
struct plot_page {
    double width_px, height_px; /* whole numbers */
    const char *title, *subtitle, *caption;
};

/* Open the <svg> element, which the caller closes: white ground, title and subtitle at the top, caption at
 * the bottom. */
void plot_page_begin(struct plot_text *out, const struct plot_page *page);

/* Draw s (may be NULL) from baseline y_px of its first line down; style holds further attributes. */
void plot_lines_draw(struct plot_text *out, const char *s, double x_px, double y_px, double font_px,
                     const char *style, double limit_px);

void plot_tick_label_draw(struct plot_text *out, const struct plot_tick_label *label, double x_px,
                          double y_px, const char *anchor);

#endif
