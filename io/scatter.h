/* Shapes of many small parts for blockers of light: particles and fibres within the ball of radius 1. The
 * same seed gives the same shape. */
#ifndef IO_SCATTER_H
#define IO_SCATTER_H

#include "io/mesh.h"

enum { IO_PARTICLE_LIMIT = 4000000, IO_FIBRE_LIMIT = 1000000, IO_FIBRE_SEGMENT_LIMIT = 4096 };

/* Vertices without triangles: the middles of count (1 to IO_PARTICLE_LIMIT) particles, spread evenly. Fails
 * with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool io_mesh_create_particles(int count, int seed, struct io_mesh **mesh_out,
                                             dipole_status *status);

/*
 * count fibres from a core of radius 0.25 outward along curls, to between 0.7 and 1 from the middle: closed
 * tubes of three sides and segment_count parts, 6 segment_count + 2 triangles each, as thick as radius at
 * the root and a third of that at the tip. Fails with DIPOLE_BAD_VALUE for too many triangles, or
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool io_mesh_create_fibres(int count, int segment_count, double radius, int seed,
                                          struct io_mesh **mesh_out, dipole_status *status);

#endif
