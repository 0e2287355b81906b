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
const char *const io_model_names[] = {
    [DIPOLE_MODEL_DIPOLE] = "dipole",       [DIPOLE_MODEL_BETTER_DIPOLE] = "better_dipole",
    [DIPOLE_MODEL_MULTIPOLE] = "multipole", [DIPOLE_MODEL_BEAM] = "beam",
    [DIPOLE_MODEL_MODES] = "modes",         NULL
};

static const char infinite[] = "infinite", layers_key[] = "layers";

/* ---- a medium, of the whole material or of a layer ------------------------------------------------ */

/* Where a medium stands and what it has from elsewhere. */
struct medium_source {
    const struct io_json *at;     /* the object with its coefficients                    */
    const struct io_json *eta_at; /* the object with its eta: the same, or the material   */
    dipole_fdr_kind fdr_kind;
    dipole_model model;     /* that a reflectance is meant for                     */
    bool has_sigma_s;       /* sigma_s_prime is sigma_s (1 - g)                    */
    const char *length_key; /* of the form by reflectance; NULL for the others     */
};

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

/* The model by which a reflectance becomes a medium: in a stack, that of the half-space of each layer,
 * which for the multipole is the dipole. */
static bool find_inverse(const struct medium_source *source, dipole_model *model_out, dipole_status *status)
{
    const struct io_json reflectance = io_json_member(source->at, reflectance_key);
    *model_out = source->model == DIPOLE_MODEL_MULTIPOLE ? DIPOLE_MODEL_DIPOLE : source->model;
    return *model_out == DIPOLE_MODEL_DIPOLE || *model_out == DIPOLE_MODEL_BEAM ||
           io_json_fail(&reflectance, DIPOLE_NOT_SUPPORTED, status,
                        "stands beside the model \"%s\", which has no inverse, expected coefficients, or "
                        "the model \"dipole\", \"multipole\" or \"beam\"",
                        io_model_names[source->model]);
}

/* Say what the library found wrong at the key that it is about, its message beginning with the name of the
 * field, which is the key's. */
static bool fail_at_field(const struct medium_source *source, size_t channel, const dipole_status *found,
                          dipole_status *status)
{
    const char *const keys[] = { "sigma_a_per_mm", "sigma_s_prime_per_mm", reflectance_key,
                                 source->length_key ? source->length_key : reflectance_key };
    for (size_t k = 0; k < sizeof keys / sizeof keys[0]; k++) {
        const size_t length = strlen(keys[k]);
        if (strncmp(found->message, keys[k], length) != 0 || found->message[length] != ' ')
            continue;
        const bool is_product = k == 1 && source->has_sigma_s;
        const struct io_json member = io_json_member(source->at, is_product ? "sigma_s_per_mm" : keys[k]);
        const struct io_json element = io_json_element(&member, channel);
        if (!member.value)
            break;
        return io_json_fail(&element, found->code, status, "%s%s", is_product ? "times (1 - g): " : "",
                            found->message + (is_product ? 0 : length + 1));
    }
    const struct io_json eta = io_json_member(source->eta_at, "eta");
    if (strncmp(found->message, "eta ", 4) == 0)
        return io_json_fail(&eta, found->code, status, "%s", found->message + 4);
    return io_json_fail(source->at, found->code, status, "channel %s: %s", io_channel_names[channel],
                        found->message);
}

/* sigma_a and sigma_s' of each channel from its reflectance and length. */
static bool invert(const struct medium_source *source, double eta, dipole_medium out[IO_CHANNEL_COUNT],
                   dipole_status *status)
{
    double reflectance[IO_CHANNEL_COUNT], length_mm[IO_CHANNEL_COUNT];
    dipole_model model;
    if (!find_inverse(source, &model, status) ||
        !io_json_get_numbers(source->at, reflectance_key, IO_CHANNEL_COUNT, 0.0, 1.0, reflectance,
                             status) ||
        !io_json_get_numbers(source->at, source->length_key, IO_CHANNEL_COUNT, -INFINITY, INFINITY,
                             length_mm, status))
        return false;
    const bool is_diffuse = source->length_key == length_keys[1];
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_status found;
        if (!(is_diffuse ? dipole_medium_from_diffuse_mean_free_path : dipole_medium_from_mean_free_path)(
                reflectance[c], length_mm[c], eta, source->fdr_kind, model, &out[c], &found))
            return fail_at_field(source, c, &found, status);
    }
    return true;
}

