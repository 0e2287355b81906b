#include "tests/check.h"

#include "io/file.h"
#include "io/material_file.h"
#include "tests/reference_file.h"

#include <ctype.h>
#include <dirent.h>
#include <stdlib.h>
#include <string.h>

static bool parse(const char *text, struct io_material *material, dipole_status *status)
{
    struct io_json_document *document;
    if (!io_json_parse(text, strlen(text), "m.json", &document, status))
        return false;
    const struct io_json root = io_json_root(document);
    const bool done = io_material_parse(&root, material, status);
    io_json_destroy(document);
    return done;
}

/* ---- the bundled materials ------------------------------------------------------------------------- */

static int json_count(const char *folder, void (*visit)(const char *path))
{
    DIR *entries = opendir(folder);
    assert_non_null(entries);
    int count = 0;
    for (const struct dirent *entry; (entry = readdir(entries));) {
        const char *end = strstr(entry->d_name, ".json");
        if (!end || end[5] != '\0' || strstr(entry->d_name, "schema"))
            continue;
        char path[2048];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        visit(path);
        count++;
    }
    closedir(entries);
    return count;
}

static void expect_readable(const char *path)
{
    struct io_material material;
    dipole_status status;
    if (!io_material_read(path, &material, &status))
        fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
    assert_string_equal(material.warning, "");
    assert_true(material.name[0] && material.source[0]);
}

/* Oracle: the number of materials in the two publications, and those of layers. */
static void every_bundled_material_is_read(void **state)
{
    (void)state;
    assert_int_equal(json_count(SOURCE_FOLDER "/materials", expect_readable), 12);
    assert_int_equal(json_count(SOURCE_FOLDER "/materials/narasimhan2006", expect_readable), 35);
    assert_int_equal(json_count(SOURCE_FOLDER "/materials/layered", expect_readable), 2);
}

/* The publication used the polynomial Fdr, and prints two digits. Its own fit of the blue of chicken 1
 * gives 0.126, but 0.10 is printed. */
static void expect_measured_reflectance(const char *path)
{
    struct io_material material;
    assert_true(io_material_read(path, &material, NULL));
    json_t *file = json_load_file(path, 0, NULL);
    const json_t *measured =
        json_object_get(json_object_get(file, "extras"), "measured_diffuse_reflectance");
    assert_int_equal(json_array_size(measured), 3);
    for (size_t c = 0; c < 3; c++) {
        dipole_coefficients coefficients;
        material.layers[c][0].medium.fdr_kind = DIPOLE_FDR_POLYNOMIAL;
        assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &coefficients, NULL));
        const double found = dipole_diffuse_reflectance(&coefficients);
        const double expected = json_number_value(json_array_get(measured, c));
        const double tolerance = strcmp(material.name, "Chicken 1") == 0 && c == 2 ? 0.03 : 0.01;
        if (fabs(found - expected) > tolerance)
            fail_msg("%s %s: %g, measured %g", material.name, io_channel_names[c], found, expected);
    }
    json_decref(file);
}

/* Oracle: the diffuse reflectance that Jensen et al. measured, which no coefficient enters. */
static void jensen_materials_have_the_measured_reflectance(void **state)
{
    (void)state;
    json_count(SOURCE_FOLDER "/materials", expect_measured_reflectance);
}

/* Oracle: the published coefficients, in other people's programs; tests/reference/jensen2001.csv and
 * narasimhan2006.csv. A file is named as its material, in small letters. */
static void check_published(const char *table, const char *folder, int row_count)
{
    struct reference_file rows;
    int count = 0;
    reference_open(&rows, table);
    while (reference_next(&rows)) {
        char path[512];
        struct io_material material;
        size_t used = (size_t)snprintf(path, sizeof path, "%s", folder);
        for (const char *p = reference_text(&rows, "material"); *p; p++)
            if (isalnum((unsigned char)*p))
                path[used++] = (char)tolower((unsigned char)*p);
            else if (path[used - 1] != '_')
                path[used++] = '_';
        strcpy(path + used - (path[used - 1] == '_'), ".json");
        assert_true(io_material_read(path, &material, NULL));
        const size_t c = strcspn("RGB", reference_text(&rows, "channel"));
        const dipole_medium *const medium = &material.layers[c][0].medium;
        if (medium->sigma_a_per_mm != reference_number(&rows, "sigma_a_per_mm") ||
            medium->sigma_s_prime_per_mm != reference_number(&rows, "sigma_sp_per_mm") ||
            medium->eta != reference_number(&rows, "eta"))
            fail_msg("%s %s: sigma_a %g, sigma_s' %g, eta %g", path, io_channel_names[c],
                     medium->sigma_a_per_mm, medium->sigma_s_prime_per_mm, medium->eta);
        count++;
    }
    assert_int_equal(count, row_count);
}

