#include "tests/check.h"

#include "io/exr.h"
#include "io/file.h"

#include <dirent.h>
#include <limits.h>
#include <openexr.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static struct io_image *random_image(int width_px, int height_px, int channel_count, unsigned seed)
{
    struct io_image *image;
    struct rng rng = { .seed = seed };
    assert_true(io_image_create(width_px, height_px, channel_count, &image, NULL));
    const size_t count = (size_t)width_px * (size_t)height_px * (size_t)channel_count;
    for (size_t i = 0; i < count; i++)
        image->pixels[i] = (float)log_uniform(&rng, 1e-12, 1e3);
    return image;
}

static size_t value_count(const struct io_image *image)
{
    return (size_t)image->width_px * (size_t)image->height_px * (size_t)image->channel_count;
}

static void read_bytes(const char *path, char **data, size_t *size)
{
    assert_true(io_file_read(path, (size_t)1 << 26, data, size, NULL));
}

static void expect_same(const struct io_image *found, const struct io_image *expected)
{
    assert_int_equal(found->width_px, expected->width_px);
    assert_int_equal(found->height_px, expected->height_px);
    assert_int_equal(found->channel_count, expected->channel_count);
    assert_memory_equal(found->pixels, expected->pixels, value_count(expected) * sizeof(float));
}

/* ---- images ---------------------------------------------------------------------------------------- */

/* Oracle: the documented limits. */
static void sizes_outside_the_limits_are_refused(void **state)
{
    (void)state;
    static const int sizes[][3] = {
        { 0, 1, 3 }, { 1, -1, 3 }, { IO_IMAGE_SIDE_LIMIT + 1, 1, 3 }, { 1, INT_MAX, 3 }, { 65536, 4097, 1 },
        { 4, 4, 2 }, { 4, 4, 5 }
    };
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct io_image *image;
        dipole_status status;
        assert_false(io_image_create(sizes[i][0], sizes[i][1], sizes[i][2], &image, &status));
        assert_null(image);
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    }
    io_image_destroy(NULL);
}

/* ---- round trips ----------------------------------------------------------------------------------- */

/* Oracle: floats survive bit by bit, negative zero, infinities and NaN included; the same image gives the
 * same bytes. */
static void floats_are_read_back_bit_by_bit(void **state)
{
    (void)state;
    static const int sizes[][3] = { { 1, 1, 1 },  { 1, 1, 4 },     { 2048, 1, 3 },
                                    { 7, 40, 1 }, { 65536, 1, 3 }, { 33, 49, 4 } };
    for (unsigned i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct io_image *image = random_image(sizes[i][0], sizes[i][1], sizes[i][2], i), *found;
        static const float special[] = { -0.0f, INFINITY, -INFINITY, NAN, 1e-45f, 3.4e38f };
        memcpy(image->pixels, special,
               sizeof special < value_count(image) * sizeof(float) ? sizeof special : sizeof(float));
        char *first, *second;
        size_t first_size, second_size;
        assert_true(io_exr_write("a.exr", image, false, NULL));
        read_bytes("a.exr", &first, &first_size);
        assert_true(io_exr_read("a.exr", &found, NULL));
        expect_same(found, image);
        assert_true(io_exr_write("b.exr", found, false, NULL));
        read_bytes("b.exr", &second, &second_size);
        assert_int_equal(first_size, second_size);
        assert_memory_equal(first, second, first_size);
        free(first);
        free(second);
        io_image_destroy(image);
        io_image_destroy(found);
    }
}

/* Oracle: what was written. Noise hardly compresses; now and then a chunk keeps its size to the byte, which
 * decides how it is read. 1 in 200 of these does. */
