/* lutgen/splat_file.c, attributes.c: splat tables as pictures and files. */
#include "tables.h"

#include <unistd.h>

static struct lut_splat *bake(const struct io_material *materials, size_t count, bool is_half)
{
    const struct lut_request request = { .kind = count > 1 ? LUT_SPLAT2D : LUT_SPLAT1D,
                                         .materials = materials,
                                         .material_count = count,
                                         .epsilon = 0.002,
                                         .is_half = is_half };
    struct lut_splat *lut = NULL;
    dipole_status status = { 0 };
    if (!lut_splat_bake(&request, &lut, &status))
        fail_msg("%s", status.message);
    return lut;
}

static void write_table(const struct lut_splat *lut, const char *path)
{
    struct io_image *image;
    dipole_status status = { 0 };
    if (!lut_splat_to_image(lut, lut->row_count > 1 ? LUT_SPLAT2D : LUT_SPLAT1D, &image, &status) ||
        !io_exr_write(path, image, lut->is_half, &status))
        fail_msg("%s", status.message);
    io_image_destroy(image);
}

static bool open_table(const struct io_image *image, const char *path, dipole_status *status)
{
    struct lut_splat *lut = NULL;
    const bool is_open = lut_splat_from_image(image, path, &lut, status);
    assert_int_equal(is_open, lut != NULL);
    lut_splat_destroy(lut);
    return is_open;
}

/* Three materials: a half-space of the dipole, one with a core, layers. */
static void materials_get(struct io_material materials[3])
{
    materials[0] = read_bundled("skin1", 1);
    materials[1] = read_bundled("ketchup", 1);
    materials[1].model = DIPOLE_MODEL_BEAM;
    materials[2] = read_bundled("layered/marble_slab", 1);
}

static void assert_same_material(const struct io_material *a, const struct io_material *b)
{
    assert_string_equal(a->name, b->name);
    assert_int_equal(a->model, b->model);
    assert_int_equal(a->layer_count, b->layer_count);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        for (size_t i = 0; i < a->layer_count; i++) {
            const dipole_layer *const x = &a->layers[c][i], *const y = &b->layers[c][i];
            assert_true(x->thickness_mm == y->thickness_mm);
            assert_true(x->medium.sigma_a_per_mm == y->medium.sigma_a_per_mm);
            assert_true(x->medium.sigma_s_prime_per_mm == y->medium.sigma_s_prime_per_mm);
            assert_true(x->medium.eta == y->medium.eta);
            assert_int_equal(x->medium.fdr_kind, y->medium.fdr_kind);
        }
}

/* Oracle: what was baked, value by value. */
static void assert_same_table(const struct lut_splat *a, const struct lut_splat *b)
{
    assert_true(a->epsilon == b->epsilon);
    assert_int_equal(a->is_half, b->is_half);
    assert_int_equal(a->node_count, b->node_count);
    assert_int_equal(a->node_count_asked, b->node_count_asked);
    assert_int_equal(a->row_count, b->row_count);
    for (size_t i = 0; i < a->row_count; i++) {
        const struct lut_splat_row *const x = &a->rows[i], *const y = &b->rows[i];
        assert_same_material(&x->material, &y->material);
        assert_true(x->axis.r_max_mm == y->axis.r_max_mm && x->axis.scale_mm == y->axis.scale_mm &&
                    x->axis.power == y->axis.power);
        assert_int_equal(x->axis.node_count, y->axis.node_count);
        assert_true(x->falloff == y->falloff && x->predicted_error == y->predicted_error);
        assert_memory_equal(x->scale, y->scale, sizeof x->scale);
        assert_memory_equal(x->core_mm, y->core_mm, sizeof x->core_mm);
        assert_true(x->error.max == y->error.max && x->error.p99 == y->error.p99);
    }
    assert_memory_equal(a->rgb, b->rgb, a->row_count * (size_t)a->node_count * 3 * sizeof *a->rgb);
}

