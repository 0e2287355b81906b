/* Gathers a frame's light samples for its pixels: the state that is kept between frames. */
#ifndef RENDERER_GATHER_DRAW_H
#define RENDERER_GATHER_DRAW_H

#include "renderer/execute.h"
#include "renderer/gather.h"

struct render_gatherer;

/* Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_gatherer_create(const struct render_media *media,
                                           struct render_gatherer **gatherer_out, dipole_status *status);
void render_gatherer_destroy(struct render_gatherer *gatherer);

/* Read the pixels' places back, and gather as the plan says: in C into the texture of radiosity, or by
 * OpenGL into the framebuffer that is bound. Its context must be current. */
DIPOLE_CHECKED bool render_gatherer_run(struct render_gatherer *gatherer, const struct render_frame *frame,
                                        dipole_status *status);

/* What the two effects that gather share (passes/gather.c). */
struct render_decision render_decide_gather(const struct render_request *request,
                                            const struct render_plan *plan);
double render_gather_error(const struct render_plan *plan);
DIPOLE_CHECKED bool render_run_gather(const struct render_frame *frame, dipole_status *status);

#endif
