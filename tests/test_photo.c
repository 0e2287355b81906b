#include "fit/photo.h"

#include "check.h"

#include <stdlib.h>
#include <string.h>

/* Files of each format byte by byte from their specifications, so that no encoder stands between the codes
 * and the test. */

enum { SIDE_LIMIT = 1 << 16 };

struct bytes {
    unsigned char data[SIDE_LIMIT];
    size_t count;
};

static void add(struct bytes *bytes, unsigned value)
{
    assert_true(bytes->count < SIDE_LIMIT);
    bytes->data[bytes->count++] = (unsigned char)(value & 0xffu);
}

static void add_big(struct bytes *bytes, uint32_t value, int size)
{
    for (int i = size - 1; i >= 0; i--)
        add(bytes, value >> (8 * i));
}

static void add_little(struct bytes *bytes, uint32_t value, int size)
{
    for (int i = 0; i < size; i++)
        add(bytes, value >> (8 * i));
}

static void add_text(struct bytes *bytes, const char *text)
{
    for (; *text; text++)
        add(bytes, (unsigned char)*text);
}

static void save(const char *path, const struct bytes *bytes)
{
    FILE *const file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes->data, 1, bytes->count, file), bytes->count);
    assert_int_equal(fclose(file), 0);
}

/* Codes of a small picture, interleaved. */
enum { WIDTH = 4, HEIGHT = 2, PIXELS = WIDTH * HEIGHT };
struct codes {
    int bits, channel_count;
    uint32_t values[4 * PIXELS];
};

static void codes_init(struct codes *codes, int bits, int channel_count)
{
    static const double shares[] = { 0, 1, 0.5, 0.04, 0.02, 0.9, 0.2, 0.7, 0.001, 0.3 };
    *codes = (struct codes){ .bits = bits, .channel_count = channel_count };
    for (int i = 0; i < PIXELS * channel_count; i++)
        codes->values[i] = (uint32_t)(shares[i % 10] * (ldexp(1, bits) - 1));
}

/* ---- PNG: stored blocks ------------------------------------------------------------------------------ */

static uint32_t crc_of(const unsigned char *data, size_t count)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < count; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
    }
    return ~crc;
}

static void add_chunk(struct bytes *bytes, const char *name, const struct bytes *content)
{
    add_big(bytes, (uint32_t)content->count, 4);
    const size_t start = bytes->count;
    add_text(bytes, name);
    for (size_t i = 0; i < content->count; i++)
        add(bytes, content->data[i]);
    add_big(bytes, crc_of(bytes->data + start, bytes->count - start), 4);
}

static void save_png(const char *path, const struct codes *codes)
{
    static struct bytes file, header, raw, packed, nothing;
    file.count = header.count = raw.count = packed.count = nothing.count = 0;
    add_big(&header, WIDTH, 4);
    add_big(&header, HEIGHT, 4);
    add(&header, (unsigned)codes->bits);
    add(&header, codes->channel_count == 1 ? 0 : codes->channel_count == 3 ? 2 : 6);
    add_big(&header, 0, 3);
    for (int i = 0; i < PIXELS * codes->channel_count; i++) {
        if (i % (WIDTH * codes->channel_count) == 0)
            add(&raw, 0); /* no filter */
        add_big(&raw, codes->values[i], codes->bits / 8);
    }
    uint32_t a = 1, b = 0;
    add_big(&packed, 0x7801, 2);
    add(&packed, 1);
    add_little(&packed, (uint32_t)raw.count, 2);
    add_little(&packed, ~(uint32_t)raw.count, 2);
    for (size_t i = 0; i < raw.count; i++) {
        add(&packed, raw.data[i]);
        a = (a + raw.data[i]) % 65521;
        b = (b + a) % 65521;
    }
    add_big(&packed, b << 16 | a, 4);
    add_text(&file, "\x89PNG\r\n\x1a\n");
    add_chunk(&file, "IHDR", &header);
    add_chunk(&file, "IDAT", &packed);
    add_chunk(&file, "IEND", &nothing);
    save(path, &file);
}

/* ---- TIFF: one strip --------------------------------------------------------------------------------- */

