/* Is a mesh file all there? For the formats whose truncation assimp 5.2 overlooks or dies of. */
#ifndef IO_MESH_COMPLETE_H
#define IO_MESH_COMPLETE_H

#include <stdbool.h>
#include <stddef.h>

/*
 * True unless data, the whole content of a file, ends before what it announces: PLY (rows of every element
 * of its header), STL (triangle count, or "endsolid") and 3DS (length of the main chunk). Other formats,
 * and what is no such file at all, are left to assimp: true.
 *
 *   extension  the file name's, without the dot, in any case
 */
bool io_mesh_is_complete(const unsigned char *data, size_t size, const char *extension);

#endif
