#include "plot/sheet.h"

#include "plot/color.h"
#include "plot/draw.h"
#include "plot/layout.h"
#include "plot/sheet_layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Indices of a tile's colours: the scale in equal steps, then what is not on it. */
enum { LEVEL_LAST = 252, INDEX_ZERO, INDEX_STRIPE_DARK, INDEX_STRIPE_LIGHT };

static void palette_init(unsigned char palette[256][3])
{
    for (int i = 0; i <= LEVEL_LAST; i++)
        plot_color((double)i / LEVEL_LAST, palette[i]);
    memset(palette[INDEX_ZERO], 0xe2, 3);
    memset(palette[INDEX_STRIPE_DARK], 0x80, 3);
    memset(palette[INDEX_STRIPE_LIGHT], 0xb0, 3);
}

static unsigned char level_find(double position)
{
    return (unsigned char)lround(fmin(fmax(position, 0), 1) * LEVEL_LAST);
}

/* Diagonals two texels wide. */
static unsigned char stripe_index(int x, int y)
{
    return (x + y) % 4 < 2 ? INDEX_STRIPE_DARK : INDEX_STRIPE_LIGHT;
}

static unsigned char index_find(const struct plot_range *range, double value, int x, int y)
{
    if (!isfinite(value))
        return stripe_index(x, y);
    if (!plot_value_is_drawable(range->scale, value))
        return INDEX_ZERO;
    return level_find(plot_range_position(range, value));
}

/* Picture elements and the size they are drawn in. */
struct picture {
    int width, height;
    double cell_width_px, cell_height_px;
    const unsigned char *indices; /* height x width */
};

/* Horizontal lines that cover every run of one colour; coordinates relative, since those are short. */
static void runs_draw(struct plot_text *out, const struct picture *picture, int index,
                      const unsigned char rgb[3])
{
    static const char digits[] = "0123456789abcdef";
    char color[8] = "#";
    for (int c = 0; c < 3; c++) {
        color[1 + 2 * c] = digits[rgb[c] >> 4];
        color[2 + 2 * c] = digits[rgb[c] & 15];
    }
    plot_text_print(out, "<path stroke=\"%s\" d=\"", color);
    int pen_x = 0, pen_y = 0;
    for (int y = 0; y < picture->height; y++) {
        const unsigned char *const row = picture->indices + (size_t)y * (size_t)picture->width;
        for (int x = 0; x < picture->width; x++) {
            if (row[x] != index)
                continue;
            const int start = x;
            while (x < picture->width && row[x] == index)
                x++;
            plot_text_print(out, "m%d %dh%d", start - pen_x, y - pen_y, x - start);
            pen_x = x;
            pen_y = y;
        }
    }
    plot_text_print(out, "\"/>\n");
}

/*
 * Lines a cell high, not an <image>: librsvg smooths every image that it enlarges. Without antialiasing
 * neighbours meet without a seam at any scale.
 */
static void picture_draw(struct plot_text *out, double x_px, double y_px, const struct picture *picture,
                         const unsigned char palette[256][3])
{
    const size_t count = (size_t)picture->width * (size_t)picture->height;
    bool is_used[256] = { false };
    for (size_t i = 0; i < count; i++)
        is_used[picture->indices[i]] = true;
    plot_text_print(
        out, "<g fill=\"none\" shape-rendering=\"crispEdges\" transform=\"matrix(%f 0 0 %f %f %f)\">\n",
        picture->cell_width_px, picture->cell_height_px, x_px, y_px + picture->cell_height_px / 2);
    for (int index = 0; index < 256; index++)
        if (is_used[index])
            runs_draw(out, picture, index, palette[index]);
    plot_text_print(out, "</g>\n");
    /* The frame lies around the picture and covers none of it. */
    plot_text_print(
        out, "<rect x=\"%f\" y=\"%f\" width=\"%f\" height=\"%f\" fill=\"none\" stroke=\"#444444\"/>\n",
        x_px - 0.5, y_px - 0.5, picture->width * picture->cell_width_px + 1,
        picture->height * picture->cell_height_px + 1);
}

