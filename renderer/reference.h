/*
 * The converged picture that the fast techniques are measured against: the integral over the surface
 * itself, in double, on the CPU, without cuts or light views; objects of any media. theory.md T33.
 */
#ifndef RENDERER_REFERENCE_H
#define RENDERER_REFERENCE_H

#include "renderer/render.h"

/* Its error is at most this part of epsilon, so that it can judge what keeps to epsilon. */
#define RENDER_REFERENCE_SHARE 0.1

/* Samples of the surface at most. Where that does not do, the report says so. */
#define RENDER_REFERENCE_SAMPLE_LIMIT ((size_t)1 << 27)

/*
 * Draw the scene as render_draw does, without OpenGL. Samples are doubled until their error, estimated from
 * two halves and from the sum before over some 800 pixels or more as the largest over the channels of the
 * relative RMSE over the picture, is at most RENDER_REFERENCE_SHARE options->epsilon, and they are nearer
 * to each other than the shortest mean free path. options->technique and table are not looked at.
 * *report_out may be NULL. Memory: 88 bytes a pixel, 64 a triangle beside Embree's, at most 400 MB for
 * samples, whatever their number. Fails with DIPOLE_BAD_VALUE, DIPOLE_OUT_OF_MEMORY or
 * DIPOLE_NOT_SUPPORTED; *image_out is then NULL.
 */
DIPOLE_CHECKED bool render_reference_draw(const struct io_scene *scene,
                                          const struct render_options *options, struct io_image **image_out,
                                          struct render_report *report_out, dipole_status *status);

#endif
