#include "dipole/inspect.h"
#include "io/json.h"

#include <stdio.h>
#include <stdlib.h>

/* ---- for people --------------------------------------------------------------------------------- */

/* One column of a table: the name, which is the name in JSON as well, and the unit below it. */
struct column {
    const char *name, *unit;
    double (*value)(const struct inspector_channel *channel, size_t layer);
};

static double sigma_a(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->sigma_a_per_mm;
}
static double sigma_s_prime(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->sigma_s_prime_per_mm;
}
static double alpha_prime(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->alpha_prime;
}
static double sigma_tr(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->sigma_tr_per_mm;
}
static double mean_free_path(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->mean_free_path_mm;
}
static double diffuse_mean_free_path(const struct inspector_channel *channel, size_t layer)
{
    return 1 / inspector_layer(channel, layer)->sigma_tr_per_mm;
}
static double fdr(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->fdr;
}
static double z_r(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->z_r_mm;
}
static double z_v(const struct inspector_channel *channel, size_t layer)
{
    return inspector_layer(channel, layer)->z_v_mm;
}
static double diffuse_reflectance(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->diffuse_reflectance;
}
static double diffuse_transmittance(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->diffuse_transmittance;
}
static double unscattered_reflectance(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->unscattered_reflectance;
}
static double unscattered_transmittance(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->unscattered_transmittance;
}
static double r_max(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->r_max_mm;
}
static double splat_spacing(const struct inspector_channel *channel, size_t layer)
{
    (void)layer;
    return channel->splat_spacing_mm;
}

static const struct column layer_columns[] = { { "sigma_a", "1/mm", sigma_a },
                                               { "sigma_s_prime", "1/mm", sigma_s_prime },
                                               { "alpha_prime", "1", alpha_prime },
                                               { "sigma_tr", "1/mm", sigma_tr },
                                               { "mean_free_path", "mm", mean_free_path } };
static const struct column medium_columns[] = { { "sigma_a", "1/mm", sigma_a },
                                                { "sigma_s_prime", "1/mm", sigma_s_prime },
                                                { "alpha_prime", "1", alpha_prime },
                                                { "sigma_tr", "1/mm", sigma_tr },
                                                { "fdr", "1", fdr } };
static const struct column length_columns[] = { { "mean_free_path", "mm", mean_free_path },
                                                { "diffuse_mean_free_path", "mm", diffuse_mean_free_path },
                                                { "z_r", "mm", z_r },
                                                { "z_v", "mm", z_v } };
static const struct column light_columns[] = { { "diffuse_reflectance", "1", diffuse_reflectance },
                                               { "r_max", "mm", r_max },
                                               { "splat_spacing", "mm", splat_spacing } };
static const struct column passing_columns[] = {
    { "diffuse_transmittance", "1", diffuse_transmittance },
    { "unscattered_transmittance", "1", unscattered_transmittance },
    { "unscattered_reflectance", "1", unscattered_reflectance }
};

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* Widest of the names and of "-1.23457e-100". */
static int column_width(const struct column *column)
{
    const int width = snprintf(NULL, 0, "%s", column->name);
    return width > 12 ? width : 12;
}

static void print_heads(const struct column *columns, size_t count, bool is_unit)
{
    for (size_t i = 0; i < count; i++)
        printf("  %*s", column_width(&columns[i]), is_unit ? columns[i].unit : columns[i].name);
}

static void print_values(const struct inspector_channel *channel, size_t layer,
                         const struct column *columns, size_t count)
{
    for (size_t i = 0; i < count; i++)
        printf("  %*.6g", column_width(&columns[i]), columns[i].value(channel, layer));
}

static void print_columns(const struct inspector_result *result, const struct column *columns, size_t count)
{
    printf("\n%-7s", "channel");
    print_heads(columns, count, false);
    printf("\n%-7s", "");
    print_heads(columns, count, true);
    printf("\n");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        printf("%-7s", result->channels[c].name);
        print_values(&result->channels[c], 0, columns, count);
        printf("\n");
    }
}

static bool has_layer_names(const struct io_material *material)
{
    for (size_t i = 0; i < material->layer_count; i++)
        if (material->layer_names[i][0])
            return true;
    return false;
}

