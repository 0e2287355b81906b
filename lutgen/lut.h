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

/* What is asked of a bake. */
struct lut_request {
    enum lut_kind kind;
    const struct io_material *materials;
    size_t material_count; /* 1, but for splat2d */
    double epsilon;        /* LUT_EPSILON_MIN to LUT_EPSILON_MAX */
    int size[3];           /* texels; 0: chosen. Splat tables: size[0] nodes; tsm: S, T, R */
    bool is_half;          /* texels are rounded to half; epsilon must then be above 4.9e-4 */
};

/* Of all that decides the bytes of the table: the request with the materials' names and sources, the
 * library's version. */
struct lut_hash lut_request_hash(const struct lut_request *request);

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
    double epsilon;       /* asked: relative error, and part of the light beyond r_max */
    bool is_half;         /* every texel is a half                                     */
    int node_count;       /* of every row                                              */
    int node_count_asked; /* 0: the fewest */
    size_t row_count;
    struct lut_splat_row *rows;
    float *rgb; /* row_count x node_count x 3                                */
};

/* Smallest and largest node_count, most rows. */
enum { LUT_NODE_COUNT_MIN = 8, LUT_NODE_COUNT_MAX = 32768, LUT_ROW_LIMIT = 1024 };

/*
 * Bake a row for each material whose relative error is at most epsilon for every channel out to
 * r_max(epsilon) of that channel, with the fewest nodes that do it in every row, or with size[0] of them.
 * The error is relative to R_d, and beyond a channel's own r_max to R_d there.
 *
 * Fails with DIPOLE_BAD_VALUE (naming the material, if there are several), DIPOLE_NOT_CONVERGED, naming
 * what was reached, DIPOLE_NOT_SUPPORTED or DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool lut_splat_bake(const struct lut_request *request, struct lut_splat **lut_out,
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

/* Back from a picture. Fails with DIPOLE_BAD_VALUE or DIPOLE_BAD_SYNTAX, naming the attribute that is
 * missing, out of range or at odds with the others or with the texels; path is for messages. */
DIPOLE_CHECKED bool lut_splat_from_image(const struct io_image *image, const char *path,
                                         struct lut_splat **lut_out, dipole_status *status);

/* lut_splat_from_image of an EXR file. */
DIPOLE_CHECKED bool lut_splat_read(const char *path, struct lut_splat **lut_out, dipole_status *status);

/* ---- volumes for translucent shadow maps -------------------------------------------------------- */

/*
 * One of the places about a point where its light's view is sampled (Dachsbacher and Stamminger 2003,
 * section 4): a cell of the plane across the light, whose mean flux a texel of the view's mip level
 * log2(width_mm/texel width) holds.
 */
struct lut_tsm_sample {
    double offset_mm[2]; /* from the point to the cell's centre: x_in - x_out along the view's axes */
    double width_mm;     /* of a square as large as the cell                                        */
    double area_mm2;
};

/* How many, by the slices of the volume: 13, 21, 53, 117 or 245 of 16, 32, 64, 128 or 256. */
enum { LUT_TSM_SAMPLE_LIMIT = 256, LUT_TSM_LOCAL_SIDE = 7, LUT_TSM_SIDE_MIN = 8, LUT_TSM_SIDE_MAX = 1024 };

/* Slices of the volume whose pattern has so many samples; 0 when there is none. */
int lut_tsm_slices(int sample_count);

/* Width of the inner square of a volume's pattern, for a medium all but LUT_TSM_EXTENT_EPSILON of whose
 * light leaves within r_max_mm: the last ring takes what comes from farther. A wider pattern would have
 * coarser cells. */
#define LUT_TSM_EXTENT_EPSILON 0.03
double lut_tsm_inner_mm(double r_max_mm, int slices);

/*
 * The response of a point to a unit of flux per mm^2 of the light's plane in the cell of a sample (T32), in
 * 1/mm^2: times the sample's area it is what leaves per mm^2. With D = x_out - x_in, N the normal where the
 * light enters, dz how much deeper x_out lies along the light:
 *   S  cosine of N and D; node i of size[0] at -1 + 2i/(size[0] - 1)
 *   T  dz; node i of size[1] at depth_scale sinh(v asinh(depth_max/depth_scale)), v = 2i/(size[1] - 1) - 1
 *   R  the sample
 * The five cells nearest to the point, a square of inner_mm, leave to the local response what lies about as
 * deep as the point: see lut_tsm_proximity.
 */
