#include "lutgen/internal.h"
#include "tests/check.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const bundled[] = {
    "apple",  "chicken1", "chicken2", "cream", "ketchup",    "marble",
    "potato", "skimmilk", "skin1",    "skin2", "spectralon", "wholemilk"
};

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct io_material read_bundled(const char *name, double factor)
{
    char path[4096];
    struct io_material material;
    dipole_status status = { 0 };
    snprintf(path, sizeof path, SOURCE_FOLDER "/materials/%s.json", name);
    if (!io_material_read(path, &material, &status))
        fail_msg("%s: %s", status.source, status.message);
    for (int c = 0; c < 3; c++) {
        material.layers[c][0].medium.sigma_a_per_mm *= factor;
        material.layers[c][0].medium.sigma_s_prime_per_mm *= factor;
    }
    return material;
}

static struct io_material make_material(double sigma_a, double sigma_s_prime)
{
    struct io_material material = { .name = "made" };
    const dipole_medium medium = { .sigma_a_per_mm = sigma_a,
                                   .sigma_s_prime_per_mm = sigma_s_prime,
                                   .eta = 1.3 };
    io_material_set_media(&material, (const dipole_medium[]){ medium, medium, medium });
    return material;
}

static struct lut_splat1d *bake(const struct io_material *material, double epsilon, bool is_half)
{
    struct lut_splat1d *lut = NULL;
    dipole_status status = { 0 };
    if (!(is_half ? lut_splat1d_bake_half : lut_splat1d_bake)(material, epsilon, &lut, &status))
        fail_msg("%s at %g: %s", material->name, epsilon, status.message);
    return lut;
}

static dipole_coefficients coefficients_of(const struct io_material *material, int channel)
{
    dipole_coefficients c;
    assert_true(dipole_coefficients_init(&material->layers[channel][0].medium, &c, NULL));
    return c;
}

/* The textbook formula, apart from the library's. */
static double textbook_rd(const dipole_coefficients *c, double r_mm)
{
    double sum = 0;
    for (int i = 0; i < 2; i++) {
        const double z = i == 0 ? c->z_r_mm : c->z_v_mm, d = hypot(r_mm, z);
        sum += z * (c->sigma_tr_per_mm + 1 / d) * exp(-c->sigma_tr_per_mm * d) / (d * d);
    }
    return c->alpha_prime / (4 * 3.14159265358979323846) * sum;
}

/* ---- axis --------------------------------------------------------------------------------------- */

/* Oracle: mapping and inverse are inverse; the ends are 0 and r_max exactly; both rise. */
static void axis_and_its_inverse_agree(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    for (int i = 0; i < 2000; i++) {
        struct lut_axis axis = { .scale_mm = log_uniform(&rng, 1e-50, 1e50),
                                 .node_count = 64 << random_bits(&rng) % 10 };
        axis.r_max_mm = axis.scale_mm * log_uniform(&rng, 0.5, i % 2 ? 1e4 : 1e100);
        assert_true(lut_axis_r_mm(&axis, 0) == 0);
        assert_true(lut_axis_r_mm(&axis, axis.node_count - 1) == axis.r_max_mm);
        assert_true(lut_axis_index(&axis, 0) == 0);
        assert_true(lut_axis_index(&axis, axis.r_max_mm) == axis.node_count - 1);
        double before = -1;
        for (int k = 0; k < 20; k++) {
            const double index = (k + uniform(&rng, 0, 1)) / 20 * (axis.node_count - 1);
            const double r_mm = lut_axis_r_mm(&axis, index);
            assert_true(r_mm > before && r_mm <= axis.r_max_mm);
            before = r_mm;
            /* log1p and expm1 lose a few bits of u, which count more the longer the axis is in log r. */
            assert_close(lut_axis_index(&axis, r_mm), index, 1e-12, "axis %d, index %g", i, index);
        }
    }
}

