#include "io/file.h"
#include "io/material_file.h"
#include "tests/reference_file.h"
#include "tests/run_tool.h"

#include <jansson.h>

#define MATERIALS SOURCE_FOLDER "/materials/"
#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct tool_run run;

static json_t *parse_out(void)
{
    json_error_t error;
    json_t *const result = json_loads(run.out, JSON_REJECT_DUPLICATES, &error);
    if (!result)
        fail_msg("%s:\n%s", error.text, run.out);
    return result;
}

static double number_of(const json_t *object, const char *key)
{
    const json_t *const value = json_object_get(object, key);
    if (!json_is_number(value))
        fail_msg("%s is not a number", key);
    return json_number_value(value);
}

static void check_channel(const json_t *json, const dipole_medium *medium, double epsilon, const char *name)
{
    dipole_coefficients c;
    assert_true(dipole_coefficients_init(medium, &c, NULL));
    const struct {
        const char *key;
        double value;
    } expected[] = {
        { "sigma_a_per_mm", c.sigma_a_per_mm },
        { "sigma_s_prime_per_mm", c.sigma_s_prime_per_mm },
        { "alpha_prime", c.alpha_prime },
        { "mean_free_path_mm", c.mean_free_path_mm },
        { "sigma_tr_per_mm", c.sigma_tr_per_mm },
        { "fdr", c.fdr },
        { "z_r_mm", c.z_r_mm },
        { "z_v_mm", c.z_v_mm },
        { "diffuse_reflectance", dipole_diffuse_reflectance(&c) },
        { "diffuse_transmittance", 0 },
        { "unscattered_transmittance", 0 },
        { "unscattered_reflectance", 0 },
        { "r_max_mm", dipole_r_max_mm(&c, epsilon) },
        { "splat_spacing_mm", dipole_splat_spacing_mm(&c, epsilon) },
    };
    assert_string_equal(json_string_value(json_object_get(json, "channel")), name);
    for (size_t i = 0; i < COUNT(expected); i++)
        if (number_of(json, expected[i].key) != expected[i].value)
            fail_msg("%s is %.17g, expected %.17g", expected[i].key, number_of(json, expected[i].key),
                     expected[i].value);
    /* channel, diffuse_mean_free_path_mm and profile beside them, nothing else */
    assert_int_equal(json_object_size(json), COUNT(expected) + 3);
    const json_t *const diffuse = json_object_get(json, "diffuse_mean_free_path_mm");
    if (c.sigma_tr_per_mm > 0)
        assert_true(json_number_value(diffuse) == 1 / c.sigma_tr_per_mm);
    else
        assert_true(json_is_null(diffuse));
    const json_t *const profile = json_object_get(json, "profile");
    assert_true(json_array_size(profile) > 5);
    for (size_t i = 0; i < json_array_size(profile); i++) {
        const json_t *const point = json_array_get(profile, i);
        assert_int_equal(json_object_size(point), 2);
        assert_true(number_of(point, "rd_per_mm2") == dipole_rd_per_mm2(&c, number_of(point, "r_mm")));
    }
}

/* Oracle: the library called here; 17 digits give back every bit. */
static void json_holds_what_the_library_says(void **state)
{
    (void)state;
    static const char *const names[] = {
        "apple",      "chicken1",  "chicken2",           "cream", "ketchup",
        "marble",     "potato",    "skimmilk",           "skin1", "skin2",
        "spectralon", "wholemilk", "narasimhan2006/coke"
    };
    for (size_t i = 0; i < COUNT(names); i++) {
        char path[4096];
        struct io_material material;
        snprintf(path, sizeof path, MATERIALS "%s.json", names[i]);
        assert_true(io_material_read(path, &material, NULL));
        const bool is_default = i % 2 == 0;
        run_tool(&run, "dipole", path, "--json", "--epsilon", is_default ? "0.01" : "0.003");
        assert_done(&run);
        json_t *const result = parse_out();
        assert_int_equal(json_object_size(result), 6);
        assert_string_equal(json_string_value(json_object_get(result, "model")), "dipole");
        assert_string_equal(json_string_value(json_object_get(result, "lit_from")), "above");
        assert_string_equal(json_string_value(json_object_get(result, "material")), material.name);
        assert_true(number_of(result, "epsilon") == (is_default ? 0.01 : 0.003));
        assert_true(number_of(result, "eta") == material.layers[0][0].medium.eta);
        const json_t *const channels = json_object_get(result, "channels");
        assert_int_equal(json_array_size(channels), 3);
        for (size_t c = 0; c < 3; c++)
            check_channel(json_array_get(channels, c), &material.layers[c][0].medium,
                          is_default ? 0.01 : 0.003, io_channel_names[c]);
        json_decref(result);
    }
}

/* Oracle: mpmath with up to 700 digits, tests/reference/dipole_exact.csv, with the Fdr each row was made
 * with. Below 1e-300 doubles begin to lose digits. */
