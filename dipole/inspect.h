/* Everything that follows from a material, as numbers; print.c and figure.c show it. */
#ifndef INSPECT_H
#define INSPECT_H

#include "io/material_file.h"
#include "io/profile_file.h"

enum {
    INSPECTOR_RADIUS_LIMIT = 4096,
    INSPECTOR_CURVE_LIMIT = 4, /* results in a figure: each has a dash of its own */
    INSPECTOR_DATA_LIMIT = 4,  /* tables in a figure: each has a mark of its own  */
};

struct inspector_channel {
    const char *name;
    dipole_coefficients coefficients; /* of the top layer                                       */
    dipole_stack *stack;              /* NULL for the classical dipole, which has its own functions */
    double diffuse_mean_free_path_mm; /* 1 / sigma_tr of the top layer; infinite without absorption */
    double diffuse_reflectance;       /* by the face that is lit                                */
    double diffuse_transmittance;     /* by the other; 0 of a half-space, as the next           */
    double unscattered_transmittance;
    double unscattered_reflectance;    /* mirrored at interfaces inside                          */
    double r_max_mm, splat_spacing_mm; /* at the epsilon asked, of the face that is lit          */
};

struct inspector_result {
    struct io_material material;
    dipole_side side;
    double epsilon;
    struct inspector_channel channels[IO_CHANNEL_COUNT];
    double radii_mm[INSPECTOR_RADIUS_LIMIT]; /* where the profile is printed */
    size_t radius_count;
};

/*
 * Derive all numbers of result->material, lit from result->side, at result->epsilon. When radius_count is
 * 0, radii are chosen: 0, then 1, 2, 5 per decade, from a tenth of the smallest mean free path or just
 * below to the largest r_max or just above. End the result with inspector_result_end, whether this fails or
 * not.
 */
DIPOLE_CHECKED bool inspector_result_derive(struct inspector_result *result, dipole_status *status);

/* Free what result owns, not result itself. */
void inspector_result_end(struct inspector_result *result);

/* Is there a far face, by which light can leave? */
bool inspector_has_far_face(const struct inspector_result *result);

/* What was derived from a layer, counted from the top. */
const dipole_coefficients *inspector_layer(const struct inspector_channel *channel, size_t index);

/* Profiles of the face that is lit and of the other. */
double inspector_rd_per_mm2(const struct inspector_channel *channel, double r_mm);
double inspector_td_per_mm2(const struct inspector_channel *channel, double r_mm);

/* Tables for people: channels as rows, or layers and channels, units under the names. */
void inspector_result_print(const struct inspector_result *result);

/* One result as a JSON object, several as { "materials": [...] }; numbers with as few digits as give them
 * back. The caller frees it. */
DIPOLE_CHECKED bool inspector_results_format_json(const struct inspector_result *results, size_t count,
                                                  char **text_out, dipole_status *status);

/* A table to draw beside the curves. */
struct inspector_data {
    const char *label;
    const struct io_profile *profile;
};

struct inspector_figure {
    const struct inspector_result *results; /* 1 to INSPECTOR_CURVE_LIMIT */
    size_t result_count;
    const struct inspector_data *data; /* at most INSPECTOR_DATA_LIMIT */
    size_t data_count;
    bool is_per_incident; /* the data: divided by 1 - Rsp of the first result's lit face */
};

/* Draw the profiles of all channels, as SVG, or PNG when is_png; of one result with mean free paths and
 * r_max. The caller frees. */
DIPOLE_CHECKED bool inspector_figure_draw(const struct inspector_figure *request, bool is_png,
                                          void **data_out, size_t *size_out, dipole_status *status);

/* "better dipole": a model for people. */
const char *inspector_model_name(dipole_model model);

#endif