static bool get_coefficients(const struct medium_source *source, double eta,
                             dipole_medium out[IO_CHANNEL_COUNT], dipole_status *status)
{
    const struct io_json *const at = source->at;
    const char *const scattering_key = source->has_sigma_s ? "sigma_s_per_mm" : "sigma_s_prime_per_mm";
    double sigma_a_per_mm[IO_CHANNEL_COUNT], sigma_s_per_mm[IO_CHANNEL_COUNT], g[IO_CHANNEL_COUNT] = { 0 };
    if (!io_json_get_numbers(at, "sigma_a_per_mm", IO_CHANNEL_COUNT, -INFINITY, INFINITY, sigma_a_per_mm,
                             status) ||
        !io_json_get_numbers(at, scattering_key, IO_CHANNEL_COUNT, -INFINITY, INFINITY, sigma_s_per_mm,
                             status) ||
        (source->has_sigma_s && !get_g(at, g, status)))
        return false;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++)
        out[c] = (dipole_medium){ .sigma_a_per_mm = sigma_a_per_mm[c],
                                  .sigma_s_prime_per_mm = sigma_s_per_mm[c] * (1.0 - g[c]),
                                  .eta = eta,
                                  .fdr_kind = source->fdr_kind };
    return true;
}

/* Legal, but so far from any material that a unit slip is likelier. */
static void warn_of_units(const struct io_json *at, const dipole_coefficients *coefficients, size_t channel,
                          char *out, size_t size)
{
    const double mean_free_path_mm = coefficients->mean_free_path_mm;
    if (out[0] || (mean_free_path_mm >= 1e-4 && mean_free_path_mm <= 1e4))
        return;
    char layer[32] = "";
    if (at->parent && at->parent->key && strcmp(at->parent->key, layers_key) == 0)
        snprintf(layer, sizeof layer, "layers[%zu], ", at->index);
    snprintf(out, size,
             "%schannel %s: sigma_a_per_mm + sigma_s_prime_per_mm is %.6g, a mean free path of %.6g mm, "
             "expected "
             "0.0001 to 10000 mm; %s",
             layer, io_channel_names[channel], coefficients->sigma_t_prime_per_mm, mean_free_path_mm,
             mean_free_path_mm < 1.0
                 ? "coefficients in 1/m must be divided by 1000 to be in 1/mm, those in 1/cm by 10"
                 : "coefficients in 1/um must be multiplied by 1000 to be in 1/mm");
}

/* The medium that stands at source->at, in all channels; length_key and has_sigma_s are found here. */
static bool read_medium(struct medium_source *source, dipole_medium out[IO_CHANNEL_COUNT], char *warning,
                        size_t warning_size, dipole_status *status)
{
    double eta = 0.0;
    if (!check_form(source->at, &source->length_key, status) ||
        !io_json_get_number(source->eta_at, "eta", -INFINITY, INFINITY, &eta, status))
        return false;
    source->has_sigma_s = io_json_member(source->at, "sigma_s_per_mm").value != NULL;
    if (!(source->length_key ? invert : get_coefficients)(source, eta, out, status))
        return false;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_coefficients derived;
        dipole_status found;
        if (!dipole_coefficients_init(&out[c], &derived, &found))
            return fail_at_field(source, c, &found, status);
        warn_of_units(source->at, &derived, c, warning, warning_size);
    }
    return true;
}

/* ---- the material --------------------------------------------------------------------------------- */

#define MEDIUM_KEYS                                                                                        \
    "sigma_a_per_mm", "sigma_s_prime_per_mm", "sigma_s_per_mm", "g", reflectance_key, length_keys[0],      \
        length_keys[1]

/* Millimetres, or "infinite" in the last layer. Numbers are checked with the stack. */
static bool get_thickness(const struct io_json *layer, bool is_last, double *out, dipole_status *status)
{
    const struct io_json member = io_json_member(layer, "thickness_mm");
    const char *const text = json_string_value(member.value);
    if (!text)
        return io_json_get_number(layer, "thickness_mm", -INFINITY, INFINITY, out, status);
    if (strcmp(text, infinite) != 0)
        return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "is \"%.60s\", expected a number of mm%s",
                            text, is_last ? ", or \"infinite\"" : "");
    *out = INFINITY;
    return is_last || io_json_fail(&member, DIPOLE_BAD_VALUE, status,
                                   "is \"infinite\", expected a number of mm: only the last layer can be");
}

static bool read_layer(const struct io_json *material_at, const struct io_json *at, size_t index,
                       dipole_fdr_kind fdr_kind, struct io_material *material, dipole_status *status)
{
    const char *const known[] = { "thickness_mm", "name", "eta", MEDIUM_KEYS, NULL };
    const struct io_json eta = io_json_member(at, "eta");
    struct medium_source source = {
        .at = at, .eta_at = eta.value ? at : material_at, .fdr_kind = fdr_kind, .model = material->model
    };
    dipole_medium media[IO_CHANNEL_COUNT];
    double thickness_mm = 0.0;
    if (!io_json_check_object(at, known, 1, status) ||
        !io_json_get_text(at, "name", material->layer_names[index], sizeof material->layer_names[index],
                          status) ||
        !get_thickness(at, index + 1 == material->layer_count, &thickness_mm, status))
        return false;
    if (!io_json_member(source.eta_at, "eta").value)
        return io_json_fail(&eta, DIPOLE_BAD_VALUE, status,
                            "is missing, expected it here, or beside layers for all of them");
    if (!read_medium(&source, media, material->warning, sizeof material->warning, status))
        return false;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++)
        material->layers[c][index] = (dipole_layer){ .medium = media[c], .thickness_mm = thickness_mm };
    return true;
}

