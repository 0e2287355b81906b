#include "io/material_file.h"

#include "io/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const io_channel_names[IO_CHANNEL_COUNT] = { "R", "G", "B" };

static const char *const fdr_names[] = {
    [DIPOLE_FDR_EXACT] = "exact", [DIPOLE_FDR_POLYNOMIAL] = "polynomial", NULL
};
static const char *const model_names[] = { "dipole", "multipole", "better_dipole", "beam", NULL };

/* The file as it is written: what the media follow from. */
struct coefficients {
    double eta;
    double sigma_a_per_mm[IO_CHANNEL_COUNT];
    double sigma_s_prime_per_mm[IO_CHANNEL_COUNT];
    bool has_sigma_s;       /* sigma_s_prime is sigma_s (1 - g)                  */
    const char *length_key; /* of the form by reflectance; NULL for the others */
    int fdr_kind;
};

/* ---- reading -------------------------------------------------------------------------------------- */

/* Keys and models that the format has and this version has not: not a slip of the user's pen. */
static bool check_supported(const struct io_json *at, dipole_status *status)
{
    const struct io_json layers = io_json_member(at, "layers");
    if (layers.value)
        return io_json_fail(&layers, DIPOLE_NOT_SUPPORTED, status,
                            "is not supported by this version, expected one medium");
    int model = 0;
    if (!io_json_get_choice(at, "model", model_names, &model, status))
        return false;
    const struct io_json member = io_json_member(at, "model");
    return model == 0 || io_json_fail(&member, DIPOLE_NOT_SUPPORTED, status,
                                      "is \"%s\", which this version does not support, expected \"dipole\"",
                                      model_names[model]);
}

static const char reflectance_key[] = "diffuse_reflectance";
static const char *const length_keys[] = { "mean_free_path_mm", "diffuse_mean_free_path_mm" };

/* Reflectance with exactly one of the two lengths, and no coefficient beside. */
static bool check_reflectance_form(const struct io_json *at, const char **length_key_out,
                                   dipole_status *status)
{
    static const char *const others[] = { "sigma_a_per_mm", "sigma_s_prime_per_mm", "sigma_s_per_mm", "g" };
    const struct io_json reflectance = io_json_member(at, reflectance_key);
    const struct io_json lengths[] = { io_json_member(at, length_keys[0]),
                                       io_json_member(at, length_keys[1]) };
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        const struct io_json other = io_json_member(at, others[i]);
        if (other.value)
            return io_json_fail(
                &other, DIPOLE_BAD_VALUE, status,
                "stands beside %s, expected either coefficients or a reflectance with a length",
                reflectance.value  ? reflectance_key
                : lengths[0].value ? length_keys[0]
                                   : length_keys[1]);
    }
    if (!reflectance.value)
        return io_json_fail(&reflectance, DIPOLE_BAD_VALUE, status,
                            "is missing, expected beside a mean free path");
    if (lengths[0].value && lengths[1].value)
        return io_json_fail(
            &lengths[1], DIPOLE_BAD_VALUE, status,
            "stands beside mean_free_path_mm, expected one of them: 1/sigma_t' is the mean free "
            "path, 1/sigma_tr the diffuse one");
    if (!lengths[0].value && !lengths[1].value)
        return io_json_fail(
            &lengths[0], DIPOLE_BAD_VALUE, status,
            "is missing, expected it or diffuse_mean_free_path_mm beside diffuse_reflectance");
    *length_key_out = length_keys[lengths[0].value ? 0 : 1];
    return true;
}

