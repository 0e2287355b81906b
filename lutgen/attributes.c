/* Attributes of table files: written, read, and compared. docs/formats.md lists them. */
#include "lutgen/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- writing ------------------------------------------------------------------------------------ */

void lut_put_text(struct lut_writer *writer, const char *name, const char *text)
{
    writer->is_done = writer->is_done && io_image_set_text(writer->image, name, text);
}

void lut_put_number(struct lut_writer *writer, const char *name, double value)
{
    writer->is_done = writer->is_done && io_image_set_number(writer->image, name, value);
}

void lut_put_numbers(struct lut_writer *writer, const char *name, const double values[3])
{
    writer->is_done = writer->is_done && io_image_set_numbers(writer->image, name, values);
}

void lut_put_json(struct lut_writer *writer, const char *name, json_t *json)
{
    char *const text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    writer->is_done = writer->is_done && text;
    if (text)
        lut_put_text(writer, name, text);
    free(text);
}

void lut_put_material(struct lut_writer *writer, const struct io_material *material)
{
    const dipole_layer(*const layers)[DIPOLE_LAYER_LIMIT] = material->layers;
    lut_put_text(writer, "dipole:material", material->name);
    lut_put_text(writer, "dipole:material_hash", lut_material_hash(material).text);
    lut_put_text(writer, "dipole:model", io_model_names[material->model]);
    lut_put_json(writer, "dipole:material_json", io_material_to_json(material, NULL));
    if (io_material_has_layers(material))
        return;
    double sigma_a[IO_CHANNEL_COUNT], sigma_s_prime[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        sigma_a[c] = layers[c][0].medium.sigma_a_per_mm;
        sigma_s_prime[c] = layers[c][0].medium.sigma_s_prime_per_mm;
    }
    lut_put_numbers(writer, "dipole:sigma_a_per_mm", sigma_a);
    lut_put_numbers(writer, "dipole:sigma_s_prime_per_mm", sigma_s_prime);
    lut_put_number(writer, "dipole:eta", layers[0][0].medium.eta);
}

void lut_put_end(struct lut_writer *writer, const struct lut_request *request)
{
    lut_put_text(writer, "dipole:storage", request->is_half ? "half" : "float");
    const double asked[] = { request->size[0], request->size[1], request->size[2] };
    lut_put_numbers(writer, "dipole:size_asked", asked);
    lut_put_text(writer, "dipole:version", dipole_version());
    lut_put_text(writer, "dipole:input_hash", lut_request_hash(request).text);
    lut_put_text(writer, "dipole:content_hash", lut_content_hash(writer->image).text);
}

/* ---- reading ------------------------------------------------------------------------------------ */

static const struct io_attribute *find(const struct lut_reader *reader, const char *name,
                                       enum io_attribute_kind kind)
{
    const struct io_attribute *const attribute = io_image_find(reader->image, name);
    if (attribute && attribute->kind == kind)
        return attribute;
    static const char *const kinds[] = { "a text", "a number", "three numbers" };
    dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                attribute ? "attribute %s has another type, expected %s" : "no attribute %s, expected %s",
                name, kinds[kind]);
    return NULL;
}

bool lut_get_text(const struct lut_reader *reader, const char *name, const char **text_out)
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_TEXT);
    if (attribute)
        *text_out = attribute->text;
    return attribute != NULL;
}

bool lut_get_choice(const struct lut_reader *reader, const char *name, const char *const *choices, int *out)
{
    const char *text;
    if (!lut_get_text(reader, name, &text))
        return false;
    char expected[128] = "";
    for (int i = 0; choices[i]; i++) {
        if (strcmp(text, choices[i]) == 0) {
            *out = i;
            return true;
        }
        const size_t used = strlen(expected);
        snprintf(expected + used, sizeof expected - used, "%s\"%s\"", i > 0 ? ", " : "", choices[i]);
    }
    return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                       "%s is \"%.64s\", expected one of %s", name, text, expected);
}

static bool check_number(const struct lut_reader *reader, const char *name, double value, double min,
                         double max)
{
    return (value >= min && value <= max) ||
           dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place, "%s is %g, expected %g to %g",
                       name, value, min, max);
}

bool lut_get_number(const struct lut_reader *reader, const char *name, double min, double max, double *out)
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_NUMBER);
    if (!attribute || !check_number(reader, name, attribute->numbers[0], min, max))
        return false;
    *out = attribute->numbers[0];
    return true;
}

bool lut_get_numbers(const struct lut_reader *reader, const char *name, double min, double max,
                     double out[3])
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_NUMBERS);
    for (int i = 0; attribute && i < 3; i++) {
        if (!check_number(reader, name, attribute->numbers[i], min, max))
            return false;
        out[i] = attribute->numbers[i];
    }
    return attribute != NULL;
}

bool lut_get_json(const struct lut_reader *reader, const char *name, struct io_json_document **document_out)
{
    const char *text;
    dipole_status why = { 0 };
    *document_out = NULL;
    return lut_get_text(reader, name, &text) &&
           (io_json_parse(text, strlen(text), name, document_out, &why) ||
            dipole_fail(reader->status, why.code, &reader->place, "%s: %s", name, why.message));
}

bool lut_check_version(const struct lut_reader *reader)
{
    const char *version;
    return lut_get_text(reader, "dipole:version", &version) &&
           (strcmp(version, dipole_version()) == 0 ||
            dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                        "was baked by version %.32s, expected %s: bake it again", version,
                        dipole_version()));
}

bool lut_check_texels(const struct lut_reader *reader, const float *texels, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(texels[i]) || texels[i] < 0)
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                               "texel %zu holds %g, expected a finite value >= 0", i / IO_CHANNEL_COUNT,
                               (double)texels[i]);
    return true;
}

/* ---- comparing ---------------------------------------------------------------------------------- */

static bool is_same(const struct io_attribute *a, const struct io_attribute *b)
{
    if (a->kind != b->kind)
        return false;
    if (a->kind == IO_ATTRIBUTE_TEXT)
        return strcmp(a->text, b->text) == 0;
    const int count = a->kind == IO_ATTRIBUTE_NUMBER ? 1 : 3;
    for (int i = 0; i < count; i++)
        if (a->numbers[i] != b->numbers[i])
            return false;
    return true;
}

/* Only texels that the table does not keep, of a self-test, can be others: the rest was copied. */
static bool check_pixels(const struct lut_reader *reader, const struct io_image *expected)
{
    const size_t count =
        (size_t)expected->width_px * (size_t)expected->height_px * (size_t)expected->channel_count;
    for (size_t i = 0; i < count; i++)
        if (reader->image->pixels[i] != expected->pixels[i])
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                               "texel %zu holds %g, expected %g, of the self-test", i / IO_CHANNEL_COUNT,
                               (double)reader->image->pixels[i], (double)expected->pixels[i]);
    return true;
}

bool lut_check_same(const struct lut_reader *reader, const struct io_image *expected)
{
    for (size_t i = 0; i < expected->attribute_count; i++) {
        const struct io_attribute *const there =
            find(reader, expected->attributes[i].name, expected->attributes[i].kind);
        if (!there)
            return false;
        if (!is_same(there, &expected->attributes[i]))
            return dipole_fail(
                reader->status, DIPOLE_BAD_VALUE, &reader->place,
                "attribute %s does not fit the rest of the file: something in it was changed", there->name);
    }
    return check_pixels(reader, expected);
}
