/* Line charts as standalone SVG: the look of every figure the tools write. */
#ifndef PLOT_H
#define PLOT_H

#include "libdipole/dipole.h"

enum plot_scale { PLOT_LINEAR = 0, PLOT_LOG };
enum plot_dash { PLOT_SOLID = 0, PLOT_DASHED, PLOT_DASH_DOTTED, PLOT_DOTTED };
enum plot_kind { PLOT_LINE = 0, PLOT_POINTS, PLOT_BAND };
enum plot_mark { PLOT_DISC = 0, PLOT_SQUARE, PLOT_DIAMOND, PLOT_TRIANGLE };

/* Tones for red, green and blue channels that colour-blind readers can tell apart on white; use a
 * different dash for each as well. */
#define PLOT_RED "#cc3311"
#define PLOT_GREEN "#009e73"
#define PLOT_BLUE "#0072b2"
#define PLOT_GREY "#666666"

struct plot_axis {
    const char *title; /* with the unit; NULL for none                                  */
    enum plot_scale scale;
    double min, max; /* limits; {0, 0} for limits that hold all series                 */
};

/* A value that is not finite, or not above 0 on a logarithmic axis, is left out and cuts a line. */
struct plot_series {
    enum plot_kind kind;
    const char *label; /* stands right of the frame; NULL for none                      */
    size_t count;
    const double *x, *y;          /* y is not read for a band                           */
    const double *y_low, *y_high; /* edges of a band; ends of error bars, NULL for none */
    const char *color;            /* "#rrggbb"; NULL for the next one of the palette    */
    enum plot_dash dash;          /* of a line */
    bool is_thin;                 /* a line of half the width */
    enum plot_mark mark;          /* of points */
    bool is_hollow;               /* points that let the lines below be seen */
    const char *const *tips;      /* of each point, shown while the mouse is over it; NULL for none */
};

/* A straight line across the frame, its label outside. */
struct plot_marker {
    bool is_horizontal;
    double value; /* on the axis it crosses */
    const char *label;
    const char *color; /* NULL for grey */
    enum plot_dash dash;
};

/* Texts are UTF-8 and shown as they are; long ones wrap, '\n' breaks a line. */
struct plot {
    int width_px, height_px; /* 0 for 960 x 640 */
    const char *title, *subtitle, *caption;
    struct plot_axis x, y;
    const struct plot_series *series;
    size_t series_count;
    const struct plot_marker *markers;
    size_t marker_count;
    bool has_legend; /* labels stand together, in the order of the series, not each beside its line */
};

/*
 * Draw plot as one <svg> element: a complete file, and without ids, so that many can stand in one HTML
 * page. *svg_out ends with a NUL beyond *size_out bytes; the caller frees it. The same plot gives the same
 * bytes under every locale. Fails with DIPOLE_OUT_OF_MEMORY; *svg_out is then NULL.
 */
DIPOLE_CHECKED bool plot_svg_create(const struct plot *plot, char **svg_out, size_t *size_out,
                                    dipole_status *status);

/*
 * Draw SVG text as a PNG file in memory, scale (0.1 to 10) pixels per px. The caller frees *png_out.
 * Fails with DIPOLE_BAD_SYNTAX, DIPOLE_BAD_VALUE or DIPOLE_OUT_OF_MEMORY; *png_out is then NULL.
 */
DIPOLE_CHECKED bool plot_png_create(const char *svg, size_t size, double scale, unsigned char **png_out,
                                    size_t *size_out, dipole_status *status);

#endif
