#include "renderer/window/view.h"

#include "renderer/gui/gui.h"
#include "renderer/window/camera.h"
#include "renderer/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    WINDOW_SIDE_MIN = 64,
    PANEL_OPEN_FROM = 640, /* units of gui_scale: a narrower picture begins without the panel */
    FRAMES_TO_SETTLE = 3,  /* that a panel needs after something happened to it             */
};

#define STILL_S 0.15 /* after so long without a move the picture is drawn finely */
#define IDLE_S 0.25
#define GRIP_WIDTH 7.0 /* to either side of the divider, times gui_scale */
#define EDGE_WIDTH 28.0

static const char font_path[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

void window_touch(struct window *window)
{
    window->is_stale = true;
    window->moved_s = glfwGetTime();
    window->panel.message[0] = '\0';
}

static void want_frames(struct window *window)
{
    window->frames_wanted = FRAMES_TO_SETTLE;
}

/* ---- the mouse ---------------------------------------------------------------------------------- */

static bool is_over_panel(const struct window *window, double x)
{
    return x < window_panel_width(window) || gui_has_list();
}

static double divider_position(const struct window *window)
{
    const struct window_area area = window_find_area(window);
    return (area.x_px + window->divider * area.width_px) / area.px_per_unit;
}

static void move_divider(struct window *window, double x)
{
    const struct window_area area = window_find_area(window);
    const double divider = (x * area.px_per_unit - area.x_px) / fmax(area.width_px, 1);
    window->divider = fmin(fmax(divider, 0), 1);
}

static void turn_light(struct window *window, double dx_px, double dy_px)
{
    const struct render_ball ball = render_ball_of_scene(window->scene);
    if (window->scene->light_count > 0)
        window_light_turn(&window->scene->lights[0], &window->scene->camera, ball.centre_mm, dx_px, dy_px);
}

static void on_cursor(GLFWwindow *handle, double x, double y)
{
    struct window *const window = glfwGetWindowUserPointer(handle);
    const double dx = x - window->cursor_x, dy = y - window->cursor_y;
    window->cursor_x = x;
    window->cursor_y = y;
    want_frames(window);
    if (window->is_divider_held) {
        move_divider(window, x);
        return;
    }
    if (window->pressed_button == GLFW_MOUSE_BUTTON_LEFT)
        window_camera_turn(&window->scene->camera, dx, dy);
    else if (window->pressed_button == GLFW_MOUSE_BUTTON_RIGHT)
        turn_light(window, dx, dy);
    else
        return;
    window_touch(window);
}

static void on_button(GLFWwindow *handle, int button, int action, int modifiers)
{
    struct window *const window = glfwGetWindowUserPointer(handle);
    (void)modifiers;
    want_frames(window);
    if (action == GLFW_RELEASE && (button == window->pressed_button || window->is_divider_held)) {
        window->pressed_button = -1;
        window->is_divider_held = false;
    }
    if (action != GLFW_PRESS || window->pressed_button >= 0 || is_over_panel(window, window->cursor_x))
        return;
    window->is_divider_held = window->comparison == WINDOW_SPLIT && button == GLFW_MOUSE_BUTTON_LEFT &&
                              fabs(window->cursor_x - divider_position(window)) < GRIP_WIDTH * gui_scale();
    if (!window->is_divider_held)
        window->pressed_button = button;
}

static void on_scroll(GLFWwindow *handle, double dx, double dy)
{
    struct window *const window = glfwGetWindowUserPointer(handle);
    (void)dx;
    want_frames(window);
    if (is_over_panel(window, window->cursor_x))
        return;
    window_camera_zoom(&window->scene->camera, dy);
    window_touch(window);
}

/* ---- keys --------------------------------------------------------------------------------------- */

/* The camera and the first light as the scene had them. */
static void go_home(struct window *window)
{
    struct io_camera *const camera = &window->scene->camera;
    const int width_px = camera->width_px, height_px = camera->height_px;
    *camera = window->home_camera;
    camera->width_px = width_px;
    camera->height_px = height_px;
    struct io_light *const light = window->scene->lights;
    if (window->scene->light_count == 0 || light->kind != window->home_light.kind)
        return;
    memcpy(light->direction, window->home_light.direction, sizeof light->direction);
    memcpy(light->position_mm, window->home_light.position_mm, sizeof light->position_mm);
}

static void change_technique(struct window *window)
{
    enum render_technique *const technique = &window->sides[0].technique;
    const bool is_lambert = *technique == RENDER_TECHNIQUE_LAMBERT;
    if (!is_lambert)
        window->technique_but_lambert = *technique;
    *technique = is_lambert ? window->technique_but_lambert : RENDER_TECHNIQUE_LAMBERT;
    window_touch(window);
}

static void obey(struct window *window, int key)
{
    switch (key) {
    case GLFW_KEY_ESCAPE:
    case GLFW_KEY_Q:
        glfwSetWindowShouldClose(window->handle, GLFW_TRUE);
        break;
    case GLFW_KEY_S:
        window->is_save_wanted = true;
        break;
    case GLFW_KEY_T:
        change_technique(window);
        break;
    case GLFW_KEY_C:
        window->comparison = (window->comparison + 1) % WINDOW_COMPARISON_COUNT;
        window_touch(window);
        break;
    case GLFW_KEY_R:
        go_home(window);
        window_touch(window);
        break;
    case GLFW_KEY_TAB:
        window->panel.is_open = !window->panel.is_open;
        window_touch(window);
        break;
    default:
        break;
    }
}

static void on_key(GLFWwindow *handle, int key, int code, int action, int modifiers)
{
    struct window *const window = glfwGetWindowUserPointer(handle);
    (void)code;
    (void)modifiers;
    want_frames(window);
    if (action == GLFW_PRESS && !gui_is_typing())
        obey(window, key);
}

static void on_character(GLFWwindow *handle, unsigned int character)
{
    (void)character;
    want_frames(glfwGetWindowUserPointer(handle));
}

/* ---- the window --------------------------------------------------------------------------------- */

static void on_size(GLFWwindow *handle, int width_px, int height_px)
{
    (void)width_px;
    (void)height_px;
    window_touch(glfwGetWindowUserPointer(handle));
}

static void on_refresh(GLFWwindow *handle)
{
    want_frames(glfwGetWindowUserPointer(handle));
}

static void set_callbacks(struct window *window)
{
    glfwSetWindowUserPointer(window->handle, window);
    glfwSetCursorPosCallback(window->handle, on_cursor);
    glfwSetMouseButtonCallback(window->handle, on_button);
    glfwSetScrollCallback(window->handle, on_scroll);
    glfwSetKeyCallback(window->handle, on_key);
    glfwSetCharCallback(window->handle, on_character);
    glfwSetFramebufferSizeCallback(window->handle, on_size);
    glfwSetWindowRefreshCallback(window->handle, on_refresh);
}

static void show_title(const struct window *window)
{
    const struct window_side *const side = &window->sides[0];
    char title[160];
    snprintf(title, sizeof title, "%.80s - %s, %dx%d, %.0f ms", window->scene->path,
             render_technique_names[side->report.technique], side->width_px, side->height_px,
             side->time_ms);
    glfwSetWindowTitle(window->handle, title);
}

/* The picture, and what stands beside and over it. */
static void show_frame(struct window *window)
{
    window->frames_wanted -= window->frames_wanted > 0;
    window_present(window);
    gui_begin();
    window_marks_show(window);
    if (window->panel.is_open) {
        window_panel_show(window);
    } else if (window->cursor_x < EDGE_WIDTH * gui_scale() && gui_opener()) {
        window->panel.is_open = true;
        window_touch(window);
    }
    gui_end();
    glfwSwapBuffers(window->handle);
}

/* A failure is told, unless there is no picture at all yet. */
static bool draw(struct window *window, bool is_coarse, dipole_status *status)
{
    dipole_status failure = { .code = DIPOLE_OK };
    if (window_draw(window, is_coarse, &failure)) {
        show_title(window);
    } else if (window->sides[0].display) {
        window_tell(window, "Picture not drawn", &failure);
    } else {
        if (status)
            *status = failure;
        return false;
    }
    show_frame(window);
    want_frames(window);
    return true;
}

static bool step(struct window *window, dipole_status *status)
{
    const bool is_moving = glfwGetTime() - window->moved_s < STILL_S;
    if (window->is_save_wanted) {
        window->is_save_wanted = false;
        window_save_picture(window);
        return true;
    }
    if (window->is_stale)
        return draw(window, is_moving, status);
    if (window->frames_wanted > 0) { /* the panel answers before a picture is refined */
        show_frame(window);
        return true;
    }
    if (window->is_coarse && !is_moving)
        return draw(window, false, status);
    if (gui_is_typing()) /* its cursor blinks */
        show_frame(window);
    glfwWaitEventsTimeout(window->is_coarse ? STILL_S : IDLE_S);
    return true;
}

/* The picture as large as the scene says, with the panel beside it, where the screen is as wide. */
static void make_room(struct window *window)
{
    GLFWmonitor *const monitor = glfwGetPrimaryMonitor();
    int x = 0, y = 0, width = 0, height = 0;
    if (monitor)
        glfwGetMonitorWorkarea(monitor, &x, &y, &width, &height);
    const struct io_camera *const camera = &window->scene->camera;
    const int wanted = camera->width_px + (int)ceil(window_panel_width(window));
    if (wanted > camera->width_px && camera->width_px < width)
        glfwSetWindowSize(window->handle, wanted < width ? wanted : width, camera->height_px);
}

static void open_window(struct window *window)
{
    const struct io_camera *const camera = &window->scene->camera;
    glfwSetWindowSizeLimits(window->handle, WINDOW_SIDE_MIN, WINDOW_SIDE_MIN, GLFW_DONT_CARE,
                            GLFW_DONT_CARE);
    glfwSetWindowSize(window->handle, camera->width_px, camera->height_px);
    glfwGetCursorPos(window->handle, &window->cursor_x, &window->cursor_y);
    window->panel.is_open = camera->width_px >= PANEL_OPEN_FROM * gui_scale();
    make_room(window);
    glfwShowWindow(window->handle);
}

static bool run(struct window *window, dipole_status *status)
{
    open_window(window);
    bool done = true;
    while (done && !glfwWindowShouldClose(window->handle)) {
        glfwPollEvents();
        done = step(window, status);
    }
    return done;
}

bool render_view(struct renderer *renderer, struct io_scene *scene,
                 const struct render_view_options *options, dipole_status *status)
{
    const struct window_side side = { .technique = options->drawing.technique,
                                      .epsilon = options->drawing.epsilon > 0 ? options->drawing.epsilon
                                                                              : RENDER_EPSILON_DEFAULT,
                                      .budget_ms = options->drawing.budget_ms };
    struct window window = { .renderer = renderer,
                             .scene = scene,
                             .options = options,
                             .drawing = options->drawing,
                             .handle = render_context_window(renderer->context),
                             .sides = { side, side },
                             .technique_but_lambert = RENDER_TECHNIQUE_AUTO,
                             .divider = 0.5,
                             .home_camera = scene->camera,
                             .moved_s = -STILL_S,
                             .pressed_button = -1,
                             .is_stale = true };
    if (scene->light_count > 0)
        window.home_light = scene->lights[0];
    window.sides[1].technique = RENDER_TECHNIQUE_LAMBERT; /* something else to compare with */
    set_callbacks(&window);
    if (!render_make_current(renderer, status) || !gui_create(window.handle, font_path, status))
        return false;
    const bool done =
        window_panel_create(&window, status) && window_draw_create(&window, status) && run(&window, status);
    window_draw_destroy(&window);
    window_panel_destroy(&window);
    gui_destroy();
    return done;
}
