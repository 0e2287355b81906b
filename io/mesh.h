/* Triangle meshes: files through assimp in a limited child process, and primitives of our own. */
#ifndef IO_MESH_H
#define IO_MESH_H

#include "libdipole/dipole.h"

#include <stdint.h>

/* One allocation; end it with io_mesh_destroy. Triangles are counter-clockwise seen from outside;
 * normals are unit vectors (from the file, else smooth, weighted by angle). */
struct io_mesh {
    size_t vertex_count, triangle_count;
    float *positions;  /* vertex_count x 3, in the file's unit  */
    float *normals;    /* vertex_count x 3                      */
    uint32_t *indices; /* triangle_count x 3                    */
    float min[3], max[3];
};

/* Limits on what a file may ask for; bytes are those of the file, and of the memory to read it. */
#define IO_MESH_TRIANGLE_LIMIT 20000000u
#define IO_MESH_BYTES_LIMIT ((size_t)2 << 30)
#define IO_MESH_SECONDS_LIMIT 120

/*
 * Read a mesh file: any format that assimp reads, without other files that it may refer to. Equal vertices
 * are welded, triangles without an area, points and lines dropped. A closed surface that is wound inwards
 * is flipped; an open one follows the normals of its file. Fails with the file and what is wrong: not
 * found, not a mesh, truncated, no triangles, not finite, over a limit. A hostile file ends its child
 * process, not ours.
 */
DIPOLE_CHECKED bool io_mesh_read(const char *path, struct io_mesh **mesh_out, dipole_status *status);

enum io_primitive {
    IO_PRIMITIVE_SPHERE = 0, /* radius 1                                             */
    IO_PRIMITIVE_CUBE,       /* -1..1                                                */
    IO_PRIMITIVE_SLAB,       /* x, z in -1..1, y in -1..0: the top face lies at y = 0 */
    IO_PRIMITIVE_TORUS,      /* about y, radii 1 and 0.35                            */
    IO_PRIMITIVE_KNOT,       /* trefoil tube within about -1..1                      */
    IO_PRIMITIVE_BOWL,       /* hollow hemisphere of thickness 0.1, open upwards     */
    IO_PRIMITIVE_TERRAIN,    /* height field with thin fins, x and z in -1..1        */
    IO_PRIMITIVE_LANTERN,    /* ball of radius 1 with 12 flutes, hollow: a ball of 0.8 within is air */
    IO_PRIMITIVE_COUNT,
};
extern const char *const io_primitive_names[IO_PRIMITIVE_COUNT];

/* detail: segments along the longest direction, 4 to 4096. */
DIPOLE_CHECKED bool io_mesh_create_primitive(enum io_primitive primitive, int detail,
                                             struct io_mesh **mesh_out, dipole_status *status);

void io_mesh_destroy(struct io_mesh *mesh);

#endif
