/* The splat table in memory: its axis, its nodes, and the audit of what lies between them. T15. */
#include "lutgen/internal.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

double lut_axis_index(const struct lut_axis *axis, double r_mm)
{
    const double x = r_mm / axis->scale_mm, x_max = axis->r_max_mm / axis->scale_mm;
    return (axis->node_count - 1) * (log1p(x * x) / log1p(x_max * x_max));
}

double lut_axis_r_mm(const struct lut_axis *axis, double index)
{
    const double u = index / (axis->node_count - 1);
    const double x_max = axis->r_max_mm / axis->scale_mm;
    /* The last node is r_max itself, not what is left of it after log and exp. */
    return u == 1 ? axis->r_max_mm : axis->scale_mm * sqrt(expm1(u * log1p(x_max * x_max)));
}

/* ---- channels ----------------------------------------------------------------------------------- */

/* What the bake and the audit need of a channel; one that does not scatter is 0 everywhere. */
struct channel {
    dipole_coefficients coefficients;
    bool has_scattering;
    double r_max_mm;
    double floor_per_mm2; /* R_d(r_max): the error is relative to no less */
};

static bool channels_init(const struct io_material *material, double epsilon,
                          struct channel channels[IO_CHANNEL_COUNT], dipole_status *status)
{
    if (!io_material_check_classical(material, status))
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        struct channel *const channel = &channels[c];
        if (!dipole_coefficients_init(&material->layers[c][0].medium, &channel->coefficients, status))
            return false;
        channel->has_scattering = channel->coefficients.alpha_prime > 0;
        channel->r_max_mm = dipole_r_max_mm(&channel->coefficients, epsilon);
        channel->floor_per_mm2 = dipole_rd_per_mm2(&channel->coefficients, channel->r_max_mm);
    }
    return true;
}

static bool has_scattering(const struct channel channels[IO_CHANNEL_COUNT])
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (channels[c].has_scattering)
            return true;
    return false;
}

/*
 * The axis ends at the largest r_max of the channels that scatter (of all, when none does), and its scale
 * is their smallest source depth z_r: below it R_d is flat in r^2, as u is; above it u goes with log r.
 * Among scales of 0.35 to 8 z_r this one needs the fewest nodes, or at most a quarter more than the fewest,
 * for every measured material at epsilon 0.1 to 0.001.
 */
static struct lut_axis axis_find(const struct channel channels[IO_CHANNEL_COUNT])
{
    const bool is_any = has_scattering(channels);
    struct lut_axis axis = { .r_max_mm = 0, .scale_mm = INFINITY };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (channels[c].has_scattering || !is_any) {
            axis.r_max_mm = fmax(axis.r_max_mm, channels[c].r_max_mm);
            axis.scale_mm = fmin(axis.scale_mm, channels[c].coefficients.z_r_mm);
        }
    return axis;
}

/* ---- half --------------------------------------------------------------------------------------- */

/* Half has 11 significant bits, the largest finite value 65504 and the smallest normal one 2^-14. */
static const double half_rounding = 0x1p-11, half_max = 65504, half_min_normal = 0x1p-14;

double lut_half_scale(double max)
{
    if (!(max > 0))
        return 1;
    int exponent;
    frexp(max / half_max, &exponent); /* max / half_max < 2^exponent */
    const double scale = ldexp(1, exponent);
    return max <= half_max * scale / 2 ? scale / 2 : scale;
}

double lut_half_round(double value)
{
    int exponent;
    frexp(fmax(fabs(value), half_min_normal),
          &exponent); /* subnormals keep the step of the smallest normal */
    const double step = ldexp(1, exponent - 11);
    return nearbyint(value / step) * step;
}

