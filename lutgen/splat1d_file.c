/* The splat table as an EXR file: one row of texels, everything else in attributes. */
#include "lutgen/internal.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char axis_mapping[] = "u = log(1 + (r/scale_mm)^2) / log(1 + (r_max_mm/scale_mm)^2); "
                                   "texel i of size has its centre at u = i/(size - 1); linear between";

static const char *const fdr_names[] = { "exact", "polynomial" };

static dipole_place place_of(const char *path)
{
    return (dipole_place){ .source = path };
}

/* ---- what the inputs were ----------------------------------------------------------------------- */

/* FNV-1a, 64 bit. */
static void hash_bytes(uint64_t *hash, const void *data, size_t size)
{
    const unsigned char *const bytes = data;
    for (size_t i = 0; i < size; i++)
        *hash = (*hash ^ bytes[i]) * UINT64_C(0x100000001b3);
}

static void hash_text(uint64_t *hash, const char *text)
{
    hash_bytes(hash, text, strlen(text) + 1);
}

/* Low byte first on every machine, and -0 as 0. */
static void hash_number(uint64_t *hash, double value)
{
    uint64_t bits;
    value += 0.0;
    memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 8; i++) {
        const unsigned char byte = (unsigned char)(bits >> (8 * i));
        hash_bytes(hash, &byte, 1);
    }
}

/* Of all that decides the bytes of the file: kind, version, storage, material, epsilon. */
static void input_hash(const struct lut_splat1d *lut, const char *version, bool is_half, char out[17])
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    hash_text(&hash, "splat1d");
    hash_text(&hash, version);
    hash_text(&hash, is_half ? "half" : "float");
    hash_text(&hash, "dipole");
    hash_text(&hash, lut->material.name);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &lut->material.layers[c][0].medium;
        hash_number(&hash, medium->sigma_a_per_mm);
        hash_number(&hash, medium->sigma_s_prime_per_mm);
        hash_number(&hash, medium->eta);
        hash_text(&hash, fdr_names[medium->fdr_kind]);
    }
    hash_number(&hash, lut->epsilon);
    snprintf(out, 17, "%016" PRIx64, hash);
}

/* ---- write -------------------------------------------------------------------------------------- */

static void scales_find(const struct lut_splat1d *lut, bool is_half, double scale[IO_CHANNEL_COUNT])
{
    /* R_d falls with r, so the first node is the largest. */
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        scale[c] = is_half ? lut_half_scale((double)lut->rgb[c]) : 1;
}

static bool attributes_set(struct io_image *image, const struct lut_splat1d *lut, bool is_half,
                           const double scale[IO_CHANNEL_COUNT])
{
    const dipole_layer(*const layers)[DIPOLE_LAYER_LIMIT] = lut->material.layers;
    const dipole_medium *const first = &layers[0][0].medium;
    double sigma_a[IO_CHANNEL_COUNT], sigma_s_prime[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &layers[c][0].medium;
        assert(medium->eta == first->eta && medium->fdr_kind == first->fdr_kind);
        sigma_a[c] = medium->sigma_a_per_mm;
        sigma_s_prime[c] = medium->sigma_s_prime_per_mm;
    }
    char hash[17];
    input_hash(lut, dipole_version(), is_half, hash);
    return io_image_set_text(image, "dipole:kind", "splat1d") &&
           io_image_set_number(image, "dipole:size", lut->axis.node_count) &&
           io_image_set_text(image, "dipole:material", lut->material.name) &&
           io_image_set_numbers(image, "dipole:sigma_a_per_mm", sigma_a) &&
           io_image_set_numbers(image, "dipole:sigma_s_prime_per_mm", sigma_s_prime) &&
           io_image_set_number(image, "dipole:eta", first->eta) &&
           io_image_set_text(image, "dipole:fdr", fdr_names[first->fdr_kind]) &&
           io_image_set_text(image, "dipole:model", "dipole") &&
           io_image_set_number(image, "dipole:epsilon", lut->epsilon) &&
           io_image_set_text(image, "dipole:axis_mapping", axis_mapping) &&
           io_image_set_number(image, "dipole:r_max_mm", lut->axis.r_max_mm) &&
           io_image_set_number(image, "dipole:scale_mm", lut->axis.scale_mm) &&
           io_image_set_text(image, "dipole:unit", "1/mm^2, texel times dipole:scale") &&
           io_image_set_numbers(image, "dipole:scale", scale) &&
           io_image_set_text(image, "dipole:storage", is_half ? "half" : "float") &&
           io_image_set_number(image, "dipole:max_relative_error", lut->max_relative_error) &&
           io_image_set_text(image, "dipole:version", dipole_version()) &&
           io_image_set_text(image, "dipole:input_hash", hash);
}

