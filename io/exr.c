#include "io/exr.h"

#include "io/file.h"
#include "io/half.h"

#include <assert.h>
#include <openexr.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Largest file that is read: the largest picture, uncompressed, with room for its header. */
#define FILE_LIMIT_BYTES (((size_t)1 << 32) + ((size_t)1 << 20))

enum { MAX_VALUE_SIZE = 4 }; /* bytes of a float or a whole number; a half has 2 */

/* ---- images --------------------------------------------------------------------------------------- */

bool io_image_create(int width_px, int height_px, int channel_count, struct io_image **image_out,
                     dipole_status *status)
{
    *image_out = NULL;
    if (width_px < 1 || height_px < 1 || width_px > IO_IMAGE_SIDE_LIMIT || height_px > IO_IMAGE_SIDE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "image of %d x %d pixels, expected sides of 1 to %d", width_px, height_px,
                           IO_IMAGE_SIDE_LIMIT);
    const size_t pixel_count = (size_t)width_px * (size_t)height_px;
    if (pixel_count > IO_IMAGE_PIXEL_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "image of %d x %d pixels, expected at most %zu in all", width_px, height_px,
                           IO_IMAGE_PIXEL_LIMIT);
    if (channel_count != 1 && channel_count != 3 && channel_count != 4)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "image of %d channels, expected 1, 3 or 4",
                           channel_count);
    /* The pixels follow the struct, whose size is a multiple of a float's. */
    struct io_image *image = calloc(1, sizeof *image + pixel_count * (size_t)channel_count * sizeof(float));
    if (!image)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for an image of %d x %d pixels",
                           width_px, height_px);
    image->width_px = width_px;
    image->height_px = height_px;
    image->channel_count = channel_count;
    image->pixels = (float *)(image + 1);
    *image_out = image;
    return true;
}

void io_image_destroy(struct io_image *image)
{
    if (!image)
        return;
    for (size_t i = 0; i < image->attribute_count; i++) {
        assert(image->attributes);
        free(image->attributes[i].text);
    }
    free(image->attributes);
    free(image);
}

static size_t attribute_index(const struct io_image *image, const char *name)
{
    size_t i = 0;
    while (i < image->attribute_count && strcmp(image->attributes[i].name, name) != 0)
        i++;
    return i;
}

/* Room for one attribute more. */
static bool grow_attributes(struct io_image *image)
{
    if (image->attribute_count < image->attribute_capacity)
        return true;
    if (image->attribute_count == IO_IMAGE_MAX_ATTRIBUTES)
        return false;
    const size_t capacity = image->attribute_capacity ? 2 * image->attribute_capacity : 16;
    struct io_attribute *attributes = realloc(image->attributes, capacity * sizeof *attributes);
    if (!attributes)
        return false;
    image->attributes = attributes;
    image->attribute_capacity = capacity;
    return true;
}

/* Put an attribute in the place of the one of its name, or behind the last. What is not taken is freed. */
static bool set_attribute(struct io_image *image, const char *name, struct io_attribute attribute)
{
    const size_t i = attribute_index(image, name), length = strlen(name);
    if (length >= sizeof attribute.name || (i == image->attribute_count && !grow_attributes(image))) {
        free(attribute.text);
        return false;
    }
    assert(image->attributes);
    memcpy(attribute.name, name, length + 1);
    if (i == image->attribute_count)
        image->attribute_count++;
    else
        free(image->attributes[i].text);
    image->attributes[i] = attribute;
    return true;
}

bool io_image_set_text(struct io_image *image, const char *name, const char *text)
{
    const size_t length = strlen(text);
    char *copy = length <= IO_IMAGE_TEXT_LIMIT ? malloc(length + 1) : NULL;
    if (!copy)
        return false;
    memcpy(copy, text, length + 1);
    return set_attribute(image, name, (struct io_attribute){ .kind = IO_ATTRIBUTE_TEXT, .text = copy });
}

