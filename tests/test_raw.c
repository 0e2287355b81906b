#include "tests/table_files.h"

#include "io/dds.h"
#include "io/raw.h"

#include <inttypes.h>
#include <jansson.h>

static json_t *read_sidecar(const char *path)
{
    json_error_t error;
    json_t *const sidecar = json_load_file(path, JSON_REJECT_DUPLICATES, &error);
    if (!sidecar)
        fail_msg("%s:%d: %s", path, error.line, error.text);
    return sidecar;
}

static size_t integer_at(const json_t *object, const char *key)
{
    const json_t *const value = json_object_get(object, key);
    assert_true(json_is_integer(value));
    return (size_t)json_integer_value(value);
}

static void expect_text(const json_t *object, const char *key, const char *text)
{
    const char *const found = json_string_value(json_object_get(object, key));
    assert_non_null(found);
    assert_string_equal(found, text);
}

/* FNV-1a as its authors' description has it: exclusive or, then multiply by 2^40 + 2^8 + 0xb3. */
static void expect_hash_of(const json_t *sidecar, const char *path)
{
    size_t size;
    char text[17];
    unsigned char *const bytes = read_bytes(path, &size);
    uint64_t hash = UINT64_C(14695981039346656037);
    for (size_t i = 0; i < size; i++) {
        hash ^= bytes[i];
        hash = (hash << 40) + (hash << 8) + hash * 0xb3;
    }
    snprintf(text, sizeof text, "%016" PRIx64, hash);
    expect_text(sidecar, "content_hash", text);
    assert_int_equal(integer_at(sidecar, "bytes"), size);
    free(bytes);
}

/* The sidecar's numbers lead to every texel, bit by bit. */
static void expect_texels_found(const char *path, const json_t *sidecar, const struct io_image *image,
                                int depth, bool is_half, size_t channel_count)
{
    size_t size;
    unsigned char *const bytes = read_bytes(path, &size);
    const size_t width = integer_at(sidecar, "width"), height = integer_at(sidecar, "height");
    const size_t value_size = is_half ? 2 : 4;
    assert_int_equal(width, image->width_px / depth);
    assert_int_equal(height, image->height_px);
    assert_int_equal(integer_at(sidecar, "depth"), depth);
    expect_text(sidecar, "byte_order", "little");
    char format[8];
    snprintf(format, sizeof format, "%s%df", channel_count == 4 ? "rgba" : "rgb", is_half ? 16 : 32);
    expect_text(sidecar, "format", format);
    for (size_t z = 0; z < (size_t)depth; z++)
        for (size_t y = 0; y < height; y++)
            for (size_t x = 0; x < width; x++)
                for (size_t c = 0; c < 3; c++) {
                    const size_t at =
                        integer_at(sidecar, "header_bytes") + z * integer_at(sidecar, "slice_bytes") +
                        y * integer_at(sidecar, "row_bytes") + (channel_count * x + c) * value_size;
                    const float value = table_value(image, depth, (int)x, (int)y, (int)z, (int)c);
                    assert_true(at + value_size <= size);
                    assert_true(little_endian(bytes + at, value_size) ==
                                (is_half ? half_bits(value) : float_bits(value)));
                }
    free(bytes);
}

/* Oracle: what was written, found by what the sidecar says about it. */
static void the_sidecar_leads_to_every_texel(void **state)
{
    (void)state;
    static const int sizes[][3] = { { 1, 1, 1 }, { 64, 1, 1 }, { 5, 3, 1 }, { 1, 1, 4 }, { 4, 3, 5 } };
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        for (int is_half = 0; is_half < 2; is_half++) {
            const int depth = sizes[i][2];
            struct io_image *const image =
                random_table(sizes[i][0] * depth, sizes[i][1], is_half, (unsigned)i);
            assert_true(io_raw_write("a.raw", image, depth, is_half, NULL));
            json_t *sidecar = read_sidecar("a.raw.json");
            expect_hash_of(sidecar, "a.raw");
            assert_int_equal(integer_at(sidecar, "header_bytes"), 0);
            assert_int_equal(integer_at(sidecar, "slice_bytes") * (size_t)depth,
                             integer_at(sidecar, "bytes"));
            expect_texels_found("a.raw", sidecar, image, depth, is_half, 3);
            json_decref(sidecar);

            assert_true(io_dds_write("a.dds", image, depth, is_half, NULL));
            assert_true(io_dds_sidecar_write("a.dds", image, depth, is_half, NULL));
            sidecar = read_sidecar("a.dds.json");
            expect_hash_of(sidecar, "a.dds");
            assert_int_equal(integer_at(sidecar, "header_bytes"), 148);
            expect_texels_found("a.dds", sidecar, image, depth, is_half, 4);
            json_decref(sidecar);
            io_image_destroy(image);
        }
}

