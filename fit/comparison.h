/* A picture beside the same picture as the model draws it, made small enough for a page. */
#ifndef FIT_COMPARISON_H
#define FIT_COMPARISON_H

#include "fit/report.h"

enum { FIT_COMPARISON_SIDE_LIMIT_PX = 1024 };

/* End it with fit_comparison_destroy. Its pixels are means over boxes of factor x factor pixels. */
struct fit_comparison {
    int factor;
    struct io_image *target, *model;  /* 3 channels, times exposure; means of what is finite, else NaN    */
    struct io_image *differences;     /* 3 channels: (model - target) / local scale, over the pixels of
                                         the box that are used; NaN where none is                         */
    double exposure;                  /* brings the 99th percentile of what is used to 0.8                */
    double limit;                     /* of the colours of differences: 98 % lie within, 0.01 to 1        */
    double mean_differences[3];       /* by channel; NaN when no pixel is used                            */
    size_t use_counts[FIT_USE_COUNT]; /* of the picture's own pixels                                     */
};

/*
 * Compare, on at most about pixel_limit pixels (>= 1) and FIT_COMPARISON_SIDE_LIMIT_PX each way. The local
 * scale is the mean target over 7 x 7 pixels round about, as far as they are used, but at least a hundredth
 * of 0.8 / exposure, so that a difference in the dark stays one of little weight.
 * Fails with DIPOLE_OUT_OF_MEMORY; *comparison_out is then NULL.
 */
DIPOLE_CHECKED bool fit_comparison_create(const struct fit_report_picture *picture, size_t pixel_limit,
                                          struct fit_comparison **comparison_out, dipole_status *status);
void fit_comparison_destroy(struct fit_comparison *comparison);

/* The differences of channel 0 to 2, or with -1 the mean of all three, in the colours of
 * fit_difference_color from -limit to limit. */
DIPOLE_CHECKED bool fit_differences_draw(const struct fit_comparison *comparison, int channel,
                                         struct io_image **image_out, dipole_status *status);

#endif