bool io_image_set_number(struct io_image *image, const char *name, double value)
{
    return set_attribute(image, name,
                         (struct io_attribute){ .kind = IO_ATTRIBUTE_NUMBER, .numbers = { value } });
}

bool io_image_set_numbers(struct io_image *image, const char *name, const double values[3])
{
    const struct io_attribute attribute = { .kind = IO_ATTRIBUTE_NUMBERS,
                                            .numbers = { values[0], values[1], values[2] } };
    return set_attribute(image, name, attribute);
}

const struct io_attribute *io_image_find(const struct io_image *image, const char *name)
{
    const size_t i = attribute_index(image, name);
    return i < image->attribute_count ? &image->attributes[i] : NULL;
}

/* ---- the library's streams and errors ------------------------------------------------------------- */

/* A file in memory, and the first thing that the library said was wrong with it. */
struct stream {
    char *data;
    size_t size, capacity;
    bool is_out_of_memory;
    char error[160];
};

static void keep_error(exr_const_context_t context, exr_result_t code, const char *message)
{
    void *user_data = NULL;
    (void)code;
    if (exr_get_user_data(context, &user_data) != EXR_ERR_SUCCESS || !user_data)
        return;
    struct stream *stream = user_data;
    if (!stream->error[0])
        snprintf(stream->error, sizeof stream->error, "%s", message);
}

/* While it writes, the library reports errors with its context locked, and asking for the stream would wait
 * for ever; the code that it returns has to do. */
static void ignore_error(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context, (void)code, (void)message;
}

static int64_t read_stream(exr_const_context_t context, void *user_data, void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)context, (void)fail;
    const struct stream *stream = user_data;
    if (offset >= stream->size)
        return 0;
    const size_t left = stream->size - (size_t)offset;
    const size_t count = size < left ? (size_t)size : left;
    memcpy(buffer, stream->data + offset, count);
    return (int64_t)count;
}

static int64_t stream_size(exr_const_context_t context, void *user_data)
{
    (void)context;
    return (int64_t)((const struct stream *)user_data)->size;
}

static int64_t write_stream(exr_const_context_t context, void *user_data, const void *buffer, uint64_t size,
                            uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)context, (void)fail;
    struct stream *stream = user_data;
    const size_t end = (size_t)offset + (size_t)size;
    if (end > stream->capacity) {
        const size_t capacity = end > 2 * stream->capacity ? end : 2 * stream->capacity;
        char *data = realloc(stream->data, capacity);
        if (!data) {
            stream->is_out_of_memory = true;
            return -1;
        }
        memset(data + stream->capacity, 0, capacity - stream->capacity);
        stream->data = data;
        stream->capacity = capacity;
    }
    memcpy(stream->data + offset, buffer, (size_t)size);
    if (end > stream->size)
        stream->size = end;
    return (int64_t)size;
}

static bool fail_at_exr(const char *path, const struct stream *stream, const char *what, exr_result_t code,
                        dipole_status *status)
{
    const dipole_place place = { .source = path };
    if (stream->is_out_of_memory)
        code = EXR_ERR_OUT_OF_MEMORY;
    return dipole_fail(status, code == EXR_ERR_OUT_OF_MEMORY ? DIPOLE_OUT_OF_MEMORY : DIPOLE_BAD_SYNTAX,
                       &place, "%s: %s", what,
                       stream->error[0] ? stream->error : exr_get_default_error_message(code));
}

/* ---- writing -------------------------------------------------------------------------------------- */

static const char *const channel_names[] = { "R", "G", "B", "A" };

static const char *channel_name(const struct io_image *image, int channel)
{
    return image->channel_count == 1 ? "Y" : channel_names[channel];
}