static void chunks_that_do_not_compress_are_read_back(void **state)
{
    (void)state;
    struct rng rng = { .seed = 77 };
    for (int i = 0; i < 3000; i++) {
        struct io_image *image, *found;
        assert_true(io_image_create(1 + (int)(random_bits(&rng) % 250), 1 + i % 17, 3, &image, NULL));
        for (size_t k = 0; k < value_count(image); k++)
            image->pixels[k] =
                ldexpf((float)(1024 + random_bits(&rng) % 1024), (int)(random_bits(&rng) % 30) - 24);
        assert_true(io_exr_write("noise.exr", image, i % 2, NULL));
        assert_true(io_exr_read("noise.exr", &found, NULL));
        expect_same(found, image);
        io_image_destroy(image);
        io_image_destroy(found);
    }
}

/* The nearest half, found by search over all of them; of two equally near, the one with an even last bit.
 * Independent of the bit manipulation in half.c. */
static double half_value(unsigned half)
{
    const unsigned exponent = half >> 10 & 31, fraction = half & 1023;
    return exponent == 0 ? ldexp(fraction, -24) : ldexp(fraction + 1024, (int)exponent - 25);
}

static double nearest_half(double value)
{
    unsigned low = 0, high = 0x7c00; /* half_value rises with the bits; 0x7c00 stands for 65536 */
    const double magnitude = fabs(value);
    while (high - low > 1) {
        const unsigned middle = (low + high) / 2;
        if (half_value(middle) <= magnitude)
            low = middle;
        else
            high = middle;
    }
    const double below = magnitude - half_value(low), above = half_value(high) - magnitude;
    const unsigned half = below < above || (below == above && low % 2 == 0) ? low : high;
    return copysign(half_value(half), value);
}

/* Oracle: the nearest of all halves, ties to even. */
static void halves_are_rounded_to_nearest_even(void **state)
{
    (void)state;
    struct rng rng = { .seed = 21 };
    struct io_image *image, *found;
    assert_true(io_image_create(1024, 66, 3, &image, NULL));
    const size_t count = value_count(image);
    for (size_t i = 0; i < count; i++) {
        const unsigned half = (unsigned)(i % 0x7bff);
        const double middle = (half_value(half) + half_value(half + 1)) / 2;
        const double value = i < 0x7bff       ? half_value(half) /* exact */
                             : i < 2 * 0x7bff ? middle           /* ties */
                             : i < 3 * 0x7bff ? (double)nextafterf((float)middle, i % 2 ? 0.0f : 1e9f)
                             : i % 3 == 0     ? log_uniform(&rng, 1e-10, 1e-4)
                                              : log_uniform(&rng, 1e-5, 65503.0);
        image->pixels[i] = (float)(random_bits(&rng) & 1 ? value : -value);
    }
    assert_true(io_exr_write("half.exr", image, true, NULL));
    assert_true(io_exr_read("half.exr", &found, NULL));
    for (size_t i = 0; i < count; i++)
        if ((double)found->pixels[i] != nearest_half((double)image->pixels[i]))
            fail_msg("%.9g became %.9g, nearest is %.9g", (double)image->pixels[i],
                     (double)found->pixels[i], nearest_half((double)image->pixels[i]));
    /* What is a half already stays what it is. */
    struct io_image *again;
    assert_true(io_exr_write("half.exr", found, true, NULL));
    assert_true(io_exr_read("half.exr", &again, NULL));
    expect_same(again, found);
    io_image_destroy(image);
    io_image_destroy(found);
    io_image_destroy(again);
}

