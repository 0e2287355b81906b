#include "renderer/view.h"

#include "renderer/output.h"
#include "renderer/renderer.h"

#define GLFW_INCLUDE_NONE
#include <cglm/cglm.h>
#include <GLFW/glfw3.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    COARSE = 4, /* pixels of the window per side of a pixel drawn while something moves */
    WINDOW_SIDE_MIN = 64,
};

#define RADIANS_PER_PIXEL 0.008
#define ZOOM_PER_NOTCH 0.9
#define STILL_S 0.15 /* after so long without a move the picture is drawn finely */
#define IDLE_S 0.25
#define POLE_COSINE 0.995

struct view {
    struct renderer *renderer;
    struct io_scene *scene;
    const struct render_view_options *options;
    struct render_options drawing;
    GLFWwindow *window;
    GLuint present;
    struct io_camera home_camera;
    struct io_light home_light;
    double cursor_x, cursor_y;
    double moved_s;
    bool is_stale, is_coarse; /* the picture shown */
    bool is_save_wanted;
};

/* ---- moving ------------------------------------------------------------------------------------- */

static void rotate(double v[3], const double axis[3], double angle_rad)
{
    vec3 turned = { (float)v[0], (float)v[1], (float)v[2] };
    vec3 about = { (float)axis[0], (float)axis[1], (float)axis[2] };
    glm_vec3_rotate(turned, (float)angle_rad, about);
    for (int k = 0; k < 3; k++)
        v[k] = (double)turned[k];
}

/* Turn v as if the cursor dragged the front of a ball: about up, then about the camera's right. */
static void drag(const struct view *view, double v[3], double dx_px, double dy_px)
{
    struct render_projection axes;
    const struct render_ball ball = { .radius_mm = 1 };
    render_projection_of_camera(&view->scene->camera, &ball, &axes);
    rotate(v, view->scene->camera.up, dx_px * RADIANS_PER_PIXEL);
    rotate(v, axes.right, dy_px * RADIANS_PER_PIXEL);
}

static void touch(struct view *view)
{
    view->is_stale = true;
    view->moved_s = glfwGetTime();
}

static void turn_camera(struct view *view, double dx_px, double dy_px)
{
    struct io_camera *const camera = &view->scene->camera;
    double from_target[3], before[3];
    for (int k = 0; k < 3; k++)
        before[k] = from_target[k] = camera->eye_mm[k] - camera->target_mm[k];
    drag(view, from_target, -dx_px, -dy_px);
    const double cosine = render_dot(from_target, camera->up) /
                          sqrt(render_dot(from_target, from_target) * render_dot(camera->up, camera->up));
    const double *const kept = fabs(cosine) > POLE_COSINE ? before : from_target;
    for (int k = 0; k < 3; k++)
        camera->eye_mm[k] = camera->target_mm[k] + kept[k];
}

static void turn_light(struct view *view, double dx_px, double dy_px)
{
    if (view->scene->light_count == 0)
        return;
    struct io_light *const light = &view->scene->lights[0];
    if (light->kind == IO_LIGHT_DIRECTIONAL) {
        drag(view, light->direction, dx_px, dy_px);
        const double length = sqrt(render_dot(light->direction, light->direction));
        for (int k = 0; k < 3; k++)
            light->direction[k] /= length;
        return;
    }
    const struct render_ball ball = render_ball_of_scene(view->scene);
    double from_centre[3];
    for (int k = 0; k < 3; k++)
        from_centre[k] = light->position_mm[k] - ball.centre_mm[k];
    drag(view, from_centre, dx_px, dy_px);
    for (int k = 0; k < 3; k++)
        light->position_mm[k] = ball.centre_mm[k] + from_centre[k];
}

/* ---- events ------------------------------------------------------------------------------------- */

static void on_cursor(GLFWwindow *window, double x, double y)
{
    struct view *const view = glfwGetWindowUserPointer(window);
    const double dx = x - view->cursor_x, dy = y - view->cursor_y;
    view->cursor_x = x;
    view->cursor_y = y;
    if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS)
        turn_camera(view, dx, dy);
    else if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS)
        turn_light(view, dx, dy);
    else
        return;
    touch(view);
}

static void on_scroll(GLFWwindow *window, double dx, double dy)
{
    struct view *const view = glfwGetWindowUserPointer(window);
    struct io_camera *const camera = &view->scene->camera;
    const double factor = pow(ZOOM_PER_NOTCH, dy);
    (void)dx;
    camera->height_mm *= factor;
    for (int k = 0; k < 3 && !camera->is_orthographic; k++)
        camera->eye_mm[k] = camera->target_mm[k] + factor * (camera->eye_mm[k] - camera->target_mm[k]);
    touch(view);
}

static void go_home(struct view *view)
{
    const int width_px = view->scene->camera.width_px, height_px = view->scene->camera.height_px;
    view->scene->camera = view->home_camera;
    view->scene->camera.width_px = width_px;
    view->scene->camera.height_px = height_px;
    if (view->scene->light_count > 0)
        view->scene->lights[0] = view->home_light;
}

