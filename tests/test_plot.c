#include "plot/axis.h"
#include "plot/plot.h"
#include "plot/text.h"
#include "tests/check.h"
#include "tests/svg_check.h"

#include <locale.h>
#include <stdlib.h>
#include <string.h>

/* ---- helpers ------------------------------------------------------------------------------------ */

static char *draw(const struct plot *plot)
{
    char *svg = NULL;
    size_t size = 0;
    dipole_status status = { 0 };
    assert_true(plot_svg_create(plot, &svg, &size, &status));
    assert_int_equal(strlen(svg), size);
    return svg;
}

static struct plot_range log_range(double min, double max)
{
    return (struct plot_range){ .scale = PLOT_LOG, .min = min, .max = max };
}

static void assert_label(const struct plot_ticks *ticks, size_t index, const char *base,
                         const char *exponent)
{
    struct plot_tick_label label;
    assert_true(index < ticks->count);
    plot_tick_label_init(ticks, &ticks->ticks[index], &label);
    assert_string_equal(label.base, base);
    assert_string_equal(label.exponent, exponent);
}

/* ---- axes --------------------------------------------------------------------------------------- */

/* Oracle: closed form; from 10^-3 to 10^2 there are 6 decades and 8 ticks between each two. */
static void log_axis_has_decades_and_minor_ticks(void **state)
{
    (void)state;
    const struct plot_range range = log_range(1e-3, 1e2);
    struct plot_ticks ticks;
    plot_ticks_place(&range, 8, &ticks);
    assert_int_equal(ticks.count, 6 + 5 * 8);
    for (size_t i = 0; i < ticks.count; i++) {
        const double value = (double)(i % 9 + 1) * pow(10, (double)(i / 9) - 3);
        assert_close(ticks.ticks[i].value, value, 1e-14, "tick %zu", i);
        assert_int_equal(ticks.ticks[i].has_label, i % 9 == 0);
    }
    assert_label(&ticks, 0, "10", "−3");
    assert_label(&ticks, 27, "10", "0");
    assert_label(&ticks, 45, "10", "2");
}

/* Oracle: closed form; 13 decades with room for 5 labels leave every third. */
static void long_log_axis_labels_every_third_decade(void **state)
{
    (void)state;
    const struct plot_range range = log_range(1e-12, 1);
    struct plot_ticks ticks;
    plot_ticks_place(&range, 5, &ticks);
    assert_int_equal(ticks.count, 13);
    for (size_t i = 0; i < ticks.count; i++)
        assert_int_equal(ticks.ticks[i].has_label, i % 3 == 0);
}

/* Oracle: closed form; under two decades 1, 2 and 5 carry labels, as decimals. */
static void short_log_axis_labels_one_two_five(void **state)
{
    (void)state;
    const struct plot_range range = log_range(0.02, 0.5);
    struct plot_ticks ticks;
    plot_ticks_place(&range, 6, &ticks);
    static const char *const labels[] = { "0.02", "0.05", "0.1", "0.2", "0.5" };
    size_t found = 0;
    for (size_t i = 0; i < ticks.count; i++)
        if (ticks.ticks[i].has_label)
            assert_label(&ticks, i, labels[found++], "");
    assert_int_equal(found, 5);
    const struct plot_range narrow = log_range(31, 32); /* no 1, 2, 5 inside: round steps */
    plot_ticks_place(&narrow, 6, &ticks);
    assert_int_equal(ticks.count, 6);
    assert_label(&ticks, 0, "31.0", "");
    assert_label(&ticks, 5, "32.0", "");
}

/* Oracle: closed form. */
static void linear_axis_has_round_steps(void **state)
{
    (void)state;
    struct plot_ticks ticks;
    plot_ticks_place(&(struct plot_range){ .min = -1, .max = 1 }, 5, &ticks);
    static const char *const labels[] = { "−1.0", "−0.5", "0", "0.5", "1.0" };
    assert_int_equal(ticks.count, 5);
    for (size_t i = 0; i < 5; i++)
        assert_label(&ticks, i, labels[i], "");
    plot_ticks_place(&(struct plot_range){ .min = 0, .max = 3e-7 }, 4, &ticks);
    assert_int_equal(ticks.count, 4);
    assert_label(&ticks, 3, "3×10", "−7");
    plot_ticks_place(&(struct plot_range){ .min = 0, .max = 15e6 }, 4, &ticks);
    assert_label(&ticks, 2, "10", "7");
    assert_label(&ticks, 3, "1.5×10", "7");
}