/* Exactly one of the ways to give a medium. */
static bool check_form(const struct io_json *at, const char **length_key_out, dipole_status *status)
{
    if (io_json_member(at, reflectance_key).value || io_json_member(at, length_keys[0]).value ||
        io_json_member(at, length_keys[1]).value)
        return check_reflectance_form(at, length_key_out, status);
    const struct io_json sigma_a = io_json_member(at, "sigma_a_per_mm");
    const struct io_json sigma_s_prime = io_json_member(at, "sigma_s_prime_per_mm");
    const struct io_json sigma_s = io_json_member(at, "sigma_s_per_mm");
    const struct io_json g = io_json_member(at, "g");
    if (!sigma_a.value)
        return io_json_fail(&sigma_a, DIPOLE_BAD_VALUE, status,
                            "is missing, expected the absorption as [R, G, B]");
    if (sigma_s_prime.value && (sigma_s.value || g.value))
        return io_json_fail(
            sigma_s.value ? &sigma_s : &g, DIPOLE_BAD_VALUE, status,
            "stands beside sigma_s_prime_per_mm, expected either that or sigma_s_per_mm and g");
    if (!sigma_s_prime.value && !sigma_s.value && !g.value)
        return io_json_fail(&sigma_s_prime, DIPOLE_BAD_VALUE, status,
                            "is missing, expected it, or sigma_s_per_mm and g");
    if (g.value && !sigma_s.value)
        return io_json_fail(&sigma_s, DIPOLE_BAD_VALUE, status, "is missing, expected beside g");
    if (sigma_s.value && !g.value)
        return io_json_fail(&g, DIPOLE_BAD_VALUE, status, "is missing, expected beside sigma_s_per_mm");
    return true;
}

/* One anisotropy for all channels, or one for each. */
static bool get_g(const struct io_json *at, double g_out[IO_CHANNEL_COUNT], dipole_status *status)
{
    const struct io_json member = io_json_member(at, "g");
    const bool is_array = json_is_array(member.value);
    if (is_array ? !io_json_get_numbers(at, "g", IO_CHANNEL_COUNT, -INFINITY, INFINITY, g_out, status)
                 : !io_json_get_number(at, "g", -INFINITY, INFINITY, g_out, status))
        return false;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct io_json element = io_json_element(&member, c);
        if (!is_array)
            g_out[c] = g_out[0];
        if (!(g_out[c] > -1.0 && g_out[c] < 1.0))
            return io_json_fail(is_array ? &element : &member, DIPOLE_BAD_VALUE, status,
                                "is %.10g, expected more than -1 and less than 1", g_out[c]);
    }
    return true;
}

/* sigma_a and sigma_s' of each channel from its reflectance and length. */
static bool invert(const struct io_json *at, struct coefficients *out, dipole_status *status)
{
    double reflectance[IO_CHANNEL_COUNT], length_mm[IO_CHANNEL_COUNT];
    if (!io_json_get_numbers(at, reflectance_key, IO_CHANNEL_COUNT, 0.0, 1.0, reflectance, status) ||
        !io_json_get_numbers(at, out->length_key, IO_CHANNEL_COUNT, -INFINITY, INFINITY, length_mm, status))
        return false;
    const bool is_diffuse = out->length_key == length_keys[1];
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_medium medium;
        dipole_status found;
        if (!(is_diffuse ? dipole_medium_from_diffuse_mean_free_path : dipole_medium_from_mean_free_path)(
                reflectance[c], length_mm[c], out->eta, (dipole_fdr_kind)out->fdr_kind, DIPOLE_MODEL_DIPOLE,
                &medium, &found)) {
            const char *const keys[] = { reflectance_key, out->length_key, "eta" };
            for (size_t k = 0; k < 3; k++) {
                const size_t length = strlen(keys[k]);
                if (strncmp(found.message, keys[k], length) != 0 || found.message[length] != ' ')
                    continue;
                const struct io_json member = io_json_member(at, keys[k]),
                                     element = io_json_element(&member, c);
                return io_json_fail(k < 2 ? &element : &member, found.code, status, "%s",
                                    found.message + length + 1);
            }
            return io_json_fail(at, found.code, status, "channel %s: %s", io_channel_names[c],
                                found.message);
        }
        out->sigma_a_per_mm[c] = medium.sigma_a_per_mm;
        out->sigma_s_prime_per_mm[c] = medium.sigma_s_prime_per_mm;
    }
    return true;
}