/* Oracle: the printed formula. */
static void axis_is_what_the_attribute_says(void **state)
{
    (void)state;
    const struct lut_axis axis = { .r_max_mm = 30, .scale_mm = 0.5, .node_count = 101 };
    for (int i = 0; i <= 100; i++) {
        const double r_mm = 0.3 * i;
        assert_close(lut_axis_index(&axis, r_mm), 100 * log(1 + pow(r_mm / 0.5, 2)) / log(1 + pow(60, 2)),
                     1e-13, "r %g", r_mm);
    }
}

/* ---- the bound ---------------------------------------------------------------------------------- */

/* Oracle: R_d itself, rounded to float, at every node; first and last node at r = 0 and r_max. */
static void nodes_are_exact(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("marble", 1);
    struct lut_splat1d *const lut = bake(&material, 0.01, false);
    double r_max_mm = 0;
    for (int c = 0; c < 3; c++) {
        const dipole_coefficients k = coefficients_of(&material, c);
        r_max_mm = fmax(r_max_mm, dipole_r_max_mm(&k, 0.01));
        for (int i = 0; i < lut->axis.node_count; i++) {
            const double r_mm = lut_axis_r_mm(&lut->axis, i);
            assert_true(lut->rgb[3 * i + c] == (float)dipole_rd_per_mm2(&k, r_mm));
        }
        double rgb[3];
        lut_splat1d_sample(lut, 0, rgb);
        assert_true(rgb[c] == (double)(float)dipole_rd_per_mm2(&k, 0));
        lut_splat1d_sample(lut, lut->axis.r_max_mm, rgb);
        assert_true(rgb[c] == (double)(float)dipole_rd_per_mm2(&k, lut->axis.r_max_mm));
        lut_splat1d_sample(lut, nextafter(lut->axis.r_max_mm, INFINITY), rgb);
        assert_true(rgb[c] == 0);
        lut_splat1d_sample(lut, NAN, rgb);
        assert_true(rgb[c] == 0);
    }
    assert_true(lut->axis.r_max_mm == r_max_mm);
    lut_splat1d_destroy(lut);
}

static void check_bound(struct rng *rng, const struct lut_splat1d *lut)
{
    assert_true(lut->max_relative_error <= lut->epsilon);
    dipole_coefficients k[3];
    double r_max_mm[3], worst = 0;
    for (int c = 0; c < 3; c++) {
        k[c] = coefficients_of(&lut->material, c);
        r_max_mm[c] = dipole_r_max_mm(&k[c], lut->epsilon);
    }
    for (int i = 0; i < 1000; i++) {
        const double end_mm = lut->axis.r_max_mm;
        const double r_mm = i % 2 ? uniform(rng, 0, end_mm) : end_mm * log_uniform(rng, 1e-7, 1);
        double rgb[3];
        lut_splat1d_sample(lut, r_mm, rgb);
        for (int c = 0; c < 3; c++) {
            const double exact = textbook_rd(&k[c], r_mm);
            const double least = r_mm > r_max_mm[c] ? textbook_rd(&k[c], r_max_mm[c]) : exact;
            worst = fmax(worst, fabs(rgb[c] - exact) / least);
        }
    }
    if (!(worst <= lut->max_relative_error))
        fail_msg("%s, epsilon %g, %d nodes: error %g, stated %g", lut->material.name, lut->epsilon,
                 lut->axis.node_count, worst, lut->max_relative_error);
}

/* Oracle: the textbook formula at points of the test's own. */
static void error_is_at_most_what_is_stated(void **state)
{
    (void)state;
    static const double epsilons[] = { 0.1, 0.01, 0.001 }, factors[] = { 1e-6, 1, 1e6 };
    struct rng rng = { .seed = 2 };
    for (size_t m = 0; m < COUNT(bundled); m++)
        for (size_t f = 0; f < COUNT(factors); f++)
            for (size_t e = 0; e < COUNT(epsilons); e++) {
                const struct io_material material = read_bundled(bundled[m], factors[f]);
                struct lut_splat1d *lut = bake(&material, epsilons[e], false);
                check_bound(&rng, lut);
                lut_splat1d_destroy(lut);
                if (strcmp(bundled[m], "spectralon") == 0 && epsilons[e] == 0.001)
                    continue; /* more decades than half has: its own test below */
                lut = bake(&material, epsilons[e], true);
                check_bound(&rng, lut);
                lut_splat1d_destroy(lut);
            }
}

