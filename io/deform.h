/*
 * How a surface is bent out of shape and moved: positions in mm, normals by the inverse transpose of the
 * Jacobian. Pure functions of numbers; renderer/shaders/common/deform.glsl has the same. theory.md
 * T54..T56.
 */
#ifndef IO_DEFORM_H
#define IO_DEFORM_H

#include <stdbool.h>
#include <stddef.h>

enum io_deform_kind {
    IO_DEFORM_TWIST = 0, /* about the axis, by an angle in proportion to the place along it (T54)      */
    IO_DEFORM_BEND,      /* the axis becomes an arc that curves toward (T55)                           */
    IO_DEFORM_WAVE,      /* moved toward by a sine of the place along the axis (T56)                   */
};
extern const char *const io_deform_kind_names[]; /* "twist", "bend", "wave", NULL */

enum { IO_DEFORM_LIMIT = 4 };

/* One deformation as it stands in one frame. axis and toward are unit vectors at right angles; a twist has
 * no use for toward. */
struct io_deform {
    enum io_deform_kind kind;
    double origin_mm[3], axis[3], toward[3];
    double rate_rad_per_mm; /* twist: angle per length; bend: curvature; wave: 2 pi over the wavelength */
    double amplitude_mm;    /* wave */
    double phase_rad;       /* wave */
};

/* What a frame makes of an object: deformations one after the other, then x becomes rotation x + shift. */
struct io_pose {
    struct io_deform deforms[IO_DEFORM_LIMIT];
    size_t deform_count; /* those that are the identity are left out */
    bool is_moved;       /* else rotation and shift are of no effect */
    double rotation[3][3], shift_mm[3];
};

/* Whether it leaves every point where it is. */
bool io_deform_is_identity(const struct io_deform *deform);

/* Deform a point, and its normal, which need not have length 1 and does not keep its length. What is the
 * identity leaves both as they are, to the last bit. A bend turns what lies beyond its centre inside out.
 */
void io_deform_apply(const struct io_deform *deform, double position_mm[3], double normal[3]);

/* All of a pose; the normal comes out with length 1 (a zero vector stays one). */
void io_pose_apply(const struct io_pose *pose, double position_mm[3], double normal[3]);

/* Whether it leaves every point where it is. */
bool io_pose_is_rest(const struct io_pose *pose);

#endif