/* Every layer in every channel, from the top; names come last, for they may be long. */
static void print_layers(const struct inspector_result *result)
{
    const struct io_material *const material = &result->material;
    printf("\n%-5s  %12s  %8s  %-7s", "layer", "thickness", "eta", "channel");
    print_heads(layer_columns, COUNT(layer_columns), false);
    printf(has_layer_names(material) ? "  name\n" : "\n");
    printf("%-5s  %12s  %8s  %-7s", "", "mm", "1", "");
    print_heads(layer_columns, COUNT(layer_columns), true);
    printf("\n");
    for (size_t i = 0; i < material->layer_count; i++)
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const dipole_layer *const layer = &material->layers[c][i];
            printf("%-5zu  %12.6g  %8.6g  %-7s", i + 1, layer->thickness_mm, layer->medium.eta,
                   result->channels[c].name);
            print_values(&result->channels[c], i, layer_columns, COUNT(layer_columns));
            printf("%s%s\n", material->layer_names[i][0] ? "  " : "", material->layer_names[i]);
        }
}

static void print_profile(const struct inspector_result *result)
{
    const int face_count = inspector_has_far_face(result) ? 2 : 1;
    printf("\n%12s", "r");
    for (int i = 0; i < face_count * IO_CHANNEL_COUNT; i++)
        printf("  %10s %s", i < IO_CHANNEL_COUNT ? "rd" : "td",
               result->channels[i % IO_CHANNEL_COUNT].name);
    printf("\n%12s", "mm");
    for (int i = 0; i < face_count * IO_CHANNEL_COUNT; i++)
        printf("  %12s", "1/mm^2");
    printf("\n");
    for (size_t k = 0; k < result->radius_count; k++) {
        printf("%12.6g", result->radii_mm[k]);
        for (int i = 0; i < face_count * IO_CHANNEL_COUNT; i++)
            printf("  %12.6g", (i < IO_CHANNEL_COUNT ? inspector_rd_per_mm2 : inspector_td_per_mm2)(
                                   &result->channels[i % IO_CHANNEL_COUNT], result->radii_mm[k]));
        printf("\n");
    }
}

void inspector_result_print(const struct inspector_result *result)
{
    const struct io_material *const material = &result->material;
    const dipole_medium *const first = &material->layers[0][0].medium;
    const bool has_layers = io_material_has_layers(material), has_far_face = inspector_has_far_face(result);
    printf("%s\n", material->name);
    if (material->source[0])
        printf("%s\n", material->source);
    printf("%s model, ", inspector_model_name(material->model));
    if (!has_layers)
        printf("eta %.6g, ", first->eta);
    printf("fdr %s, ", first->fdr_kind == DIPOLE_FDR_EXACT ? "exact" : "by polynomial");
    if (has_far_face)
        printf("lit from %s, ", result->side == DIPOLE_FROM_ABOVE ? "above" : "below");
    printf("epsilon %.6g\n", result->epsilon);
    if (has_layers) {
        print_layers(result);
    } else {
        print_columns(result, medium_columns, COUNT(medium_columns));
        print_columns(result, length_columns, COUNT(length_columns));
    }
    print_columns(result, light_columns, COUNT(light_columns));
    if (has_layers)
        print_columns(result, passing_columns, COUNT(passing_columns));
    print_profile(result);
}

/* ---- for programs ------------------------------------------------------------------------------- */

/* Append a value that may be NULL because it could not be made. */
static bool append(json_t *array, json_t *value)
{
    return json_array_append_new(array, value) == 0;
}

static json_t *profile_to_json(const struct inspector_result *result,
                               const struct inspector_channel *channel)
{
    const bool has_far_face = inspector_has_far_face(result);
    json_t *const profile = json_array();
    for (size_t i = 0; i < result->radius_count; i++) {
        const double r_mm = result->radii_mm[i];
        json_t *const td = has_far_face ? json_real(inspector_td_per_mm2(channel, r_mm)) : NULL;
        if (!append(profile, json_pack("{s:f, s:f, s:o*}", "r_mm", r_mm, "rd_per_mm2",
                                       inspector_rd_per_mm2(channel, r_mm), "td_per_mm2", td))) {
            json_decref(profile);
            return NULL;
        }
    }
    return profile;
}

