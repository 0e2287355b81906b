/* The window of `render --view`. */
#ifndef RENDERER_WINDOW_VIEW_H
#define RENDERER_WINDOW_VIEW_H

#include "renderer/render.h"

struct render_view_options {
    struct render_options drawing;
    const struct io_scene_options *reading; /* that the scene was read with */
    const char *save_path;                  /* what the key S writes; NULL: a name beside the scene's */
};

/*
 * Show the scene until the window is closed; docs/window.md says what one can do there. Camera, lights,
 * exposure and materials of the scene are changed. renderer must have been created with
 * RENDER_CONTEXT_WINDOW. Fails when the first picture cannot be drawn; later failures are told in the
 * window.
 */
DIPOLE_CHECKED bool render_view(struct renderer *renderer, struct io_scene *scene,
                                const struct render_view_options *options, dipole_status *status);

#endif