static bool get_coefficients(const struct io_json *at, struct coefficients *out, dipole_status *status)
{
    double sigma_s_per_mm[IO_CHANNEL_COUNT], g[IO_CHANNEL_COUNT];
    out->has_sigma_s = io_json_member(at, "sigma_s_per_mm").value != NULL;
    if (!io_json_get_number(at, "eta", -INFINITY, INFINITY, &out->eta, status) ||
        !io_json_get_choice(at, "fdr", fdr_names, &out->fdr_kind, status))
        return false;
    if (out->length_key)
        return invert(at, out, status);
    if (!io_json_get_numbers(at, "sigma_a_per_mm", IO_CHANNEL_COUNT, -INFINITY, INFINITY,
                             out->sigma_a_per_mm, status))
        return false;
    if (!out->has_sigma_s)
        return io_json_get_numbers(at, "sigma_s_prime_per_mm", IO_CHANNEL_COUNT, -INFINITY, INFINITY,
                                   out->sigma_s_prime_per_mm, status);
    if (!io_json_get_numbers(at, "sigma_s_per_mm", IO_CHANNEL_COUNT, -INFINITY, INFINITY, sigma_s_per_mm,
                             status) ||
        !get_g(at, g, status))
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        out->sigma_s_prime_per_mm[c] = sigma_s_per_mm[c] * (1.0 - g[c]);
    return true;
}

/* Say what dipole_coefficients_init found wrong, at the key that it is about: its messages begin with the
 * name of the field, which is the key's. */
static bool fail_at_medium(const struct io_json *at, const struct coefficients *coefficients,
                           size_t channel, const dipole_status *found, dipole_status *status)
{
    const char *const keys[] = { "sigma_a_per_mm", "sigma_s_prime_per_mm" };
    for (size_t k = 0; k < 2; k++) {
        const size_t length = strlen(keys[k]);
        if (strncmp(found->message, keys[k], length) != 0)
            continue;
        const bool is_product = k == 1 && coefficients->has_sigma_s;
        const struct io_json member = io_json_member(at, is_product ? "sigma_s_per_mm" : keys[k]);
        const struct io_json element = io_json_element(&member, channel);
        return io_json_fail(&element, found->code, status, "%s%s", is_product ? "times (1 - g): " : "",
                            found->message + (is_product ? 0 : length + 1));
    }
    const struct io_json eta = io_json_member(at, "eta");
    if (strncmp(found->message, "eta ", 4) == 0)
        return io_json_fail(&eta, found->code, status, "%s", found->message + 4);
    return io_json_fail(at, found->code, status, "channel %s: %s", io_channel_names[channel],
                        found->message);
}

/* Legal, but so far from any material that a unit slip is likelier. */
static void warn_of_units(const dipole_coefficients *coefficients, size_t channel, char *out, size_t size)
{
    const double mean_free_path_mm = coefficients->mean_free_path_mm;
    if (out[0] || (mean_free_path_mm >= 1e-4 && mean_free_path_mm <= 1e4))
        return;
    snprintf(
        out, size,
        "channel %s: sigma_a_per_mm + sigma_s_prime_per_mm is %.6g, a mean free path of %.6g mm, expected "
        "0.0001 to 10000 mm; %s",
        io_channel_names[channel], coefficients->sigma_t_prime_per_mm, mean_free_path_mm,
        mean_free_path_mm < 1.0
            ? "coefficients in 1/m must be divided by 1000 to be in 1/mm, those in 1/cm by 10"
            : "coefficients in 1/um must be multiplied by 1000 to be in 1/mm");
}