/* Oracle: the attributes that were set; random doubles over all of the range come back bit by bit. */
static void the_sidecar_has_all_attributes(void **state)
{
    (void)state;
    struct io_image *const image = random_table(4, 4, true, 1);
    struct rng rng = { .seed = 8 };
    double numbers[100];
    char name[64];
    for (int i = 0; i < 100; i++) {
        numbers[i] = log_uniform(&rng, 1e-300, 1e300) * (i % 2 ? 1 : -1);
        snprintf(name, sizeof name, "dipole:%d", i);
        assert_true(io_image_set_number(image, name, numbers[i]));
    }
    static const double three[3] = { 0.1, 1e-300, -0.0 };
    static const char text[] = "a \"quoted\"\n\303\251\t\360\237\217\224 \\";
    assert_true(io_image_set_numbers(image, "dipole:scale", three));
    assert_true(io_image_set_text(image, "dipole:material", text));
    assert_true(
        io_image_set_text(image, "dipole:looks_like_json", "{\"a\": [1, 0.1, \"\303\251\", null]}"));
    assert_true(io_image_set_text(image, "dipole:json", "{\"not\": \"embedded\"}"));
    assert_true(io_raw_write("a.raw", image, 1, true, NULL));
    json_t *const sidecar = read_sidecar("a.raw.json");
    const json_t *const attributes = json_object_get(sidecar, "attributes");
    assert_int_equal(json_object_size(attributes), image->attribute_count);
    for (int i = 0; i < 100; i++) {
        snprintf(name, sizeof name, "dipole:%d", i);
        assert_true(json_number_value(json_object_get(attributes, name)) == numbers[i]);
    }
    const json_t *const scale = json_object_get(attributes, "dipole:scale");
    assert_int_equal(json_array_size(scale), 3);
    for (size_t i = 0; i < 3; i++)
        assert_true(json_number_value(json_array_get(scale, i)) == three[i]);
    expect_text(attributes, "dipole:material", text);
    expect_text(attributes, "dipole:json", "{\"not\": \"embedded\"}");
    const json_t *const embedded =
        json_object_get(json_object_get(attributes, "dipole:looks_like_json"), "a");
    assert_int_equal(json_array_size(embedded), 4);
    assert_true(json_number_value(json_array_get(embedded, 1)) == 0.1);
    assert_string_equal(json_string_value(json_array_get(embedded, 2)), "\303\251");
    json_decref(sidecar);
    io_image_destroy(image);
}

