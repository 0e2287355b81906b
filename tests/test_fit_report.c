#include "tests/page_check.h"

#include "fit/report.h"
#include "fit/report_color.h"
#include "fit/report_page.h"

#include <dirent.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- an example ---------------------------------------------------------------------------------------
 */

enum { WIDTH = 192, HEIGHT = 144, CURVE_COUNT = 120, MEASURED_COUNT = 24, PARAMETER_COUNT = 7 };

/* All that a report points to. */
struct example {
    struct io_image *image, *model;
    unsigned char uses[WIDTH * HEIGHT];
    struct fit_report_picture picture;
    double r_mm[CURVE_COUNT], rd[3][CURVE_COUNT], low[3][CURVE_COUNT], high[3][CURVE_COUNT];
    double measured_r_mm[MEASURED_COUNT], measured[MEASURED_COUNT], sem[MEASURED_COUNT];
    struct fit_report_profile profiles[3];
    double sums[3][25];
    struct fit_report_search searches[3];
    double correlations[PARAMETER_COUNT * PARAMETER_COUNT];
    struct fit_report report;
};

static const struct fit_report_value example_values[] = {
    { "R", "sigma_a", "1/mm", 0.0321987, { 0.0301, 0.0343 }, "" },
    { "R", "sigma_s'", "1/mm", 0.7412345, { 0.7399, 0.7426 }, "" },
    { "G", "sigma_a", "1/mm", 1.23456e-5, { 2.1e-6, 7.3e-5 }, "hardly told from 0" },
    { "G", "sigma_s'", "1/mm", 123.456, { 100.2, 151.9 }, "" },
    { "B", "sigma_a", "1/mm", 0.1, { 0, INFINITY }, "the target does not tell" },
    { "B", "sigma_s'", "1/mm", NAN, { NAN, NAN }, "" },
    { "knot.exr", "exposure", "", 1.00213, { 1.0018, 1.0025 }, "" },
};

static const char *const example_notes[] = { "The light's size was taken from the scene.",
                                             "1 % of uncertain exposure is taken into the intervals." };
static const char *const example_names[PARAMETER_COUNT] = { "R sigma_a",  "R sigma_s'", "G sigma_a",
                                                            "G sigma_s'", "B sigma_a",  "B sigma_s'",
                                                            "exposure" };

/* A ball lit from the upper left, with noise, the model's light somewhat softer. */
static void example_draw(struct example *example)
{
    static const float tint[3] = { 0.9f, 0.55f, 0.4f };
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const double x = (i % WIDTH - 96) / 64.0, y = (i / WIDTH - 72) / 64.0, rr = x * x + y * y;
        float *const target = example->image->pixels + 4 * i, *const model = example->model->pixels + 3 * i;
        const bool is_ball = rr < 1;
        const double z = is_ball ? sqrt(1 - rr) : 0, light = fmax(0.5 * (z - x - y) / 0.9, 0.0);
        const double shine = pow(fmax(0.8 * z - 0.45 * (x + y), 0), 60);
        for (int c = 0; c < 3; c++) {
            target[c] =
                is_ball ? (float)(0.02 * tint[c] * (light + 0.1) * uniform(&rng, 0.97, 1.03) + 0.03 * shine)
                        : 0.001f;
            model[c] = is_ball ? (float)(0.02 * tint[c] * (0.98 * light + 0.105)) : NAN;
        }
        target[3] = is_ball;
        example->uses[i] = (unsigned char)(!is_ball        ? FIT_USE_NOT_COVERED
                                           : rr > 0.97     ? FIT_USE_SHADOW_EDGE
                                           : shine > 0.03  ? FIT_USE_SPECULAR
                                           : light < 0.005 ? FIT_USE_DARK
                                           : i % 997 == 0  ? FIT_USE_OUTLIER
                                                           : FIT_USE_OK);
    }
}