static exr_result_t declare_attributes(exr_context_t context, const struct io_image *image)
{
    exr_result_t result = EXR_ERR_SUCCESS;
    for (size_t i = 0; i < image->attribute_count && result == EXR_ERR_SUCCESS; i++) {
        const struct io_attribute *a = &image->attributes[i];
        const exr_attr_v3d_t v = { .x = a->numbers[0], .y = a->numbers[1], .z = a->numbers[2] };
        if (strlen(a->name) > 31)
            exr_set_longname_support(context, 1);
        switch (a->kind) {
        case IO_ATTRIBUTE_TEXT:
            result = exr_attr_set_string(context, 0, a->name, a->text);
            break;
        case IO_ATTRIBUTE_NUMBER:
            result = exr_attr_set_double(context, 0, a->name, a->numbers[0]);
            break;
        case IO_ATTRIBUTE_NUMBERS:
            result = exr_attr_set_v3d(context, 0, a->name, &v);
            break;
        }
    }
    return result;
}

static exr_result_t declare(exr_context_t context, const struct io_image *image, exr_pixel_type_t type)
{
    int part;
    exr_result_t result = exr_add_part(context, NULL, EXR_STORAGE_SCANLINE, &part);
    if (result == EXR_ERR_SUCCESS)
        result = exr_initialize_required_attr_simple(context, 0, image->width_px, image->height_px,
                                                     EXR_COMPRESSION_ZIP);
    for (int c = 0; c < image->channel_count && result == EXR_ERR_SUCCESS; c++)
        result =
            exr_add_channel(context, 0, channel_name(image, c), type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (result == EXR_ERR_SUCCESS)
        result = declare_attributes(context, image);
    return result == EXR_ERR_SUCCESS ? exr_write_header(context) : result;
}

/* Copy one channel of some rows out of the image, as floats or halves. */
static void pack_channel(const struct io_image *image, int channel, int row, int row_count, bool is_half,
                         uint8_t *out)
{
    const size_t step = (size_t)image->channel_count;
    const size_t count = (size_t)row_count * (size_t)image->width_px;
    const float *in = image->pixels + (size_t)row * (size_t)image->width_px * step + (size_t)channel;
    for (size_t i = 0; i < count; i++) {
        const uint16_t half = io_half_from_float(in[i * step]);
        if (is_half)
            memcpy(out + i * sizeof half, &half, sizeof half);
        else
            memcpy(out + i * sizeof(float), &in[i * step], sizeof(float));
    }
}

static int channel_index(const struct io_image *image, const char *name)
{
    int c = 0;
    while (c < image->channel_count && strcmp(channel_name(image, c), name) != 0)
        c++;
    return c;
}

/* The library's compressor. */
struct compression {
    exr_result_t (*run)(exr_encode_pipeline_t *pipeline);
};

/* A chunk whose size compression does not change is read as one that is not compressed, yet up to
 * version 3.4.7 the library writes it compressed (OpenEXR issue 2306). */
static exr_result_t compress(exr_encode_pipeline_t *pipeline)
{
    const struct compression *compression = pipeline->encoding_user_data;
    const exr_result_t result = compression->run(pipeline);
    if (result == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    return result;
}

static exr_result_t write_chunk(exr_context_t context, const struct io_image *image, int row, bool is_half,
                                struct compression *compression, uint8_t *rows,
                                exr_encode_pipeline_t *pipeline)
{
    const bool is_first = row == 0;
    const int16_t value_size = is_half ? 2 : 4;
    exr_chunk_info_t chunk;
    exr_result_t result = exr_write_scanline_chunk_info(context, 0, row, &chunk);
    if (result == EXR_ERR_SUCCESS)
        result = is_first ? exr_encoding_initialize(context, 0, &chunk, pipeline)
                          : exr_encoding_update(context, 0, &chunk, pipeline);
    if (result != EXR_ERR_SUCCESS)
        return result;
    /* Planes, not pixels: the library's interleaved paths reorder channels. */
    for (int c = 0; c < pipeline->channel_count; c++) {
        exr_coding_channel_info_t *channel = &pipeline->channels[c];
        uint8_t *plane =
            rows + (size_t)c * (size_t)chunk.height * (size_t)image->width_px * (size_t)value_size;
        pack_channel(image, channel_index(image, channel->channel_name), row, chunk.height, is_half, plane);
        channel->user_data_type = is_half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = value_size;
        channel->user_pixel_stride = value_size;
        channel->user_line_stride = value_size * image->width_px;
        channel->encode_from_ptr = plane;
    }
    if (is_first) {
        result = exr_encoding_choose_default_routines(context, 0, pipeline);
        compression->run = pipeline->compress_fn;
        pipeline->compress_fn = compress;
        pipeline->encoding_user_data = compression;
    }
    return result == EXR_ERR_SUCCESS ? exr_encoding_run(context, 0, pipeline) : result;
}

static exr_result_t write_chunks(exr_context_t context, const struct io_image *image, bool is_half)
{
    int32_t rows_per_chunk;
    const exr_result_t found = exr_get_scanlines_per_chunk(context, 0, &rows_per_chunk);
    if (found != EXR_ERR_SUCCESS)
        return found;
    uint8_t *rows = malloc((size_t)rows_per_chunk * (size_t)image->width_px * (size_t)image->channel_count *
                           MAX_VALUE_SIZE);
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    struct compression compression;
    exr_result_t result = rows ? EXR_ERR_SUCCESS : EXR_ERR_OUT_OF_MEMORY;
    for (int row = 0; row < image->height_px && result == EXR_ERR_SUCCESS; row += rows_per_chunk)
        result = write_chunk(context, image, row, is_half, &compression, rows, &pipeline);
    exr_encoding_destroy(context, &pipeline);
    free(rows);
    return result;
}

bool io_exr_write(const char *path, const struct io_image *image, bool is_half, dipole_status *status)
{
    return io_exr_write_checked(path, image, is_half, NULL, NULL, status);
}

bool io_exr_write_checked(const char *path, const struct io_image *image, bool is_half,
                          io_file_check *check, void *check_context, dipole_status *status)
{
    if (is_half && !io_half_check(path, image, status))
        return false;
    struct stream stream = { 0 };
    exr_context_initializer_t initializer = EXR_DEFAULT_CONTEXT_INITIALIZER;
    initializer.error_handler_fn = ignore_error;
    initializer.user_data = &stream;
    initializer.write_fn = write_stream;

    exr_context_t context = NULL;
    exr_result_t result = exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &initializer);
    if (result == EXR_ERR_SUCCESS)
        result = declare(context, image, is_half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT);
    if (result == EXR_ERR_SUCCESS)
        result = write_chunks(context, image, is_half);
    const exr_result_t finished = exr_finish(&context);
    if (result == EXR_ERR_SUCCESS)
        result = finished;
    const bool done =
        result == EXR_ERR_SUCCESS
            ? io_file_write_checked(path, stream.data, stream.size, check, check_context, status)
            : fail_at_exr(path, &stream, "cannot be written as EXR", result, status);
    free(stream.data);
    return done;
}

/* ---- reading -------------------------------------------------------------------------------------- */

/* What is read of a part. */
struct source {
    const char *path;
    exr_context_t context;
    struct stream *stream;
    struct io_image *image;
    exr_attr_box2i_t window;
    const char *names[IO_IMAGE_MAX_CHANNELS]; /* of the file's channels, in the image's order */
    int channel_count;
    int chunk_width, chunk_height; /* the largest                    */
    uint8_t *planes;               /* one chunk, channel after channel */
};

static bool fail_at_source(const struct source *source, exr_result_t code, dipole_status *status)
{
    return fail_at_exr(source->path, source->stream, "cannot be read as EXR", code, status);
}

/* R, G, B and perhaps A; else Y; else the only one. */
static bool choose_channels(struct source *source, dipole_status *status)
{
    const dipole_place place = { .source = source->path };
    const exr_attr_chlist_t *list;
    const exr_result_t result = exr_get_channels(source->context, 0, &list);
    if (result != EXR_ERR_SUCCESS)
        return fail_at_source(source, result, status);
    const char *rgba[IO_IMAGE_MAX_CHANNELS] = { NULL };
    const char *single = NULL;
    for (int i = 0; i < list->num_channels; i++) {
        const exr_attr_chlist_entry_t *entry = &list->entries[i];
        if (entry->x_sampling != 1 || entry->y_sampling != 1)
            return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                               "channel %.40s is subsampled, expected one value for each pixel",
                               entry->name.str);
        for (int c = 0; c < IO_IMAGE_MAX_CHANNELS; c++)
            if (strcmp(entry->name.str, channel_names[c]) == 0)
                rgba[c] = entry->name.str;
        if (list->num_channels == 1 || strcmp(entry->name.str, "Y") == 0)
            single = entry->name.str;
    }
    if (rgba[0] && rgba[1] && rgba[2]) {
        memcpy(source->names, rgba, sizeof rgba);
        source->channel_count = rgba[3] ? 4 : 3;
    } else if (single) {
        source->names[0] = single;
        source->channel_count = 1;
    } else {
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                           "has %d channels without R, G, B or Y, expected those or a single one",
                           list->num_channels);
    }
    return true;
}

