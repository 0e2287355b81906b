#include "tests/run_tool.h"

#include "io/exr.h"
#include "io/material_file.h"

static const char marble_path[] = PROGRAM_FOLDER "/../share/libdipole/materials/marble.json";
static const char skin1_path[] = PROGRAM_FOLDER "/../share/libdipole/materials/skin1.json";

static const char knot[] =
    "{ \"camera\": { \"eye\": [5, 10, 48], \"target\": [0, 0, 0], \"fov_y_deg\": 38, \"size\": [160, 120] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [-0.5, -0.6, -0.6], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"knot\", \"detail\": 256, \"transform\": { \"scale\": 12 },\n"
    "                \"material\": \"marble\", \"roughness\": 0.3 }] }\n";

/* The knot's scene with one piece of its text replaced. */
static void write_knot_with(const char *path, const char *piece, const char *replacement)
{
    char scene[2 * sizeof knot];
    const char *const found = strstr(knot, piece);
    assert_non_null(found);
    snprintf(scene, sizeof scene, "%.*s%s%s", (int)(found - knot), knot, replacement,
             found + strlen(piece));
    write_text(path, scene);
}

/* A grey picture of any size. */
static void write_picture(const char *path, int width_px, int height_px, int channel_count)
{
    struct io_image *image;
    assert_true(io_image_create(width_px, height_px, channel_count, &image, NULL));
    for (int i = 0; i < width_px * height_px * channel_count; i++)
        image->pixels[i] = 0.1f;
    assert_true(io_exr_write(path, image, false, NULL));
    io_image_destroy(image);
}

static double number_at(const json_t *object, const char *key, size_t index)
{
    const json_t *const value = json_object_get(object, key);
    return json_number_value(json_is_array(value) ? json_array_get(value, index) : value);
}

/* The members of the fit block, and of its channels: all of them, none beside. */
static void assert_fit_block(const json_t *fit)
{
    static const char *const keys[] = { "converged", "rms_residual", "channels", "seconds" };
    static const char *const channel_keys[] = { "sigma_a_per_mm",       "sigma_a_ci95",
                                                "sigma_s_prime_per_mm", "sigma_s_prime_ci95",
                                                "identifiable",         "note" };
    assert_int_equal(json_object_size(fit), sizeof keys / sizeof *keys);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        assert_non_null(json_object_get(fit, keys[i]));
    const json_t *const channels = json_object_get(fit, "channels");
    assert_int_equal(json_array_size(channels), 3);
    for (size_t c = 0; c < 3; c++) {
        const json_t *const channel = json_array_get(channels, c);
        assert_int_equal(json_object_size(channel), sizeof channel_keys / sizeof *channel_keys);
        for (size_t i = 0; i < sizeof channel_keys / sizeof *channel_keys; i++)
            assert_non_null(json_object_get(channel, channel_keys[i]));
    }
}

/* Oracle: the coefficients of the material that the picture was drawn with. The search starts at skin1, up
 * to 70 times off; the picture is cut off well within the knot. 1 %: what is promised for the project's own
 * pictures. */
