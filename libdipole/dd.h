/*
 * Double-double numbers: hi + lo, about 32 digits. For exponents and sums whose terms cancel.
 *
 * The exact error of a product comes from a fused multiply-add where the processor has one, and from
 * splitting the factors (Dekker 1971) where it has none: the result is the same. Arguments are between
 * 1e-145 and 1e145 in magnitude, or their low parts do not matter.
 */
#ifndef LIBDIPOLE_DD_H
#define LIBDIPOLE_DD_H

#include <math.h>

struct dd {
    double hi, lo;
};

#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__ARM_FEATURE_FMA)
#define MULTIPLY_ADD(a, b, c) __builtin_fma(a, b, c)

static inline double product_error(double a, double b, double product)
{
    return __builtin_fma(a, b, -product);
}
#else
#define MULTIPLY_ADD(a, b, c) ((a) * (b) + (c))

static inline double product_error(double a, double b, double product)
{
    const double split = 134217729.0; /* 2^27 + 1 */
    const double a_part = split * a, b_part = split * b;
    const double a_hi = a_part - (a_part - a), b_hi = b_part - (b_part - b);
    const double a_lo = a - a_hi, b_lo = b - b_hi;
    return ((a_hi * b_hi - product) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo;
}
#endif

/* Exact. */
static inline struct dd dd_sum(double a, double b)
{
    const double hi = a + b, part = hi - a;
    return (struct dd){ hi, (a - (hi - part)) + (b - part) };
}

/* Exact where |a| >= |b|. */
static inline struct dd dd_sum_ordered(double a, double b)
{
    const double hi = a + b;
    return (struct dd){ hi, b - (hi - a) };
}

/* Exact. */
static inline struct dd dd_product(double a, double b)
{
    const double hi = a * b;
    return (struct dd){ hi, product_error(a, b, hi) };
}

static inline struct dd dd_add(struct dd a, struct dd b)
{
    const struct dd hi = dd_sum(a.hi, b.hi), lo = dd_sum(a.lo, b.lo);
    const struct dd sum = dd_sum_ordered(hi.hi, hi.lo + lo.hi);
    return dd_sum_ordered(sum.hi, sum.lo + lo.lo);
}

static inline struct dd dd_negate(struct dd a)
{
    return (struct dd){ -a.hi, -a.lo };
}

static inline struct dd dd_multiply(struct dd a, struct dd b)
{
    const struct dd hi = dd_product(a.hi, b.hi);
    return dd_sum_ordered(hi.hi, hi.lo + (a.hi * b.lo + a.lo * b.hi));
}

static inline struct dd dd_scale(double s, struct dd a)
{
    return dd_multiply((struct dd){ s, 0.0 }, a);
}

static inline struct dd dd_divide(struct dd a, struct dd b)
{
    const double first = a.hi / b.hi;
    const struct dd rest = dd_add(a, dd_negate(dd_scale(first, b)));
    return dd_sum_ordered(first, (rest.hi + rest.lo) / b.hi);
}

/* a >= 0 */
static inline struct dd dd_root(struct dd a)
{
    const double root = sqrt(a.hi);
    if (!(root > 0.0))
        return (struct dd){ root, 0.0 };
    const struct dd rest = dd_add(a, dd_negate(dd_product(root, root)));
    return dd_sum_ordered(root, 0.5 * (rest.hi + rest.lo) / root);
}

/* e^(-x) 2^-*exponent for 0 <= x < 1500; relative error below 1e-25. */
static inline struct dd dd_decay(struct dd x, int *exponent)
{
    const double k = nearbyint(-x.hi * 0x1.71547652b82fep+0);
    const struct dd ln2_lo = { 0x1.3de6af278ece6p-42, 0x1.f97b57a079a19p-103 };
    struct dd rest =
        dd_add((struct dd){ k * -0x1.62e42fefa3000p-1, 0.0 }, dd_negate(x)); /* exact product */
    rest = dd_add(rest, dd_scale(-k, ln2_lo));
    /* e^t - 1 for t = rest/512 by its series, whose later terms need no second double; then doubled nine
     * times: 1 + p becomes (1 + p)^2 */
    const struct dd t = { 0x1p-9 * rest.hi, 0x1p-9 * rest.lo },
                    sixth = { 0x1.5555555555555p-3, 0x1.5555555555555p-57 };
    const double later = 1.0 / 24.0 + t.hi * (1.0 / 120.0 + t.hi * (1.0 / 720.0 + t.hi * (1.0 / 5040.0)));
    const struct dd cubic = dd_add(sixth, dd_product(t.hi, later));
    const struct dd square = dd_add((struct dd){ 0.5, 0.0 }, dd_multiply(t, cubic));
    struct dd p = dd_add(t, dd_multiply(dd_multiply(t, t), square));
    for (int i = 0; i < 9; i++)
        p = dd_add(dd_scale(2.0, p), dd_multiply(p, p));
    *exponent = (int)k;
    return dd_add((struct dd){ 1.0, 0.0 }, p);
}

#endif