static void json_agrees_with_the_exact_rows(void **state)
{
    (void)state;
    struct reference_file file;
    int count = 0;
    reference_open(&file, "dipole_exact.csv");
    while (reference_next(&file)) {
        const char *const branch = reference_text(&file, "fdr_branch"),
                          *const id = reference_text(&file, "id"),
                          *const eta = reference_text(&file, "eta_rel");
        const char *const sigma_a = reference_text(&file, "sigma_a_per_mm"), *const sigma_s_prime =
                                                                                 reference_text(
                                                                                     &file,
                                                                                     "sigma_sp_per_mm");
        if (strcmp(branch, "lt") == 0 && strtod(eta, NULL) == 1.0)
            continue; /* the branch for eta < 1 at 1, where it is not defined */
        char text[1024];
        snprintf(text, sizeof text,
                 "{ \"name\": \"m\", \"eta\": %s, \"fdr\": \"%s\", \"sigma_a_per_mm\": [%s, %s, %s], "
                 "\"sigma_s_prime_per_mm\": [%s, %s, %s] }",
                 eta, strcmp(branch, "exact0") == 0 ? "exact" : "polynomial", sigma_a, sigma_a, sigma_a,
                 sigma_s_prime, sigma_s_prime, sigma_s_prime);
        write_text("m.json", text);
        run_tool(&run, "dipole", "m.json", "--json", "-q", "--at", reference_text(&file, "r_mm"));
        assert_done(&run);
        json_t *const result = parse_out();
        for (size_t c = 0; c < 3; c++) {
            const json_t *const channel = json_array_get(json_object_get(result, "channels"), c);
            const double expected = reference_number(&file, "Rd_per_mm2"),
                         rd = number_of(json_array_get(json_object_get(channel, "profile"), 0),
                                        "rd_per_mm2");
            if (expected < 1e-300)
                assert_true(fabs(rd - expected) <= 1e-300);
            else
                assert_close(rd, expected, 1e-13, "Rd, row %s", id);
            assert_close(number_of(channel, "diffuse_reflectance"), reference_number(&file, "Rd_total"),
                         1e-13, "total, row %s", id);
            assert_close(number_of(channel, "z_v_mm"), reference_number(&file, "z_v_mm"), 1e-13,
                         "z_v, row %s", id);
            assert_close(number_of(channel, "sigma_tr_per_mm"), reference_number(&file, "sigma_tr_per_mm"),
                         1e-13, "sigma_tr, row %s", id);
        }
        json_decref(result);
        count++;
    }
    assert_int_equal(count, 86);
}

/* A channel of a stack, compared with the library called here. */
static void check_stack(const json_t *json, const struct io_material *material, size_t c, dipole_side side)
{
    dipole_stack *stack;
    assert_true(dipole_stack_create(material->layers[c], material->layer_count, material->model, side,
                                    &stack, NULL));
    const dipole_coefficients *const k = dipole_stack_coefficients(stack, 0);
    const struct {
        const char *key;
        double value;
    } expected[] = {
        { "sigma_a_per_mm", k->sigma_a_per_mm },
        { "mean_free_path_mm", k->mean_free_path_mm },
        { "z_v_mm", k->z_v_mm },
        { "diffuse_reflectance", dipole_stack_total(stack, DIPOLE_FACE_LIT) },
        { "diffuse_transmittance", dipole_stack_total(stack, DIPOLE_FACE_FAR) },
        { "unscattered_transmittance", dipole_stack_unscattered(stack, DIPOLE_FACE_FAR) },
        { "unscattered_reflectance", dipole_stack_unscattered(stack, DIPOLE_FACE_LIT) },
        { "r_max_mm", dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 0.01) },
        { "splat_spacing_mm", dipole_stack_splat_spacing_mm(stack, DIPOLE_FACE_LIT, 0.01) },
    };
    for (size_t i = 0; i < COUNT(expected); i++)
        if (number_of(json, expected[i].key) != expected[i].value)
            fail_msg("%s is %.17g, expected %.17g", expected[i].key, number_of(json, expected[i].key),
                     expected[i].value);
    const json_t *const layers = json_object_get(json, "layers");
    assert_int_equal(json_array_size(layers), io_material_has_layers(material) ? material->layer_count : 0);
    for (size_t i = 0; i < json_array_size(layers); i++) {
        const json_t *const layer = json_array_get(layers, i);
        const dipole_layer *const of = &material->layers[c][i];
        const char *const name = json_string_value(json_object_get(layer, "name"));
        assert_string_equal(name ? name : "", material->layer_names[i]);
        assert_true(number_of(layer, "sigma_a_per_mm") == of->medium.sigma_a_per_mm);
        assert_true(number_of(layer, "sigma_s_prime_per_mm") == of->medium.sigma_s_prime_per_mm);
        assert_true(number_of(layer, "eta") == of->medium.eta);
        assert_true(number_of(layer, "fdr") == dipole_stack_coefficients(stack, i)->fdr);
        if (isinf(of->thickness_mm))
            assert_true(json_is_null(json_object_get(layer, "thickness_mm")));
        else
            assert_true(number_of(layer, "thickness_mm") == of->thickness_mm);
    }
    const bool has_far_face = isfinite(material->layers[c][material->layer_count - 1].thickness_mm);
    const json_t *const profile = json_object_get(json, "profile");
    assert_true(json_array_size(profile) > 5);
    for (size_t i = 0; i < json_array_size(profile); i++) {
        const json_t *const point = json_array_get(profile, i);
        const double r_mm = number_of(point, "r_mm");
        double values[2];
        for (int face = 0; face < 2; face++)
            dipole_stack_profile_per_mm2(stack, (dipole_face)face, &r_mm, 1, &values[face]);
        assert_int_equal(json_object_size(point), has_far_face ? 3 : 2);
        assert_true(number_of(point, "rd_per_mm2") == values[DIPOLE_FACE_LIT]);
        assert_true(!has_far_face || number_of(point, "td_per_mm2") == values[DIPOLE_FACE_FAR]);
    }
    dipole_stack_destroy(stack);
}

