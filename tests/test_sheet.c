#include "plot/color.h"
#include "plot/sheet.h"
#include "plot/text.h"
#include "tests/check.h"
#include "tests/svg_check.h"

#include <cairo.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>

/* ---- helpers ------------------------------------------------------------------------------------ */

static char *draw(const struct plot_sheet *sheet)
{
    char *svg = NULL;
    size_t size = 0;
    dipole_status status = { 0 };
    if (!plot_sheet_svg_create(sheet, &svg, &size, &status))
        fail_msg("%s", status.message);
    assert_int_equal(strlen(svg), size);
    return svg;
}

struct bytes {
    const unsigned char *data;
    size_t size;
};

static cairo_status_t bytes_read(void *closure, unsigned char *data, unsigned int size)
{
    struct bytes *const bytes = closure;
    if (bytes->size < size)
        return CAIRO_STATUS_READ_ERROR;
    memcpy(data, bytes->data, size);
    bytes->data += size;
    bytes->size -= size;
    return CAIRO_STATUS_SUCCESS;
}

/* The pixels that readers of the SVG see. */
static cairo_surface_t *pixels_create(const char *svg, double scale)
{
    unsigned char *png = NULL;
    size_t size = 0;
    assert_true(plot_png_create(svg, strlen(svg), scale, &png, &size, NULL));
    struct bytes bytes = { png, size };
    cairo_surface_t *const surface = cairo_image_surface_create_from_png_stream(bytes_read, &bytes);
    assert_int_equal(cairo_surface_status(surface), CAIRO_STATUS_SUCCESS);
    free(png);
    return surface;
}

static unsigned pixel_at(cairo_surface_t *surface, int x, int y)
{
    assert_true(x >= 0 && x < cairo_image_surface_get_width(surface));
    assert_true(y >= 0 && y < cairo_image_surface_get_height(surface));
    unsigned argb;
    memcpy(&argb,
           cairo_image_surface_get_data(surface) + (ptrdiff_t)y * cairo_image_surface_get_stride(surface) +
               4 * (ptrdiff_t)x,
           4);
    return argb & 0xffffff;
}

static unsigned color_of(double position)
{
    unsigned char rgb[3];
    plot_color(position, rgb);
    return (unsigned)rgb[0] << 16 | (unsigned)rgb[1] << 8 | rgb[2];
}

struct box {
    double x, y, width, height;
};

/* Boxes of the pictures, inside their frames, in order: the tiles, the colour bar, its key. */
static size_t boxes_find(const char *svg, struct box *boxes, size_t limit)
{
    size_t count = 0;
    for (const char *p = svg; (p = strstr(p, "</g>\n<rect ")) != NULL; p++) {
        assert_true(count < limit);
        struct box *const box = &boxes[count++];
        assert_int_equal(sscanf(p, "</g>\n<rect x=\"%lf\" y=\"%lf\" width=\"%lf\" height=\"%lf\"", &box->x,
                                &box->y, &box->width, &box->height),
                         4);
        *box = (struct box){ box->x + 0.5, box->y + 0.5, box->width - 1, box->height - 1 };
    }
    return count;
}

/* ---- colours ------------------------------------------------------------------------------------ */

static double linear_of(int byte)
{
    const double encoded = byte / 255.0;
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

static double root(double t)
{
    return t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}

/* CIE 15: L*, a*, b* of linear sRGB under D65. */
static void lab_of(const double rgb[3], double lab[3])
{
    const double x = root((0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2]) / 0.95047);
    const double y = root(0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2]);
    const double z = root((0.0193339 * rgb[0] + 0.1191920 * rgb[1] + 0.9503041 * rgb[2]) / 1.08883);
    lab[0] = 116 * y - 16;
    lab[1] = 500 * (x - y);
    lab[2] = 200 * (y - z);
}

