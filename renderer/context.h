/* OpenGL 4.5 core contexts, one file per backend. */
#ifndef RENDERER_CONTEXT_H
#define RENDERER_CONTEXT_H

#include "renderer/render.h"

#include <glad/gl.h>

/* Every backend's own struct begins with this. */
struct render_context {
    const char *name;
    GLADloadfunc load; /* address of an OpenGL function, valid while current */
    bool (*make_current)(struct render_context *context, dipole_status *status);
    void (*destroy)(struct render_context *context);
};

/* Fail with DIPOLE_NOT_SUPPORTED and the reason alone; *context_out is then NULL. */
DIPOLE_CHECKED bool render_context_create_osmesa(struct render_context **context_out,
                                                 dipole_status *status);
DIPOLE_CHECKED bool render_context_create_egl(struct render_context **context_out, dipole_status *status);
DIPOLE_CHECKED bool render_context_create_window(struct render_context **context_out,
                                                 dipole_status *status);

/* The GLFW window of a window context: GLFWwindow *. */
void *render_context_window(struct render_context *context);

/*
 * Create the context of that kind, or the first that can be had by default. Fails with
 * DIPOLE_NOT_SUPPORTED, naming every backend tried and why it failed.
 */
DIPOLE_CHECKED bool render_context_create(enum render_context_kind kind,
                                          struct render_context **context_out, dipole_status *status);
void render_context_destroy(struct render_context *context);

#endif