/* Oracle: the definition of fewest; a table of half the nodes misses epsilon. */
static void no_smaller_table_would_do(void **state)
{
    (void)state;
    for (size_t m = 0; m < COUNT(bundled); m++) {
        const struct io_material material = read_bundled(bundled[m], 1);
        struct lut_splat1d *const lut = bake(&material, 0.001, false);
        assert_true(lut->axis.node_count > LUT_NODE_COUNT_MIN);
        lut->axis.node_count /= 2;
        for (int c = 0; c < 3; c++) {
            const dipole_coefficients k = coefficients_of(&material, c);
            for (int i = 0; i < lut->axis.node_count; i++)
                lut->rgb[3 * i + c] = (float)dipole_rd_per_mm2(&k, lut_axis_r_mm(&lut->axis, i));
        }
        assert_true(lut_splat1d_audit(lut, 20000, 7) > 0.98 * 0.001);
        lut_splat1d_destroy(lut);
    }
}

/* Oracle: dimensions; with all sigma times 2^k, lengths divide by it and R_d grows by 4^k, bit for bit. */
static void tables_scale_with_the_unit_of_length(void **state)
{
    (void)state;
    const struct io_material one = read_bundled("skin1", 1), other = read_bundled("skin1", 0x1p20);
    struct lut_splat1d *const a = bake(&one, 0.001, false), *const b = bake(&other, 0.001, false);
    assert_int_equal(a->axis.node_count, b->axis.node_count);
    assert_close(b->axis.r_max_mm * 0x1p20, a->axis.r_max_mm, 1e-11, "r_max");
    assert_true(b->axis.scale_mm * 0x1p20 == a->axis.scale_mm);
    for (int i = 0; i < 3 * a->axis.node_count; i++)
        assert_close((double)b->rgb[i] * 0x1p-40, (double)a->rgb[i], 1e-6, "texel %d", i / 3);
    lut_splat1d_destroy(a);
    lut_splat1d_destroy(b);
}

/* Oracle: limits; a channel that does not scatter is 0, without absorption the table still ends. */
static void edges_of_the_range_bake(void **state)
{
    (void)state;
    struct io_material material = make_material(0.5, 0);
    struct lut_splat1d *lut = bake(&material, 0.001, false);
    assert_int_equal(lut->axis.node_count, LUT_NODE_COUNT_MIN);
    assert_true(lut->max_relative_error == 0 && isfinite(lut->axis.r_max_mm) && lut->axis.r_max_mm > 0);
    for (int i = 0; i < 3 * LUT_NODE_COUNT_MIN; i++)
        assert_true(lut->rgb[i] == 0);
    lut_splat1d_destroy(lut);

    /* A channel without scattering has no say in where the table ends. */
    material = make_material(0.5, 2);
    const dipole_coefficients k = coefficients_of(&material, 0);
    material.layers[1][0].medium.sigma_a_per_mm = 1e-3;
    material.layers[1][0].medium.sigma_s_prime_per_mm = 0;
    lut = bake(&material, 0.001, true);
    assert_true(lut->axis.r_max_mm == dipole_r_max_mm(&k, 0.001));
    for (int i = 0; i < lut->axis.node_count; i++)
        assert_true(lut->rgb[3 * i + 1] == 0 && lut->rgb[3 * i] > 0);
    lut_splat1d_destroy(lut);

    material = make_material(0, 1);
    for (double epsilon = 1e-4; epsilon < 0.5; epsilon *= 7) {
        struct rng rng = { .seed = 4 };
        lut = bake(&material, epsilon, false);
        check_bound(&rng, lut);
        lut_splat1d_destroy(lut);
    }
}