static void materials_are_the_published_ones(void **state)
{
    (void)state;
    check_published("jensen2001.csv", SOURCE_FOLDER "/materials/", 36);
    check_published("narasimhan2006.csv", SOURCE_FOLDER "/materials/narasimhan2006/", 105);
}

/* ---- what is read ---------------------------------------------------------------------------------- */

/* Oracle: sigma_s' = sigma_s (1 - g). */
static void scattering_with_g_is_reduced(void **state)
{
    (void)state;
    struct io_material one = { 0 }, each = { 0 };
    assert_true(parse("{\"name\": \"a\", \"eta\": 1.4, \"fdr\": \"polynomial\", \"model\": \"dipole\", "
                      "\"sigma_a_per_mm\": [0, 1, 2], \"sigma_s_per_mm\": [1, 2, 4], \"g\": 0.75}",
                      &one, NULL));
    assert_true(
        parse("{\"name\": \"a\", \"eta\": 1.4, \"sigma_a_per_mm\": [0, 1, 2], "
              "\"sigma_s_per_mm\": [1, 2, 4], \"g\": [0.75, 0, -0.5], \"extras\": {\"x\": []}, \"fit\": 3}",
              &each, NULL));
    static const double expected_one[] = { 0.25, 0.5, 1.0 }, expected_each[] = { 0.25, 2.0, 6.0 };
    for (int c = 0; c < 3; c++) {
        assert_true(one.layers[c][0].medium.sigma_a_per_mm == c);
        assert_true(one.layers[c][0].medium.eta == 1.4);
        assert_int_equal(one.layers[c][0].medium.fdr_kind, DIPOLE_FDR_POLYNOMIAL);
        assert_int_equal(each.layers[c][0].medium.fdr_kind, DIPOLE_FDR_EXACT);
        assert_true(one.layers[c][0].medium.sigma_s_prime_per_mm == expected_one[c]);
        assert_true(each.layers[c][0].medium.sigma_s_prime_per_mm == expected_each[c]);
    }
}

#define HEAD "{\"name\": \"a\", \"eta\": 1.3,\n"
#define SIGMAS "\"sigma_a_per_mm\": [0.1, 0.2, 0.3], \"sigma_s_prime_per_mm\": [1, 2, 3]"

struct failure {
    const char *text;
    dipole_code code;
    int line, column;
    const char *message;
};

static void expect_failures(const struct failure *cases, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct io_material material = { .name = "untouched" };
        dipole_status status = { 0 };
        if (parse(cases[i].text, &material, &status))
            fail_msg("read: %s", cases[i].text);
        assert_string_equal(material.name, "untouched");
        assert_string_equal(status.message, cases[i].message);
        assert_string_equal(status.source, "m.json");
        if (status.code != cases[i].code || status.line != cases[i].line ||
            status.column != cases[i].column)
            fail_msg("%s: code %d at %d:%d, expected %d at %d:%d", cases[i].message, status.code,
                     status.line, status.column, cases[i].code, cases[i].line, cases[i].column);
    }
}