static json_t *layers_to_json(const struct inspector_result *result,
                              const struct inspector_channel *channel)
{
    const struct io_material *const material = &result->material;
    json_t *const layers = json_array();
    for (size_t i = 0; i < material->layer_count; i++) {
        const dipole_coefficients *const c = inspector_layer(channel, i);
        const char *const name = material->layer_names[i];
        if (!append(layers, json_pack("{s:s*, s:o, s:f, s:f, s:f, s:f, s:f, s:f, s:o, s:f}", "name",
                                      name[0] ? name : NULL, "thickness_mm",
                                      io_json_number(material->layers[0][i].thickness_mm), "eta", c->eta,
                                      "sigma_a_per_mm", c->sigma_a_per_mm, "sigma_s_prime_per_mm",
                                      c->sigma_s_prime_per_mm, "alpha_prime", c->alpha_prime,
                                      "mean_free_path_mm", c->mean_free_path_mm, "sigma_tr_per_mm",
                                      c->sigma_tr_per_mm, "diffuse_mean_free_path_mm",
                                      io_json_number(1 / c->sigma_tr_per_mm), "fdr", c->fdr))) {
            json_decref(layers);
            return NULL;
        }
    }
    return layers;
}

static json_t *channel_to_json(const struct inspector_result *result,
                               const struct inspector_channel *channel)
{
    const dipole_coefficients *const c = &channel->coefficients;
    json_t *const layers =
        io_material_has_layers(&result->material) ? layers_to_json(result, channel) : NULL;
    return json_pack(
        "{s:s, s:f, s:f, s:f, s:f, s:f, s:o, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:o, s:o, "
        "s:o*, s:o}",
        "channel", channel->name, "sigma_a_per_mm", c->sigma_a_per_mm, "sigma_s_prime_per_mm",
        c->sigma_s_prime_per_mm, "alpha_prime", c->alpha_prime, "mean_free_path_mm", c->mean_free_path_mm,
        "sigma_tr_per_mm", c->sigma_tr_per_mm, "diffuse_mean_free_path_mm",
        io_json_number(channel->diffuse_mean_free_path_mm), "fdr", c->fdr, "z_r_mm", c->z_r_mm, "z_v_mm",
        c->z_v_mm, "diffuse_reflectance", channel->diffuse_reflectance, "diffuse_transmittance",
        channel->diffuse_transmittance, "unscattered_transmittance", channel->unscattered_transmittance,
        "unscattered_reflectance", channel->unscattered_reflectance, "r_max_mm",
        io_json_number(channel->r_max_mm), "splat_spacing_mm", io_json_number(channel->splat_spacing_mm),
        "layers", layers, "profile", profile_to_json(result, channel));
}

static json_t *result_to_json(const struct inspector_result *result)
{
    json_t *const channels = json_array();
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (!append(channels, channel_to_json(result, &result->channels[c]))) {
            json_decref(channels);
            return NULL;
        }
    return json_pack("{s:s, s:s, s:s, s:f, s:f, s:o}", "material", result->material.name, "model",
                     io_model_names[result->material.model], "lit_from",
                     result->side == DIPOLE_FROM_ABOVE ? "above" : "below", "epsilon", result->epsilon,
                     "eta", result->material.layers[0][0].medium.eta, "channels", channels);
}

bool inspector_results_format_json(const struct inspector_result *results, size_t count, char **text_out,
                                   dipole_status *status)
{
    json_t *const materials = json_array();
    bool is_done = materials != NULL;
    for (size_t i = 0; i < count && is_done; i++)
        is_done = append(materials, result_to_json(&results[i]));
    json_t *const several = is_done ? json_pack("{s:O}", "materials", materials) : NULL;
    json_t *const root = is_done && count == 1 ? json_array_get(materials, 0) : several;
    *text_out = root ? io_json_format(root) : NULL;
    json_decref(several);
    json_decref(materials);
    return *text_out || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the result");
}
