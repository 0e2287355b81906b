/* From values to positions along an axis, and where its ticks stand. */
#ifndef PLOT_AXIS_H
#define PLOT_AXIS_H

#include "plot/plot.h"

struct plot_range {
    enum plot_scale scale;
    double min, max; /* min < max, both drawable on the scale */
};

/* A tick is the exact decimal mantissa x 10^exponent. */
struct plot_tick {
    double value;
    long mantissa;
    int exponent;
    bool has_label;
};

enum { PLOT_TICK_LIMIT = 1024 };

struct plot_ticks {
    struct plot_tick ticks[PLOT_TICK_LIMIT];
    size_t count;
    bool has_powers; /* labels are powers of ten, not decimals */
};

/* What a label shows: base, and an exponent to be raised (NULL-terminated, maybe empty). */
struct plot_tick_label {
    char base[64], exponent[16];
};

/* Finite, and above 0 on a logarithmic axis. */
bool plot_value_is_drawable(enum plot_scale scale, double value);

/* The range low..high widened to round numbers; a useful one when low > high (no values at all). */
struct plot_range plot_range_round(enum plot_scale scale, double low, double high);

/* 0 at min, 1 at max; NaN when the value is not drawable. */
double plot_range_position(const struct plot_range *range, double value);

/*
 * Ticks inside range, ascending, with at most about label_limit (>= 2) labels: decades on a logarithmic
 * axis, 2 to 9 between them unlabelled; 1, 2, 5 when the range holds less than two decades; round steps
 * on a linear axis.
 */
void plot_ticks_place(const struct plot_range *range, int label_limit, struct plot_ticks *out);

void plot_tick_label_init(const struct plot_ticks *ticks, const struct plot_tick *tick,
                          struct plot_tick_label *out);

#endif
