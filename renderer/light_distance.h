/* How near to a light anything is. Pure C. */
#ifndef RENDERER_LIGHT_DISTANCE_H
#define RENDERER_LIGHT_DISTANCE_H

#include "io/scene_file.h"

/* From a point to the nearest surface of all that blocks, objects and blockers; INFINITY where there is
 * none. */
double render_light_distance_mm(const struct io_scene *scene, const double position_mm[3]);

/* The same of one triangle, whose corners may be in line, or one. */
double render_triangle_distance_mm(const double corners_mm[3][3], const double position_mm[3]);

#endif
