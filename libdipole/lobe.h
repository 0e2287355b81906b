/*
 * One lobe: what a source at depth z under the surface of a half-space, with phi = 0 at the surface, sends
 * out at distance r. docs/theory.md T5, T7, T8, T12.
 *
 * Light that came far fades as e^(-x), x = sigma_tr d up to 745, and an error of one part in 2^53 of x
 * would cost 10 bits of the result. So depths, sigma_tr, d and x carry a second double (dd.h); everything
 * else is a few roundings. No function branches, so that the compiler can run a loop over them in vector
 * registers.
 */
#ifndef LIBDIPOLE_LOBE_H
#define LIBDIPOLE_LOBE_H

#include "dd.h"

#include <stdint.h>

/* Beyond this distance no source is seen at an angle: z <= 1e54 mm. And this stands for infinity. */
#define LOBE_FAR_MM 1e140
#define LOBE_END_MM 1e300

/* ---- e^(-x) --------------------------------------------------------------------------------------- */

/* (1 + excess) scale_1 scale_2, |excess| < 0.42; the scales are powers of two, two of them so that neither
 * underflows before the result does. */
struct decay_parts {
    double excess, scale_1, scale_2;
};

static inline double power_of_two(double n)
{
    union {
        double number;
        uint64_t bits;
    } u = { .number = n + 0x1.8p52 }; /* whose last bits are n */
    u.bits = (u.bits + 1023) << 52;
    return u.number;
}

/* k of e^(-x) = 2^k (1 + excess), |excess| < 0.42, in the last bits of 1.5 2^52 + k. */
static inline double decay_exponent(double x)
{
    return MULTIPLY_ADD(x, -0x1.71547652b82fep+0, 0x1.8p52);
}

/* The excess of e^(-(x + x_low)). The polynomial is within 2e-17 of (e^r - 1 - r)/r^2, times r^2, for |r|
 * up to log(2)/2. */
static inline double decay_excess(double x, double x_low, double k)
{
    const double r =
        MULTIPLY_ADD(k, -0x1.3de6af278ece6p-42, MULTIPLY_ADD(k, -0x1.62e42fefa3000p-1, -x)) - x_low;
    const double r2 = r * r;
    const double p01 = MULTIPLY_ADD(r, 0x1.5555555555556p-3, 0.5);
    const double p23 = MULTIPLY_ADD(r, 0x1.11111111109adp-7, 0x1.5555555553d4fp-5);
    const double p45 = MULTIPLY_ADD(r, 0x1.a01a01a7c8d47p-13, 0x1.6c16c17893833p-10);
    const double p67 = MULTIPLY_ADD(r, 0x1.71de0d9c145d0p-19, 0x1.a019b8ef67c6cp-16);
    const double p89 = MULTIPLY_ADD(r, 0x1.af38d53857513p-26, 0x1.2891a8c1d838dp-22);
    double p = MULTIPLY_ADD(p89, r2, p67);
    p = MULTIPLY_ADD(p, r2, p45);
    p = MULTIPLY_ADD(p, r2, p23);
    p = MULTIPLY_ADD(p, r2, p01);
    return MULTIPLY_ADD(p, r2, r);
}

/* factor e^(-x), for a result that is neither 0 nor subnormal nor infinite. */
static inline double decay_times_normal(double factor, double x)
{
    const double magic = decay_exponent(x), k = magic - 0x1.8p52;
    union {
        double number;
        uint64_t bits;
    } exponent = { .number = magic },
      value = { .number = MULTIPLY_ADD(factor, decay_excess(x, 0.0, k), factor) };
    value.bits += exponent.bits << 52;
    return value.number;
}

/* e^(-(x + x_low)) for x >= 0, as if x were 1400 beyond that, where the result would underflow whatever it
 * is multiplied by. */
static inline struct decay_parts decay_split(double x, double x_low)
{
    const double end = 1400.0;
    const double y = x > end ? end : x, y_low = x > end ? 0.0 : x_low;
    const double k = decay_exponent(y) - 0x1.8p52, half = MULTIPLY_ADD(k, 0.5, 0x1.8p52) - 0x1.8p52;
    return (struct decay_parts){ decay_excess(y, y_low, k), power_of_two(half), power_of_two(k - half) };
}

/* factor e^(-x) */
static inline double decay_times(double factor, struct decay_parts e)
{
    return MULTIPLY_ADD(factor, e.excess, factor) * e.scale_1 * e.scale_2;
}

/* 1 - e^(-x), no digits lost at small x; e^-700 is nothing beside 1 */
static inline double decay_deficit(double x)
{
    const double y = x > 700.0 ? 700.0 : x;
    const double k = decay_exponent(y) - 0x1.8p52, scale = power_of_two(k);
    return (1.0 - scale) - scale * decay_excess(y, 0.0, k);
}

/* ---- where the source is seen from ---------------------------------------------------------------- */

struct lobe_path {
    double d, d2, inverse;    /* distance from the source, its square, and 1/d: mm, mm^2, 1/mm */
    double x;                 /* sigma_tr d                                                    */
    struct decay_parts decay; /* e^(-x)                                                        */
};