/* Oracle: the library called here, for every model, layers, and both sides. */
static void json_of_stacks_holds_what_the_library_says(void **state)
{
    (void)state;
    static const struct {
        const char *name, *model, *side;
    } cases[] = {
        { "skin1", "beam", "above" },
        { "skin1", "better_dipole", "above" },
        { "marble", "multipole", "above" },
        { "skin1", "modes", "above" },
        { "layered/skin", "beam", "above" },
        { "layered/skin", "modes", "above" },
        { "layered/marble_slab", "modes", "below" },
        { "layered/marble_slab", "beam", "above" },
        { "layered/marble_slab", "beam", "below" },
        { "layered/marble_slab", "multipole", "above" },
        { "skin1", "modes", "above" },
        { "layered/marble_slab", "modes", "below" },
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char path[4096];
        struct io_material material;
        snprintf(path, sizeof path, MATERIALS "%s.json", cases[i].name);
        assert_true(io_material_read(path, &material, NULL));
        while (strcmp(io_model_names[material.model], cases[i].model) != 0)
            material.model = (dipole_model)((material.model + 1) % 5);
        const bool is_above = strcmp(cases[i].side, "above") == 0;
        run_tool(&run, "dipole", path, "--json", "--model", cases[i].model, "--lit-from", cases[i].side);
        assert_done(&run);
        json_t *const result = parse_out();
        assert_string_equal(json_string_value(json_object_get(result, "model")), cases[i].model);
        assert_string_equal(json_string_value(json_object_get(result, "lit_from")), cases[i].side);
        assert_true(number_of(result, "eta") == material.layers[0][0].medium.eta);
        for (size_t c = 0; c < 3; c++)
            check_stack(json_array_get(json_object_get(result, "channels"), c), &material, c,
                        is_above ? DIPOLE_FROM_ABOVE : DIPOLE_FROM_BELOW);
        json_decref(result);
    }
}

/* A material file from the layers as a table of Monte Carlo runs gives them. */
static void write_layers_of(const char *path, const char *layers)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "{ \"name\": \"m\", \"model\": \"beam\", \"layers\": [");
    for (const char *p = layers; p; p = strchr(p, ';')) {
        double n, sigma_a, sigma_s, g;
        char d_mm[32];
        p += strspn(p, "; \"");
        assert_int_equal(sscanf(p, "n=%lf sigma_a=%lf sigma_s=%lf g=%lf d_mm=%31[0-9.inf]", &n, &sigma_a,
                                &sigma_s, &g, d_mm),
                         5);
        fprintf(
            file,
            "%s{ \"eta\": %.17g, \"sigma_a_per_mm\": [%.17g, %.17g, %.17g], \"sigma_s_per_mm\": [%.17g, "
            "%.17g, %.17g], \"g\": %.17g, \"thickness_mm\": %s }",
            p == layers + 1 ? "" : ", ", n, sigma_a, sigma_a, sigma_a, sigma_s, sigma_s, sigma_s, g,
            strcmp(d_mm, "inf") == 0 ? "\"infinite\"" : d_mm);
    }
    fprintf(file, "] }\n");
    assert_int_equal(fclose(file), 0);
}

/* Oracle: Monte Carlo, per incident photon. The tolerances are how far the model is from the truth where it
 * is stated to be near; unscattered light is exact but for the noise of the runs. */
static void layers_agree_with_monte_carlo(void **state)
{
    (void)state;
    struct reference_file file;
    int count = 0;
    reference_open(&file, "mcml_totals.csv");
    while (reference_next(&file)) {
        const char *const name = reference_text(&file, "case");
        if (strncmp(name, "slab", 4) != 0 && strncmp(name, "layer", 5) != 0 &&
            strncmp(name, "semi_hialb", 10) != 0)
            continue;
        write_layers_of("m.json", reference_text(&file, "layers"));
        run_tool(&run, "dipole", "m.json", "--json", "--at", "0");
        assert_done(&run);
        json_t *const result = parse_out();
        const json_t *const channel = json_array_get(json_object_get(result, "channels"), 0);
        const double entered = 1 - reference_number(&file, "Rsp");
        assert_close(entered * number_of(channel, "diffuse_reflectance"), reference_number(&file, "R"),
                     0.025, "R of %s", name);
        assert_close(entered * number_of(channel, "diffuse_transmittance"), reference_number(&file, "T"),
                     0.03, "T of %s", name);
        const struct {
            const char *key, *column;
        } rows[] = { { "unscattered_reflectance", "R0" }, { "unscattered_transmittance", "T0" } };
        for (size_t i = 0; i < 2; i++)
            if (fabs(entered * number_of(channel, rows[i].key) - reference_number(&file, rows[i].column)) >
                5e-4)
                fail_msg("%s of %s", rows[i].key, name);
        json_decref(result);
        count++;
    }
    assert_int_equal(count, 9);
}