/* Oracle: a rounded range holds its values, wastes less than a step, and its ticks ascend inside it. */
static void rounded_ranges_hold_their_values(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 2000; i++) {
        const bool is_log = i % 2;
        double low = log_uniform(&rng, 1e-300, 1e300) * (is_log || i % 4 ? 1 : -1);
        double high = i % 7 == 0 ? low : low + fabs(low) * log_uniform(&rng, 1e-6, 1e6);
        const struct plot_range range = plot_range_round(is_log ? PLOT_LOG : PLOT_LINEAR, low, high);
        assert_true(isfinite(range.min) && isfinite(range.max) && range.min < range.max);
        if (fabs(low) > 1e-280 && fabs(high) < 1e280) {
            assert_true(range.min <= low + 1e-9 * fabs(high) && range.max >= high - 1e-9 * fabs(high));
            if (is_log)
                assert_true(range.min > low / 2.6 && range.max < high * 2.6);
        }
        struct plot_ticks ticks;
        plot_ticks_place(&range, 8, &ticks);
        assert_true(ticks.count < PLOT_TICK_LIMIT);
        for (size_t t = 0; t < ticks.count; t++) {
            const double position = plot_range_position(&range, ticks.ticks[t].value);
            assert_true(position > -1e-6 && position < 1 + 1e-6);
            assert_true(t == 0 || ticks.ticks[t].value > ticks.ticks[t - 1].value);
        }
    }
    assert_true(isnan(plot_range_position(&(struct plot_range){ PLOT_LOG, 1, 10 }, 0)));
    assert_true(isnan(plot_range_position(&(struct plot_range){ PLOT_LINEAR, 1, 10 }, INFINITY)));
}

/* ---- pictures ----------------------------------------------------------------------------------- */

/* Oracle: the corners of explicit axes are the corners of the frame. */
static void values_land_where_the_axes_say(void **state)
{
    (void)state;
    const double x[] = { 0.01, 1, 100 }, y[] = { 2, 5, 8 };
    const struct plot_series series = { .label = "s", .count = 3, .x = x, .y = y };
    const struct plot plot = { .x = { .scale = PLOT_LOG, .min = 0.01, .max = 100 },
                               .y = { .min = 2, .max = 8 },
                               .series = &series,
                               .series_count = 1 };
    char *const svg = draw(&plot);
    double left, top, bottom, right, path[6];
    const char *const frame = strstr(svg, "stroke-width=\"1.2\" d=\"M");
    const char *const line = strstr(svg, "stroke-width=\"2.4\"");
    assert_non_null(frame);
    assert_int_equal(sscanf(strstr(frame, "d=\""), "d=\"M%lf %lfV%lfH%lf", &left, &top, &bottom, &right),
                     4);
    assert_int_equal(sscanf(strstr(line, "d=\""), "d=\"M%lf %lfL%lf %lfL%lf %lf", &path[0], &path[1],
                            &path[2], &path[3], &path[4], &path[5]),
                     6);
    /* Coordinates are written in hundredths. */
    assert_close(path[0], left, 1e-4, "left");
    assert_close(path[1], bottom, 1e-4, "bottom");
    assert_close(path[2], (left + right) / 2, 1e-4, "middle of a log axis");
    assert_close(path[3], (top + bottom) / 2, 1e-4, "middle of a linear axis");
    assert_close(path[4], right, 1e-4, "right");
    assert_close(path[5], top, 1e-4, "top");
    free(svg);
}