static bool check_half(const struct channel channels[IO_CHANNEL_COUNT], double epsilon,
                       dipole_status *status)
{
    if (epsilon <= half_rounding)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "epsilon is %g, expected > %.2g for a half table (half rounds by as much); use "
                           "float",
                           epsilon, half_rounding);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!channels[c].has_scattering)
            continue;
        /* Below the normal range the rounding stays half a step of 2^-24, so the error grows. */
        const double max = dipole_rd_per_mm2(&channels[c].coefficients, 0);
        const double least = channels[c].floor_per_mm2 / lut_half_scale(max);
        if (0x1p-25 / least > epsilon)
            return dipole_fail(
                status, DIPOLE_BAD_VALUE, NULL,
                "channel %s falls from %.3g to %.3g per mm^2 within r_max, more than half holds "
                "at epsilon %g; use float or a larger epsilon",
                io_channel_names[c], max, channels[c].floor_per_mm2, epsilon);
    }
    return true;
}

/* ---- bake and audit ----------------------------------------------------------------------------- */

void lut_splat1d_destroy(struct lut_splat1d *lut)
{
    if (lut)
        free(lut->rgb);
    free(lut);
}

/* Fill the nodes with R_d itself: exact there, and too high between, as R_d is convex over most of the
 * axis. */
static void nodes_bake(struct lut_splat1d *lut, const struct channel channels[IO_CHANNEL_COUNT],
                       bool is_half)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_coefficients *const coefficients = &channels[c].coefficients;
        const double scale = lut_half_scale((float)dipole_rd_per_mm2(coefficients, 0));
        for (int i = 0; i < lut->axis.node_count; i++) {
            double rd = dipole_rd_per_mm2(coefficients, lut_axis_r_mm(&lut->axis, i));
            if (is_half)
                rd = lut_half_round(rd / scale) * scale;
            lut->rgb[(size_t)i * IO_CHANNEL_COUNT + (size_t)c] = (float)rd;
        }
    }
}

static void sample_at_index(const struct lut_splat1d *lut, double index, double rgb_out[IO_CHANNEL_COUNT])
{
    const int last = lut->axis.node_count - 2;
    const int i = index < last ? (int)index : last;
    const double f = index - i;
    const float *const node = lut->rgb + (size_t)i * IO_CHANNEL_COUNT;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = (1 - f) * (double)node[c] + f * (double)node[c + IO_CHANNEL_COUNT];
}

void lut_splat1d_sample(const struct lut_splat1d *lut, double r_mm, double rgb_out[3])
{
    if (r_mm >= 0 && r_mm <= lut->axis.r_max_mm) {
        sample_at_index(lut, lut_axis_index(&lut->axis, r_mm), rgb_out);
        return;
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = 0;
}

/* SplitMix64, as a number in 0 <= x < 1. */
static double random_next(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static double error_at_index(const struct lut_splat1d *lut, const struct channel channels[IO_CHANNEL_COUNT],
                             double index)
{
    const double r_mm = lut_axis_r_mm(&lut->axis, index);
    double rgb[IO_CHANNEL_COUNT], worst = 0;
    lut_splat1d_sample(lut, r_mm, rgb);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double exact = dipole_rd_per_mm2(&channels[c].coefficients, r_mm);
        const double difference = fabs(rgb[c] - exact);
        if (difference > 0)
            worst = fmax(worst, difference / fmax(exact, channels[c].floor_per_mm2));
    }
    return worst;
}

/*
 * One random point in each of count equal parts of the axis, and the nodes, where rounding shows. Between
 * two nodes the error is about a parabola: with 32 parts the largest found is at most 0.4 % below the
 * largest.
 */
static double audit(const struct lut_splat1d *lut, const struct channel channels[IO_CHANNEL_COUNT],
                    size_t count, unsigned seed)
{
    uint64_t random = seed;
    const int last = lut->axis.node_count - 1;
    double worst = 0;
    for (size_t i = 0; i < count; i++) {
        const double u = ((double)i + random_next(&random)) / (double)count;
        worst = fmax(worst, error_at_index(lut, channels, u * last));
    }
    for (int i = 0; i <= last; i++)
        worst = fmax(worst, error_at_index(lut, channels, i));
    return worst;
}

double lut_splat1d_audit(const struct lut_splat1d *lut, size_t count, unsigned seed)
{
    struct channel channels[IO_CHANNEL_COUNT];
    if (!channels_init(&lut->material, lut->epsilon, channels, NULL))
        return INFINITY;
    return audit(lut, channels, count, seed);
}

/* A table in float keeps its digits only inside float's normal range. */
static bool check_range(const struct channel channels[IO_CHANNEL_COUNT], dipole_status *status)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double max = dipole_rd_per_mm2(&channels[c].coefficients, 0);
        if (channels[c].has_scattering &&
            (max > (double)FLT_MAX || channels[c].floor_per_mm2 < (double)FLT_MIN))
            return dipole_fail(
                status, DIPOLE_BAD_VALUE, NULL,
                "channel %s falls from %.3g to %.3g per mm^2 within r_max, expected %.2g to %.2g "
                "(float)",
                io_channel_names[c], max, channels[c].floor_per_mm2, (double)FLT_MAX, (double)FLT_MIN);
    }
    return true;
}