static void example_profiles(struct example *example)
{
    static const char *const names[3] = { "R", "G", "B" };
    struct rng rng = { .seed = 6 };
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < CURVE_COUNT; i++) {
            const double r = 0.05 * pow(400, i / (CURVE_COUNT - 1.0));
            example->r_mm[i] = r;
            example->rd[c][i] = exp(-(0.2 + 0.3 * c) * r) / (2 + 8 * r * r);
            example->low[c][i] = example->rd[c][i] * (1 - 0.02 * r);
            example->high[c][i] = example->rd[c][i] * (1 + 0.02 * r);
        }
        example->profiles[c] = (struct fit_report_profile){ .name = names[c],
                                                            .count = CURVE_COUNT,
                                                            .r_mm = example->r_mm,
                                                            .rd_per_mm2 = example->rd[c],
                                                            .low_per_mm2 = example->low[c],
                                                            .high_per_mm2 = example->high[c] };
    }
    for (int i = 0; i < MEASURED_COUNT; i++) {
        const double r = 0.2 + 0.6 * i, rd = exp(-0.2 * r) / (2 + 8 * r * r);
        example->measured_r_mm[i] = r;
        example->sem[i] = 0.03 * rd + 3e-6;
        example->measured[i] = rd + example->sem[i] * uniform(&rng, -1.8, 1.8);
    }
    example->profiles[0].measured_count = MEASURED_COUNT;
    example->profiles[0].measured_r_mm = example->measured_r_mm;
    example->profiles[0].measured_rd_per_mm2 = example->measured;
    example->profiles[0].measured_sem_per_mm2 = example->sem;
}

static void example_searches(struct example *example)
{
    static const char *const names[3] = { "round 1, start 1", "round 1, start 2", "round 2" };
    for (int s = 0; s < 3; s++) {
        for (int i = 0; i < 25; i++)
            example->sums[s][i] = (1 + s) * 30 * exp(-0.5 * i) + 0.04 / (1 + s);
        example->searches[s] =
            (struct fit_report_search){ names[s], (size_t)(25 - 5 * s), example->sums[s], false };
    }
    for (int i = 0; i < PARAMETER_COUNT; i++)
        for (int k = 0; k < PARAMETER_COUNT; k++)
            example->correlations[i * PARAMETER_COUNT + k] =
                i == k             ? 1
                : i == 5 || k == 5 ? NAN
                                   : cos(1.1 * (i + k)) * exp(-0.3 * abs(i - k));
}

static struct example *example_create(void)
{
    struct example *const example = calloc(1, sizeof *example);
    assert_non_null(example);
    assert_true(io_image_create(WIDTH, HEIGHT, 4, &example->image, NULL));
    assert_true(io_image_create(WIDTH, HEIGHT, 3, &example->model, NULL));
    example_draw(example);
    example_profiles(example);
    example_searches(example);
    example->picture = (struct fit_report_picture){
        .name = "ball.exr", .image = example->image, .model = example->model, .uses = example->uses
    };
    example->report = (struct fit_report){
        .title = "ball.exr: marble, fitted",
        .verdict = "The target tells sigma_a and sigma_s' of red to a few percent. Green's absorption is "
                   "hardly told from 0.",
        .model = "beam",
        .has_converged = true,
        .seconds = 12.3456,
        .rms_residual = 0.01789,
        .value_count = sizeof example_values / sizeof example_values[0],
        .values = example_values,
        .picture_count = 1,
        .pictures = &example->picture,
        .profile_count = 3,
        .profiles = example->profiles,
        .search_count = 3,
        .searches = example->searches,
        .note_count = 2,
        .notes = example_notes,
        .correlation_count = PARAMETER_COUNT,
        .correlation_names = example_names,
        .correlations = example->correlations,
    };
    return example;
}

static void example_destroy(struct example *example)
{
    io_image_destroy(example->image);
    io_image_destroy(example->model);
    free(example);
}

/* ---- reading a page -----------------------------------------------------------------------------------
 */

static void folder_empty(const char *path)
{
    DIR *const folder = opendir(path);
    if (!folder)
        return;
    char name[4096];
    for (const struct dirent *entry; (entry = readdir(folder));) {
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            assert_int_equal(remove(name), 0);
    }
    closedir(folder);
}

static size_t folder_count(const char *path)
{
    DIR *const folder = opendir(path);
    size_t count = 0;
    while (folder && readdir(folder))
        count++;
    if (folder)
        closedir(folder);
    return folder ? count - 2 : 0; /* . and .. */
}

/* Write a report, check what must hold of every page, and return it; the caller frees it. */
static char *page_of(const char *folder, const struct fit_report *report)
{
    folder_empty(folder);
    dipole_status status = { 0 };
    if (!fit_report_write(folder, report, &status))
        fail_msg("%s: %s", status.source, status.message);
    char path[256], *page;
    size_t size;
    snprintf(path, sizeof path, "%s/index.html", folder);
    assert_true(io_file_read(path, (size_t)1 << 30, &page, &size, &status));
    assert_int_equal(strlen(page), size);
    assert_page(page, size);
    return page;
}