/* Oracle: the rule itself; each value that cannot be drawn ends a stroke, and a lone point is a dot. */
static void values_that_cannot_be_drawn_cut_the_line(void **state)
{
    (void)state;
    const double x[] = { 1, 2, 3, 4, 5, 6, 7, 8, 9 };
    const double y[] = { 1, 2, NAN, 3, 0, -1, 4, 5, INFINITY };
    const double big[] = { 2, 3, 4, 5, 6, 7, 8, 9, 10 };
    struct plot_series series[] = { { .count = 9, .x = x, .y = y },
                                    { .kind = PLOT_BAND, .count = 9, .x = x, .y_low = y, .y_high = big } };
    const struct plot plot = {
        .x = { .scale = PLOT_LOG }, .y = { .scale = PLOT_LOG }, .series = series, .series_count = 2
    };
    char *const svg = draw(&plot);
    assert_well_formed(svg);
    char path[256] = "";
    sscanf(strstr(strstr(svg, "stroke-width=\"2.4\""), " d=\""), " d=\"%255[^\"]", path);
    assert_int_equal(count_of(path, "M"), 3);
    assert_int_equal(count_of(path, "L"), 2);
    assert_int_equal(count_of(path, "h0.01"), 1);
    assert_int_equal(count_of(svg, "fill-opacity=\"0.22\""), 2);
    assert_int_equal(count_of(svg, "nan") + count_of(svg, "inf"), 0);
    free(svg);
}

/* Oracle: XML 1.0: what is not a legal character cannot appear, the rest comes back as it was. */
static void texts_are_escaped(void **state)
{
    (void)state;
    const struct plot_marker marker = { .value = 1, .label = "</text><script>" };
    const struct plot plot = {
        .title = "a<b> & \"c\" \x01\xff\xc0\x80\xed\xa0\x80\xe0\x80\x80\xf0\x9f\x94\xac end",
        .subtitle = "<!-- ]]> %s %d",
        .caption = "\xe2\x84\x93 'x'",
        .x = { .title = "<&>", .min = 0, .max = 2 },
        .y = { .title = "\xc3" },
        .markers = &marker,
        .marker_count = 1
    };
    char *const svg = draw(&plot);
    assert_well_formed(svg);
    assert_non_null(strstr(svg, "<title>a&lt;b&gt; &amp; &quot;c&quot; \xef\xbf\xbd\xef\xbf\xbd"));
    assert_non_null(strstr(svg, "\xf0\x9f\x94\xac end</title>"));
    char title[256] = "";
    sscanf(strstr(svg, "<title>"), "<title>%255[^/]", title);
    assert_int_equal(count_of(title, "\xef\xbf\xbd"), 10); /* every byte that is no part of a character */
    assert_non_null(strstr(svg, "&lt;!-- ]]&gt; %s %d"));
    assert_non_null(strstr(svg, "\xe2\x84\x93 'x'"));
    assert_null(strstr(svg, "<script>"));
    assert_drawable(svg);
    free(svg);
}

/* Oracle: nothing to draw is a picture that says so; no plot may fail for want of data. */
static void empty_plots_say_so(void **state)
{
    (void)state;
    const double zero[] = { 0, 0 }, x[] = { 1, 2 };
    const struct plot_series series = { .label = "zero", .count = 2, .x = x, .y = zero };
    for (int i = 0; i < 8; i++) {
        const enum plot_scale scale = i & 1 ? PLOT_LOG : PLOT_LINEAR;
        const struct plot plot = { .x = { .scale = scale },
                                   .y = { .scale = scale },
                                   .series = &series,
                                   .series_count = i & 2 ? 1 : 0,
                                   .width_px = i & 4 ? 40 : 0,
                                   .height_px = i & 4 ? 30 : 0 };
        char *const svg = draw(&plot);
        assert_well_formed(svg);
        assert_drawable(svg);
        const bool is_empty = plot.series_count == 0 || scale == PLOT_LOG;
        assert_int_equal(count_of(svg, "no values to show"), is_empty);
        free(svg);
    }
}

struct flag {
    double x, y, width;
};