static void map_lab(double position, double lab[3])
{
    unsigned char bytes[3];
    plot_color(position, bytes);
    lab_of((const double[]){ linear_of(bytes[0]), linear_of(bytes[1]), linear_of(bytes[2]) }, lab);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

/*
 * Oracle: CIELAB, computed back from the bytes. Steps are equal but for the rounding to bytes: it moves L*
 * by up to 0.2, and dark colours by up to 0.6 in all. A colour cut off at the edge of sRGB would show as a
 * step too short.
 */
static void equal_steps_look_equally_large(void **state)
{
    (void)state;
    double labs[253][3];
    for (int i = 0; i <= 252; i++) {
        map_lab(i / 252.0, labs[i]);
        assert_true(fabs(labs[i][0] - (18 + 76 * i / 252.0)) < 0.25);
        assert_true(i < 1 || distance(labs[i], labs[i - 1]) > 0);
        assert_true(i < 2 || labs[i][0] > labs[i - 2][0]);
        assert_true(i < 9 || fabs(distance(labs[i], labs[i - 9]) - 209.4 * 9 / 252) < 1.2);
    }
}

/* Oracle: Vienot, Brettel and Mollon 1999, what protanopes and deuteranopes see of linear sRGB: lightness
 * still rises all along, and colours a quarter of the scale apart differ by more than their lightness, 19.
 */
static void colour_blind_readers_see_the_order(void **state)
{
    (void)state;
    static const double seen[2][3][3] = {
        { { 0.11238, 0.88762, 0 }, { 0.11238, 0.88762, 0 }, { 0.00401, -0.00401, 1 } },
        { { 0.29275, 0.70725, 0 }, { 0.29275, 0.70725, 0 }, { -0.02234, 0.02234, 1 } },
    };
    for (int kind = 0; kind < 2; kind++) {
        double labs[65][3];
        for (int i = 0; i <= 64; i++) {
            unsigned char bytes[3];
            plot_color(i / 64.0, bytes);
            double rgb[3] = { 0 };
            for (int row = 0; row < 3; row++)
                for (int c = 0; c < 3; c++)
                    rgb[row] += seen[kind][row][c] * linear_of(bytes[c]);
            lab_of(rgb, labs[i]);
            assert_true(i == 0 || labs[i][0] > labs[i - 1][0] + 0.3);
            assert_true(i < 16 || distance(labs[i], labs[i - 16]) > 19);
        }
    }
}

/* Oracle: the declaration; positions beyond the ends are the ends. */
static void positions_are_clamped(void **state)
{
    (void)state;
    assert_int_equal(color_of(-1), color_of(0));
    assert_int_equal(color_of(7), color_of(1));
    assert_int_not_equal(color_of(0), color_of(1));
}

/* ---- pictures ----------------------------------------------------------------------------------- */

static unsigned expected_pixel(const struct plot_sheet *sheet, const struct plot_tile *tile, int x, int y)
{
    const double value = tile->values[y * tile->width + x];
    if (!isfinite(value))
        return (x + y) % 4 < 2 ? 0x808080 : 0xb0b0b0;
    if (sheet->scale == PLOT_LOG && value <= 0)
        return 0xe2e2e2;
    const double position = sheet->scale == PLOT_LOG
                                ? log(value / sheet->min) / log(sheet->max / sheet->min)
                                : (value - sheet->min) / (sheet->max - sheet->min);
    return color_of(round(fmin(fmax(position, 0), 1) * 252) / 252);
}

/* Oracle: the scale itself; every pixel of every tile, as librsvg draws it, at two resolutions. */
static void every_pixel_has_its_values_colour(void **state)
{
    (void)state;
    struct rng rng = { .seed = 11 };
    double values[2][12 * 12];
    for (int i = 0; i < 144; i++) {
        values[0][i] = log_uniform(&rng, 1e-5, 1e3);
        values[1][i] = i % 7 == 0 ? 0 : i % 7 == 1 ? -1.0 : i % 7 == 2 ? NAN : log_uniform(&rng, 1e-3, 10);
    }
    values[0][5] = INFINITY;
    const struct plot_tile tiles[] = { { "a", 12, 12, values[0] }, { "b", 9, 5, values[1] } };
    for (int i = 0; i < 4; i++) {
        const bool is_log = i % 2;
        const struct plot_sheet sheet = { .title = "t",
                                          .tiles = tiles,
                                          .tile_count = 2,
                                          .width_px = 500 + 37 * i,
                                          .scale = is_log ? PLOT_LOG : PLOT_LINEAR,
                                          .min = is_log ? 1e-4 : -2,
                                          .max = 100,
                                          .value_title = "v" };
        char *const svg = draw(&sheet);
        struct box boxes[8];
        assert_int_equal(boxes_find(svg, boxes, 8), is_log ? 5 : 4);
        const int scale = 1 + i / 2;
        cairo_surface_t *const surface = pixels_create(svg, scale);
        for (int t = 0; t < 2; t++) {
            const int side = (int)boxes[t].width / tiles[t].width;
            assert_true(side >= 10);
            assert_true(boxes[t].width == side * tiles[t].width &&
                        boxes[t].height == side * tiles[t].height);
            for (int y = 0; y < tiles[t].height * side * scale; y++)
                for (int x = 0; x < tiles[t].width * side * scale; x++)
                    assert_int_equal(
                        pixel_at(surface, (int)boxes[t].x * scale + x, (int)boxes[t].y * scale + y),
                        expected_pixel(&sheet, &tiles[t], x / (side * scale), y / (side * scale)));
        }
        cairo_surface_destroy(surface);
        free(svg);
    }
}

/* Oracle: at any scale, also where texels end between pixels, a pixel has a texel's colour: neighbours
 * leave no seam and are not mixed. */
static void texels_leave_no_seams(void **state)
{
    (void)state;
    static const double scales[] = { 0.7, 1.1, 1.5, 2.37, 3.3 };
    const double values[] = { 0, 0.5, 1, 0.75, 0.25, 0.5, 0.5, 1, 0 };
    const struct plot_tile tile = { NULL, 3, 3, values };
    const struct plot_sheet sheet = {
        .tiles = &tile, .tile_count = 1, .width_px = 320, .min = 0, .max = 1
    };
    char *const svg = draw(&sheet);
    struct box boxes[2];
    assert_int_equal(boxes_find(svg, boxes, 2), 2);
    for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
        cairo_surface_t *const surface = pixels_create(svg, scales[i]);
        const int left = (int)ceil(boxes[0].x * scales[i]) + 1, top = (int)ceil(boxes[0].y * scales[i]) + 1;
        const int right = (int)((boxes[0].x + boxes[0].width) * scales[i]) - 1,
                  bottom = (int)((boxes[0].y + boxes[0].height) * scales[i]) - 1;
        assert_true(right - left > 50 && bottom - top > 50);
        for (int y = top; y < bottom; y++)
            for (int x = left; x < right; x++) {
                bool is_texel = false;
                for (int k = 0; k < 9; k++)
                    is_texel =
                        is_texel || pixel_at(surface, x, y) == color_of(round(values[k] * 252) / 252);
                assert_true(is_texel);
            }
        cairo_surface_destroy(surface);
    }
    free(svg);
}