/* is_float: the values are bits of floats. */
static void save_tiff(const char *path, const struct codes *codes, bool is_float)
{
    static struct bytes file;
    enum { ENTRIES = 10, TABLE = 8, EXTRA = TABLE + 2 + 12 * ENTRIES + 4, DATA = EXTRA + 16 };
    const unsigned channels = (unsigned)codes->channel_count;
    const uint32_t size = (uint32_t)(PIXELS * codes->channel_count * codes->bits / 8);
    const uint32_t entries[ENTRIES][4] = {
        { 256, 4, 1, WIDTH },
        { 257, 4, 1, HEIGHT },
        { 258, 3, channels, channels == 1 ? (uint32_t)codes->bits : EXTRA },
        { 259, 3, 1, 1 },
        { 262, 3, 1, channels == 1 ? 1 : 2 }, /* grey, with 0 black; rgb */
        { 273, 4, 1, DATA },
        { 277, 3, 1, channels },
        { 278, 4, 1, HEIGHT },
        { 279, 4, 1, size },
        { 339, 3, channels, channels == 1 ? (is_float ? 3 : 1) : EXTRA + 8 },
    };
    file.count = 0;
    add_text(&file, "II*");
    add(&file, 0);
    add_little(&file, TABLE, 4);
    add_little(&file, ENTRIES, 2);
    for (int i = 0; i < ENTRIES; i++) {
        add_little(&file, entries[i][0], 2);
        add_little(&file, entries[i][1], 2);
        add_little(&file, entries[i][2], 4);
        add_little(&file, entries[i][3], 4);
    }
    add_little(&file, 0, 4);
    for (int i = 0; i < 4; i++)
        add_little(&file, (uint32_t)codes->bits, 2);
    for (int i = 0; i < 4; i++)
        add_little(&file, is_float ? 3 : 1, 2);
    for (int i = 0; i < PIXELS * codes->channel_count; i++)
        add_little(&file, codes->values[i], codes->bits / 8);
    save(path, &file);
}

/* ---- JPEG: blocks of one value each ------------------------------------------------------------------ */

struct bits {
    struct bytes *bytes;
    uint32_t pending;
    int count;
};

static void add_bits(struct bits *bits, uint32_t value, int count)
{
    for (int i = count - 1; i >= 0; i--) {
        bits->pending = bits->pending << 1 | (value >> i & 1u);
        if (++bits->count == 8) {
            add(bits->bytes, bits->pending);
            if ((bits->pending & 0xffu) == 0xff)
                add(bits->bytes, 0);
            bits->pending = 0;
            bits->count = 0;
        }
    }
}

/* Grey, a row of 8 x 8 blocks. All quantisers are 8, so that a block of level v has the DC v - 128. */
static void save_jpeg(const char *path, const int *levels, int block_count)
{
    static struct bytes file;
    file.count = 0;
    add_big(&file, 0xffd8, 2);
    add_big(&file, 0xffdb0043, 4);
    add(&file, 0);
    for (int i = 0; i < 64; i++)
        add(&file, 8);
    add_big(&file, 0xffc0000b, 4);
    add(&file, 8);
    add_big(&file, 8, 2);
    add_big(&file, (uint32_t)(8 * block_count), 2);
    add_big(&file, 0x01011100, 4);
    /* sizes 0 to 8 of DC have codes of 4 bits; the end of AC has one of 1 bit */
    add_big(&file, 0xffc4001c, 4);
    add(&file, 0x00);
    for (int length = 1; length <= 16; length++)
        add(&file, length == 4 ? 9 : 0);
    for (unsigned size = 0; size < 9; size++)
        add(&file, size);
    add_big(&file, 0xffc40014, 4);
    add(&file, 0x10);
    for (int length = 1; length <= 16; length++)
        add(&file, length == 1);
    add(&file, 0);
    add_big(&file, 0xffda0008, 4);
    add_big(&file, 0x010100, 3);
    add_big(&file, 0x003f00, 3);
    struct bits bits = { .bytes = &file };
    int before = 0;
    for (int i = 0; i < block_count; i++) {
        const int difference = levels[i] - 128 - before, magnitude = abs(difference);
        int size = 0;
        while (magnitude >> size)
            size++;
        add_bits(&bits, (uint32_t)size, 4);
        add_bits(&bits, (uint32_t)(difference >= 0 ? difference : difference + (1 << size) - 1), size);
        add_bits(&bits, 0, 1);
        before = levels[i] - 128;
    }
    while (bits.count > 0)
        add_bits(&bits, 1, 1);
    add_big(&file, 0xffd9, 2);
    save(path, &file);
}

/* ---- what is read ------------------------------------------------------------------------------------ */

static double from_srgb(double code)
{
    return code <= 0.04045 ? code / 12.92 : pow((code + 0.055) / 1.055, 2.4);
}

