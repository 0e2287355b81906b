/* An object's vertices in the pose of a frame: from those at rest, by a vertex shader whose output goes
 * back to the buffers that every pass draws from. io/deform.h says what a pose is; shaders/pose.vert does
 * it. */
#ifndef RENDERER_POSE_H
#define RENDERER_POSE_H

#include "io/scene_file.h"
#include "renderer/geometry.h"

/* Where an object's vertices lie in the geometry, and what is kept of them at rest; begins as the first
 * two, the rest 0. */
struct render_posed {
    size_t first_vertex, vertex_count;
    GLuint rest[RENDER_VERTEX_ARRAYS]; /* buffers; 0 until the object is first posed */
    GLuint vertex_array;               /* of these                                   */
    bool is_posed;                     /* else the geometry has it at rest           */
};

/* The program of shaders/pose.vert. Fails as render_program_create does. */
DIPOLE_CHECKED bool render_pose_program_create(GLuint *program_out, dipole_status *status);

/* Write the vertices in the object's pose. What is at rest is kept from then on. */
void render_pose_write(GLuint program, const struct io_object *object,
                       const struct render_geometry *geometry, struct render_posed *posed);

/* Put the vertices back where they rest, unless they are there. */
void render_pose_undo(const struct render_geometry *geometry, struct render_posed *posed);

/* Accepts { 0 }; context current. */
void render_pose_end(struct render_posed *posed);

/* Whether what the pose makes of a solid surely has its outside outside: of a bend that is so short of its
 * centre, which is known of the first deformation alone. */
bool render_pose_keeps_sides(const struct io_object *object);

#endif
