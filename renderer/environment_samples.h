/*
 * Where light from all around enters: samples of the whole surface, put together from patches of it, which
 * come from the triangles themselves or from a picture of them. Pure C: no OpenGL here. theory.md T53.
 */
#ifndef RENDERER_ENVIRONMENT_SAMPLES_H
#define RENDERER_ENVIRONMENT_SAMPLES_H

#include "renderer/environment_visibility.h"
#include "renderer/irradiance_table.h"
#include "renderer/light_samples.h"

/* A bit of surface with one normal for its light. */
struct render_patch {
    double position_mm[3];  /* its middle                                             */
    double normal[3];       /* unit, interpolated: what its light depends on          */
    double facet_normal[3]; /* unit, of its triangle: tells sheets and edges apart    */
    double area_mm2;
    float min_mm[3], max_mm[3]; /* a box that holds it */
};

/* Patches of one object on their way to samples. */
struct render_patches;

/*
 * irradiance must outlive it; samples are at most spacing_mm wide along each axis, as long as patches are
 * at most RENDER_PATCH_SHARE of that. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_patches_create(const struct render_irradiance_table *irradiance,
                                          const double min_mm[3], double spacing_mm,
                                          struct render_patches **patches_out, dipole_status *status);
void render_patches_destroy(struct render_patches *patches);
#define RENDER_PATCH_SHARE 0.22

/* Fails with DIPOLE_OUT_OF_MEMORY, or DIPOLE_BAD_VALUE for more samples than RENDER_LIGHT_SAMPLE_LIMIT. */
DIPOLE_CHECKED bool render_patches_add(struct render_patches *patches, const struct render_patch *patch,
                                       dipole_status *status);

/* All triangles of a mesh, cut where they are wide. Fails as render_patches_add. */
DIPOLE_CHECKED bool render_patches_add_mesh(struct render_patches *patches, const struct io_mesh *mesh,
                                            dipole_status *status);

/*
 * Append a sample for all patches of one cube that face the same way (of six): their flux, at its mean
 * position. Samples follow a space-filling curve. visibility: what is hidden from them is taken off; NULL:
 * nothing is. Fails as render_patches_add. Nothing may be added afterwards.
 */
DIPOLE_CHECKED bool render_patches_finish(struct render_patches *patches, float object,
                                          const struct render_visibility *visibility,
                                          struct render_light_samples *samples, dipole_status *status);

#endif
