/*
 * Tables for renderers: a material's profile, baked with its measured error. Splat tables hold R_d(r), one
 * row of texels per material; translucent-shadow-map volumes hold the response of 21 samples of a light's
 * view.
 */
#ifndef LUTGEN_LUT_H
#define LUTGEN_LUT_H

#include "io/exr.h"
#include "io/material_file.h"

enum lut_kind { LUT_SPLAT1D = 0, LUT_SPLAT2D, LUT_TSM, LUT_KIND_COUNT };

/* "splat1d", "splat2d", "tsm"; ends with NULL. */
extern const char *const lut_kind_names[];

#define LUT_EPSILON_MIN 1e-6
#define LUT_EPSILON_MAX 0.5

/* 16 hexadecimal digits and a NUL. */
struct lut_hash {
    char text[17];
};

/* Of all that decides how light spreads in a material: model, layers, indices and coefficients, not its
 * name. */
struct lut_hash lut_material_hash(const struct io_material *material);

/* Largest relative error, and the one that 99 % of random points stay below. */
struct lut_error {
    double max, p99;
};

/* Seed of the points that measure an error: bake and check use different ones. */
enum { LUT_SEED_BAKE = 1, LUT_SEED_CHECK = 2 };

/* ---- splat tables ------------------------------------------------------------------------------- */

/*
 * Axis of a row of texels. theory.md T15; w = 1 + (r/scale)^2, W the same at r_max:
 *   u(r) = (w^power - 1)/(W^power - 1), for power 0 its limit log w/log W
 * Texel i of node_count has its centre at u = i/(node_count - 1).
 */
struct lut_axis {
    double r_max_mm, scale_mm, power;
    int node_count;
};
double lut_axis_index(const struct lut_axis *axis, double r_mm); /* 0 .. node_count - 1 */
double lut_axis_r_mm(const struct lut_axis *axis, double index);

/* One material's row: a texel holds R_d(r) w^falloff/scale, which falls far less than R_d does. */
struct lut_splat_row {
    struct io_material material;
    struct lut_axis axis;
    double falloff;                   /* 0, 0.5, 1 or 1.5                                       */
    double scale[IO_CHANNEL_COUNT];   /* powers of two; 1 in float                              */
    double core_mm[IO_CHANNEL_COUNT]; /* below it the profile is replaced (T31); 0 where it is not */
    double predicted_error;           /* from the profile's curvature along u                   */
    struct lut_error error;           /* measured                                               */
};

/* End it with lut_splat_destroy. */
struct lut_splat {
    double epsilon; /* asked: relative error, and part of the light beyond r_max */
    bool is_half;   /* every texel is a half                                     */
    int node_count; /* of every row                                              */
    size_t row_count;
    struct lut_splat_row *rows;
    float *rgb; /* row_count x node_count x 3                                */
};

/* Smallest and largest node_count, most rows. */
enum { LUT_NODE_COUNT_MIN = 8, LUT_NODE_COUNT_MAX = 32768, LUT_ROW_LIMIT = 1024 };

/*
 * Bake a row for each material whose relative error is at most epsilon (1e-6 to 0.5) for every channel out
 * to r_max(epsilon) of that channel, with the fewest nodes that do it in every row. The error is relative
 * to R_d, and beyond a channel's own r_max to R_d there.
 *
 *   node_count   0: the fewest; else so many, and epsilon must hold with these
 *   is_half      texels are rounded to half; epsilon must then be above 4.9e-4
 *
 * Fails with DIPOLE_BAD_VALUE (naming the material), DIPOLE_NOT_CONVERGED, naming what was reached, or
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool lut_splat_bake(const struct io_material *materials, size_t count, double epsilon,
                                   int node_count, bool is_half, struct lut_splat **lut_out,
                                   dipole_status *status);
void lut_splat_destroy(struct lut_splat *lut);

/* A row at r_mm as the shader evaluates it, in 1/mm^2; 0 beyond r_max. */
void lut_splat_sample(const struct lut_splat *lut, size_t row, double r_mm,
                      double rgb_out[IO_CHANNEL_COUNT]);

/* Error of a row against direct evaluation at its nodes and at random points, points_per_node in each
 * interval. */
DIPOLE_CHECKED bool lut_splat_audit(const struct lut_splat *lut, size_t row, int points_per_node,
                                    unsigned seed, struct lut_error *error_out, dipole_status *status);

/* The picture that becomes a file: texels and the attributes of docs/formats.md. The caller destroys it. */
DIPOLE_CHECKED bool lut_splat_to_image(const struct lut_splat *lut, enum lut_kind kind,
                                       struct io_image **image_out, dipole_status *status);

/* Back from a picture. Fails with DIPOLE_BAD_VALUE, naming the attribute that is missing, out of range or
 * at odds with the others or with the texels; path is for messages. */
DIPOLE_CHECKED bool lut_splat_from_image(const struct io_image *image, const char *path,
                                         struct lut_splat **lut_out, dipole_status *status);

/* lut_splat_from_image of an EXR file. */
DIPOLE_CHECKED bool lut_splat_read(const char *path, struct lut_splat **lut_out, dipole_status *status);

#endif
