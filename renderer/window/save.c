#include "renderer/output.h"
#include "renderer/window/window.h"

#include <stdio.h>
#include <string.h>

void window_tell(struct window *window, const char *what, const dipole_status *status)
{
    struct window_panel *const panel = &window->panel;
    panel->is_failure = status != NULL;
    if (!status)
        snprintf(panel->message, sizeof panel->message, "%s", what);
    else if (status->source[0] && status->line > 0)
        snprintf(panel->message, sizeof panel->message, "%s: %s:%d:%d: %s", what, status->source,
                 status->line, status->column, status->message);
    else if (status->source[0])
        snprintf(panel->message, sizeof panel->message, "%s: %s: %s", what, status->source,
                 status->message);
    else
        snprintf(panel->message, sizeof panel->message, "%s: %s", what, status->message);
    window->frames_wanted = 1;
}

void window_name_files(struct window *window)
{
    const char *const path = window->scene->path, *const suffix = strrchr(path, '.');
    const int length = suffix && strcmp(suffix, ".json") == 0 ? (int)(suffix - path) : (int)strlen(path);
    struct window_panel *const panel = &window->panel;
    snprintf(panel->scene_path, sizeof panel->scene_path, "%.*s_view.json", length, path);
    if (window->options->save_path)
        snprintf(panel->picture_path, sizeof panel->picture_path, "%s", window->options->save_path);
    else
        snprintf(panel->picture_path, sizeof panel->picture_path, "%.*s_view.png", length, path);
}

void window_save_picture(struct window *window)
{
    char done[WINDOW_PATH_SIZE + 16];
    struct render_options drawing = window->drawing;
    dipole_status status = { .code = DIPOLE_OK };
    drawing.technique = window->sides[0].technique;
    drawing.epsilon = window->sides[0].epsilon; /* also that which was chosen */
    drawing.budget_ms = 0;
    snprintf(done, sizeof done, "Saved %s", window->panel.picture_path);
    if (render_output_write(window->renderer, &drawing, window->panel.picture_path, NULL, &status))
        window_tell(window, done, NULL);
    else
        window_tell(window, "Picture not saved", &status);
}

void window_save_scene(struct window *window)
{
    char done[WINDOW_PATH_SIZE + 16];
    dipole_status status = { .code = DIPOLE_OK };
    snprintf(done, sizeof done, "Saved %s", window->panel.scene_path);
    if (io_scene_write(window->scene, window->options->reading, window->panel.scene_path, &status))
        window_tell(window, done, NULL);
    else
        window_tell(window, "Scene not saved", &status);
}
