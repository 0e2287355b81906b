/* Where things stand in a translucent-shadow-map volume, and what it gives back. T32. */
#include "lutgen/tsm.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* ---- axes and proximity ------------------------------------------------------------------------- */

double lut_tsm_depth_mm(const struct lut_tsm *lut, double index)
{
    const double end = asinh(lut->depth_max_mm / lut->depth_scale_mm);
    return lut->depth_scale_mm * sinh((2 * index / (lut->size[1] - 1) - 1) * end);
}

double lut_tsm_depth_index(const struct lut_tsm *lut, double dz_mm)
{
    const double end = asinh(lut->depth_max_mm / lut->depth_scale_mm);
    return 0.5 * (lut->size[1] - 1) * (1 + asinh(dz_mm / lut->depth_scale_mm) / end);
}

double lut_tsm_local_depth_mm(const struct lut_tsm *lut, double index)
{
    const double scale_mm = lut->local_depth_scale_mm;
    return scale_mm * sinh(index / (lut->size[0] - 1) * asinh(lut->inner_mm / scale_mm));
}

double lut_tsm_local_depth_index(const struct lut_tsm *lut, double dz_mm)
{
    const double scale_mm = lut->local_depth_scale_mm;
    return (lut->size[0] - 1) * (asinh(fabs(dz_mm) / scale_mm) / asinh(lut->inner_mm / scale_mm));
}

/* 1 at a depth of 0, 0 from inner_mm on, with two continuous derivatives. */
double lut_tsm_proximity(const struct lut_tsm *lut, double dz_mm)
{
    const double x = fmin(fabs(dz_mm) / lut->inner_mm, 1);
    return fmax(1 - x * x * x * (x * (6 * x - 15) + 10), 0);
}

int lut_tsm_kernel_slice(const struct lut_tsm *lut)
{
    return lut->sample_count;
}

int lut_tsm_depth_slice(const struct lut_tsm *lut)
{
    return lut->sample_count + 1;
}

float *lut_tsm_texel(const struct lut_tsm *lut, int s, int t, int r)
{
    const size_t width = (size_t)lut->size[0] * (size_t)lut->size[2];
    return lut->rgb + ((size_t)t * width + (size_t)r * (size_t)lut->size[0] + (size_t)s) * IO_CHANNEL_COUNT;
}

void lut_tsm_samples_fill(struct lut_tsm *lut)
{
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    lut->sample_count = lut_pattern_cells(lut->size[2], cells);
    for (int i = 0; i < lut->sample_count; i++)
        lut->samples[i] =
            (struct lut_tsm_sample){ .offset_mm = { cells[i].centre[0] * lut->inner_mm,
                                                    cells[i].centre[1] * lut->inner_mm },
                                     .width_mm = sqrt(cells[i].area) * lut->inner_mm,
                                     .area_mm2 = cells[i].area * lut->inner_mm * lut->inner_mm };
}

/* ---- sampling ----------------------------------------------------------------------------------- */

/* Where an index lies: the node below, and how far on to the next. */
static int split(double index, int count, double *fraction)
{
    const int i = index < count - 2 ? (int)fmax(index, 0) : count - 2;
    *fraction = fmin(fmax(index - i, 0), 1);
    return i;
}

void lut_tsm_sample_at(const struct lut_tsm *lut, int sample, double s, double t,
                       double rgb_out[IO_CHANNEL_COUNT])
{
    assert(sample >= 0 && sample < lut->sample_count);
    double fs, ft;
    const int i = split(s, lut->size[0], &fs), j = split(t, lut->size[1], &ft);
    const float *const low = lut_tsm_texel(lut, i, j, sample), *const high =
                                                                   lut_tsm_texel(lut, i, j + 1, sample);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double a = (1 - fs) * (double)low[c] + fs * (double)low[IO_CHANNEL_COUNT + c];
        const double b = (1 - fs) * (double)high[c] + fs * (double)high[IO_CHANNEL_COUNT + c];
        rgb_out[c] = ((1 - ft) * a + ft * b) * lut->scale[c];
    }
}

void lut_tsm_sample(const struct lut_tsm *lut, int sample, double cosine, double dz_mm,
                    double rgb_out[IO_CHANNEL_COUNT])
{
    if (fabs(dz_mm) <= lut->depth_max_mm) {
        lut_tsm_sample_at(lut, sample, 0.5 * (1 + cosine) * (lut->size[0] - 1),
                          lut_tsm_depth_index(lut, dz_mm), rgb_out);
        return;
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = 0;
}

void lut_tsm_local_kernel(const struct lut_tsm *lut, int i, int j, double rgb_out[IO_CHANNEL_COUNT])
{
    const int half = LUT_TSM_LOCAL_SIDE / 2;
    assert(abs(i) <= half && abs(j) <= half);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] =
            (double)lut_tsm_texel(lut, i + half, j + half, lut_tsm_kernel_slice(lut))[c] * lut->scale[c];
}

void lut_tsm_local_depth_factor(const struct lut_tsm *lut, double dz_mm, double rgb_out[IO_CHANNEL_COUNT])
{
    double f;
    const int s = split(lut_tsm_local_depth_index(lut, dz_mm), lut->size[0], &f);
    const int row = dz_mm >= 0 ? 0 : 1, r = lut_tsm_depth_slice(lut);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = fabs(dz_mm) < lut->inner_mm ? (1 - f) * (double)lut_tsm_texel(lut, s, row, r)[c] +
                                                       f * (double)lut_tsm_texel(lut, s + 1, row, r)[c]
                                                 : 0;
}