static void tables_come_back_as_they_were(void **state)
{
    (void)state;
    struct io_material materials[3];
    for (int is_half = 0; is_half < 2; is_half++)
        for (size_t count = 1; count <= 3; count += 2) {
            materials_get(materials);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                materials[0].layers[c][0].medium.fdr_kind =
                    is_half ? DIPOLE_FDR_POLYNOMIAL : DIPOLE_FDR_EXACT;
            struct lut_splat *const lut = bake(materials, count, is_half), *back = NULL;
            dipole_status status = { 0 };
            write_table(lut, "table.exr");
            if (!lut_splat_read("table.exr", &back, &status))
                fail_msg("%s", status.message);
            assert_same_table(back, lut);
            for (size_t i = 0; i < count; i++) {
                struct lut_error error;
                assert_true(lut_splat_audit(back, i, 8, 9, &error, NULL));
                assert_true(error.max <= back->rows[i].error.max);
            }
            lut_splat_destroy(back);
            lut_splat_destroy(lut);
        }
}

/* Oracle: docs/formats.md. */
static void attributes_say_what_was_baked(void **state)
{
    (void)state;
    struct io_material materials[3];
    materials_get(materials);
    struct lut_splat *lut = bake(materials, 1, true);
    write_table(lut, "table.exr");
    struct io_image *image = read_image("table.exr");
    assert_text(image, "dipole:kind", "splat1d");
    assert_text(image, "dipole:model", "dipole");
    assert_text(image, "dipole:material", materials[0].name);
    assert_text(image, "dipole:material_hash", lut_material_hash(&materials[0]).text);
    assert_text(image, "dipole:storage", "half");
    assert_text(image, "dipole:version", dipole_version());
    const struct lut_request request = {
        .materials = materials, .material_count = 1, .epsilon = 0.002, .is_half = true
    };
    assert_text(image, "dipole:input_hash", lut_request_hash(&request).text);
    assert_int_equal(image->height_px, 1);
    assert_int_equal(image->width_px, lut->node_count);
    assert_true(attribute_of(image, "dipole:size")->numbers[0] == lut->node_count);
    assert_true(attribute_of(image, "dipole:power")->numbers[0] == lut->rows[0].axis.power);
    assert_true(attribute_of(image, "dipole:max_relative_error")->numbers[0] == lut->rows[0].error.max);
    io_image_destroy(image);
    lut_splat_destroy(lut);

    lut = bake(materials, 3, false);
    double most = 0;
    for (int i = 0; i < 3; i++)
        most = fmax(most, lut->rows[i].error.max);
    write_table(lut, "table.exr");
    image = read_image("table.exr");
    assert_text(image, "dipole:kind", "splat2d");
    assert_text(image, "dipole:storage", "float");
    assert_true(attribute_of(image, "dipole:size")->numbers[1] == 3);
    assert_true(attribute_of(image, "dipole:max_relative_error")->numbers[0] == most);
    io_image_destroy(image);
    lut_splat_destroy(lut);
}