/* Oracle: the messages as a user should read them. */
static void failures_name_key_value_and_range(void **state)
{
    (void)state;
    static const struct failure cases[] = {
        { "{\"eta\": 1.3, " SIGMAS "}", DIPOLE_BAD_VALUE, 1, 1, "name is missing, it is required here" },
        { "{\"name\": \"a\", " SIGMAS "}", DIPOLE_BAD_VALUE, 1, 1, "eta is missing, it is required here" },
        { "{\"name\": \"a\", \"eta\": 0, " SIGMAS "}", DIPOLE_BAD_VALUE, 1, 22,
          "eta is 0, expected > 0 (0.1 to 10)" },
        { "{\"name\": \"a\", \"eta\": -1.3, " SIGMAS "}", DIPOLE_BAD_VALUE, 1, 22,
          "eta is -1.3, expected > 0 (0.1 to 10)" },
        { HEAD SIGMAS ", \"sigma_t\": 1}", DIPOLE_BAD_VALUE, 2, 71,
          "unknown key \"sigma_t\", expected name, eta, model, fdr, sigma_a_per_mm, sigma_s_prime_per_mm, "
          "sigma_s_per_mm, g, diffuse_reflectance, mean_free_path_mm, diffuse_mean_free_path_mm, layers, "
          "source, extras, fit" },
        { HEAD "\"sigma_a_per_mm\": [1, -0.2, 0], \"sigma_s_prime_per_mm\": [1, 2, 3]}", DIPOLE_BAD_VALUE,
          2, 23, "sigma_a_per_mm[1] is -0.2, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { HEAD "\"sigma_a_per_mm\": [1, 0, 0], \"sigma_s_prime_per_mm\": [1, 2, 1e60]}", DIPOLE_BAD_VALUE,
          2, 61, "sigma_s_prime_per_mm[2] is 1e+60, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { HEAD "\"sigma_a_per_mm\": [1, 0, 0], \"sigma_s_prime_per_mm\": [1, 2, 0]}", DIPOLE_BAD_VALUE, 2,
          26, "sigma_a_per_mm[2] and sigma_s_prime_per_mm are both 0, expected one > 0" },
        { HEAD "\"sigma_a_per_mm\": [1, 0], \"sigma_s_prime_per_mm\": [1, 2, 3]}", DIPOLE_BAD_VALUE, 2, 19,
          "sigma_a_per_mm has 2 elements, expected an array of 3 numbers" },
        { HEAD "\"sigma_a_per_mm\": 1, \"sigma_s_prime_per_mm\": [1, 2, 3]}", DIPOLE_BAD_VALUE, 2, 19,
          "sigma_a_per_mm is a number, expected an array of 3 numbers" },
        { HEAD "\"sigma_a_per_mm\": [NaN, 1, 1], \"sigma_s_prime_per_mm\": [1, 2, 3]}", DIPOLE_BAD_SYNTAX,
          2, 22, "JSON syntax: invalid token near 'NaN'" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_per_mm\": [1, 2, 3], \"g\": 1}", DIPOLE_BAD_VALUE,
          2, 64, "g is 1, expected more than -1 and less than 1" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_per_mm\": [1, 2, 3], \"g\": [0, 0, -1]}",
          DIPOLE_BAD_VALUE, 2, 71, "g[2] is -1, expected more than -1 and less than 1" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_per_mm\": [1, -2, 3], \"g\": 0.5}",
          DIPOLE_BAD_VALUE, 2, 52,
          "sigma_s_per_mm[1] times (1 - g): sigma_s_prime_per_mm is -1, expected >= 0 (0, or 1e-50 to "
          "1e+50)" },
        { HEAD "\"sigma_s_prime_per_mm\": [1, 2, 3]}", DIPOLE_BAD_VALUE, 1, 1,
          "sigma_a_per_mm is missing, expected the absorption as [R, G, B]" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1]}", DIPOLE_BAD_VALUE, 1, 1,
          "sigma_s_prime_per_mm is missing, expected it, or sigma_s_per_mm and g" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1], \"g\": 0}", DIPOLE_BAD_VALUE, 1, 1,
          "sigma_s_per_mm is missing, expected beside g" },
        { HEAD "\"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_per_mm\": [1, 1, 1]}", DIPOLE_BAD_VALUE, 1, 1,
          "g is missing, expected beside sigma_s_per_mm" },
        { HEAD SIGMAS ", \"g\": 0}", DIPOLE_BAD_VALUE, 2, 76,
          "g stands beside sigma_s_prime_per_mm, expected either that or sigma_s_per_mm and g" },
        { HEAD SIGMAS ", \"fdr\": \"schlick\"}", DIPOLE_BAD_VALUE, 2, 78,
          "fdr is \"schlick\", expected \"exact\" or \"polynomial\"" },
        { HEAD SIGMAS ", \"model\": \"cone\"}", DIPOLE_BAD_VALUE, 2, 80,
          "model is \"cone\", expected \"dipole\" or \"better_dipole\" or \"multipole\" or \"beam\" or "
          "\"modes\"" },
        { HEAD "\"diffuse_reflectance\": [1, 1.5, 1], \"mean_free_path_mm\": [1, 1, 1]}", DIPOLE_BAD_VALUE,
          2, 28, "diffuse_reflectance[1] is 1.5, expected 0 to 1" },
        { HEAD "\"diffuse_reflectance\": [1, 0, 1], \"mean_free_path_mm\": [1, 1, -2]}", DIPOLE_BAD_VALUE,
          2, 63, "mean_free_path_mm[2] is -2, expected > 0 (1e-50 to 1e+50)" },
        { HEAD "\"diffuse_reflectance\": [0.5, 1, 0], \"diffuse_mean_free_path_mm\": [1, 1, 1]}",
          DIPOLE_BAD_VALUE, 2, 30,
          "diffuse_reflectance[1] is 1, where light travels without end, expected less beside "
          "diffuse_mean_free_path_mm" },
        { HEAD "\"diffuse_reflectance\": [1, 1, 1]}", DIPOLE_BAD_VALUE, 1, 1,
          "mean_free_path_mm is missing, expected it or diffuse_mean_free_path_mm beside "
          "diffuse_reflectance" },
        { HEAD "\"mean_free_path_mm\": [1, 1, 1]}", DIPOLE_BAD_VALUE, 1, 1,
          "diffuse_reflectance is missing, expected beside a mean free path" },
        { HEAD "\"diffuse_reflectance\": [1, 1, 1], \"mean_free_path_mm\": [1, 1, 1], "
               "\"diffuse_mean_free_path_mm\": [1, 1, 1]}",
          DIPOLE_BAD_VALUE, 2, 96,
          "diffuse_mean_free_path_mm stands beside mean_free_path_mm, expected one of them: 1/sigma_t' is "
          "the "
          "mean free path, 1/sigma_tr the diffuse one" },
        { HEAD SIGMAS ", \"diffuse_reflectance\": [1, 1, 1]}", DIPOLE_BAD_VALUE, 2, 19,
          "sigma_a_per_mm stands beside diffuse_reflectance, expected either coefficients or a reflectance "
          "with a "
          "length" },
        { "[1]", DIPOLE_BAD_VALUE, 1, 1, "the whole is an array, expected an object" },
        { HEAD SIGMAS ", \"thickness_mm\": 3}", DIPOLE_BAD_VALUE, 2, 87,
          "thickness_mm stands beside the material's name, expected in one of its layers, as in "
          "\"layers\": [{ \"thickness_mm\": 3, ... }]" },
        { HEAD "\"model\": \"better_dipole\", \"diffuse_reflectance\": [1, 1, 1], \"mean_free_path_mm\": "
               "[1, 1, 1]}",
          DIPOLE_NOT_SUPPORTED, 2, 50,
          "diffuse_reflectance stands beside the model \"better_dipole\", which has no inverse, expected "
          "coefficients, or the model \"dipole\", \"multipole\" or \"beam\"" },
        { HEAD
          "\"model\": \"modes\", \"diffuse_reflectance\": [1, 1, 1], \"mean_free_path_mm\": [1, 1, 1]}",
          DIPOLE_NOT_SUPPORTED, 2, 42,
          "diffuse_reflectance stands beside the model \"modes\", which has no inverse, expected "
          "coefficients, or the model \"dipole\", \"multipole\" or \"beam\"" },
    };
    expect_failures(cases, sizeof cases / sizeof cases[0]);
}