bool io_material_parse(const struct io_json *at, struct io_material *out, dipole_status *status)
{
    const char *const known[] = { "name",
                                  "eta",
                                  "model",
                                  "fdr",
                                  "sigma_a_per_mm",
                                  "sigma_s_prime_per_mm",
                                  "sigma_s_per_mm",
                                  "g",
                                  reflectance_key,
                                  length_keys[0],
                                  length_keys[1],
                                  "source",
                                  "extras",
                                  "fit",
                                  NULL };
    struct coefficients coefficients = { .fdr_kind = DIPOLE_FDR_EXACT };
    struct io_material material = { 0 };
    if ((json_is_object(at->value) && !check_supported(at, status)) ||
        !io_json_check_object(at, known, 2, status) || !check_form(at, &coefficients.length_key, status) ||
        !io_json_get_text(at, "name", material.name, sizeof material.name, status) ||
        !io_json_get_text(at, "source", material.source, sizeof material.source, status) ||
        !get_coefficients(at, &coefficients, status))
        return false;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        material.medium[c] = (dipole_medium){ .sigma_a_per_mm = coefficients.sigma_a_per_mm[c],
                                              .sigma_s_prime_per_mm = coefficients.sigma_s_prime_per_mm[c],
                                              .eta = coefficients.eta,
                                              .fdr_kind = (dipole_fdr_kind)coefficients.fdr_kind };
        dipole_coefficients derived;
        dipole_status found;
        if (!dipole_coefficients_init(&material.medium[c], &derived, &found))
            return fail_at_medium(at, &coefficients, c, &found, status);
        warn_of_units(&derived, c, material.warning, sizeof material.warning);
    }
    *out = material;
    return true;
}

bool io_material_read(const char *path, struct io_material *out, dipole_status *status)
{
    struct io_json_document *document = NULL;
    if (!io_json_read(path, &document, status))
        return false;
    const struct io_json root = io_json_root(document);
    const bool done = io_material_parse(&root, out, status);
    io_json_destroy(document);
    return done;
}

/* ---- bundled materials ---------------------------------------------------------------------------- */

bool io_material_is_bundled_name(const char *text)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    const size_t first = strspn(text, letters);
    if (first == 0 || text[first] == '\0')
        return first > 0;
    const size_t second = text[first] == '/' ? strspn(text + first + 1, letters) : 0;
    return second > 0 && text[first + 1 + second] == '\0';
}

bool io_material_bundled_path(const char *name, char *out, size_t size, dipole_status *status)
{
    char relative[256];
    const int length = snprintf(relative, sizeof relative, "materials/%s.json", name);
    if (!io_material_is_bundled_name(name) || length >= (int)sizeof relative)
        return dipole_fail(status, DIPOLE_NOT_FOUND, NULL, "no bundled material is named %.60s", name);
    return io_data_path(relative, out, size, status);
}

bool io_material_open(const char *name, struct io_material *out, dipole_status *status)
{
    char path[4096];
    dipole_status why = { 0 };
    if (io_material_read(name, out, &why))
        return true;
    if (why.code == DIPOLE_NOT_FOUND && io_material_bundled_path(name, path, sizeof path, NULL))
        return io_material_read(path, out, status);
    if (status)
        *status = why;
    return false;
}

/* ---- writing -------------------------------------------------------------------------------------- */

bool io_material_write(const char *path, const struct io_material *material, const json_t *fit,
                       dipole_status *status)
{
    const dipole_medium *medium = material->medium;
    json_t *json = json_pack(
        "{s:s, s:s*, s:f, s:s, s:s, s:[fff], s:[fff]}", "name", material->name, "source",
        material->source[0] ? material->source : NULL, "eta", medium[0].eta, "model", model_names[0], "fdr",
        fdr_names[medium[0].fdr_kind], "sigma_a_per_mm", medium[0].sigma_a_per_mm, medium[1].sigma_a_per_mm,
        medium[2].sigma_a_per_mm, "sigma_s_prime_per_mm", medium[0].sigma_s_prime_per_mm,
        medium[1].sigma_s_prime_per_mm, medium[2].sigma_s_prime_per_mm);
    if (json && fit && json_object_set_new(json, "fit", json_deep_copy(fit)) != 0) {
        json_decref(json);
        json = NULL;
    }
    char *text = json ? io_json_format(json) : NULL;
    json_decref(json);
    const dipole_place place = { .source = path };
    const bool done =
        text ? io_file_write(path, text, strlen(text), status)
             : dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "cannot be written: the material's texts must be UTF-8, its numbers finite");
    free(text);
    return done;
}
