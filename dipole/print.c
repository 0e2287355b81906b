#include "dipole/inspect.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- for people --------------------------------------------------------------------------------- */

/* One column of a table: the name, which is the name in JSON as well, and the unit below it. */
struct column {
    const char *name, *unit;
    double (*value)(const struct inspector_channel *channel);
};

static double sigma_a(const struct inspector_channel *channel)
{
    return channel->coefficients.sigma_a_per_mm;
}
static double sigma_s_prime(const struct inspector_channel *channel)
{
    return channel->coefficients.sigma_s_prime_per_mm;
}
static double alpha_prime(const struct inspector_channel *channel)
{
    return channel->coefficients.alpha_prime;
}
static double sigma_tr(const struct inspector_channel *channel)
{
    return channel->coefficients.sigma_tr_per_mm;
}
static double diffuse_reflectance(const struct inspector_channel *channel)
{
    return channel->diffuse_reflectance;
}
static double mean_free_path(const struct inspector_channel *channel)
{
    return channel->coefficients.mean_free_path_mm;
}
static double diffuse_mean_free_path(const struct inspector_channel *channel)
{
    return channel->diffuse_mean_free_path_mm;
}
static double fdr(const struct inspector_channel *channel)
{
    return channel->coefficients.fdr;
}
static double z_r(const struct inspector_channel *channel)
{
    return channel->coefficients.z_r_mm;
}
static double z_v(const struct inspector_channel *channel)
{
    return channel->coefficients.z_v_mm;
}
static double r_max(const struct inspector_channel *channel)
{
    return channel->r_max_mm;
}
static double splat_spacing(const struct inspector_channel *channel)
{
    return channel->splat_spacing_mm;
}

/* Widest of the names and of "-1.23457e-100". */
static int column_width(const struct column *column)
{
    const int width = snprintf(NULL, 0, "%s", column->name);
    return width > 12 ? width : 12;
}

static void print_columns(const struct inspector_result *result, const struct column *columns, size_t count)
{
    printf("\n%-7s", "channel");
    for (size_t i = 0; i < count; i++)
        printf("  %*s", column_width(&columns[i]), columns[i].name);
    printf("\n%-7s", "");
    for (size_t i = 0; i < count; i++)
        printf("  %*s", column_width(&columns[i]), columns[i].unit);
    printf("\n");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        printf("%-7s", result->channels[c].name);
        for (size_t i = 0; i < count; i++)
            printf("  %*.6g", column_width(&columns[i]), columns[i].value(&result->channels[c]));
        printf("\n");
    }
}

#define COUNT(array) (sizeof(array) / sizeof *(array))

void inspector_result_print(const struct inspector_result *result)
{
    static const struct column medium[] = { { "sigma_a", "1/mm", sigma_a },
                                            { "sigma_s_prime", "1/mm", sigma_s_prime },
                                            { "alpha_prime", "1", alpha_prime },
                                            { "sigma_tr", "1/mm", sigma_tr },
                                            { "fdr", "1", fdr } };
    static const struct column lengths[] = { { "mean_free_path", "mm", mean_free_path },
                                             { "diffuse_mean_free_path", "mm", diffuse_mean_free_path },
                                             { "z_r", "mm", z_r },
                                             { "z_v", "mm", z_v } };
    static const struct column light[] = { { "diffuse_reflectance", "1", diffuse_reflectance },
                                           { "r_max", "mm", r_max },
                                           { "splat_spacing", "mm", splat_spacing } };

    const dipole_medium *const first = &result->material.layers[0][0].medium;
    printf("%s\n", result->material.name);
    if (result->material.source[0])
        printf("%s\n", result->material.source);
    printf("dipole model, eta %.6g, fdr %s, epsilon %.6g\n", first->eta,
           first->fdr_kind == DIPOLE_FDR_EXACT ? "exact" : "by polynomial", result->epsilon);
    print_columns(result, medium, COUNT(medium));
    print_columns(result, lengths, COUNT(lengths));
    print_columns(result, light, COUNT(light));

    printf("\n%12s", "r");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        printf("  %10s %s", "rd", result->channels[c].name);
    printf("\n%12s", "mm");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        printf("  %12s", "1/mm^2");
    printf("\n");
    for (size_t i = 0; i < result->radius_count; i++) {
        printf("%12.6g", result->radii_mm[i]);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            printf("  %12.6g", dipole_rd_per_mm2(&result->channels[c].coefficients, result->radii_mm[i]));
        printf("\n");
    }
}

/* ---- for programs ------------------------------------------------------------------------------- */

/* JSON has no infinity: a length that does not end is null. */
static json_t *real_or_null(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *profile_to_json(const struct inspector_result *result,
                               const struct inspector_channel *channel)
{
    json_t *const profile = json_array();
    for (size_t i = 0; i < result->radius_count; i++) {
        const double r_mm = result->radii_mm[i];
        json_t *const point = json_pack("{s:f, s:f}", "r_mm", r_mm, "rd_per_mm2",
                                        dipole_rd_per_mm2(&channel->coefficients, r_mm));
        if (json_array_append_new(profile, point) != 0) {
            json_decref(profile);
            return NULL;
        }
    }
    return profile;
}

static json_t *channel_to_json(const struct inspector_result *result,
                               const struct inspector_channel *channel)
{
    const dipole_coefficients *const c = &channel->coefficients;
    /* A half-space lets nothing through: both transmittances are 0. */
    return json_pack("{s:s, s:f, s:f, s:f, s:f, s:f, s:o, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:o}",
                     "channel", channel->name, "sigma_a_per_mm", c->sigma_a_per_mm, "sigma_s_prime_per_mm",
                     c->sigma_s_prime_per_mm, "alpha_prime", c->alpha_prime, "mean_free_path_mm",
                     c->mean_free_path_mm, "sigma_tr_per_mm", c->sigma_tr_per_mm,
                     "diffuse_mean_free_path_mm", real_or_null(channel->diffuse_mean_free_path_mm), "fdr",
                     c->fdr, "z_r_mm", c->z_r_mm, "z_v_mm", c->z_v_mm, "diffuse_reflectance",
                     channel->diffuse_reflectance, "diffuse_transmittance", 0.0,
                     "unscattered_transmittance", 0.0, "r_max_mm", channel->r_max_mm, "splat_spacing_mm",
                     channel->splat_spacing_mm, "profile", profile_to_json(result, channel));
}

bool inspector_result_format_json(const struct inspector_result *result, char **text_out,
                                  dipole_status *status)
{
    json_t *const channels = json_array();
    bool is_done = channels != NULL;
    for (int c = 0; c < IO_CHANNEL_COUNT && is_done; c++)
        is_done = json_array_append_new(channels, channel_to_json(result, &result->channels[c])) == 0;
    json_t *const root =
        is_done ? json_pack("{s:s, s:f, s:f, s:O}", "material", result->material.name, "epsilon",
                            result->epsilon, "eta", result->material.layers[0][0].medium.eta, "channels", channels)
                : NULL;
    *text_out = root ? io_json_format(root) : NULL;
    json_decref(root);
    json_decref(channels);
    return *text_out || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the result");
}
