/* lutgen/tsm_file.c: volumes for translucent shadow maps as pictures and files. */
#include "tsm_check.h"

#include "lutgen/self_test.h"

#include <unistd.h>

static void write_volume(const struct lut_tsm *lut, const char *path)
{
    struct io_image *image;
    dipole_status status = { 0 };
    if (!lut_tsm_to_image(lut, &image, &status) || !io_exr_write(path, image, lut->is_half, &status))
        fail_msg("%s", status.message);
    io_image_destroy(image);
}

static bool open_volume(const struct io_image *image, const char *path, dipole_status *status)
{
    struct lut_tsm *lut = NULL;
    const bool is_open = lut_tsm_from_image(image, path, &lut, status);
    assert_int_equal(is_open, lut != NULL);
    lut_tsm_destroy(lut);
    return is_open;
}

/* Small, of a model with a core and fitted sources, or of marble. */
static struct lut_tsm *small_volume(bool is_half)
{
    struct io_material material = read_bundled("marble", 1);
    if (is_half)
        material.model = DIPOLE_MODEL_MODES;
    struct lut_request request = tsm_request(&material, 0.5, is_half);
    request.size[0] = 24;
    request.size[1] = is_half ? 40 : 0;
    request.size[2] = 16;
    return tsm_bake(&request);
}

/* Oracle: what was baked, value by value; its error is measured on what was read. */
static void volumes_come_back_as_they_were(void **state)
{
    (void)state;
    for (int is_half = 0; is_half < 2; is_half++) {
        struct lut_tsm *const lut = small_volume(is_half), *back = NULL;
        dipole_status status = { 0 };
        write_volume(lut, "volume.exr");
        if (!lut_tsm_read("volume.exr", &back, &status))
            fail_msg("%s", status.message);
        assert_same_volume(back, lut);
        assert_string_equal(lut_material_hash(&back->material).text,
                            lut_material_hash(&lut->material).text);
        assert_string_equal(back->material.name, lut->material.name);
        assert_int_equal(back->is_half, is_half);
        assert_memory_equal(back->size_asked, lut->size_asked, sizeof lut->size_asked);
        assert_true(back->epsilon == lut->epsilon && back->error.max == lut->error.max &&
                    back->error.p99 == lut->error.p99 && back->source_error == lut->source_error);
        assert_true(back->depth_scale_mm == lut->depth_scale_mm && back->inner_mm == lut->inner_mm &&
                    back->depth_max_mm == lut->depth_max_mm &&
                    back->local_depth_scale_mm == lut->local_depth_scale_mm);
        assert_int_equal(back->sample_count, 13);
        assert_memory_equal(back->samples, lut->samples, 13 * sizeof *lut->samples);
        struct lut_error error;
        assert_true(lut_tsm_audit(back, 300, LUT_SEED_CHECK, &error, NULL));
        assert_true(error.max <= back->error.max);
        lut_tsm_destroy(back);
        lut_tsm_destroy(lut);
    }
}

static double number(struct io_image *image, const char *name)
{
    return attribute_of(image, name)->numbers[0];
}

/* Oracle: docs/formats.md; the patch as a program that loads the file would check it. */
static void pictures_hold_what_is_documented(void **state)
{
    (void)state;
    for (int is_half = 0; is_half < 2; is_half++) {
        struct lut_tsm *const lut = small_volume(is_half);
        write_volume(lut, "volume.exr");
        struct io_image *const image = read_image("volume.exr");
        const int width = 24, height = lut->size[1];
        assert_int_equal(image->width_px, width * 16);
        assert_int_equal(image->height_px, height);
        assert_text(image, "dipole:kind", "tsm");
        assert_text(image, "dipole:model", is_half ? "modes" : "dipole");
        assert_text(image, "dipole:storage", is_half ? "half" : "float");
        assert_text(image, "dipole:material_hash", lut_material_hash(&lut->material).text);
        assert_true(number(image, "dipole:local_slice") == 13);
        assert_true(number(image, "dipole:depth_factor_slice") == 14);
        assert_true(number(image, "dipole:self_test_slice") == 15);
        assert_close(number(image, "dipole:local_width_mm"), lut->inner_mm / 7, 1e-15, "local width");
        assert_true(number(image, "dipole:max_relative_error") == lut->error.max);
        json_t *const pattern = json_loads(attribute_of(image, "dipole:pattern_json")->text, 0, NULL);
        assert_int_equal(json_array_size(pattern), 13);
        for (size_t i = 0; i < 13; i++) {
            const json_t *const sample = json_array_get(pattern, i);
            const json_t *const offset = json_object_get(sample, "offset_mm");
            for (size_t k = 0; k < 2; k++)
                assert_true(json_number_value(json_array_get(offset, k)) == lut->samples[i].offset_mm[k]);
            assert_true(json_number_value(json_object_get(sample, "width_mm")) == lut->samples[i].width_mm);
            assert_true(json_number_value(json_object_get(sample, "area_mm2")) == lut->samples[i].area_mm2);
        }
        json_decref(pattern);
        float *const patch = malloc((size_t)(width * height * 3) * sizeof *patch);
        assert_non_null(patch);
        for (int y = 0; y < height; y++)
            memcpy(patch + (size_t)(y * width) * 3,
                   image->pixels + (size_t)(y * image->width_px + 15 * width) * 3,
                   (size_t)width * 3 * sizeof *patch);
        assert_int_equal(lut_self_test_check(patch, width, height, is_half), LUT_SELF_TEST_FINE);
        free(patch);
        io_image_destroy(image);
        lut_tsm_destroy(lut);
    }
}

