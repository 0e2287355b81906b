/* A light with a size as many lights without one. theory.md T66. */
#ifndef RENDERER_AREA_LIGHT_H
#define RENDERER_AREA_LIGHT_H

#include "io/scene_file.h"

/* Whether its shadows have penumbras. */
bool render_light_has_size(const struct io_light *light);

/*
 * The light at place index, 0 to count - 1, of its disc as it faces position_mm: points of equal areas on a
 * spiral, that of index 0 and count 1 its middle. Its rgb is the whole light's.
 */
struct io_light render_light_place(const struct io_light *light, const double position_mm[3], int index,
                                   int count);

/* Part of a spot's intensity that goes along the unit vector; 1 of other lights. */
double render_light_spot_part(const struct io_light *light, const double direction[3]);

/* Cosines of the angles to a spot's direction between which its light falls from all to none. */
void render_light_spot_cosines(const struct io_light *light, double *inner_out, double *outer_out);

#endif
