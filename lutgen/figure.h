/* Pictures of tables for people: SVG text that the caller frees. */
#ifndef LUTGEN_FIGURE_H
#define LUTGEN_FIGURE_H

#include "lutgen/lut.h"

/* Curves of a splat table with its texels as points: R, G and B of one material, or G of many. */
DIPOLE_CHECKED bool lut_splat_figure_create(const struct lut_splat *lut, char **svg_out, size_t *size_out,
                                            dipole_status *status);

/* Contact sheet of a volume: a tile per sample, G, in one logarithmic colour scale. */
DIPOLE_CHECKED bool lut_tsm_figure_create(const struct lut_tsm *lut, char **svg_out, size_t *size_out,
                                          dipole_status *status);

#endif