/* Oracle: geometry; over random markers no label touches another, and no pole crosses one. */
static void marker_labels_never_touch(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    for (int round = 0; round < 100; round++) {
        struct plot_marker markers[8];
        char labels[8][32];
        const size_t count = 1 + random_bits(&rng) % 8;
        for (size_t i = 0; i < count; i++) {
            snprintf(labels[i], sizeof *labels, "label %.*s", (int)(random_bits(&rng) % 9), "longlong");
            markers[i] =
                (struct plot_marker){ .value = log_uniform(&rng, 1, i % 2 ? 1.2 : 10), .label = labels[i] };
        }
        const struct plot plot = { .x = { .scale = PLOT_LOG, .min = 1, .max = 10 },
                                   .markers = markers,
                                   .marker_count = count };
        char *const svg = draw(&plot);
        struct flag flags[8];
        double pole_x[8], pole_top[8];
        size_t found = 0;
        for (const char *p = svg; (p = strstr(p, "stroke-width=\"1.3\"")) != NULL; found++) {
            double bottom;
            assert_true(found < count);
            p = strstr(p, "d=\"");
            assert_int_equal(sscanf(p, "d=\"M%lf %lfV%lf", &pole_x[found], &bottom, &pole_top[found]), 3);
            p = strstr(p, "<text");
            char label[32];
            assert_int_equal(sscanf(p, "<text x=\"%lf\" y=\"%lf\" font-size=\"12\">%31[^<]",
                                    &flags[found].x, &flags[found].y, label),
                             3);
            flags[found].width = plot_text_width_px(label, strlen(label), 12);
        }
        assert_int_equal(found, count);
        for (size_t i = 0; i < count; i++) {
            assert_true(flags[i].x + flags[i].width <= 960);
            for (size_t j = 0; j < count; j++) {
                const bool is_beside =
                    flags[j].x >= flags[i].x + flags[i].width || flags[i].x >= flags[j].x + flags[j].width;
                assert_true(i == j || is_beside || fabs(flags[i].y - flags[j].y) >= 14);
                const bool is_over = pole_x[j] > flags[i].x && pole_x[j] < flags[i].x + flags[i].width;
                assert_true(!is_over || pole_top[j] > flags[i].y);
            }
        }
        free(svg);
    }
}

/* Oracle: geometry; series that end at the same place still get labels a line apart, beside the frame. */
static void series_labels_never_touch(void **state)
{
    (void)state;
    const double x[] = { 1, 2 }, y[] = { 1, 1 };
    struct plot_series series[12];
    for (size_t i = 0; i < 12; i++)
        series[i] = (struct plot_series){ .label = "same", .count = 2, .x = x, .y = y };
    for (int end = 0; end < 3; end++) { /* at the bottom, in the middle, at the top */
        const struct plot plot = { .series = series,
                                   .series_count = 12,
                                   .y = { .min = end * -0.5 + 1, .max = 2 - end * 0.5 } };
        char *const svg = draw(&plot);
        double y_px[12], top, bottom;
        const char *const frame = strstr(svg, "stroke-width=\"1.2\" d=\"M");
        assert_int_equal(sscanf(strstr(frame, "d=\""), "d=\"M%*f %lfV%lf", &top, &bottom), 2);
        size_t found = 0;
        for (const char *p = svg; (p = strstr(p, ">same<")) != NULL; p++) {
            const char *text = p;
            while (strncmp(text, "<text", 5) != 0)
                text--;
            assert_true(found < 12);
            assert_int_equal(sscanf(text, "<text x=\"%*f\" y=\"%lf\"", &y_px[found++]), 1);
        }
        assert_int_equal(found, 12);
        for (size_t i = 0; i < 12; i++) {
            assert_true(y_px[i] > top && y_px[i] < bottom + 13);
            assert_true(i == 0 || y_px[i] - y_px[i - 1] >= 13);
        }
        free(svg);
    }
}

/* Oracle: same plot, same bytes; also where the decimal point is a comma, if such a locale is there. */
static void bytes_depend_on_the_plot_alone(void **state)
{
    (void)state;
    const double x[] = { 0.1, 0.25, 1.5 }, y[] = { 0.3, 0.1, 0.7 };
    const struct plot_series series = { .kind = PLOT_POINTS, .count = 3, .x = x, .y = y };
    const struct plot plot = { .title = "t", .series = &series, .series_count = 1 };
    char *const first = draw(&plot);
    setlocale(LC_ALL, "de_DE.UTF-8");
    char *const second = draw(&plot);
    setlocale(LC_ALL, "C");
    assert_string_equal(first, second);
    assert_null(strchr(first, ','));
    free(first);
    free(second);
}

