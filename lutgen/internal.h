/* What the .c files of lutgen share. */
#ifndef LUTGEN_INTERNAL_H
#define LUTGEN_INTERNAL_H

#include "lutgen/lut.h"

#include <stdint.h>

/* ---- half (half.c) ------------------------------------------------------------------------------ */

/* Half has 11 significant bits, the largest finite value 65504 and the smallest normal one 2^-14. */
#define LUT_HALF_ROUNDING 0x1p-11

/* The power of two by which values up to max are divided so that the largest lies just below half's limit,
 * which leaves the most range below; 1 for max = 0. */
double lut_half_scale(double max);

/* What every kind asks of a request. */
DIPOLE_CHECKED bool lut_request_check(const struct lut_request *request, dipole_status *status);

/* ---- profiles (profile.c) ----------------------------------------------------------------------- */

/* One channel of a material, as tables hold it. */
struct lut_profile {
    dipole_stack *stack; /* NULL: does not scatter, 0 everywhere                                        */
    double r_max_mm;
    double floor_per_mm2; /* R_d(r_max): errors are relative to no less                                 */
    double mean_free_path_mm; /* the shortest of the layers */
    double shortest_mm;       /* the length below which the profile is flat: the same, or the core's */
    double core_mm, core[3];  /* R_d = core[0] + core[1] t + core[2] t^2 for t = (r/core)^2 < 1; T31     */
};

/* The channels of a material with r_max(epsilon); end them with lut_profiles_end, also after a failure. */
DIPOLE_CHECKED bool lut_profiles_init(const struct io_material *material, double epsilon,
                                      struct lut_profile out[IO_CHANNEL_COUNT], dipole_status *status);
void lut_profiles_end(struct lut_profile profiles[IO_CHANNEL_COUNT]);

/* Fail where float cannot hold a profile with all its digits. */
DIPOLE_CHECKED bool lut_profiles_check_range(const struct lut_profile profiles[IO_CHANNEL_COUNT],
                                             dipole_status *status);

/* R_d at count radii from 0 to whatever, in 1/mm^2. */
void lut_profile_evaluate(const struct lut_profile *profile, const double *r_mm, size_t count,
                          double *values);

/* ---- axis (axis.c) ------------------------------------------------------------------------------ */

enum { AXIS_POINTS = 128 };

/*
 * The axis (without node_count) and falloff for which linear interpolation errs least: an interval of 1/N
 * errs by the value returned over 8 N^2. log_range_limit: log of the largest over the smallest value that
 * storage holds with all its digits.
 */
double lut_axis_find(const struct lut_profile profiles[IO_CHANNEL_COUNT], double log_range_limit,
                     struct lut_axis *axis_out, double *falloff_out);

/* ---- rows of splat tables (splat.c) -------------------------------------------------------------- */

/* Texels of a row whose axis and falloff are set; sets its scale and core. */
DIPOLE_CHECKED bool lut_splat_row_bake(struct lut_splat_row *row,
                                       const struct lut_profile profiles[IO_CHANNEL_COUNT], bool is_half,
                                       float *rgb, dipole_status *status);

/* ---- attributes of files (attributes.c) ---------------------------------------------------------- */

/* Attributes that are being set: the first failure ends the rest. */
struct lut_writer {
    struct io_image *image;
    bool is_done;
};
void lut_put_text(struct lut_writer *writer, const char *name, const char *text);
void lut_put_number(struct lut_writer *writer, const char *name, double value);
void lut_put_numbers(struct lut_writer *writer, const char *name, const double values[3]);
void lut_put_json(struct lut_writer *writer, const char *name, json_t *json); /* takes json; NULL fails */
/* What every kind ends with: storage, version, hashes of the inputs and of all that was set before. */
void lut_put_end(struct lut_writer *writer, const struct lut_request *request);
/* A table's one material. */
void lut_put_material(struct lut_writer *writer, const struct io_material *material);

/* Attributes of a picture that was read, and where failures go. */
struct lut_reader {
    const struct io_image *image;
    dipole_place place;
    dipole_status *status;
};
bool lut_get_text(const struct lut_reader *reader, const char *name, const char **text_out);
/* Which of choices, which end with NULL. */
bool lut_get_choice(const struct lut_reader *reader, const char *name, const char *const *choices,
                    int *out);
bool lut_get_number(const struct lut_reader *reader, const char *name, double min, double max, double *out);
bool lut_get_numbers(const struct lut_reader *reader, const char *name, double min, double max,
                     double out[3]);
/* The JSON of a text; end it with io_json_destroy. */
bool lut_get_json(const struct lut_reader *reader, const char *name,
                  struct io_json_document **document_out);

/* Fail unless this version of the library wrote the file. */
bool lut_check_version(const struct lut_reader *reader);

/* Fail at the first texel that is not finite or below 0. */
bool lut_check_texels(const struct lut_reader *reader, const float *texels, size_t count);

/* Fail unless the file has every attribute that the table would be written with, and the same texels: so
 * that nothing in it was changed without the rest. */
bool lut_check_same(const struct lut_reader *reader, const struct io_image *expected);

/* ---- hashes (hash.c): by io/hash.h ------------------------------------------------------------------- */

void lut_hash_number(uint64_t *hash, double value); /* low byte first on every machine, -0 as 0 */
void lut_hash_material(uint64_t *hash, const struct io_material *material);
struct lut_hash lut_hash_print(uint64_t hash);

/* Of the texels as stored, and of the attributes that are set. */
struct lut_hash lut_content_hash(const struct io_image *image);

/* ---- random numbers ----------------------------------------------------------------------------- */

/* SplitMix64, as a number in 0 <= x < 1. */
double lut_random(uint64_t *state);

/* ---- errors ------------------------------------------------------------------------------------- */

/* Reorders errors (count > 0); NaN counts as infinite. */
struct lut_error lut_error_of(double *errors, size_t count);

#endif
