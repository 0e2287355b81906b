/* What mesh.c, primitives.c and the importing program (mesh_import.c) share; for no one else. */
#ifndef IO_MESH_INTERNAL_H
#define IO_MESH_INTERNAL_H

#include "io/mesh.h"

/* A mesh with room for what is asked, arrays unfilled, one allocation; NULL when there is no memory. Counts
 * are within IO_MESH_TRIANGLE_LIMIT, three times that for vertices. */
struct io_mesh *io_mesh_create(size_t vertex_count, size_t triangle_count);

/* Recompute min and max from the positions. */
void io_mesh_update_bounds(struct io_mesh *mesh);

/* Who reads mesh files, and what it may use. Tests put other programs and smaller limits in their place. */
struct io_mesh_importer {
    const char *program;
    size_t bytes_limit, triangle_limit;
    int seconds_limit;
};

/* io_mesh_read by the importer given. */
DIPOLE_CHECKED bool io_mesh_read_by(const struct io_mesh_importer *importer, const char *path,
                                    struct io_mesh **mesh_out, dipole_status *status);

/*
 * What the importing program writes to its standard output: this header and, unless it holds a message, the
 * positions, normals and indices of struct io_mesh, one after the other. Both programs are built together,
 * so numbers go as they lie in memory.
 */
struct io_mesh_header {
    char magic[8];
    uint64_t vertex_count, triangle_count;
    char message[256]; /* why there is no mesh, or "" */
};
#define IO_MESH_MAGIC "dipmesh"

#endif