static bool keep_attribute(struct source *source, const exr_attribute_t *a, dipole_status *status)
{
    struct io_image *const image = source->image;
    const dipole_place place = { .source = source->path };
    const size_t length = a->type == EXR_ATTR_STRING ? strlen(a->string->str) : 0;
    if (strlen(a->name) >= sizeof image->attributes->name || length > IO_IMAGE_TEXT_LIMIT ||
        image->attribute_count == IO_IMAGE_MAX_ATTRIBUTES)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "attribute %.64s is too much, expected at most %d of at most %d bytes", a->name,
                           IO_IMAGE_MAX_ATTRIBUTES, IO_IMAGE_TEXT_LIMIT);
    const bool is_kept =
        a->type == EXR_ATTR_STRING ? io_image_set_text(image, a->name, a->string->str)
        : a->type == EXR_ATTR_DOUBLE
            ? io_image_set_number(image, a->name, a->d)
            : io_image_set_numbers(image, a->name, (double[]){ a->v3d->x, a->v3d->y, a->v3d->z });
    return is_kept || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for its attributes");
}

static bool keep_attributes(struct source *source, dipole_status *status)
{
    int32_t count = 0;
    exr_result_t result = exr_get_attribute_count(source->context, 0, &count);
    for (int32_t i = 0; i < count && result == EXR_ERR_SUCCESS; i++) {
        const exr_attribute_t *a;
        result = exr_get_attribute_by_index(source->context, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a);
        if (result != EXR_ERR_SUCCESS || strncmp(a->name, "dipole:", 7) != 0)
            continue;
        if ((a->type == EXR_ATTR_STRING || a->type == EXR_ATTR_DOUBLE || a->type == EXR_ATTR_V3D) &&
            !keep_attribute(source, a, status))
            return false;
    }
    return result == EXR_ERR_SUCCESS || fail_at_source(source, result, status);
}

