/* fit --report as a user runs it: what the program found stands in its page. */
#include "tests/page_check.h"
#include "tests/run_tool.h"

#include "fit/report_color.h"
#include "fit/report_page.h"
#include "io/exr.h"
#include "io/material_file.h"

enum { WIDTH = 160, HEIGHT = 120, PIXEL_COUNT = WIDTH * HEIGHT };

static const char knot[] =
    "{ \"camera\": { \"eye\": [5, 10, 48], \"target\": [0, 0, 0], \"fov_y_deg\": 38, \"size\": [160, 120] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [-0.5, -0.6, -0.6], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"knot\", \"detail\": 256, \"transform\": { \"scale\": 12 },\n"
    "                \"material\": \"marble\", \"roughness\": 0.3 }] }\n";

static void render_knot(struct tool_run *run)
{
    write_text("knot.json", knot);
    run_tool(run, "render", "knot.json", "-q", "-o", "knot.exr");
    assert_int_equal(run->exit_code, 0);
}

/* The page in a folder; the caller frees it. */
static char *read_page(const char *folder)
{
    char path[256], *page;
    size_t size;
    snprintf(path, sizeof path, "%s/index.html", folder);
    assert_true(io_file_read(path, (size_t)1 << 30, &page, &size, NULL));
    assert_page(page, size);
    return page;
}

/* The "fit" block of a material; the caller ends it. */
static json_t *read_block(const char *path)
{
    json_t *const written = json_load_file(path, 0, NULL);
    json_t *const block = json_incref(json_object_get(written, "fit"));
    assert_non_null(block);
    json_decref(written);
    return block;
}

static double number_at(const json_t *object, const char *key, size_t index)
{
    const json_t *const value = json_object_get(object, key);
    assert_non_null(value);
    return json_number_value(json_is_array(value) ? json_array_get(value, index) : value);
}

/* A row of the page's table has the value and its interval, each with the digits it deserves. */
static void assert_has_value(const char *page, const json_t *entry, const char *group, const char *name,
                             const char *key, const char *ci_key)
{
    const double value = number_at(entry, key, 0), low = number_at(entry, ci_key, 0);
    const double high = number_at(entry, ci_key, 1);
    char text[512], numbers[3][FIT_NUMBER_SIZE];
    fit_number_format(value, fit_number_digits(value, fmin(value - low, high - value)), numbers[0]);
    fit_number_format(low, fit_number_digits(low, value - low), numbers[1]);
    fit_number_format(high, fit_number_digits(high, high - value), numbers[2]);
    snprintf(text, sizeof text, "<td>%s</td><td>%s</td><td class=\"number\"><b>%s</b></td>", group, name,
             numbers[0]);
    assert_has(page, text);
    snprintf(text, sizeof text, "<td class=\"number\">%s</td><td class=\"number\">%s</td>", numbers[1],
             numbers[2]);
    assert_has(page, text);
}

static void assert_has_coefficients(const char *page, const json_t *block)
{
    const json_t *const channels = json_object_get(block, "channels");
    for (size_t c = 0; c < json_array_size(channels); c++) {
        const json_t *const channel = json_array_get(channels, c);
        const char *const group = json_array_size(channels) > 1 ? io_channel_names[c] : "medium";
        assert_has_value(page, channel, group, "sigma_a", "sigma_a_per_mm", "sigma_a_ci95");
        assert_has_value(page, channel, group, "sigma_s'", "sigma_s_prime_per_mm", "sigma_s_prime_ci95");
    }
}

static const json_t *target_of(const json_t *block, size_t index)
{
    return json_array_get(json_object_get(block, "targets"), index);
}

/* ---- pictures ---------------------------------------------------------------------------------------- */

static struct io_image *read_mask(const char *path)
{
    struct io_image *mask;
    assert_true(io_photo_read(path, IO_PHOTO_SRGB, NULL, &mask, NULL));
    assert_int_equal(mask->width_px, WIDTH);
    assert_int_equal(mask->height_px, HEIGHT);
    assert_int_equal(mask->channel_count, 3);
    return mask;
}