static void on_key(GLFWwindow *window, int key, int code, int action, int modifiers)
{
    struct view *const view = glfwGetWindowUserPointer(window);
    (void)code;
    (void)modifiers;
    if (action != GLFW_PRESS)
        return;
    if (key == GLFW_KEY_ESCAPE || key == GLFW_KEY_Q) {
        glfwSetWindowShouldClose(window, GLFW_TRUE);
    } else if (key == GLFW_KEY_S) {
        view->is_save_wanted = view->options->save_path != NULL;
    } else if (key == GLFW_KEY_T) {
        view->drawing.technique = view->drawing.technique == RENDER_TECHNIQUE_LAMBERT
                                      ? RENDER_TECHNIQUE_SPLAT
                                      : RENDER_TECHNIQUE_LAMBERT;
        touch(view);
    } else if (key == GLFW_KEY_R) {
        go_home(view);
        touch(view);
    }
}

static void on_size(GLFWwindow *window, int width_px, int height_px)
{
    (void)width_px;
    (void)height_px;
    touch(glfwGetWindowUserPointer(window));
}

static void on_refresh(GLFWwindow *window)
{
    struct view *const view = glfwGetWindowUserPointer(window);
    view->is_stale = true;
}

/* ---- drawing ------------------------------------------------------------------------------------ */

static void present(const struct view *view, int width_px, int height_px)
{
    const GLuint display = render_executor_texture(view->renderer->executor, "display");
    const GLint location = glGetUniformLocation(view->present, "window_px");
    GLuint vertex_array;
    glCreateVertexArrays(1, &vertex_array);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width_px, height_px);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glUseProgram(view->present);
    glProgramUniform2f(view->present, location, (float)width_px, (float)height_px);
    glBindTextureUnit(0, display);
    glBindVertexArray(vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDeleteVertexArrays(1, &vertex_array);
    glfwSwapBuffers(view->window);
}

/* Draw the scene at the window's size, or a part of it while something moves, and show it. */
static bool show(struct view *view, bool is_coarse, dipole_status *status)
{
    const double start_s = glfwGetTime();
    int width_px, height_px;
    glfwGetFramebufferSize(view->window, &width_px, &height_px);
    if (width_px == 0 || height_px == 0)
        return true; /* an icon */
    const int divisor = is_coarse ? COARSE : 1;
    struct io_camera *const camera = &view->scene->camera;
    camera->width_px = (width_px + divisor - 1) / divisor;
    camera->height_px = (height_px + divisor - 1) / divisor;
    const struct render_request request = { .scene = view->scene,
                                            .technique = view->drawing.technique,
                                            .epsilon = view->drawing.epsilon,
                                            .media = view->renderer->media,
                                            .tables = view->drawing.tables,
                                            .is_tone_mapped = true };
    double time_ms[RENDER_EFFECT_LIMIT];
    struct render_plan *plan = NULL;
    bool done = render_run(view->renderer, &request, &plan, time_ms, status);
    if (done) {
        present(view, width_px, height_px);
        char title[160];
        snprintf(title, sizeof title, "%.80s - %s, %dx%d, %.0f ms", view->scene->path,
                 render_technique_names[plan->technique], camera->width_px, camera->height_px,
                 (glfwGetTime() - start_s) * 1e3);
        glfwSetWindowTitle(view->window, title);
        done = render_gl_check(&view->renderer->errors, "showing the picture", status);
    }
    render_plan_destroy(plan);
    camera->width_px = width_px;
    camera->height_px = height_px;
    view->is_stale = false;
    view->is_coarse = is_coarse;
    return done;
}

static bool step(struct view *view, dipole_status *status)
{
    const bool is_moving = glfwGetTime() - view->moved_s < STILL_S;
    if (view->is_save_wanted) {
        view->is_save_wanted = false;
        return render_output_write(view->renderer, &view->drawing, view->options->save_path, NULL, status);
    }
    if (view->is_stale || (view->is_coarse && !is_moving))
        return show(view, is_moving, status);
    glfwWaitEventsTimeout(view->is_coarse ? STILL_S : IDLE_S);
    return true;
}

static void open_window(struct view *view)
{
    const struct io_camera *const camera = &view->scene->camera;
    glfwSetWindowUserPointer(view->window, view);
    glfwSetWindowSizeLimits(view->window, WINDOW_SIDE_MIN, WINDOW_SIDE_MIN, GLFW_DONT_CARE, GLFW_DONT_CARE);
    glfwSetWindowSize(view->window, camera->width_px, camera->height_px);
    glfwGetCursorPos(view->window, &view->cursor_x, &view->cursor_y);
    glfwSetCursorPosCallback(view->window, on_cursor);
    glfwSetScrollCallback(view->window, on_scroll);
    glfwSetKeyCallback(view->window, on_key);
    glfwSetFramebufferSizeCallback(view->window, on_size);
    glfwSetWindowRefreshCallback(view->window, on_refresh);
    glfwShowWindow(view->window);
}

bool render_view(struct renderer *renderer, struct io_scene *scene,
                 const struct render_view_options *options, dipole_status *status)
{
    struct view view = { .renderer = renderer,
                         .scene = scene,
                         .options = options,
                         .drawing = options->drawing,
                         .window = render_context_window(renderer->context),
                         .home_camera = scene->camera,
                         .moved_s = -STILL_S,
                         .is_stale = true };
    if (scene->light_count > 0)
        view.home_light = scene->lights[0];
    if (!render_make_current(renderer, status) ||
        !render_program_create(render_shader_find("fullscreen.vert"), render_shader_find("present.frag"),
                               NULL, &view.present, status))
        return false;
    open_window(&view);
    bool done = true;
    while (done && !glfwWindowShouldClose(view.window)) {
        glfwPollEvents();
        done = step(&view, status);
    }
    glDeleteProgram(view.present);
    return done;
}
