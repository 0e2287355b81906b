/*
 * The surface of a whole scene as one line of length 1, one object after the other: equal lengths are equal
 * areas, and what is near on the line is near in space. Points spread evenly over the line then are spread
 * evenly over the surface. theory.md T33.
 */
#ifndef RENDERER_REFERENCE_SURFACE_H
#define RENDERER_REFERENCE_SURFACE_H

#include "io/scene_file.h"

struct render_surface;

/* Fails with DIPOLE_OUT_OF_MEMORY, or DIPOLE_BAD_VALUE for more than 2^32 triangles. The scene must outlive
 * it. */
DIPOLE_CHECKED bool render_surface_create(const struct io_scene *scene, struct render_surface **surface_out,
                                          dipole_status *status);
void render_surface_destroy(struct render_surface *surface);

double render_surface_area_mm2(const struct render_surface *surface);

struct render_surface_point {
    double position_mm[3];
    double facet_normal[3]; /* unit, of the triangle                  */
    double normal[3];       /* unit, interpolated between its corners */
    size_t object;
};

/* The point at place along the line, 0 <= place < 1. */
void render_surface_at(const struct render_surface *surface, double place,
                       struct render_surface_point *point);

/* Parts of a mesh's triangle: corners; the normal as long as twice its area; a point by weights of its
 * corners that add up to 1 (object is left 0). */
void render_triangle_corners(const struct io_mesh *mesh, size_t triangle, double corners_mm[3][3]);
void render_triangle_normal(const double corners_mm[3][3], double normal[3]);
void render_triangle_point(const struct io_mesh *mesh, size_t triangle, const double weights[3],
                           struct render_surface_point *point);

#endif