/* ---- what a page says ---------------------------------------------------------------------------------
 */

/* Oracle: rounded by hand, to two digits of what is uncertain. */
static void numbers_have_the_digits_they_deserve(void **state)
{
    (void)state;
    static const struct {
        double value, distance;
        const char *text;
    } cases[] = {
        { 0.0321987, 0.0021, "0.0322" },
        { 0.7412345, 0.0013, "0.7412" },
        { 1.23456e-5, 1e-5, "1.2e-5" },
        { 123.456, 23.2, "123" },
        { 1234.5, 240, "1230" },
        { 0.05, 2, "0.050" },
        { 12345678, 1e6, "1.23e7" },
        { 999.96, 1, "1000" },
        { 0.000099996, 1e-6, "0.000100" },
        { -0.5, 0.01, "-0.500" },
        { 0.1, INFINITY, "0.10" },
        { 0, 0.1, "0" },
        { 3, NAN, "3.000" },
        { 3, 0, "3.00000" },
        { 5e-324, 5e-324, "4.9e-324" },
        { 1.7e308, 1e308, "1.7e308" },
        { INFINITY, 1, "∞" },
        { -INFINITY, 1, "−∞" },
        { NAN, NAN, "unknown" },
        { 2.0 / 3, 1e-12, "0.666667" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[FIT_NUMBER_SIZE];
        fit_number_format(cases[i].value, fit_number_digits(cases[i].value, cases[i].distance), text);
        assert_string_equal(text, cases[i].text);
    }
}

/* Oracle: everything that is in the report is found in the page. */
static void a_page_holds_what_was_found(void **state)
{
    (void)state;
    struct example *const example = example_create();
    char *const page = page_of("example", &example->report);
    assert_has(page, "<title>ball.exr: marble, fitted</title>");
    assert_has(page, "<h1>ball.exr: marble, fitted</h1>");
    assert_has(page, example->report.verdict);
    assert_has(page, "✓ Converged");
    assert_has(page, "<dt>model</dt><dd>beam</dd>");
    assert_has(page, "<dd>12.3 s</dd>");
    assert_has(page, "<dd>1.79 %</dd>");
    assert_has(page, "<td>R</td><td>sigma_a</td><td class=\"number\"><b>0.0322</b></td><td>1/mm</td>"
                     "<td class=\"number\">0.0301</td><td class=\"number\">0.0343</td>"
                     "<td class=\"number\">6.5</td>");
    assert_has(page, "<b>1.2e-5</b>");
    assert_has(page, "<td class=\"number\">2.1e-6</td><td class=\"number\">7.3e-5</td>");
    assert_has(page, "<td class=\"note\">hardly told from 0</td>");
    assert_has(page, "<b>0.10</b></td><td>1/mm</td><td class=\"number\">0</td><td class=\"number\">∞</td>");
    assert_has(page, "<b>unknown</b>");
    assert_has(page, "<td>knot.exr</td><td>exposure</td><td class=\"number\"><b>1.00213</b>");
    for (size_t i = 0; i < 2; i++)
        assert_has(page, example_notes[i]);
    for (size_t i = 0; i < 3; i++)
        assert_has(page, example->searches[i].name);
    assert_has(page, "<th>2 R sigma_s'</th>");
    assert_has(page, ">-0.73</td>");
    assert_has(page, ">–</td>");
    assert_int_equal(count_of(page, "<div class=\"plot\"><svg"), 5);
    free(page);

    example->report.has_converged = false;
    char *const other = page_of("not_converged", &example->report);
    assert_has(other, "✗ Not converged");
    assert_null(strstr(other, "✓"));
    free(other);
    example_destroy(example);
}

/* Oracle: the uses counted here. */
static void the_mask_is_counted_and_coloured(void **state)
{
    (void)state;
    struct example *const example = example_create();
    char *const page = page_of("mask", &example->report);
    struct io_image *const shown = picture_of(page, "Use of the pixels");
    struct io_image *written;
    assert_true(io_photo_read("mask/ball.exr.mask.png", IO_PHOTO_SRGB, NULL, &written, NULL));
    int counts[FIT_USE_COUNT] = { 0 };
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        counts[example->uses[i]]++;
        assert_color(shown, i % WIDTH, i / WIDTH, fit_use_colors[example->uses[i]]);
        assert_color(written, i % WIDTH, i / WIDTH, fit_use_colors[example->uses[i]]);
    }
    for (int i = 0; i < FIT_USE_COUNT; i++) {
        char row[128], name[64];
        snprintf(name, sizeof name, "</svg>%s: ", fit_use_names[i]);
        snprintf(row, sizeof row, "%s%d, ", name, counts[i]);
        assert_true((strstr(page, counts[i] > 0 ? row : name) != NULL) == (counts[i] > 0));
    }
    assert_true(counts[FIT_USE_OK] > 0 && counts[FIT_USE_OUTLIER] > 0 && counts[FIT_USE_CLIPPED] == 0);
    io_image_destroy(shown);
    io_image_destroy(written);
    free(page);
    example_destroy(example);
}

