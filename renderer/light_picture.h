/*
 * What a light sees, drawn in memory: the texels of light_samples.h as pass light_view draws them. Pure C:
 * no OpenGL here. theory.md T13, T46.
 */
#ifndef RENDERER_LIGHT_PICTURE_H
#define RENDERER_LIGHT_PICTURE_H

#include "renderer/projection.h"

struct render_light_mesh {
    const struct io_mesh *mesh; /* positions in mm, in the world */
    const float *rest_mm;       /* of each vertex, x y z of the object at rest; NULL: not asked for */
    double eta;                 /* index inside over outside, > 0 */
    bool has_hidden_inside;     /* no triangle is seen from behind */
};

struct render_light_picture {
    const struct render_light_mesh *meshes;
    size_t mesh_count;
    const struct render_projection *projection; /* orthographic: holds all of the meshes */
    int size_px;                                /* of a side, 1 to 32767 */
    double texel_area;                          /* mm^2; perspective: at distance 1 */
    int thread_count; /* that place triangles, 0: as many as processors; the picture does not depend on it
                       */
};

/* A picture in tiles of tile_px x tile_px texels, each of them drawn when it is asked for. */
struct render_light_tiles;

/*
 * Place all triangles, and tell which tiles they show in. Tiles begin shift_px texels before the picture
 * does, along both sides; 0 <= shift_px < tile_px. The picture's meshes and projection must live as long
 * as *tiles_out, which the caller ends with render_light_tiles_destroy. Fails with DIPOLE_OUT_OF_MEMORY;
 * *tiles_out is then NULL.
 */
DIPOLE_CHECKED bool render_light_tiles_create(const struct render_light_picture *picture, int tile_px,
                                              int shift_px, struct render_light_tiles **tiles_out,
                                              dipole_status *status);

/*
 * Draw the tile whose lower left texel is (x, y) into tile_px x tile_px texels of { x, y, z in mm, power
 * share }, the lowest row first: 0 where no surface is and beyond the picture, share 0 where it is seen
 * from behind. What is nearer than near_mm is not seen by a perspective view. objects: of each texel the
 * number of its mesh, from 1, 0: none; may be NULL. false: nothing is in the tile, texels and objects are
 * left as they were. Several threads may draw tiles at a time. tiles: a struct render_light_tiles, as
 * light_samples.h hands it on.
 */
bool render_light_tiles_draw(const void *tiles, int x, int y, float *texels, float *objects);

void render_light_tiles_destroy(struct render_light_tiles *tiles);

/* A whole picture, the lowest row first; NULL: not asked for. */
struct render_light_texels {
    float *texels;  /* { x, y, z in mm, power share } */
    float *objects; /* of each texel the number of its mesh, from 1; 0: none */
    float *rest_mm; /* { x, y, z, 1 } of its surface at rest; 0: none. Every mesh has rest_mm then */
    float empty[4]; /* texels where no surface is */
};

/* Draw all tiles of a picture. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_light_picture_draw(const struct render_light_picture *picture,
                                              const struct render_light_texels *out, dipole_status *status);

#endif
