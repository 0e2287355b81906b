#include "renderer/gui/gui.h"
#include "renderer/window/window.h"

#include <stdio.h>

enum { TEXT_SIZE = 96 };

static void name_side(const struct window_side *side, const char *which, char text[TEXT_SIZE])
{
    snprintf(text, TEXT_SIZE, "%s: %s, \u03b5 %.3g, %.0f ms", which,
             render_technique_names[side->report.technique], side->report.epsilon, side->time_ms);
}

/* Where the picture stands, in the window's units. */
struct place {
    double left, width, height, margin;
};

static void show_split(const struct window *window, const struct place *place)
{
    char left[TEXT_SIZE], right[TEXT_SIZE];
    double left_width, right_width, text_height;
    name_side(&window->sides[0], "left", left);
    name_side(&window->sides[1], "right", right);
    gui_mark_size(left, &left_width, &text_height);
    gui_mark_size(right, &right_width, &text_height);
    gui_mark_divider(place->left + window->divider * place->width, 0, place->height);
    gui_mark_text(place->left + place->margin, place->margin, left);
    /* side by side, or one below the other where both have no room */
    const bool is_narrow = left_width + right_width + 3 * place->margin > place->width;
    gui_mark_text(place->left + place->width - place->margin - right_width,
                  place->margin + (is_narrow ? text_height + 0.5 * place->margin : 0), right);
}

static void show_difference(const struct window *window, const struct place *place)
{
    const struct window_difference *const difference = &window->difference;
    char lines[3][TEXT_SIZE], low[24], high[24];
    double width, height;
    name_side(&window->sides[0], "left", lines[0]);
    name_side(&window->sides[1], "right", lines[1]);
    if (window->has_difference)
        snprintf(lines[2], TEXT_SIZE, "right \u2212 left: RMSE %.3g %%, max %.3g %% of the brightest",
                 100 * difference->rmse, 100 * difference->max);
    else
        snprintf(lines[2], TEXT_SIZE, "right \u2212 left");
    for (int i = 0; i < 3; i++) {
        gui_mark_size(lines[i], &width, &height);
        gui_mark_text(place->left + place->margin, place->margin + i * (height + 0.5 * place->margin),
                      lines[i]);
    }
    snprintf(low, sizeof low, "\u2212%g %%", 100 * difference->range);
    snprintf(high, sizeof high, "+%g %%", 100 * difference->range);
    const double wanted = 300 * gui_scale(), most = place->width - 8 * height;
    const double scale_width = wanted < most ? wanted : most;
    if (scale_width > 0)
        gui_mark_scale(place->left + 0.5 * (place->width - scale_width), place->height - 3 * height,
                       scale_width, 0.6 * height, window->scale_rgb[0], WINDOW_COLOUR_COUNT,
                       (const char *const[]){ low, "0", high });
}

void window_marks_show(struct window *window)
{
    const struct window_area area = window_find_area(window);
    const struct place place = { .left = area.x_px / area.px_per_unit,
                                 .width = area.width_px / area.px_per_unit,
                                 .height = area.height_px / area.px_per_unit,
                                 .margin = 8 * gui_scale() };
    if (window->panel.message[0])
        gui_mark_note(place.left + place.margin, place.height - place.margin,
                      place.width - 2 * place.margin, window->panel.is_failure ? GUI_WARNING : GUI_GOOD,
                      window->panel.message);
    if (window->sides[1].display == 0) /* not drawn yet */
        return;
    if (window->comparison == WINDOW_SPLIT)
        show_split(window, &place);
    else if (window->comparison == WINDOW_DIFFERENCE)
        show_difference(window, &place);
}
