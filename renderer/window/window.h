/* What the parts of the window share. */
#ifndef RENDERER_WINDOW_WINDOW_H
#define RENDERER_WINDOW_WINDOW_H

#include "renderer/renderer.h"
#include "renderer/window/difference.h"
#include "renderer/window/material_list.h"
#include "renderer/window/view.h"

enum { WINDOW_HISTORY = 96, WINDOW_TECHNIQUE_LIMIT = 16, WINDOW_PATH_SIZE = 1024 };

/* What is asked of a picture, and the picture that was drawn last. */
struct window_side {
    enum render_technique technique;
    double epsilon;
    double budget_ms;         /* that epsilon is chosen for; 0: it is set by hand */
    GLuint display, radiance; /* textures, 0: none yet */
    int width_px, height_px;
    struct render_report report;
    double time_ms;
};

enum window_comparison { WINDOW_ALONE = 0, WINDOW_SPLIT, WINDOW_DIFFERENCE, WINDOW_COMPARISON_COUNT };

/* What was derived from the material that the panel shows. */
struct window_derived {
    const struct render_media *media; /* that it was derived for; NULL: nothing yet */
    size_t object, layer;
    double epsilon;
    dipole_coefficients coefficients[IO_CHANNEL_COUNT];
    double reflectance[IO_CHANNEL_COUNT], r_max_mm[IO_CHANNEL_COUNT];
};

/* Of the panel alone. */
struct window_panel {
    bool is_open;
    size_t object, layer;
    bool is_by_reflectance;      /* sliders for reflectance and path, not for coefficients */
    size_t *chosen;              /* of each object: which entry of the list                */
    bool *is_edited;             /* whether it is no longer that entry                     */
    struct io_material *as_read; /* of each object                                         */
    char (*as_read_names)[288];  /* \"NAME (OBJECT)\"                                      */
    const char **material_names; /* as_read of each object, then those of the list         */
    struct window_material_list list;
    struct window_derived derived;
    double rgb_of_dark[IO_SCENE_LIGHT_LIMIT][3]; /* of lights that are off, when on again */
    bool is_dark[IO_SCENE_LIGHT_LIMIT];
    char picture_path[WINDOW_PATH_SIZE], scene_path[WINDOW_PATH_SIZE];
    char message[2048]; /* of the last thing done, or why it failed */
    bool is_failure;
};

struct window {
    struct renderer *renderer;
    struct io_scene *scene;
    const struct render_view_options *options;
    struct render_options drawing; /* tables and the rest of what both sides share */
    void *handle;                  /* GLFWwindow *                                 */

    struct window_side sides[2];                 /* left, or alone; right */
    enum render_technique technique_but_lambert; /* that the key T goes back to */
    enum window_comparison comparison;
    double divider; /* 0 to 1 of the picture's width */
    struct window_difference difference;
    bool has_difference; /* of the pictures shown, both fine */
    GLuint program, colours;
    float scale_rgb[WINDOW_COLOUR_COUNT][3];
    float history_ms[WINDOW_HISTORY];
    size_t history_count;

    struct io_camera home_camera;
    struct io_light home_light;
    double cursor_x, cursor_y, moved_s;
    int pressed_button; /* that drags the picture; -1: none        */
    bool is_divider_held;
    bool is_stale, is_coarse; /* the picture shown                 */
    int frames_wanted;        /* of the panel, after what happened */
    bool is_save_wanted;
    struct window_panel panel;
};

/* Where the picture stands, in the framebuffer, from the left; as high as it. */
struct window_area {
    int x_px, width_px, height_px;
    double px_per_unit; /* of the window's own units, in which the cursor moves */
};

/* ---- view.c ------------------------------------------------------------------------------------- */

/* Say that what is shown must be drawn again: coarse until nothing has moved for a moment. What was told
 * goes. */
void window_touch(struct window *window);

/* ---- draw.c ------------------------------------------------------------------------------------- */

DIPOLE_CHECKED bool window_draw_create(struct window *window, dipole_status *status);
void window_draw_destroy(struct window *window);

struct window_area window_find_area(const struct window *window);
double window_panel_width(const struct window *window);

/* Draw what is compared, at the size of the area or a part of it, and keep the pictures. */
DIPOLE_CHECKED bool window_draw(struct window *window, bool is_coarse, dipole_status *status);

/* Show the pictures kept. */
void window_present(const struct window *window);

/* ---- panel.c, panel_material.c, panel_lights.c, marks.c ------------------------------------------ */

DIPOLE_CHECKED bool window_panel_create(struct window *window, dipole_status *status);
void window_panel_destroy(struct window *window);
void window_panel_show(struct window *window);
void window_material_show(struct window *window);
void window_lights_show(struct window *window);

/* What stands over the picture: names, divider, scale. */
void window_marks_show(struct window *window);

/* Whether the technique says what it errs by and takes, so that one can be chosen by the other. */
bool window_predicts_error(enum render_technique technique);

/* Techniques that a window can draw; returns how many. */
size_t window_list_techniques(enum render_technique techniques[WINDOW_TECHNIQUE_LIMIT],
                              const char *names[WINDOW_TECHNIQUE_LIMIT]);

/* ---- save.c ------------------------------------------------------------------------------------- */

/* Tell at the foot of the picture, until something else happens. status NULL: it is no failure. */
void window_tell(struct window *window, const char *what, const dipole_status *status);

/* Names to begin with: "DIR/NAME.json" gives "DIR/NAME_view.png" and "DIR/NAME_view.json". */
void window_name_files(struct window *window);
void window_save_picture(struct window *window);
void window_save_scene(struct window *window);

#endif