/* ---- half --------------------------------------------------------------------------------------- */

/* Oracle: the binary16 format. */
static void half_rounds_to_nearest_even(void **state)
{
    (void)state;
    assert_true(lut_half_round(1 + 0x1p-11) == 1);
    assert_true(lut_half_round(1 + 3 * 0x1p-11) == 1 + 0x1p-9);
    assert_true(lut_half_round(1 + 0x1p-11 + 0x1p-30) == 1 + 0x1p-10);
    assert_true(lut_half_round(65504 + 15.9) == 65504);
    assert_true(lut_half_round(2047.5) == 2048);
    assert_true(lut_half_round(0x1p-14 * (1 + 0x1p-11)) == 0x1p-14);
    assert_true(lut_half_round(0x1p-24 * 2.4) == 0x1p-23);
    assert_true(lut_half_round(0x1p-26) == 0);
    assert_true(lut_half_round(0) == 0);
    struct rng rng = { .seed = 6 };
    for (int i = 0; i < 1000; i++) {
        const double max = log_uniform(&rng, 1e-30, 1e30);
        const double scaled = max / lut_half_scale(max);
        assert_true(scaled > 32752 && scaled <= 65504);
        int exponent;
        assert_true(frexp(lut_half_scale(max), &exponent) == 0.5);
    }
    assert_true(lut_half_scale(65504) == 1 && lut_half_scale(65505) == 2 && lut_half_scale(0) == 1);
}

/* Oracle: the digits and the range of half. */
static void half_is_refused_where_it_cannot_hold(void **state)
{
    (void)state;
    struct lut_splat1d *lut = NULL;
    dipole_status status = { 0 };
    struct io_material material = read_bundled("marble", 1);
    assert_false(lut_splat1d_bake_half(&material, 0x1p-11, &lut, &status));
    assert_null(lut);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message, "epsilon is 0.000488281, expected > 0.00049 for a half table (half "
                                        "rounds by as much); use float");
    material = read_bundled("spectralon", 1);
    assert_false(lut_splat1d_bake_half(&material, 0.001, &lut, &status));
    assert_null(lut);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message,
                        "channel R falls from 11.2 to 2.87e-09 per mm^2 within r_max, more than "
                        "half holds at epsilon 0.001; use float or a larger epsilon");
}