/* Say what dipole_stack_create found wrong, its message beginning with "layers[i].key" or "layers[i]". */
static bool fail_at_stack(const struct io_json *at, size_t channel, const dipole_status *found,
                          dipole_status *status)
{
    size_t index;
    int length = 0;
    if (sscanf(found->message, "layers[%zu]%n", &index, &length) != 1 || length == 0)
        return io_json_fail(at, found->code, status, "channel %s: %s", io_channel_names[channel],
                            found->message);
    const char *const keys[] = { ".eta ", ".thickness_mm ", " " };
    const char *rest = found->message + length;
    size_t k = 0;
    while (k + 1 < sizeof keys / sizeof keys[0] && strncmp(rest, keys[k], strlen(keys[k])) != 0)
        k++;
    const struct io_json layers = io_json_member(at, layers_key);
    const struct io_json layer = io_json_element(&layers, index);
    const struct io_json member = io_json_member(&layer, k == 0 ? "eta" : "thickness_mm");
    rest += strncmp(rest, keys[k], strlen(keys[k])) == 0 ? strlen(keys[k]) : 0;
    return k < 2 ? io_json_fail(&member, found->code, status, "%s", rest)
                 : io_json_fail(&member, found->code, status, "(channel %s) %s", io_channel_names[channel],
                                rest);
}

static bool check_stacks(const struct io_json *at, const struct io_material *material,
                         dipole_status *status)
{
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_stack *stack = NULL;
        dipole_status found;
        if (!dipole_stack_create(material->layers[c], material->layer_count, material->model,
                                 DIPOLE_FROM_ABOVE, &stack, &found))
            return fail_at_stack(at, c, &found, status);
        dipole_stack_destroy(stack);
    }
    return true;
}

static bool read_layers(const struct io_json *at, dipole_fdr_kind fdr_kind, struct io_material *material,
                        dipole_status *status)
{
    const char *const medium_keys[] = { MEDIUM_KEYS };
    const struct io_json layers = io_json_member(at, layers_key), model = io_json_member(at, "model");
    for (size_t i = 0; i < sizeof medium_keys / sizeof medium_keys[0]; i++) {
        const struct io_json member = io_json_member(at, medium_keys[i]);
        if (member.value)
            return io_json_fail(&member, DIPOLE_BAD_VALUE, status,
                                "stands beside layers, expected either layers or one medium");
    }
    if (material->model == DIPOLE_MODEL_DIPOLE || material->model == DIPOLE_MODEL_BETTER_DIPOLE)
        return io_json_fail(&model, DIPOLE_NOT_SUPPORTED, status,
                            "is \"%s\", which knows only a half-space, expected \"beam\", "
                            "\"modes\" or \"multipole\" beside layers",
                            io_model_names[material->model]);
    if (!io_json_check_array(&layers, 1, DIPOLE_LAYER_LIMIT, &material->layer_count, status))
        return false;
    for (size_t i = 0; i < material->layer_count; i++) {
        const struct io_json layer = io_json_element(&layers, i);
        if (!read_layer(at, &layer, i, fdr_kind, material, status))
            return false;
    }
    return check_stacks(at, material, status);
}

static bool read_homogeneous(const struct io_json *at, dipole_fdr_kind fdr_kind,
                             struct io_material *material, dipole_status *status)
{
    const struct io_json eta = io_json_member(at, "eta");
    struct medium_source source = {
        .at = at, .eta_at = at, .fdr_kind = fdr_kind, .model = material->model
    };
    dipole_medium media[IO_CHANNEL_COUNT];
    if (!eta.value)
        return io_json_fail(&eta, DIPOLE_BAD_VALUE, status, "is missing, it is required here");
    if (!read_medium(&source, media, material->warning, sizeof material->warning, status))
        return false;
    io_material_set_media(material, media);
    return check_stacks(at, material, status);
}