/* Oracle: the largest half is 65504, and 65520 lies in the middle between it and what would come next. */
static void a_value_over_the_largest_half_is_refused(void **state)
{
    (void)state;
    struct io_image *image, *found;
    dipole_status status;
    assert_true(io_image_create(5, 3, 3, &image, NULL));
    image->pixels[0] = 65519.996f;
    image->pixels[1] = -INFINITY;
    assert_true(io_exr_write("half.exr", image, true, NULL));
    assert_true(io_exr_read("half.exr", &found, NULL));
    assert_true(found->pixels[0] == 65504.0f && found->pixels[1] == -INFINITY);
    io_image_destroy(found);
    image->pixels[(5 * 2 + 3) * 3 + 1] = 65520.0f;
    assert_false(io_exr_write("half.exr", image, true, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.source, "half.exr");
    assert_string_equal(status.message,
                        "pixel (3, 2) of channel G is 65520, expected at most 65504 in half");
    assert_true(io_exr_write("half.exr", image, false, NULL));
    io_image_destroy(image);
}

/* Oracle: attributes keep text and all bits of their numbers; only ours are kept. */
static void attributes_are_read_back(void **state)
{
    (void)state;
    struct io_image *image = random_image(3, 2, 3, 1), *found;
    static const double triple[3] = { 0.1, -1e-300, 12345.678901234567 };
    assert_true(io_image_set_text(image, "dipole:kind", "splat1d \303\251"));
    assert_true(io_image_set_text(image, "dipole:empty", ""));
    assert_true(io_image_set_number(image, "dipole:epsilon", 1.0 / 3.0));
    assert_true(io_image_set_numbers(image, "dipole:sigma_a_per_mm", triple));
    assert_true(io_image_set_number(image, "dipole:a_name_that_is_longer_than_31_characters", 2.0));
    assert_true(io_image_set_text(image, "other", "not ours"));
    assert_true(io_exr_write("a.exr", image, false, NULL));
    assert_true(io_exr_read("a.exr", &found, NULL));
    expect_same(found, image);
    assert_int_equal(found->attribute_count, 5);
    assert_string_equal(io_image_find(found, "dipole:kind")->text, "splat1d \303\251");
    assert_string_equal(io_image_find(found, "dipole:empty")->text, "");
    assert_true(io_image_find(found, "dipole:epsilon")->numbers[0] == 1.0 / 3.0);
    assert_memory_equal(io_image_find(found, "dipole:sigma_a_per_mm")->numbers, triple, sizeof triple);
    assert_int_equal(io_image_find(found, "dipole:sigma_a_per_mm")->kind, IO_ATTRIBUTE_NUMBERS);
    assert_true(io_image_find(found, "dipole:a_name_that_is_longer_than_31_characters")->numbers[0] == 2.0);
    assert_null(io_image_find(found, "other"));
    io_image_destroy(image);
    io_image_destroy(found);
}

/* A text of length bytes, with line breaks, quotes and letters of 2 to 4 bytes. */
static char *long_text(size_t length)
{
    static const char part[] = "{\"a\": 1}\n\303\251\t\342\202\254 \360\237\217\224\\";
    char *const text = malloc(length + 1);
    assert_non_null(text);
    for (size_t i = 0; i < length; i++)
        text[i] = part[i % (sizeof part - 1)];
    text[length] = '\0';
    return text;
}

/* Oracle: the documented limits, and what was set: the most attributes, each of the last of two values, and
 * the longest text, are read back; one more of any is refused and changes nothing. */
static void attributes_grow_to_their_limits(void **state)
{
    (void)state;
    struct io_image *image = random_image(3, 2, 3, 1), *found;
    char *const longest = long_text(IO_IMAGE_TEXT_LIMIT), *const longer =
                                                              long_text(IO_IMAGE_TEXT_LIMIT + 1);
    char name[80];
    for (int i = 0; i < IO_IMAGE_MAX_ATTRIBUTES; i++) {
        snprintf(name, sizeof name, "dipole:%d", i);
        assert_true(io_image_set_number(image, name, i));
    }
    assert_false(io_image_set_number(image, "dipole:more", 1.0));
    assert_false(io_image_set_text(image, "dipole:more", "x"));
    assert_false(io_image_set_text(image, "dipole:7", longer));
    assert_true(io_image_set_text(image, "dipole:7", "x"));
    assert_true(io_image_set_text(image, "dipole:7", longest));
    assert_true(io_image_set_numbers(image, "dipole:8", (double[]){ 8, 9, 10 }));
    assert_int_equal(image->attribute_count, IO_IMAGE_MAX_ATTRIBUTES);
    snprintf(name, sizeof name, "dipole:%057d", 1);
    assert_false(io_image_set_number(image, name, 1.0)); /* 64 bytes */
    assert_true(io_exr_write("a.exr", image, true, NULL));
    assert_true(io_exr_read("a.exr", &found, NULL));
    assert_int_equal(found->attribute_count, IO_IMAGE_MAX_ATTRIBUTES);
    for (int i = 0; i < IO_IMAGE_MAX_ATTRIBUTES; i++) {
        snprintf(name, sizeof name, "dipole:%d", i);
        const struct io_attribute *const attribute = io_image_find(found, name);
        assert_non_null(attribute);
        if (i == 7)
            assert_string_equal(attribute->text, longest);
        else
            assert_true(attribute->numbers[0] == i && !attribute->text);
    }
    assert_true(io_image_find(found, "dipole:8")->numbers[2] == 10);
    free(longest);
    free(longer);
    io_image_destroy(image);
    io_image_destroy(found);
}

/* Oracle: the limits hold for files of others, too. */
static void too_much_in_the_header_is_refused(void **state)
{
    (void)state;
    char *const longer = long_text(IO_IMAGE_TEXT_LIMIT + 1);
    const char *const messages[] = {
        "attribute dipole:a is too much, expected at most 256 of at most 4194304 bytes",
        "attribute dipole:0 is too much, expected at most 256 of at most 4194304 bytes"
    };
    for (int i = 0; i < 2; i++) {
        struct io_image *image = random_image(3, 2, 3, 1);
        struct io_attribute many[IO_IMAGE_MAX_ATTRIBUTES + 1] = { 0 };
        for (int j = 0; j <= IO_IMAGE_MAX_ATTRIBUTES; j++) {
            many[j].kind = IO_ATTRIBUTE_NUMBER;
            snprintf(many[j].name, sizeof many[j].name, "dipole:%d", IO_IMAGE_MAX_ATTRIBUTES - j);
        }
        struct io_attribute one = { .name = "dipole:a", .kind = IO_ATTRIBUTE_TEXT, .text = longer };
        struct io_image wrong = *image;
        wrong.attributes = i == 0 ? &one : many;
        wrong.attribute_count = i == 0 ? 1 : IO_IMAGE_MAX_ATTRIBUTES + 1;
        assert_true(io_exr_write("a.exr", &wrong, false, NULL));
        io_image_destroy(image);
        dipole_status status;
        assert_false(io_exr_read("a.exr", &image, &status));
        assert_null(image);
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_string_equal(status.message, messages[i]);
    }
    free(longer);
}

/* ---- files of others ------------------------------------------------------------------------------- */

/* Write a file by the library itself: kinds that io_exr_write does not make. */
struct made {
    exr_storage_t storage;
    exr_compression_t compression;
    exr_pixel_type_t type;
    const char *channels; /* one letter each */
    int tile_size;
    int origin; /* of the data window, both axes */
};

enum { MADE_WIDTH = 37, MADE_HEIGHT = 21 };

/* What a channel holds at a pixel: a whole number, exact in all types. */
static uint32_t made_value(char channel, int x, int y)
{
    return (uint32_t)(channel % 7 * 100 + x + 3 * y);
}

static void make_exr(const char *path, const struct made *made)
{
    exr_context_t context;
    exr_context_initializer_t initializer = EXR_DEFAULT_CONTEXT_INITIALIZER;
    const exr_attr_box2i_t window = { .min = { .x = made->origin, .y = made->origin },
                                      .max = { .x = made->origin + MADE_WIDTH - 1,
                                               .y = made->origin + MADE_HEIGHT - 1 } };
    const exr_attr_v2f_t centre = { .x = 0.0f, .y = 0.0f };
    int part;
    assert_int_equal(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &initializer), 0);
    assert_int_equal(exr_add_part(context, "first", made->storage, &part), 0);
    assert_int_equal(exr_initialize_required_attr(context, 0, &window, &window, 1.0f, &centre, 1.0f,
                                                  EXR_LINEORDER_INCREASING_Y, made->compression),
                     0);
    for (const char *c = made->channels; *c; c++)
        assert_int_equal(exr_add_channel(context, 0, (char[]){ *c, '\0' }, made->type,
                                         EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1),
                         0);
    const bool is_tiled = made->storage == EXR_STORAGE_TILED;
    if (is_tiled)
        assert_int_equal(exr_set_tile_descriptor(context, 0, (uint32_t)made->tile_size,
                                                 (uint32_t)made->tile_size, EXR_TILE_ONE_LEVEL,
                                                 EXR_TILE_ROUND_DOWN),
                         0);
    assert_int_equal(exr_write_header(context), 0);
    int step_y = made->tile_size;
    if (!is_tiled)
        assert_int_equal(exr_get_scanlines_per_chunk(context, 0, &step_y), 0);
    const int step_x = is_tiled ? made->tile_size : MADE_WIDTH;
    const size_t value_size = made->type == EXR_PIXEL_HALF ? 2 : 4;
    for (int y = 0; y < MADE_HEIGHT; y += step_y) {
        for (int x = 0; x < MADE_WIDTH; x += step_x) {
            exr_chunk_info_t chunk;
            exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
            assert_int_equal(
                is_tiled ? exr_write_tile_chunk_info(context, 0, x / step_x, y / step_y, 0, 0, &chunk)
                         : exr_write_scanline_chunk_info(context, 0, made->origin + y, &chunk),
                0);
            assert_int_equal(exr_encoding_initialize(context, 0, &chunk, &pipeline), 0);
            uint8_t *planes[8] = { NULL };
            for (int c = 0; c < pipeline.channel_count; c++) {
                exr_coding_channel_info_t *channel = &pipeline.channels[c];
                planes[c] = calloc((size_t)chunk.width * (size_t)chunk.height, value_size);
                for (int i = 0; i < chunk.width * chunk.height; i++) {
                    const uint32_t whole =
                        made_value(channel->channel_name[0], x + i % chunk.width, y + i / chunk.width);
                    const float real = (float)whole;
                    int exponent;
                    const double fraction = frexp(whole, &exponent); /* 0.5 to 1, or 0 */
                    const int bits = whole ? ((exponent + 14) << 10) + (int)((fraction * 2 - 1) * 1024) : 0;
                    const uint16_t half = (uint16_t)bits;
                    const void *from = made->type == EXR_PIXEL_HALF    ? (const void *)&half
                                       : made->type == EXR_PIXEL_FLOAT ? (const void *)&real
                                                                       : (const void *)&whole;
                    memcpy(planes[c] + (size_t)i * value_size, from, value_size);
                }
                channel->user_data_type = (uint16_t)made->type;
                channel->user_bytes_per_element = (int16_t)value_size;
                channel->user_pixel_stride = (int32_t)value_size;
                channel->user_line_stride = (int32_t)value_size * chunk.width;
                channel->encode_from_ptr = planes[c];
            }
            assert_int_equal(exr_encoding_choose_default_routines(context, 0, &pipeline), 0);
            assert_int_equal(exr_encoding_run(context, 0, &pipeline), 0);
            for (int c = 0; c < pipeline.channel_count; c++)
                free(planes[c]);
            exr_encoding_destroy(context, &pipeline);
        }
    }
    exr_finish(&context);
}

