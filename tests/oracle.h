/*
 * The classical dipole in MPFR with 512 bits, from the textbook formulas: no rearranging, so that it is
 * independent of the library's way around cancellation. A is taken from the library (test_fresnel.c has
 * its own oracle for it).
 */
#ifndef ORACLE_H
#define ORACLE_H

#include "libdipole/dipole.h"

#include <math.h>
#include <mpfr.h>

enum { ORACLE_BITS = 512 };

struct oracle {
    mpfr_t sigma_a, alpha_prime, sigma_tr, z[2], r, d, x, e, term, sum, scratch;
};

/* The same medium with sigma_a and sigma_s' moved by steps of any size, A held. */
static inline void oracle_set(struct oracle *o, const dipole_coefficients *c, double step_a, double step_s)
{
    mpfr_set_d(o->sigma_a, c->sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(o->sigma_a, o->sigma_a, step_a, MPFR_RNDN);
    mpfr_set_d(o->alpha_prime, c->sigma_s_prime_per_mm, MPFR_RNDN); /* sigma_s' */
    mpfr_add_d(o->alpha_prime, o->alpha_prime, step_s, MPFR_RNDN);
    mpfr_add(o->scratch, o->sigma_a, o->alpha_prime, MPFR_RNDN); /* sigma_t' */
    mpfr_div(o->alpha_prime, o->alpha_prime, o->scratch, MPFR_RNDN);
    mpfr_mul(o->sigma_tr, o->scratch, o->sigma_a, MPFR_RNDN);
    mpfr_mul_ui(o->sigma_tr, o->sigma_tr, 3, MPFR_RNDN);
    mpfr_sqrt(o->sigma_tr, o->sigma_tr, MPFR_RNDN);
    mpfr_ui_div(o->z[0], 1, o->scratch, MPFR_RNDN);
    mpfr_set_d(o->z[1], c->boundary_a, MPFR_RNDN);
    mpfr_mul_ui(o->z[1], o->z[1], 4, MPFR_RNDN);
    mpfr_div_ui(o->z[1], o->z[1], 3, MPFR_RNDN);
    mpfr_add_ui(o->z[1], o->z[1], 1, MPFR_RNDN);
    mpfr_mul(o->z[1], o->z[1], o->z[0], MPFR_RNDN);
}

static inline void oracle_init(struct oracle *o, const dipole_coefficients *c)
{
    mpfr_inits2(ORACLE_BITS, o->sigma_a, o->alpha_prime, o->sigma_tr, o->z[0], o->z[1], o->r, o->d, o->x,
                o->e, o->term, o->sum, o->scratch, (mpfr_ptr)0);
    oracle_set(o, c, 0.0, 0.0);
}

static inline void oracle_clear(struct oracle *o)
{
    mpfr_clears(o->sigma_a, o->alpha_prime, o->sigma_tr, o->z[0], o->z[1], o->r, o->d, o->x, o->e, o->term,
                o->sum, o->scratch, (mpfr_ptr)0);
}

/* d, x = sigma_tr d and e = e^(-x) of one lobe. */
static inline void oracle_lobe(struct oracle *o, int i, double r_mm)
{
    mpfr_set_d(o->r, r_mm, MPFR_RNDN);
    mpfr_hypot(o->d, o->r, o->z[i], MPFR_RNDN);
    mpfr_mul(o->x, o->sigma_tr, o->d, MPFR_RNDN);
    mpfr_neg(o->e, o->x, MPFR_RNDN);
    mpfr_exp(o->e, o->e, MPFR_RNDN);
}

/* o->sum = alpha'/(4 pi) sum z (x + 1) e^(-x) / d^3; returned rounded, as by all below */
static inline double oracle_rd(struct oracle *o, double r_mm)
{
    mpfr_set_zero(o->sum, 1);
    for (int i = 0; i < 2; i++) {
        oracle_lobe(o, i, r_mm);
        mpfr_add_ui(o->term, o->x, 1, MPFR_RNDN);
        mpfr_mul(o->term, o->term, o->e, MPFR_RNDN);
        mpfr_mul(o->term, o->term, o->z[i], MPFR_RNDN);
        for (int k = 0; k < 3; k++)
            mpfr_div(o->term, o->term, o->d, MPFR_RNDN);
        mpfr_add(o->sum, o->sum, o->term, MPFR_RNDN);
    }
    mpfr_mul(o->sum, o->sum, o->alpha_prime, MPFR_RNDN);
    mpfr_const_pi(o->scratch, MPFR_RNDN);
    mpfr_mul_ui(o->scratch, o->scratch, 4, MPFR_RNDN);
    mpfr_div(o->sum, o->sum, o->scratch, MPFR_RNDN);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

/* o->sum = sum z e^(-x)/d, what leaves beyond r but for alpha'/2 */
static inline void oracle_beyond(struct oracle *o, double r_mm)
{
    mpfr_set_zero(o->sum, 1);
    for (int i = 0; i < 2; i++) {
        oracle_lobe(o, i, r_mm);
        mpfr_mul(o->term, o->e, o->z[i], MPFR_RNDN);
        mpfr_div(o->term, o->term, o->d, MPFR_RNDN);
        mpfr_add(o->sum, o->sum, o->term, MPFR_RNDN);
    }
}

/* alpha'/2 (beyond(lo) - beyond(hi)); hi < 0 for infinity */
static inline double oracle_between(struct oracle *o, double r_lo_mm, double r_hi_mm)
{
    mpfr_t lo;
    mpfr_init2(lo, ORACLE_BITS);
    oracle_beyond(o, r_lo_mm);
    mpfr_set(lo, o->sum, MPFR_RNDN);
    if (r_hi_mm >= 0.0) {
        oracle_beyond(o, r_hi_mm);
        mpfr_sub(lo, lo, o->sum, MPFR_RNDN);
    }
    mpfr_mul(lo, lo, o->alpha_prime, MPFR_RNDN);
    mpfr_div_ui(lo, lo, 2, MPFR_RNDN);
    mpfr_set(o->sum, lo, MPFR_RNDN);
    mpfr_clear(lo);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

static inline double oracle_tail(struct oracle *o, double r_mm)
{
    mpfr_t tail;
    mpfr_init2(tail, ORACLE_BITS);
    oracle_beyond(o, r_mm);
    mpfr_set(tail, o->sum, MPFR_RNDN);
    oracle_beyond(o, 0.0);
    mpfr_div(tail, tail, o->sum, MPFR_RNDN);
    mpfr_set(o->sum, tail, MPFR_RNDN);
    mpfr_clear(tail);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

/* The mean of R_d over a ring. */
static inline double oracle_ring_mean(struct oracle *o, double r_lo_mm, double r_hi_mm)
{
    oracle_between(o, r_lo_mm, r_hi_mm);
    mpfr_set_d(o->d, r_hi_mm, MPFR_RNDN);
    mpfr_sqr(o->d, o->d, MPFR_RNDN);
    mpfr_set_d(o->r, r_lo_mm, MPFR_RNDN);
    mpfr_sqr(o->r, o->r, MPFR_RNDN);
    mpfr_sub(o->d, o->d, o->r, MPFR_RNDN);
    mpfr_div(o->sum, o->sum, o->d, MPFR_RNDN);
    mpfr_const_pi(o->scratch, MPFR_RNDN);
    mpfr_div(o->sum, o->sum, o->scratch, MPFR_RNDN);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

/* dR_d/dsigma_a or dR_d/dsigma_s' by the difference over a step that is far below what 53 bits resolve and
 * far above what 512 do: central, or forward at 0. */
static inline double oracle_derivative(struct oracle *o, const dipole_coefficients *c, bool is_by_sigma_a,
                                       double r_mm)
{
    const double sigma = is_by_sigma_a ? c->sigma_a_per_mm : c->sigma_s_prime_per_mm;
    const double step = ldexp(sigma > 0.0 ? sigma : c->sigma_t_prime_per_mm, sigma > 0.0 ? -120 : -240);
    mpfr_t ahead;
    mpfr_init2(ahead, ORACLE_BITS);
    oracle_set(o, c, is_by_sigma_a ? step : 0.0, is_by_sigma_a ? 0.0 : step);
    oracle_rd(o, r_mm);
    mpfr_set(ahead, o->sum, MPFR_RNDN);
    const double back = sigma > 0.0 ? -step : 0.0;
    oracle_set(o, c, is_by_sigma_a ? back : 0.0, is_by_sigma_a ? 0.0 : back);
    oracle_rd(o, r_mm);
    mpfr_sub(o->sum, ahead, o->sum, MPFR_RNDN);
    mpfr_div_d(o->sum, o->sum, step - back, MPFR_RNDN);
    mpfr_clear(ahead);
    oracle_set(o, c, 0.0, 0.0);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

/* How far found is from o->sum in units in the last place of a double that size. */
static inline double oracle_ulp(struct oracle *o, double found)
{
    if (mpfr_zero_p(o->sum) || mpfr_get_exp(o->sum) < -1100) /* rounds to 0 */
        return found / 0x1p-1074;
    const long exponent = mpfr_get_exp(o->sum) < -1021 ? -1074 : mpfr_get_exp(o->sum) - 53;
    mpfr_d_sub(o->scratch, found, o->sum, MPFR_RNDN);
    mpfr_mul_2si(o->scratch, o->scratch, -exponent, MPFR_RNDN);
    return fabs(mpfr_get_d(o->scratch, MPFR_RNDN));
}

/* alpha'/2 sum e^(-z sqrt(sigma_tr^2 + k^2)) */
static inline double oracle_spectrum(struct oracle *o, double k_per_mm)
{
    mpfr_set_zero(o->sum, 1);
    mpfr_set_d(o->r, k_per_mm, MPFR_RNDN);
    mpfr_hypot(o->d, o->r, o->sigma_tr, MPFR_RNDN);
    for (int i = 0; i < 2; i++) {
        mpfr_mul(o->term, o->d, o->z[i], MPFR_RNDN);
        mpfr_neg(o->term, o->term, MPFR_RNDN);
        mpfr_exp(o->term, o->term, MPFR_RNDN);
        mpfr_add(o->sum, o->sum, o->term, MPFR_RNDN);
    }
    mpfr_mul(o->sum, o->sum, o->alpha_prime, MPFR_RNDN);
    mpfr_div_ui(o->sum, o->sum, 2, MPFR_RNDN);
    return mpfr_get_d(o->sum, MPFR_RNDN);
}

#endif
