#include "io/raw.h"

#include "io/dds.h"
#include "io/file.h"
#include "io/json.h"
#include "io/texels.h"

#include <assert.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool fail_without_memory(const char *path, dipole_status *status)
{
    const dipole_place place = { .source = path };
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for its bytes or its description");
}

/* ---- the sidecar ---------------------------------------------------------------------------------- */

static uint64_t fnv1a_64(const void *bytes, size_t size)
{
    const unsigned char *const data = bytes;
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ data[i]) * UINT64_C(0x100000001b3);
    return hash;
}

/* Layout and hash of an image's own file, whatever there is on disk: others may write there, too. */
struct content {
    struct io_texels texels;
    size_t header_bytes, bytes;
    uint64_t hash;
};

static bool content_find(const char *path, const struct io_image *image, int depth, bool is_half,
                         bool is_dds, struct content *content, dipole_status *status)
{
    if (!io_texels_init(&content->texels, path, image, depth, is_dds ? 4 : 3, is_half, status))
        return false;
    content->header_bytes = is_dds ? IO_DDS_HEADER_BYTES : 0;
    content->bytes = content->header_bytes + content->texels.bytes;
    assert(content->bytes > 0);
    uint8_t *const data = malloc(content->bytes);
    if (!data)
        return fail_without_memory(path, status);
    if (is_dds)
        io_dds_pack(&content->texels, image, data);
    else
        io_texels_pack(&content->texels, image, data);
    content->hash = fnv1a_64(data, content->bytes);
    free(data);
    return true;
}

static bool is_json(const char *name)
{
    static const char end[] = "_json";
    const size_t length = strlen(name);
    return length >= sizeof end - 1 && strcmp(name + length - (sizeof end - 1), end) == 0;
}

/* NULL, with *reason, for what JSON has not. */
static json_t *attribute_value(const struct io_attribute *attribute, const char **reason)
{
    const double *const numbers = attribute->numbers;
    switch (attribute->kind) {
    case IO_ATTRIBUTE_TEXT:
        *reason = is_json(attribute->name) ? "is not JSON" : "is not UTF-8";
        return is_json(attribute->name)
                   ? json_loads(attribute->text, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, NULL)
                   : json_string(attribute->text);
    case IO_ATTRIBUTE_NUMBER:
        *reason = "is not finite";
        return json_real(numbers[0]);
    case IO_ATTRIBUTE_NUMBERS:
        *reason = "is not finite";
        return json_pack("[f, f, f]", numbers[0], numbers[1], numbers[2]);
    }
    return NULL;
}

static json_t *describe_attributes(const char *path, const struct io_image *image, dipole_status *status)
{
    const dipole_place place = { .source = path };
    json_t *const object = json_object();
    for (size_t i = 0; i < image->attribute_count && object; i++) {
        const struct io_attribute *const attribute = &image->attributes[i];
        const char *reason = "";
        if (json_object_set_new(object, attribute->name, attribute_value(attribute, &reason)) != 0) {
            dipole_fail(status, DIPOLE_BAD_VALUE, &place, "attribute %s %s", attribute->name, reason);
            json_decref(object);
            return NULL;
        }
    }
    if (!object)
        fail_without_memory(path, status);
    return object;
}

/* Takes over the attributes. */
static char *describe(const struct content *content, json_t *attributes)
{
    const struct io_texels *const texels = &content->texels;
    char format[8], hash[17], layout[256];
    snprintf(format, sizeof format, "%s%zuf", texels->channel_count == 3 ? "rgb" : "rgba",
             8 * texels->value_size);
    snprintf(hash, sizeof hash, "%016" PRIx64, content->hash);
    snprintf(
        layout, sizeof layout,
        "channel c of texel (x, y, z) is the %zu bytes at header_bytes + z*slice_bytes + y*row_bytes + "
        "(%zu*x + c)*%zu; y counts from the top, z is the slice",
        texels->value_size, texels->channel_count, texels->value_size);
    json_t *const object = json_pack(
        "{s:s, s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:s, s:s, s:o}", "format", format, "byte_order",
        "little", "width", (json_int_t)texels->width, "height", (json_int_t)texels->height, "depth",
        (json_int_t)texels->depth, "header_bytes", (json_int_t)content->header_bytes, "row_bytes",
        (json_int_t)texels->row_bytes, "slice_bytes", (json_int_t)texels->slice_bytes, "bytes",
        (json_int_t)content->bytes, "layout", layout, "content_hash", hash, "attributes", attributes);
    char *const text = object ? io_json_format(object) : NULL;
    json_decref(object);
    return text;
}

/* The sidecar's path and, to be freed, its text. */
static bool sidecar_make(const char *path, const struct io_image *image, const struct content *content,
                         char out[PATH_MAX], char **text_out, dipole_status *status)
{
    const dipole_place place = { .source = path };
    *text_out = NULL;
    if (snprintf(out, PATH_MAX, "%s.json", path) >= PATH_MAX)
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "has too long a name");
    json_t *const attributes = describe_attributes(path, image, status);
    if (!attributes)
        return false;
    *text_out = describe(content, attributes);
    return *text_out || fail_without_memory(out, status);
}

static bool sidecar_write(const char *path, const struct io_image *image, int depth, bool is_half,
                          bool is_dds, dipole_status *status)
{
    struct content content;
    char sidecar_path[PATH_MAX], *text = NULL;
    const bool done = content_find(path, image, depth, is_half, is_dds, &content, status) &&
                      sidecar_make(path, image, &content, sidecar_path, &text, status) &&
                      io_file_write(sidecar_path, text, strlen(text), status);
    free(text);
    return done;
}

bool io_dds_sidecar_write(const char *path, const struct io_image *image, int depth, bool is_half,
                          dipole_status *status)
{
    return sidecar_write(path, image, depth, is_half, true, status);
}

static bool has_content(const char *path, const struct content *content)
{
    char *data;
    size_t size;
    const bool is_same = io_file_read(path, content->bytes, &data, &size, NULL) && size == content->bytes &&
                         fnv1a_64(data, size) == content->hash;
    free(data);
    return is_same;
}

static bool has_text(const char *path, const char *text)
{
    char *data;
    size_t size;
    const bool is_same = io_file_read(path, strlen(text), &data, &size, NULL) && strcmp(data, text) == 0;
    free(data);
    return is_same;
}

bool io_sidecar_is_current(const char *path, const struct io_image *image, int depth, bool is_half)
{
    bool is_current = false;
    for (int is_dds = 0; is_dds < 2 && !is_current; is_dds++) {
        struct content content;
        char sidecar_path[PATH_MAX], *text = NULL;
        is_current = content_find(path, image, depth, is_half, is_dds, &content, NULL) &&
                     has_content(path, &content) &&
                     sidecar_make(path, image, &content, sidecar_path, &text, NULL) &&
                     has_text(sidecar_path, text);
        free(text);
    }
    return is_current;
}

/* ---- the table ------------------------------------------------------------------------------------ */

bool io_raw_write(const char *path, const struct io_image *image, int depth, bool is_half,
                  dipole_status *status)
{
    struct io_texels texels;
    if (!io_texels_init(&texels, path, image, depth, 3, is_half, status))
        return false;
    uint8_t *const data = malloc(texels.bytes);
    if (!data)
        return fail_without_memory(path, status);
    io_texels_pack(&texels, image, data);
    const bool done = io_file_write(path, data, texels.bytes, status);
    free(data);
    return done && sidecar_write(path, image, depth, is_half, false, status);
}