/* Oracle: the same bytes. */
static void same_volume_same_bytes(void **state)
{
    (void)state;
    char *bytes[2];
    size_t sizes[2];
    for (int i = 0; i < 2; i++) {
        struct lut_tsm *const lut = small_volume(true);
        write_volume(lut, "volume.exr");
        lut_tsm_destroy(lut);
        assert_true(io_file_read("volume.exr", 1 << 26, &bytes[i], &sizes[i], NULL));
    }
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

/* Oracle: each change. */
static void changes_are_refused(void **state)
{
    (void)state;
    struct lut_tsm *const lut = small_volume(true);
    struct io_image *image = NULL;
    assert_true(lut_tsm_to_image(lut, &image, NULL));
    lut_tsm_destroy(lut);
    assert_true(open_volume(image, "good.exr", NULL));
    expect_missing_attributes_named(image, open_volume);
    expect_changed_attributes_refused(image, open_volume);
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 200; i++) { /* slices of all kinds, that of the self-test as well */
        const int x = i % 4 ? (int)(random_bits(&rng) % (uint64_t)image->width_px) : 15 * 24 + i % 24;
        float *const texel =
            &image->pixels[((size_t)(i % image->height_px) * (size_t)image->width_px + (size_t)x) * 3];
        const float was = *texel;
        *texel = nextafterf(was, INFINITY);
        if (open_volume(image, "bad.exr", NULL))
            fail_msg("texel (%d, %d) can be %g as well as %g", x, i % image->height_px, (double)*texel,
                     (double)was);
        *texel = was;
    }
    image->pixels[3 * 15 * 24] = 0.5F;
    assert_refused(image, open_volume, "texel 360 holds 0.5, expected 1, of the self-test");
    image->pixels[3 * 15 * 24] = 1;
    image->pixels[3 * 5 + 1] = -1;
    assert_refused(image, open_volume, "texel 5 holds -1, expected a finite value >= 0");
    io_image_destroy(image);
}

/* Oracle: each thing that can be wrong with a file, named. */
static void files_that_are_no_volumes_are_refused(void **state)
{
    (void)state;
    struct lut_tsm *lut = small_volume(true);
    struct io_image *image = NULL;
    assert_true(lut_tsm_to_image(lut, &image, NULL));
    lut_tsm_destroy(lut);

    double *const size = attribute_of(image, "dipole:size")->numbers;
    size[0] = 25;
    assert_refused(
        image, open_volume,
        "the picture is 384 x 40 with 3 channels, expected 16 slices of 25 x 40 side by side and "
        "3 (dipole:size)");
    size[0] = 12;
    size[2] = 32; /* as wide */
    assert_refused(image, open_volume, "");
    size[0] = 16;
    size[2] = 24; /* as wide, but no pattern */
    assert_refused(image, open_volume, "expected 24 slices of 16 x 40");
    size[0] = 1025;
    assert_refused(image, open_volume, "dipole:size is 1025, expected 8 to 1024");
    size[0] = 24;
    size[2] = 16;
    image->height_px = 39;
    assert_refused(image, open_volume, "the picture is 384 x 39 with 3 channels");
    image->height_px = 40;

    assert_true(io_image_set_text(image, "dipole:kind", "splat1d"));
    assert_refused(image, open_volume, "dipole:kind is \"splat1d\", expected one of \"tsm\"");
    assert_true(io_image_set_text(image, "dipole:kind", "tsm"));
    assert_true(io_image_set_text(image, "dipole:version", "0.0.9"));
    assert_refused(image, open_volume, "was baked by version 0.0.9, expected ");
    assert_true(io_image_set_text(image, "dipole:version", dipole_version()));
    assert_true(io_image_set_text(image, "dipole:material_json", "{"));
    assert_refused(image, open_volume, "dipole:material_json: ");
    io_image_destroy(image);

    dipole_status status = { 0 };
    unlink("missing.exr");
    assert_false(lut_tsm_read("missing.exr", &lut, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_null(lut);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(volumes_come_back_as_they_were),
        cmocka_unit_test(pictures_hold_what_is_documented),
        cmocka_unit_test(same_volume_same_bytes),
        cmocka_unit_test(changes_are_refused),
        cmocka_unit_test(files_that_are_no_volumes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
