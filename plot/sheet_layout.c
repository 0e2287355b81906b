#include "plot/sheet_layout.h"

#include "plot/layout.h"
#include "plot/text.h"

#include <math.h>
#include <string.h>

enum {
    GAP_PX = 14,      /* least room between tiles                               */
    WIDE_GAP_PX = 40, /* most room between tiles side by side                   */
    BAR_GAP_PX = 28,  /* between the tiles and the colour bar                   */
    TICK_LIMIT = 10,  /* labels of the colour bar                               */
    BAR_LOW_PX = 120, /* shortest and longest bar                               */
    BAR_HIGH_PX = 480,
};

/* ---- checks -------------------------------------------------------------------------------------- */

static bool tiles_check(const struct plot_sheet *sheet, dipole_status *status)
{
    if (sheet->tile_count > PLOT_TILE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "a sheet of %zu tiles, expected at most %d",
                           sheet->tile_count, PLOT_TILE_LIMIT);
    size_t texel_count = 0;
    for (size_t i = 0; i < sheet->tile_count; i++) {
        const struct plot_tile *const tile = &sheet->tiles[i];
        if (tile->width < 1 || tile->width > 4096 || tile->height < 1 || tile->height > 4096)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "tile %zu is %d x %d texels, expected sides of 1 to 4096", i, tile->width,
                               tile->height);
        texel_count += (size_t)tile->width * (size_t)tile->height;
    }
    return texel_count <= PLOT_TEXEL_LIMIT ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "tiles of %zu texels together, expected at most %d",
                       texel_count, PLOT_TEXEL_LIMIT);
}

static bool numbers_check(const struct plot_sheet *sheet, dipole_status *status)
{
    if (sheet->width_px != 0 && (sheet->width_px < 320 || sheet->width_px > 16384))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "width_px of a sheet is %d, expected 320 to 16384", sheet->width_px);
    const bool is_drawable = plot_value_is_drawable(sheet->scale, sheet->min) &&
                             plot_value_is_drawable(sheet->scale, sheet->max);
    if ((sheet->min != 0 || sheet->max != 0) &&
        !(is_drawable && sheet->min < sheet->max && isfinite(sheet->max - sheet->min)))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "limits of the colours are %g and %g, expected min < max%s", sheet->min,
                           sheet->max, sheet->scale == PLOT_LOG ? ", both above 0" : "");
    return true;
}

/* ---- values --------------------------------------------------------------------------------------- */

static void values_survey(const struct plot_sheet *sheet, struct plot_sheet_layout *out)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < sheet->tile_count; i++) {
        const struct plot_tile *const tile = &sheet->tiles[i];
        const size_t count = (size_t)tile->width * (size_t)tile->height;
        for (size_t k = 0; k < count; k++) {
            const double value = tile->values[k];
            if (plot_value_is_drawable(sheet->scale, value)) {
                low = fmin(low, value);
                high = fmax(high, value);
            } else if (!isfinite(value)) {
                out->has_missing = true;
            } else {
                out->has_zero = true;
                out->has_negative = out->has_negative || value < 0;
            }
        }
    }
    if (sheet->min != 0 || sheet->max != 0)
        out->range = (struct plot_range){ .scale = sheet->scale, .min = sheet->min, .max = sheet->max };
    else
        out->range = plot_range_round(sheet->scale, low, high);
}

/* ---- places --------------------------------------------------------------------------------------- */

static double text_width_px(const char *s, double font_px)
{
    return s ? plot_text_width_px(s, strlen(s), font_px) : 0;
}

/* Height of the labels above a row of tiles, when each may be limit_px wide. */
static double label_height_px(const struct plot_sheet *sheet, double limit_px)
{
    int lines = 0;
    for (size_t i = 0; i < sheet->tile_count; i++) {
        const int count = plot_line_count(sheet->tiles[i].label, PLOT_CAPTION_PX, limit_px);
        lines = count > lines ? count : lines;
    }
    return lines > 0 ? ceil(PLOT_LINE_HEIGHT * PLOT_CAPTION_PX * lines + 3) : 0;
}

/* Side of a texel when the tiles, the largest of them width x height, stand in so many columns. */
static double texel_find(const struct plot_sheet *sheet, double room_px, size_t columns, double width,
                         double height, bool is_height_shared)
{
    const double cell_px = (room_px - (double)(columns - 1) * GAP_PX) / (double)columns;
    const size_t rows = (sheet->tile_count + columns - 1) / columns;
    double limit_px = 1.1 * room_px; /* a sheet is about as high as it is wide, at most */
    if (is_height_shared)
        limit_px = limit_px / (double)rows - GAP_PX - label_height_px(sheet, cell_px);
    const double texel_px = fmin(cell_px / width, fmax(limit_px, 4) / height);
    return texel_px >= 1 ? floor(texel_px) : texel_px;
}