static int code_at(const struct io_image *image, int pixel, int channel)
{
    return (int)lround(255 * io_srgb_from_linear((double)image->pixels[3 * pixel + channel]));
}

static enum fit_use use_at(const struct io_image *mask, int pixel)
{
    for (int use = 0; use < FIT_USE_COUNT; use++) {
        bool is_alike = true;
        for (int c = 0; c < 3; c++)
            is_alike = is_alike && code_at(mask, pixel, c) == fit_use_colors[use][c];
        if (is_alike)
            return (enum fit_use)use;
    }
    fail_msg("pixel %d has no colour of a use", pixel);
    return FIT_USE_OK;
}

/* The mask, the JSON and the page's legend count the same, and all pixels. */
static void assert_counts(const char *page, const struct io_image *mask, const json_t *target)
{
    const json_t *const pixels = json_object_get(target, "pixels");
    int counts[FIT_USE_COUNT] = { 0 };
    json_int_t sum = 0;
    for (int i = 0; i < PIXEL_COUNT; i++)
        counts[use_at(mask, i)]++;
    for (int use = 0; use < FIT_USE_COUNT; use++) {
        char text[64];
        const json_int_t count = json_integer_value(json_object_get(pixels, fit_use_names[use]));
        assert_int_equal(count, counts[use]);
        sum += count;
        snprintf(text, sizeof text, "</svg>%s: %d, ", fit_use_names[use], counts[use]);
        if (count > 0)
            assert_has(page, text);
    }
    assert_int_equal(sum, PIXEL_COUNT);
}

/* Oracle: what is in the material file is in the page; and the scene drawn with what was found is the
 * picture, which was drawn with nearly the same: to 4 codes of 255, where a radiance off by 1 %, as both
 * drawings may be, is 1. */
static void a_rendered_picture_is_shown_beside_its_like(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    render_knot(&run);
    run_tool(&run, "fit", "knot.json", "knot.exr", "--start", "skin1", "-o", "found.json", "--report",
             "some/page", "--free", "exposure");
    assert_done(&run);
    assert_int_equal(count_entries("some/page"), 2);
    char *const page = read_page("some/page");
    json_t *const block = read_block("found.json");
    assert_has(page, "<title>knot.exr: Marble, fitted</title>");
    assert_has(page, "✓ Converged");
    assert_has_coefficients(page, block);
    assert_has_value(page, target_of(block, 0), "knot.exr", "exposure", "exposure", "exposure_ci95");
    assert_has(page, "R: sigma_a is known to ");
    assert_has(page, "The fit converged in ");
    assert_has(page, "knot.exr: of 160 × 120 pixels ");
    assert_has(page, "7 knot.exr exposure</th>");
    struct io_image *const mask = read_mask("some/page/knot.exr.mask.png");
    assert_counts(page, mask, target_of(block, 0));
    struct io_image *const target = picture_of(page, "Target"), *const model = picture_of(page, "Model");
    assert_int_equal(target->width_px, WIDTH);
    assert_int_equal(model->width_px, WIDTH);
    for (int i = 0; i < 3 * PIXEL_COUNT; i++) {
        if (use_at(mask, i / 3) == FIT_USE_OK)
            assert_in_range(code_at(model, i / 3, i % 3) - code_at(target, i / 3, i % 3) + 4, 0, 8);
    }
    io_image_destroy(mask);
    io_image_destroy(target);
    io_image_destroy(model);
    io_image_destroy(picture_of(page, "(model - target) / target"));
    io_image_destroy(picture_of(page, "Use of the pixels"));
    io_image_destroy(picture_of(page, "B: (model - target) / target"));
    assert_int_equal(count_of(page, "95 % band"), 3);
    assert_has(page, ">start ");
    json_decref(block);
    free(page);
    free(run.out);
}

enum { JUNK_SIDE = 6 };

static bool is_all_used(const struct io_image *mask, int corner)
{
    bool is_all = corner % WIDTH + JUNK_SIDE <= WIDTH && corner / WIDTH + JUNK_SIDE <= HEIGHT;
    for (int i = 0; is_all && i < JUNK_SIDE * JUNK_SIDE; i++)
        is_all = use_at(mask, corner + i / JUNK_SIDE * WIDTH + i % JUNK_SIDE) == FIT_USE_OK;
    return is_all;
}