/* Oracle: a picture of a few values whose colours are known: no difference is white, brighter is red,
 * darker blue, not used grey; target and model have the code of 0.8 where the target is brightest. */
static void pictures_have_the_colours_of_their_values(void **state)
{
    (void)state;
    struct example *const example = example_create();
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        for (int c = 0; c < 3; c++) {
            const int x = i % WIDTH;
            example->image->pixels[4 * i + c] = 0.25f;
            example->model->pixels[3 * i + c] = x < 48 ? 0.25f : x < 96 ? 0.5f : x < 144 ? 0.125f : 4.0f;
            example->uses[i] = x < 144 ? FIT_USE_OK : FIT_USE_MASKED;
        }
    char *const page = page_of("colours", &example->report);
    static const unsigned char white[3] = { 255, 255, 255 }, red[3] = { 170, 60, 56 },
                               half_blue[3] = { 136, 176, 219 }, grey[3] = { 150, 150, 150 },
                               level[3] = { 231, 231, 231 }; /* 0.8 in sRGB is 0.906 */
    static const char *const names[4] = { "(model - target) / target", "R: (model - target) / target",
                                          "G: (model - target) / target", "B: (model - target) / target" };
    for (int k = 0; k < 4; k++) {
        struct io_image *const difference = picture_of(page, names[k]);
        assert_color(difference, 10, 5, white);
        assert_color(difference, 70, 100, red);
        assert_color(difference, 120, 143, half_blue);
        assert_color(difference, 191, 0, grey);
        io_image_destroy(difference);
    }
    assert_has(page, "<span>-100\xc2\xa0%</span><span>0</span><span>+100\xc2\xa0%</span>");
    assert_has(page, "Mean: R +17\xc2\xa0%, G +17\xc2\xa0%, B +17\xc2\xa0%.");
    assert_has(page, "192 × 144 pixels, times 3.20, as sRGB.");
    struct io_image *const target = picture_of(page, "Target"), *const model = picture_of(page, "Model");
    assert_color(target, 10, 5, level);
    assert_color(target, 180, 5, level);
    assert_color(model, 10, 5, level);
    assert_color(model, 70, 5, white);
    io_image_destroy(target);
    io_image_destroy(model);
    struct io_image *const scale = picture_of(page, "blue, white, red");
    static const unsigned char blue[3] = { 16, 96, 182 };
    assert_color(scale, 0, 0, blue);
    assert_color(scale, 50, 0, white);
    assert_color(scale, 100, 0, red);
    io_image_destroy(scale);
    free(page);
    example_destroy(example);
}

/* ---- plots --------------------------------------------------------------------------------------------
 */

/* The plot of this number in a page, up to the end of the page. */
static const char *plot_of(const char *page, int number)
{
    const char *svg = page;
    for (int i = 0; i <= number; i++) {
        svg = strstr(svg + 1, "<div class=\"plot\">");
        assert_non_null(svg);
    }
    return svg;
}

/* Oracle: between the points of a power law, what is measured 10 % above it stands at 10 % on an axis that
 * reaches a tenth beyond, and its bars of 5 % end at 5 and 15 %. Positions in SVG are rounded to 0.01 px.
 */
