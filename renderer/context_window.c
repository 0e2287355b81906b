/* A GLFW window, hidden until view.c shows it. */
#include "renderer/context.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <stdlib.h>

enum { WIDTH_PX = 800, HEIGHT_PX = 600 };

struct window_context {
    struct render_context base;
    GLFWwindow *window;
};

static bool fail(dipole_status *status, const char *what)
{
    const char *reason = NULL;
    glfwGetError(&reason);
    return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s: %s", what,
                       reason ? reason : "no reason given");
}

static bool make_current(struct render_context *context, dipole_status *status)
{
    glfwMakeContextCurrent(((struct window_context *)context)->window);
    (void)status;
    return true;
}

static void destroy(struct render_context *context)
{
    struct window_context *const window = (struct window_context *)context;
    if (window->window)
        glfwDestroyWindow(window->window);
    glfwTerminate();
    free(window);
}

void *render_context_window(struct render_context *context)
{
    return ((struct window_context *)context)->window;
}

bool render_context_create_window(struct render_context **context_out, dipole_status *status)
{
    struct window_context *const window = calloc(1, sizeof *window);
    *context_out = NULL;
    if (!window)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory");
    window->base = (struct render_context){ .name = "window",
                                            .load = (GLADloadfunc)glfwGetProcAddress,
                                            .make_current = make_current,
                                            .destroy = destroy };
    bool done = glfwInit() || fail(status, "glfwInit");
    if (done) {
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
        window->window = glfwCreateWindow(WIDTH_PX, HEIGHT_PX, "libdipole", NULL, NULL);
        done = window->window || fail(status, "glfwCreateWindow");
    }
    if (!done) {
        destroy(&window->base);
        return false;
    }
    *context_out = &window->base;
    return true;
}
