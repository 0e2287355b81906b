/*
 * What parallel light sees, drawn in memory: the texels of light_samples.h as pass light_view draws them,
 * where nothing else needs a texture of them. Pure C: no OpenGL here. theory.md T13.
 */
#ifndef RENDERER_LIGHT_PICTURE_H
#define RENDERER_LIGHT_PICTURE_H

#include "renderer/projection.h"

struct render_light_mesh {
    const struct io_mesh *mesh; /* positions in mm, in the world */
    double eta;                 /* index inside over outside, > 0 */
    bool has_hidden_inside;     /* no triangle is seen from behind */
};

struct render_light_picture {
    const struct render_light_mesh *meshes;
    size_t mesh_count;
    const struct render_projection *projection; /* orthographic, and holds all of the meshes */
    int size_px;                                /* of a side, 1 to 32767 */
    double texel_area_mm2;
    int thread_count; /* 0: as many as processors; the picture does not depend on it */
};

/*
 * Draw into size_px x size_px texels of { x, y, z in mm, power share }, the lowest row first: 0 where no
 * surface is, share 0 where it is seen from behind. objects: of each texel the number of its mesh, from 1,
 * 0: none; may be NULL. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_light_picture_draw(const struct render_light_picture *picture, float *texels,
                                              float *objects, dipole_status *status);

#endif