static void residuals_stand_where_they_belong(void **state)
{
    (void)state;
    enum { COUNT = 5 };
    static const double r_mm[COUNT] = { 0.1, 0.7, 1.3, 8, 20 };
    double rd[COUNT], measured_r_mm[COUNT - 1], measured[COUNT - 1], sem[COUNT - 1];
    for (int i = 0; i < COUNT; i++)
        rd[i] = 0.02 / (r_mm[i] * r_mm[i]);
    for (int i = 0; i < COUNT - 1; i++) {
        measured_r_mm[i] = 0.4 * r_mm[i] + 0.6 * r_mm[i + 1];
        measured[i] = 1.1 * 0.02 / (measured_r_mm[i] * measured_r_mm[i]);
        sem[i] = measured[i] / 22;
    }
    const struct fit_report_profile profile = { "skin.csv", COUNT,     r_mm,          rd,       rd,
                                                rd,         COUNT - 1, measured_r_mm, measured, sem };
    const struct fit_report report = {
        .title = "", .verdict = "", .model = "", .profile_count = 1, .profiles = &profile
    };
    char *const page = page_of("residuals", &report);
    const char *const svg = plot_of(page, 1);
    double left, top, bottom, right, y, low, high;
    const char *const frame = strstr(svg, "stroke=\"#444444\" stroke-width=\"1.2\" d=\"M");
    assert_non_null(frame);
    assert_int_equal(sscanf(strstr(frame, "d=\"M"), "d=\"M%lf %lfV%lfH%lf", &left, &top, &bottom, &right),
                     4);
    const char *at = svg;
    for (int i = 0; i < COUNT - 1; i++) {
        at = strstr(at, "<path stroke=\"#666666\"");
        assert_non_null(at);
        assert_int_equal(sscanf(strstr(at, "d=\"M"), "d=\"M%*f %lfV%lf", &low, &high), 2);
        at = strstr(at, "<circle ");
        assert_non_null(at);
        assert_int_equal(sscanf(strstr(at, "cy="), "cy=\"%lf", &y), 1);
        assert_true(fabs(y - (bottom - (10 + 11) / 22.0 * (bottom - top))) < 0.011);
        assert_true(fabs(low - (bottom - (5 + 11) / 22.0 * (bottom - top))) < 0.011);
        assert_true(fabs(high - (bottom - (15 + 11) / 22.0 * (bottom - top))) < 0.011);
    }
    free(page);
}

/* Oracle: the thick line, and no other, ends lowest, with the last value of its search. */
static void the_best_search_stands_out(void **state)
{
    (void)state;
    struct example *const example = example_create();
    char *const page = page_of("searches", &example->report);
    const char *const svg = plot_of(page, 4);
    double ends[3];
    bool is_thick[3];
    const char *at = svg;
    for (int i = 0; i < 3; i++) {
        at = strstr(at + 1, "stroke-linejoin");
        assert_non_null(at);
        is_thick[i] = strncmp(at - 6, "\"2.4\" ", 6) == 0;
        const char *const end = strstr(at, "\"/>"), *last = end;
        while (*last != 'L')
            last--;
        assert_int_equal(sscanf(last, "L%*f %lf", &ends[i]), 1);
        assert_int_equal(count_of(at, "L") - count_of(end, "L"), example->searches[i].count - 1);
    }
    assert_true(!is_thick[0] && is_thick[1] && !is_thick[2]);
    assert_true(ends[1] > ends[0] && ends[1] > ends[2]); /* y runs down */
    assert_has(page, "The thick line is the search that ended lowest, of 3.");
    assert_null(strstr(page, "do not compare"));
    free(page);
    example_destroy(example);
}

/* Oracle: a search that ends lower only by its weights is not the thick line, nor counted with the others.
 */
static void searches_under_other_weights_do_not_compare(void **state)
{
    (void)state;
    struct example *const example = example_create();
    example->searches[1].is_reweighed = true;
    char *const page = page_of("weights", &example->report);
    const char *at = plot_of(page, 4);
    int thick_count = 0;
    for (int i = 0; i < 3; i++) {
        at = strstr(at + 1, "stroke-linejoin");
        assert_non_null(at);
        const bool is_thick = strncmp(at - 6, "\"2.4\" ", 6) == 0;
        thick_count += is_thick;
        assert_true(i != 1 || !is_thick);
    }
    assert_int_equal(thick_count, 1);
    assert_has(page, "The thick line is the search that ended lowest, of 2. The lines called weights");
    free(page);
    example_destroy(example);
}

/* ---- hostile reports ----------------------------------------------------------------------------------
 */