static void read(const char *path, bool is_linear, double exposure, struct fit_photo *out)
{
    dipole_status status;
    if (!fit_photo_read(path, is_linear, exposure, out, &status))
        fail_msg("%s: %s", path, status.message);
}

/* Oracle: the codes by formula, over the exposure; grey is three equal channels, alpha is multiplied in.
 * 2e-6: what is read are floats. */
static void check_codes(const char *path, const struct codes *codes, bool is_linear)
{
    static const double exposure = 2.5;
    struct fit_photo photo;
    const double top = ldexp(1, codes->bits) - 1;
    read(path, is_linear, exposure, &photo);
    assert_int_equal(photo.bits, codes->bits);
    assert_int_equal(photo.is_srgb, !is_linear);
    assert_true(photo.exposure == exposure);
    assert_false(photo.is_rendered);
    assert_true(isinf(photo.cut_mm));
    assert_close(photo.systematic.scale, 0.01, 1e-12, "scale of a camera");
    assert_close(photo.systematic.tile, 0.005, 1e-12, "flat field of a camera");
    assert_int_equal(photo.image->width_px, WIDTH);
    assert_int_equal(photo.image->height_px, HEIGHT);
    assert_int_equal(photo.image->channel_count, codes->channel_count == 4 ? 4 : 3);
    for (int i = 0; i < PIXELS; i++) {
        const uint32_t *const pixel = codes->values + i * codes->channel_count;
        const double alpha = codes->channel_count == 4 ? pixel[3] / top : 1;
        for (int c = 0; c < 3; c++) {
            const double code = pixel[codes->channel_count == 1 ? 0 : c];
            const double expected = (is_linear ? code / top : from_srgb(code / top)) / exposure;
            const double found = (double)photo.image->pixels[i * photo.image->channel_count + c];
            assert_close(found, alpha * expected, 2e-6, "%s, pixel %d", path, i);
            assert_close(fit_photo_value(&photo, code), expected, 1e-12, "%s, code %g", path, code);
        }
    }
    fit_photo_destroy(&photo);
    assert_null(photo.image);
}

static void integers_are_codes_over_the_exposure(void **state)
{
    (void)state;
    struct codes codes;
    for (int bits = 8; bits <= 16; bits += 8) {
        for (int is_linear = 0; is_linear < 2; is_linear++) {
            static const int channel_counts[] = { 1, 3, 4 };
            for (int i = 0; i < 3; i++) {
                codes_init(&codes, bits, channel_counts[i]);
                save_png("codes.png", &codes);
                check_codes("codes.png", &codes, is_linear);
                if (channel_counts[i] == 4)
                    continue;
                save_tiff("codes.tif", &codes, false);
                check_codes("codes.tif", &codes, is_linear);
            }
        }
    }
}

/* Oracle: numbers stand as they are, whatever the exposure, beyond 1 and below 0, too. */
static void numbers_are_as_they_stand(void **state)
{
    (void)state;
    static const float values[] = { 0, 1, 0.5f, 1e-6f, 70000, -0.25f };
    for (int channel_count = 1; channel_count <= 3; channel_count += 2) {
        struct codes codes = { .bits = 32, .channel_count = channel_count };
        for (int i = 0; i < PIXELS * channel_count; i++)
            memcpy(&codes.values[i], &values[i % 6], sizeof values[0]);
        save_tiff("numbers.tif", &codes, true);
        for (int is_linear = 0; is_linear < 2; is_linear++) {
            struct fit_photo photo;
            read("numbers.tif", is_linear, 4, &photo);
            assert_int_equal(photo.bits, 0);
            assert_false(photo.is_srgb);
            assert_true(photo.exposure == 1);
            for (int i = 0; i < PIXELS * 3; i++)
                assert_true(photo.image->pixels[i] == values[(channel_count == 1 ? i / 3 : i) % 6]);
            fit_photo_destroy(&photo);
        }
    }
}

/* Oracle: Ward's format: mantissas over 256 times two to the exponent less 128 (decoders may put a half
 * into the mantissa: 1/256 of the largest). */
