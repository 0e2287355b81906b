/*
 * Light samples in a tree, so that far ones are taken together: a cluster stands for its samples by six
 * points that have its flux, its mean and its second moments. theory.md T16.
 */
#ifndef FIT_CLUSTERS_H
#define FIT_CLUSTERS_H

#include "fit/form.h"
#include "renderer/light_samples.h"

struct fit_clusters;

/* count > 0 samples, or those of one object (-1: of all); nothing of them is kept. Where there are none
 * nothing is seen. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool fit_clusters_create(const struct render_light_sample *samples, size_t count, int object,
                                        struct fit_clusters **clusters_out, dipole_status *status);
void fit_clusters_destroy(struct fit_clusters *clusters);

/* Points that stand for all samples, by component; grown as needed, begins as {0}. */
struct fit_points {
    size_t count, capacity;
    float *x, *y, *z, *flux_w[FIT_CHANNEL_COUNT]; /* parts of one allocation, which x owns */
};
void fit_points_destroy(struct fit_points *points);

/*
 * The light as a receiver sees it: of each cluster that is smaller than an angle of 1/7 (radius over
 * distance) its six points, else its samples. Skewness is what is lost: a few times 1e-3 of a single
 * cluster's light, 1e-4 of the sum. False when memory runs out; out is then empty.
 */
bool fit_clusters_collect(const struct fit_clusters *clusters, const float position_mm[3],
                          struct fit_points *out);

#endif