/* r >= 0, z > 0; r^2 = r2 + r2_low for r <= LOBE_FAR_MM */
static inline struct lobe_path lobe_path(struct dd z, struct dd sigma_tr, double r, struct dd r2)
{
    const struct dd z2 = dd_product(z.hi, z.hi), d2 = dd_sum(r2.hi, z2.hi);
    const double d2_low = d2.lo + (r2.lo + MULTIPLY_ADD(2.0 * z.hi, z.lo, z2.lo));
    const double root = sqrt(d2.hi);
    const double d = r > LOBE_FAR_MM ? r : root, inverse = 1.0 / d;
    const double root_low = 0.5 * (d2_low - product_error(root, root, d2.hi)) * inverse;
    const double d_low = r > LOBE_FAR_MM ? 0.0 : root_low;
    const double x = sigma_tr.hi * d;
    const double x_low =
        product_error(sigma_tr.hi, d, x) + MULTIPLY_ADD(sigma_tr.hi, d_low, sigma_tr.lo * d);
    return (struct lobe_path){ d, d2.hi, inverse, x, decay_split(x, x_low) };
}

static inline double lobe_distance(double r_mm)
{
    return r_mm > LOBE_END_MM ? LOBE_END_MM : r_mm;
}

/* r^2 of a distance up to LOBE_FAR_MM */
static inline struct dd lobe_square(double r)
{
    const double near = r > LOBE_FAR_MM ? LOBE_FAR_MM : r;
    return dd_product(near, near);
}

/* d - z, without the cancellation of subtracting; r (r/(d + z)) */
static inline double lobe_excess(struct dd z, const struct lobe_path *path, double r)
{
    return r * (r / (path->d + z.hi));
}

/* ---- what it sends out ---------------------------------------------------------------------------- */

/* z (sigma_tr + 1/d) e^(-sigma_tr d)/d^2. T5 */
static inline double lobe_value(struct dd z, struct dd sigma_tr, double r, struct dd r2)
{
    const struct lobe_path path = lobe_path(z, sigma_tr, r, r2);
    const double x = path.x > 1400.0 ? 1400.0 : path.x;
    return decay_times(z.hi * (1.0 + x) / (path.d * path.d2), path.decay);
}

/* (z/d) e^(-sigma_tr d): the part beyond r. T8 */
static inline double lobe_beyond(struct dd z, struct dd sigma_tr, double factor, double r, struct dd r2)
{
    const struct lobe_path path = lobe_path(z, sigma_tr, r, r2);
    return decay_times(factor * (z.hi * path.inverse), path.decay);
}

/* e^(-sigma_tr z) - (z/d) e^(-sigma_tr d), as a sum of two positive terms: the part within r. T7 */
static inline double lobe_within(struct dd z, struct dd sigma_tr, double r, struct dd r2)
{
    const struct lobe_path path = lobe_path(z, sigma_tr, r, r2);
    const double excess = lobe_excess(z, &path, r), y = sigma_tr.hi * excess;
    const double start = sigma_tr.hi * z.hi;
    const double start_low =
        product_error(sigma_tr.hi, z.hi, start) + MULTIPLY_ADD(sigma_tr.hi, z.lo, sigma_tr.lo * z.hi);
    return decay_times(excess * path.inverse + (z.hi * path.inverse) * decay_deficit(y),
                       decay_split(start, start_low));
}

/*
 * Mean of the lobe over a ring. The antiderivative z e^(-sigma d)/d is differenced by hand:
 *   z e^(-s d_lo)/d_lo - z e^(-s d_hi)/d_hi = z e^(-s d_lo)/d_hi [D/d_lo + 1 - e^(-s D)],  D = d_hi - d_lo,
 * and the ring's area is pi D (d_hi + d_lo), so that D divides out and nothing cancels however thin it is.
 */
static inline double lobe_ring_mean(struct dd z, struct dd sigma_tr, double r_lo, struct dd r2_lo,
                                    double r_hi, struct dd r2_hi)
{
    const struct lobe_path lo = lobe_path(z, sigma_tr, r_lo, r2_lo),
                           hi = lobe_path(z, sigma_tr, r_hi, r2_hi);
    const double sum = hi.d + lo.d, difference = (r_hi - r_lo) * ((r_hi + r_lo) / sum);
    const double y = sigma_tr.hi * difference;
    const double fade = y > 1e-300 ? decay_deficit(y) / (y > 1e-300 ? y : 1.0) : 1.0; /* (1 - e^(-y))/y */
    const double slope = lo.inverse + sigma_tr.hi * fade;
    return decay_times(2.0 * (z.hi * hi.inverse) * slope / sum, lo.decay);
}

/*
 * The lobe g and its derivatives. T12. With u = z/d and B = (x + 1) - u^2 (x^2 + 3x + 3):
 *   dg/d log z = (u/d^2) e^(-x) B          dg/d(sigma_tr^2) = -(u/2) e^(-x), finite at sigma_tr = 0
 */
struct lobe_slopes {
    double value, d_log_z, d_sigma_tr2;
};

static inline struct lobe_slopes lobe_slopes(struct dd z, struct dd sigma_tr, double r, struct dd r2)
{
    const struct lobe_path path = lobe_path(z, sigma_tr, r, r2);
    const double x = path.x > 1400.0 ? 1400.0 : path.x, slant = z.hi * path.inverse;
    const double bracket = (1.0 + x) - slant * slant * MULTIPLY_ADD(x + 3.0, x, 3.0);
    const double over_area = slant * path.inverse * path.inverse;
    return (struct lobe_slopes){
        .value = decay_times(over_area * (1.0 + x), path.decay),
        .d_log_z = decay_times(over_area * bracket, path.decay),
        .d_sigma_tr2 = decay_times(-0.5 * slant, path.decay),
    };
}

#endif
