/* How drags and the wheel move a camera and lights. No window is needed. */
#ifndef RENDERER_WINDOW_CAMERA_H
#define RENDERER_WINDOW_CAMERA_H

#include "io/scene_file.h"

/* Turn the eye about the target, as if the cursor dragged the front of a ball, by pixels right and down.
 * The distance stays; at the poles, where up would be lost, nothing moves. */
void window_camera_turn(struct io_camera *camera, double dx_px, double dy_px);

/* Come nearer by a tenth for each notch, or go away for negative ones. */
void window_camera_zoom(struct io_camera *camera, double notches);

/* Turn a light in the same way: a point light about the centre. */
void window_light_turn(struct io_light *light, const struct io_camera *camera, const double centre_mm[3],
                       double dx_px, double dy_px);

/*
 * Where light that travels along a unit vector comes from: turn_deg about y, 0 at +z, 90 at +x, -180 to
 * 180; height_deg above the horizon, -90 to 90. One is the other's inverse.
 */
void window_angles_of_direction(const double direction[3], double *turn_deg, double *height_deg);
void window_direction_of_angles(double turn_deg, double height_deg, double direction[3]);

#endif