/* Oracle: the documented conditions; the sidecar that was there stays. */
static void what_json_has_not_is_refused(void **state)
{
    (void)state;
    enter_fresh_folder();
    static const struct {
        const char *name, *text;
        double number;
        const char *message;
    } cases[] = {
        { "dipole:a_json", "[1, 2", 0, "attribute dipole:a_json is not JSON" },
        { "dipole:a_json", "{\"a\": 1, \"a\": 2}", 0, "attribute dipole:a_json is not JSON" },
        { "dipole:a_json", "", 0, "attribute dipole:a_json is not JSON" },
        { "dipole:text", "caf\351", 0, "attribute dipole:text is not UTF-8" },
        { "dipole:number", NULL, INFINITY, "attribute dipole:number is not finite" },
        { "dipole:number", NULL, NAN, "attribute dipole:number is not finite" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct io_image *const image = random_table(4, 4, true, 1);
        assert_true(cases[i].text ? io_image_set_text(image, cases[i].name, cases[i].text)
                                  : io_image_set_number(image, cases[i].name, cases[i].number));
        expect_refused(io_raw_write, "a.raw", image, 1, true, DIPOLE_BAD_VALUE, cases[i].message);
        assert_int_equal(entry_count("."), 1);
        io_image_destroy(image);
    }
    assert_int_equal(chdir(".."), 0);
}

/* Of another program that writes a table of the same size there. */
static const struct io_image *others;

static bool write_dds(const char *path, const struct io_image *image, int depth, bool is_half,
                      dipole_status *status)
{
    return io_dds_write(path, image, depth, is_half, status) &&
           (!others || io_dds_write(path, others, depth, is_half, status)) &&
           io_dds_sidecar_write(path, image, depth, is_half, status);
}

/* Oracle: bytes. A table and its sidecar are current when both are of that image, in that layout; a sidecar
 * has the hash of its own image's file, whoever has written another one in between. */
static void a_sidecar_vouches_for_no_other_table(void **state)
{
    (void)state;
    enter_fresh_folder();
    for (int is_dds = 0; is_dds < 2; is_dds++) {
        const table_writer write_table = is_dds ? write_dds : io_raw_write;
        struct io_image *const mine = random_table(6, 4, true, 1), *const other =
                                                                       random_table(6, 4, true, 2);
        assert_true(write_table("x", mine, 3, true, NULL));
        assert_true(io_sidecar_is_current("x", mine, 3, true));
        assert_false(io_sidecar_is_current("x", other, 3, true));
        assert_false(io_sidecar_is_current("x", mine, 1, true));
        assert_false(io_sidecar_is_current("x", mine, 3, false));
        assert_false(io_sidecar_is_current("missing", mine, 3, true));
        json_t *const right = read_sidecar("x.json");
        others = other;
        assert_true(!is_dds || write_dds("x", mine, 3, true, NULL));
        others = NULL;
        assert_true(is_dds || system("cp x.json kept.json") == 0);
        assert_true(is_dds || io_raw_write("x", other, 3, true, NULL));
        assert_true(is_dds || rename("kept.json", "x.json") == 0);
        json_t *const sidecar = read_sidecar("x.json");
        assert_true(json_equal(sidecar, right));
        assert_false(io_sidecar_is_current("x", mine, 3, true) ||
                     io_sidecar_is_current("x", other, 3, true));
        assert_true(write_table("x", mine, 3, true, NULL));
        assert_true(io_sidecar_is_current("x", mine, 3, true));
        assert_true(io_image_set_text(mine, "dipole:new", "text"));
        assert_false(io_sidecar_is_current("x", mine, 3, true));
        assert_int_equal(unlink("x.json"), 0);
        assert_false(io_sidecar_is_current("x", mine, 3, true));
        json_decref(sidecar);
        json_decref(right);
        io_image_destroy(mine);
        io_image_destroy(other);
    }
    assert_int_equal(chdir(".."), 0);
}

/* Oracle: on a disk that is full after the table, the old sidecar stands beside the new table, and its hash
 * says that it is not of it. */
static void an_old_sidecar_does_not_match_a_new_table(void **state)
{
    (void)state;
    enter_fresh_folder();
    struct io_image *const old = random_table(4, 4, true, 1), *const image = random_table(4, 4, true, 2);
    assert_true(io_image_set_text(image, "dipole:text",
                                  "a long text, so that only the table fits: "
                                  "0123456789012345678901234567890123456789"));
    assert_true(io_raw_write("x", old, 2, false, NULL));
    json_t *const before = read_sidecar("x.json");
    assert_int_equal(write_limited(io_raw_write, image, 200, "cannot be written: File too large"), 0);
    json_t *const after = read_sidecar("x.json");
    assert_true(json_equal(before, after));
    assert_int_equal(entry_count("."), 2);
    size_t size;
    unsigned char *const bytes = read_bytes("x", &size);
    assert_int_equal(little_endian(bytes, 4), float_bits(image->pixels[0])); /* the new one */
    free(bytes);
    assert_true(io_raw_write("new", image, 2, false, NULL));
    json_t *const fresh = read_sidecar("new.json");
    assert_string_not_equal(json_string_value(json_object_get(fresh, "content_hash")),
                            json_string_value(json_object_get(after, "content_hash")));
    json_decref(before);
    json_decref(after);
    json_decref(fresh);
    io_image_destroy(old);
    io_image_destroy(image);
    assert_int_equal(chdir(".."), 0);
}

static void same_table_same_bytes(void **state)
{
    (void)state;
    expect_same_bytes(io_raw_write);
}

static void what_is_no_table_is_refused(void **state)
{
    (void)state;
    expect_bad_tables_refused(io_raw_write);
}

static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    expect_unwritable_named(io_raw_write);
}

static void a_full_disk_leaves_the_old_file(void **state)
{
    (void)state;
    expect_full_disk_harmless(io_raw_write);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_sidecar_leads_to_every_texel),
        cmocka_unit_test(the_sidecar_has_all_attributes),
        cmocka_unit_test(what_json_has_not_is_refused),
        cmocka_unit_test(a_sidecar_vouches_for_no_other_table),
        cmocka_unit_test(an_old_sidecar_does_not_match_a_new_table),
        cmocka_unit_test(same_table_same_bytes),
        cmocka_unit_test(what_is_no_table_is_refused),
        cmocka_unit_test(what_cannot_be_written_is_named),
        cmocka_unit_test(a_full_disk_leaves_the_old_file),
    };
    return cmocka_run_group_tests_name("raw", tests, NULL, NULL);
}