/* A tile in width x height picture elements: all texels, or those under the centres of fewer elements. */
static void indices_find(const struct plot_tile *tile, const struct plot_range *range, int width,
                         int height, unsigned char *indices)
{
    size_t i = 0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, i++) {
            const size_t column = (size_t)((x + 0.5) * tile->width / width),
                         row = (size_t)((y + 0.5) * tile->height / height);
            indices[i] = index_find(range, tile->values[row * (size_t)tile->width + column], x, y);
        }
}

static void tile_draw(struct plot_text *out, const struct plot_sheet *sheet,
                      const struct plot_sheet_layout *layout, size_t index,
                      const unsigned char palette[256][3])
{
    const struct plot_tile *const tile = &sheet->tiles[index];
    const size_t row = index / layout->columns, column = index % layout->columns;
    const double x_px = layout->left + (double)column * layout->x_step,
                 y_px = layout->top + (double)row * layout->y_step;
    const int lines = plot_line_count(tile->label, PLOT_CAPTION_PX, layout->label_width_px);
    plot_lines_draw(out, tile->label, x_px, y_px - 6 - PLOT_LINE_HEIGHT * PLOT_CAPTION_PX * (lines - 1),
                    PLOT_CAPTION_PX, "", layout->label_width_px);
    /* No picture element is smaller than a px. */
    const double cell_px = fmax(layout->texel_px, 1), texels = cell_px / layout->texel_px;
    const int width = (int)fmax(1, round(tile->width / texels)),
              height = (int)fmax(1, round(tile->height / texels));
    unsigned char *const indices = calloc((size_t)width, (size_t)height);
    if (!indices) {
        out->has_failed = true;
        return;
    }
    indices_find(tile, &layout->range, width, height, indices);
    const struct picture picture = { width, height, cell_px, cell_px, indices };
    picture_draw(out, x_px, y_px, &picture, palette);
    free(indices);
}

/* ---- the scale ------------------------------------------------------------------------------------ */

static void key_draw(struct plot_text *out, const struct plot_sheet_layout *layout, int line,
                     const char *label, bool is_striped, const unsigned char palette[256][3])
{
    enum { SIDE = PLOT_BAR_PX / 2 };
    unsigned char indices[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++)
        indices[i] = is_striped ? stripe_index(i % SIDE, i / SIDE) : INDEX_ZERO;
    const double y_px = layout->top + layout->bar_height + line * PLOT_KEY_PX + 6;
    picture_draw(out, layout->bar_left, y_px, &(struct picture){ SIDE, SIDE, 2, 2, indices }, palette);
    plot_text_print(out, "<text x=\"%f\" y=\"%f\" font-size=\"%d\">%s</text>\n",
                    layout->bar_left + PLOT_BAR_PX + 8, y_px + PLOT_BAR_PX / 2.0 + 0.36 * PLOT_LABEL_PX,
                    PLOT_LABEL_PX, label);
}

static void ticks_draw(struct plot_text *out, const struct plot_sheet_layout *layout)
{
    const double x_px = layout->bar_left + PLOT_BAR_PX;
    for (size_t i = 0; i < layout->ticks.count; i++) {
        const struct plot_tick *const tick = &layout->ticks.ticks[i];
        const double y_px =
            layout->top + (1 - plot_range_position(&layout->range, tick->value)) * layout->bar_height;
        plot_text_print(out, "<line x1=\"%f\" y1=\"%f\" x2=\"%f\" y2=\"%f\" stroke=\"#444444\"/>\n", x_px,
                        y_px, x_px + (tick->has_label ? 6 : 3.5), y_px);
        if (tick->has_label) {
            struct plot_tick_label label;
            plot_tick_label_init(&layout->ticks, tick, &label);
            plot_tick_label_draw(out, &label, x_px + 10, y_px + 0.36 * PLOT_LABEL_PX, "start");
        }
    }
}