static void coefficients_come_back_from_a_rendered_picture(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    run_tool(&run, "render", "knot.json", "-q", "--epsilon", "0.02", "-o", "knot.exr");
    assert_int_equal(run.exit_code, 0);
    run_tool(&run, "fit", "knot.json", "knot.exr", "--start", skin1_path, "-o", "found.json", "--json");
    assert_done(&run);

    json_t *const printed = json_loads(run.out, 0, NULL), *const written =
                                                              json_load_file("found.json", 0, NULL);
    assert_non_null(printed);
    assert_non_null(written);
    assert_fit_block(printed);
    assert_true(json_equal(printed, json_object_get(written, "fit")));
    assert_true(json_is_true(json_object_get(printed, "converged")));
    assert_true(number_at(printed, "rms_residual", 0) < 0.02);

    struct io_material truth, found;
    assert_true(io_material_read(marble_path, &truth, NULL));
    assert_true(io_material_read("found.json", &found, NULL));
    for (size_t c = 0; c < 3; c++) {
        const json_t *const channel = json_array_get(json_object_get(printed, "channels"), c);
        const double sigma_a = truth.layers[c][0].medium.sigma_a_per_mm,
                     sigma_s = truth.layers[c][0].medium.sigma_s_prime_per_mm;
        assert_close(number_at(channel, "sigma_a_per_mm", 0), sigma_a, 0.01, "sigma_a %zu", c);
        assert_close(number_at(channel, "sigma_s_prime_per_mm", 0), sigma_s, 0.01, "sigma_s' %zu", c);
        assert_true(number_at(channel, "sigma_a_ci95", 0) <= sigma_a);
        assert_true(number_at(channel, "sigma_a_ci95", 1) >= sigma_a);
        assert_true(number_at(channel, "sigma_s_prime_ci95", 0) <= sigma_s);
        assert_true(number_at(channel, "sigma_s_prime_ci95", 1) >= sigma_s);
        assert_true(json_is_true(json_object_get(channel, "identifiable")));
        assert_close(found.layers[c][0].medium.sigma_a_per_mm, number_at(channel, "sigma_a_per_mm", 0), 0.0,
                     "file");
        assert_close(found.layers[c][0].medium.eta, truth.layers[c][0].medium.eta, 0.0,
                     "eta of the scene's material");
    }
    json_decref(printed);
    json_decref(written);

    /* what was found is a material like any other, and a start that is no further away changes nothing */
    run_tool(&run, "lutgen", "found.json", "-q", "-o", "tables");
    assert_int_equal(run.exit_code, 0);
    run_tool(&run, "fit", "knot.json", "knot.exr", "-o", "again.json");
    assert_done(&run);
    assert_non_null(strstr(run.out, "1/mm"));
    struct io_material again;
    assert_true(io_material_read("again.json", &again, NULL));
    for (size_t c = 0; c < 3; c++)
        assert_close(again.layers[c][0].medium.sigma_a_per_mm, found.layers[c][0].medium.sigma_a_per_mm,
                     1e-5, "start %zu", c);

    /* a full disk leaves what was there */
    const int entry_count = count_entries(".");
    run_tool_limited(&run, 100, "fit",
                     (const char *const[]){ "knot.json", "knot.exr", "-o", "full.json", NULL });
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err, "fit: full.json: "));
    assert_int_equal(count_entries("."), entry_count);
    free(run.out);
}

/* Oracle: exact messages for a scene and for a start that fit cannot do, exit code 1, and nothing written.
 */
static void other_models_are_refused(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    write_picture("grey.exr", 160, 120, 3);
    write_text("beam.json", "{ \"name\": \"b\", \"eta\": 1.5, \"model\": \"beam\",\n"
                            "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_knot_with("slab.json", "\"marble\"",
                    "{ \"name\": \"s\", \"eta\": 1.5, \"layers\": [{ \"thickness_mm\": 2,\n"
                    "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] }] }");
    run_tool(&run, "fit", "slab.json", "grey.exr", "-o", "found.json");
    assert_failed(&run, 1,
                  "fit: slab.json:4:66: objects[0].material.layers cannot be done by this program, which "
                  "knows the classical dipole only, expected one medium with the model \"dipole\"\n");
    run_tool(&run, "fit", "knot.json", "grey.exr", "-o", "found.json", "--start", "beam.json");
    assert_failed(&run, 1,
                  "fit: beam.json:1:37: model is \"beam\", which cannot be done by this program, expected "
                  "\"dipole\"\n");
    write_text("sky.exr", "");
    write_text("sky.json", "{ \"camera\": { \"eye\": [0, 0, 9], \"target\": [0, 0, 0] }, \"lights\": [],\n"
                           "  \"environment\": { \"image\": \"sky.exr\" },\n"
                           "  \"objects\": [{ \"primitive\": \"cube\", \"material\": \"marble\" }] }\n");
    run_tool(&run, "fit", "sky.json", "grey.exr", "-o", "found.json");
    assert_failed(&run, 1,
                  "fit: sky.json: the scene has an environment, which cannot be fitted to, expected lights "
                  "alone\n");
    assert_int_equal(count_entries("."), 6);
    free(run.out);
}

/* The fit block that fit --json prints for a picture of the knot. */
static json_t *fit_knot(struct tool_run *run, const char *picture_path)
{
    run_tool(run, "fit", "knot.json", picture_path, "--start", skin1_path, "-o", "found.json", "--json");
    assert_done(run);
    json_t *const fit = json_loads(run->out, 0, NULL);
    assert_non_null(fit);
    assert_fit_block(fit);
    return fit;
}

static double interval_width(const json_t *fit, size_t channel, const char *key)
{
    const json_t *const entry = json_array_get(json_object_get(fit, "channels"), channel);
    return number_at(entry, key, 1) - number_at(entry, key, 0);
}