static void radiance_pictures_are_numbers(void **state)
{
    (void)state;
    static struct bytes file;
    static const unsigned pixels[][4] = { { 128, 64, 200, 129 },
                                          { 255, 3, 130, 120 },
                                          { 140, 150, 160, 140 } };
    file.count = 0;
    add_text(&file, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 3\n");
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 4; k++)
            add(&file, pixels[i][k]);
    }
    save("lamp.hdr", &file);
    struct fit_photo photo;
    read("lamp.hdr", false, 3, &photo);
    assert_int_equal(photo.bits, 0);
    assert_true(photo.exposure == 1);
    for (int i = 0; i < 3; i++) {
        const double unit = ldexp(1, (int)pixels[i][3] - 128 - 8);
        for (int c = 0; c < 3; c++) {
            const double found = (double)photo.image->pixels[3 * i + c];
            assert_true(fabs(found - unit * pixels[i][c]) <= unit);
        }
    }
    fit_photo_destroy(&photo);
}

/* Oracle: the levels that the blocks were made of: sRGB codes of 8 bits; a decoder may round by one. */
static void jpeg_is_srgb_of_eight_bits(void **state)
{
    (void)state;
    static const int levels[] = { 128, 130, 20, 250, 77, 0, 255, 128 };
    struct fit_photo photo;
    save_jpeg("blocks.jpg", levels, 8);
    read("blocks.jpg", false, 0.5, &photo);
    assert_int_equal(photo.bits, 8);
    assert_true(photo.is_srgb);
    assert_int_equal(photo.image->width_px, 64);
    assert_int_equal(photo.image->channel_count, 3);
    for (int i = 0; i < 64; i++) {
        for (int c = 0; c < 3; c++) {
            const double found = (double)photo.image->pixels[3 * (64 * 3 + i) + c];
            const double low = fmax(levels[i / 8] - 1, 0), high = fmin(levels[i / 8] + 1, 255);
            assert_true(found >= from_srgb(low / 255) / 0.5 - 1e-6);
            assert_true(found <= from_srgb(high / 255) / 0.5 + 1e-6);
        }
    }
    fit_photo_destroy(&photo);
}

/* Oracle: photo.h: what render says about its picture; stated bounds as deviations of even distributions,
 * with what no bound covers on top. */
static void an_exr_keeps_what_render_says(void **state)
{
    (void)state;
    struct io_image *image;
    struct fit_photo photo;
    assert_true(io_image_create(3, 2, 4, &image, NULL));
    for (int i = 0; i < 24; i++)
        image->pixels[i] = 0.1f * (float)i;
    assert_true(io_exr_write("plain.exr", image, false, NULL));
    read("plain.exr", false, 7, &photo);
    assert_int_equal(photo.bits, 0);
    assert_true(photo.exposure == 1 && !photo.is_rendered && !photo.has_model && isinf(photo.cut_mm));
    assert_memory_equal(photo.image->pixels, image->pixels, 24 * sizeof(float));
    fit_photo_destroy(&photo);

    assert_true(io_image_set_number(image, "dipole:epsilon", 1e-3) &&
                io_image_set_number(image, "dipole:error_estimated", 2e-3) &&
                io_image_set_text(image, "dipole:model", "modes"));
    assert_true(io_exr_write("lut.EXR", image, false, NULL));
    read("lut.EXR", false, 7, &photo);
    assert_true(photo.is_rendered && photo.has_model);
    assert_int_equal(photo.model, DIPOLE_MODEL_MODES);
    assert_true(isinf(photo.cut_mm) && isinf(photo.linear_limit));
    const double by_estimate = hypot(2e-3 / sqrt(3), 2e-4);
    assert_close(photo.systematic.scale, by_estimate, 1e-12, "scale");
    assert_close(photo.systematic.tile, by_estimate, 1e-12, "tile");
    assert_close(photo.systematic.offset, 4e-4, 1e-12, "offset");
    fit_photo_destroy(&photo);

    assert_true(io_image_set_number(image, "dipole:spacing_mm", 0.25) &&
                io_image_set_number(image, "dipole:r_max_mm", 12.5) &&
                io_image_set_number(image, "dipole:table_error", 3e-4) &&
                io_image_set_number(image, "dipole:banding_error", 1e-4) &&
                io_image_set_number(image, "dipole:blur_error", 5e-4) &&
                io_image_set_text(image, "dipole:model", "nonsense"));
    assert_true(io_exr_write("splat.exr", image, false, NULL));
    read("splat.exr", true, 7, &photo);
    assert_true(photo.is_rendered && !photo.has_model);
    assert_true(photo.cut_mm == 12.5);
    assert_close(photo.systematic.scale, hypot(9e-4 / sqrt(3), 2e-4), 1e-12, "scale");
    fit_photo_destroy(&photo);

    /* numbers that are none do not count */
    assert_true(io_image_set_number(image, "dipole:r_max_mm", -1) &&
                io_image_set_number(image, "dipole:epsilon", INFINITY));
    assert_true(io_exr_write("odd.exr", image, false, NULL));
    read("odd.exr", true, 7, &photo);
    assert_true(!photo.is_rendered && isinf(photo.cut_mm));
    fit_photo_destroy(&photo);
    io_image_destroy(image);
}

