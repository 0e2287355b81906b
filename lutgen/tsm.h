/* What the files of translucent-shadow-map volumes share. */
#ifndef LUTGEN_TSM_H
#define LUTGEN_TSM_H

#include "lutgen/internal.h"

/* ---- pattern (tsm_pattern.c) -------------------------------------------------------------------- */

/* A cell of the pattern, in sides of the inner square: a polygon of four corners, counter-clockwise. */
struct lut_cell {
    double corners[4][2], centre[2], area;
    bool is_inner;     /* one of the five that share their light with the local response */
    bool is_outermost; /* of the last ring, which takes what falls beyond                */
};

/* Whether there is a pattern for so many slices; how many times it is as wide as its inner square; its
 * cells. */
bool lut_pattern_has(int slices);
double lut_pattern_extent(int slices);
int lut_pattern_cells(int slices, struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT]);

/* ---- places in a volume (tsm_sample.c) ----------------------------------------------------------- */

/* Slices behind the samples: the local kernel, and its depth factors; the last slice holds the self-test.
 */
int lut_tsm_kernel_slice(const struct lut_tsm *lut);
int lut_tsm_depth_slice(const struct lut_tsm *lut);
float *lut_tsm_texel(const struct lut_tsm *lut, int s, int t, int r);

double lut_tsm_depth_mm(const struct lut_tsm *lut, double index); /* of a T node, or between */
double lut_tsm_depth_index(const struct lut_tsm *lut, double dz_mm);
double lut_tsm_local_depth_mm(const struct lut_tsm *lut, double index);
double lut_tsm_local_depth_index(const struct lut_tsm *lut, double dz_mm);

/* lut_tsm_sample at indices of nodes, or between. */
void lut_tsm_sample_at(const struct lut_tsm *lut, int sample, double s, double t,
                       double rgb_out[IO_CHANNEL_COUNT]);

/* sample_count and samples, from size[2] and inner_mm. */
void lut_tsm_samples_fill(struct lut_tsm *lut);

/* ---- what a volume is baked from (tsm_plan.c) ----------------------------------------------------- */

enum { LUT_GAUSS_POINTS = 8, LUT_RULE_LIMIT = 4 * LUT_GAUSS_POINTS };

/* Cells that are each other's mirror images receive the same, and so do their slices. */
struct lut_cell_class {
    struct lut_cell cell; /* the first of them */
    int members[8], member_count;
    int first, count; /* of the plan's terms */
};

/* One radius of a rule that sums the power within discs. */
struct lut_rule_term {
    int radius; /* of r_mm */
    double weight;
};

struct lut_tsm_plan {
    struct lut_tsm *lut;
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    int class_of[LUT_TSM_SAMPLE_LIMIT];
    struct lut_cell_class classes[LUT_TSM_SAMPLE_LIMIT];
    int class_count, term_count;
    struct lut_rule_term *terms; /* of all classes' rules */
    double *r_mm; /* different ones: those of the inner cells first, one more that is infinite */
    int radius_count, inner_radius_count;
    dipole_sources sources[IO_CHANNEL_COUNT];
    double flat_inner_power[IO_CHANNEL_COUNT]; /* of the five inner cells at dz = 0 */
    struct lut_profile profiles[IO_CHANNEL_COUNT];
};

/* Of a volume whose material, epsilon and size[2] are set; sets its lengths and samples. End it with
 * lut_tsm_plan_destroy, also after a failure. */
DIPOLE_CHECKED bool lut_tsm_plan_create(struct lut_tsm *lut, struct lut_tsm_plan **plan_out,
                                        dipole_status *status);
void lut_tsm_plan_destroy(struct lut_tsm_plan *plan);

/* Memory of one thread's row: within radius_count + 1, means class_count for each channel, the others
 * cosine_count and one more. */
struct lut_tsm_work {
    double *within, *means, *cosines, *values;
};
bool lut_tsm_work_create(const struct lut_tsm_plan *plan, size_t cosine_count, struct lut_tsm_work *work);
void lut_tsm_work_end(struct lut_tsm_work *work);

/*
 * work->means: the mean response of each class of cells where the surface of the light's entry lies across
 * the light, dz above the point; negative where it is lost in rounding. What falls beyond the last ring is
 * added to it, so that the sum over all cells is all the light that arrives.
 */
void lut_tsm_means_find(const struct lut_tsm_plan *plan, int channel, double dz_mm,
                        const struct lut_tsm_work *work);

/* Power of the five inner cells at that depth, over that at dz = 0. */
double lut_tsm_inner_part(const struct lut_tsm_plan *plan, int channel, double dz_mm,
                          const struct lut_tsm_work *work);

/* work->values: the whole response of one cell at the first count of work->cosines, after
 * lut_tsm_means_find at the same depth; overwrites the cosine behind them. Members of a class have the
 * same. */
void lut_tsm_response(const struct lut_tsm_plan *plan, int channel, int sample, double dz_mm, size_t count,
                      const struct lut_tsm_work *work);

/* The part of it that is not left to the local response. */
double lut_tsm_global_part(const struct lut_tsm_plan *plan, int sample, double dz_mm);

/* Means of the flat response over the cells of the local kernel, row by row. */
void lut_tsm_kernel_find(const struct lut_tsm_plan *plan, int channel,
                         double means[LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE]);

/* ---- texels (tsm.c) ----------------------------------------------------------------------------- */

/* Fill new texels of the volume's size[0] and size[1], in float; whatever was there is freed. */
DIPOLE_CHECKED bool lut_tsm_plan_bake(const struct lut_tsm_plan *plan, int thread_count,
                                      dipole_status *status);

/* ---- audit (tsm_audit.c) ------------------------------------------------------------------------ */

/* Which axes' points lie off the grid. */
enum lut_tsm_audit_kind { LUT_AUDIT_BOTH = 0, LUT_AUDIT_S, LUT_AUDIT_T };

DIPOLE_CHECKED bool lut_tsm_plan_audit(const struct lut_tsm_plan *plan, enum lut_tsm_audit_kind kind,
                                       int depth_count, unsigned seed, int thread_count,
                                       struct lut_error *error_out, dipole_status *status);

#endif
