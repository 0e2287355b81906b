#include "tests/run_tool.h"

#include "io/image.h"
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

/* The members of the fit block, and of its channels, that others read. */
static void assert_fit_block(const json_t *fit)
{
    static const char *const keys[] = { "converged", "model",   "rms_residual",
                                        "channels",  "targets", "seconds" };
    static const char *const channel_keys[] = { "channel",
                                                "sigma_a_per_mm",
                                                "sigma_a_ci95",
                                                "sigma_s_prime_per_mm",
                                                "sigma_s_prime_ci95",
                                                "correlation",
                                                "identifiable",
                                                "rms_residual",
                                                "note" };
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

/* Oracle: exact messages for what fit cannot do, exit code 1, and nothing written. */
static void what_cannot_be_fitted_is_refused(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    write_picture("grey.exr", 160, 120, 3);
    write_text("sky.exr", "");
    write_text("sky.json", "{ \"camera\": { \"eye\": [0, 0, 9], \"target\": [0, 0, 0] }, \"lights\": [],\n"
                           "  \"environment\": { \"image\": \"sky.exr\" },\n"
                           "  \"objects\": [{ \"primitive\": \"cube\", \"material\": \"marble\" }] }\n");
    run_tool(&run, "fit", "sky.json", "grey.exr", "-o", "found.json");
    assert_failed(&run, 1,
                  "fit: sky.json: the scene has an environment, which cannot be fitted to, expected lights "
                  "alone\n");
    run_tool(&run, "fit", "knot.json", "grey.exr", "-o", "found.json", "--layer", "2");
    assert_failed(&run, 1, "fit: --layer is 2, expected 1 to 1\n");
    write_text(
        "three.json",
        "{ \"name\": \"t\", \"eta\": 1.5, \"layers\": [\n"
        "  { \"thickness_mm\": 1, \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] },\n"
        "  { \"thickness_mm\": \"infinite\", \"sigma_a_per_mm\": [1, 1, 1],\n"
        "    \"sigma_s_prime_per_mm\": [1, 1, 1] }] }\n");
    run_tool(&run, "fit", "knot.json", "grey.exr", "-o", "found.json", "--start", "three.json");
    assert_failed(&run, 1, "fit: three.json: the start has 2 layers, expected 1 as in the scene, or one\n");
    write_knot_with("other.json", "\"marble\"",
                    "{ \"name\": \"s\", \"eta\": 1.7,\n"
                    "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] }");
    run_tool(&run, "fit", "knot.json", "grey.exr", "other.json", "grey.exr", "-o", "found.json");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err, "the material's eta is 1.7, expected 1.5 as in"));
    assert_int_equal(count_entries("."), 6);
    free(run.out);
}