/* Oracle: the stated ranges. */
static void what_float_cannot_hold_is_refused(void **state)
{
    (void)state;
    struct lut_splat1d *lut = NULL;
    dipole_status status = { 0 };
    static const double epsilons[] = { 0, 9e-7, 0.6, NAN };
    struct io_material material = make_material(0.1, 1);
    for (size_t i = 0; i < COUNT(epsilons); i++) {
        assert_false(lut_splat1d_bake(&material, epsilons[i], &lut, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_null(lut);
    }
    static const double sigmas[] = { 1e-30, 1e30 };
    for (size_t i = 0; i < COUNT(sigmas); i++) {
        material = make_material(sigmas[i], sigmas[i]);
        assert_false(lut_splat1d_bake(&material, 0.01, &lut, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_non_null(strstr(status.message, "channel R falls from"));
        assert_null(lut);
    }
    material = make_material(-1, 1);
    assert_false(lut_splat1d_bake(&material, 0.01, &lut, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
}

/* ---- files -------------------------------------------------------------------------------------- */

static struct io_image *read_image(const char *path)
{
    struct io_image *image = NULL;
    dipole_status status = { 0 };
    if (!io_exr_read(path, &image, &status))
        fail_msg("%s", status.message);
    return image;
}

static void assert_text(const struct io_image *image, const char *name, const char *text)
{
    const struct io_attribute *const attribute = io_image_find(image, name);
    assert_non_null(attribute);
    assert_string_equal(attribute->text, text);
}

/* Oracle: what was baked, value by value. */
static void tables_come_back_as_they_were(void **state)
{
    (void)state;
    for (int is_half = 0; is_half < 2; is_half++) {
        struct io_material material = read_bundled("skin1", 1);
        material.layers[0][0].medium.fdr_kind = material.layers[1][0].medium.fdr_kind =
            material.layers[2][0].medium.fdr_kind = is_half ? DIPOLE_FDR_POLYNOMIAL : DIPOLE_FDR_EXACT;
        struct lut_splat1d *const lut = bake(&material, 0.002, is_half), *back = NULL;
        dipole_status status = { 0 };
        if (!lut_splat1d_write(lut, "skin1.exr", is_half, &status) ||
            !lut_splat1d_read("skin1.exr", &back, &status))
            fail_msg("%s", status.message);
        assert_string_equal(back->material.name, material.name);
        for (int c = 0; c < 3; c++) {
            assert_true(back->material.layers[c][0].medium.sigma_a_per_mm ==
                        material.layers[c][0].medium.sigma_a_per_mm);
            assert_true(back->material.layers[c][0].medium.sigma_s_prime_per_mm ==
                        material.layers[c][0].medium.sigma_s_prime_per_mm);
            assert_true(back->material.layers[c][0].medium.eta == material.layers[c][0].medium.eta);
            assert_int_equal(back->material.layers[c][0].medium.fdr_kind,
                             material.layers[c][0].medium.fdr_kind);
        }
        assert_true(back->epsilon == lut->epsilon && back->max_relative_error == lut->max_relative_error);
        assert_true(back->axis.r_max_mm == lut->axis.r_max_mm && back->axis.scale_mm == lut->axis.scale_mm);
        assert_int_equal(back->axis.node_count, lut->axis.node_count);
        assert_memory_equal(back->rgb, lut->rgb, (size_t)lut->axis.node_count * 3 * sizeof *lut->rgb);
        assert_true(lut_splat1d_audit(back, 20000, 9) <= back->max_relative_error);

        struct io_image *const image = read_image("skin1.exr");
        assert_text(image, "dipole:kind", "splat1d");
        assert_text(image, "dipole:model", "dipole");
        assert_text(image, "dipole:fdr", is_half ? "polynomial" : "exact");
        assert_text(image, "dipole:storage", is_half ? "half" : "float");
        assert_text(image, "dipole:version", dipole_version());
        assert_text(image, "dipole:axis_mapping",
                    "u = log(1 + (r/scale_mm)^2) / log(1 + (r_max_mm/scale_mm)^2); texel i of size has its "
                    "centre at u = i/(size - 1); linear between");
        assert_int_equal(image->height_px, 1);
        const struct io_attribute *const scale = io_image_find(image, "dipole:scale");
        assert_non_null(scale);
        for (int i = 0; i < image->width_px * 3; i++)
            assert_true((double)image->pixels[i] * scale->numbers[i % 3] == (double)lut->rgb[i]);
        io_image_destroy(image);
        lut_splat1d_destroy(back);
        lut_splat1d_destroy(lut);
    }
}

/* Oracle: the promise that nothing is rounded behind the caller's back. */
static void half_is_not_written_from_a_float_table(void **state)
{
    (void)state;
    unlink("float.exr");
    const struct io_material material = read_bundled("marble", 1);
    struct lut_splat1d *const lut = bake(&material, 0.01, false);
    dipole_status status = { 0 };
    assert_false(lut_splat1d_write(lut, "float.exr", true, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message,
                        "the table has values between those of half, expected one baked for half");
    assert_int_not_equal(access("float.exr", F_OK), 0);
    lut_splat1d_destroy(lut);
}

static struct io_attribute *attribute_of(struct io_image *image, const char *name)
{
    for (size_t i = 0; i < image->attribute_count; i++)
        if (strcmp(image->attributes[i].name, name) == 0)
            return &image->attributes[i];
    fail_msg("no %s", name);
    return NULL;
}

static void assert_refused(const struct io_image *image, const char *message)
{
    struct lut_splat1d *lut = NULL;
    dipole_status status = { 0 };
    assert_true(io_exr_write("bad.exr", image, false, NULL));
    assert_false(lut_splat1d_read("bad.exr", &lut, &status));
    assert_null(lut);
    assert_string_equal(status.source, "bad.exr");
    if (!strstr(status.message, message))
        fail_msg("\"%s\" is not in \"%s\"", message, status.message);
}

/* Oracle: each thing that can be wrong with a file, named. */
static void files_that_are_no_tables_are_refused(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("marble", 1);
    struct lut_splat1d *const lut = bake(&material, 0.01, false);
    assert_true(lut_splat1d_write(lut, "good.exr", false, NULL));
    lut_splat1d_destroy(lut);

    struct io_image *image = read_image("good.exr");
    for (size_t i = 0; i < image->attribute_count; i++) {
        struct io_attribute *const attribute = &image->attributes[i];
        if (strcmp(attribute->name, "dipole:axis_mapping") == 0 ||
            strcmp(attribute->name, "dipole:unit") == 0)
            continue; /* for people */
        char name[64], message[128];
        snprintf(name, sizeof name, "%s", attribute->name);
        snprintf(attribute->name, sizeof attribute->name, "dipole:other");
        snprintf(message, sizeof message, "no attribute %s, expected ", name);
        assert_refused(image, message);
        snprintf(attribute->name, sizeof attribute->name, "%s", name);
    }
    io_image_destroy(image);

    image = read_image("good.exr");
    attribute_of(image, "dipole:sigma_a_per_mm")->numbers[1] *= 1.0001;
    assert_refused(image, "dipole:input_hash is ");
    attribute_of(image, "dipole:sigma_a_per_mm")->numbers[1] = -1;
    assert_refused(image, "dipole:sigma_a_per_mm is -1, expected 0 to 1e+50");
    io_image_destroy(image);

    image = read_image("good.exr");
    attribute_of(image, "dipole:size")->numbers[0] = 64;
    assert_refused(image, "the picture is 128 x 1 with 3 channels, expected 64 x 1 with 3 (dipole:size)");
    io_image_destroy(image);

    image = read_image("good.exr");
    attribute_of(image, "dipole:max_relative_error")->numbers[0] = 0.02;
    assert_refused(image, "dipole:max_relative_error is 0.02, expected 0 to 0.01");
    io_image_destroy(image);

    image = read_image("good.exr");
    snprintf(attribute_of(image, "dipole:kind")->text, 16, "tsm");
    assert_refused(image, "dipole:kind is \"tsm\", expected \"splat1d\"");
    io_image_destroy(image);

    image = read_image("good.exr");
    image->pixels[3 * 5 + 1] = -1;
    assert_refused(image, "texel 5 holds -1, expected a finite value >= 0");
    io_image_destroy(image);

    assert_true(io_image_create(64, 1, 3, &image, NULL));
    assert_refused(image, "no attribute dipole:kind, expected a text");
    io_image_destroy(image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(axis_and_its_inverse_agree),
        cmocka_unit_test(axis_is_what_the_attribute_says),
        cmocka_unit_test(nodes_are_exact),
        cmocka_unit_test(error_is_at_most_what_is_stated),
        cmocka_unit_test(no_smaller_table_would_do),
        cmocka_unit_test(tables_scale_with_the_unit_of_length),
        cmocka_unit_test(edges_of_the_range_bake),
        cmocka_unit_test(half_rounds_to_nearest_even),
        cmocka_unit_test(half_is_refused_where_it_cannot_hold),
        cmocka_unit_test(what_float_cannot_hold_is_refused),
        cmocka_unit_test(tables_come_back_as_they_were),
        cmocka_unit_test(half_is_not_written_from_a_float_table),
        cmocka_unit_test(files_that_are_no_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
