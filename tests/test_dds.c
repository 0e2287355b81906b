#include "tests/table_files.h"

#include "io/dds.h"

/* ---- a reader of our own, from the documented layout ---------------------------------------------- */

/* The words of "DDS ", DDS_HEADER and DDS_HEADER_DXT10, by their names in Microsoft's documentation. */
struct dds_file {
    uint32_t dwMagic, dwSize, dwFlags, dwHeight, dwWidth, dwPitchOrLinearSize, dwDepth, dwMipMapCount;
    uint32_t dwReserved1[11];
    uint32_t ddspfSize, ddspfFlags, ddspfFourCC, ddspfRGBBitCount, ddspfMasks[4];
    uint32_t dwCaps, dwCaps2, dwCaps3, dwCaps4, dwReserved2;
    uint32_t dxgiFormat, resourceDimension, miscFlag, arraySize, miscFlags2;
};

static struct dds_file read_dds(const char *path, unsigned char **texels_out, size_t *size_out)
{
    struct dds_file file;
    size_t size;
    unsigned char *const bytes = read_bytes(path, &size);
    assert_int_equal(sizeof file, 4 + 124 + 20);
    assert_true(size > sizeof file);
    uint32_t words[sizeof file / 4];
    for (size_t i = 0; i < sizeof file / 4; i++)
        words[i] = (uint32_t)little_endian(bytes + 4 * i, 4);
    memcpy(&file, words, sizeof file);
    *size_out = size - sizeof file;
    memmove(bytes, bytes + sizeof file, *size_out);
    *texels_out = bytes;
    return file;
}

/* Oracle: the words of the format's documentation, and every texel where the documentation puts it, bit by
 * bit: rows after rows, slices after slices, without gaps. */
static void files_have_the_documented_layout(void **state)
{
    (void)state;
    static const struct {
        int width, height, depth;
    } cases[] = { { 1, 1, 1 }, { 64, 1, 1 }, { 5, 3, 1 }, { 1, 1, 4 }, { 4, 3, 5 }, { 64, 64, 32 } };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (int is_half = 0; is_half < 2; is_half++) {
            const int width = cases[i].width, height = cases[i].height, depth = cases[i].depth;
            struct io_image *const image = random_table(width * depth, height, is_half, (unsigned)i);
            assert_true(io_dds_write("a.dds", image, depth, is_half, NULL));
            unsigned char *texels;
            size_t size;
            const struct dds_file file = read_dds("a.dds", &texels, &size);
            const size_t value_size = is_half ? 2 : 4, row_bytes = 4 * value_size * (size_t)width;
            assert_int_equal(file.dwMagic, 0x20534444);
            assert_int_equal(file.dwSize, 124);
            /* caps, height, width, pitch, pixel format, count of levels; depth */
            assert_int_equal(file.dwFlags,
                             0x1 | 0x2 | 0x4 | 0x8 | 0x1000 | 0x20000 | (depth > 1 ? 0x800000 : 0));
            assert_int_equal(file.dwHeight, height);
            assert_int_equal(file.dwWidth, width);
            assert_int_equal(file.dwDepth, depth);
            assert_int_equal(file.dwPitchOrLinearSize, row_bytes);
            assert_int_equal(file.dwMipMapCount, 1);
            assert_int_equal(file.ddspfSize, 32);
            assert_int_equal(file.ddspfFlags, 0x4);
            assert_memory_equal(&file.ddspfFourCC, "DX10", 4);
            assert_int_equal(file.dwCaps, depth > 1 ? 0x1008 : 0x1000);
            assert_int_equal(file.dwCaps2, depth > 1 ? 0x200000 : 0);
            assert_int_equal(file.dxgiFormat, is_half ? 10 : 2);
            assert_int_equal(file.resourceDimension, depth > 1 ? 4 : 3);
            assert_int_equal(file.miscFlag, 0);
            assert_int_equal(file.arraySize, 1);
            assert_int_equal(file.miscFlags2, 0);

            assert_int_equal(size, row_bytes * (size_t)height * (size_t)depth);
            const unsigned char *at = texels;
            for (int z = 0; z < depth; z++)
                for (int y = 0; y < height; y++)
                    for (int x = 0; x < width; x++)
                        for (int c = 0; c < 4; c++, at += value_size)
                            assert_true(little_endian(at, value_size) ==
                                        (c == 3    ? is_half ? 0x3c00u : 0x3f800000u
                                         : is_half ? half_bits(table_value(image, depth, x, y, z, c))
                                                   : float_bits(table_value(image, depth, x, y, z, c))));
            free(texels);
            io_image_destroy(image);
        }
    }
}

/* Oracle: bit patterns of the standard's examples. */
static void halves_have_known_bits(void **state)
{
    (void)state;
    static const struct {
        float value;
        unsigned bits;
    } known[] = { { 0.0f, 0x0000 },        { -0.0f, 0x8000 },      { 1.0f, 0x3c00 },
                  { -2.0f, 0xc000 },       { 65504.0f, 0x7bff },   { 0x1p-14f, 0x0400 },
                  { 0x1p-24f, 0x0001 },    { 0x1p-25f, 0x0000 },   { 0.1f, 0x2e66 },
                  { 1.0f / 3.0f, 0x3555 }, { INFINITY, 0x7c00 },   { -INFINITY, 0xfc00 },
                  { NAN, 0x7e00 },         { 65519.996f, 0x7bff }, { 1000.0f, 0x63d0 } };
    enum { COUNT = sizeof known / sizeof known[0] };
    struct io_image *image;
    assert_true(io_image_create(COUNT, 1, 3, &image, NULL));
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3; c++)
            image->pixels[3 * i + c] = known[i].value;
    assert_true(io_dds_write("a.dds", image, 1, true, NULL));
    unsigned char *texels;
    size_t size;
    (void)read_dds("a.dds", &texels, &size);
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3; c++)
            assert_int_equal(little_endian(texels + 8 * i + 2 * c, 2), known[i].bits);
    free(texels);
    io_image_destroy(image);
}

static void same_table_same_bytes(void **state)
{
    (void)state;
    expect_same_bytes(io_dds_write);
}

static void what_is_no_table_is_refused(void **state)
{
    (void)state;
    expect_bad_tables_refused(io_dds_write);
}

static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    expect_unwritable_named(io_dds_write);
}

static void a_full_disk_leaves_the_old_file(void **state)
{
    (void)state;
    expect_full_disk_harmless(io_dds_write);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_have_the_documented_layout),
        cmocka_unit_test(halves_have_known_bits),
        cmocka_unit_test(same_table_same_bytes),
        cmocka_unit_test(what_is_no_table_is_refused),
        cmocka_unit_test(what_cannot_be_written_is_named),
        cmocka_unit_test(a_full_disk_leaves_the_old_file),
    };
    return cmocka_run_group_tests_name("dds", tests, NULL, NULL);
}