/* Oracle: the same bytes. */
static void same_table_same_bytes(void **state)
{
    (void)state;
    struct io_material materials[3];
    materials_get(materials);
    char *bytes[2];
    size_t sizes[2];
    for (int i = 0; i < 2; i++) {
        struct lut_splat *const lut = bake(materials, 3, true);
        write_table(lut, "table.exr");
        lut_splat_destroy(lut);
        assert_true(io_file_read("table.exr", 1 << 26, &bytes[i], &sizes[i], NULL));
    }
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

static struct io_image *image_of(const struct io_material *materials, size_t count)
{
    struct lut_splat *const lut = bake(materials, count, false);
    struct io_image *image = NULL;
    assert_true(lut_splat_to_image(lut, count > 1 ? LUT_SPLAT2D : LUT_SPLAT1D, &image, NULL));
    lut_splat_destroy(lut);
    assert_true(open_table(image, "good.exr", NULL));
    return image;
}

static void changed_attributes_are_refused(void **state)
{
    (void)state;
    struct io_material materials[3];
    materials_get(materials);
    for (size_t count = 1; count <= 3; count += 2) {
        struct io_image *const image = image_of(materials, count);
        expect_missing_attributes_named(image, open_table);
        expect_changed_attributes_refused(image, open_table);
        assert_true(open_table(image, "good.exr", NULL));
        io_image_destroy(image);
    }
}

/* Oracle: the change. */
static void changed_texels_are_refused(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("marble", 1);
    struct io_image *const image = image_of(&material, 1);
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 200; i++) {
        float *const texel = &image->pixels[random_bits(&rng) % (uint64_t)(image->width_px * 3)],
                     was = *texel;
        *texel = nextafterf(was, i % 2 ? INFINITY : 0);
        assert_refused(image, open_table, "does not fit the rest of the file: something in it was changed");
        *texel = was;
    }
    image->pixels[3 * 5 + 1] = -1;
    assert_refused(image, open_table, "texel 5 holds -1, expected a finite value >= 0");
    image->pixels[3 * 5 + 1] = NAN;
    assert_refused(image, open_table, "texel 5 holds nan, expected a finite value >= 0");
    io_image_destroy(image);
}

static void text_set(struct io_image *image, const char *name, const char *text)
{
    assert_true(io_image_set_text(image, name, text));
}

/* Oracle: each thing that can be wrong with a file, named. */
static void files_that_are_no_tables_are_refused(void **state)
{
    (void)state;
    struct io_material materials[3];
    materials_get(materials);
    struct io_image *image = image_of(materials, 3);
    char message[160];

    text_set(image, "dipole:kind", "tsm");
    assert_refused(image, open_table, "dipole:kind is \"tsm\", expected one of \"splat1d\", \"splat2d\"");
    text_set(image, "dipole:kind", "splat1d");
    snprintf(message, sizeof message,
             "the picture is %d x 3 with 3 channels, expected a width of 8 to 32768, a height of 1, and 3",
             image->width_px);
    assert_refused(image, open_table, message);
    text_set(image, "dipole:kind", "splat2d");

    text_set(image, "dipole:version", "0.0.9");
    snprintf(message, sizeof message, "was baked by version 0.0.9, expected %s: bake it again",
             dipole_version());
    assert_refused(image, open_table, message);
    text_set(image, "dipole:version", dipole_version());

    attribute_of(image, "dipole:epsilon")->numbers[0] = 0.6;
    assert_refused(image, open_table, "dipole:epsilon is 0.6, expected 1e-06 to 0.5");
    attribute_of(image, "dipole:epsilon")->numbers[0] = 0.002;

    image->height_px = 2;
    assert_refused(image, open_table, "dipole:row_json: 3 rows are described, expected 2, the height");
    image->height_px = 3;

    text_set(image, "dipole:row_json", "[{}");
    assert_refused(image, open_table, "dipole:row_json: ");
    text_set(image, "dipole:row_json", "[]");
    assert_refused(image, open_table, "dipole:row_json: ");
    assert_true(io_image_set_number(image, "dipole:row_json", 3));
    assert_refused(image, open_table, "attribute dipole:row_json has another type, expected a text");
    io_image_destroy(image);

    assert_true(io_image_create(64, 1, 3, &image, NULL));
    assert_refused(image, open_table, "no attribute dipole:kind, expected a text");
    io_image_destroy(image);

    struct lut_splat *lut = NULL;
    dipole_status status = { 0 };
    unlink("missing.exr");
    assert_false(lut_splat_read("missing.exr", &lut, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_null(lut);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_come_back_as_they_were),
        cmocka_unit_test(attributes_say_what_was_baked),
        cmocka_unit_test(same_table_same_bytes),
        cmocka_unit_test(changed_attributes_are_refused),
        cmocka_unit_test(changed_texels_are_refused),
        cmocka_unit_test(files_that_are_no_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
