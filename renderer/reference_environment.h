/* Irradiance from all around for the reference: the map itself summed against the kernel, without
 * harmonics, in a table by the normal. theory.md T52. */
#ifndef RENDERER_REFERENCE_ENVIRONMENT_H
#define RENDERER_REFERENCE_ENVIRONMENT_H

#include "renderer/environment.h"

struct render_exact_irradiance;

/*
 * Pixels of up to a third of a degree are points, wider ones several. Larger maps than 1024 pixels are
 * summed by blocks, each at the middle of its light. Between normals 1/64 of pi apart: cubics. Errs by some
 * 1e-4 of the largest irradiance. Fails with DIPOLE_OUT_OF_MEMORY. environment must outlive the call alone.
 */
DIPOLE_CHECKED bool render_exact_irradiance_create(const struct render_environment *environment, double eta,
                                                   int thread_count,
                                                   struct render_exact_irradiance **irradiance_out,
                                                   dipole_status *status);
void render_exact_irradiance_destroy(struct render_exact_irradiance *irradiance);

/* At a unit normal, in W/mm^2: the table, and the sum itself, which is slow. */
void render_exact_irradiance_at(const struct render_exact_irradiance *irradiance, const double normal[3],
                                double rgb[3]);
void render_exact_irradiance_sum(const struct render_exact_irradiance *irradiance, const double normal[3],
                                 double rgb[3]);

#endif
