/* What the readers of the parts of a scene share; at is the part's JSON, unit_mm the scene's unit. */
#ifndef IO_SCENE_INTERNAL_H
#define IO_SCENE_INTERNAL_H

#include "io/json.h"
#include "io/scene_file.h"

/* Ranges of what a scene may say: wide enough for anything, narrow enough that nothing overflows. Lengths
 * and factors; coordinates to either side. */
#define IO_SCENE_LENGTH_MIN 1e-6
#define IO_SCENE_LENGTH_MAX 1e6

/* Roughness of an object that states none. */
#define IO_SCENE_ROUGHNESS 0.3

#define IO_SCENE_RAD_PER_DEG (3.14159265358979323846 / 180)

/* False for a vector that is too short to have a direction. */
bool io_scene_normalize(double v[3]);
double io_scene_length(const double v[3]);
void io_scene_scale_to_mm(double v[3], double unit_mm);

/* Like io_json_get_numbers: an absent key keeps what was there. A colour is [r, g, b], or one number. */
DIPOLE_CHECKED bool io_scene_get_coordinates(const struct io_json *object, const char *key, double out[3],
                                             dipole_status *status);
DIPOLE_CHECKED bool io_scene_get_rgb(const struct io_json *object, const char *key, double out[3],
                                     dipole_status *status);

/* Read camera or cameras of the root, all of them, and keep the one of that name; NULL: the first. */
DIPOLE_CHECKED bool io_scene_read_cameras(const struct io_json *root, const char *name, double unit_mm,
                                          struct io_camera *camera, dipole_status *status);

DIPOLE_CHECKED bool io_scene_read_light(const struct io_json *at, double unit_mm, struct io_light *light,
                                        dipole_status *status);

/* A bundled material's name, a path, or the material itself. */
DIPOLE_CHECKED bool io_scene_read_material(const struct io_json *at, const struct io_scene_options *options,
                                           struct io_material *material, dipole_status *status);

/* Read frames once camera and lights are there. An absent at is one frame. */
DIPOLE_CHECKED bool io_scene_read_frames(const struct io_json *at, struct io_scene *scene,
                                         dipole_status *status);

struct io_scene_transform {
    double fit_height;     /* 0: as large as the mesh is */
    double origin[3], fit; /* of io_scene_fit_mesh */
    double scale[3];
    double rotation[3][3];
    double translate[3];
};

DIPOLE_CHECKED bool io_scene_read_transform(const struct io_json *at, struct io_scene_transform *transform,
                                            dipole_status *status);

/* How far a mesh may reach once it is in the world. */
#define IO_SCENE_REACH_MAX_MM 1e9

/* Work out what fit_height makes of a mesh, and of all others that are placed alike; at is its object. */
DIPOLE_CHECKED bool io_scene_fit_mesh(const struct io_json *at, const struct io_mesh *mesh,
                                      struct io_scene_transform *transform, dipole_status *status);

/* Move a mesh to the world, once the transform was fitted. */
DIPOLE_CHECKED bool io_scene_place_mesh(const struct io_json *at,
                                        const struct io_scene_transform *transform, double unit_mm,
                                        struct io_mesh *mesh, dipole_status *status);

/* The one shape that an object names: a mesh file or a primitive. */
DIPOLE_CHECKED bool io_scene_read_shape(const struct io_json *at, const struct io_scene_options *options,
                                        struct io_mesh **mesh, dipole_status *status);

/* Whether an element of objects is a blocker; then read it. Its mesh and motion are set when reading failed
 * after them, too; of one that moves the mesh is there once it is posed. */
bool io_scene_is_blocker(const struct io_json *at);
DIPOLE_CHECKED bool io_scene_read_blocker(const struct io_json *at, const struct io_scene_options *options,
                                          double unit_mm, int frame_count, struct io_blocker *blocker,
                                          dipole_status *status);

/* Read the mesh file that a string names. */
DIPOLE_CHECKED bool io_scene_read_mesh(const struct io_json *at, const char *name,
                                       const struct io_scene_options *options, struct io_mesh **mesh,
                                       dipole_status *status);

#endif