/* Oracle: what each says alone; one after the other, and as one array. */
static void several_are_shown_one_after_the_other(void **state)
{
    (void)state;
    static const char *const alone[3][5] = { { "marble", "--model", "beam", "--json" },
                                             { "skin1", "--model", "beam", "--json" },
                                             { "skin1", "--json" } };
    json_t *results[3];
    char *tables[3];
    for (int i = 0; i < 3; i++) {
        run_tool_limited(&run, 0, "dipole", alone[i]);
        assert_done(&run);
        results[i] = parse_out();
        run_tool_limited(&run, 0, "dipole",
                         i < 2 ? (const char *const[]){ alone[i][0], "--model", "beam", NULL }
                               : (const char *const[]){ alone[i][0], NULL });
        assert_done(&run);
        tables[i] = strdup(run.out);
    }
    char expected[16384];
    run_tool(&run, "dipole", "marble", "skin1", "--model", "beam");
    assert_done(&run);
    snprintf(expected, sizeof expected, "%s\n%s", tables[0], tables[1]);
    assert_string_equal(run.out, expected);
    run_tool(&run, "dipole", "skin1", "--model", "beam", "--model", "dipole");
    assert_done(&run);
    snprintf(expected, sizeof expected, "%s\n%s", tables[1], tables[2]);
    assert_string_equal(run.out, expected);

    run_tool(&run, "dipole", "marble", "skin1", "--model", "beam", "--json");
    assert_done(&run);
    json_t *const both = parse_out();
    assert_int_equal(json_object_size(both), 1);
    const json_t *const array = json_object_get(both, "materials");
    assert_int_equal(json_array_size(array), 2);
    for (size_t i = 0; i < 2; i++)
        assert_true(json_equal(json_array_get(array, i), results[i]));
    json_decref(both);
    for (int i = 0; i < 3; i++) {
        json_decref(results[i]);
        free(tables[i]);
    }
}

/* Oracle: the definition; light that nothing scatters has no profile, and JSON no infinity. */
static void what_has_no_end_is_null(void **state)
{
    (void)state;
    write_text("clear.json", "{ \"name\": \"c\", \"eta\": 1.5, \"layers\": [{ \"thickness_mm\": 2,\n"
                             "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [0, 0, 0] }] }\n");
    run_tool(&run, "dipole", "clear.json", "--json");
    assert_done(&run);
    json_t *const result = parse_out();
    const json_t *const channel = json_array_get(json_object_get(result, "channels"), 2);
    assert_true(json_is_null(json_object_get(channel, "splat_spacing_mm")));
    assert_true(number_of(channel, "r_max_mm") == 0);
    assert_true(number_of(channel, "diffuse_reflectance") == 0);
    /* two surfaces of reflectance 0.04, of which the second counts within */
    const double e2 = exp(-4), through = exp(-2) * 0.96 / (1 - 0.0016 * e2);
    assert_close(number_of(channel, "unscattered_transmittance"), through, 1e-13, "through");
    assert_close(number_of(channel, "unscattered_reflectance"), through * exp(-2) * 0.04, 1e-13, "back");
    assert_true(json_array_size(json_object_get(channel, "profile")) >= 4);
    json_decref(result);
    run_tool(&run, "dipole", "clear.json", "--plot", "clear.svg");
    assert_done(&run);
}

/* Oracle: the rule; 0, then 1, 2, 5 per decade around a tenth of the least mean free path to r_max. */
static void default_radii_cover_the_profile(void **state)
{
    (void)state;
    run_tool(&run, "dipole", MATERIALS "marble.json", "--json");
    assert_done(&run);
    json_t *const result = parse_out();
    const json_t *const profile =
        json_object_get(json_array_get(json_object_get(result, "channels"), 0), "profile");
    static const double radii_mm[] = { 0, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20 };
    assert_int_equal(json_array_size(profile), COUNT(radii_mm));
    for (size_t i = 0; i < COUNT(radii_mm); i++)
        assert_true(number_of(json_array_get(profile, i), "r_mm") == radii_mm[i]);
    json_decref(result);
}

/* Oracle: the option itself; the radii in the order given. */
static void asked_radii_are_kept_in_order(void **state)
{
    (void)state;
    run_tool(&run, "dipole", MATERIALS "marble.json", "--json", "--at", "5,0,0.25,5,1e6");
    assert_done(&run);
    json_t *const result = parse_out();
    static const double radii_mm[] = { 5, 0, 0.25, 5, 1e6 };
    for (size_t c = 0; c < 3; c++) {
        const json_t *const profile =
            json_object_get(json_array_get(json_object_get(result, "channels"), c), "profile");
        assert_int_equal(json_array_size(profile), COUNT(radii_mm));
        for (size_t i = 0; i < COUNT(radii_mm); i++)
            assert_true(number_of(json_array_get(profile, i), "r_mm") == radii_mm[i]);
        assert_true(number_of(json_array_get(profile, 4), "rd_per_mm2") == 0);
    }
    json_decref(result);
}