static bool check_part(struct source *source, exr_storage_t *storage_out, dipole_status *status)
{
    const dipole_place place = { .source = source->path };
    exr_compression_t compression;
    exr_result_t result = exr_get_storage(source->context, 0, storage_out);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_compression(source->context, 0, &compression);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_data_window(source->context, 0, &source->window);
    if (result != EXR_ERR_SUCCESS)
        return fail_at_source(source, result, status);
    if (*storage_out != EXR_STORAGE_SCANLINE && *storage_out != EXR_STORAGE_TILED)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                           "holds deep data, expected one value for each pixel");
    if (compression == EXR_COMPRESSION_DWAA || compression == EXR_COMPRESSION_DWAB)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                           "is compressed by DWA, expected ZIP, PIZ, RLE, PXR24, B44 or none");
    const int64_t width = (int64_t)source->window.max.x - source->window.min.x + 1;
    const int64_t height = (int64_t)source->window.max.y - source->window.min.y + 1;
    if (width < 1 || height < 1 || width > IO_IMAGE_SIDE_LIMIT || height > IO_IMAGE_SIDE_LIMIT ||
        (size_t)(width * height) > IO_IMAGE_PIXEL_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "has %lld x %lld pixels, expected sides of 1 to %d and at most %zu in all",
                           (long long)width, (long long)height, IO_IMAGE_SIDE_LIMIT, IO_IMAGE_PIXEL_LIMIT);
    return true;
}