/* Oracle: the rule; where texels are smaller than px, a px shows the one under its centre. */
static void large_tiles_are_sampled(void **state)
{
    (void)state;
    enum { SIDE = 2000 };
    static double values[SIDE * 3];
    for (int i = 0; i < SIDE * 3; i++)
        values[i] = i % SIDE;
    const struct plot_tile tile = { NULL, SIDE, 3, values };
    const struct plot_sheet sheet = { .tiles = &tile, .tile_count = 1, .min = 0, .max = SIDE - 1 };
    char *const svg = draw(&sheet);
    struct box boxes[2];
    assert_int_equal(boxes_find(svg, boxes, 2), 2);
    assert_true(boxes[0].width > 700 && boxes[0].width < SIDE / 2.0 && boxes[0].height == 1);
    cairo_surface_t *const surface = pixels_create(svg, 1);
    for (int x = 0; x < (int)boxes[0].width; x++)
        assert_int_equal(
            pixel_at(surface, (int)boxes[0].x + x, (int)boxes[0].y),
            color_of(round(floor((x + 0.5) * SIDE / boxes[0].width) / (SIDE - 1) * 252) / 252));
    cairo_surface_destroy(surface);
    free(svg);
}

/* Oracle: a tile that runs through the scale; the bar has the same colours at the same values. */
static void the_colour_bar_is_the_scale(void **state)
{
    (void)state;
    const double values[] = { 0.001, 0.01, 0.1, 1, 10, 1 };
    const struct plot_tile tile = { NULL, 2, 3, values };
    const struct plot_sheet sheet = { .tiles = &tile, .tile_count = 1, .scale = PLOT_LOG };
    char *const svg = draw(&sheet);
    struct box boxes[2];
    assert_int_equal(boxes_find(svg, boxes, 2), 2);
    const struct box *const bar = &boxes[1];
    cairo_surface_t *const surface = pixels_create(svg, 1);
    for (int y = 0; y < (int)bar->height; y++) {
        const double position = 1 - (y + 0.5) / bar->height;
        for (int x = 0; x < (int)bar->width; x++)
            assert_int_equal(pixel_at(surface, (int)bar->x + x, (int)bar->y + y),
                             color_of(round(position * 252) / 252));
    }
    /* Its labels: decades, each beside its place. */
    for (int i = 0; i < 5; i++) {
        char tick[128];
        const int count =
            snprintf(tick, sizeof tick, ">10<tspan dy=\"-5.46\" font-size=\"9.75\">%s%d</tspan>",
                     i < 3 ? "−" : "", abs(i - 3));
        assert_true(count > 0 && (size_t)count < sizeof tick);
        const char *text = strstr(svg, tick);
        assert_non_null(text);
        while (strncmp(text, "<text", 5) != 0)
            text--;
        double y_px = 0;
        assert_int_equal(sscanf(text, "<text x=\"%*f\" y=\"%lf\"", &y_px), 1);
        /* The baseline stands 0.36 of 13 px below the tick. */
        assert_close(y_px - 0.36 * 13, bar->y + bar->height * (1 - i / 4.0), 1e-4, "tick %d", i);
    }
    cairo_surface_destroy(surface);
    free(svg);
}