bool io_material_parse(const struct io_json *at, struct io_material *out, dipole_status *status)
{
    const char *const known[] = { "name",     "eta",    "model",  "fdr", MEDIUM_KEYS,
                                  layers_key, "source", "extras", "fit", NULL };
    const bool has_layers = json_object_get(at->value, layers_key) != NULL;
    struct io_material material = { 0 };
    int model = has_layers ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE, fdr_kind = DIPOLE_FDR_EXACT;
    const struct io_json thickness = io_json_member(at, "thickness_mm");
    if (thickness.value)
        return io_json_fail(&thickness, DIPOLE_BAD_VALUE, status,
                            "stands beside the material's name, expected in one of its layers, as in "
                            "\"layers\": [{ \"thickness_mm\": 3, ... }]");
    if (!io_json_check_object(at, known, 1, status) ||
        !io_json_get_text(at, "name", material.name, sizeof material.name, status) ||
        !io_json_get_text(at, "source", material.source, sizeof material.source, status) ||
        !io_json_get_choice(at, "model", io_model_names, &model, status) ||
        !io_json_get_choice(at, "fdr", fdr_names, &fdr_kind, status))
        return false;
    material.model = (dipole_model)model;
    material.is_model_stated = json_object_get(at->value, "model") != NULL;
    if (!(has_layers ? read_layers : read_homogeneous)(at, (dipole_fdr_kind)fdr_kind, &material, status))
        return false;
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

/* ---- what a material is --------------------------------------------------------------------------- */

bool io_material_has_layers(const struct io_material *material)
{
    return material->layer_count != 1 || isfinite(material->layers[0][0].thickness_mm);
}

void io_material_set_media(struct io_material *material, const dipole_medium media[IO_CHANNEL_COUNT])
{
    material->layer_count = 1;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++)
        material->layers[c][0] = (dipole_layer){ .medium = media[c], .thickness_mm = INFINITY };
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

static json_t *numbers_of(const struct io_material *material, size_t layer, bool is_absorption)
{
    double values[IO_CHANNEL_COUNT];
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &material->layers[c][layer].medium;
        values[c] = is_absorption ? medium->sigma_a_per_mm : medium->sigma_s_prime_per_mm;
    }
    return json_pack("[fff]", values[0], values[1], values[2]);
}

static bool has_one_eta(const struct io_material *material)
{
    for (size_t i = 1; i < material->layer_count; i++)
        if (material->layers[0][i].medium.eta != material->layers[0][0].medium.eta)
            return false;
    return true;
}

static json_t *layers_of(const struct io_material *material)
{
    json_t *const layers = json_array();
    for (size_t i = 0; layers && i < material->layer_count; i++) {
        const dipole_layer *const layer = &material->layers[0][i];
        const char *const name = material->layer_names[i];
        json_t *const thickness =
            isinf(layer->thickness_mm) ? json_string(infinite) : json_real(layer->thickness_mm);
        json_t *const eta = has_one_eta(material) ? NULL : json_real(layer->medium.eta);
        json_t *const json =
            json_pack("{s:s*, s:o, s:o*, s:o, s:o}", "name", name[0] ? name : NULL, "thickness_mm",
                      thickness, "eta", eta, "sigma_a_per_mm", numbers_of(material, i, true),
                      "sigma_s_prime_per_mm", numbers_of(material, i, false));
        if (json_array_append_new(layers, json) != 0) {
            json_decref(layers);
            return NULL;
        }
    }
    return layers;
}

/* Add a member whose value may be NULL because it could not be made. */
static bool add(json_t *object, const char *key, json_t *value)
{
    return json_object_set_new(object, key, value) == 0;
}

json_t *io_material_to_json(const struct io_material *material, const json_t *fit)
{
    const bool has_layers = io_material_has_layers(material);
    const dipole_medium *const medium = &material->layers[0][0].medium;
    json_t *const json = json_pack("{s:s, s:s*}", "name", material->name, "source",
                                   material->source[0] ? material->source : NULL);
    const bool done =
        json && (!has_one_eta(material) || add(json, "eta", json_real(medium->eta))) &&
        add(json, "model", json_string(io_model_names[material->model])) &&
        add(json, "fdr", json_string(fdr_names[medium->fdr_kind])) &&
        (has_layers ? add(json, layers_key, layers_of(material))
                    : add(json, "sigma_a_per_mm", numbers_of(material, 0, true)) &&
                          add(json, "sigma_s_prime_per_mm", numbers_of(material, 0, false))) &&
        (!fit || add(json, "fit", json_deep_copy(fit)));
    if (done)
        return json;
    json_decref(json);
    return NULL;
}

bool io_material_write(const char *path, const struct io_material *material, const json_t *fit,
                       dipole_status *status)
{
    json_t *const json = io_material_to_json(material, fit);
    char *const text = json ? io_json_format(json) : NULL;
    json_decref(json);
    const dipole_place place = { .source = path };
    const bool done =
        text ? io_file_write(path, text, strlen(text), status)
             : dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "cannot be written: the material's texts must be UTF-8, its numbers finite");
    free(text);
    return done;
}
