/* From triangles as a file has them to a mesh: welded, turned outwards, with normals. */
#ifndef IO_MESH_BUILD_H
#define IO_MESH_BUILD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct io_mesh_vertex {
    float position[3];
    float normal[3]; /* all 0 where the file has none */
};

/* Both arrays are from malloc; the caller owns them. */
struct io_mesh_soup {
    size_t vertex_count, triangle_count;
    struct io_mesh_vertex *vertices;
    uint32_t *triangles; /* triangle_count x 3, each below vertex_count */
};

enum io_mesh_outcome {
    IO_MESH_BUILT = 0,
    IO_MESH_NO_TRIANGLES,
    IO_MESH_NOT_FINITE,
    IO_MESH_ALL_DEGENERATE,
    IO_MESH_NO_MEMORY
};

/*
 * Make a soup a mesh, in place:
 * - triangles without an area are dropped;
 * - equal vertices become one, bit for bit: what merely lies close stays apart, so scale does not matter;
 *   vertices that no triangle uses are dropped;
 * - a surface that bounds a volume is turned so that its triangles are counter-clockwise from outside: one
 *   that was wound inwards is flipped; an open one follows the file's normals, or stays as it is;
 * - normals become unit vectors on the same side: the file's, else smooth ones weighted by angle.
 * Fails unless there is at least one triangle with an area and every position in use is finite.
 */
enum io_mesh_outcome io_mesh_build(struct io_mesh_soup *soup);

#endif
