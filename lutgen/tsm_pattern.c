/*
 * Where a translucent shadow map is sampled: the one place of the pattern's data. T32.
 *
 * A square of side 1 about the point, in five cells: a square that stands on its corner, and the four
 * triangles that it leaves. Around it rings of squares, each ring as many times wider than what it encloses
 * as the design says: the finest cells are where the response is steepest, and all of them tile the plane
 * out to the last ring without gap or overlap.
 */
#include "lutgen/tsm.h"

#include <math.h>

enum { INNER_CELLS = 5 };

/* A ring of cells of which per_side stand along the side of what it encloses: 4 (per_side + 1) of them. */
static const struct design {
    int slices, per_side, rings;
} designs[] = {
    { 16, 1, 1 },   /*  13 samples,  3 times as wide as the inner square */
    { 32, 1, 2 },   /*  21,  9 times                                     */
    { 64, 2, 4 },   /*  53, 16 times                                     */
    { 128, 3, 7 },  /* 117, 36 times                                     */
    { 256, 5, 10 }, /* 245, 29 times                                     */
};

static const struct design *design_of(int slices)
{
    for (size_t i = 0; i < sizeof designs / sizeof *designs; i++)
        if (designs[i].slices == slices)
            return &designs[i];
    return NULL;
}

bool lut_pattern_has(int slices)
{
    return design_of(slices) != NULL;
}

int lut_tsm_slices(int sample_count)
{
    for (size_t i = 0; i < sizeof designs / sizeof *designs; i++)
        if (INNER_CELLS + designs[i].rings * 4 * (designs[i].per_side + 1) == sample_count)
            return designs[i].slices;
    return 0;
}

double lut_pattern_extent(int slices)
{
    const struct design *const design = design_of(slices);
    return pow((design->per_side + 2.0) / design->per_side, design->rings);
}

double lut_tsm_inner_mm(double r_max_mm, int slices)
{
    return 2 * r_max_mm / lut_pattern_extent(slices);
}

static struct lut_cell polygon(double corners[4][2], bool is_inner, bool is_outermost)
{
    struct lut_cell cell = { .is_inner = is_inner, .is_outermost = is_outermost };
    double sum[2] = { 0, 0 };
    for (int k = 0; k < 4; k++) {
        const double *const a = corners[k], *const b = corners[(k + 1) % 4];
        const double cross = a[0] * b[1] - b[0] * a[1];
        cell.corners[k][0] = a[0];
        cell.corners[k][1] = a[1];
        cell.area += 0.5 * cross;
        sum[0] += (a[0] + b[0]) * cross;
        sum[1] += (a[1] + b[1]) * cross;
    }
    cell.centre[0] = sum[0] / (6 * cell.area);
    cell.centre[1] = sum[1] / (6 * cell.area);
    return cell;
}

static int inner_cells(struct lut_cell *cells)
{
    const double h = 0.5;
    cells[0] = polygon((double[4][2]){ { h, 0 }, { 0, h }, { -h, 0 }, { 0, -h } }, true, false);
    cells[0].centre[0] = cells[0].centre[1] = 0;
    for (int k = 0; k < 4; k++) {
        const double u = k == 0 || k == 3 ? h : -h, v = k < 2 ? h : -h;
        /* counter-clockwise; one corner twice makes it a triangle */
        double corners[4][2] = { { u, v }, { u, v }, { 0, v }, { u, 0 } };
        if (u * v < 0) {
            corners[2][0] = u;
            corners[2][1] = 0;
            corners[3][0] = 0;
            corners[3][1] = v;
        }
        cells[1 + k] = polygon(corners, true, false);
    }
    return INNER_CELLS;
}

int lut_pattern_cells(int slices, struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT])
{
    const struct design *const design = design_of(slices);
    const int side = design->per_side + 2;
    int count = inner_cells(cells);
    double enclosed = 1;
    for (int ring = 0; ring < design->rings; ring++) {
        const double width = enclosed / design->per_side, first = -0.5 * side * width;
        for (int i = 0; i < side * side; i++) {
            const int column = i % side, row = i / side;
            if (column > 0 && column < side - 1 && row > 0 && row < side - 1)
                continue;
            const double u = first + column * width, v = first + row * width;
            cells[count++] = polygon(
                (double[4][2]){ { u, v }, { u + width, v }, { u + width, v + width }, { u, v + width } },
                false, ring == design->rings - 1);
        }
        enclosed *= (double)side / design->per_side;
    }
    return count;
}
