/* Heat maps: a contact sheet of tiles in one colour scale. */
#ifndef PLOT_SHEET_H
#define PLOT_SHEET_H

#include "plot/plot.h"

enum { PLOT_TILE_LIMIT = 4096, PLOT_TEXEL_LIMIT = 1 << 24 };

/* A value that is not finite is shown as grey stripes. On a logarithmic scale a value at or below 0 gets a
 * light grey of its own. Both are explained beside the sheet where they occur. */
struct plot_tile {
    const char *label;    /* above the tile, wraps; NULL for none                        */
    int width, height;    /* texels, each 1 to 4096, all tiles together at most 2^24     */
    const double *values; /* height x width, rows from the top                           */
};

/* Texts are UTF-8 and shown as they are; title, subtitle and caption wrap, '\n' breaks a line. */
struct plot_sheet {
    int width_px; /* 320 to 16384; 0 for 960. The height follows from the tiles */
    const char *title, *subtitle, *caption;
    const struct plot_tile *tiles;
    size_t tile_count; /* at most PLOT_TILE_LIMIT                                     */
    int columns;       /* of tiles, row by row; 0 for as many as show them largest    */
    enum plot_scale scale;
    double min, max;               /* of the colours, values beyond get the end's; {0, 0}: from the data */
    const char *value_title;       /* what the colours mean, with the unit; NULL for none                */
    const char *x_title, *y_title; /* of every tile, shown once; NULL for none                          */
};

/*
 * Draw sheet as one <svg> element: a complete file, and without ids, so that many can stand in one HTML
 * page. Tiles are drawn in one size of texel, a whole number of px; where there is no room for one px, the
 * texel under the centre of each px is shown. *svg_out ends with a NUL beyond *size_out bytes; the caller
 * frees it. The same sheet gives the same bytes under every locale. Fails with DIPOLE_BAD_VALUE (a number
 * outside its range, limits that the scale cannot show, more columns than fit) or DIPOLE_OUT_OF_MEMORY;
 * *svg_out is then NULL.
 */
DIPOLE_CHECKED bool plot_sheet_svg_create(const struct plot_sheet *sheet, char **svg_out, size_t *size_out,
                                          dipole_status *status);

#endif