static void assert_holds(const json_t *fit, size_t channel, const char *key, double truth)
{
    const json_t *const entry = json_array_get(json_object_get(fit, "channels"), channel);
    assert_true(number_at(entry, key, 0) <= truth && truth <= number_at(entry, key, 1));
}

/* Oracle: the coefficients that the picture was drawn with, to 1 % although the picture errs by up to 5 %:
 * it says where it was cut off and how far its light samples are apart, and fit does the same, so that
 * little is left over. Without these words in the file they come back less exactly, and surely with wider
 * intervals. */
static void a_coarse_picture_is_taken_at_its_word(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    run_tool(&run, "render", "knot.json", "-q", "--epsilon", "0.05", "-o", "coarse.exr");
    assert_int_equal(run.exit_code, 0);
    struct io_image *image;
    assert_true(io_exr_read("coarse.exr", &image, NULL));
    struct io_image silent_image = *image; /* without attributes */
    silent_image.attribute_count = 0;
    assert_true(io_exr_write("silent.exr", &silent_image, false, NULL));
    io_image_destroy(image);
    json_t *const stated = fit_knot(&run, "coarse.exr"), *const silent = fit_knot(&run, "silent.exr");
    struct io_material truth;
    assert_true(io_material_read(marble_path, &truth, NULL));
    assert_true(number_at(stated, "rms_residual", 0) < 1e-3);
    assert_true(number_at(silent, "rms_residual", 0) > 2e-3);
    for (size_t c = 0; c < 3; c++) {
        const json_t *const channel = json_array_get(json_object_get(stated, "channels"), c);
        assert_close(number_at(channel, "sigma_a_per_mm", 0), truth.layers[c][0].medium.sigma_a_per_mm,
                     0.01, "%zu", c);
        assert_true(interval_width(silent, c, "sigma_a_ci95") >
                    2.0 * interval_width(stated, c, "sigma_a_ci95"));
        /* the picture errs by some 0.2 % beside what it says: an interval that is much narrower would boast
         */
        assert_true(interval_width(stated, c, "sigma_s_prime_ci95") >
                    0.006 * truth.layers[c][0].medium.sigma_s_prime_per_mm);
        assert_holds(stated, c, "sigma_a_ci95", truth.layers[c][0].medium.sigma_a_per_mm);
        assert_holds(stated, c, "sigma_s_prime_ci95", truth.layers[c][0].medium.sigma_s_prime_per_mm);
    }
    json_decref(stated);
    json_decref(silent);
    free(run.out);
}

/* Oracle: red light tells nothing of green and blue: there the coefficients of --start stand, and are said
 * to be unknown; red comes back as above. */
static void a_channel_without_light_keeps_the_start(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_knot_with("red.json", "\"irradiance\": 3", "\"irradiance\": [3, 0, 0]");
    run_tool(&run, "render", "red.json", "-q", "--epsilon", "0.02", "-o", "red.exr");
    assert_int_equal(run.exit_code, 0);
    run_tool(&run, "fit", "red.json", "red.exr", "--start", "skin1", "-o", "found.json");
    assert_done(&run);
    assert_non_null(strstr(run.out, "G: no light enters or leaves in this channel"));
    struct io_material truth, start, found;
    assert_true(io_material_read(marble_path, &truth, NULL));
    assert_true(io_material_read(skin1_path, &start, NULL));
    assert_true(io_material_read("found.json", &found, NULL));
    assert_close(found.layers[0][0].medium.sigma_a_per_mm, truth.layers[0][0].medium.sigma_a_per_mm, 0.01,
                 "red");
    json_t *const written = json_load_file("found.json", 0, NULL);
    const json_t *const channels = json_object_get(json_object_get(written, "fit"), "channels");
    for (size_t c = 1; c < 3; c++) {
        assert_close(found.layers[c][0].medium.sigma_a_per_mm, start.layers[c][0].medium.sigma_a_per_mm,
                     1e-15, "%zu", c);
        assert_close(found.layers[c][0].medium.eta, truth.layers[c][0].medium.eta, 0.0, "%zu", c);
        assert_true(json_is_false(json_object_get(json_array_get(channels, c), "identifiable")));
    }
    json_decref(written);
    free(run.out);
}