#define LAYER(thickness) "{\"thickness_mm\": " thickness ", " SIGMAS "}"
#define FOUR_LAYERS LAYER("1") "," LAYER("1") "," LAYER("1") "," LAYER("1")

/* Oracle: the messages as a user should read them. */
static void failures_in_layers_name_the_layer(void **state)
{
    (void)state;
    static const struct failure cases[] = {
        { HEAD "\"layers\": []}", DIPOLE_BAD_VALUE, 2, 11, "layers has 0 elements, expected 1 to 16" },
        { HEAD "\"layers\": {}}", DIPOLE_BAD_VALUE, 2, 11, "layers is an object, expected an array" },
        { HEAD "\"layers\": [" FOUR_LAYERS "," FOUR_LAYERS "," FOUR_LAYERS "," FOUR_LAYERS
               "," LAYER("1") "]}",
          DIPOLE_BAD_VALUE, 2, 11, "layers has 17 elements, expected 1 to 16" },
        { HEAD "\"layers\": [3]}", DIPOLE_BAD_VALUE, 2, 12, "layers[0] is a number, expected an object" },
        { HEAD "\"layers\": [" LAYER("1") ",\n{" SIGMAS "}]}", DIPOLE_BAD_VALUE, 3, 1,
          "layers[1].thickness_mm is missing, it is required here" },
        { HEAD "\"layers\": [" LAYER("1") ",\n{\"thickness_mm\": \"infinite\"}]}", DIPOLE_BAD_VALUE, 3, 1,
          "layers[1].sigma_a_per_mm is missing, expected the absorption as [R, G, B]" },
        { HEAD "\"layers\": [" LAYER("\"infinite\"") ",\n" LAYER("1") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is \"infinite\", expected a number of mm: only the last layer can be" },
        { HEAD "\"layers\": [" LAYER("\"thick\"") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is \"thick\", expected a number of mm, or \"infinite\"" },
        { HEAD "\"layers\": [" LAYER("null") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is null, expected a number" },
        { HEAD "\"layers\": [" LAYER("0") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is 0, expected > 0 (1e-50 to 1e+50, or infinite)" },
        { HEAD "\"layers\": [" LAYER("-1") ", " LAYER("1") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is -1, expected > 0 (1e-50 to 1e+50)" },
        { HEAD "\"layers\": [" LAYER("1e60") "]}", DIPOLE_BAD_VALUE, 2, 29,
          "layers[0].thickness_mm is 1e+60, expected > 0 (1e-50 to 1e+50, or infinite)" },
        { HEAD "\"layers\": [{\"depth_mm\": 1, " SIGMAS "}]}", DIPOLE_BAD_VALUE, 2, 13,
          "unknown key \"depth_mm\" in layers[0], expected thickness_mm, name, eta, sigma_a_per_mm, "
          "sigma_s_prime_per_mm, sigma_s_per_mm, g, diffuse_reflectance, mean_free_path_mm, "
          "diffuse_mean_free_path_mm" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"sigma_a_per_mm\": [1, 1, 1], "
               "\"sigma_s_prime_per_mm\": [1, -1, 1]}]}",
          DIPOLE_BAD_VALUE, 2, 89,
          "layers[0].sigma_s_prime_per_mm[1] is -1, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"eta\": 11, " SIGMAS "}]}", DIPOLE_BAD_VALUE, 2, 39,
          "layers[0].eta is 11, expected > 0 (0.1 to 10)" },
        { "{\"name\": \"a\", \"eta\": 11,\n\"layers\": [" LAYER("1") "]}", DIPOLE_BAD_VALUE, 1, 22,
          "eta is 11, expected > 0 (0.1 to 10)" },
        { "{\"name\": \"a\",\n\"layers\": [{\"thickness_mm\": 1, \"eta\": 1.3, " SIGMAS
          "}, " LAYER("1") "]}",
          DIPOLE_BAD_VALUE, 2, 115,
          "layers[1].eta is missing, expected it here, or beside layers for all of them" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"eta\": 0.2, " SIGMAS "},\n"
               "{\"thickness_mm\": 1, \"eta\": 9, " SIGMAS "}]}",
          DIPOLE_BAD_VALUE, 3, 28,
          "layers[1].eta is 45 times that of the layer above, expected 0.1 to 10" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"eta\": 0.1, " SIGMAS "},\n" LAYER("1") "]}",
          DIPOLE_BAD_VALUE, 3, 1, "layers[1].eta is 13 times that of the layer above, expected 0.1 to 10" },
        { HEAD SIGMAS ", \"layers\": [" LAYER("1") "]}", DIPOLE_BAD_VALUE, 2, 19,
          "sigma_a_per_mm stands beside layers, expected either layers or one medium" },
        { HEAD "\"model\": \"dipole\", \"layers\": [" LAYER("1") "]}", DIPOLE_NOT_SUPPORTED, 2, 10,
          "model is \"dipole\", which knows only a half-space, expected \"beam\", \"modes\" or "
          "\"multipole\" beside "
          "layers" },
        { HEAD "\"model\": \"better_dipole\", \"layers\": [" LAYER("1") "]}", DIPOLE_NOT_SUPPORTED, 2, 10,
          "model is \"better_dipole\", which knows only a half-space, expected \"beam\", \"modes\" or "
          "\"multipole\" "
          "beside layers" },
        { HEAD "\"model\": \"multipole\", \"layers\": [" LAYER("1") ",\n" LAYER("0.4") "]}",
          DIPOLE_NOT_SUPPORTED, 3, 18,
          "layers[1].thickness_mm (channel R) is 0.4 mm thick, and the source of the multipole lies "
          "0.909091 mm deep, below it; expected a thicker layer, or the model \"beam\" or \"modes\", which "
          "have no "
          "limit" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"name\": 3, " SIGMAS "}]}", DIPOLE_BAD_VALUE, 2, 40,
          "layers[0].name is a number, expected a string" },
        { HEAD "\"layers\": [{\"thickness_mm\": 1, \"diffuse_reflectance\": [0, 1, 1], "
               "\"diffuse_mean_free_path_mm\": [1, 1, 1]}]}",
          DIPOLE_BAD_VALUE, 2, 59,
          "layers[0].diffuse_reflectance[1] is 1, where light travels without end, expected less beside "
          "diffuse_mean_free_path_mm" },
    };
    expect_failures(cases, sizeof cases / sizeof cases[0]);
}

/* Oracle: the text itself; a layer without an eta has that of the material. */
static void layers_are_read_from_the_top(void **state)
{
    (void)state;
    struct io_material material;
    dipole_status status;
    static const char text[] =
        HEAD "\"fdr\": \"polynomial\", \"layers\": [\n"
             "{\"thickness_mm\": 0.25, \"name\": \"wax\", \"eta\": 1.45, " SIGMAS "},\n"
             "{\"thickness_mm\": 2, \"sigma_a_per_mm\": [0, 0, 1], \"sigma_s_per_mm\": [4, 4, 0], \"g\": "
             "0.75},\n"
             "{\"thickness_mm\": \"infinite\", \"diffuse_reflectance\": [0.9, 0.5, 0.1], "
             "\"mean_free_path_mm\": [1, 2, 3]}]}";
    if (!parse(text, &material, &status))
        fail_msg("%s", status.message);
    assert_int_equal(material.model, DIPOLE_MODEL_BEAM);
    assert_int_equal(material.layer_count, 3);
    assert_true(io_material_has_layers(&material));
    assert_string_equal(material.layer_names[0], "wax");
    assert_string_equal(material.layer_names[1], "");
    static const double thickness_mm[] = { 0.25, 2, INFINITY }, eta[] = { 1.45, 1.3, 1.3 };
    static const double reflectance[] = { 0.9, 0.5, 0.1 };
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        for (size_t i = 0; i < 3; i++) {
            assert_true(material.layers[c][i].thickness_mm == thickness_mm[i]);
            assert_true(material.layers[c][i].medium.eta == eta[i]);
            assert_int_equal(material.layers[c][i].medium.fdr_kind, DIPOLE_FDR_POLYNOMIAL);
        }
        assert_true(material.layers[c][0].medium.sigma_s_prime_per_mm == (double)(c + 1));
        assert_true(material.layers[c][1].medium.sigma_s_prime_per_mm == (c < 2 ? 1 : 0));
        dipole_stack *stack;
        assert_true(dipole_stack_create(&material.layers[c][2], 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE,
                                        &stack, NULL));
        assert_close(dipole_stack_total(stack, DIPOLE_FACE_LIT), reflectance[c], 1e-12, "channel %zu", c);
        dipole_stack_destroy(stack);
    }
    /* an eta of each layer needs none of the material */
    assert_true(parse("{\"name\": \"a\", \"model\": \"multipole\", \"layers\": [{\"thickness_mm\": 2, "
                      "\"eta\": 1.2, " SIGMAS "}]}",
                      &material, NULL));
    assert_int_equal(material.model, DIPOLE_MODEL_MULTIPOLE);
    assert_true(material.layers[2][0].medium.eta == 1.2);
}

/* Oracle: the names; without layers each model has its half-space. */
static void every_model_is_read(void **state)
{
    (void)state;
    for (int model = 0; io_model_names[model]; model++) {
        char text[512];
        struct io_material material;
        snprintf(text, sizeof text, HEAD "\"model\": \"%s\", " SIGMAS "}", io_model_names[model]);
        assert_true(parse(text, &material, NULL));
        assert_int_equal(material.model, model);
        assert_false(io_material_has_layers(&material));
    }
}

/* Oracle: the way forth. A material given by reflectance and length has that reflectance and that length,
 * by its model; the half-space of the multipole is the dipole. */
static void reflectance_and_length_give_the_coefficients(void **state)
{
    (void)state;
    static const char *const lengths[] = { "mean_free_path_mm", "diffuse_mean_free_path_mm" };
    static const char *const models[] = { "dipole", "beam", "multipole" };
    const double reflectance[3] = { 0.83, 0.5, 0.01 }, length_mm[3] = { 0.45, 2, 30 };
    for (int i = 0; i < 6; i++) {
        char text[512];
        struct io_material material;
        dipole_status status;
        snprintf(text, sizeof text,
                 HEAD
                 "\"model\": \"%s\", \"diffuse_reflectance\": [0.83, 0.5, 0.01], \"%s\": [0.45, 2, 30]}",
                 models[i / 2], lengths[i % 2]);
        if (!parse(text, &material, &status))
            fail_msg("%s", status.message);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            dipole_stack *stack;
            assert_true(dipole_stack_create(material.layers[c], material.layer_count, material.model,
                                            DIPOLE_FROM_ABOVE, &stack, NULL));
            const dipole_coefficients *const k = dipole_stack_coefficients(stack, 0);
            assert_close(dipole_stack_total(stack, DIPOLE_FACE_LIT), reflectance[c], 1e-12, "channel %d",
                         c);
            assert_close(i % 2 == 0 ? k->mean_free_path_mm : 1 / k->sigma_tr_per_mm, length_mm[c], 1e-12,
                         "channel %d", c);
            dipole_stack_destroy(stack);
        }
    }
}

/* Oracle: the way to the material is part of the key. */
static void a_material_inside_a_scene_is_named_by_its_path(void **state)
{
    (void)state;
    static const char text[] = "{\"objects\": [{}, {\"material\":\n " HEAD
                               "\"sigma_a_per_mm\": [1, 1, -1], \"sigma_s_prime_per_mm\": [1, 2, 3]}}]}";
    struct io_json_document *document;
    struct io_material material;
    dipole_status status;
    assert_true(io_json_parse(text, sizeof text - 1, "s.json", &document, NULL));
    const struct io_json root = io_json_root(document);
    const struct io_json objects = io_json_member(&root, "objects");
    const struct io_json object = io_json_element(&objects, 1);
    const struct io_json at = io_json_member(&object, "material");
    assert_false(io_material_parse(&at, &material, &status));
    assert_string_equal(
        status.message,
        "objects[1].material.sigma_a_per_mm[2] is -1, expected >= 0 (0, or 1e-50 to 1e+50)");
    assert_int_equal(status.line, 3);
    assert_int_equal(status.column, 26);
    io_json_destroy(document);
}

/* Oracle: 1/m given as 1/mm makes the mean free path 1000 times too short. */
static void a_unit_slip_is_warned_of(void **state)
{
    (void)state;
    struct io_material material;
    assert_true(parse(HEAD "\"sigma_a_per_mm\": [2, 4, 7], \"sigma_s_prime_per_mm\": [2190, 26200, 30000]}",
                      &material, NULL));
    assert_string_equal(
        material.warning,
        "channel G: sigma_a_per_mm + sigma_s_prime_per_mm is 26204, a mean free path of "
        "3.81621e-05 mm, expected 0.0001 to 10000 mm; coefficients in 1/m must be divided by 1000 "
        "to be in 1/mm, those in 1/cm by 10");
    assert_true(parse(HEAD "\"sigma_a_per_mm\": [0, 0, 0], \"sigma_s_prime_per_mm\": [1e-5, 1, 1]}",
                      &material, NULL));
    assert_string_equal(
        material.warning,
        "channel R: sigma_a_per_mm + sigma_s_prime_per_mm is 1e-05, a mean free path of 100000 mm, "
        "expected 0.0001 to 10000 mm; coefficients in 1/um must be multiplied by 1000 to be in "
        "1/mm");
    assert_true(parse(HEAD
                      "\"layers\": [{\"thickness_mm\": 1, " SIGMAS "}, {\"thickness_mm\": 2, "
                      "\"sigma_a_per_mm\": [2, 4, 7], \"sigma_s_prime_per_mm\": [2190, 26200, 30000]}]}",
                      &material, NULL));
    assert_int_equal(strncmp(material.warning, "layers[1], channel G: sigma_a_per_mm + ", 39), 0);
}

/* ---- what is written ------------------------------------------------------------------------------- */

/* Oracle: reading gives every bit back, and writing that gives the same bytes. */
static void what_is_written_is_read_back(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < 50; i++) {
        struct io_material material = { .name = "Jade \"\303\251\"", .source = "a\nb" }, again;
        const bool has_layers = i % 5 > 1, has_one_eta = i % 7 > 3;
        material.layer_count = has_layers ? 1 + random_bits(&rng) % DIPOLE_LAYER_LIMIT : 1;
        material.model = has_layers || i % 2 ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE;
        for (size_t k = 0; k < material.layer_count; k++) {
            const double eta =
                k > 0 && has_one_eta ? material.layers[0][0].medium.eta : uniform(&rng, 1.0, 2.0);
            const bool is_infinite = k + 1 == material.layer_count && (!has_layers || i % 3 == 0);
            const double thickness_mm = is_infinite ? INFINITY : log_uniform(&rng, 1e-3, 1e2);
            if (k % 2 == 0)
                snprintf(material.layer_names[k], sizeof *material.layer_names, "l %zu", k);
            for (int c = 0; c < 3; c++)
                material.layers[c][k] =
                    (dipole_layer){ .medium = { .sigma_a_per_mm = log_uniform(&rng, 1e-4, 1e2),
                                                .sigma_s_prime_per_mm = log_uniform(&rng, 1e-2, 1e3),
                                                .eta = eta,
                                                .fdr_kind =
                                                    i % 2 ? DIPOLE_FDR_POLYNOMIAL : DIPOLE_FDR_EXACT },
                                    .thickness_mm = thickness_mm };
        }
        if (!io_material_has_layers(&material))
            material.layer_names[0][0] = '\0';
        json_t *fit = json_pack("{s:b, s:[{s:f}]}", "converged", 1, "channels", "sigma_a_per_mm", 0.1);
        char *first, *second;
        size_t first_size, second_size;
        assert_true(io_material_write("m.json", &material, i % 3 ? fit : NULL, NULL));
        assert_true(io_material_read("m.json", &again, NULL));
        assert_true(io_file_read("m.json", 10000, &first, &first_size, NULL));
        assert_true(io_material_write("m.json", &again, i % 3 ? fit : NULL, NULL));
        assert_true(io_file_read("m.json", 10000, &second, &second_size, NULL));
        assert_string_equal(first, second);
        assert_int_equal(strstr(first, "\"fit\"") != NULL, i % 3 != 0);
        assert_string_equal(again.name, material.name);
        assert_string_equal(again.source, material.source);
        assert_int_equal(again.model, material.model);
        assert_int_equal(again.layer_count, material.layer_count);
        for (size_t k = 0; k < material.layer_count; k++) {
            assert_string_equal(again.layer_names[k], material.layer_names[k]);
            for (int c = 0; c < 3; c++) {
                const dipole_layer *const x = &again.layers[c][k], *const y = &material.layers[c][k];
                assert_true(x->thickness_mm == y->thickness_mm && x->medium.eta == y->medium.eta);
                assert_true(x->medium.sigma_a_per_mm == y->medium.sigma_a_per_mm);
                assert_true(x->medium.sigma_s_prime_per_mm == y->medium.sigma_s_prime_per_mm);
                assert_int_equal(x->medium.fdr_kind, y->medium.fdr_kind);
            }
        }
        free(first);
        free(second);
        json_decref(fit);
    }
}

