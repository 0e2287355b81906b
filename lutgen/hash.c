/* What the inputs were, and what a table holds, as one number each. */
#include "lutgen/internal.h"

#include "io/hash.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define FNV_PRIME UINT64_C(0x100000001b3)

static void hash_low_first(uint64_t *hash, uint64_t bits)
{
    for (int i = 0; i < 8; i++) {
        const unsigned char byte = (unsigned char)(bits >> (8 * i));
        io_hash_bytes(hash, &byte, 1);
    }
}

void lut_hash_number(uint64_t *hash, double value)
{
    uint64_t bits;
    value += 0.0;
    memcpy(&bits, &value, sizeof bits);
    hash_low_first(hash, bits);
}

void lut_hash_material(uint64_t *hash, const struct io_material *material)
{
    io_hash_text(hash, io_model_names[material->model]);
    for (size_t i = 0; i < material->layer_count; i++)
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const dipole_layer *const layer = &material->layers[c][i];
            lut_hash_number(hash, layer->thickness_mm);
            lut_hash_number(hash, layer->medium.sigma_a_per_mm);
            lut_hash_number(hash, layer->medium.sigma_s_prime_per_mm);
            lut_hash_number(hash, layer->medium.eta);
            lut_hash_number(hash, layer->medium.fdr_kind);
        }
}

struct lut_hash lut_request_hash(const struct lut_request *request)
{
    uint64_t hash = IO_HASH_START;
    io_hash_text(&hash, lut_kind_names[request->kind]);
    io_hash_text(&hash, dipole_version());
    io_hash_text(&hash, request->is_half ? "half" : "float");
    lut_hash_number(&hash, request->epsilon);
    for (int i = 0; i < 3; i++)
        lut_hash_number(&hash, request->size[i]);
    for (size_t i = 0; i < request->material_count; i++) {
        const struct io_material *const material = &request->materials[i];
        io_hash_text(&hash, material->name);
        io_hash_text(&hash, material->source);
        for (size_t k = 0; k < material->layer_count; k++)
            io_hash_text(&hash, material->layer_names[k]);
        lut_hash_material(&hash, material);
    }
    return lut_hash_print(hash);
}

struct lut_hash lut_hash_print(uint64_t hash)
{
    struct lut_hash out;
    snprintf(out.text, sizeof out.text, "%016" PRIx64, hash);
    return out;
}

struct lut_hash lut_material_hash(const struct io_material *material)
{
    uint64_t hash = IO_HASH_START;
    lut_hash_material(&hash, material);
    return lut_hash_print(hash);
}

struct lut_hash lut_content_hash(const struct io_image *image)
{
    const size_t count = (size_t)image->width_px * (size_t)image->height_px * (size_t)image->channel_count;
    uint64_t hash = IO_HASH_START;
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        const float value = image->pixels[i] + 0.0F;
        memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * FNV_PRIME; /* a word at a time: of a volume there are 400,000 */
    }
    for (size_t i = 0; i < image->attribute_count; i++) {
        const struct io_attribute *const attribute = &image->attributes[i];
        io_hash_text(&hash, attribute->name);
        if (attribute->kind == IO_ATTRIBUTE_TEXT)
            io_hash_text(&hash, attribute->text);
        for (int k = 0; attribute->kind != IO_ATTRIBUTE_TEXT && k < 3; k++)
            lut_hash_number(&hash, attribute->numbers[k]);
    }
    return lut_hash_print(hash);
}