/* The fit block that fit --json prints for a picture of the knot. */
static json_t *fit_knot(struct tool_run *run, const char *picture_path)
{
    run_tool(run, "fit", "knot.json", picture_path, "--start", skin1_path, "-o", "found.json", "--json",
             "--model", "dipole");
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

/* Oracle: the coefficients that the picture was drawn with, although it errs by up to 3 %, within 2 % and
 * the intervals; what the picture says of its errors makes them narrower than what is assumed of a
 * photograph (with 5 % it would no longer). */
static void a_coarse_picture_is_taken_at_its_word(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    run_tool(&run, "render", "knot.json", "-q", "--epsilon", "0.03", "-o", "coarse.exr");
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
    assert_true(number_at(stated, "rms_residual", 0) < 0.01);
    assert_string_equal(json_string_value(json_object_get(stated, "model")), "dipole");
    for (size_t c = 0; c < 3; c++) {
        const json_t *const channel = json_array_get(json_object_get(stated, "channels"), c);
        assert_close(number_at(channel, "sigma_a_per_mm", 0), truth.layers[c][0].medium.sigma_a_per_mm,
                     0.02, "%zu", c);
        assert_true(interval_width(silent, c, "sigma_a_ci95") > interval_width(stated, c, "sigma_a_ci95"));
        /* the picture errs by some 0.2 % beside what it says: an interval that is much narrower would boast
         */
        assert_true(interval_width(stated, c, "sigma_s_prime_ci95") >
                    0.006 * truth.layers[c][0].medium.sigma_s_prime_per_mm);
        for (int i = 0; i < 2; i++) {
            assert_holds(i ? silent : stated, c, "sigma_a_ci95", truth.layers[c][0].medium.sigma_a_per_mm);
            assert_holds(i ? silent : stated, c, "sigma_s_prime_ci95",
                         truth.layers[c][0].medium.sigma_s_prime_per_mm);
        }
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

static const json_t *channel_of(const json_t *fit, size_t channel)
{
    return json_array_get(json_object_get(fit, "channels"), channel);
}

/* Assert that each of a material's coefficients lies in its interval and within tolerance of what was
 * found. */
static void assert_material(const json_t *fit, const char *path, double tolerance)
{
    struct io_material truth;
    assert_true(io_material_read(path, &truth, NULL));
    for (size_t c = 0; c < 3; c++) {
        const dipole_medium *const medium = &truth.layers[c][0].medium;
        if (tolerance > 0) {
            assert_close(number_at(channel_of(fit, c), "sigma_a_per_mm", 0), medium->sigma_a_per_mm,
                         tolerance, "sigma_a %zu", c);
            assert_close(number_at(channel_of(fit, c), "sigma_s_prime_per_mm", 0),
                         medium->sigma_s_prime_per_mm, tolerance, "sigma_s' %zu", c);
        }
        assert_holds(fit, c, "sigma_a_ci95", medium->sigma_a_per_mm);
        assert_holds(fit, c, "sigma_s_prime_ci95", medium->sigma_s_prime_per_mm);
    }
}

/* Oracle: the material of a photograph whose codes were made here from linear values: 8-bit sRGB, 5 % of
 * the object clipped, no word about its making; and no model named. 5 %: what is promised. With light of
 * unknown brightness this picture tells less, and the intervals say so. */
static void a_photograph_tells_the_material(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    write_knot_with("dim.json", ", \"irradiance\": 3", "");
    run_tool(&run, "render", "knot.json", "-q", "-o", "knot.exr");
    assert_int_equal(run.exit_code, 0);
    struct io_image *image;
    assert_true(io_exr_read("knot.exr", &image, NULL));
    const size_t count = 160 * 120;
    double peak = 0;
    for (size_t i = 0; i < count; i++)
        peak = fmax(peak, (double)image->pixels[4 * i]);
    const double exposure = 1.1; /* of the brightest point */
    size_t covered = 0, clipped = 0;
    for (size_t i = 0; i < count; i++) {
        covered += image->pixels[4 * i + 3] > 0;
        bool is_clipped = false;
        for (size_t c = 0; c < 3; c++) {
            image->pixels[4 * i + c] = (float)((double)image->pixels[4 * i + c] * exposure / peak);
            is_clipped = is_clipped || image->pixels[4 * i + c] >= 1;
        }
        image->pixels[4 * i + 3] = 1;
        clipped += is_clipped;
    }
    print_message("  %.3g %% are clipped\n", 100 * (double)clipped / (double)covered);
    assert_true((double)clipped > 0.04 * (double)covered);
    struct io_image silent = *image; /* without attributes */
    silent.attribute_count = 0;
    assert_true(io_png_write("knot.png", &silent, NULL));
    io_image_destroy(image);
    char irradiance[64];
    snprintf(irradiance, sizeof irradiance, "\"irradiance\": %.9g", 3 * exposure / peak);
    write_knot_with("lit.json", "\"irradiance\": 3", irradiance);
    run_tool(&run, "fit", "lit.json", "knot.png", "--start", skin1_path, "-o", "found.json", "--json");
    assert_int_equal(run.exit_code, 0);
    json_t *fit = json_loads(run.out, 0, NULL);
    assert_string_equal(json_string_value(json_object_get(fit, "model")), "dipole");
    assert_material(fit, marble_path, 0.05);
    const json_t *target = json_array_get(json_object_get(fit, "targets"), 0);
    assert_true(number_at(json_object_get(target, "pixels"), "clipped", 0) >= 10);
    json_decref(fit);

    run_tool(&run, "fit", "dim.json", "knot.png", "--start", skin1_path, "-o", "found.json", "--json",
             "--model", "dipole");
    assert_int_equal(run.exit_code, 0);
    assert_non_null(strstr(run.err, "so the exposure is fitted, too"));
    fit = json_loads(run.out, 0, NULL);
    assert_material(fit, marble_path, 0);
    target = json_array_get(json_object_get(fit, "targets"), 0);
    assert_true(number_at(target, "exposure_ci95", 0) < 3 * exposure / peak &&
                number_at(target, "exposure_ci95", 1) > 3 * exposure / peak);
    json_decref(fit);
    free(run.out);
}

/* Oracle: the material, from two views together, one of them 1.7 times as bright as the scene says and with
 * a constant added to red. */
static void several_pictures_and_nuisances_are_fitted_together(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("front.json", knot);
    write_knot_with("back.json", "\"eye\": [5, 10, 48]", "\"eye\": [-20, 30, -35]");
    run_tool(&run, "render", "front.json", "-q", "-o", "front.exr");
    run_tool(&run, "render", "back.json", "-q", "-o", "back.exr");
    assert_int_equal(run.exit_code, 0);
    struct io_image *image;
    assert_true(io_exr_read("back.exr", &image, NULL));
    for (size_t i = 0; i < 160 * 120; i++) {
        for (size_t c = 0; c < 3; c++)
            image->pixels[4 * i + c] = 1.7f * image->pixels[4 * i + c] + (c == 0 ? 0.01f : 0.0f);
    }
    assert_true(io_exr_write("back.exr", image, false, NULL));
    io_image_destroy(image);
    run_tool(&run, "fit", "front.json", "front.exr", "back.json", "back.exr", "--start", skin1_path, "-o",
             "found.json", "--json", "--free", "exposure,black-level");
    assert_done(&run);
    json_t *const fit = json_loads(run.out, 0, NULL);
    assert_material(fit, marble_path, 0.1);
    const json_t *const back = json_array_get(json_object_get(fit, "targets"), 1);
    assert_close(number_at(back, "exposure", 0), 1.7, 0.01, "exposure");
    const json_t *const black = json_array_get(json_object_get(back, "black_level"), 0);
    assert_close(number_at(black, "value", 0), 0.01, 0.1, "black level");
    json_decref(fit);
    free(run.out);
}

/* Oracle: the upper of two layers and its thickness, in what render draws of the whole. Starts are up to
 * five times off. */
static void a_layer_on_a_known_base_comes_back(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    static const char layers[] =
        "{ \"name\": \"l\", \"eta\": 1.4, \"layers\": [\n"
        "  { \"thickness_mm\": %s, \"sigma_a_per_mm\": %s, \"sigma_s_prime_per_mm\": %s },\n"
        "  { \"thickness_mm\": \"infinite\", \"sigma_a_per_mm\": [0.02, 0.02, 0.02],\n"
        "    \"sigma_s_prime_per_mm\": [1, 1, 1] }] }";
    char truth[512], start[512];
    snprintf(truth, sizeof truth, layers, "0.7", "[0.1, 0.2, 0.3]", "[2, 1.5, 3]");
    snprintf(start, sizeof start, layers, "2", "[0.05, 0.05, 0.05]", "[4, 4, 4]");
    write_knot_with("truth.json", "\"marble\"", truth);
    write_knot_with("start.json", "\"marble\"", start);
    run_tool(&run, "render", "truth.json", "-q", "-o", "knot.exr");
    assert_int_equal(run.exit_code, 0);
    run_tool(&run, "fit", "start.json", "knot.exr", "-o", "found.json", "--json");
    assert_done(&run);
    json_t *const fit = json_loads(run.out, 0, NULL);
    static const double sigma_a[] = { 0.1, 0.2, 0.3 }, sigma_s[] = { 2, 1.5, 3 };
    for (size_t c = 0; c < 3; c++) {
        assert_close(number_at(channel_of(fit, c), "sigma_a_per_mm", 0), sigma_a[c], 0.03, "%zu", c);
        assert_close(number_at(channel_of(fit, c), "sigma_s_prime_per_mm", 0), sigma_s[c], 0.03, "%zu", c);
        assert_holds(fit, c, "sigma_a_ci95", sigma_a[c]);
        assert_holds(fit, c, "sigma_s_prime_ci95", sigma_s[c]);
        assert_holds(fit, c, "thickness_ci95", 0.7);
    }
    assert_close(number_at(channel_of(fit, 0), "thickness_mm", 0), 0.7, 0.03, "thickness");
    json_decref(fit);
    /* what was found is a material with layers, like any other */
    struct io_material found;
    assert_true(io_material_read("found.json", &found, NULL));
    assert_int_equal(found.layer_count, 2);
    assert_close(found.layers[1][1].medium.sigma_a_per_mm, 0.02, 0.0, "the base is as it was");
    free(run.out);
}

/* Oracle: Monte Carlo's own coefficients of red skin (tests/reference/README.md) lie in the intervals,
 * which are no wider than a quarter; adding-doubling's of a slab do, too. */
static void profiles_and_totals_of_others_are_fitted(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    run_tool(&run, "fit", "--profile", SOURCE_FOLDER "/tests/reference/mcml/semi_skin1R_n13.csv", "--eta",
             "1.3", "-o", "skin.json", "--json", "-q");
    assert_done(&run);
    json_t *fit = json_loads(run.out, 0, NULL);
    assert_string_equal(json_string_value(json_object_get(fit, "model")), "modes");
    assert_int_equal(json_array_size(json_object_get(fit, "channels")), 1);
    assert_holds(fit, 0, "sigma_a_ci95", 0.032);
    assert_holds(fit, 0, "sigma_s_prime_ci95", 0.74);
    assert_true(interval_width(fit, 0, "sigma_a_ci95") < 0.25 * 0.032);
    json_decref(fit);
    /* albedo 0.99, g 0, n 1, tau 5: adding_doubling.csv */
    write_text("slab.csv", "thickness_mm,total_reflectance,total_reflectance_sem,total_transmittance,"
                           "total_transmittance_sem\n1,0.680078115504,0.001,0.220627796449,0.001\n");
    run_tool(&run, "fit", "--totals", "slab.csv", "--eta", "1", "-o", "slab.json", "--json", "-q");
    assert_done(&run);
    fit = json_loads(run.out, 0, NULL);
    assert_holds(fit, 0, "sigma_a_ci95", 0.05);
    assert_holds(fit, 0, "sigma_s_prime_ci95", 4.95);
    assert_true(interval_width(fit, 0, "sigma_a_ci95") < 0.25 * 0.05);
    json_decref(fit);
    free(run.out);
}

/* Oracle: Ctrl-C leaves a whole material file that says it was interrupted, and exit code 1. */
static void an_interrupted_fit_keeps_the_best_so_far(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("knot.json", knot);
    run_tool(&run, "render", "knot.json", "-q", "-o", "knot.exr");
    /* not so soon that it has not begun, nor so late that it is done, whatever the machine */
    assert_int_equal(
        system("for seconds in 0.5 1 2 4 8; do env --default-signal=INT timeout --preserve-status -s INT "
               "$seconds " PROGRAM_FOLDER "/fit knot.json knot.exr --model modes -q -o found.json "
               ">out 2>err; code=$?; if grep -q 'was interrupted; found.json has the best so far' err; "
               "then exit $((code - 1)); fi; done; exit 9"),
        0);
    json_t *const found = json_load_file("found.json", 0, NULL);
    const json_t *const fit = json_object_get(found, "fit");
    assert_true(json_is_false(json_object_get(fit, "converged")));
    assert_true(json_is_true(json_object_get(fit, "interrupted")));
    json_decref(found);
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
    run_tool(&run, "fit", "knot.json", "grey.exr", "-o", "found.json", "--mask", "small.exr");
    assert_failed(&run, 1,
                  "fit: grey.exr: the mask is 80x60 pixels, expected the 160x120 of the scene's camera\n");
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
        "fit: away.exr: the picture has 0 pixels to fit, expected 100 or more; of 19200: 19200 not "
        "covered\n");
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
    assert_failed(&run, 2, "fit: expected SCENE.json and TARGET in pairs; try --help\n");
    run_tool(&run, "fit", "a.json", "b.exr", "-o", "c.json", "--profile", "d.csv");
    assert_failed(
        &run, 2, "fit: expected a --profile for each of red, green and blue beside pictures; try --help\n");
    run_tool(&run, "fit", "--profile", "d.csv", "-o", "c.json");
    assert_failed(&run, 2, "fit: nothing says what eta is: expected --eta or --start; try --help\n");
    run_tool(&run, "fit", "a.json", "b.exr", "-o", "c.json", "--eta", "1.3");
    assert_failed(&run, 2,
                  "fit: --eta cannot be used with a scene, whose material states it; try --help\n");
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
        tool_test(a_photograph_tells_the_material),
        tool_test(several_pictures_and_nuisances_are_fitted_together),
        tool_test(a_layer_on_a_known_base_comes_back),
        tool_test(profiles_and_totals_of_others_are_fitted),
        tool_test(an_interrupted_fit_keeps_the_best_so_far),
        tool_test(bad_inputs_are_refused_in_one_line),
        tool_test(what_cannot_be_fitted_is_refused),
        tool_test(a_truncated_picture_is_refused),
        tool_test(a_picture_of_nothing_is_refused),
        tool_test(wrong_usage_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
