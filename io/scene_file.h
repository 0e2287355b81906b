/* Scene files; docs/formats.md and scenes/scene.schema.json describe them. */
#ifndef IO_SCENE_FILE_H
#define IO_SCENE_FILE_H

#include "io/material_file.h"
#include "io/mesh.h"

enum io_light_kind { IO_LIGHT_DIRECTIONAL = 0, IO_LIGHT_POINT };

struct io_light {
    enum io_light_kind kind;
    double direction[3];   /* directional: unit vector along which light travels           */
    double position_mm[3]; /* point                                                        */
    double rgb[3];         /* directional: irradiance on a facing surface in W/mm^2;
                              point: intensity in W/sr; finite, >= 0                       */
};

struct io_camera {
    double eye_mm[3], target_mm[3], up[3];
    bool is_orthographic;
    double fov_y_rad; /* perspective                        */
    double height_mm; /* orthographic: height of the view   */
    int width_px, height_px;
};

struct io_object {
    char name[128];
    struct io_mesh *mesh; /* positions in mm, in the world: transform and unit applied */
    struct io_material material;
    double roughness;  /* GGX roughness of the surface, 0.05 to 1; specular only     */
    bool has_specular; /* false when the object says "specular": false               */
};

struct io_scene {
    char path[4096];
    struct io_camera camera;
    double exposure_ev;   /* PNG only: radiance times 2^ev                    */
    double background[3]; /* radiance where no object is                      */
    struct io_light *lights;
    size_t light_count;
    struct io_object *objects;
    size_t object_count;
    double min_mm[3], max_mm[3];
};

struct io_scene_options {
    const char *const *allowed_paths; /* folders that references may lead to, beside the scene's own */
    size_t allowed_path_count;
    int width_px, height_px; /* override the camera's, when > 0                       */
};

/* Read a scene, its meshes and materials. End it with io_scene_destroy. */
DIPOLE_CHECKED bool io_scene_read(const char *path, const struct io_scene_options *options,
                                  struct io_scene **scene_out, dipole_status *status);

void io_scene_destroy(struct io_scene *scene);

#endif
