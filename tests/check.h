/* What the tests share: relative comparison in double, and seeded random numbers. */
#ifndef CHECK_H
#define CHECK_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* |found - expected| <= tolerance * |expected|; equal values (zeros, too) always pass. */
static inline void assert_close_at(double found, double expected, double tolerance, const char *file,
                                   int line, const char *format, ...) __attribute__((format(printf, 6, 7)));

static inline void assert_close_at(double found, double expected, double tolerance, const char *file,
                                   int line, const char *format, ...)
{
    if (found == expected || fabs(found - expected) <= tolerance * fabs(expected))
        return;
    char where[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(where, sizeof where, format, arguments);
    va_end(arguments);
    print_error("%s\n  found %.17g, expected %.17g, relative difference %.3g over %.3g\n", where, found,
                expected, fabs(found - expected) / fabs(expected), tolerance);
    _fail(file, line);
}

#define assert_close(found, expected, tolerance, ...)                                                      \
    assert_close_at(found, expected, tolerance, __FILE__, __LINE__, __VA_ARGS__)

/* SplitMix64: small, seeded, the same everywhere. */
struct rng {
    uint64_t seed;
};

static inline uint64_t random_bits(struct rng *rng)
{
    uint64_t z = rng->seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* lo <= value < hi */
static inline double uniform(struct rng *rng, double lo, double hi)
{
    return lo + (hi - lo) * ((double)(random_bits(rng) >> 11) * 0x1p-53);
}

static inline double log_uniform(struct rng *rng, double lo, double hi)
{
    return exp(uniform(rng, log(lo), log(hi)));
}

#endif
