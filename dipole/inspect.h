/* Everything that follows from a material, as numbers; print.c and figure.c show it. */
#ifndef INSPECT_H
#define INSPECT_H

#include "io/material_file.h"

enum { INSPECTOR_RADIUS_LIMIT = 4096 };

struct inspector_channel {
    const char *name;
    dipole_coefficients coefficients;
    double diffuse_mean_free_path_mm; /* 1 / sigma_tr; infinite without absorption */
    double diffuse_reflectance;
    double r_max_mm, splat_spacing_mm; /* at the epsilon asked */
};

struct inspector_result {
    struct io_material material;
    double epsilon;
    struct inspector_channel channels[IO_CHANNEL_COUNT];
    double radii_mm[INSPECTOR_RADIUS_LIMIT]; /* where the profile is printed */
    size_t radius_count;
};

/*
 * Derive all numbers of result->material at result->epsilon. When radius_count is 0, radii are chosen: 0,
 * then 1, 2, 5 per decade, from a tenth of the smallest mean free path or just below to the largest r_max
 * or just above.
 */
DIPOLE_CHECKED bool inspector_result_derive(struct inspector_result *result, dipole_status *status);

/* A table for people: channels as rows, units under the names. */
void inspector_result_print(const struct inspector_result *result);

/* The result as one JSON object, 17 significant digits; the caller frees it. */
DIPOLE_CHECKED bool inspector_result_format_json(const struct inspector_result *result, char **text_out,
                                                 dipole_status *status);

/* Draw R_d(r) of all channels with mean free paths and r_max, as SVG, or PNG when is_png; the caller frees.
 */
DIPOLE_CHECKED bool inspector_result_draw(const struct inspector_result *result, bool is_png,
                                          void **data_out, size_t *size_out, dipole_status *status);

#endif
