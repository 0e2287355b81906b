/* Pixels that show one piece of surface: no edge of an object, and none of it in front of itself. */
#ifndef ACCURACY_INTERIOR_H
#define ACCURACY_INTERIOR_H

#include "io/scene_file.h"

/*
 * One byte for each pixel of the scene's camera, rows from the top: ACCURACY_EMPTY (no object),
 * ACCURACY_EDGE, or ACCURACY_INTERIOR: all rays of the pixel and of its eight neighbours hit one object,
 * and those of the pixel hit no farther than a pixel's width off the plane through the first, where it
 * turns by no more than 37 degrees: no crease. What edges
 * look like is a matter of the points of a pixel, of which the renderer has four and the reference sixteen,
 * not of light. The caller frees it. Fails with DIPOLE_OUT_OF_MEMORY or as render_tracer_create does.
 */
enum { ACCURACY_EMPTY = 0, ACCURACY_EDGE, ACCURACY_INTERIOR };
DIPOLE_CHECKED bool accuracy_interior_create(const struct io_scene *scene, unsigned char **kinds_out,
                                             dipole_status *status);

#endif
