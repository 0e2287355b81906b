#include "renderer/gui/gui.h"
#include "renderer/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <stdlib.h>
#include <string.h>

enum { COARSE = 4 }; /* pixels of the window per side of a pixel drawn while something moves */

#define PANEL_WIDTH 350.0
#define PANEL_PART 0.6 /* of the window, at most */

static const char *const kept_names[] = { "display", "radiance" };

bool window_draw_create(struct window *window, dipole_status *status)
{
    for (int i = 0; i < WINDOW_COLOUR_COUNT; i++)
        window_difference_colour(2.0 * i / (WINDOW_COLOUR_COUNT - 1) - 1, window->scale_rgb[i]);
    glCreateTextures(GL_TEXTURE_2D, 1, &window->colours);
    glTextureStorage2D(window->colours, 1, GL_RGB32F, WINDOW_COLOUR_COUNT, 1);
    glTextureParameteri(window->colours, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(window->colours, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureSubImage2D(window->colours, 0, 0, 0, WINDOW_COLOUR_COUNT, 1, GL_RGB, GL_FLOAT,
                        window->scale_rgb);
    return render_program_create(render_shader_find("fullscreen.vert"), render_shader_find("present.frag"),
                                 NULL, &window->program, status);
}

void window_draw_destroy(struct window *window)
{
    for (int i = 0; i < 2; i++) {
        glDeleteTextures(1, &window->sides[i].display);
        glDeleteTextures(1, &window->sides[i].radiance);
    }
    glDeleteTextures(1, &window->colours);
    glDeleteProgram(window->program);
}

double window_panel_width(const struct window *window)
{
    int width, height;
    glfwGetWindowSize(window->handle, &width, &height);
    const double wanted = PANEL_WIDTH * gui_scale(), most = PANEL_PART * width;
    return !window->panel.is_open ? 0 : wanted < most ? wanted : most;
}

struct window_area window_find_area(const struct window *window)
{
    int width_px, height_px, width, height;
    glfwGetFramebufferSize(window->handle, &width_px, &height_px);
    glfwGetWindowSize(window->handle, &width, &height);
    struct window_area area = { .height_px = height_px,
                                .px_per_unit = width > 0 ? (double)width_px / width : 1 };
    area.x_px = (int)(window_panel_width(window) * area.px_per_unit + 0.5);
    area.width_px = width_px - area.x_px;
    return area;
}

/* ---- pictures ----------------------------------------------------------------------------------- */

/* Keep what the executor has drawn: the next picture is drawn into the same textures. */
static void keep(const struct window *window, struct window_side *side, int width_px, int height_px)
{
    GLuint *const kept[] = { &side->display, &side->radiance };
    const bool has_size = side->width_px == width_px && side->height_px == height_px;
    for (int i = 0; i < 2; i++) {
        if (!has_size) {
            glDeleteTextures(1, kept[i]);
            glCreateTextures(GL_TEXTURE_2D, 1, kept[i]);
            glTextureStorage2D(*kept[i], 1, GL_RGBA32F, width_px, height_px);
            glTextureParameteri(*kept[i], GL_TEXTURE_MIN_FILTER, GL_NEAREST);
            glTextureParameteri(*kept[i], GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        }
        glCopyImageSubData(render_executor_texture(window->renderer->executor, kept_names[i]),
                           GL_TEXTURE_2D, 0, 0, 0, 0, *kept[i], GL_TEXTURE_2D, 0, 0, 0, 0, width_px,
                           height_px, 1);
    }
    side->width_px = width_px;
    side->height_px = height_px;
}

/* The scene's camera has the size of the picture. */
static bool draw_side(struct window *window, struct window_side *side, dipole_status *status)
{
    const struct io_camera *const camera = &window->scene->camera;
    struct render_options drawing = window->drawing;
    drawing.technique = side->technique;
    drawing.epsilon = side->epsilon;
    drawing.budget_ms = window_predicts_error(side->technique) ? side->budget_ms : 0;
    drawing.is_tone_mapped = true;
    const struct render_request request = render_request_for(window->renderer, &drawing);
    double time_ms[RENDER_EFFECT_LIMIT];
    struct render_plan *plan = NULL;
    const double start_s = glfwGetTime();
    if (!render_run(window->renderer, &request, &plan, time_ms, status))
        return false;
    side->time_ms = (glfwGetTime() - start_s) * 1e3;
    render_fill_report(window->renderer, plan, time_ms, &side->report);
    side->report.total_ms = side->time_ms;
    if (plan->budget_ms > 0)
        side->epsilon = plan->epsilon;
    render_plan_destroy(plan);
    keep(window, side, camera->width_px, camera->height_px);
    return render_gl_check(&window->renderer->errors, "keeping a picture", status);
}

static float *read_radiance(const struct window_side *side)
{
    const size_t size = (size_t)side->width_px * (size_t)side->height_px * 4 * sizeof(float);
    float *const pixels = malloc(size);
    if (pixels)
        glGetTextureImage(side->radiance, 0, GL_RGBA, GL_FLOAT, (GLsizei)size, pixels);
    return pixels;
}

static bool measure(struct window *window, dipole_status *status)
{
    const struct window_side *const side = &window->sides[0];
    float *const left = read_radiance(side), *const right = read_radiance(&window->sides[1]);
    const bool done =
        (left && right) || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    if (done)
        window_difference_measure(left, right, (size_t)side->width_px * (size_t)side->height_px,
                                  &window->difference);
    window->has_difference = done;
    free(left);
    free(right);
    return done;
}

static void remember_time(struct window *window, double time_ms)
{
    if (window->history_count == WINDOW_HISTORY)
        memmove(window->history_ms, window->history_ms + 1, --window->history_count * sizeof(float));
    window->history_ms[window->history_count++] = (float)time_ms;
}

bool window_draw(struct window *window, bool is_coarse, dipole_status *status)
{
    const struct window_area area = window_find_area(window);
    const int divisor = is_coarse ? COARSE : 1;
    struct io_camera *const camera = &window->scene->camera;
    window->is_stale = false;
    window->is_coarse = is_coarse;
    if (area.width_px <= 0 || area.height_px <= 0)
        return true; /* an icon */
    camera->width_px = (area.width_px + divisor - 1) / divisor;
    camera->height_px = (area.height_px + divisor - 1) / divisor;
    const int side_count = window->comparison == WINDOW_ALONE ? 1 : 2;
    window->has_difference = false;
    bool done = true;
    double sum_ms = 0;
    for (int i = 0; done && i < side_count; i++) {
        done = draw_side(window, &window->sides[i], status);
        sum_ms += window->sides[i].time_ms;
    }
    camera->width_px = area.width_px;
    camera->height_px = area.height_px;
    if (!done)
        return false;
    remember_time(window, sum_ms);
    return side_count == 1 || is_coarse || measure(window, status);
}

/* ---- the window --------------------------------------------------------------------------------- */

static void set_uniforms(const struct window *window, const struct window_area *area)
{
    const GLuint program = window->program;
    const bool is_difference = window->comparison == WINDOW_DIFFERENCE;
    const struct window_side *const left = &window->sides[0];
    const struct window_side *const right = &window->sides[window->comparison == WINDOW_ALONE ? 0 : 1];
    glBindTextureUnit(0, is_difference ? left->radiance : left->display);
    glBindTextureUnit(1, is_difference ? right->radiance : right->display);
    glBindTextureUnit(2, window->colours);
    render_set_int(program, "left_picture", 0);
    render_set_int(program, "right_picture", 1);
    render_set_int(program, "colours", 2);
    render_set_int(program, "is_difference", is_difference);
    render_set_float(program, "range",
                     window->difference.range *
                         (window->difference.brightest > 0 ? window->difference.brightest : 1));
    render_set_float(program, "divider", window->comparison == WINDOW_SPLIT ? window->divider : 1);
    glProgramUniform3f(program, glGetUniformLocation(program, "area_px"), (float)area->x_px,
                       (float)area->width_px, (float)area->height_px);
}

void window_present(const struct window *window)
{
    const struct window_area area = window_find_area(window);
    GLuint vertex_array;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    if (area.width_px <= 0 || window->sides[0].display == 0)
        return;
    glCreateVertexArrays(1, &vertex_array);
    glViewport(area.x_px, 0, area.width_px, area.height_px);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glUseProgram(window->program);
    set_uniforms(window, &area);
    glBindVertexArray(vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDeleteVertexArrays(1, &vertex_array);
}
