#include "fit/blur.h"

#include "renderer/footprint.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum {
    STENCIL = 6,
    NODES_PER_FOLD = 6, /* below the first row's distance: nodes to a factor of e                        */
};

/* In standard deviations: where the kernel ends; and beyond what distance it changes nothing. */
static const double kernel_reach = 10, table_reach = 32;
/* The disc at the middle that is left out: 1e-5 of the light of a profile that ends as 1/r, 1e-9 of one
 * that ends as a logarithm. */
static const double innermost = 1e-5;
/* Step of the quadrature in s / blur, and in log s where that is finer. */
static const double ring_step = 0.125, ring_log_step = 0.1;

/* Lagrange weights in log r. first: of STENCIL nodes. */
static size_t interpolation(const double *node_r_mm, size_t node_count, double r_mm,
                            double weights[STENCIL])
{
    size_t low = 0, high = node_count - 1;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        *(node_r_mm[middle] <= r_mm ? &low : &high) = middle;
    }
    size_t first = low > STENCIL / 2 - 1 ? low - (STENCIL / 2 - 1) : 0;
    if (first + STENCIL > node_count)
        first = node_count - STENCIL;
    for (size_t k = 0; k < STENCIL; k++) {
        weights[k] = 1;
        for (size_t m = 0; m < STENCIL; m++) {
            if (m != k)
                weights[k] *=
                    log(r_mm / node_r_mm[first + m]) / log(node_r_mm[first + k] / node_r_mm[first + m]);
        }
    }
    return first;
}

/* Rings of equal steps in s where s is large, and in log s next to 0. */
static void fill_row(struct fit_blur *blur, double blur_mm, double r_mm, double *row)
{
    const struct render_footprint_kernel kernel = { .blur_mm = blur_mm };
    const double last_mm = r_mm + kernel_reach * blur_mm;
    double s_mm = fmax(r_mm - kernel_reach * blur_mm, blur->node_r_mm[0]);
    while (s_mm < last_mm) {
        const double width_mm = fmin(ring_step * blur_mm, ring_log_step * s_mm);
        /* Gauss's rule of two points: exact to the third power within the ring */
        for (int point = 0; point < 2; point++) {
            const double at_mm = s_mm + width_mm * (point == 0 ? 0.21132486540518712 : 0.78867513459481288);
            const double power =
                2 * PI * at_mm * 0.5 * width_mm * render_footprint_kernel_per_mm2(&kernel, r_mm, at_mm);
            double weights[STENCIL];
            const size_t first = interpolation(blur->node_r_mm, blur->node_count, at_mm, weights);
            for (size_t k = 0; k < STENCIL; k++)
                row[first + k] += power * weights[k];
        }
        s_mm += width_mm;
    }
}

bool fit_blur_create(const double *row_r_mm, size_t row_count, double blur_mm, double finest_mm,
                     struct fit_blur **blur_out, dipole_status *status)
{
    *blur_out = NULL;
    /* nodes: the rows' own, which are about as dense as the profile needs, and more next to 0 */
    const double first_mm = row_r_mm[1], innermost_mm = innermost * finest_mm;
    const double folds = fmax(log(first_mm / innermost_mm), 0);
    const size_t inner_count = (size_t)ceil(folds * NODES_PER_FOLD);
    const size_t node_count = inner_count + row_count - 1;
    struct fit_blur *const blur =
        node_count < STENCIL ? NULL
                             : calloc(1, sizeof *blur + node_count * (row_count + 1) * sizeof(double));
    if (!blur)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a blur of %zu rows",
                           row_count);
    *blur = (struct fit_blur){ .row_count = row_count, .node_count = node_count };
    blur->node_r_mm = (double *)(void *)(blur + 1);
    blur->matrix = blur->node_r_mm + node_count;
    for (size_t k = 0; k < inner_count; k++)
        blur->node_r_mm[k] = innermost_mm * exp(folds * (double)k / (double)inner_count);
    for (size_t k = 1; k < row_count; k++)
        blur->node_r_mm[inner_count + k - 1] = row_r_mm[k];
    for (size_t i = 0; i < row_count; i++) {
        double *const row = blur->matrix + i * node_count;
        if (row_r_mm[i] > table_reach * blur_mm)
            row[inner_count + i - 1] = 1;
        else
            fill_row(blur, blur_mm, row_r_mm[i], row);
    }
    *blur_out = blur;
    return true;
}