/* Oracle: the values that were written, in the order R, G, B, A whatever the file's. */
static void files_of_other_programs_are_read(void **state)
{
    (void)state;
    static const struct made cases[] = {
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_NONE, EXR_PIXEL_FLOAT, "RGB", .origin = 0 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_ZIPS, EXR_PIXEL_HALF, "ABGR", .origin = -7 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_ZIP, EXR_PIXEL_UINT, "BGR", .origin = 5 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_RLE, EXR_PIXEL_HALF, "RGBZ", .origin = 100 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_PIZ, EXR_PIXEL_HALF, "RGBA", .origin = 0 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_ZIP, EXR_PIXEL_FLOAT, "ZY", .origin = 0 },
        { EXR_STORAGE_SCANLINE, EXR_COMPRESSION_ZIP, EXR_PIXEL_HALF, "Q", .origin = 0 },
        { EXR_STORAGE_TILED, EXR_COMPRESSION_ZIP, EXR_PIXEL_FLOAT, "RGB", .tile_size = 16 },
        { EXR_STORAGE_TILED, EXR_COMPRESSION_NONE, EXR_PIXEL_HALF, "RGBA", .tile_size = 8, .origin = -3 },
        { EXR_STORAGE_TILED, EXR_COMPRESSION_PIZ, EXR_PIXEL_UINT, "Y", .tile_size = 64 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct io_image *image;
        dipole_status status;
        make_exr("made.exr", &cases[i]);
        if (!io_exr_read("made.exr", &image, &status))
            fail_msg("case %zu: %s", i, status.message);
        assert_int_equal(image->width_px, MADE_WIDTH);
        assert_int_equal(image->height_px, MADE_HEIGHT);
        const char *order = !strchr(cases[i].channels, 'R')  ? strchr(cases[i].channels, 'Y') ? "Y" : "Q"
                            : strchr(cases[i].channels, 'A') ? "RGBA"
                                                             : "RGB";
        assert_int_equal(image->channel_count, strlen(order));
        const float *found = image->pixels;
        for (int y = 0; y < MADE_HEIGHT; y++)
            for (int x = 0; x < MADE_WIDTH; x++)
                for (const char *c = order; *c; c++, found++)
                    if (*found != (float)made_value(*c, x, y))
                        fail_msg("case %zu, %c at (%d, %d): %g, expected %u", i, *c, x, y, (double)*found,
                                 made_value(*c, x, y));
        io_image_destroy(image);
    }
}

