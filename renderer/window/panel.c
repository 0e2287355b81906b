#include "renderer/gui/gui.h"
#include "renderer/window/window.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct gui_range budget_range = { 10, 10000, true, "%.0f ms" };
static const struct gui_range epsilon_range = { 1e-4, RENDER_EPSILON_MAX, true, "%.3g" };
static const struct gui_range exposure_range = { -10, 10, false, "%+.1f EV" };

/* ---- what the panel has ------------------------------------------------------------------------- */

bool window_panel_create(struct window *window, dipole_status *status)
{
    struct window_panel *const panel = &window->panel;
    const size_t object_count = window->scene->object_count;
    if (!window_material_list_create(&panel->list, status))
        return false;
    panel->chosen = calloc(object_count, sizeof *panel->chosen);
    panel->is_edited = calloc(object_count, sizeof *panel->is_edited);
    panel->as_read = calloc(object_count, sizeof *panel->as_read);
    panel->as_read_names = calloc(object_count, sizeof *panel->as_read_names);
    panel->material_names = calloc(object_count + panel->list.count, sizeof *panel->material_names);
    if (!panel->chosen || !panel->is_edited || !panel->as_read || !panel->as_read_names ||
        !panel->material_names)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the panel");
    for (size_t i = 0; i < object_count; i++) {
        panel->chosen[i] = i;
        panel->as_read[i] = window->scene->objects[i].material;
        snprintf(panel->as_read_names[i], sizeof *panel->as_read_names, "%s (%s)", panel->as_read[i].name,
                 object_count == 1 ? "as read" : window->scene->objects[i].name);
        panel->material_names[i] = panel->as_read_names[i];
    }
    for (size_t i = 0; i < panel->list.count; i++)
        panel->material_names[object_count + i] = panel->list.names[i];
    window_name_files(window);
    return true;
}

void window_panel_destroy(struct window *window)
{
    struct window_panel *const panel = &window->panel;
    free(panel->chosen);
    free(panel->is_edited);
    free(panel->as_read);
    free(panel->as_read_names);
    free(panel->material_names);
    window_material_list_destroy(&panel->list);
}

size_t window_list_techniques(enum render_technique techniques[WINDOW_TECHNIQUE_LIMIT],
                              const char *names[WINDOW_TECHNIQUE_LIMIT])
{
    size_t count = 0;
    for (size_t i = 0; render_technique_names[i] && count < WINDOW_TECHNIQUE_LIMIT; i++) {
        if (i == RENDER_TECHNIQUE_REFERENCE) /* knows no OpenGL, and takes too long */
            continue;
        techniques[count] = (enum render_technique)i;
        names[count++] = render_technique_names[i];
    }
    return count;
}

/* ---- sections ----------------------------------------------------------------------------------- */

static void show_head(const struct window *window)
{
    const struct render_report *const report = &window->sides[0].report;
    const struct io_camera *const camera = &window->scene->camera;
    const char *const slash = strrchr(window->scene->path, '/');
    char text[160];
    gui_text(GUI_PLAIN, slash ? slash + 1 : window->scene->path);
    gui_tip(window->scene->path);
    snprintf(text, sizeof text, "%d \u00d7 %d pixels, %zu object%s, %s", camera->width_px,
             camera->height_px, window->scene->object_count, window->scene->object_count == 1 ? "" : "s",
             render_technique_names[report->technique]);
    gui_text(GUI_DIM, text);
    double largest = 0;
    for (size_t i = 0; i < window->history_count; i++)
        largest = fmax(largest, (double)window->history_ms[i]);
    if (window->history_count > 0) {
        snprintf(text, sizeof text, "%.0f ms%s", (double)window->history_ms[window->history_count - 1],
                 window->is_coarse ? ", coarse" : "");
        gui_text(GUI_PLAIN, text);
        snprintf(text, sizeof text, "Milliseconds of the last pictures, 0 to %.0f", largest);
        gui_plot(window->history_ms, window->history_count, largest);
        gui_tip(text);
    }
    for (size_t i = 0; i < report->note_count; i++)
        gui_text(GUI_WARNING, report->notes[i]);
}

bool window_predicts_error(enum render_technique technique)
{
    return technique == RENDER_TECHNIQUE_AUTO || technique == RENDER_TECHNIQUE_GATHER ||
           technique == RENDER_TECHNIQUE_SPLAT;
}

/* What the sliders of a side are called. */
struct side_labels {
    const char *technique, *epsilon, *is_timed, *budget;
};