/* Oracle: as text in the page, names are what they were, with what HTML and XML need escaped; page_of() has
 * checked that no markup came of them. Files stay in their folder, each picture's apart. */
static void hostile_names_are_text(void **state)
{
    (void)state;
    static const char name[] = "../<script>alert(\"1\")</script>&amp;'\xff\x01.exr";
    static const char escaped[] = "../&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&amp;amp;'"
                                  "\xef\xbf\xbd\xef\xbf\xbd.exr";
    struct example *const example = example_create();
    struct fit_report *const report = &example->report;
    const struct fit_report_value value = { name, name, name, 1, { 0.9, 1.1 }, name };
    char long_name[1000];
    memset(long_name, 'x', sizeof long_name - 1);
    long_name[sizeof long_name - 1] = '\0';
    const char *const picture_names[6] = { name, "a/b", "a_b", "a/b", "", long_name };
    struct fit_report_picture pictures[6];
    for (int i = 0; i < 6; i++) {
        pictures[i] = example->picture;
        pictures[i].name = picture_names[i];
    }
    const char *names[PARAMETER_COUNT];
    for (int i = 0; i < PARAMETER_COUNT; i++)
        names[i] = name;
    report->title = report->verdict = report->model = name;
    report->values = &value;
    report->value_count = 1;
    report->pictures = pictures;
    report->picture_count = 6;
    report->notes = names;
    report->correlation_names = names;
    for (int i = 0; i < 3; i++)
        example->profiles[i].name = example->searches[i].name = name;
    char *const page = page_of("hostile", report);
    assert_int_equal(count_of(page, "alert("), count_of(page, "&lt;script&gt;alert(&quot;1&quot;)"));
    assert_true(count_of(page, escaped) >= 16);
    free(page);
    static const char *const files[] = { ".._<script>alert(\"1\")<_script>&amp;'\xff_.exr.mask.png",
                                         "a_b.mask.png", "a_b-2.mask.png", "a_b-3.mask.png", ".mask.png" };
    char path[512];
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        snprintf(path, sizeof path, "hostile/%s", files[i]);
        assert_int_equal(access(path, F_OK), 0);
    }
    assert_int_equal(folder_count("hostile"), 7);
    example_destroy(example);
}

/* Oracle: a page, with its pictures and plots, whatever the values. */
static void values_that_are_none_break_nothing(void **state)
{
    (void)state;
    static const double wild[] = { NAN, INFINITY, -INFINITY, 0, -1, 1e300, -1e-300, 5e-324, 1 };
    struct rng rng = { .seed = 9 };
    for (int k = 0; k < 20; k++) {
        struct example *const example = example_create();
        struct fit_report *const report = &example->report;
#define WILD() wild[random_bits(&rng) % (sizeof wild / sizeof wild[0])]
        struct fit_report_value value = { "R", "sigma_a", "1/mm", WILD(), { WILD(), WILD() }, "" };
        report->values = &value;
        report->value_count = 1;
        report->seconds = WILD();
        report->rms_residual = WILD();
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            example->uses[i] = FIT_USE_OK;
            for (int c = 0; c < 3; c++) {
                example->image->pixels[4 * i + c] = k < 10 ? (float)WILD() : 3e38f;
                example->model->pixels[3 * i + c] = k < 10 ? (float)WILD() : -3e38f;
            }
        }
        for (int i = 0; i < CURVE_COUNT; i++)
            example->r_mm[i] = example->rd[0][i] = example->low[1][i] = example->high[2][i] = WILD();
        for (int i = 0; i < MEASURED_COUNT; i++)
            example->measured[i] = example->measured_r_mm[i] = example->sem[i] = WILD();
        for (int i = 0; i < 25; i++)
            example->sums[k % 3][i] = WILD();
        for (int i = 0; i < PARAMETER_COUNT * PARAMETER_COUNT; i++)
            example->correlations[i] = WILD();
        char *const page = page_of("wild", report);
        static const char *const slips[] = { "\"nan", " nan", ">nan", "-nan",
                                             "\"inf", " inf", ">inf", "-inf" };
        for (size_t i = 0; i < sizeof slips / sizeof slips[0]; i++)
            assert_null(strstr(page, slips[i]));
        io_image_destroy(picture_of(page, "(model - target) / target"));
        for (const char *svg = page; (svg = strstr(svg, "<div class=\"plot\">"));) {
            svg += strlen("<div class=\"plot\">");
            const char *const end = strstr(svg, "</div>");
            char *const copy = strndup(svg, (size_t)(end - svg));
            assert_drawable(copy);
            free(copy);
        }
        free(page);
        example_destroy(example);
    }
}