/* Oracle: the PNG format; signature, and the size in its header. */
static void png_has_the_size_asked(void **state)
{
    (void)state;
    const double x[] = { 1, 2 };
    const struct plot_series series = { .kind = PLOT_POINTS,
                                        .count = 2,
                                        .x = x,
                                        .y = x,
                                        .y_low = (double[]){ 0, 1 },
                                        .y_high = (double[]){ 2, 3 } };
    char *const svg =
        draw(&(struct plot){ .width_px = 300, .height_px = 200, .series = &series, .series_count = 1 });
    unsigned char *png = NULL;
    size_t size = 0;
    assert_true(plot_png_create(svg, strlen(svg), 2, &png, &size, NULL));
    assert_true(size > 1000);
    assert_memory_equal(png, "\x89PNG\r\n\x1a\n", 8);
    assert_memory_equal(png + 16, "\0\0\x02\x58\0\0\x01\x90", 8);
    free(png);

    dipole_status status = { 0 };
    assert_false(plot_png_create(svg, strlen(svg), 0, &png, &size, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_null(png);
    assert_false(plot_png_create("<svg", 4, 1, &png, &size, &status));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
    assert_null(png);
    free(svg);
}

/* Oracle: the order of the series; labels of a legend stand below each other, whatever the lines do. */
static void a_legend_keeps_the_order_of_the_series(void **state)
{
    (void)state;
    static const double x[] = { 1, 2 }, high[] = { 1, 9 }, low[] = { 1, 2 }, one[] = { 1, 1 };
    static const struct plot_series series[] = {
        { .label = "low", .count = 2, .x = x, .y = low },
        { .label = "high", .count = 2, .x = x, .y = high, .is_thin = true },
        { .kind = PLOT_POINTS,
          .label = "points",
          .count = 2,
          .x = x,
          .y = low,
          .y_low = one,
          .y_high = low,
          .color = "#333333",
          .mark = PLOT_SQUARE,
          .is_hollow = true },
    };
    const struct plot plot = { .series = series, .series_count = 3, .has_legend = true };
    char *const svg = draw(&plot);
    assert_well_formed(svg);
    assert_drawable(svg);
    double y_px[3];
    for (int i = 0; i < 3; i++) {
        char label[32];
        snprintf(label, sizeof label, ">%s<", series[i].label);
        const char *text = strstr(svg, label);
        assert_non_null(text);
        while (strncmp(text, "y=\"", 3) != 0)
            text--;
        y_px[i] = strtod(text + 3, NULL);
    }
    assert_true(y_px[0] < y_px[1] && y_px[1] < y_px[2]);
    assert_int_equal(count_of(svg, "stroke-width=\"1.2\" stroke-linejoin"), 1);
    assert_int_equal(count_of(svg, "<path fill=\"none\" stroke=\"#333333\" stroke-width=\"1.2\""), 3);
    assert_int_equal(count_of(svg, "h8M"), 1); /* the first point's interval is none */
    free(svg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(log_axis_has_decades_and_minor_ticks),
        cmocka_unit_test(long_log_axis_labels_every_third_decade),
        cmocka_unit_test(short_log_axis_labels_one_two_five),
        cmocka_unit_test(linear_axis_has_round_steps),
        cmocka_unit_test(rounded_ranges_hold_their_values),
        cmocka_unit_test(values_land_where_the_axes_say),
        cmocka_unit_test(values_that_cannot_be_drawn_cut_the_line),
        cmocka_unit_test(texts_are_escaped),
        cmocka_unit_test(empty_plots_say_so),
        cmocka_unit_test(marker_labels_never_touch),
        cmocka_unit_test(series_labels_never_touch),
        cmocka_unit_test(a_legend_keeps_the_order_of_the_series),
        cmocka_unit_test(bytes_depend_on_the_plot_alone),
        cmocka_unit_test(png_has_the_size_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
