#include "io/file.h"
#include "io/material_file.h"
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
        assert_int_equal(json_object_size(result), 4);
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
        "dipole: 0 operands, expected 1: dipole MATERIAL.json [--epsilon E] [--at R,R,...] [--plot "
        "FILE.svg|png]\n");
    run_tool(&run, "dipole", "marble", "--epsilon", "0");
    assert_failed(&run, 2, "dipole: --epsilon is \"0\", expected a number 1e-09 to 0.5\n");
    run_tool(&run, "dipole", "marble", "--at", "1,-1");
    assert_failed(&run, 2, "dipole: --at has \"-1\", expected numbers 0 to 1e+50 with commas between\n");
    run_tool(&run, "dipole", "marble", "--plot", "marble.pdf");
    assert_failed(&run, 2, "dipole: --plot is \"marble.pdf\", expected a name that ends in .svg or .png\n");
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
        tool_test(default_radii_cover_the_profile),
        tool_test(asked_radii_are_kept_in_order),
        tool_test(people_get_tables_with_units),
        tool_test(bundled_materials_have_names),
        tool_test(plot_shows_what_matters),
        tool_test(bad_input_is_named),
        tool_test(wrong_usage_is_explained),
        tool_test(unit_slips_are_noted),
        tool_test(plots_that_cannot_be_written_leave_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