static void write_small(const char *path, char **data, size_t *size, bool is_tiled)
{
    if (is_tiled) {
        make_exr(path, &(struct made){ EXR_STORAGE_TILED, EXR_COMPRESSION_ZIP, EXR_PIXEL_HALF, "RGB",
                                       .tile_size = 16 });
    } else {
        struct io_image *image = random_image(20, 40, 3, 9);
        assert_true(io_image_set_text(image, "dipole:kind", "splat1d"));
        assert_true(io_exr_write(path, image, false, NULL));
        io_image_destroy(image);
    }
    read_bytes(path, data, size);
}

static void expect_refused(const char *path, dipole_code code, const char *message)
{
    struct io_image *image;
    dipole_status status = { 0 };
    assert_false(io_exr_read(path, &image, &status));
    assert_null(image);
    assert_string_equal(status.source, path);
    assert_string_equal(status.message, message);
    assert_int_equal(status.code, code);
}

/* Oracle: the messages as a user should read them. */
static void what_cannot_be_read_is_named(void **state)
{
    (void)state;
    make_exr("made.exr", &(struct made){ EXR_STORAGE_SCANLINE, EXR_COMPRESSION_ZIP, EXR_PIXEL_HALF, "UV",
                                         .origin = 0 });
    expect_refused("made.exr", DIPOLE_NOT_SUPPORTED,
                   "has 2 channels without R, G, B or Y, expected those or a single one");
    /* Sampling of channel B: after its name, four bytes each of type and linearity. */
    char *data;
    size_t size;
    write_small("made.exr", &data, &size, false);
    char *name = memmem(data, size, "B\0\2\0\0\0", 6);
    assert_non_null(name);
    name[2 + 8] = name[2 + 12] = 2;
    assert_true(io_file_write("made.exr", data, size, NULL));
    free(data);
    expect_refused("made.exr", DIPOLE_NOT_SUPPORTED,
                   "channel B is subsampled, expected one value for each pixel");
    expect_refused("missing.exr", DIPOLE_NOT_FOUND, "cannot be read: No such file or directory");
    assert_true(io_file_write("text.exr", "{\"name\": \"not an image\"}\n", 25, NULL));
    struct io_image *image;
    dipole_status status;
    assert_false(io_exr_read("text.exr", &image, &status));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
    assert_int_equal(strncmp(status.message, "cannot be read as EXR: ", 23), 0);
    assert_true(io_file_write("empty.exr", "", 0, NULL));
    assert_false(io_exr_read("empty.exr", &image, &status));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
}