static void bar_draw(struct plot_text *out, const struct plot_sheet *sheet,
                     const struct plot_sheet_layout *layout, const unsigned char palette[256][3])
{
    const int height = (int)layout->bar_height;
    unsigned char *const indices = calloc((size_t)height, 1);
    if (!indices) {
        out->has_failed = true;
        return;
    }
    for (int y = 0; y < height; y++)
        indices[y] = level_find(1 - (y + 0.5) / height);
    picture_draw(out, layout->bar_left, layout->top,
                 &(struct picture){ 1, height, PLOT_BAR_PX, 1, indices }, palette);
    free(indices);
    ticks_draw(out, layout);
    if (sheet->value_title) {
        const double x_px =
            layout->bar_left + PLOT_BAR_PX + 10 + plot_ticks_width_px(&layout->ticks) + 1.7 * PLOT_LABEL_PX;
        const double y_px = layout->top + layout->bar_height / 2;
        plot_text_print(out,
                        "<text x=\"%f\" y=\"%f\" transform=\"rotate(-90 %f %f)\" text-anchor=\"middle\" "
                        "font-size=\"%d\">%s</text>\n",
                        x_px, y_px, x_px, y_px, PLOT_LABEL_PX + 1, sheet->value_title);
    }
    int line = 0;
    if (layout->has_zero)
        key_draw(out, layout, line++, layout->has_negative ? "≤ 0" : "0", false, palette);
    if (layout->has_missing)
        key_draw(out, layout, line, "not finite", true, palette);
}

/* ---- the sheet ------------------------------------------------------------------------------------ */

/* At the tile in the lower left corner: in the middle of its side, or from its corner on when longer. */
static void titles_draw(struct plot_text *out, const struct plot_sheet *sheet,
                        const struct plot_sheet_layout *layout)
{
    const double left = layout->left, width_px = layout->cell_width_px, height_px = layout->cell_height_px;
    const double bottom = layout->top + (double)(layout->rows - 1) * layout->y_step + height_px;
    if (sheet->x_title) {
        const bool has_room =
            plot_text_width_px(sheet->x_title, strlen(sheet->x_title), PLOT_CAPTION_PX) <= width_px;
        plot_text_print(out, "<text x=\"%f\" y=\"%f\" text-anchor=\"%s\" font-size=\"%d\">%s</text>\n",
                        has_room ? left + width_px / 2 : left, bottom + 1.4 * PLOT_CAPTION_PX,
                        has_room ? "middle" : "start", PLOT_CAPTION_PX, sheet->x_title);
    }
    if (sheet->y_title) {
        const bool has_room =
            plot_text_width_px(sheet->y_title, strlen(sheet->y_title), PLOT_CAPTION_PX) <= height_px;
        const double x_px = left - 0.7 * PLOT_CAPTION_PX, y_px = has_room ? bottom - height_px / 2 : bottom;
        plot_text_print(out,
                        "<text x=\"%f\" y=\"%f\" transform=\"rotate(-90 %f %f)\" text-anchor=\"%s\" "
                        "font-size=\"%d\">%s</text>\n",
                        x_px, y_px, x_px, y_px, has_room ? "middle" : "start", PLOT_CAPTION_PX,
                        sheet->y_title);
    }
}

static void sheet_draw(struct plot_text *out, const struct plot_sheet *sheet,
                       const struct plot_sheet_layout *layout)
{
    unsigned char palette[256][3];
    palette_init(palette);
    const struct plot_page page = { .width_px = layout->width_px,
                                    .height_px = layout->height_px,
                                    .title = sheet->title,
                                    .subtitle = sheet->subtitle,
                                    .caption = sheet->caption };
    plot_page_begin(out, &page);
    for (size_t i = 0; i < sheet->tile_count; i++)
        tile_draw(out, sheet, layout, i, palette);
    if (sheet->tile_count > 0) {
        titles_draw(out, sheet, layout);
        bar_draw(out, sheet, layout, palette);
    } else {
        plot_text_print(
            out, "<text x=\"%f\" y=\"%f\" font-size=\"%d\" fill=\"#888888\">no values to show</text>\n",
            layout->left, layout->top + PLOT_TITLE_PX, PLOT_TITLE_PX);
    }
    plot_text_print(out, "</svg>\n");
}

bool plot_sheet_svg_create(const struct plot_sheet *sheet, char **svg_out, size_t *size_out,
                           dipole_status *status)
{
    *svg_out = NULL;
    struct plot_sheet_layout *const layout = malloc(sizeof *layout); /* its ticks are large */
    struct plot_text text = { .has_failed = layout == NULL };
    if (layout && !plot_sheet_layout_init(sheet, layout, status)) {
        free(layout);
        return false;
    }
    if (layout)
        sheet_draw(&text, sheet, layout);
    free(layout);
    if (text.has_failed) {
        plot_text_destroy(&text);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory while drawing a sheet");
    }
    *svg_out = text.data;
    *size_out = text.size;
    return true;
}
