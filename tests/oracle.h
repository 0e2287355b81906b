/*
 * The classical dipole in MPFR with 512 bits, from the textbook formulas: no rearranging, so that it is
 * independent of the library's way around cancellation. A is taken from the library (test_fresnel.c has
 * its own oracle for it).
 */
#ifndef ORACLE_H
#define ORACLE_H

#include "libdipole/dipole.h"

#include <mpfr.h>

enum { ORACLE_BITS = 512 };

struct oracle {
    mpfr_t alpha_prime, sigma_tr, z[2], r, d, x, e, term, sum, scratch;
};

static inline void oracle_init(struct oracle *o, const dipole_coefficients *c)
{
    mpfr_inits2(ORACLE_BITS, o->alpha_prime, o->sigma_tr, o->z[0], o->z[1], o->r, o->d, o->x, o->e, o->term,
                o->sum, o->scratch, (mpfr_ptr)0);
    mpfr_set_d(o->scratch, c->sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(o->scratch, o->scratch, c->sigma_s_prime_per_mm, MPFR_RNDN); /* sigma_t' */
    mpfr_d_div(o->alpha_prime, c->sigma_s_prime_per_mm, o->scratch, MPFR_RNDN);
    mpfr_mul_d(o->sigma_tr, o->scratch, c->sigma_a_per_mm, MPFR_RNDN);
    mpfr_mul_ui(o->sigma_tr, o->sigma_tr, 3, MPFR_RNDN);
    mpfr_sqrt(o->sigma_tr, o->sigma_tr, MPFR_RNDN);
    mpfr_ui_div(o->z[0], 1, o->scratch, MPFR_RNDN);
    mpfr_set_d(o->z[1], c->boundary_a, MPFR_RNDN);
    mpfr_mul_ui(o->z[1], o->z[1], 4, MPFR_RNDN);
    mpfr_div_ui(o->z[1], o->z[1], 3, MPFR_RNDN);
    mpfr_add_ui(o->z[1], o->z[1], 1, MPFR_RNDN);
    mpfr_mul(o->z[1], o->z[1], o->z[0], MPFR_RNDN);
}

static inline void oracle_clear(struct oracle *o)
{
    mpfr_clears(o->alpha_prime, o->sigma_tr, o->z[0], o->z[1], o->r, o->d, o->x, o->e, o->term, o->sum,
                o->scratch, (mpfr_ptr)0);
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

/* alpha'/(4 pi) sum z (x + 1) e^(-x) / d^3 */
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
    const double result = mpfr_get_d(lo, MPFR_RNDN);
    mpfr_clear(lo);
    return result;
}

static inline double oracle_tail(struct oracle *o, double r_mm)
{
    mpfr_t tail;
    mpfr_init2(tail, ORACLE_BITS);
    oracle_beyond(o, r_mm);
    mpfr_set(tail, o->sum, MPFR_RNDN);
    oracle_beyond(o, 0.0);
    mpfr_div(tail, tail, o->sum, MPFR_RNDN);
    const double result = mpfr_get_d(tail, MPFR_RNDN);
    mpfr_clear(tail);
    return result;
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
