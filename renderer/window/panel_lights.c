#include "renderer/gui/gui.h"
#include "renderer/projection.h"
#include "renderer/window/camera.h"
#include "renderer/window/window.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct gui_range turn_range = { -180, 180, false, "%.0f\u00b0" };
static const struct gui_range height_range = { -89, 89, false, "%.0f\u00b0" };
static const struct gui_range irradiance_range = { 1e-3, 1e3, true, "%.4g W/mm\u00b2" };
static const struct gui_range intensity_range = { 1e-3, 1e6, true, "%.4g W/sr" };
static const struct gui_range scale_range = { 1e-3, 1e3, true, "\u00d7 %.3g" };
static const struct gui_range colour_range = { 0, 1, false, "%.2f" };

static double largest(const double rgb[3])
{
    return fmax(fmax(rgb[0], rgb[1]), rgb[2]);
}

/* Brightness, and the colour that it multiplies. */
static bool edit_brightness(double rgb[3], const struct gui_range *range)
{
    double brightness = largest(rgb), colour[3];
    for (int c = 0; c < 3; c++)
        colour[c] = brightness > 0 ? rgb[c] / brightness : 1;
    const bool is_brighter = gui_slider("brightness", range, &brightness);
    const bool is_coloured = gui_sliders("colour", true, &colour_range, colour) >= 0 && largest(colour) > 0;
    for (int c = 0; (is_brighter || is_coloured) && c < 3; c++)
        rgb[c] = brightness * colour[c] / (is_coloured ? largest(colour) : 1);
    return is_brighter || is_coloured;
}

static bool edit_place(const struct window *window, struct io_light *light)
{
    if (light->kind == IO_LIGHT_POINT) {
        const struct render_ball ball = render_ball_of_scene(window->scene);
        const double reach_mm = ceil(6 * ball.radius_mm);
        const struct gui_range range = { -reach_mm, reach_mm, false, "%.1f" };
        return gui_sliders("position x, y, z, mm", false, &range, light->position_mm) >= 0;
    }
    double turn_deg, height_deg;
    window_angles_of_direction(light->direction, &turn_deg, &height_deg);
    const bool is_turned = gui_slider("from, about y", &turn_range, &turn_deg);
    const bool is_raised = gui_slider("height", &height_range, &height_deg);
    if (is_turned || is_raised)
        window_direction_of_angles(turn_deg, height_deg, light->direction);
    return is_turned || is_raised;
}

/* A light that is off is black, and remembers what it was. */
static void switch_light(struct window *window, size_t index, bool is_on)
{
    struct window_panel *const panel = &window->panel;
    struct io_light *const light = &window->scene->lights[index];
    static const double black[3] = { 0, 0, 0 };
    if (!is_on)
        memcpy(panel->rgb_of_dark[index], light->rgb, sizeof light->rgb);
    memcpy(light->rgb, is_on ? panel->rgb_of_dark[index] : black, sizeof light->rgb);
    light->is_stated = true;
    panel->is_dark[index] = !is_on;
}

static void remove_light(struct window *window, size_t index)
{
    struct window_panel *const panel = &window->panel;
    io_scene_remove_light(window->scene, index);
    const size_t after = window->scene->light_count - index;
    memmove(panel->rgb_of_dark[index], panel->rgb_of_dark[index + 1], after * sizeof panel->rgb_of_dark[0]);
    memmove(panel->is_dark + index, panel->is_dark + index + 1, after * sizeof panel->is_dark[0]);
    window_touch(window);
}

/* false: it was taken away. */
static bool show_light(struct window *window, size_t index)
{
    struct io_light *const light = &window->scene->lights[index];
    const bool is_point = light->kind == IO_LIGHT_POINT;
    const bool is_needed = window->scene->light_count == 1 && !window->scene->has_environment;
    bool is_on = !window->panel.is_dark[index], is_changed = false;
    char name[48];
    snprintf(name, sizeof name, "%zu  %s", index + 1, is_point ? "point" : "directional");
    if (gui_check(name, &is_on)) {
        switch_light(window, index, is_on);
        is_changed = true;
    }
    gui_same_line();
    gui_disabled_begin(is_needed);
    const bool is_removed = gui_button("Remove");
    gui_disabled_end();
    if (is_removed) {
        remove_light(window, index);
        return false;
    }
    gui_disabled_begin(!is_on);
    is_changed |= edit_place(window, light);
    if (edit_brightness(light->rgb, is_point ? &intensity_range : &irradiance_range) && is_on)
        is_changed = light->is_stated = true;
    gui_disabled_end();
    if (is_changed)
        window_touch(window);
    return true;
}

static void show_environment(struct window *window)
{
    struct io_environment *const environment = &window->scene->environment;
    const double pi = acos(-1);
    const char *const slash = strrchr(environment->path, '/');
    double turn_deg = remainder(environment->rotate_rad, 2 * pi) * 180 / pi;
    gui_value("environment", GUI_PLAIN, slash ? slash + 1 : environment->path);
    const bool is_turned = gui_slider("turn about y", &turn_range, &turn_deg);
    if (is_turned)
        environment->rotate_rad = turn_deg * pi / 180;
    if (edit_brightness(environment->rgb, &scale_range) || is_turned)
        window_touch(window);
}

static void add(struct window *window, enum io_light_kind kind)
{
    const struct render_ball ball = render_ball_of_scene(window->scene);
    const double distance_mm = 3 * ball.radius_mm;
    struct io_light light = { .kind = kind, .is_stated = true, .rgb = { 1, 1, 1 } };
    dipole_status status = { .code = DIPOLE_OK };
    if (kind == IO_LIGHT_DIRECTIONAL) {
        window_direction_of_angles(30, 40, light.direction);
    } else {
        for (int k = 0; k < 3; k++) {
            light.position_mm[k] = ball.centre_mm[k] + (k < 1 ? 0 : distance_mm / sqrt(2));
            light.rgb[k] =
                distance_mm * distance_mm; /* as bright at the scene's middle as the other kind */
        }
    }
    if (io_scene_add_light(window->scene, &light, &status))
        window_touch(window);
    else
        window_tell(window, "Light not added", &status);
}

void window_lights_show(struct window *window)
{
    if (!gui_section("Lights", false))
        return;
    if (window->scene->has_environment)
        show_environment(window);
    for (size_t i = 0; i < window->scene->light_count; i++) {
        gui_group_begin(i);
        const bool is_there = show_light(window, i);
        gui_group_end();
        if (!is_there)
            break;
    }
    if (gui_button("Add directional"))
        add(window, IO_LIGHT_DIRECTIONAL);
    gui_same_line();
    if (gui_button("Add point"))
        add(window, IO_LIGHT_POINT);
}
