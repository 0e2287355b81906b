/* Shadows of blockers by OpenGL: keeps their meshes, lists and curves. For the passes of shadows alone. */
#ifndef RENDERER_SHADOW_DRAW_H
#define RENDERER_SHADOW_DRAW_H

#include "renderer/execute.h"

struct render_shadower;

/* Takes the scene's blockers to the context. Destroy accepts NULL; context current. */
DIPOLE_CHECKED bool render_shadower_create(const struct io_scene *scene,
                                           struct render_shadower **shadower_out, dipole_status *status);
void render_shadower_destroy(struct render_shadower *shadower);

/* Whether it has compiled the one it keeps. */
bool render_shadower_has_program(const struct render_shadower *shadower);

/* Run and bind functions of passes. */
void render_shadow_bind_map(const struct render_frame *frame);
void render_shadow_bind_nearest(const struct render_frame *frame);
DIPOLE_CHECKED bool render_shadow_draw_map(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_shadow_make_curves(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_shadow_mark_colour(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_shadow_find_nearest(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_shadow_fill_taps(const struct render_frame *frame, dipole_status *status);

/* Uniforms of common/shadow.glsl; does nothing for a plan without such shadows. What is shaded are pixels
 * of a view that is width_px wide. */
void render_set_shadow(const struct render_frame *frame, const struct render_projection *seen,
                       double width_px);

#endif