/* Oracle: the bytes that a reader of the file expects. */
static void the_written_file_is_for_people(void **state)
{
    (void)state;
    struct io_material material = { .name = "Marble" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] =
            (dipole_medium){ .sigma_a_per_mm = 0.0021, .sigma_s_prime_per_mm = 2.25 + c, .eta = 1.5 };
    io_material_set_media(&material, media);
    char *text;
    size_t size;
    assert_true(io_material_write("m.json", &material, NULL, NULL));
    assert_true(io_file_read("m.json", 10000, &text, &size, NULL));
    assert_string_equal(
        text,
        "{\n  \"name\": \"Marble\",\n  \"eta\": 1.5,\n  \"model\": \"dipole\",\n  \"fdr\": \"exact\",\n"
        "  \"sigma_a_per_mm\": [0.0021, 0.0021, 0.0021],\n"
        "  \"sigma_s_prime_per_mm\": [2.25, 3.25, 4.25]\n}\n");
    free(text);
    for (int c = 0; c < 3; c++)
        material.layers[c][0].thickness_mm = 3;
    material.model = DIPOLE_MODEL_BEAM;
    assert_true(io_material_write("m.json", &material, NULL, NULL));
    assert_true(io_file_read("m.json", 10000, &text, &size, NULL));
    assert_string_equal(
        text, "{\n  \"name\": \"Marble\",\n  \"eta\": 1.5,\n  \"model\": \"beam\",\n  \"fdr\": \"exact\",\n"
              "  \"layers\": [\n    {\n      \"thickness_mm\": 3,\n"
              "      \"sigma_a_per_mm\": [0.0021, 0.0021, 0.0021],\n"
              "      \"sigma_s_prime_per_mm\": [2.25, 3.25, 4.25]\n    }\n  ]\n}\n");
    free(text);
}