bool lut_splat1d_write(const struct lut_splat1d *lut, const char *path, bool is_half, dipole_status *status)
{
    double scale[IO_CHANNEL_COUNT];
    scales_find(lut, is_half, scale);
    struct io_image *image = NULL;
    if (!io_image_create(lut->axis.node_count, 1, IO_CHANNEL_COUNT, &image, status))
        return false;
    const dipole_place place = place_of(path);
    bool is_exact = true;
    for (size_t i = 0; i < (size_t)lut->axis.node_count * IO_CHANNEL_COUNT; i++) {
        const double value = (double)lut->rgb[i] / scale[i % IO_CHANNEL_COUNT];
        is_exact = is_exact && (!is_half || lut_half_round(value) == value);
        image->pixels[i] = (float)value;
    }
    if (!is_exact)
        dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                    "the table has values between those of half, expected one baked for half");
    const bool has_room = attributes_set(image, lut, is_half, scale);
    assert(has_room);
    const bool is_done = is_exact && has_room && io_exr_write(path, image, is_half, status);
    io_image_destroy(image);
    return is_done;
}

/* ---- read --------------------------------------------------------------------------------------- */

/* Attributes of a file, and where the first failure goes. */
struct reader {
    const struct io_image *image;
    dipole_place place;
    dipole_status *status;
};

static const struct io_attribute *find(const struct reader *reader, const char *name,
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

static bool get_text(const struct reader *reader, const char *name, const char *const *choices,
                     size_t count, size_t *index_out)
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_TEXT);
    if (!attribute)
        return false;
    for (size_t i = 0; i < count; i++)
        if (strcmp(attribute->text, choices[i]) == 0) {
            *index_out = i;
            return true;
        }
    return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                       "%s is \"%.64s\", expected \"%s\"%s%s%s", name, attribute->text, choices[0],
                       count > 1 ? " or \"" : "", count > 1 ? choices[1] : "", count > 1 ? "\"" : "");
}

static bool check_number(const struct reader *reader, const char *name, double value, double min,
                         double max)
{
    if (value >= min && value <= max)
        return true;
    return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place, "%s is %g, expected %g to %g",
                       name, value, min, max);
}

static bool get_number(const struct reader *reader, const char *name, double min, double max, double *out)
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_NUMBER);
    if (!attribute || !check_number(reader, name, attribute->numbers[0], min, max))
        return false;
    *out = attribute->numbers[0];
    return true;
}

static bool get_numbers(const struct reader *reader, const char *name, double min, double max,
                        double out[IO_CHANNEL_COUNT])
{
    const struct io_attribute *const attribute = find(reader, name, IO_ATTRIBUTE_NUMBERS);
    if (!attribute)
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!check_number(reader, name, attribute->numbers[c], min, max))
            return false;
        out[c] = attribute->numbers[c];
    }
    return true;
}

static bool material_get(const struct reader *reader, struct io_material *out)
{
    double sigma_a[IO_CHANNEL_COUNT], sigma_s_prime[IO_CHANNEL_COUNT], eta;
    size_t fdr = 0, model = 0;
    const struct io_attribute *const name = find(reader, "dipole:material", IO_ATTRIBUTE_TEXT);
    if (!name || !get_numbers(reader, "dipole:sigma_a_per_mm", 0, DIPOLE_SIGMA_MAX_PER_MM, sigma_a) ||
        !get_numbers(reader, "dipole:sigma_s_prime_per_mm", 0, DIPOLE_SIGMA_MAX_PER_MM, sigma_s_prime) ||
        !get_number(reader, "dipole:eta", DIPOLE_ETA_MIN, DIPOLE_ETA_MAX, &eta) ||
        !get_text(reader, "dipole:fdr", fdr_names, 2, &fdr) ||
        !get_text(reader, "dipole:model", (const char *const[]){ "dipole" }, 1, &model))
        return false;
    snprintf(out->name, sizeof out->name, "%.*s", (int)sizeof out->name - 1, name->text);
    dipole_medium media[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        media[c] = (dipole_medium){ .sigma_a_per_mm = sigma_a[c],
                                    .sigma_s_prime_per_mm = sigma_s_prime[c],
                                    .eta = eta,
                                    .fdr_kind = (dipole_fdr_kind)fdr };
        dipole_coefficients unused;
        dipole_status why = { 0 };
        if (!dipole_coefficients_init(&media[c], &unused, &why))
            return dipole_fail(reader->status, why.code, &reader->place, "channel %s: %s",
                               io_channel_names[c], why.message);
    }
    io_material_set_media(out, media);
    return true;
}

