/*
 * Panels and marks over a window: Dear ImGui behind a C header. One window at a time; all functions belong
 * to the thread of its OpenGL context. No exception leaves it. Lengths are the window's own units, y down.
 */
#ifndef RENDERER_GUI_GUI_H
#define RENDERER_GUI_GUI_H

#include "libdipole/dipole.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a text looks. */
enum gui_tone { GUI_PLAIN = 0, GUI_DIM, GUI_WARNING, GUI_GOOD };

/* What a slider spans. */
struct gui_range {
    double min, max;
    bool is_log;
    const char *format; /* printf, of a double */
};

/* ---- frames ------------------------------------------------------------------------------------- */

/* window: GLFWwindow *, context current, its callbacks set: they are still called. font_path may lead
 * nowhere: then a small font is taken. Fails with DIPOLE_NOT_SUPPORTED. */
DIPOLE_CHECKED bool gui_create(void *window, const char *font_path, dipole_status *status);
void gui_destroy(void);

/* Everything else below stands between the two; end draws into the framebuffer that is bound. */
void gui_begin(void);
void gui_end(void);

/* Unit of what is laid out: 1 on a usual screen, 2 on one of twice as many pixels. */
double gui_scale(void);

/* Whether keys belong to a text that is typed; whether a list stands open, which takes every click. */
bool gui_is_typing(void);
bool gui_has_list(void);

/* ---- panel -------------------------------------------------------------------------------------- */

/* At the left edge, as high as the window. */
void gui_panel_begin(double width, double height);
void gui_panel_end(void);

/* A heading that opens and closes what follows: false when closed. */
bool gui_section(const char *title, bool is_open_at_first);

/* Text is broken into lines; what a value shows is cut off where it does not fit, and whole in a tip. */
void gui_text(enum gui_tone tone, const char *text);
void gui_value(const char *label, enum gui_tone tone, const char *value);

/* True when the user has changed what the last argument points to. The label stands to the left. */
bool gui_slider(const char *label, const struct gui_range *range, double *value);
bool gui_choice(const char *label, const char *const *names, size_t count, size_t *index);
bool gui_check(const char *label, bool *is_set);
bool gui_field(const char *label, char *text, size_t size);

/* Three sliders in a row under their label, for red, green and blue or x, y, z; the index of the one that
 * was changed, else -1. */
int gui_sliders(const char *label, bool is_colour, const struct gui_range *range, double values[3]);

bool gui_button(const char *label);
void gui_same_line(void);

/* A row of numbers as a curve, oldest first, from 0 to max. */
void gui_plot(const float *values, size_t count, double max);

/* A table of texts, cell by cell; widths are parts of the panel's. false: out of sight, neither cells nor
 * an end must follow. */
bool gui_table_begin(const char *name, const double *widths, size_t column_count);
void gui_cell(enum gui_tone tone, const char *text);
void gui_table_end(void);

/* Shown while the mouse is over what stands before it. */
void gui_tip(const char *text);

/* Names inside belong to that number, so that they may be the same for others. */
void gui_group_begin(size_t number);
void gui_group_end(void);

/* What is disabled is dim and cannot be changed. */
void gui_disabled_begin(bool is_disabled);
void gui_disabled_end(void);

/* A small button at the left edge of a window whose panel is closed; true when it is pressed. */
bool gui_opener(void);

/* ---- marks over the picture --------------------------------------------------------------------- */

/* Size of a text in its box. */
void gui_mark_size(const char *text, double *width, double *height);
void gui_mark_text(double x, double y, const char *text);

/* A text broken into lines of a width, which ends at bottom. */
void gui_mark_note(double x, double bottom, double width, enum gui_tone tone, const char *text);

/* An upright line with a grip in its middle. */
void gui_mark_divider(double x, double top, double bottom);

/* A strip of colours (rgb, 0 to 1, left to right), with a text under its start, middle and end. */
void gui_mark_scale(double x, double y, double width, double height, const float *rgb, size_t count,
                    const char *const texts[3]);

#ifdef __cplusplus
}
#endif
#endif