/* Oracle: a failure never leaves a file. */
static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    struct io_material material = { .name = "a" };
    dipole_status status;
    const dipole_medium bad = { .sigma_s_prime_per_mm = NAN, .eta = 1.5 };
    io_material_set_media(&material, (const dipole_medium[]){ bad, bad, bad });
    assert_false(io_material_write("none.json", &material, NULL, &status));
    assert_string_equal(status.message,
                        "cannot be written: the material's texts must be UTF-8, its numbers finite");
    assert_false(io_material_write("none/m.json", &(struct io_material){ .name = "a" }, NULL, &status));
    assert_string_equal(status.message, "cannot be written: No such file or directory");
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    FILE *file = fopen("none.json", "r");
    assert_null(file);
}

static void damage(const char *path)
{
    char *text;
    size_t size;
    struct rng rng = { .seed = 11 };
    assert_true(io_file_read(path, 10000, &text, &size, NULL));
    char *copy = malloc(size);
    for (int i = 0; i < 5000; i++) {
        memcpy(copy, text, size);
        const size_t used = i % 2 ? size : random_bits(&rng) % (size + 1);
        for (uint64_t n = random_bits(&rng) % 4; n > 0; n--)
            copy[random_bits(&rng) % size] = (char)random_bits(&rng);
        struct io_json_document *document;
        struct io_material material;
        dipole_status status = { 0 };
        bool done = io_json_parse(copy, used, "m.json", &document, &status);
        if (done) {
            const struct io_json root = io_json_root(document);
            done = io_material_parse(&root, &material, &status);
        }
        if (!done)
            assert_true(status.message[0] && status.line >= 1 && status.column >= 1);
        io_json_destroy(document);
    }
    free(copy);
    free(text);
}

