#include "tests/check.h"

#include "io/file.h"
#include "io/image.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static struct io_image *grey_ramp(int count)
{
    struct io_image *image;
    assert_true(io_image_create(count, 1, 3, &image, NULL));
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            image->pixels[3 * i + c] = (float)i / (float)(count - 1);
    return image;
}

static void read_bytes(const char *path, char **data, size_t *size)
{
    assert_true(io_file_read(path, (size_t)1 << 26, data, size, NULL));
}

static double linear_from_srgb(double srgb)
{
    return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4);
}

/* Oracle: IEC 61966-2-1. Each of the 256 codes has its own linear value; between two of them the code
 * changes where the curve passes the middle. */
static void every_code_is_the_nearest(void **state)
{
    (void)state;
    struct io_image *image, *found;
    dipole_status status;
    assert_true(io_image_create(256, 3, 3, &image, NULL));
    for (int code = 0; code < 256; code++) {
        const double steps[3] = { 0.0, -0.49, 0.49 };
        for (int row = 0; row < 3; row++)
            for (int c = 0; c < 3; c++)
                image->pixels[(row * 256 + code) * 3 + c] =
                    (float)linear_from_srgb((code + steps[row]) / 255.0);
    }
    assert_true(io_png_write("codes.png", image, &status));
    assert_true(io_photo_read("codes.png", IO_PHOTO_SRGB, NULL, &found, &status));
    assert_int_equal(found->width_px, 256);
    assert_int_equal(found->height_px, 3);
    assert_int_equal(found->channel_count, 3);
    for (int i = 0; i < 3 * 256 * 3; i++) /* what is read is a code over 255, rounded to float on the way */
        assert_close((double)found->pixels[i], linear_from_srgb(i / 3 % 256 / 255.0), 2e-6, "value %d", i);
    io_image_destroy(image);
    io_image_destroy(found);
}

/* Oracle: values beyond the range of the format lie at its ends. */
static void values_out_of_range_are_clamped(void **state)
{
    (void)state;
    static const float values[5] = { -1.0f, NAN, 1.5f, INFINITY, -INFINITY };
    struct io_image *image, *found;
    assert_true(io_image_create(5, 1, 1, &image, NULL));
    memcpy(image->pixels, values, sizeof values);
    assert_true(io_png_write("clamped.png", image, NULL));
    assert_true(io_photo_read("clamped.png", IO_PHOTO_SRGB, NULL, &found, NULL));
    assert_int_equal(found->channel_count, 1);
    static const float expected[5] = { 0.0f, 0.0f, 1.0f, 1.0f, 0.0f };
    assert_memory_equal(found->pixels, expected, sizeof expected);
    io_image_destroy(image);
    io_image_destroy(found);
}

/* Oracle: colour times alpha, within the rounding of both to 8 bits. */
static void alpha_is_premultiplied_in_memory(void **state)
{
    (void)state;
    struct io_image *image, *found;
    assert_true(io_image_create(16, 1, 4, &image, NULL));
    for (int i = 0; i < 16; i++) {
        const float alpha = (float)i / 15.0f;
        const float pixel[4] = { 0.8f * alpha, 0.2f * alpha, 0.0f, alpha };
        memcpy(image->pixels + 4 * i, pixel, sizeof pixel);
    }
    assert_true(io_png_write("alpha.png", image, NULL));
    assert_true(io_photo_read("alpha.png", IO_PHOTO_SRGB, NULL, &found, NULL));
    assert_int_equal(found->channel_count, 4);
    for (int i = 0; i < 64; i++)
        assert_true(fabsf(found->pixels[i] - image->pixels[i]) < 0.006f);
    io_image_destroy(image);
    io_image_destroy(found);
}

/* Oracle: what is written to a file. */
static void what_is_encoded_is_what_is_written(void **state)
{
    (void)state;
    struct io_image *image = grey_ramp(77);
    unsigned char *encoded;
    char *written;
    size_t encoded_size, written_size;
    assert_true(io_png_encode(image, &encoded, &encoded_size, NULL));
    assert_true(io_png_write("encoded.png", image, NULL));
    read_bytes("encoded.png", &written, &written_size);
    assert_int_equal(encoded_size, written_size);
    assert_memory_equal(encoded, written, written_size);
    free(encoded);
    free(written);
    io_image_destroy(image);
}

/* Oracle: identical pictures make identical files, which tell nothing of when and by what they were made.
 */
static void the_same_picture_gives_the_same_bytes(void **state)
{
    (void)state;
    struct io_image *image = grey_ramp(300);
    char *first, *second;
    size_t first_size, second_size;
    assert_true(io_image_set_text(image, "dipole:kind", "not kept"));
    assert_true(io_png_write("first.png", image, NULL));
    sleep(1); /* a time stamp would differ */
    assert_true(io_png_write("second.png", image, NULL));
    read_bytes("first.png", &first, &first_size);
    read_bytes("second.png", &second, &second_size);
    assert_int_equal(first_size, second_size);
    assert_memory_equal(first, second, first_size);
    static const char *const chunks[] = { "tIME", "eXIf", "Software", "DateTime", "OpenImageIO" };
    for (size_t i = 0; i < sizeof chunks / sizeof chunks[0]; i++)
        assert_null(memmem(first, first_size, chunks[i], strlen(chunks[i])));
    free(first);
    free(second);
    io_image_destroy(image);
}

/* Oracle: a linear format is read as it was written, bit by bit. */
static void an_exr_is_read_without_a_curve(void **state)
{
    (void)state;
    struct io_image *image = grey_ramp(100), *found;
    image->pixels[7] = 1234.5f;
    image->pixels[8] = -0.25f;
    assert_true(io_exr_write("linear.exr", image, false, NULL));
    assert_true(io_photo_read("linear.exr", IO_PHOTO_SRGB, NULL, &found, NULL));
    assert_memory_equal(found->pixels, image->pixels, 300 * sizeof(float));
    io_image_destroy(image);
    io_image_destroy(found);
}