/* Oracle: the same numbers, rounded, as the JSON of the same material; the layout by eye, once. */
static void people_get_tables_with_units(void **state)
{
    (void)state;
    write_text("m.json", "{ \"name\": \"Two by four\", \"eta\": 1, \"sigma_a_per_mm\": [0, 1, 3],\n"
                         "  \"sigma_s_prime_per_mm\": [0.5, 2, 0], \"source\": \"made up\" }\n");
    run_tool(&run, "dipole", "m.json", "--at", "0,2", "--epsilon", "0.1");
    assert_done(&run);
    assert_string_equal(run.out,
                        "Two by four\n"
                        "made up\n"
                        "dipole model, eta 1, fdr exact, epsilon 0.1\n"
                        "\n"
                        "channel       sigma_a  sigma_s_prime   alpha_prime      sigma_tr           fdr\n"
                        "                 1/mm           1/mm             1          1/mm             1\n"
                        "R                   0            0.5             1             0             0\n"
                        "G                   1              2      0.666667             3             0\n"
                        "B                   3              0             0       5.19615             0\n"
                        "\n"
                        "channel  mean_free_path  diffuse_mean_free_path           z_r           z_v\n"
                        "                     mm                      mm            mm            mm\n"
                        "R                     2                     inf             2       4.66667\n"
                        "G              0.333333                0.333333      0.333333      0.777778\n"
                        "B              0.333333                 0.19245      0.333333      0.777778\n"
                        "\n"
                        "channel  diffuse_reflectance         r_max  splat_spacing\n"
                        "                           1            mm             mm\n"
                        "R                          1       33.0864        4.16994\n"
                        "G                    0.15495      0.839592       0.482144\n"
                        "B                          0      0.590827       0.415751\n"
                        "\n"
                        "           r          rd R          rd G          rd B\n"
                        "          mm        1/mm^2        1/mm^2        1/mm^2\n"
                        "           0     0.0235484      0.379646             0\n"
                        "           2    0.00987117   8.39791e-05             0\n");
}

/* Oracle: the same numbers, rounded, as the JSON of the same material; the layout by eye, once. */
static void people_get_layers_as_rows(void **state)
{
    (void)state;
    write_text("m.json", "{ \"name\": \"Glazed\", \"eta\": 1.5, \"layers\": [\n"
                         "  { \"name\": \"glaze\", \"thickness_mm\": 0.5, \"eta\": 1.4,\n"
                         "    \"sigma_a_per_mm\": [0, 1, 2], \"sigma_s_prime_per_mm\": [0.5, 2, 0] },\n"
                         "  { \"thickness_mm\": 0.25, \"sigma_a_per_mm\": [1, 1, 1],\n"
                         "    \"sigma_s_prime_per_mm\": [8, 8, 8] }] }\n");
    run_tool(&run, "dipole", "m.json", "--at", "0.5", "--lit-from", "below");
    assert_done(&run);
    assert_string_equal(
        run.out,
        "Glazed\n"
        "beam model, fdr exact, lit from below, epsilon 0.01\n"
        "\n"
        "layer     thickness       eta  channel       sigma_a  sigma_s_prime   alpha_prime      sigma_tr  "
        "mean_free_path  name\n"
        "                 mm         1                   1/mm           1/mm             1          1/mm   "
        "           mm\n"
        "1               0.5       1.4  R                   0            0.5             1             0   "
        "            2  glaze\n"
        "1               0.5       1.4  G                   1              2      0.666667             3   "
        "     0.333333  glaze\n"
        "1               0.5       1.4  B                   2              0             0        3.4641   "
        "          0.5  glaze\n"
        "2              0.25       1.5  R                   1              8      0.888889       5.19615   "
        "     0.111111\n"
        "2              0.25       1.5  G                   1              8      0.888889       5.19615   "
        "     0.111111\n"
        "2              0.25       1.5  B                   1              8      0.888889       5.19615   "
        "     0.111111\n"
        "\n"
        "channel  diffuse_reflectance         r_max  splat_spacing\n"
        "                           1            mm             mm\n"
        "R                   0.229914        3.9829      0.0296735\n"
        "G                   0.212451      0.995441      0.0284944\n"
        "B                   0.199296      0.864549      0.0275729\n"
        "\n"
        "channel  diffuse_transmittance  unscattered_transmittance  unscattered_reflectance\n"
        "                             1                          1                        1\n"
        "R                      0.15828                  0.0797122              0.000191938\n"
        "G                      0.04056                  0.0228374              2.73948e-05\n"
        "B                     0.020687                  0.0376526              5.26776e-05\n"
        "\n"
        "           r          rd R          rd G          rd B          td R          td G          td B\n"
        "          mm        1/mm^2        1/mm^2        1/mm^2        1/mm^2        1/mm^2        1/mm^2\n"
        "         0.5     0.0203434     0.0242689     0.0195928     0.0232474     0.0151398    "
        "0.00812695\n");
}

/* Oracle: a bundled material by name is the file by path; a file of that name comes first. */
static void bundled_materials_have_names(void **state)
{
    (void)state;
    run_tool(&run, "dipole", MATERIALS "skin1.json");
    assert_done(&run);
    char *const by_path = strdup(run.out);
    run_tool(&run, "dipole", "skin1");
    assert_done(&run);
    assert_string_equal(run.out, by_path);
    free(by_path);
    write_text("skin1", "{");
    run_tool(&run, "dipole", "skin1");
    assert_failed(&run, 1, "dipole: skin1:1:1: JSON syntax: string or '}' expected near end of file\n");
    run_tool(&run, "dipole", "skin9");
    assert_failed(&run, 1, "dipole: skin9: cannot be read: No such file or directory\n");
    run_tool(&run, "dipole", "../materials/skin1");
    assert_failed(&run, 1, "dipole: ../materials/skin1: cannot be read: No such file or directory\n");
}