/* ---- damage ---------------------------------------------------------------------------------------- */

/* A file in memory, for the many that are damaged here: on a disk each would wait for its blocks. */
struct memory_file {
    int file;
    char path[64];
};

static struct memory_file open_memory_file(void)
{
    struct memory_file memory = { .file = memfd_create("damaged", MFD_CLOEXEC) };
    assert_true(memory.file >= 0);
    snprintf(memory.path, sizeof memory.path, "/proc/self/fd/%d", memory.file);
    return memory;
}

static void set_memory_file(const struct memory_file *memory, const char *data, size_t size)
{
    assert_int_equal(ftruncate(memory->file, (off_t)size), 0);
    assert_int_equal(pwrite(memory->file, data, size, 0), size);
}

/* Oracle: a part of a file is never the file. */
static void a_truncated_file_is_refused(void **state)
{
    (void)state;
    const struct memory_file memory = open_memory_file();
    for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
        char *data;
        size_t size;
        write_small("whole.exr", &data, &size, is_tiled);
        for (size_t length = 0; length < size; length += length < 800 ? 1 : 37) {
            struct io_image *image;
            dipole_status status = { 0 };
            set_memory_file(&memory, data, length);
            if (io_exr_read(memory.path, &image, &status))
                fail_msg("%zu of %zu bytes are taken for the whole", length, size);
            assert_null(image);
            assert_true(status.message[0]);
        }
        free(data);
    }
    close(memory.file);
}