struct lut_tsm {
    struct io_material material;
    double epsilon;
    bool is_half;
    int size[3], size_asked[3]; /* S, T, R; asked: 0 is chosen */
    double depth_scale_mm, depth_max_mm, inner_mm, local_depth_scale_mm;
    int sample_count;
    struct lut_tsm_sample samples[LUT_TSM_SAMPLE_LIMIT];
    double scale[IO_CHANNEL_COUNT]; /* powers of two, which texels are to be multiplied with    */
    struct lut_error error;         /* measured, relative to the whole response; with the next  */
    double source_error;            /* of the model's sources over a flat surface (T30)         */
    float *rgb;                     /* size[1] rows of size[2] slices side by side of size[0] texels */
};

/*
 * Bake with thread_count threads (0: as many as processors); the bytes do not depend on it. A size of 0 is
 * 64 x 64 x 32, and S and T are doubled up to 1024 until the error is at most epsilon; a size that is given
 * must keep it. Fails like lut_splat_bake, or with DIPOLE_NOT_CONVERGED where the sources do.
 */
DIPOLE_CHECKED bool lut_tsm_bake(const struct lut_request *request, int thread_count,
                                 struct lut_tsm **lut_out, dipole_status *status);
void lut_tsm_destroy(struct lut_tsm *lut);

/* Part of the light from five inner cells that the local response takes over, 1 at dz = 0 to 0 from
 * inner_mm on. */
double lut_tsm_proximity(const struct lut_tsm *lut, double dz_mm);

/* The volume as a shader samples it, in 1/mm^2. cosine -1 to 1; 0 beyond depth_max. */
void lut_tsm_sample(const struct lut_tsm *lut, int sample, double cosine, double dz_mm,
                    double rgb_out[IO_CHANNEL_COUNT]);

/*
 * The local response: 7 x 7 cells of inner_mm/7, indices from -3 to 3, in 1/mm^2, times a factor of their
 * depth, which has size[0] nodes at
 *   |dz| = local_depth_scale sinh(i/(size[0] - 1) asinh(inner/local_depth_scale)).
 * Power per mm^2 is flux per mm^2 times the cell's area times both.
 */
void lut_tsm_local_kernel(const struct lut_tsm *lut, int i, int j, double rgb_out[IO_CHANNEL_COUNT]);
void lut_tsm_local_depth_factor(const struct lut_tsm *lut, double dz_mm, double rgb_out[IO_CHANNEL_COUNT]);

/* Error against direct evaluation off the grid: at depth_count random depths all samples at random cosines.
 * Without source_error. */
DIPOLE_CHECKED bool lut_tsm_audit(const struct lut_tsm *lut, int depth_count, unsigned seed,
                                  struct lut_error *error_out, dipole_status *status);

/*
 * What the volume was baked from, for those who evaluate the response themselves: of sample i it is the
 * form of T30 at the cell's centre, |D|^2 = offset^2 + dz^2, times a factor of dz. End it with
 * lut_tsm_exact_destroy.
 */
struct lut_tsm_exact {
    dipole_sources sources[IO_CHANNEL_COUNT];
    int node_count; /* of depth: dz = depth_scale sinh(v asinh(depth_max/depth_scale)), v = 2k/(node_count -
                     * 1) - 1
                     */
    float *rgb;     /* sample_count rows of node_count factors */
};

/* node_count 2 to 65536. Fails with DIPOLE_OUT_OF_MEMORY or as lut_tsm_bake does. */
DIPOLE_CHECKED bool lut_tsm_exact_create(const struct lut_tsm *lut, int node_count,
                                         struct lut_tsm_exact **exact_out, dipole_status *status);
void lut_tsm_exact_destroy(struct lut_tsm_exact *exact);

/* Picture and file, as of splat tables. */
DIPOLE_CHECKED bool lut_tsm_to_image(const struct lut_tsm *lut, struct io_image **image_out,
                                     dipole_status *status);
DIPOLE_CHECKED bool lut_tsm_from_image(const struct io_image *image, const char *path,
                                       struct lut_tsm **lut_out, dipole_status *status);
DIPOLE_CHECKED bool lut_tsm_read(const char *path, struct lut_tsm **lut_out, dipole_status *status);

#endif
