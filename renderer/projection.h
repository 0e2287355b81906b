/* What a camera or a light sees: one projection for both, in double; the matrix is made for OpenGL. */
#ifndef RENDERER_PROJECTION_H
#define RENDERER_PROJECTION_H

#include "io/scene_file.h"

/* right, up, forward are unit vectors at right angles. */
struct render_projection {
    double eye_mm[3], right[3], up[3], forward[3];
    bool is_orthographic;
    double half_width, half_height; /* orthographic: in mm; perspective: at distance 1 */
    double near_mm, far_mm;
};

/* A sphere that holds everything. */
struct render_ball {
    double centre_mm[3], radius_mm;
};

/* The smallest ball about the middle of the box, the scene's or the mesh's, that holds every vertex. It has
 * a radius above 0 even where all vertices are the same. */
struct render_ball render_ball_of_scene(const struct io_scene *scene);
struct render_ball render_ball_of_mesh(const struct io_mesh *mesh);

/* Distance of the boxes about two meshes; 0 where they meet. */
double render_mesh_gap_mm(const struct io_mesh *a, const struct io_mesh *b);

/* Turn the view along forward (a unit vector), with up as close as may be to the vector given. */
void render_projection_aim(struct render_projection *projection, const double forward[3],
                           const double up[3]);

/* The scene's camera; near and far enclose the ball. */
void render_projection_of_camera(const struct io_camera *camera, const struct render_ball *ball,
                                 struct render_projection *out);

/* Position in the view: right, up, forward of the eye, in mm. */
void render_projection_to_view(const struct render_projection *projection, const double position_mm[3],
                               double view_mm[3]);

/* World to clip space, column by column. */
void render_projection_matrix(const struct render_projection *projection, float matrix[16]);

/*
 * The smallest rectangle { left, bottom, right, top } in -1..1 of the picture that holds the sphere's
 * image, by the planes through the eye that touch it; the whole picture for an eye inside.
 * false: nothing of the sphere can be in the picture.
 */
bool render_projection_bound_sphere(const struct render_projection *projection, const double centre_mm[3],
                                    double radius_mm, double rectangle[4]);

/* Where view_z_mm lies between near (0) and far (1), kept to that range: linear, so that one rounding
 * error is the same everywhere. common/depth.glsl has the same. */
double render_projection_linear_depth(const struct render_projection *projection, double view_z_mm);

static inline double render_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#endif