/* A lamp that is mirrored: pixels two to four times too bright in the first square of the picture all of
 * which is used; no two alike, or they would be taken for clipped. */
static void paint_junk(const struct io_image *mask, bool painted[PIXEL_COUNT])
{
    struct io_image *image;
    struct rng rng = { .seed = 11 };
    int corner = 0;
    assert_true(io_exr_read("knot.exr", &image, NULL));
    while (corner < PIXEL_COUNT && !is_all_used(mask, corner))
        corner++;
    assert_true(corner < PIXEL_COUNT);
    memset(painted, 0, PIXEL_COUNT * sizeof *painted);
    for (int i = 0; i < JUNK_SIDE * JUNK_SIDE; i++) {
        const int at = corner + i / JUNK_SIDE * WIDTH + i % JUNK_SIDE;
        painted[at] = true;
        for (int c = 0; c < 3; c++)
            image->pixels[at * image->channel_count + c] *= (float)log_uniform(&rng, 2, 4);
    }
    assert_true(io_exr_write("junk.exr", image, false, NULL));
    io_image_destroy(image);
}

/* Oracle: the mask calls those pixels outliers that junk was painted onto, and no others but those few that
 * are farther off than the rest in the picture without junk, too. */
static void junk_in_a_picture_is_shown_as_such(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    bool painted[PIXEL_COUNT];
    render_knot(&run);
    run_tool(&run, "fit", "knot.json", "knot.exr", "-o", "found.json", "--report", "clean");
    assert_done(&run);
    struct io_image *const clean = read_mask("clean/knot.exr.mask.png");
    paint_junk(clean, painted);
    run_tool(&run, "fit", "knot.json", "junk.exr", "-o", "found.json", "--report", "page");
    assert_done(&run);
    char *const page = read_page("page");
    json_t *const block = read_block("found.json");
    struct io_image *const mask = read_mask("page/junk.exr.mask.png");
    int outlier_count = 0, clean_count = 0;
    for (int i = 0; i < PIXEL_COUNT; i++) {
        const bool is_outlier = use_at(mask, i) == FIT_USE_OUTLIER,
                   was_outlier = use_at(clean, i) == FIT_USE_OUTLIER;
        assert_true(painted[i] ? is_outlier : !is_outlier || was_outlier);
        outlier_count += is_outlier;
        clean_count += was_outlier;
    }
    assert_true(clean_count <= 4); /* of 2000 */
    assert_counts(page, mask, target_of(block, 0));
    char text[128];
    snprintf(text, sizeof text, "and %d of those fitted to were given no weight", outlier_count);
    assert_has(page, text);
    snprintf(text, sizeof text, ", %d outlier)", outlier_count);
    assert_has(run.out, text);
    io_image_destroy(clean);
    io_image_destroy(mask);
    json_decref(block);
    free(page);
    free(run.out);
}

/* ---- profiles ---------------------------------------------------------------------------------------- */

/* The dipole's own profile with noise of 1 %, at 40 distances. */
static void write_profile(const char *path, double sigma_a_per_mm, double sigma_s_prime_per_mm)
{
    const dipole_medium medium = { .sigma_a_per_mm = sigma_a_per_mm,
                                   .sigma_s_prime_per_mm = sigma_s_prime_per_mm,
                                   .eta = 1.3 };
    dipole_coefficients coefficients;
    struct rng rng = { .seed = 3 };
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
    fprintf(file, "r_mm,rd_per_mm2,sem\n");
    for (int i = 0; i < 40; i++) {
        const double r_mm = 0.1 * pow(100, i / 39.0), rd = dipole_rd_per_mm2(&coefficients, r_mm);
        fprintf(file, "%.9g,%.9g,%.9g\n", r_mm, rd * log_uniform(&rng, 0.985, 1.015), 0.01 * rd);
    }
    assert_int_equal(fclose(file), 0);
}