/* Oracle: a report of nothing is a page, too. */
static void an_empty_report_is_a_page(void **state)
{
    (void)state;
    const struct fit_report report = { .title = "", .verdict = "", .model = "" };
    free(page_of("empty", &report));
    assert_int_equal(folder_count("empty"), 1);
}

/* Oracle: the smallest and a large photograph; the page shows the large one in boxes of 4 x 4, the mask's
 * file all of it. */
static void pictures_may_be_small_or_large(void **state)
{
    (void)state;
    static const int sizes[2][4] = { { 1, 1, 1, 1 }, { 4000, 3000, 1000, 750 } };
    for (int k = 0; k < 2; k++) {
        struct example *const example = example_create();
        const size_t count = (size_t)sizes[k][0] * (size_t)sizes[k][1];
        unsigned char *const uses = calloc(count, 1);
        struct io_image *image, *model;
        assert_true(io_image_create(sizes[k][0], sizes[k][1], 3, &image, NULL));
        assert_true(io_image_create(sizes[k][0], sizes[k][1], 3, &model, NULL));
        for (size_t i = 0; i < 3 * count; i++) {
            image->pixels[i] = (float)(i % 3 + 1);
            model->pixels[i] = 1.5f * (float)(i % 3 + 1);
        }
        example->picture =
            (struct fit_report_picture){ .name = "size", .image = image, .model = model, .uses = uses };
        char *const page = page_of("size", &example->report);
        static const unsigned char red[3] = { 170, 60, 56 }, white[3] = { 255, 255, 255 };
        struct io_image *const difference = picture_of(page, "(model - target) / target");
        assert_int_equal(difference->width_px, sizes[k][2]);
        assert_int_equal(difference->height_px, sizes[k][3]);
        assert_color(difference, sizes[k][2] - 1, sizes[k][3] - 1, red);
        io_image_destroy(difference);
        struct io_image *mask;
        assert_true(io_photo_read("size/size.mask.png", IO_PHOTO_SRGB, NULL, &mask, NULL));
        assert_int_equal(mask->width_px, sizes[k][0]);
        assert_int_equal(mask->height_px, sizes[k][1]);
        assert_color(mask, sizes[k][0] - 1, sizes[k][1] - 1, white);
        io_image_destroy(mask);
        io_image_destroy(image);
        io_image_destroy(model);
        free(page);
        free(uses);
        example_destroy(example);
    }
}

/* Oracle: a hundred thousand points, and a hundred parameters, make a page of at most a few megabytes; of
 * the parameters the pairs stand first whose correlation is largest. */
static void long_lists_are_cut(void **state)
{
    (void)state;
    enum { COUNT = 100000, MANY = 100 };
    struct example *const example = example_create();
    double *const values = malloc(COUNT * sizeof *values);
    double *const correlations = calloc(MANY * MANY, sizeof *correlations);
    char names[MANY][16];
    const char *name_list[MANY];
    for (int i = 0; i < COUNT; i++)
        values[i] = i + 1;
    for (int i = 0; i < MANY; i++) {
        snprintf(names[i], sizeof names[i], "p%d", i);
        name_list[i] = names[i];
        for (int k = 0; k < MANY; k++)
            correlations[i * MANY + k] = i == k ? 1 : -(i + k) / 250.0;
    }
    example->profiles[1] = (struct fit_report_profile){ .name = "long",
                                                        .count = COUNT,
                                                        .r_mm = values,
                                                        .rd_per_mm2 = values,
                                                        .low_per_mm2 = values,
                                                        .high_per_mm2 = values,
                                                        .measured_count = COUNT,
                                                        .measured_r_mm = values,
                                                        .measured_rd_per_mm2 = values };
    example->searches[1] = (struct fit_report_search){ "long", COUNT, values, false };
    example->report.correlation_count = MANY;
    example->report.correlation_names = name_list;
    example->report.correlations = correlations;
    char *const page = page_of("long", &example->report);
    assert_true(strlen(page) < 2 << 20);
    assert_has(page, "Of 100000 measured points, 1000 are drawn. Residual: measured over found, less 1. No "
                     "standard errors were given.");
    assert_has(page, "Of 100 parameters");
    const char *const first = strstr(page, "<tr><th>p98</th><th>p99</th>");
    assert_non_null(first);
    assert_true(strstr(page, "<tr><th>p97</th><th>p99</th>") > first);
    assert_int_equal(count_of(page, "<tr><th>p"), 20);
    free(page);
    free(values);
    free(correlations);
    example_destroy(example);
}