/* Values as the file has them, converted here: the library's own conversions reorder channels. */
static void unpack_channel(const struct source *source, int channel, const uint8_t *in, uint16_t type,
                           int x, int y, int width, int height)
{
    struct io_image *image = source->image;
    for (int row = 0; row < height; row++) {
        float *out =
            image->pixels +
            (((size_t)(y + row) * (size_t)image->width_px + (size_t)x) * (size_t)image->channel_count) +
            channel;
        for (int i = 0; i < width; i++, out += image->channel_count) {
            uint16_t half;
            uint32_t whole;
            if (type == EXR_PIXEL_HALF) {
                memcpy(&half, in, sizeof half);
                *out = io_float_from_half(half);
                in += sizeof half;
            } else {
                memcpy(type == EXR_PIXEL_FLOAT ? (void *)out : (void *)&whole, in, sizeof whole);
                if (type == EXR_PIXEL_UINT)
                    *out = (float)whole;
                in += sizeof whole;
            }
        }
    }
}

/* Decode a chunk whose first pixel is (x, y) of the image. */
static exr_result_t read_chunk(struct source *source, const exr_chunk_info_t *chunk, int x, int y,
                               exr_decode_pipeline_t *pipeline)
{
    const struct io_image *image = source->image;
    if (chunk->width < 1 || chunk->width > source->chunk_width || chunk->width > image->width_px - x ||
        chunk->height < 1 || chunk->height > source->chunk_height || chunk->height > image->height_px - y)
        return EXR_ERR_BAD_CHUNK_LEADER;
    exr_result_t result = pipeline->channels ? exr_decoding_update(source->context, 0, chunk, pipeline)
                                             : exr_decoding_initialize(source->context, 0, chunk, pipeline);
    if (result != EXR_ERR_SUCCESS)
        return result;
    int indices[IO_IMAGE_MAX_CHANNELS] = { 0 };
    for (int i = 0; i < pipeline->channel_count; i++) {
        exr_coding_channel_info_t *channel = &pipeline->channels[i];
        channel->decode_to_ptr = NULL;
        for (int c = 0; c < source->channel_count; c++) {
            if (strcmp(channel->channel_name, source->names[c]) != 0)
                continue;
            const int16_t value_size = channel->data_type == EXR_PIXEL_HALF ? 2 : 4;
            indices[c] = i;
            channel->user_data_type = channel->data_type;
            channel->user_bytes_per_element = value_size;
            channel->user_pixel_stride = value_size;
            channel->user_line_stride = value_size * chunk->width;
            channel->decode_to_ptr =
                source->planes + (size_t)c * (size_t)chunk->width * (size_t)chunk->height * MAX_VALUE_SIZE;
        }
    }
    result = exr_decoding_choose_default_routines(source->context, 0, pipeline);
    if (result == EXR_ERR_SUCCESS)
        result = exr_decoding_run(source->context, 0, pipeline);
    for (int c = 0; c < source->channel_count && result == EXR_ERR_SUCCESS; c++) {
        const exr_coding_channel_info_t *channel = &pipeline->channels[indices[c]];
        unpack_channel(source, c, channel->decode_to_ptr, channel->data_type, x, y, chunk->width,
                       chunk->height);
    }
    return result;
}

static exr_result_t read_chunks(struct source *source, bool is_tiled, exr_decode_pipeline_t *pipeline)
{
    const int chunk_width = source->chunk_width, chunk_height = source->chunk_height;
    const struct io_image *image = source->image;
    exr_result_t result = EXR_ERR_SUCCESS;
    for (int y = 0; y < image->height_px && result == EXR_ERR_SUCCESS; y += chunk_height) {
        for (int x = 0; x < image->width_px && result == EXR_ERR_SUCCESS; x += chunk_width) {
            exr_chunk_info_t chunk;
            result = is_tiled ? exr_read_tile_chunk_info(source->context, 0, x / chunk_width,
                                                         y / chunk_height, 0, 0, &chunk)
                              : exr_read_scanline_chunk_info(source->context, 0, source->window.min.y + y,
                                                             &chunk);
            if (result == EXR_ERR_SUCCESS)
                result = read_chunk(source, &chunk, x, y, pipeline);
        }
    }
    return result;
}

