/* Where everything on a sheet stands: decided before anything is drawn. */
#ifndef PLOT_SHEET_LAYOUT_H
#define PLOT_SHEET_LAYOUT_H

#include "plot/axis.h"
#include "plot/sheet.h"

enum { PLOT_BAR_PX = 16, PLOT_KEY_PX = 22 /* height of a line of the key below the colour bar */ };

struct plot_sheet_layout {
    double width_px, height_px;
    /* Tile i stands at (left + column * x_step, top + row * y_step), its label above it. Whole px. */
    double left, top, x_step, y_step;
    double texel_px;                      /* side of a texel */
    double cell_width_px, cell_height_px; /* of the largest tile */
    double label_width_px;
    size_t columns, rows;
    double bar_left, bar_height; /* the colour bar begins at top */
    struct plot_range range;
    struct plot_ticks ticks;
    /* What the key must explain. */
    bool has_zero, has_negative, has_missing;
};

/* Fails with DIPOLE_BAD_VALUE as plot_sheet_svg_create() does. */
DIPOLE_CHECKED bool plot_sheet_layout_init(const struct plot_sheet *sheet, struct plot_sheet_layout *out,
                                           dipole_status *status);

#endif
