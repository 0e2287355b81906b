/* Gathers by OpenGL's shaders: what gather.c does, of the same places, tiles and samples. theory.md T43. */
#ifndef RENDERER_GATHER_GL_H
#define RENDERER_GATHER_GL_H

#include "renderer/execute.h"
#include "renderer/gather.h"

struct render_gather_gl;

/* Fails with DIPOLE_OUT_OF_MEMORY. A context must be current, here and below. */
DIPOLE_CHECKED bool render_gather_gl_create(struct render_gather_gl **gl_out, dipole_status *status);
void render_gather_gl_destroy(struct render_gather_gl *gl);

/* Draw the radiosity of the frame's pixels into the framebuffer that is bound. Fails with
 * DIPOLE_OUT_OF_MEMORY, or DIPOLE_NOT_SUPPORTED where OpenGL's buffers are too small. */
DIPOLE_CHECKED bool render_gather_gl_draw(struct render_gather_gl *gl, const struct render_frame *frame,
                                          const struct render_gather_request *request,
                                          dipole_status *status);

#endif
