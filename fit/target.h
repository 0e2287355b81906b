/*
 * What was measured, as data that are linear in what the medium does. theory.md T38.
 *
 * A target asks the medium for values at nodes: its profile at distances, or totals of slabs. Each datum is
 * a sum over some of these:
 *     model = gain (factor sum_k row_k node_k + constant) + ambient_share ambient + black
 */
#ifndef FIT_TARGET_H
#define FIT_TARGET_H

#include "fit/form.h"
#include "io/totals_file.h"

struct fit_datum {
    const double *row; /* count values for the nodes from first on                         */
    size_t first, count;
    double factor, constant, ambient_share;
    double value;      /* what was measured                                                */
    double sigma;      /* its standard deviation, > 0, as far as is known by now             */
    double stated;     /* the standard deviation that came with it; 0: none                  */
    double robust;     /* 0 to 1: the share of its weight that it keeps as an outlier      */
    int channel, tile; /* errors within a tile go together                                 */
    size_t place;      /* where it was measured: a pixel of the picture, a row of the file */
};

/* Systematic errors that the data cannot show, all relative standard errors. */
struct fit_systematic {
    double scale;         /* common to the whole target                                             */
    double tile;          /* common to a tile                                                       */
    double offset;        /* added everywhere, relative to the mean                                 */
    double misfit_factor; /* how much more of a misfit is taken to be hidden than what shows         */
};

struct fit_target {
    char name[128];
    size_t node_count;             /* asked of the medium                                             */
    const double *node_r_mm;       /* distances; NULL: totals                                 */
    const struct io_total *totals; /* of each node                                            */
    const double *blur[FIT_CHANNEL_COUNT]; /* row_node_count x node_count each, applied to the nodes first;
                                              NULL: none                                            */
    size_t row_node_count; /* what rows count in: node_count unless there is a blur           */
    struct fit_datum *data;
    size_t datum_count;
    int tile_count;
    bool are_sigmas_stated; /* as standard deviations, not only relative to each other         */
    bool is_gain_free, is_ambient_free, is_black_free;
    bool is_coloured_by_camera;              /* white balance counts */
    double value_scale[FIT_CHANNEL_COUNT];   /* the mean of |value|: the unit of black; 0: no data  */
    double ambient_scale[FIT_CHANNEL_COUNT]; /* the ambient that would make as much            */
    struct fit_systematic systematic;
    double pixel_mm; /* below this nothing is certain: pixels, light samples; 0: there are none     */
    double finest_mm, largest_mm; /* mean free paths that the target could tell apart: from, to         */
};

/* Fill in value_scale and ambient_scale from the data. */
void fit_target_measure_scales(struct fit_target *target);

/*
 * Values at the rows' nodes in one channel: row_node_count doubles; gradients (may be NULL), by logarithms
 * of coefficients, FIT_COEFFICIENT_COUNT times as many. scratch: (1 + FIT_COEFFICIENT_COUNT) node_count.
 * False where the form has no value there, or memory runs out.
 */
bool fit_target_evaluate(const struct fit_target *target, const struct fit_form *form, int channel,
                         const double logs[FIT_COEFFICIENT_COUNT], double *scratch, double *values,
                         double *gradients);

#endif