/* Oracle: the rule; the key explains what occurs, and nothing else. */
static void the_key_explains_what_occurs(void **state)
{
    (void)state;
    static const struct {
        double value;
        enum plot_scale scale;
        int zero_count, negative_count, missing_count;
    } cases[] = {
        { 0, PLOT_LINEAR, 0, 0, 0 }, { -1, PLOT_LINEAR, 0, 0, 0 },    { NAN, PLOT_LINEAR, 0, 0, 1 },
        { 1, PLOT_LOG, 0, 0, 0 },    { 0, PLOT_LOG, 1, 0, 0 },        { -1, PLOT_LOG, 0, 1, 0 },
        { NAN, PLOT_LOG, 0, 0, 1 },  { INFINITY, PLOT_LOG, 0, 0, 1 }, { -INFINITY, PLOT_LOG, 0, 0, 1 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double values[] = { 0.1, cases[i].value };
        const struct plot_tile tile = { NULL, 2, 1, values };
        const struct plot_sheet sheet = {
            .tiles = &tile, .tile_count = 1, .scale = cases[i].scale, .min = 0.1, .max = 10
        };
        char *const svg = draw(&sheet);
        assert_well_formed(svg);
        assert_int_equal(count_of(svg, "font-size=\"13\">0</text>"), cases[i].zero_count);
        assert_int_equal(count_of(svg, ">≤ 0<"), cases[i].negative_count);
        assert_int_equal(count_of(svg, ">not finite<"), cases[i].missing_count);
        assert_int_equal(count_of(svg, "<g "),
                         2 + cases[i].zero_count + cases[i].negative_count + cases[i].missing_count);
        free(svg);
    }
}

/* Oracle: the stated bound, for values that nothing can pack: 21 tiles of 64 x 64 of noise. */
static void a_sheet_of_noise_is_small(void **state)
{
    (void)state;
    static double values[64 * 64];
    struct rng rng = { .seed = 12 };
    for (size_t i = 0; i < 64 * 64; i++)
        values[i] = uniform(&rng, 0, 1);
    struct plot_tile tiles[21];
    for (int i = 0; i < 21; i++)
        tiles[i] = (struct plot_tile){ "noise", 64, 64, values };
    const struct plot_sheet sheet = { .tiles = tiles, .tile_count = 21 };
    char *const svg = draw(&sheet);
    assert_true(strlen(svg) < 1000000);
    struct box boxes[22];
    assert_int_equal(boxes_find(svg, boxes, 22), 22);
    assert_true(boxes[0].width == 128); /* two px a texel, not one and a bit */
    free(svg);
}

/* Oracle: geometry; over random sheets no two pictures touch, and all of them lie on the page. */
static void pictures_never_touch(void **state)
{
    (void)state;
    static const double values[100 * 100];
    struct rng rng = { .seed = 13 };
    for (int round = 0; round < 300; round++) {
        struct plot_tile tiles[40];
        const size_t count = 1 + random_bits(&rng) % 40;
        const int side = (int)log_uniform(&rng, 1, 100);
        for (size_t i = 0; i < count; i++)
            tiles[i] = (struct plot_tile){ i % 3 ? "some words, about depth" : NULL,
                                           1 + (int)(random_bits(&rng) % (unsigned)side),
                                           1 + (int)(random_bits(&rng) % (unsigned)side), values };
        const struct plot_sheet sheet = { .title = round % 2 ? "title" : NULL,
                                          .caption = round % 3 ? "caption" : NULL,
                                          .x_title = round % 5 ? "a title longer than a tile" : NULL,
                                          .y_title = round % 5 ? "y" : NULL,
                                          .value_title = round % 7 ? "value" : NULL,
                                          .tiles = tiles,
                                          .tile_count = count,
                                          .columns = round % 4 ? 0 : 1 + round % 10,
                                          .scale = round % 2 ? PLOT_LOG : PLOT_LINEAR,
                                          .width_px = round % 3 ? 0 : 500 + round };
        char *const svg = draw(&sheet);
        struct box boxes[43];
        const size_t found = boxes_find(svg, boxes, 43);
        assert_int_equal(found, count + 1 + (sheet.scale == PLOT_LOG));
        double page_width, page_height;
        assert_int_equal(
            sscanf(strstr(svg, "viewBox"), "viewBox=\"0 0 %lf %lf\"", &page_width, &page_height), 2);
        for (size_t i = 0; i < found; i++) {
            const struct box *const a = &boxes[i];
            assert_true(a->x >= 20 && a->y >= 20 && a->x + a->width <= page_width - 20 &&
                        a->y + a->height <= page_height - 20);
            assert_true(a->x == floor(a->x) && a->y == floor(a->y));
            for (size_t j = 0; j < i; j++) {
                const struct box *const b = &boxes[j];
                assert_true(a->x >= b->x + b->width + 4 || b->x >= a->x + a->width + 4 ||
                            a->y >= b->y + b->height + 4 || b->y >= a->y + a->height + 4);
            }
        }
        assert_well_formed(svg);
        free(svg);
    }
}

/* Oracle: XML 1.0: what is not a legal character cannot appear, nor can a text become markup. */
static void texts_are_escaped(void **state)
{
    (void)state;
    const double values[] = { 1, 2 };
    const struct plot_tile tile = { "</text><script> \"\xff\"", 2, 1, values };
    const struct plot_sheet sheet = { .title = "a<b> & \"c\" \x01\xc0\x80",
                                      .subtitle = "<!-- ]]> %s %d",
                                      .caption = "\xe2\x84\x93 'x'",
                                      .tiles = &tile,
                                      .tile_count = 1,
                                      .value_title = "<v>",
                                      .x_title = "<x>",
                                      .y_title = "y\xc3" };
    char *const svg = draw(&sheet);
    assert_well_formed(svg);
    assert_drawable(svg);
    assert_null(strstr(svg, "<script>"));
    assert_non_null(strstr(svg, "&lt;/text&gt;&lt;script&gt; &quot;\xef\xbf\xbd&quot;<"));
    assert_non_null(strstr(svg, "a&lt;b&gt; &amp; &quot;c&quot; \xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd<"));
    assert_non_null(strstr(svg, "&lt;!-- ]]&gt; %s %d"));
    assert_non_null(strstr(svg, "\xe2\x84\x93 'x'"));
    assert_non_null(strstr(svg, ">&lt;v&gt;<"));
    assert_non_null(strstr(svg, ">&lt;x&gt;<"));
    assert_non_null(strstr(svg, ">y\xef\xbf\xbd<"));
    free(svg);
}

/* Oracle: sheets without tiles, without any value, with tiles shrunk, with one texel, with the widest
 * values are all pictures. */
static void odd_sheets_are_drawn(void **state)
{
    (void)state;
    const double missing[] = { NAN, INFINITY, 0 }, wide[] = { -1e308, 1e308, 5e-324 };
    double *const many = calloc(2000, sizeof *many);
    assert_non_null(many);
    const struct plot_tile tiles[] = { { "none", 3, 1, missing },
                                       { "wide", 3, 1, wide },
                                       { "shrunk", 2000, 1, many },
                                       { "one", 1, 1, missing } };
    for (size_t first = 0; first < 4; first++)
        for (size_t count = 0; first + count <= 4; count++)
            for (int is_log = 0; is_log < 2; is_log++) {
                const struct plot_sheet sheet = { .tiles = tiles + first,
                                                  .tile_count = count,
                                                  .scale = is_log ? PLOT_LOG : PLOT_LINEAR,
                                                  .width_px = count % 2 ? 320 : 0 };
                char *const svg = draw(&sheet);
                assert_well_formed(svg);
                assert_drawable(svg);
                assert_int_equal(count_of(svg, "no values to show"), count == 0);
                free(svg);
            }
    free(many);
}

static void expect_refused(const struct plot_sheet *sheet, const char *message)
{
    dipole_status status = { 0 };
    char *svg = (char *)1;
    size_t size = 0;
    assert_false(plot_sheet_svg_create(sheet, &svg, &size, &status));
    assert_null(svg);
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message, message);
}

