/* How the readers of scenes share out what objects do over the frames. */
#ifndef IO_SCENE_MOTION_H
#define IO_SCENE_MOTION_H

#include "io/scene_internal.h"

enum { IO_MESH_SEQUENCE_LIMIT = 1000, IO_KEY_LIMIT = 1000 };

/* A deformation whose amount goes from first to last: the rate in rad/mm, of a wave the amplitude in mm. */
struct io_deform_track {
    struct io_deform deform;
    double first, last;
    bool is_there_and_back;   /* along a cosine, else straight on                    */
    double phase_deg, cycles; /* of a wave: the phase grows by so many whole turns   */
};

struct io_motion_key {
    double frame, turn_deg, translate_mm[3];
};

/* Owns its meshes. */
struct io_motion {
    struct io_mesh **meshes; /* placed in the world; frame f has f modulo mesh_count */
    size_t mesh_count;
    struct io_mesh *posed;         /* large enough for any of them; NULL when none is deformed or moved */
    const struct io_mesh *indices; /* the mesh whose triangles posed holds                             */
    struct io_deform_track tracks[IO_DEFORM_LIMIT];
    size_t track_count;
    double axis[3], point_mm[3];
    struct io_motion_key *keys; /* frames ascend; none: it stays where it is                        */
    size_t key_count;
    bool is_smooth;         /* Catmull-Rom, else linear */
    bool is_there_and_back; /* two keys, passed along a cosine */
    int frame_count;
    double stretch; /* io_object_stretch */
};

struct io_motion_reading {
    const struct io_json *at; /* the object */
    const struct io_scene_options *options;
    struct io_scene_transform *transform;
    double unit_mm;
    int frame_count;
};

/* Read mesh_sequence, deform and motion of an object whose mesh is there, unless it is a sequence; the mesh
 * becomes the motion's. Leaves both as they are when the object has none of them. */
DIPOLE_CHECKED bool io_scene_read_motion(const struct io_motion_reading *reading, struct io_mesh **mesh,
                                         struct io_motion **motion_out, dipole_status *status);

/* scene_sequence.c: read and place every mesh of a sequence. */
DIPOLE_CHECKED bool io_scene_read_sequence(const struct io_motion_reading *reading,
                                           struct io_motion *motion, dipole_status *status);

/* Of all the object's meshes. */
size_t io_scene_triangle_count(const struct io_object *object);

/* Put every object and blocker into a frame's pose, and the box about the scene. */
void io_scene_pose_objects(struct io_scene *scene, int frame);

/* Of an object or blocker, also of one that was read in part. */
void io_scene_end_shape(struct io_mesh *mesh, struct io_motion *motion);

#endif