/* Oracle: a TIFF file written here by hand, one row of two pixels, 16 bits each, little-endian: taken as
 * sRGB. */
static void sixteen_bits_are_srgb(void **state)
{
    (void)state;
    enum { PIXELS = 8, BITS = 20, ENTRIES = 26, COUNT = 9 };
    static const uint16_t codes[6] = { 0x8000, 0xffff, 0, 0x2000, 0x1000, 0x800 }, bits[3] = { 16, 16, 16 };
    static const uint16_t entries[COUNT][6] = {
        /* tag, type (3: 16 bits), count, value */
        { 256, 3, 1, 0, 2, 0 },                              /* width            */
        { 257, 3, 1, 0, 1, 0 },                              /* height           */
        { 258, 3, 3, 0, BITS, 0 },                           /* bits per sample  */
        { 259, 3, 1, 0, 1, 0 },                              /* no compression   */
        { 262, 3, 1, 0, 2, 0 },                              /* RGB              */
        { 273, 3, 1, 0, PIXELS, 0 }, { 277, 3, 1, 0, 3, 0 }, /* samples            */
        { 278, 3, 1, 0, 1, 0 },                              /* rows in the strip  */
        { 279, 3, 1, 0, 12, 0 },                             /* bytes in the strip */
    };
    static const uint16_t count = COUNT;
    char file[ENTRIES + 2 + sizeof entries + 4] = "II*\0\x1a";
    memcpy(file + PIXELS, codes, sizeof codes);
    memcpy(file + BITS, bits, sizeof bits);
    memcpy(file + ENTRIES, &count, sizeof count);
    memcpy(file + ENTRIES + 2, entries, sizeof entries);
    struct io_image *image;
    dipole_status status;
    assert_true(io_file_write("deep.tif", file, sizeof file, NULL));
    if (!io_photo_read("deep.tif", IO_PHOTO_SRGB, NULL, &image, &status))
        fail_msg("%s", status.message);
    assert_int_equal(image->width_px, 2);
    for (int i = 0; i < 6; i++)
        assert_close((double)image->pixels[i], linear_from_srgb(codes[i] / 65535.0), 2e-6, "value %d", i);
    io_image_destroy(image);
}

static void expect_unreadable(const char *path, dipole_code code, const char *message)
{
    struct io_image *image;
    dipole_status status = { 0 };
    assert_false(io_photo_read(path, IO_PHOTO_SRGB, NULL, &image, &status));
    assert_null(image);
    assert_int_equal(status.code, code);
    assert_string_equal(status.source, path);
    assert_int_equal(strncmp(status.message, message, strlen(message)), 0);
}

/* Oracle: the beginnings of the messages; their ends are OpenImageIO's. */
static void what_cannot_be_read_is_named(void **state)
{
    (void)state;
    char *data;
    size_t size;
    struct io_image *image = grey_ramp(300);
    assert_true(io_file_write("text.png", "not a picture", 13, NULL));
    assert_true(io_png_write("whole.png", image, NULL));
    read_bytes("whole.png", &data, &size);
    assert_true(io_file_write("part.png", data, size / 2, NULL));
    expect_unreadable("missing.png", DIPOLE_NOT_FOUND, "cannot be read: No such file or directory");
    expect_unreadable("text.png", DIPOLE_BAD_SYNTAX, "cannot be read as an image: ");
    expect_unreadable("part.png", DIPOLE_BAD_SYNTAX,
                      "cannot be read as an image: the PNG is damaged or cut at byte ");
    data[size - 20] ^= 1; /* in the last checksum but one */
    assert_true(io_file_write("bent.png", data, size, NULL));
    expect_unreadable("bent.png", DIPOLE_BAD_SYNTAX,
                      "cannot be read as an image: the PNG is damaged or cut at byte ");
    free(data);
    io_image_destroy(image);
}

/* Oracle: one message, and the old file as it was. */
static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    struct io_image *image = grey_ramp(2000);
    dipole_status status;
    char *data;
    size_t size;
    assert_true(io_file_write("old.png", "old", 3, NULL));
    assert_false(io_png_write("missing/out.png", image, &status));
    assert_string_equal(status.source, "missing/out.png");
    assert_string_equal(status.message, "cannot be written: No such file or directory");
    const pid_t child = fork();
    if (child == 0) {
        const struct rlimit limit = { .rlim_cur = 100, .rlim_max = 100 };
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        _exit(io_png_write("old.png", image, &status)                            ? 1
              : strcmp(status.message, "cannot be written: File too large") != 0 ? 2
                                                                                 : 0);
    }
    int result;
    waitpid(child, &result, 0);
    assert_true(WIFEXITED(result));
    assert_int_equal(WEXITSTATUS(result), 0);
    read_bytes("old.png", &data, &size);
    assert_string_equal(data, "old");
    free(data);
    io_image_destroy(image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_code_is_the_nearest),
        cmocka_unit_test(values_out_of_range_are_clamped),
        cmocka_unit_test(alpha_is_premultiplied_in_memory),
        cmocka_unit_test(what_is_encoded_is_what_is_written),
        cmocka_unit_test(the_same_picture_gives_the_same_bytes),
        cmocka_unit_test(an_exr_is_read_without_a_curve),
        cmocka_unit_test(sixteen_bits_are_srgb),
        cmocka_unit_test(what_cannot_be_read_is_named),
        cmocka_unit_test(what_cannot_be_written_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