/* Oracle: the messages as a caller should read them. */
static void what_cannot_be_drawn_is_named(void **state)
{
    (void)state;
    const double value = 1;
    struct plot_tile tile = { NULL, 1, 1, &value };
    struct plot_sheet sheet = { .tiles = &tile, .tile_count = 1, .width_px = 10 };
    expect_refused(&sheet, "width_px of a sheet is 10, expected 320 to 16384");
    sheet.width_px = 0;
    sheet.columns = -1;
    expect_refused(&sheet, "columns of a sheet is -1, expected >= 0");
    sheet.columns = 0;
    sheet.min = 2;
    expect_refused(&sheet, "limits of the colours are 2 and 0, expected min < max");
    sheet.max = NAN;
    expect_refused(&sheet, "limits of the colours are 2 and nan, expected min < max");
    sheet.scale = PLOT_LOG;
    sheet.min = -2;
    sheet.max = 2;
    expect_refused(&sheet, "limits of the colours are -2 and 2, expected min < max, both above 0");
    sheet.min = sheet.max = 0;
    tile.width = 0;
    expect_refused(&sheet, "tile 0 is 0 x 1 texels, expected sides of 1 to 4096");
    tile.width = 1;
    tile.height = 4097;
    expect_refused(&sheet, "tile 0 is 1 x 4097 texels, expected sides of 1 to 4096");
    tile.height = 1;
    sheet.tile_count = 4097;
    expect_refused(&sheet, "a sheet of 4097 tiles, expected at most 4096");
    struct plot_tile tiles[100];
    for (int i = 0; i < 100; i++)
        tiles[i] = (struct plot_tile){ NULL, 1, 1, &value };
    sheet.tiles = tiles;
    sheet.tile_count = 100;
    sheet.columns = 100;
    expect_refused(&sheet, "100 columns of tiles do not fit into a sheet 960 px wide, expected at most 47");
    sheet.columns = 47;
    free(draw(&sheet));
    tiles[0].width = tiles[0].height = tiles[1].width = 4096; /* refused before a value is read */
    expect_refused(&sheet, "tiles of 16781410 texels together, expected at most 16777216");
}