/* Double the nodes until the audit passes. */
static bool nodes_find(struct lut_splat1d *lut, const struct channel channels[IO_CHANNEL_COUNT],
                       bool is_half, dipole_status *status)
{
    for (int count = LUT_NODE_COUNT_MIN; count <= LUT_NODE_COUNT_MAX; count *= 2) {
        lut->axis.node_count = count;
        nodes_bake(lut, channels, is_half);
        lut->max_relative_error = 1.01 * audit(lut, channels, (size_t)count, 1);
        if (lut->max_relative_error > lut->epsilon)
            continue; /* a few points show it; only what passes is worth many */
        lut->max_relative_error = 1.01 * audit(lut, channels, (size_t)count * 32, 2);
        if (lut->max_relative_error <= lut->epsilon)
            return true;
    }
    return dipole_fail(status, DIPOLE_NOT_CONVERGED, NULL,
                       "%d nodes reach a relative error of %.2g, expected at most epsilon = %g",
                       LUT_NODE_COUNT_MAX, lut->max_relative_error, lut->epsilon);
}

static bool bake(const struct io_material *material, double epsilon, bool is_half,
                 struct lut_splat1d **lut_out, dipole_status *status)
{
    *lut_out = NULL;
    if (!(epsilon >= LUT_EPSILON_MIN && epsilon <= LUT_EPSILON_MAX))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "epsilon is %g, expected %g to %g", epsilon,
                           LUT_EPSILON_MIN, LUT_EPSILON_MAX);
    struct channel channels[IO_CHANNEL_COUNT];
    if (!channels_init(material, epsilon, channels, status) || !check_range(channels, status) ||
        (is_half && !check_half(channels, epsilon, status)))
        return false;

    struct lut_splat1d *const lut = calloc(1, sizeof *lut);
    float *const rgb = calloc((size_t)LUT_NODE_COUNT_MAX * IO_CHANNEL_COUNT, sizeof *rgb);
    if (!lut || !rgb) {
        free(lut);
        free(rgb);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a table");
    }
    *lut = (struct lut_splat1d){
        .material = *material, .epsilon = epsilon, .axis = axis_find(channels), .rgb = rgb
    };
    if (!nodes_find(lut, channels, is_half, status)) {
        lut_splat1d_destroy(lut);
        return false;
    }
    *lut_out = lut;
    return true;
}

bool lut_splat1d_bake(const struct io_material *material, double epsilon, struct lut_splat1d **lut_out,
                      dipole_status *status)
{
    return bake(material, epsilon, false, lut_out, status);
}

bool lut_splat1d_bake_half(const struct io_material *material, double epsilon, struct lut_splat1d **lut_out,
                           dipole_status *status)
{
    return bake(material, epsilon, true, lut_out, status);
}