static size_t count_of(const char *text, const char *part)
{
    size_t count = 0;
    for (const char *p = strstr(text, part); p; p = strstr(p + 1, part))
        count++;
    return count;
}

/* Oracle: what the picture must name, and that two runs draw the same. */
static void plot_shows_what_matters(void **state)
{
    (void)state;
    char *svg = NULL, *again = NULL;
    size_t size = 0;
    for (int i = 0; i < 2; i++) {
        run_tool(&run, "dipole", MATERIALS "marble.json", "--plot", i ? "again.svg" : "marble.svg");
        assert_done(&run);
    }
    assert_true(io_file_read("marble.svg", 1 << 20, &svg, &size, NULL));
    assert_true(io_file_read("again.svg", 1 << 20, &again, &size, NULL));
    assert_string_equal(svg, again);
    static const char *const parts[] = { ">Marble: ",
                                         "SIGGRAPH 2001",
                                         "distance r from where the light entered, mm",
                                         "1/mm²",
                                         ">R ℓ 0.456 mm<",
                                         ">G ℓ 0.381 mm<",
                                         ">B ℓ 0.333 mm<",
                                         ">R r_max 19.5 mm<",
                                         ">G r_max 13.9 mm<",
                                         ">B r_max 10.5 mm<",
                                         ">R, total 83 %<",
                                         ">G, total 79.1 %<",
                                         ">B, total 75.3 %<",
                                         "σa 0.0021 /mm" };
    for (size_t i = 0; i < COUNT(parts); i++)
        if (!strstr(svg, parts[i]))
            fail_msg("no \"%s\" in the plot", parts[i]);
    assert_int_equal(count_of(svg, "stroke-width=\"2.4\" stroke-linejoin"), 3);
    assert_int_equal(count_of(svg, "<circle"), 6);
    free(svg);
    free(again);

    /* A channel that does not scatter has no curve, no end and no dots, but a label. */
    run_tool(&run, "dipole", MATERIALS "narasimhan2006/coke.json", "--plot", "coke.svg");
    assert_done(&run);
    assert_true(io_file_read("coke.svg", 1 << 20, &svg, &size, NULL));
    assert_non_null(strstr(svg, ">B, Rd = 0<"));
    assert_null(strstr(svg, ">B r_max"));
    assert_int_equal(count_of(svg, "<circle"), 4);
    free(svg);

    run_tool(&run, "dipole", MATERIALS "spectralon.json", "--plot", "spectralon.png");
    assert_done(&run);
    assert_true(io_file_read("spectralon.png", 1 << 24, &svg, &size, NULL));
    assert_memory_equal(svg, "\x89PNG\r\n\x1a\n", 8);
    assert_memory_equal(svg + 16, "\0\0\x07\x80\0\0\x05\0", 8); /* 1920 x 1280 */
    free(svg);
}

/* Height of a disc in a plot, from the top. */
static double circle_y_px(const char *svg, int index)
{
    for (int i = 0; i <= index; i++) {
        svg = strstr(svg, "<circle");
        assert_non_null(svg);
        svg = strstr(svg, "cy=\"") + 4;
    }
    return strtod(svg, NULL);
}

/* Oracle: what the picture must name: every curve with its model, face and total, and that points stand
 * where the table says. */
static void plots_overlay_models_and_data(void **state)
{
    (void)state;
    char *svg = NULL;
    size_t size = 0;
    write_text("a.csv", "r_mm,rd_per_mm2,sem\n1,0.03,0.02\n2,0.01,1e-9\n4,-1,1\n0,1,1\n");
    write_text("b.csv", "r_lo_mm,r_hi_mm,R_per_mm2,R_sem_per_mm2\n0,1,0.2,0.001\n");
    run_tool(&run, "dipole", "layered/marble_slab", "--model", "multipole,beam", "--plot", "p.svg",
             "--data", "a.csv", "--data", "./b.csv", "--per-incident");
    assert_done(&run);
    assert_true(io_file_read("p.svg", 1 << 20, &svg, &size, NULL));
    static const char *const parts[] = { ">Marble, 3 mm thick: ",
                                         ">R, multipole, reflected 67.6 %<",
                                         ">B, beam, transmitted 21.1 %<",
                                         ">a.csv, 2 of 4<",
                                         ">b.csv<",
                                         "solid multipole model",
                                         "dashed beam model",
                                         "1 − Rsp = 0.96",
                                         "bars, where they are longer" };
    for (size_t i = 0; i < COUNT(parts); i++)
        if (!strstr(svg, parts[i]))
            fail_msg("no \"%s\" in the plot", parts[i]);
    assert_int_equal(count_of(svg, "stroke-width=\"2.4\" stroke-linejoin"), 6);
    assert_int_equal(count_of(svg, "stroke-width=\"1.2\" stroke-linejoin"), 6);
    assert_int_equal(count_of(svg, "<circle"), 3);  /* two points and the legend's */
    assert_int_equal(count_of(svg, "h7.2v7.2"), 2); /* one square and the legend's */
    assert_int_equal(count_of(svg, "h8M"), 1);      /* the one bar that is long enough */
    const double first_px = circle_y_px(svg, 0), second_px = circle_y_px(svg, 1);
    free(svg);

    /* 0.03 and 0.01 stand log(3) apart, and dividing by 0.96 lifts both */
    run_tool(&run, "dipole", "layered/marble_slab", "--model", "multipole,beam", "--plot", "p.svg",
             "--data", "a.csv", "--data", "./b.csv");
    assert_done(&run);
    assert_true(io_file_read("p.svg", 1 << 20, &svg, &size, NULL));
    assert_null(strstr(svg, "Rsp"));
    const double unit_px = (second_px - first_px) / log(3);
    assert_true(fabs(circle_y_px(svg, 0) - first_px - unit_px * log(1 / 0.96)) < 0.1);
    free(svg);

    run_tool(&run, "dipole", "marble", "skin1", "layered/skin", "layered/marble_slab", "--plot", "p.svg");
    assert_done(&run);
    assert_true(io_file_read("p.svg", 1 << 20, &svg, &size, NULL));
    static const char *const names[] = { ">How far light ", ">R, Marble, dipole, reflected 83 %<",
                                         ">B, Skin 1, dipole, reflected 13.1 %<",
                                         ">G, Skin in three layers, beam, reflected 43.2 %<",
                                         ">G, Marble, 3 mm thick, beam, transmitted 25 %<" };
    for (size_t i = 0; i < COUNT(names); i++)
        if (!strstr(svg, names[i]))
            fail_msg("no \"%s\" in the plot", names[i]);
    free(svg);
}