/* Oracle: grey EXR becomes three equal channels and keeps its attributes' meaning. */
static void a_grey_exr_has_three_channels(void **state)
{
    (void)state;
    struct io_image *image;
    struct fit_photo photo;
    assert_true(io_image_create(3, 2, 1, &image, NULL));
    for (int i = 0; i < 6; i++)
        image->pixels[i] = (float)i;
    assert_true(io_image_set_number(image, "dipole:epsilon", 1e-3));
    assert_true(io_exr_write("grey.exr", image, false, NULL));
    read("grey.exr", false, 1, &photo);
    assert_int_equal(photo.image->channel_count, 3);
    for (int i = 0; i < 18; i++)
        assert_true(photo.image->pixels[i] == (float)(i / 3));
    assert_true(photo.is_rendered);
    fit_photo_destroy(&photo);
    io_image_destroy(image);
}

/* Oracle: photo.h; a status that names the file, nothing to destroy. */
static void what_is_no_picture_is_refused(void **state)
{
    (void)state;
    static struct bytes file;
    static const char *const names[] = { "text.png", "text.exr",    "text.jpg",
                                         "text.tif", "missing.png", "missing.exr" };
    file.count = 0;
    add_text(&file, "no picture at all");
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct fit_photo photo;
        dipole_status status = { .code = DIPOLE_OK };
        if (strncmp(names[i], "text", 4) == 0)
            save(names[i], &file);
        assert_false(fit_photo_read(names[i], false, 1, &photo, &status));
        assert_true(status.code != DIPOLE_OK);
        assert_string_equal(status.source, names[i]);
        assert_null(photo.image);
        assert_false(fit_photo_read(names[i], false, 1, &photo, NULL));
    }
}

/* Oracle: means by hand, of squares of 3 x 3; a clipped value, and one that is none, are not meaned away; a
 * size that is no multiple is left alone. A mask is bright where all of a square is. */
static void larger_pictures_are_meaned(void **state)
{
    (void)state;
    struct fit_photo photo = { .bits = 8, .exposure = 1, .linear_limit = INFINITY };
    assert_true(io_image_create(6, 3, 3, &photo.image, NULL));
    for (size_t i = 0; i < 6 * 3 * 3; i++)
        photo.image->pixels[i] = (float)i / 100;
    photo.image->pixels[3 * (6 + 5) + 1] = 1;
    photo.image->pixels[3 * (6 + 4) + 2] = NAN;
    assert_true(fit_photo_reduce(&photo, 4, 2, NULL));
    assert_int_equal(photo.image->width_px, 6);
    assert_true(fit_photo_reduce(&photo, 2, 1, NULL));
    assert_int_equal(photo.image->width_px, 2);
    assert_int_equal(photo.image->height_px, 1);
    /* the first channel of pixel (x, y) is (18 y + 3 x) / 100, its mean that of the middle pixel */
    assert_close((double)photo.image->pixels[0], 0.21, 1e-6, "mean");
    assert_close((double)photo.image->pixels[3], 0.30, 1e-6, "mean");
    assert_close((double)photo.image->pixels[4], 1, 0, "clipped");
    assert_true(isnan(photo.image->pixels[5]));
    fit_photo_destroy(&photo);

    struct io_image *mask;
    assert_true(io_image_create(4, 2, 1, &mask, NULL));
    for (size_t i = 0; i < 8; i++)
        mask->pixels[i] = i != 5;
    assert_true(fit_mask_reduce(&mask, 2, 1, NULL));
    assert_int_equal(mask->width_px, 2);
    assert_true(mask->pixels[0] == 0 && mask->pixels[1] == 1);
    io_image_destroy(mask);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(larger_pictures_are_meaned),
        cmocka_unit_test(integers_are_codes_over_the_exposure),
        cmocka_unit_test(numbers_are_as_they_stand),
        cmocka_unit_test(radiance_pictures_are_numbers),
        cmocka_unit_test(jpeg_is_srgb_of_eight_bits),
        cmocka_unit_test(an_exr_keeps_what_render_says),
        cmocka_unit_test(a_grey_exr_has_three_channels),
        cmocka_unit_test(what_is_no_picture_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