/* The texels as values; scale undone. */
static bool texels_get(const struct reader *reader, const double scale[IO_CHANNEL_COUNT],
                       struct lut_splat1d *lut)
{
    const size_t count = (size_t)lut->axis.node_count * IO_CHANNEL_COUNT;
    lut->rgb = malloc(count * sizeof *lut->rgb);
    if (!lut->rgb)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, &reader->place,
                           "out of memory for a table");
    for (size_t i = 0; i < count; i++) {
        const double value = (double)reader->image->pixels[i] * scale[i % IO_CHANNEL_COUNT];
        lut->rgb[i] = (float)value;
        if (!isfinite(lut->rgb[i]) || lut->rgb[i] < 0)
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                               "texel %zu holds %g, expected a finite value >= 0", i / IO_CHANNEL_COUNT,
                               value);
    }
    return true;
}

static bool parse(const struct reader *reader, struct lut_splat1d *lut)
{
    static const char *const storages[] = { "float", "half" };
    static const char *const kinds[] = { "splat1d" };
    const struct io_image *const image = reader->image;
    double size, scale[IO_CHANNEL_COUNT];
    size_t kind = 0, storage = 0;
    if (!get_text(reader, "dipole:kind", kinds, 1, &kind) || !material_get(reader, &lut->material) ||
        !get_number(reader, "dipole:size", LUT_NODE_COUNT_MIN, LUT_NODE_COUNT_MAX, &size) ||
        !get_number(reader, "dipole:epsilon", LUT_EPSILON_MIN, LUT_EPSILON_MAX, &lut->epsilon) ||
        !get_number(reader, "dipole:max_relative_error", 0, lut->epsilon, &lut->max_relative_error) ||
        !get_number(reader, "dipole:r_max_mm", 1e-100, 1e100, &lut->axis.r_max_mm) ||
        !get_number(reader, "dipole:scale_mm", 1e-100, 1e100, &lut->axis.scale_mm) ||
        !get_numbers(reader, "dipole:scale", 0x1p-200, 0x1p200, scale) ||
        !get_text(reader, "dipole:storage", storages, 2, &storage))
        return false;
    if (image->width_px != size || image->height_px != 1 || image->channel_count != IO_CHANNEL_COUNT)
        return dipole_fail(
            reader->status, DIPOLE_BAD_VALUE, &reader->place,
            "the picture is %d x %d with %d channels, expected %.0f x 1 with %d (dipole:size)",
            image->width_px, image->height_px, image->channel_count, size, IO_CHANNEL_COUNT);
    lut->axis.node_count = image->width_px;

    const struct io_attribute *const version = find(reader, "dipole:version", IO_ATTRIBUTE_TEXT);
    const struct io_attribute *const stored = find(reader, "dipole:input_hash", IO_ATTRIBUTE_TEXT);
    if (!version || !stored)
        return false;
    char hash[17];
    input_hash(lut, version->text, storage == 1, hash);
    if (strcmp(hash, stored->text) != 0)
        return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &reader->place,
                           "dipole:input_hash is %.16s, expected %s: the attributes were changed",
                           stored->text, hash);
    return texels_get(reader, scale, lut);
}

bool lut_splat1d_read(const char *path, struct lut_splat1d **lut_out, dipole_status *status)
{
    *lut_out = NULL;
    struct io_image *image = NULL;
    if (!io_exr_read(path, &image, status))
        return false;
    struct lut_splat1d *const lut = calloc(1, sizeof *lut);
    const struct reader reader = { .image = image, .place = place_of(path), .status = status };
    bool is_done = false;
    if (!lut)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &reader.place, "out of memory for a table");
    else
        is_done = parse(&reader, lut);
    io_image_destroy(image);
    if (!is_done) {
        lut_splat1d_destroy(lut);
        return false;
    }
    *lut_out = lut;
    return true;
}
