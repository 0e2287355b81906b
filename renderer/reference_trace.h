/* Rays through a scene's triangles, by Embree; nothing else of the project knows it. */
#ifndef RENDERER_REFERENCE_TRACE_H
#define RENDERER_REFERENCE_TRACE_H

#include "renderer/casters.h"
#include "renderer/reference_surface.h"

struct render_tracer;

/* Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_NOT_SUPPORTED. The scene must outlive the tracer. All objects
 * are opaque. */
DIPOLE_CHECKED bool render_tracer_create(const struct io_scene *scene, struct render_tracer **tracer_out,
                                         dipole_status *status);

/* The same, but light comes through the objects among the casters, which must outlive it, too. */
DIPOLE_CHECKED bool render_tracer_create_with(const struct io_scene *scene,
                                              const struct render_casters *casters,
                                              struct render_tracer **tracer_out, dipole_status *status);
void render_tracer_destroy(struct render_tracer *tracer);

/* The first surface from origin_mm along direction (any length > 0); false when there is none. For any
 * number of threads at once. */
bool render_tracer_find(const struct render_tracer *tracer, const double origin_mm[3],
                        const double direction[3], struct render_surface_point *hit);

/* Whether nothing is in the way from a point of a triangle, on the side of its facet normal, along the unit
 * vector direction, until distance_mm (INFINITY: to the end). For any number of threads at once. */
bool render_tracer_is_clear(const struct render_tracer *tracer, const double position_mm[3],
                            const double facet_normal[3], const double direction[3], double distance_mm);

/* The same of what lets no light through. */
bool render_tracer_is_clear_of_opaque(const struct render_tracer *tracer, const double position_mm[3],
                                      const double facet_normal[3], const double direction[3],
                                      double distance_mm);

/* What casters leave of light that goes along -direction (a unit vector) to a point, per
 * channel, from distance_mm away (INFINITY: from the end); exact but for float's rounding of where they
 * are. theory.md T66. For any number of threads at once; without memory for more than some hundred blockers
 * along a ray, nothing is left. */
void render_tracer_left(const struct render_tracer *tracer, const double position_mm[3],
                        const double direction[3], double distance_mm, double left[IO_CHANNEL_COUNT]);

#endif