/* Oracle: exact messages; nothing is written. */
static void what_models_and_data_cannot_do_is_named(void **state)
{
    (void)state;
    write_text("p.csv", "r_mm,rd_per_mm2\n1,2\n3,x\n");
    run_tool(&run, "dipole", MATERIALS "marble.json", "--lit-from", "below");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err, ": cannot be lit from below, expected layers of which the last has a "
                                    "thickness\n"));
    run_tool(&run, "dipole", "layered/skin", "--model", "beam,dipole", "--plot", "p.svg");
    assert_failed(
        &run, 1,
        "dipole: layered/skin: --model dipole: this model knows only a half-space, expected \"beam\", "
        "\"modes\" or \"multipole\" for layers\n");
    run_tool(&run, "dipole", "layered/skin", "--model", "multipole");
    assert_failed(
        &run, 1,
        "dipole: layered/skin: --model multipole: layers[0] is 0.1 mm thick, and the source of the "
        "multipole lies 0.199601 mm deep, below it; expected a thicker layer, or the model \"beam\" or "
        "\"modes\", which have no limit\n");
    run_tool(&run, "dipole", "marble", "--plot", "p.svg", "--data", "p.csv");
    assert_failed(&run, 1, "dipole: p.csv:3:3: rd_per_mm2 is \"x\", expected a number\n");
    run_tool(&run, "dipole", "marble", "--plot", "p.svg", "--data", "q.csv");
    assert_failed(&run, 1, "dipole: q.csv: cannot be read: No such file or directory\n");
    assert_int_equal(count_entries("."), 1);
}

/* Oracle: exact messages. */
static void bad_input_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {
        { "{ \"name\": \"n\",\n", "2:1: JSON syntax: string or '}' expected near end of file" },
        { "{ \"name\": \"n\", \"eta\": 1.3,\n \"sigma_a_per_mm\": [0.1, -2, 0], \"sigma_s_prime_per_mm\": "
          "[1, 1, "
          "1] }",
          "2:26: sigma_a_per_mm[1] is -2, expected >= 0 (0, or 1e-50 to 1e+50)" },
        { "{ \"name\": \"n\", \"eta\": 1.3,\n \"sigma_a_per_mm\": [0.1, NaN, 0], \"sigma_s_prime_per_mm\": "
          "[1, 1, "
          "1] }",
          "2:28: JSON syntax: invalid token near 'NaN'" },
        { "{ \"name\": \"n\", \"eta\": 0,\n \"sigma_a_per_mm\": [0.1, 2, 0], \"sigma_s_prime_per_mm\": [1, "
          "1, 1] }",
          "1:23: eta is 0, expected > 0 (0.1 to 10)" },
        { "{ \"name\": \"n\", \"eta\": 1.3,\n \"sigmaa\": [0.1, 2, 0], \"sigma_s_prime_per_mm\": [1, 1, 1] "
          "}",
          "2:2: unknown key \"sigmaa\", expected name, eta, model, fdr, sigma_a_per_mm, "
          "sigma_s_prime_per_mm, "
          "sigma_s_per_mm, g, diffuse_reflectance, mean_free_path_mm, diffuse_mean_free_path_mm, layers, "
          "source, extras, fit" },
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char expected[1024];
        write_text("bad.json", cases[i].text);
        snprintf(expected, sizeof expected, "dipole: bad.json:%s\n", cases[i].message);
        run_tool(&run, "dipole", "bad.json", "--json", "--plot", "bad.svg");
        assert_failed(&run, 1, expected);
        assert_int_equal(count_entries("."), 1);
    }
}