/* The columns that show the tiles largest; among equals those that leave the fewest places empty. */
static size_t columns_choose(const struct plot_sheet *sheet, double room_px, double width, double height)
{
    size_t best = 1, best_empty = 0;
    double best_texel_px = 0;
    for (size_t columns = 1; columns <= sheet->tile_count; columns++) {
        if ((double)columns * (GAP_PX + 8) > room_px && columns > 1)
            break;
        const double texel_px = texel_find(sheet, room_px, columns, width, height, true);
        const size_t empty = (columns - sheet->tile_count % columns) % columns;
        if (texel_px > best_texel_px || (texel_px == best_texel_px && empty <= best_empty)) {
            best = columns;
            best_empty = empty;
            best_texel_px = texel_px;
        }
    }
    return best;
}

static bool grid_init(const struct plot_sheet *sheet, double right_px, struct plot_sheet_layout *out,
                      dipole_status *status)
{
    out->left = PLOT_PAD_PX + (sheet->y_title ? ceil(1.9 * PLOT_CAPTION_PX) : 0);
    double width = 1, height = 1;
    for (size_t i = 0; i < sheet->tile_count; i++) {
        width = fmax(width, sheet->tiles[i].width);
        height = fmax(height, sheet->tiles[i].height);
    }
    const double room_px = fmax(out->width_px - right_px - out->left, 32);
    const size_t count = sheet->tile_count > 0 ? sheet->tile_count : 1;
    out->columns = columns_choose(sheet, room_px, width, height);
    if (sheet->columns != 0)
        out->columns = (size_t)sheet->columns < count ? (size_t)sheet->columns : count;
    if ((double)out->columns * (GAP_PX + 4) > room_px + GAP_PX)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, NULL,
            "%zu columns of tiles do not fit into a sheet %.0f px wide, expected at most %.0f",
            out->columns, out->width_px, floor((room_px + GAP_PX) / (GAP_PX + 4)));
    out->rows = (count + out->columns - 1) / out->columns;
    out->texel_px = texel_find(sheet, room_px, out->columns, width, height, sheet->columns == 0);
    out->cell_width_px = fmax(1, round(width * out->texel_px));
    out->cell_height_px = fmax(1, round(height * out->texel_px));

    /* Room that whole texels leave goes between the columns. */
    const double columns = (double)out->columns;
    const double gap_px =
        out->columns > 1 ? floor((room_px - columns * out->cell_width_px) / (columns - 1)) : WIDE_GAP_PX;
    out->x_step = out->cell_width_px + fmin(gap_px, WIDE_GAP_PX);
    out->label_width_px = out->x_step - GAP_PX / 2.0;
    const double label_px = label_height_px(sheet, out->label_width_px);
    out->y_step = out->cell_height_px + label_px + GAP_PX;
    out->top = ceil(plot_head_height_px(sheet->title, sheet->subtitle, out->width_px - 2 * PLOT_PAD_PX)) +
               label_px;
    return true;
}

bool plot_sheet_layout_init(const struct plot_sheet *sheet, struct plot_sheet_layout *out,
                            dipole_status *status)
{
    *out = (struct plot_sheet_layout){ .width_px = sheet->width_px != 0 ? sheet->width_px : 960 };
    if (!numbers_check(sheet, status) || !tiles_check(sheet, status))
        return false;
    if (sheet->columns < 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "columns of a sheet is %d, expected >= 0",
                           sheet->columns);
    values_survey(sheet, out);

    /* Fewer labels are not wider: the bar's height may still change. */
    plot_ticks_place(&out->range, TICK_LIMIT, &out->ticks);
    const double key_px = out->has_missing ? text_width_px("not finite", PLOT_LABEL_PX) + 8 : 0;
    const double scale_px = 10 + fmax(plot_ticks_width_px(&out->ticks), key_px) +
                            (sheet->value_title ? 2.2 * PLOT_LABEL_PX : 0);
    if (!grid_init(sheet, ceil(BAR_GAP_PX + PLOT_BAR_PX + scale_px + PLOT_PAD_PX), out, status))
        return false;

    const double grid_px = (double)out->rows * out->y_step - (out->y_step - out->cell_height_px);
    const double keys_px = (out->has_zero + out->has_missing) * PLOT_KEY_PX;
    out->bar_left = out->left + (double)(out->columns - 1) * out->x_step + out->cell_width_px + BAR_GAP_PX;
    out->bar_height = fmin(fmax(grid_px - keys_px, BAR_LOW_PX), BAR_HIGH_PX);
    out->bar_height = round(
        fmax(out->bar_height, fmin(text_width_px(sheet->value_title, PLOT_LABEL_PX + 1), 2 * BAR_HIGH_PX)));
    plot_ticks_place(&out->range, (int)fmin(TICK_LIMIT, fmax(2, out->bar_height / 36)), &out->ticks);

    const int caption_lines =
        plot_line_count(sheet->caption, PLOT_CAPTION_PX, out->width_px - 2 * PLOT_PAD_PX);
    const double below_px =
        fmax(grid_px + (sheet->x_title ? 1.7 * PLOT_CAPTION_PX : 0), out->bar_height + keys_px);
    out->height_px = ceil(out->top + below_px + PLOT_PAD_PX +
                          (caption_lines > 0 ? 8 + PLOT_LINE_HEIGHT * PLOT_CAPTION_PX * caption_lines : 0));
    return true;
}
