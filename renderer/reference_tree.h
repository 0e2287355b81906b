/*
 * Sums over points where light enters: what arrives at other points from all of them, with a proven bound
 * of the error. Far points are summed together, by their moments. theory.md T33.
 */
#ifndef RENDERER_REFERENCE_TREE_H
#define RENDERER_REFERENCE_TREE_H

#include "renderer/reference_profile.h"

/* Error of a sum in each channel, at most: this part of the sum itself, or of what the caller says is
 * little enough, and the profile's noise times the flux. */
#define RENDER_TREE_ERROR 1e-4

/* Power that enters at a point. */
struct render_tree_point {
    double position_mm[3], unused;
    render_lanes flux_w;
};

/* Sums are made together for up to so many places near each other. */
enum { RENDER_TREE_TARGETS = 64 };

struct render_tree_targets {
    double position_mm[RENDER_TREE_TARGETS][3];
    render_lanes sums[RENDER_TREE_TARGETS]; /* W/mm^2                                          */
    render_lanes least;                     /* sums below this err by no more than this would */
    int count;
};

struct render_tree;

/* The points are put in another order and must outlive the tree. Takes up to 250 bytes a point. Fails with
 * DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_tree_create(struct render_tree_point *points, size_t count,
                                       struct render_tree **tree_out, dipole_status *status);
void render_tree_destroy(struct render_tree *tree);

/* Add to each target's sums what arrives there, in W/mm^2. For any number of threads at once. */
void render_tree_add(const struct render_tree *tree, const struct render_profile *profile,
                     struct render_tree_targets *targets);

#endif
