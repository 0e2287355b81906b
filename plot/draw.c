#include "plot/draw.h"

#include "plot/layout.h"

#include <stdlib.h>
#include <string.h>

void plot_lines_draw(struct plot_text *out, const char *s, double x_px, double y_px, double font_px,
                     const char *style, double limit_px)
{
    while (s && *s) {
        const char *const line = s;
        const size_t size = plot_line_break(line, font_px, limit_px, &s);
        char *const copy = strndup(line, size);
        if (!copy) {
            out->has_failed = true;
            return;
        }
        plot_text_print(out, "<text x=\"%f\" y=\"%f\" font-size=\"%f\" ", x_px, y_px, font_px);
        plot_text_add(out, style, strlen(style));
        plot_text_print(out, ">%s</text>\n", copy);
        free(copy);
        y_px += PLOT_LINE_HEIGHT * font_px;
    }
}

void plot_tick_label_draw(struct plot_text *out, const struct plot_tick_label *label, double x_px,
                          double y_px, const char *anchor)
{
    plot_text_print(out, "<text x=\"%f\" y=\"%f\" text-anchor=\"%s\" font-size=\"%d\">%s", x_px, y_px,
                    anchor, PLOT_LABEL_PX, label->base);
    if (label->exponent[0])
        plot_text_print(out, "<tspan dy=\"%f\" font-size=\"%f\">%s</tspan>", -0.42 * PLOT_LABEL_PX,
                        0.75 * PLOT_LABEL_PX, label->exponent);
    plot_text_print(out, "</text>\n");
}

void plot_page_begin(struct plot_text *out, const struct plot_page *page)
{
    const int width = (int)page->width_px, height = (int)page->height_px;
    const double text_px = page->width_px - 2 * PLOT_PAD_PX;
    plot_text_print(out,
                    "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
                    "viewBox=\"0 0 %d %d\" font-family=\"sans-serif\" fill=\"#222222\" role=\"img\">\n",
                    width, height, width, height);
    if (page->title)
        plot_text_print(out, "<title>%s</title>\n", page->title);
    plot_text_print(out, "<rect width=\"%d\" height=\"%d\" fill=\"white\"/>\n", width, height);

    double y_px = PLOT_PAD_PX + PLOT_TITLE_PX;
    plot_lines_draw(out, page->title, PLOT_PAD_PX, y_px, PLOT_TITLE_PX, "font-weight=\"bold\"", text_px);
    y_px += PLOT_LINE_HEIGHT * PLOT_TITLE_PX * plot_line_count(page->title, PLOT_TITLE_PX, text_px) - 5;
    plot_lines_draw(out, page->subtitle, PLOT_PAD_PX, y_px, PLOT_SUBTITLE_PX, "fill=\"#555555\"", text_px);
    const int caption_lines = plot_line_count(page->caption, PLOT_CAPTION_PX, text_px);
    y_px = page->height_px - PLOT_PAD_PX + 4 - PLOT_LINE_HEIGHT * PLOT_CAPTION_PX * (caption_lines - 1);
    plot_lines_draw(out, page->caption, PLOT_PAD_PX, y_px, PLOT_CAPTION_PX, "fill=\"#555555\"", text_px);
}
