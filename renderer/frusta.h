/* What a light must look at to see objects, as tightly as may be: for light views and for translucent
 * shadow maps alike. */
#ifndef RENDERER_FRUSTA_H
#define RENDERER_FRUSTA_H

#include "renderer/projection.h"

/* Views of a point light at the most: those of a cube. */
enum { RENDER_FACES = 6 };

/*
 * Fit an orthographic view along direction to all vertices of count objects, square and wider by margin (1:
 * not at all). ball: about the same objects; gives a flat one some depth.
 */
void render_frustum_of_parallel(const double direction[3], const struct io_object *objects, size_t count,
                                const struct render_ball *ball, double margin,
                                struct render_projection *out);

/*
 * Fit one view from position_mm to the ball, wider by margin; or where it is too wide for one, or the light
 * within, the faces of a cube +x -x +y -y +z -z that reach half_width to the side of their middle at
 * distance 1 (1: no farther than the next face). Returns how many.
 */
size_t render_frusta_of_point(const double position_mm[3], const struct render_ball *ball, double margin,
                              double half_width, struct render_projection out[RENDER_FACES]);

/*
 * Turn a perspective view to the middle of what it sees of all vertices of count objects, and narrow it to
 * them, square and wider by margin. Nothing is done where a vertex would be behind the eye.
 */
void render_frustum_narrow(const struct io_object *objects, size_t count, double margin,
                           struct render_projection *view);

#endif