/* Oracle: same sheet, same bytes; also where the decimal point is a comma, if such a locale is there. */
static void bytes_depend_on_the_sheet_alone(void **state)
{
    (void)state;
    const double values[] = { 0.1, 0.25, 1.5, NAN, 0, 7 };
    const struct plot_tile tiles[] = { { "a", 3, 2, values }, { "b", 2, 3, values } };
    const struct plot_sheet sheet = { .title = "t", .tiles = tiles, .tile_count = 2 };
    char *const first = draw(&sheet);
    setlocale(LC_ALL, "de_DE.UTF-8");
    char *const second = draw(&sheet);
    setlocale(LC_ALL, "C");
    assert_string_equal(first, second);
    free(first);
    free(second);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_steps_look_equally_large),
        cmocka_unit_test(colour_blind_readers_see_the_order),
        cmocka_unit_test(positions_are_clamped),
        cmocka_unit_test(every_pixel_has_its_values_colour),
        cmocka_unit_test(texels_leave_no_seams),
        cmocka_unit_test(large_tiles_are_sampled),
        cmocka_unit_test(the_colour_bar_is_the_scale),
        cmocka_unit_test(the_key_explains_what_occurs),
        cmocka_unit_test(a_sheet_of_noise_is_small),
        cmocka_unit_test(pictures_never_touch),
        cmocka_unit_test(texts_are_escaped),
        cmocka_unit_test(odd_sheets_are_drawn),
        cmocka_unit_test(what_cannot_be_drawn_is_named),
        cmocka_unit_test(bytes_depend_on_the_sheet_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