/* Oracle: what is in the material file is in the page; measured points and what they leave are drawn. */
static void a_profile_is_shown_over_what_was_measured(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_profile("skin.csv", 0.03, 0.7);
    run_tool(&run, "fit", "--profile", "skin.csv", "--eta", "1.3", "--model", "dipole", "-o", "found.json",
             "--report", "page");
    assert_done(&run);
    assert_int_equal(count_entries("page"), 1);
    char *const page = read_page("page");
    json_t *const block = read_block("found.json");
    assert_has(page, "<title>skin.csv: profile, fitted</title>");
    assert_has_coefficients(page, block);
    assert_has(page, "skin.csv: 40 values were fitted to.");
    assert_has(page, "residual in %");
    assert_int_equal(count_of(page, ">measured<"), 2); /* in each of the two charts' legends */
    assert_null(strstr(page, "<h2>Pictures</h2>"));
    json_decref(block);
    free(page);
    free(run.out);
}

/* Oracle: three profiles are three charts, each of its channel; a beam model cannot follow a dipole's
 * profile, and the page says so. */
static void a_wrong_model_is_told_from_noise(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_profile("r.csv", 0.03, 0.7);
    write_profile("g.csv", 0.1, 0.9);
    write_profile("b.csv", 0.2, 1.1);
    run_tool(&run, "fit", "--profile", "r.csv", "--profile", "g.csv", "--profile", "b.csv", "--eta", "1.3",
             "--model", "beam", "-o", "found.json", "--report", "page");
    assert_int_equal(run.exit_code, 0);
    char *const page = read_page("page");
    json_t *const block = read_block("found.json");
    assert_has_coefficients(page, block);
    assert_has(page, "<title>r.csv and 2 more: profile, fitted</title>");
    assert_has(page, "R: r.csv</text>");
    assert_has(page, "G: g.csv</text>");
    assert_has(page, "B: b.csv</text>");
    assert_has(page, "The model does not describe the target: beyond noise it is off by ");
    json_decref(block);
    free(page);
    free(run.out);
}

/* ---- files ------------------------------------------------------------------------------------------- */

/* Oracle: one line that says what is wrong, exit code 1, no material and nothing else written. */
static void a_refused_folder_ends_before_the_fit(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_profile("skin.csv", 0.03, 0.7);
    run_tool(&run, "fit", "--profile", "skin.csv", "--eta", "1.3", "-o", "found.json", "--report",
             "skin.csv");
    assert_failed(&run, 1, "fit: skin.csv: cannot be made: Not a directory\n");
    run_tool(&run, "fit", "--profile", "skin.csv", "--eta", "1.3", "-o", "found.json", "--report",
             "skin.csv/page");
    assert_int_equal(run.exit_code, 1);
    run_tool(&run, "fit", "--profile", "none.csv", "--eta", "1.3", "-o", "found.json", "--report", "page");
    assert_int_equal(run.exit_code, 1);
    assert_int_equal(count_entries("."), 1);
    free(run.out);
}

/* Remove the one thing that may differ: how long it took. */
static void cut_time(char *page)
{
    char *const from = strstr(page, "<dt>time</dt>");
    assert_non_null(from);
    const char *const to = strstr(from, "</dd>");
    assert_non_null(to);
    memmove(from, to, strlen(to) + 1);
}

/* Oracle: same input, same bytes. */
static void the_same_input_gives_the_same_page(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    render_knot(&run);
    run_tool(&run, "fit", "knot.json", "knot.exr", "-o", "found.json", "--report", "a");
    assert_done(&run);
    run_tool(&run, "fit", "knot.json", "knot.exr", "-o", "found.json", "--report", "b");
    assert_done(&run);
    char *const a = read_page("a"), *const b = read_page("b");
    cut_time(a);
    cut_time(b);
    assert_true(strcmp(a, b) == 0); /* a message of half a megabyte helps nobody */
    free(a);
    free(b);
    free(run.out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(a_rendered_picture_is_shown_beside_its_like),
        tool_test(junk_in_a_picture_is_shown_as_such),
        tool_test(a_profile_is_shown_over_what_was_measured),
        tool_test(a_wrong_model_is_told_from_noise),
        tool_test(a_refused_folder_ends_before_the_fit),
        tool_test(the_same_input_gives_the_same_page),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
