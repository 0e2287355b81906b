/* Light from all around in the frame: where it enters, as samples or at pixels. State kept between frames.
 */
#ifndef RENDERER_ENVIRONMENT_DRAW_H
#define RENDERER_ENVIRONMENT_DRAW_H

#include "renderer/execute.h"

struct render_sky;

/* Its context must be current, here and below. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_sky_create(const struct render_media *media, struct render_sky **sky_out,
                                      dipole_status *status);
void render_sky_destroy(struct render_sky *sky);

/* How often an object was sampled so far: those that have not changed are not sampled again. */
size_t render_sky_sampled_count(const struct render_sky *sky);

/* Run functions of passes: tables of irradiance, first of all; the tree that rays are traced through; light
 * samples by triangles, and by depth peeling. What is right from the frame before is kept. */
DIPOLE_CHECKED bool render_sky_tabulate(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_sky_plant(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_sky_sample(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_sky_peel(const struct render_frame *frame, dipole_status *status);

/* Bind the tables; a shader includes common/irradiance.glsl. */
void render_sky_bind(const struct render_frame *frame);

#endif
