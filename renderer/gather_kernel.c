#include "renderer/gather_kernel.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Of piece p: bits 22 to 24 of 1.0f are 6. */
static int column(int piece)
{
    return (piece + 6) % RENDER_GATHER_PIECES;
}

/* u where piece p starts. */
static double piece_start(int piece)
{
    return ldexp(piece % 2 ? 1.5 : 1.0, piece / 2);
}

/* The cubic through Chebyshev's nodes over -0.25..0.25, in powers. */
static void fit_cubic(const double values[RENDER_GATHER_TERMS], double terms[RENDER_GATHER_TERMS])
{
    double chebyshev[RENDER_GATHER_TERMS] = { 0 };
    for (int k = 0; k < RENDER_GATHER_TERMS; k++) {
        for (int i = 0; i < RENDER_GATHER_TERMS; i++)
            chebyshev[k] +=
                (k > 0 ? 0.5 : 0.25) * values[i] * cos(PI * k * (i + 0.5) / RENDER_GATHER_TERMS);
    }
    const double scale = 4; /* 1 over the half width */
    terms[0] = chebyshev[0] - chebyshev[2];
    terms[1] = scale * (chebyshev[1] - 3 * chebyshev[3]);
    terms[2] = scale * scale * 2 * chebyshev[2];
    terms[3] = scale * scale * scale * 4 * chebyshev[3];
}

/* d^T spread d */
static float spread_along(const float d_mm[3], const float m[6])
{
    const float x = d_mm[0], y = d_mm[1], z = d_mm[2];
    return x * (m[0] * x + 2 * (m[4] * z + m[5] * y)) + y * (m[1] * y + 2 * m[3] * z) + m[2] * z * z;
}

/* Where a source is on its polynomials. */
struct piece_at {
    uint32_t column;
    float t;             /* place within the piece                                                  */
    float slope, trace;  /* of t, per mm^2 of the distance squared; of the spread                   */
    float first, second; /* what the spread multiplies the first and half the second derivative by */
};

/* false: beyond the reach. */
static bool find_piece(const struct render_gather_kernel *kernel, const float step_mm[3],
                       const float spread_mm2[6], struct piece_at *at)
{
    const float distance2_mm2 = step_mm[0] * step_mm[0] + step_mm[1] * step_mm[1] + step_mm[2] * step_mm[2];
    if (!(distance2_mm2 <= kernel->reach2_mm2))
        return false;
    const float u = 1 + distance2_mm2 * kernel->inverse_per_mm2;
    uint32_t bits;
    memcpy(&bits, &u, sizeof bits);
    at->column = bits >> 22 & (RENDER_GATHER_PIECES - 1);
    bits = (bits & 0x3fffffu) | 0x3f800000u;
    memcpy(&at->t, &bits, sizeof at->t);
    at->t -= 1.25f;
    at->slope = kernel->slope[at->column];
    /* of what is averaged along the surface already, the third way is none */
    at->trace = spread_mm2[0] + spread_mm2[1] + spread_mm2[2] + kernel->averaged_mm2;
    at->first = at->slope * at->trace;
    at->second = 4 * at->slope * at->slope * spread_along(step_mm, spread_mm2);
    return true;
}

void render_gather_kernel_at(const struct render_gather_kernel *kernel, const float step_mm[3],
                             const float spread_mm2[6], float rgb_out[IO_CHANNEL_COUNT])
{
    struct piece_at at;
    const bool is_near = find_piece(kernel, step_mm, spread_mm2, &at);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        rgb_out[c] = 0;
        if (!is_near)
            continue;
        const float(*const terms)[RENDER_GATHER_PIECES] = kernel->terms[c];
        const float t0 = terms[0][at.column], t1 = terms[1][at.column], t2 = terms[2][at.column],
                    t3 = terms[3][at.column], t = at.t;
        const float half_bend = t2 + 3 * t * t3; /* of the cubic */
        rgb_out[c] = t0 + t * (t1 + t * (t2 + t * t3)) + at.first * (t1 + t * (half_bend + t2)) +
                     at.second * half_bend;
        rgb_out[c] *= 1 + kernel->lost_per_mm2[c] * at.trace;
    }
}

void render_gather_kernel_change_at(const struct render_gather_kernel *kernel, const float step_mm[3],
                                    const float spread_mm2[6], float rgb_out[IO_CHANNEL_COUNT])
{
    struct piece_at at;
    const bool is_near = find_piece(kernel, step_mm, spread_mm2, &at);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        rgb_out[c] = 0;
        if (!is_near)
            continue;
        const float(*const terms)[RENDER_GATHER_PIECES] = kernel->terms[c];
        const float t1 = terms[1][at.column], t2 = terms[2][at.column], t3 = terms[3][at.column], t = at.t;
        const float half_bend = t2 + 3 * t * t3;
        rgb_out[c] = at.slope * (t1 + t * (half_bend + t2) + 4 * at.first * half_bend + 3 * at.second * t3);
        rgb_out[c] *= 1 + kernel->lost_per_mm2[c] * at.trace;
    }
}

