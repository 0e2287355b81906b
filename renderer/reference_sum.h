/* The sum over samples of the surface, for every pixel: theory.md T33. */
#ifndef RENDERER_REFERENCE_SUM_H
#define RENDERER_REFERENCE_SUM_H

#include "renderer/reference_pixel.h"

/* Cells of each half that are held at a time. */
enum { RENDER_SUM_CHUNK = 8192 };

struct render_sum;

/* Fails with DIPOLE_OUT_OF_MEMORY. View and surface must outlive the sum. */
DIPOLE_CHECKED bool render_sum_create(const struct render_pixel_view *view,
                                      const struct render_surface *surface, int thread_count,
                                      struct render_sum **sum_out, dipole_status *status);
void render_sum_destroy(struct render_sum *sum);

/* Cut the surface into cell_count cells, in two ways: each is a half. Take cells first .. first + count - 1
 * (count <= RENDER_SUM_CHUNK) of both in place of those before, and find the light that enters them. */
void render_sum_take(struct render_sum *sum, size_t cell_count, size_t first, size_t count);

/* For each pixel of these rows add its scattered radiance to three values of either half's array. */
void render_sum_add_rows(struct render_sum *sum, int first_row, int row_count, double *const halves[2]);

#endif
