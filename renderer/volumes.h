/* Volumes for translucent shadow maps of a scene's media: from a folder, or baked in memory. */
#ifndef RENDERER_VOLUMES_H
#define RENDERER_VOLUMES_H

#include "renderer/media.h"

/* End it with render_volumes_destroy. */
struct render_volumes {
    double epsilon;           /* asked of them; 0 of a folder's */
    int slice_count;          /* the same                       */
    size_t count;             /* of media                       */
    struct lut_tsm **volumes; /* of each medium; NULL where nothing scatters */
};

/* What is asked of a volume for a picture of that epsilon: the interpolation along its depth, worst near
 * sources, costs more texels than it is worth to a sum of so few samples. */
double render_volume_epsilon(double epsilon);

/* A volume for each medium, to epsilon or as near as a usual size allows; each tells its error. Fails as
 * lut_tsm_bake does. */
DIPOLE_CHECKED bool render_volumes_bake(const struct render_media *media, double epsilon, int slice_count,
                                        struct render_volumes **volumes_out, dipole_status *status);

/* Read each medium's volume among the *.tsm.exr of a folder; of several, the most exact. sample_count: of
 * their pattern; 0: any. Fails with DIPOLE_NOT_FOUND (no such folder or volume), or as lut_tsm_read does.
 */
DIPOLE_CHECKED bool render_volumes_find(const char *folder, const struct render_media *media,
                                        int sample_count, struct render_volumes **volumes_out,
                                        dipole_status *status);

void render_volumes_destroy(struct render_volumes *volumes);

#endif