/* Oracle: one line that says what is wrong, exit code 1, and nothing written. */
static void bad_inputs_are_refused_in_one_line(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    write_picture("small.exr", 80, 60, 3);
    write_picture("grey.exr", 160, 120, 1);
    write_text("text.exr", "this is no picture");
    const int entry_count = count_entries(".");

    run_tool(&run, "fit", "knot.json", "missing.exr", "-o", "found.json");
    assert_failed(&run, 1, "fit: missing.exr: cannot be read: No such file or directory\n");
    run_tool(&run, "fit", "missing.json", "small.exr", "-o", "found.json");
    assert_failed(&run, 1, "fit: missing.json: cannot be read: No such file or directory\n");
    run_tool(&run, "fit", "knot.json", "small.exr", "-o", "found.json");
    assert_failed(
        &run, 1,
        "fit: small.exr: the picture is 80x60 pixels, expected the 160x120 of the scene's camera\n");
    run_tool(&run, "fit", "knot.json", "grey.exr", "-o", "found.json");
    assert_failed(&run, 1, "fit: grey.exr: the picture has 1 channel, expected red, green and blue\n");
    run_tool(&run, "fit", "knot.json", "small.exr", "-o", "found.json", "--start", "none.json");
    assert_failed(&run, 1, "fit: none.json: cannot be read: No such file or directory\n");
    run_tool(&run, "fit", "knot.json", "text.exr", "-o", "found.json");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err, "fit: text.exr: "));
    run_tool(&run, "fit", "knot.json", "small.exr", "-o", "nowhere/found.json");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err, "fit: nowhere/found.json: "));
    assert_int_equal(count_entries("."), entry_count);
    free(run.out);
}

/* Oracle: a picture cut short anywhere must be refused with its name, not end the program. */
static void a_truncated_picture_is_refused(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    write_picture("whole.exr", 160, 120, 3);
    FILE *const whole = fopen("whole.exr", "rb");
    assert_non_null(whole);
    char bytes[65536];
    const size_t size = fread(bytes, 1, sizeof bytes, whole);
    fclose(whole);
    for (size_t part = 1; part < 8; part += 2) {
        FILE *const cut = fopen("cut.exr", "wb");
        assert_non_null(cut);
        assert_int_equal(fwrite(bytes, 1, size * part / 8, cut), size * part / 8);
        assert_int_equal(fclose(cut), 0);
        run_tool(&run, "fit", "knot.json", "cut.exr", "-o", "found.json");
        assert_int_equal(run.exit_code, 1);
        assert_non_null(strstr(run.err, "fit: cut.exr: "));
        assert_true(strchr(run.err, '\n') == run.err + strlen(run.err) - 1);
    }
    assert_int_equal(count_entries("."), 3);
    free(run.out);
}

/* Oracle: a camera that looks away has no pixel to fit; the message counts them. */
static void a_picture_of_nothing_is_refused(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_knot_with("away.json", "\"target\": [0, 0, 0]", "\"target\": [0, 0, 90]");
    write_picture("away.exr", 160, 120, 3);
    run_tool(&run, "fit", "away.json", "away.exr", "-o", "found.json");
    assert_failed(
        &run, 1,
        "fit: away.exr: the picture has 0 pixels to fit, expected 100 or more: of 19200, 19200 are not "
        "wholly covered by an object, 0 are not finite, 0 are mostly specular or black\n");
    assert_int_equal(count_entries("."), 2);
    free(run.out);
}

/* Oracle: DESIGN's exit codes; wrong usage is 2. */
static void wrong_usage_is_told(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    run_tool(&run, "fit", "a.json", "b.exr");
    assert_failed(&run, 2, "fit: no --output (-o) MATERIAL.json was given; try --help\n");
    run_tool(&run, "fit", "a.json", "-o", "c.json");
    assert_int_equal(run.exit_code, 2);
    run_tool(&run, "fit", "a.json", "b.exr", "-o", "c.json", "--profile", "d.csv");
    assert_int_equal(run.exit_code, 2);
    run_tool(&run, "fit", "--help");
    assert_done(&run);
    assert_non_null(strstr(run.out, "--start"));
    free(run.out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(coefficients_come_back_from_a_rendered_picture),
        tool_test(a_coarse_picture_is_taken_at_its_word),
        tool_test(a_channel_without_light_keeps_the_start),
        tool_test(bad_inputs_are_refused_in_one_line),
        tool_test(other_models_are_refused),
        tool_test(a_truncated_picture_is_refused),
        tool_test(a_picture_of_nothing_is_refused),
        tool_test(wrong_usage_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
