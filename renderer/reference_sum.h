/* The sum over points of the surface, for every pixel: theory.md T33. */
#ifndef RENDERER_REFERENCE_SUM_H
#define RENDERER_REFERENCE_SUM_H

#include "renderer/environment.h"
#include "renderer/media.h"
#include "renderer/reference_pixel.h"

/* Points of each half that are held at a time. */
enum { RENDER_SUM_CHUNK = 1 << 19 };

struct render_sum;

/* Light from all around; environment NULL: none. A ray_count of 0: nothing stands in its way. */
struct render_sum_sky {
    const struct render_environment *environment;
    int ray_count;
};

/* A pass over the picture. */
struct render_sum_pass {
    size_t point_count; /* of each half, on the whole surface                                       */
    bool is_joined;     /* the mean of both halves is summed, as if it were the first               */
    int step_px;        /* every so manieth pixel across and down; the others are left alone        */
    double least[IO_CHANNEL_COUNT]; /* radiance that is little: its sum may err by RENDER_TREE_ERROR of
                                       this where that is more than of itself                       */
};

/* Fails with DIPOLE_OUT_OF_MEMORY. View, surface, media and sky must outlive the sum. */
DIPOLE_CHECKED bool render_sum_create(const struct render_pixel_view *view,
                                      const struct render_surface *surface,
                                      const struct render_media *media, const struct render_sum_sky *sky,
                                      int thread_count, struct render_sum **sum_out, dipole_status *status);
void render_sum_destroy(struct render_sum *sum);

/*
 * Cut the surface into point_count parts of equal area, twice, with a point at random in each: each time
 * is a half. Find the light that enters at points first .. first + count - 1 (count <= RENDER_SUM_CHUNK) of
 * both, in place of those before. Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_sum_take(struct render_sum *sum, const struct render_sum_pass *pass,
                                    size_t first, size_t count, dipole_status *status);

/* Rows of pixels that are summed together, and how many of them there are. */
int render_sum_band_count(const struct render_sum *sum, const struct render_sum_pass *pass);

/* For each pixel of bands first .. first + count - 1 add its scattered radiance to three values of either
 * half's array, which has all pixels. */
void render_sum_add_bands(struct render_sum *sum, const struct render_sum_pass *pass, int first, int count,
                          double *const halves[2]);

#endif
