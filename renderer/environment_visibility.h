/* How much of the light from all around a point of the surface sees past the scene's objects, by rays.
 * theory.md T53. */
#ifndef RENDERER_ENVIRONMENT_VISIBILITY_H
#define RENDERER_ENVIRONMENT_VISIBILITY_H

#include "renderer/environment.h"
#include "renderer/reference_trace.h"

#include <stdint.h>

enum { RENDER_VISIBILITY_RAY_LIMIT = 4096 };

struct render_visibility;

/*
 * ray_count rays from each point, up to RENDER_VISIBILITY_RAY_LIMIT, as many in directions as
 * F_t(mu) mu asks, stratified. tracer and environment must outlive it. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_visibility_create(const struct render_tracer *tracer,
                                             const struct render_environment *environment, double eta,
                                             int ray_count, struct render_visibility **visibility_out,
                                             dipole_status *status);
void render_visibility_destroy(struct render_visibility *visibility);

/*
 * Part of the irradiance that enters which comes past all objects, 0 to 1, of each channel. Rays are turned
 * about the normal by a number of the point, so that neighbours do not err alike. The same for the same
 * number; for any number of threads at once.
 */
void render_visibility_share(const struct render_visibility *visibility, const double position_mm[3],
                             const double normal[3], const double facet_normal[3], uint64_t number,
                             double share[3]);

#endif