/* Oracle: damage ends in a material or a message with a place, never in a crash (sanitizers). */
static void damaged_files_end_in_a_message(void **state)
{
    (void)state;
    static const char *const paths[] = { SOURCE_FOLDER "/materials/marble.json",
                                         SOURCE_FOLDER "/materials/layered/skin.json" };
    for (size_t i = 0; i < 2; i++)
        damage(paths[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_bundled_material_is_read),
        cmocka_unit_test(jensen_materials_have_the_measured_reflectance),
        cmocka_unit_test(materials_are_the_published_ones),
        cmocka_unit_test(scattering_with_g_is_reduced),
        cmocka_unit_test(failures_name_key_value_and_range),
        cmocka_unit_test(failures_in_layers_name_the_layer),
        cmocka_unit_test(layers_are_read_from_the_top),
        cmocka_unit_test(every_model_is_read),
        cmocka_unit_test(reflectance_and_length_give_the_coefficients),
        cmocka_unit_test(a_material_inside_a_scene_is_named_by_its_path),
        cmocka_unit_test(a_unit_slip_is_warned_of),
        cmocka_unit_test(what_is_written_is_read_back),
        cmocka_unit_test(the_written_file_is_for_people),
        cmocka_unit_test(what_cannot_be_written_is_named),
        cmocka_unit_test(damaged_files_end_in_a_message),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