static void show_side(struct window *window, struct window_side *side, const struct side_labels *labels)
{
    enum render_technique techniques[WINDOW_TECHNIQUE_LIMIT];
    const char *names[WINDOW_TECHNIQUE_LIMIT];
    const size_t count = window_list_techniques(techniques, names);
    size_t index = 0;
    while (index + 1 < count && techniques[index] != side->technique)
        index++;
    if (gui_choice(labels->technique, names, count, &index)) {
        side->technique = techniques[index];
        window_touch(window);
    }
    const bool is_predicted = window_predicts_error(side->technique);
    bool is_timed = is_predicted && side->budget_ms > 0;
    gui_disabled_begin(is_timed); /* it is chosen */
    if (gui_slider(labels->epsilon, &epsilon_range, &side->epsilon))
        window_touch(window);
    gui_disabled_end();
    if (!is_predicted)
        return;
    if (gui_check(labels->is_timed, &is_timed)) {
        side->budget_ms = is_timed ? fmin(fmax(side->time_ms, budget_range.min), budget_range.max) : 0;
        window_touch(window);
    }
    gui_tip("Choose the least \u03b5 that is predicted to take no longer");
    if (is_timed && gui_slider(labels->budget, &budget_range, &side->budget_ms))
        window_touch(window);
}

static void show_technique(struct window *window)
{
    if (!gui_section("Technique", true))
        return;
    static const struct side_labels labels = { "technique", "\u03b5 (error)", "\u03b5 by time", "time" };
    show_side(window, &window->sides[0], &labels);
    if (gui_slider("exposure", &exposure_range, &window->scene->exposure_ev))
        window_touch(window);
}

static void show_comparison(struct window *window)
{
    static const char *const names[WINDOW_COMPARISON_COUNT] = { "off", "split", "difference" };
    size_t index = window->comparison;
    if (!gui_section("Compare", true))
        return;
    if (gui_choice("show", names, WINDOW_COMPARISON_COUNT, &index)) {
        window->comparison = (enum window_comparison)index;
        window_touch(window);
    }
    gui_disabled_begin(window->comparison == WINDOW_ALONE);
    static const struct side_labels labels = { "right", "right \u03b5", "right by time", "right time" };
    show_side(window, &window->sides[1], &labels);
    gui_disabled_end();
    char text[96] = "\u2013";
    if (window->has_difference)
        snprintf(text, sizeof text, "RMSE %.3g %%, max %.3g %%", 100 * window->difference.rmse,
                 100 * window->difference.max);
    gui_value("difference", GUI_PLAIN, text);
    gui_tip("Right less left, of the radiance of all channels, in % of the brightest.");
}

static void show_effects(const struct render_report *report, const char *title, const char *name)
{
    static const double widths[] = { 0.45, 0.17, 0.19, 0.19 };
    static const char *const heads[] = { "effect", "active", "ms", "error" };
    if (!gui_section(title, false) || !gui_table_begin(name, widths, 4))
        return;
    for (int i = 0; i < 4; i++)
        gui_cell(GUI_DIM, heads[i]);
    for (size_t e = 0; e < report->effect_count; e++) {
        const struct render_effect_report *const effect = &report->effects[e];
        const enum gui_tone tone = effect->is_active ? GUI_PLAIN : GUI_DIM;
        char time[24] = "", error[24] = "";
        if (effect->is_active) {
            snprintf(time, sizeof time, "%.1f", effect->time_ms);
            snprintf(error, sizeof error, isfinite(effect->error) ? "%.2g" : "?", effect->error);
        }
        const char *const cells[] = { effect->name, effect->is_active ? "yes" : "no", time, error };
        for (int i = 0; i < 4; i++) {
            gui_cell(tone, cells[i]);
            gui_tip(effect->reason);
        }
    }
    gui_table_end();
}

static void show_saving(struct window *window)
{
    struct window_panel *const panel = &window->panel;
    if (!gui_section("Save", false))
        return;
    gui_field("picture", panel->picture_path, sizeof panel->picture_path);
    gui_field("scene", panel->scene_path, sizeof panel->scene_path);
    const bool is_compared = window->comparison != WINDOW_ALONE;
    window->is_save_wanted |= gui_button(is_compared ? "Save left picture" : "Save picture");
    gui_tip("As seen, without panel and labels: .exr linear, .png tone mapped.");
    gui_same_line();
    if (gui_button("Save scene"))
        window_save_scene(window);
    gui_tip("The scene's file with what was changed: it draws this picture again.");
}

static void show_keys(void)
{
    static const char *const keys[][2] = {
        { "left drag", "turn the camera" },
        { "right drag", "turn the first light" },
        { "wheel", "nearer, farther" },
        { "T", "to Lambert and back" },
        { "C", "compare: split, difference" },
        { "R", "camera and light as read" },
        { "S", "save the picture" },
        { "Tab", "close or open the panel" },
        { "Q, Escape", "quit" },
        { "Ctrl + click", "type a slider's number" },
    };
    if (!gui_section("Keys", false))
        return;
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        gui_value(keys[i][0], GUI_DIM, keys[i][1]);
}

void window_panel_show(struct window *window)
{
    const struct window_area area = window_find_area(window);
    const bool is_compared = window->comparison != WINDOW_ALONE;
    gui_panel_begin(window_panel_width(window), area.height_px / area.px_per_unit);
    show_head(window);
    show_technique(window);
    show_comparison(window);
    window_material_show(window);
    window_lights_show(window);
    show_effects(&window->sides[0].report, is_compared ? "Effects, left" : "Effects",
                 "effects of the left");
    if (is_compared)
        show_effects(&window->sides[1].report, "Effects, right", "effects of the right");
    show_saving(window);
    show_keys();
    gui_panel_end();
}
