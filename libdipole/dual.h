/* Dual numbers: a complex value and its derivative with respect to one real parameter. */
#ifndef LIBDIPOLE_DUAL_H
#define LIBDIPOLE_DUAL_H

#include <complex.h>
#include <math.h>

#ifndef CMPLX /* C11, but glibc defines it for gcc alone */
#define CMPLX(re, im) __builtin_complex((double)(re), (double)(im))
#endif

struct dual {
    double complex v, d;
};

static inline struct dual constant(double v)
{
    return (struct dual){ v, 0.0 };
}

static inline struct dual add(struct dual a, struct dual b)
{
    return (struct dual){ a.v + b.v, a.d + b.d };
}

static inline struct dual subtract(struct dual a, struct dual b)
{
    return (struct dual){ a.v - b.v, a.d - b.d };
}

static inline struct dual multiply(struct dual a, struct dual b)
{
    return (struct dual){ a.v * b.v, a.d * b.v + a.v * b.d };
}

/* |re| + |im|, within sqrt(2) of the modulus */
static inline double size(double complex x)
{
    return fabs(creal(x)) + fabs(cimag(x));
}

/* 1/x by Smith's method: no part is squared, so nothing overflows on the way. */
static inline double complex inverse_of(double complex x)
{
    const double a = creal(x), b = cimag(x);
    if (fabs(a) >= fabs(b)) {
        const double r = b / a, d = 1.0 / (a + b * r);
        return CMPLX(d, -r * d);
    }
    const double r = a / b, d = 1.0 / (b + a * r);
    return CMPLX(r * d, -d);
}

static inline struct dual divide(struct dual a, struct dual b)
{
    const double complex inverse = inverse_of(b.v), v = a.v * inverse;
    return (struct dual){ v, (a.d - v * b.d) * inverse };
}

static inline struct dual scale(double s, struct dual a)
{
    return (struct dual){ s * a.v, s * a.d };
}

/* A root of 0 with a derivative of 0/0 (sigma_tr = 0 at k = 0, with respect to log sigma_a) has slope 0. */
static inline struct dual root(struct dual a)
{
    const double complex v = csqrt(a.v);
    return (struct dual){ v, a.d == 0.0 ? 0.0 : a.d / (2.0 * v) };
}

/* e^(-x); 0 where it underflows, whatever the angle. */
static inline double complex decay_value(double complex x)
{
    return creal(x) > 745.5 ? 0.0 : cexp(-x);
}

static inline struct dual decay(struct dual x)
{
    const double complex v = decay_value(x.v);
    return (struct dual){ v, -v * x.d };
}

/* 1 - e^(-x), given e^(-x), exact for small x */
static inline double complex fade_value(double complex x, double complex e)
{
    const double a = -creal(x), b = -cimag(x);
    if (fabs(a) + fabs(b) > 0.5)
        return 1.0 - e;
    const double s = sin(0.5 * b);
    return -(expm1(a) * cos(b) - 2.0 * s * s) - I * cimag(e);
}

static inline struct dual fade(struct dual x)
{
    const double complex e = decay_value(x.v);
    return (struct dual){ fade_value(x.v, e), e * x.d };
}

/* (1 - e^(-x))/x, 1 at x = 0 */
static inline struct dual fade_mean(struct dual x)
{
    const double complex y = x.v;
    if (fabs(creal(y)) + fabs(cimag(y)) <
        1e-2) { /* these terms leave 1e-16 of the value, 1e-13 of the slope */
        const double complex v =
            1.0 - y / 2.0 * (1.0 - y / 3.0 * (1.0 - y / 4.0 * (1.0 - y / 5.0 * (1.0 - y / 6.0))));
        const double complex slope =
            -0.5 + y / 3.0 - y * y / 8.0 + y * y * y / 30.0 - y * y * y * y / 144.0;
        return (struct dual){ v, slope * x.d };
    }
    const double complex e = decay_value(y), inverse = inverse_of(y), v = fade_value(y, e) * inverse;
    return (struct dual){ v, (e - v) * inverse * x.d };
}

#endif