/* Oracle: damage ends in an image or a message, never in a crash (sanitizers). */
static void damaged_files_end_in_an_image_or_a_message(void **state)
{
    (void)state;
    const struct memory_file memory = open_memory_file();
    struct rng rng = { .seed = 17 };
    for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
        char *data;
        size_t size;
        write_small("whole.exr", &data, &size, is_tiled);
        char *copy = malloc(size);
        for (int i = 0; i < 1500; i++) {
            memcpy(copy, data, size);
            const size_t reach = i % 2 ? size : 500; /* half of them in the header and the chunk table */
            for (uint64_t n = 1 + random_bits(&rng) % 3; n > 0; n--)
                copy[random_bits(&rng) % reach] = (char)random_bits(&rng);
            set_memory_file(&memory, copy, size);
            struct io_image *image;
            dipole_status status = { 0 };
            if (!io_exr_read(memory.path, &image, &status))
                assert_true(status.message[0] && !image);
            io_image_destroy(image);
        }
        free(copy);
        free(data);
    }
    close(memory.file);
}

/* ---- where it cannot be written -------------------------------------------------------------------- */

static int entry_count(void)
{
    DIR *entries = opendir(".");
    int count = 0;
    while (readdir(entries))
        count++;
    closedir(entries);
    return count;
}

/* Oracle: one message, the old file as it was, and nothing new in the folder. */
static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    struct io_image *image = random_image(64, 64, 3, 2);
    dipole_status status = { 0 };
    char *data;
    size_t size;
    assert_true(io_file_write("old.exr", "old", 3, NULL));
    const int before = entry_count();
    assert_false(io_exr_write("old.exr/out.exr", image, false, &status));
    assert_string_equal(status.source, "old.exr/out.exr");
    assert_string_equal(status.message, "cannot be written: Not a directory");
    assert_false(io_exr_write("missing/out.exr", image, false, &status));
    assert_string_equal(status.message, "cannot be written: No such file or directory");

    const pid_t child = fork();
    if (child == 0) {
        const struct rlimit limit = { .rlim_cur = 4096, .rlim_max = 4096 };
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        _exit(io_exr_write("old.exr", image, false, &status)                     ? 1
              : strcmp(status.message, "cannot be written: File too large") != 0 ? 2
                                                                                 : 0);
    }
    int result;
    waitpid(child, &result, 0);
    assert_true(WIFEXITED(result));
    assert_int_equal(WEXITSTATUS(result), 0);
    read_bytes("old.exr", &data, &size);
    assert_string_equal(data, "old");
    assert_int_equal(entry_count(), before);
    free(data);
    io_image_destroy(image);
}