static bool read_pixels(struct source *source, exr_storage_t storage, dipole_status *status)
{
    const struct io_image *image = source->image;
    const bool is_tiled = storage == EXR_STORAGE_TILED;
    uint32_t tile_width = (uint32_t)image->width_px, tile_height = 0;
    int32_t row_count = 0;
    exr_tile_level_mode_t levels;
    exr_tile_round_mode_t rounding;
    exr_result_t result = is_tiled ? exr_get_tile_descriptor(source->context, 0, &tile_width, &tile_height,
                                                             &levels, &rounding)
                                   : exr_get_scanlines_per_chunk(source->context, 0, &row_count);
    if (result != EXR_ERR_SUCCESS)
        return fail_at_source(source, result, status);
    if (!is_tiled)
        tile_height = (uint32_t)row_count;
    /* A tile may be larger than the picture, but what is decoded of it is not. */
    const uint32_t width = (uint32_t)image->width_px, height = (uint32_t)image->height_px;
    const uint32_t chunk_width = tile_width < width ? tile_width : width;
    const uint32_t chunk_height = tile_height < height ? tile_height : height;
    if (chunk_width == 0 || chunk_height == 0)
        return fail_at_source(source, EXR_ERR_INVALID_ATTR, status);
    source->chunk_width = (int)chunk_width;
    source->chunk_height = (int)chunk_height;
    source->planes =
        malloc((size_t)chunk_width * chunk_height * (size_t)source->channel_count * MAX_VALUE_SIZE);
    exr_decode_pipeline_t pipeline = EXR_DECODE_PIPELINE_INITIALIZER;
    result = source->planes ? read_chunks(source, is_tiled, &pipeline) : EXR_ERR_OUT_OF_MEMORY;
    exr_decoding_destroy(source->context, &pipeline);
    free(source->planes);
    return result == EXR_ERR_SUCCESS || fail_at_source(source, result, status);
}

static bool read_context(struct source *source, dipole_status *status)
{
    exr_storage_t storage;
    struct io_image *image;
    if (!check_part(source, &storage, status) || !choose_channels(source, status) ||
        !io_image_create(source->window.max.x - source->window.min.x + 1,
                         source->window.max.y - source->window.min.y + 1, source->channel_count, &image,
                         status))
        return false;
    assert(image);
    source->image = image;
    return keep_attributes(source, status) && read_pixels(source, storage, status);
}

bool io_exr_read(const char *path, struct io_image **image_out, dipole_status *status)
{
    *image_out = NULL;
    struct stream stream = { 0 };
    if (!io_file_read(path, FILE_LIMIT_BYTES, &stream.data, &stream.size, status))
        return false;
    exr_context_initializer_t initializer = EXR_DEFAULT_CONTEXT_INITIALIZER;
    initializer.error_handler_fn = keep_error;
    initializer.user_data = &stream;
    initializer.read_fn = read_stream;
    initializer.size_fn = stream_size;
    initializer.max_image_width = initializer.max_image_height = IO_IMAGE_SIDE_LIMIT;
    initializer.max_tile_width = initializer.max_tile_height = IO_IMAGE_SIDE_LIMIT;
    initializer.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION; /* a broken file is an error */

    struct source source = { .path = path, .stream = &stream };
    const exr_result_t result = exr_start_read(&source.context, path, &initializer);
    const bool done =
        result == EXR_ERR_SUCCESS ? read_context(&source, status) : fail_at_source(&source, result, status);
    exr_finish(&source.context);
    free(stream.data);
    if (!done) {
        io_image_destroy(source.image);
        return false;
    }
    *image_out = source.image;
    return true;
}