/* Oracle: exact messages, exit code 2. */
static void wrong_usage_is_explained(void **state)
{
    (void)state;
    run_tool(&run, "dipole", "--json");
    assert_failed(
        &run, 2,
        "dipole: 0 operands, expected at least 1: dipole MATERIAL.json... [--model NAME,...] [--epsilon E] "
        "[--at R,R,...] [--plot FILE.svg|png] [--data FILE.csv]\n");
    run_tool(&run, "dipole", "marble", "--epsilon", "0");
    assert_failed(&run, 2, "dipole: --epsilon is \"0\", expected a number 1e-09 to 0.5\n");
    run_tool(&run, "dipole", "marble", "--at", "1,-1");
    assert_failed(&run, 2, "dipole: --at has \"-1\", expected numbers 0 to 1e+300 with commas between\n");
    run_tool(&run, "dipole", "marble", "--plot", "marble.pdf");
    assert_failed(&run, 2, "dipole: --plot is \"marble.pdf\", expected a name that ends in .svg or .png\n");
    run_tool(&run, "dipole", "marble", "--model", "beam,cone");
    assert_failed(
        &run, 2,
        "dipole: --model has \"cone\", expected dipole, better_dipole, multipole, beam or modes, with "
        "commas between\n");
    run_tool(&run, "dipole", "marble", "--model", "beam,");
    assert_failed(
        &run, 2,
        "dipole: --model has \"\", expected dipole, better_dipole, multipole, beam or modes, with commas "
        "between\n");
    run_tool(&run, "dipole", "marble", "--model", "beam", "--model", "dipole,beam");
    assert_failed(&run, 2, "dipole: --model has \"beam\" twice\n");
    run_tool(&run, "dipole", "marble", "--lit-from", "behind");
    assert_failed(&run, 2, "dipole: --lit-from is \"behind\", expected one of above, below\n");
    run_tool(&run, "dipole", "marble", "--data", "p.csv");
    assert_failed(&run, 2, "dipole: --data is given without --plot\n");
    run_tool(&run, "dipole", "marble", "--per-incident", "--plot", "p.svg");
    assert_failed(&run, 2, "dipole: --per-incident is given without --data\n");
    run_tool(&run, "dipole", "marble", "skin1", "skin2", "--model", "dipole,beam", "--plot", "p.svg");
    assert_failed(&run, 2, "dipole: --plot would show 6 materials or models, expected at most 4\n");
    run_tool(&run, "dipole", "marble", "--plot", "p.svg", "--data", "a", "--data", "b", "--data", "c",
             "--data", "d", "--data", "e");
    assert_failed(&run, 2, "dipole: --data is given 5 times, expected at most 4\n");
    assert_int_equal(count_entries("."), 0);
}

/* Oracle: a material in 1/m gets a note on stderr, which -q silences; the numbers are the same. */
static void unit_slips_are_noted(void **state)
{
    (void)state;
    write_text("slip.json", "{ \"name\": \"s\", \"eta\": 1.3, \"sigma_a_per_mm\": [2000, 2000, 2000],\n"
                            "  \"sigma_s_prime_per_mm\": [20000, 20000, 20000] }\n");
    run_tool(&run, "dipole", "slip.json");
    assert_int_equal(run.exit_code, 0);
    assert_int_equal(strncmp(run.err, "dipole: note: slip.json: channel R: ", 36), 0);
    char *const noted = strdup(run.out);
    run_tool(&run, "dipole", "slip.json", "-q");
    assert_done(&run);
    assert_string_equal(run.out, noted);
    free(noted);
}

/* Oracle: on a full disk, and where there is no folder: one line, exit 1, and the file that was there
 * stays. */
static void plots_that_cannot_be_written_leave_nothing(void **state)
{
    (void)state;
    write_text("plot.svg", "before");
    run_tool_limited(&run, 1000, "dipole",
                     (const char *const[]){ MATERIALS "marble.json", "--plot", "plot.svg", NULL });
    assert_failed(&run, 1, "dipole: plot.svg: cannot be written: File too large\n");
    run_tool_limited(&run, 1000, "dipole",
                     (const char *const[]){ MATERIALS "marble.json", "--plot", "new.png", NULL });
    assert_failed(&run, 1, "dipole: new.png: cannot be written: File too large\n");
    char *data = NULL;
    size_t size = 0;
    assert_true(io_file_read("plot.svg", 100, &data, &size, NULL));
    assert_string_equal(data, "before");
    free(data);
    assert_int_equal(count_entries("."), 1);
    run_tool(&run, "dipole", MATERIALS "marble.json", "--plot", "missing/plot.svg");
    assert_failed(&run, 1, "dipole: missing/plot.svg: cannot be written: No such file or directory\n");
    run_tool(&run, "dipole", MATERIALS "marble.json", "--plot", "plot.svg/plot.svg");
    assert_failed(&run, 1, "dipole: plot.svg/plot.svg: cannot be written: Not a directory\n");
}

static int free_run(void **state)
{
    (void)state;
    free(run.out);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(json_holds_what_the_library_says),
        tool_test(json_agrees_with_the_exact_rows),
        tool_test(json_of_stacks_holds_what_the_library_says),
        tool_test(layers_agree_with_monte_carlo),
        tool_test(several_are_shown_one_after_the_other),
        tool_test(what_has_no_end_is_null),
        tool_test(default_radii_cover_the_profile),
        tool_test(asked_radii_are_kept_in_order),
        tool_test(people_get_tables_with_units),
        tool_test(people_get_layers_as_rows),
        tool_test(bundled_materials_have_names),
        tool_test(plot_shows_what_matters),
        tool_test(plots_overlay_models_and_data),
        tool_test(what_models_and_data_cannot_do_is_named),
        tool_test(bad_input_is_named),
        tool_test(wrong_usage_is_explained),
        tool_test(unit_slips_are_noted),
        tool_test(plots_that_cannot_be_written_leave_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
