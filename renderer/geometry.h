/* The meshes of a scene where OpenGL finds them: vertices and triangles of all objects one after the other,
 * to draw from and to look corners up by the number of a triangle (common/points.glsl). */
#ifndef RENDERER_GEOMETRY_H
#define RENDERER_GEOMETRY_H

#include "renderer/gl.h"

/* What each vertex has: position in mm, unit normal; x y z and a float that is not used: texels of four are
 * fetched several times faster. */
enum { RENDER_VERTEX_POSITION = 0, RENDER_VERTEX_NORMAL, RENDER_VERTEX_ARRAYS };
enum { RENDER_VERTEX_FLOATS = 4 };

struct render_geometry {
    struct render_buffer_texture vertices[RENDER_VERTEX_ARRAYS]; /* RGBA32F                         */
    struct render_buffer_texture triangles; /* RGBA32UI: corners, counted over all objects; object from 1 */
};

/*
 * Take the meshes, as they are at rest, to the current context. Fails with DIPOLE_NOT_SUPPORTED (more
 * vertices or triangles than its buffers have texels) or DIPOLE_OUT_OF_MEMORY; *geometry is then empty.
 */
DIPOLE_CHECKED bool render_geometry_create(const struct io_scene *scene, struct render_geometry *geometry,
                                           dipole_status *status);

/* Accepts { 0 }; context current. */
void render_geometry_destroy(struct render_geometry *geometry);

#endif