/* Power that leaves by the band, of a flat surface whose sources are spread by as much in all its
 * directions; NULL: as the split says, without spread. */
static void power_of(const struct render_split *split, int band, const struct render_gather_kernel *kernel,
                     double spread_mm2, double power[IO_CHANNEL_COUNT])
{
    enum { STEPS = 256 };
    const float m = (float)spread_mm2, across = kernel ? -kernel->averaged_mm2 : 0,
                spread[6] = { m, m, across, 0, 0, 0 };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        power[c] = 0;
    for (int i = 0; i < STEPS; i++) {
        const double r_mm = (i + 0.5) / STEPS * split->bands[band].r_outer_mm;
        const float step_mm[3] = { (float)r_mm, 0, 0 };
        float summed[IO_CHANNEL_COUNT];
        double exact[IO_CHANNEL_COUNT];
        if (kernel)
            render_gather_kernel_at(kernel, step_mm, spread, summed);
        else
            render_split_band_per_mm2(split, band, r_mm, exact);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            power[c] += r_mm * (kernel ? (double)summed[c] : exact[c]);
    }
}

/* Cubics miss a little of the power, most where the profile has no value at 0. And spreading light moves it
 * and takes none away; but derivatives of piecewise cubics jump, and so they do. */
static void keep_power(const struct render_split *split, int band, struct render_gather_kernel *kernel)
{
    const double spacing_mm = split->bands[band].spacing_mm, spread_mm2 = spacing_mm * spacing_mm / 12;
    double exact[IO_CHANNEL_COUNT], narrow[IO_CHANNEL_COUNT], wide[IO_CHANNEL_COUNT];
    power_of(split, band, NULL, 0, exact);
    power_of(split, band, kernel, 0, narrow);
    power_of(split, band, kernel, spread_mm2, wide);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        /* Where the lobes of a blurred profile cancel, there is nothing to be kept. */
        if (!(fabs(narrow[c] - exact[c]) < 0.5 * exact[c] && fabs(wide[c] - narrow[c]) < narrow[c]))
            continue;
        kernel->lost_per_mm2[c] = (float)((1 - wide[c] / narrow[c]) / (2 * spread_mm2));
        for (int k = 0; k < RENDER_GATHER_TERMS; k++) {
            for (int p = 0; p < RENDER_GATHER_PIECES; p++)
                kernel->terms[c][k][p] *= (float)(exact[c] / narrow[c]);
        }
    }
}

static bool is_grey(const struct render_gather_kernel *kernel)
{
    bool is_grey = true;
    for (int c = 1; c < IO_CHANNEL_COUNT; c++) {
        is_grey = is_grey && kernel->lost_per_mm2[c] == kernel->lost_per_mm2[0];
        for (int k = 0; k < RENDER_GATHER_TERMS; k++) {
            for (int p = 0; p < RENDER_GATHER_PIECES; p++)
                is_grey = is_grey && kernel->terms[c][k][p] == kernel->terms[0][k][p];
        }
    }
    return is_grey;
}

void render_gather_kernel_init(const struct render_split *split, int band,
                               struct render_gather_kernel *kernel)
{
    const struct render_band *const planned = &split->bands[band];
    /* A cap ends where the fifth piece starts, at u = 4, the band as a rule at 13. */
    const double width_mm = fmax(planned->r_outer_mm, 2 * planned->cap_mm);
    const double inverse = 12 / (width_mm * width_mm);
    *kernel =
        (struct render_gather_kernel){ .averaged_mm2 =
                                           (float)(split->source.spread_mm * split->source.spread_mm),
                                       .inverse_per_mm2 = (float)inverse,
                                       .reach2_mm2 = (float)(planned->r_outer_mm * planned->r_outer_mm) };
    for (int p = 0; p < RENDER_GATHER_PIECES; p++) {
        kernel->slope[column(p)] = (float)ldexp(inverse, -(p / 2));
        double values[IO_CHANNEL_COUNT][RENDER_GATHER_TERMS], terms[RENDER_GATHER_TERMS];
        for (int i = 0; i < RENDER_GATHER_TERMS; i++) {
            const double part = 0.25 * cos(PI * (i + 0.5) / RENDER_GATHER_TERMS); /* of the mantissa */
            const double u = piece_start(p) + ldexp(part + 0.25, p / 2);
            double rgb[IO_CHANNEL_COUNT];
            render_split_band_per_mm2(split, band, fmin(sqrt((u - 1) / inverse), planned->r_outer_mm), rgb);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                values[c][i] = rgb[c];
        }
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            fit_cubic(values[c], terms);
            for (int k = 0; k < RENDER_GATHER_TERMS; k++)
                kernel->terms[c][k][column(p)] = (float)terms[k];
        }
    }
    keep_power(split, band, kernel);
    kernel->is_grey = is_grey(kernel);
}

const struct render_gather_loops *render_gather_loops_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return &render_gather_loops_avx2;
#endif
    return &render_gather_loops_portable;
}