/* ---- checked before it has its name ----------------------------------------------------------------- */

struct watch {
    const struct io_image *image; /* what the file must hold */
    bool is_good;
    int calls;
};

static bool watch_file(void *context, const char *path, dipole_status *status)
{
    struct watch *const watch = context;
    struct io_image *found;
    watch->calls++;
    assert_string_not_equal(path, "checked.exr");
    assert_true(io_exr_read(path, &found, NULL));
    expect_same(found, watch->image);
    assert_int_equal(found->attribute_count, 1);
    assert_string_equal(found->attributes[0].text, "value");
    io_image_destroy(found);
    const dipole_place place = { .source = path };
    return watch->is_good || dipole_fail(status, DIPOLE_NOT_CONVERGED, &place, "is refused");
}

/* Oracle: the picture itself, read back by the check; what it refuses leaves the old file, and no other. A
 * picture that cannot be written is not looked at. */
static void a_check_reads_the_picture_before_it_has_its_name(void **state)
{
    (void)state;
    struct io_image *const image = random_image(40, 30, 3, 5);
    assert_true(io_image_set_text(image, "dipole:x", "value"));
    struct watch watch = { .image = image, .is_good = true };
    char *plain, *checked;
    size_t plain_size, checked_size;
    dipole_status status = { 0 };
    assert_true(io_exr_write("plain.exr", image, false, NULL));
    read_bytes("plain.exr", &plain, &plain_size);
    const int before = entry_count();
    for (int round = 0; round < 3; round++) {
        watch.is_good = round == 1;
        assert_true(io_exr_write_checked("checked.exr", image, false, watch_file, &watch, &status) ==
                    watch.is_good);
        assert_int_equal(watch.calls, round + 1);
        assert_int_equal(entry_count(), before + (round > 0));
        if (!watch.is_good) {
            assert_int_equal(status.code, DIPOLE_NOT_CONVERGED);
            assert_string_equal(status.source, "checked.exr");
            assert_string_equal(status.message, "is refused");
        }
        if (round > 0) {
            read_bytes("checked.exr", &checked, &checked_size);
            assert_int_equal(checked_size, plain_size);
            assert_memory_equal(checked, plain, plain_size);
            free(checked);
        }
        status = (dipole_status){ 0 };
    }
    assert_true(io_exr_write_checked("checked.exr", image, false, NULL, NULL, NULL));
    image->pixels[7] = 1e5f;
    assert_false(io_exr_write_checked("checked.exr", image, true, watch_file, &watch, NULL));
    assert_false(io_exr_write_checked("missing/checked.exr", image, false, watch_file, &watch, NULL));
    assert_int_equal(watch.calls, 3);
    assert_int_equal(entry_count(), before + 1);
    free(plain);
    io_image_destroy(image);
    assert_int_equal(unlink("checked.exr") | unlink("plain.exr"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_outside_the_limits_are_refused),
        cmocka_unit_test(floats_are_read_back_bit_by_bit),
        cmocka_unit_test(chunks_that_do_not_compress_are_read_back),
        cmocka_unit_test(halves_are_rounded_to_nearest_even),
        cmocka_unit_test(a_value_over_the_largest_half_is_refused),
        cmocka_unit_test(attributes_are_read_back),
        cmocka_unit_test(attributes_grow_to_their_limits),
        cmocka_unit_test(too_much_in_the_header_is_refused),
        cmocka_unit_test(files_of_other_programs_are_read),
        cmocka_unit_test(what_cannot_be_read_is_named),
        cmocka_unit_test(a_truncated_file_is_refused),
        cmocka_unit_test(damaged_files_end_in_an_image_or_a_message),
        cmocka_unit_test(what_cannot_be_written_is_named),
        cmocka_unit_test(a_check_reads_the_picture_before_it_has_its_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
