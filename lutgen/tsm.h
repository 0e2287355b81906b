/* What the files of translucent-shadow-map volumes share. */
#ifndef LUTGEN_TSM_H
#define LUTGEN_TSM_H

#include "lutgen/internal.h"

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

/* Slices behind the samples: the local kernel, its depth factors in column 0; the last holds the self-test.
 */
int lut_tsm_kernel_slice(const struct lut_tsm *lut);
int lut_tsm_depth_slice(const struct lut_tsm *lut);

/* sample_count and samples, from size[2] and inner_mm. */
void lut_tsm_samples_fill(struct lut_tsm *lut);

double lut_tsm_depth_mm(const struct lut_tsm *lut, double index); /* of a T node, or between */
double lut_tsm_local_depth_mm(const struct lut_tsm *lut, double index);
double lut_tsm_local_depth_index(const struct lut_tsm *lut, double dz_mm);
double lut_tsm_depth_index(const struct lut_tsm *lut, double dz_mm);

#endif
