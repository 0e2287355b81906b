/*
 * Light samples that stay on the surface: texels of a light's view are gathered in cubes that are fixed to
 * the object at rest, so that a sample moves as its piece of surface does, whatever the view's grid does.
 * Pure C on plain arrays. theory.md T57.
 */
#ifndef RENDERER_CELL_SAMPLES_H
#define RENDERER_CELL_SAMPLES_H

#include "renderer/light_samples.h"

/*
 * Append to the target of each object one sample for each cube of side cell_mm that lit texels of the view
 * come from: total flux, flux-weighted mean position. view->rest_mm tells where each texel's surface is at
 * rest. Samples are ordered along a space-filling curve, and carry the codes of their cubes. Fails with
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_cell_samples_append(const struct render_light_target *targets,
                                               const struct render_light_view *view, dipole_status *status);

/* Append to *merged one sample for each object in each cube 2^levels[object] times as wide. */
DIPOLE_CHECKED bool render_cell_samples_merge(const struct render_light_samples *samples, const int *levels,
                                              struct render_light_samples *merged, dipole_status *status);

#endif
