/*
 * How much light is left at each depth along one ray, per channel: a falling curve through nodes, exact, or
 * of few nodes. Pure C, no OpenGL. theory.md T62 to T64.
 */
#ifndef RENDERER_TRANSMITTANCE_H
#define RENDERER_TRANSMITTANCE_H

#include "io/material_file.h"

#include <stddef.h>

/* One blocker: what it keeps of each channel, spread evenly by optical depth over the way; a thin sheet
 * where both depths are the same. */
struct render_segment {
    double z0_mm, ze_mm;            /* finite, z0_mm <= ze_mm */
    double alpha[IO_CHANNEL_COUNT]; /* 0 to 1                 */
};

/* Light that is left at a depth. Two nodes at one depth are a step. */
struct render_node {
    double z_mm;
    double left[IO_CHANNEL_COUNT]; /* 0 to 1 */
};

/* Where optical depth begins or ends to grow, or grows at once; storage for render_transmittance_build. */
struct render_node_event {
    double z_mm;
    int kind;
    double depth[IO_CHANNEL_COUNT]; /* at once, or per mm */
};

/*
 * Nodes of the curve of count segments in any order; nodes and events have room for 3 count. Nodes are
 * sorted by depth, the first has 1, and light never grows. Returns how many, 0 where nothing blocks. T62
 */
size_t render_transmittance_build(const struct render_segment *segments, size_t count,
                                  struct render_node_event *events, struct render_node *nodes);

/* Leave at most limit (2 or more) nodes, in place: again and again the one goes whose going changes the
 * area under the curve least, never the first or the last; of more than 256 run by run. areas has room for
 * count. Returns how many are left. T63 */
size_t render_transmittance_compress(struct render_node *nodes, size_t count, size_t limit, double *areas);

/* What is left at a depth of one channel; behind a step that is at it. T62 */
double render_transmittance_at(const struct render_node *nodes, size_t count, double z_mm, int channel);

/* Light that stays before z_mm, 0 to 1, and where it does: the mean of the pieces' half depths, by what
 * stays in each; *mean_mm is unchanged where none stays. T64 */
double render_transmittance_blocked(const struct render_node *nodes, size_t count, double z_mm, int channel,
                                    double *mean_mm);

/* Integral of one channel over depth, from the first node to the last. */
double render_transmittance_area_mm(const struct render_node *nodes, size_t count, int channel);

#endif
