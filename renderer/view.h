/* The window of `render --view`. */
#ifndef RENDERER_VIEW_H
#define RENDERER_VIEW_H

#include "renderer/render.h"

struct render_view_options {
    struct render_options drawing;
    const char *save_path; /* what the key S writes; NULL: S does nothing */
};

/*
 * Show the scene until the window is closed. Left drag turns the camera, right drag the first light, the
 * wheel zooms; T changes the technique, R goes back to the scene's view, S saves, Q or Escape closes.
 * The scene's camera and lights are changed. renderer must have been created with RENDER_CONTEXT_WINDOW.
 */
DIPOLE_CHECKED bool render_view(struct renderer *renderer, struct io_scene *scene,
                                const struct render_view_options *options, dipole_status *status);

#endif
