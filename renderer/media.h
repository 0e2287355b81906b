/* The media of a scene's objects, each different one once, with what every technique asks of them. */
#ifndef RENDERER_MEDIA_H
#define RENDERER_MEDIA_H

#include "io/scene_file.h"
#include "lutgen/lut.h"

#include <math.h>

/* One medium, of any model, homogeneous or layered. Light enters and leaves by its uppermost layer. */
struct render_medium {
    const struct io_material *material; /* of the first object that is made of it            */
    struct lut_hash hash;               /* lut_material_hash                                 */
    double eta;                         /* of the uppermost layer, alike in all channels     */
    dipole_stack *stacks[IO_CHANNEL_COUNT];
    double diffuse_reflectance[IO_CHANNEL_COUNT]; /* 0 where the channel scatters nothing    */
    bool has_scattering;                          /* in some channel                         */
    struct io_passage
        *passage; /* NULL: no object of it is closed, thin or told to be translucent, and not alone */
};

/* End it with render_media_destroy; the scene must outlive it. Any number of threads may read
 * it. */
struct render_media {
    struct render_medium *media;
    size_t count;
    size_t object_count;
    double *area_mm2;    /* of each object's surface                                      */
    double *volume_mm3;  /* the same; 0: it is not closed, changes its mesh, or stands alone */
    bool *is_convex;     /* the same, never hides light from itself; false where nobody asks         */
    size_t *of_object;   /* index into media, for each object of the scene */
    bool has_scattering; /* some medium has */
};

/* Whether a body is so much wider than thick that a slab's transmittance is its own: mean thickness against
 * the side of a square as large as the mean silhouette: of a ball 0.38, of a cube 0.27, of a square slab a
 * fifth as thick as wide 0.17. theory.md T70 */
static inline bool render_body_is_thin(double volume_mm3, double area_mm2)
{
    return 2 * volume_mm3 / area_mm2 <= sqrt(area_mm2 / 4) / 6;
}

/* A medium's profile on disk or in memory: a row of a splat table. */
struct render_table {
    const struct lut_splat *lut;
    size_t row;
};

/* Fails with DIPOLE_OUT_OF_MEMORY or as dipole_stack_create does. */
DIPOLE_CHECKED bool render_media_create(const struct io_scene *scene, struct render_media **media_out,
                                        dipole_status *status);
void render_media_destroy(struct render_media *media);

/* Measure anew the areas of objects that are deformed or change their mesh, once a frame is set. */
void render_media_measure(const struct io_scene *scene, struct render_media *media);

/* How far all but epsilon of what leaves a medium travels, the farthest channel; and how far apart light
 * samples alias by at most epsilon, the narrowest; spread: render_footprint_sharp_spacing_mm's. 0 and
 * INFINITY where nothing scatters. theory.md T9, T11, T82. */
double render_medium_r_max_mm(const struct render_medium *medium, double epsilon);
double render_medium_spacing_mm(const struct render_medium *medium, double epsilon, double spread);

/* The shortest mean free path of any layer of a channel that scatters; INFINITY where none does. */
double render_medium_shortest_path_mm(const struct render_medium *medium);

/* Whether all channels scatter alike: one profile does for them. */
bool render_medium_is_grey(const struct render_medium *medium);

/* Names of all the materials, between commas; cut off at size. Returns names. */
const char *render_media_list_names(const struct render_media *media, char *names, size_t size);

#endif
