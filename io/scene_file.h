/* Scene files; docs/formats.md and scenes/scene.schema.json describe them. */
#ifndef IO_SCENE_FILE_H
#define IO_SCENE_FILE_H

#include "io/deform.h"
#include "io/material_file.h"
#include "io/mesh.h"

enum io_light_kind { IO_LIGHT_DIRECTIONAL = 0, IO_LIGHT_POINT };

struct io_light {
    enum io_light_kind kind;
    double direction[3];   /* directional: unit vector along which light travels           */
    double position_mm[3]; /* point                                                        */
    double rgb[3];         /* directional: irradiance on a facing surface in W/mm^2;
                              point: intensity in W/sr; finite, >= 0                       */
    double size_mm;        /* point: diameter of the disc that it is, facing what it lights; 0: a point */
    double size_rad;       /* directional: angle that its disc is seen under; 0: a direction            */
    bool is_spot;          /* point: lights a cone about direction alone                                */
    double cone_rad;       /* spot: angle between its sides, under pi                                   */
    double cone_blend;     /* spot: part of that angle, 0 to 1, over which light falls to the edge      */
    bool is_stated;        /* else the file says nothing of rgb, and it is 1               */
};

struct io_camera {
    double eye_mm[3], target_mm[3], up[3];
    bool is_orthographic;
    double fov_y_rad; /* perspective                        */
    double height_mm; /* orthographic: height of the view   */
    int width_px, height_px;
};

enum { IO_SCENE_LIGHT_LIMIT = 64 };

/* Light from all around: a picture of radiance by direction. The picture itself is not read here. */
struct io_environment {
    char path[4096];   /* of an EXR or HDR file, resolved; it exists      */
    double rgb[3];     /* what the picture is multiplied by, finite, >= 0 */
    double rotate_rad; /* about y, counter-clockwise seen from above      */
};

/* A scene in motion. Without frames count is 1 and the turns are 0. */
struct io_frames {
    int count;
    double camera_turn_deg, lights_turn_deg; /* from frame 0 to frame count */
    struct io_camera camera;                 /* as read: every frame is made */
    struct io_light *lights;                 /* of these                     */
};

struct io_motion; /* as read: scene_motion.h */

/* What an object throws on others: AUTO leaves it to who draws. */
enum io_casts { IO_CASTS_AUTO = 0, IO_CASTS_OPAQUE, IO_CASTS_TRANSLUCENT };

struct io_object {
    char name[128];
    struct io_mesh *mesh; /* positions in mm, in the world: transform and unit applied */
    struct io_material material;
    double roughness;  /* GGX roughness of the surface, 0.05 to 1; specular only     */
    bool has_specular; /* false when the object says "specular": false               */
    enum io_casts casts;

    /* Of an object in motion: mesh is rest in the pose of the frame that is set. NULL and no effect for one
     * that stands still, whose mesh never changes. */
    struct io_motion *motion;
    const struct io_mesh *rest;
    struct io_pose pose;
};

/* What the pose of an object is applied to. */
static inline const struct io_mesh *io_object_rest(const struct io_object *object)
{
    return object->rest ? object->rest : object->mesh;
}

/* What of an object changes from frame to frame; all false where nothing does. */
struct io_motion_kinds {
    bool is_deformed, is_moved, is_sequence;
};
struct io_motion_kinds io_object_motion_kinds(const struct io_object *object);

/* How much longer the edges of the mesh become, by their root mean square, in the frame that stretches them
 * most (of some that are looked at); 1 or more. The same in all frames. */
double io_object_stretch(const struct io_object *object);

/* What a body leaves of light by the length of the way through it, tabulated; no file has it:
 * renderer/passage.h fills it, and says what it is between nodes. */
enum { IO_PASSAGE_NODES = 64 };
struct io_passage {
    double first_mm;
    int counts[IO_CHANNEL_COUNT];
    double depth[IO_CHANNEL_COUNT][IO_PASSAGE_NODES]; /* optical: -ln of what is left */
};

/*
 * What stands in the way of light, and is not seen itself. A solid keeps its opacity of the light on each
 * way through it, or by extinction the more the longer the way; a sheet at each of its surfaces. Particles
 * are discs that face the light.
 */
struct io_blocker {
    char name[128];
    struct io_mesh *mesh; /* positions in mm, in the world; of particles their middles, without triangles */
    double particle_mm;   /* radius; 0: these are no particles                                            */
    bool is_sheet;
    bool has_extinction;
    double opacity[3];                /* per channel, 0 to 1   */
    double extinction_per_mm[3];      /* >= 0, if it has one   */
    const struct io_passage *passage; /* in place of both; NULL: of all that a file has */

    /* Of one that is deformed or moves: mesh is in the pose of the frame that is set. Else NULL. */
    struct io_motion *motion;
};

struct io_scene {
    char path[4096];
    struct io_camera camera; /* of frame 0, as are the lights, until io_scene_set_frame */
    double exposure_ev;      /* PNG only: radiance times 2^ev                       */
    double background[3];    /* radiance where no object is                         */
    struct io_light *lights;
    size_t light_count; /* 0 only with an environment                          */
    bool has_environment;
    struct io_environment environment;
    struct io_object *objects;
    size_t object_count;
    struct io_blocker *blockers; /* stand among the file's objects; outside of min_mm, max_mm */
    size_t blocker_count;
    double min_mm[3], max_mm[3];
    struct io_frames frames;
};

struct io_scene_options {
    const char *const *allowed_paths; /* folders that references may lead to, beside the scene's own */
    size_t allowed_path_count;
    const char *camera_name; /* which of the cameras; NULL: the first                 */
    int width_px, height_px; /* override the camera's, when > 0                       */
};

/* Read a scene, its meshes and materials. End it with io_scene_destroy. */
DIPOLE_CHECKED bool io_scene_read(const char *path, const struct io_scene_options *options,
                                  struct io_scene **scene_out, dipole_status *status);

/*
 * Set the camera, the lights and the objects of a scene that was read to those of a frame, 0 to
 * frames.count, where what goes round is back where it began. Each frame is computed from what was read:
 * frame 0 is the file to the last bit, whatever was set before. Counter-clockwise seen against the axis:
 * the camera turns about its up through its target, the lights about y through the target.
 */
void io_scene_set_frame(struct io_scene *scene, int frame);

/* Add a light, or take one away, also of what frames are made of. Adding fails with DIPOLE_BAD_VALUE beyond
 * IO_SCENE_LIGHT_LIMIT, or DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool io_scene_add_light(struct io_scene *scene, const struct io_light *light,
                                       dipole_status *status);
void io_scene_remove_light(struct io_scene *scene, size_t index);

/*
 * Write the scene as it stands: the file that it was read from, with these options, and in it what has
 * changed since: camera, lights, scale and turn of the environment, exposure, materials, roughness and
 * gloss. All else stays as it was; a changed material stands in the scene itself, with coefficients. Fails
 * as io_file_write and the reading of a scene do; with DIPOLE_BAD_VALUE also where the file has other
 * objects by now, or names files by relative paths and path is not in its folder.
 */
DIPOLE_CHECKED bool io_scene_write(const struct io_scene *scene, const struct io_scene_options *options,
                                   const char *path, dipole_status *status);

void io_scene_destroy(struct io_scene *scene);

#endif
