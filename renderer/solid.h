/* Whether what a mesh bounds has an inside. */
#ifndef RENDERER_SOLID_H
#define RENDERER_SOLID_H

#include "io/mesh.h"

/*
 * Whether every connected part of the mesh is closed (each of its edges is walked as often one way as the
 * other) and holds a volume > 0, so that from outside no triangle is seen from behind. Vertices at the same
 * place are one. An edge that does not balance is overlooked with a chance of 2^-64. Hollow parts, wound
 * inwards, do not count as solid. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_mesh_is_solid(const struct io_mesh *mesh, bool *is_solid_out,
                                         dipole_status *status);

/* Whether a solid is convex: in one part, and no corner of a triangle is above the plane of a neighbour by
 * more than 1e-4 of its longest side. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_mesh_is_convex(const struct io_mesh *mesh, bool *is_convex_out,
                                          dipole_status *status);

#endif