/* ---- files --------------------------------------------------------------------------------------------
 */

/* Oracle: same report, same bytes; also where the decimal point is a comma, if such a locale is there. */
static void the_same_report_gives_the_same_bytes(void **state)
{
    (void)state;
    struct example *const example = example_create();
    char *const first = page_of("first", &example->report);
    setlocale(LC_ALL, "de_DE.UTF-8");
    char *const second = page_of("second", &example->report);
    setlocale(LC_ALL, "C");
    assert_string_equal(first, second);
    free(first);
    free(second);
    example_destroy(example);
}

/* Oracle: what cannot be written is named, and nothing new is there. */
static void what_cannot_be_written_leaves_nothing(void **state)
{
    (void)state;
    struct example *const example = example_create();
    dipole_status status;
    assert_true(io_file_write("file", "", 0, NULL));
    assert_false(fit_report_write("file/report", &example->report, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_string_equal(status.source, "file/report");
    assert_string_equal(status.message, "cannot be made: Not a directory");

    folder_empty("taken");
    assert_true(io_folder_make("taken/index.html", NULL));
    assert_false(fit_report_write("taken", &example->report, &status));
    assert_int_equal(status.code, DIPOLE_IO_FAILED);
    assert_string_equal(status.source, "taken/index.html");
    assert_int_equal(folder_count("taken"), 1);

    assert_false(fit_report_write("/proc/report", &example->report, &status));
    assert_string_equal(status.source, "/proc/report");
    char *const long_path = malloc(5000);
    memset(long_path, 'x', 4999);
    long_path[4999] = '\0';
    assert_false(fit_report_write(long_path, &example->report, &status));
    free(long_path);
    example_destroy(example);
}

/* Oracle: a report that contradicts itself is refused with what is wrong, before anything is made. */
static void what_contradicts_itself_is_refused(void **state)
{
    (void)state;
    struct example *const example = example_create();
    struct io_image *small;
    dipole_status status;
    assert_true(io_image_create(WIDTH, HEIGHT - 1, 3, &small, NULL));
    example->picture.model = small;
    assert_false(fit_report_write("refused", &example->report, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.source, "ball.exr");
    assert_string_equal(status.message, "has 192 x 144 pixels and its model 192 x 143, expected the same");
    io_image_destroy(small);
    assert_true(io_image_create(WIDTH, HEIGHT, 1, &small, NULL));
    example->picture.model = small;
    assert_false(fit_report_write("refused", &example->report, &status));
    assert_string_equal(status.message, "has 4 channels and its model 1, expected 3 or 4");
    io_image_destroy(small);
    example->picture.model = example->model;
    example->uses[77] = 200;
    assert_false(fit_report_write("refused", &example->report, &status));
    assert_string_equal(status.message, "use of pixel 77 is 200, expected 0 to 8");
    example->report.picture_count = 65;
    assert_false(fit_report_write("refused", &example->report, &status));
    assert_string_equal(status.message, "a report of 65 pictures, expected at most 64");
    assert_int_equal(access("refused", F_OK), -1);
    example_destroy(example);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_have_the_digits_they_deserve),
        cmocka_unit_test(a_page_holds_what_was_found),
        cmocka_unit_test(the_mask_is_counted_and_coloured),
        cmocka_unit_test(pictures_have_the_colours_of_their_values),
        cmocka_unit_test(residuals_stand_where_they_belong),
        cmocka_unit_test(the_best_search_stands_out),
        cmocka_unit_test(searches_under_other_weights_do_not_compare),
        cmocka_unit_test(hostile_names_are_text),
        cmocka_unit_test(values_that_are_none_break_nothing),
        cmocka_unit_test(an_empty_report_is_a_page),
        cmocka_unit_test(pictures_may_be_small_or_large),
        cmocka_unit_test(long_lists_are_cut),
        cmocka_unit_test(the_same_report_gives_the_same_bytes),
        cmocka_unit_test(what_cannot_be_written_leaves_nothing),
        cmocka_unit_test(what_contradicts_itself_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
