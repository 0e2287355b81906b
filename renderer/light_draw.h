/* What lights see, drawn in memory (light_picture.h) of the scene that is in a frame. */
#ifndef RENDERER_LIGHT_DRAW_H
#define RENDERER_LIGHT_DRAW_H

#include "renderer/execute.h"
#include "renderer/light_picture.h"

/* The view of the frame, of all objects. Owns its meshes: end it with render_light_picture_free. Fails with
 * DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_light_picture_of(const struct render_frame *frame,
                                            struct render_light_picture *picture, dipole_status *status);
void render_light_picture_free(struct render_light_picture *picture);

/* The whole view that was drawn last; its memory is kept between views and frames. */
struct render_light_drawing;
struct render_light_drawing *render_light_drawing_create(void); /* NULL: no memory */
void render_light_drawing_destroy(struct render_light_drawing *drawing);

/* Draw the frame's view, with objects where they are told apart and places at rest where samples stay with
 * the surface; into texture light_view, too, where passes read it. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_light_drawing_draw(struct render_light_drawing *drawing,
                                              const struct render_frame *frame, dipole_status *status);
const struct render_light_texels *render_light_drawing_texels(const struct render_light_drawing *drawing);

#endif
