/*
 * The beam model of layers (theory.md T23) in MPFR, by the textbook: in each layer phi = C e^(-qz) +
 * E e^(-q(d - z)) + particular solution, all conditions in one banded system, Gaussian elimination with
 * pivoting; the beams from a linear system of their own. Nothing is rearranged against cancellation: the
 * precision is raised until it does not matter. A is taken from the library (test_fresnel.c has its oracle).
 *
 * Profiles from it: R^ and T^ along the real k axis, interpolated by polynomials on each octave, are
 * integrated against J_0(kr) k between the zeros of J_0, and the sums accelerated by Wynn's algorithm.
 */
#ifndef ORACLE_LAYERS_H
#define ORACLE_LAYERS_H

#include "libdipole/dipole.h"

#include <math.h>
#include <mpfr.h>
#include <stdbool.h>
#include <stdlib.h>

enum { ORACLE_UNKNOWNS = 2 * DIPOLE_LAYER_LIMIT };

struct layers_oracle {
    size_t count;
    bool is_half_space;
    const dipole_layer *layers;
    double boundary_a[2];
    mpfr_t down[DIPOLE_LAYER_LIMIT], up[DIPOLE_LAYER_LIMIT]; /* where they enter the layer */
    double unscattered[2];
    /* a system of equations, its right side in column `unknowns`, and scratch */
    size_t unknowns;
    mpfr_t rows[ORACLE_UNKNOWNS][ORACLE_UNKNOWNS + 1];
    mpfr_t q[DIPOLE_LAYER_LIMIT], diffusion[DIPOLE_LAYER_LIMIT], sigma_t[DIPOLE_LAYER_LIMIT];
    mpfr_t a, b, c;
};

/* ---- linear equations ----------------------------------------------------------------------------- */

static inline void oracle_precision_set(struct layers_oracle *o, size_t unknowns, mpfr_prec_t bits)
{
    o->unknowns = unknowns;
    for (size_t i = 0; i < unknowns; i++)
        for (size_t j = i > 9 ? i - 9 : 0; j <= unknowns; j = j < unknowns && j == i + 9 ? unknowns : j + 1) {
            mpfr_set_prec(o->rows[i][j], bits);
            mpfr_set_zero(o->rows[i][j], 1);
        }
    for (size_t i = 0; i < DIPOLE_LAYER_LIMIT; i++) {
        mpfr_set_prec(o->q[i], bits);
        mpfr_set_prec(o->diffusion[i], bits);
        mpfr_set_prec(o->sigma_t[i], bits);
    }
    mpfr_set_prec(o->a, bits);
    mpfr_set_prec(o->b, bits);
    mpfr_set_prec(o->c, bits);
}

/* Gauss; no entry is farther than 3 from the diagonal, 6 after swaps. The solution ends in the right side. */
static inline void oracle_solve(struct layers_oracle *o)
{
    const size_t n = o->unknowns;
    for (size_t k = 0; k < n; k++) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n && i <= k + 3; i++)
            if (mpfr_cmpabs(o->rows[i][k], o->rows[pivot][k]) > 0)
                pivot = i;
        for (size_t j = k; pivot != k && j <= n; j = j < n && j == k + 6 ? n : j + 1)
            mpfr_swap(o->rows[k][j], o->rows[pivot][j]);
        for (size_t i = k + 1; i < n && i <= k + 3; i++) {
            if (mpfr_zero_p(o->rows[i][k]))
                continue;
            mpfr_div(o->a, o->rows[i][k], o->rows[k][k], MPFR_RNDN);
            for (size_t j = k + 1; j <= n; j = j < n && j == k + 6 ? n : j + 1) {
                mpfr_mul(o->b, o->a, o->rows[k][j], MPFR_RNDN);
                mpfr_sub(o->rows[i][j], o->rows[i][j], o->b, MPFR_RNDN);
            }
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n && j <= k + 6; j++) {
            mpfr_mul(o->b, o->rows[k][j], o->rows[j][n], MPFR_RNDN);
            mpfr_sub(o->rows[k][n], o->rows[k][n], o->b, MPFR_RNDN);
        }
        mpfr_div(o->rows[k][n], o->rows[k][n], o->rows[k][k], MPFR_RNDN);
    }
}

/* ---- beams ---------------------------------------------------------------------------------------- */

/* out = ((n - m)/(n + m))^2 */
static inline void oracle_normal_reflectance(mpfr_t out, double n, double m, mpfr_t scratch)
{
    mpfr_set_d(out, n, MPFR_RNDN);
    mpfr_add_d(scratch, out, m, MPFR_RNDN);
    mpfr_sub_d(out, out, m, MPFR_RNDN);
    mpfr_div(out, out, scratch, MPFR_RNDN);
    mpfr_sqr(out, out, MPFR_RNDN);
}

/* out = e^(-(sigma_a + sigma_s') d) of a layer; 0 for the infinite one */
static inline void oracle_through(const struct layers_oracle *o, size_t i, mpfr_t out)
{
    const dipole_layer *const layer = &o->layers[i];
    mpfr_set_d(out, layer->medium.sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(out, out, layer->medium.sigma_s_prime_per_mm, MPFR_RNDN);
    mpfr_mul_d(out, out, -layer->thickness_mm, MPFR_RNDN);
    mpfr_exp(out, out, MPFR_RNDN);
}

/*
 * Unknowns down_0, up_0, down_1, ...: at an interface with reflectance r, arriving from above and below with
 * a = down_i through_i and b = up_(i+1) through_(i+1), down_(i+1) = (1 - r) a + r b, up_i = r a + (1 - r) b.
 */
static inline void oracle_beams(struct layers_oracle *o)
{
    const size_t n = 2 * o->count;
    mpfr_t r, through;
    mpfr_inits2(512, r, through, (mpfr_ptr)0);
    oracle_precision_set(o, n, 512);
    for (size_t i = 0; i < n; i++)
        mpfr_set_ui(o->rows[i][i], 1, MPFR_RNDN);
    mpfr_set_ui(o->rows[0][n], 1, MPFR_RNDN);
    oracle_normal_reflectance(r, o->layers[0].medium.eta, 1.0, o->b);
    oracle_through(o, 0, through);
    mpfr_mul(o->rows[0][1], r, through, MPFR_RNDN);
    mpfr_neg(o->rows[0][1], o->rows[0][1], MPFR_RNDN);
    for (size_t i = 0; i < o->count; i++) {
        const bool is_last = i + 1 == o->count;
        oracle_normal_reflectance(r, o->layers[i].medium.eta, is_last ? 1.0 : o->layers[i + 1].medium.eta,
                                  o->b);
        oracle_through(o, i, through);
        mpfr_neg(through, through, MPFR_RNDN);
        if (!is_last || !o->is_half_space)
            mpfr_mul(o->rows[2 * i + 1][2 * i], r, through, MPFR_RNDN);
        if (is_last)
            break;
        mpfr_ui_sub(o->c, 1, r, MPFR_RNDN);
        mpfr_mul(o->rows[2 * i + 2][2 * i], o->c, through, MPFR_RNDN);
        oracle_through(o, i + 1, through);
        mpfr_neg(through, through, MPFR_RNDN);
        mpfr_mul(o->rows[2 * i + 2][2 * i + 3], r, through, MPFR_RNDN);
        mpfr_mul(o->rows[2 * i + 1][2 * i + 3], o->c, through, MPFR_RNDN);
    }
    oracle_solve(o);
    for (size_t i = 0; i < o->count; i++) {
        mpfr_set(o->down[i], o->rows[2 * i][n], MPFR_RNDN);
        mpfr_set(o->up[i], o->rows[2 * i + 1][n], MPFR_RNDN);
    }
    oracle_normal_reflectance(r, o->layers[0].medium.eta, 1.0, o->b);
    for (int face = 0; face < 2; face++) {
        const size_t i = face == 0 ? 0 : o->count - 1;
        if (face == 1)
            oracle_normal_reflectance(r, o->layers[i].medium.eta, 1.0, o->b);
        mpfr_ui_sub(r, 1, r, MPFR_RNDN);
        oracle_through(o, i, through);
        mpfr_mul(r, r, through, MPFR_RNDN);
        mpfr_mul(r, r, face == 0 ? o->up[i] : o->down[i], MPFR_RNDN);
        o->unscattered[face] = mpfr_get_d(r, MPFR_RNDN);
    }
    mpfr_clears(r, through, (mpfr_ptr)0);
}

/* ---- one stack ------------------------------------------------------------------------------------ */

/* layers must stay; light from above. */
static inline void layers_oracle_init(struct layers_oracle *o, const dipole_layer *layers, size_t count,
                                      const dipole_stack *stack)
{
    o->count = count;
    o->layers = layers;
    o->is_half_space = isinf(layers[count - 1].thickness_mm);
    o->boundary_a[0] = dipole_stack_coefficients(stack, 0)->boundary_a;
    o->boundary_a[1] = dipole_stack_coefficients(stack, count - 1)->boundary_a;
    for (size_t i = 0; i < ORACLE_UNKNOWNS; i++)
        for (size_t j = 0; j <= ORACLE_UNKNOWNS; j++)
            mpfr_init2(o->rows[i][j], 64);
    for (size_t i = 0; i < DIPOLE_LAYER_LIMIT; i++)
        mpfr_inits2(512, o->q[i], o->diffusion[i], o->sigma_t[i], o->down[i], o->up[i], (mpfr_ptr)0);
    mpfr_inits2(512, o->a, o->b, o->c, (mpfr_ptr)0);
    oracle_beams(o);
}

static inline void layers_oracle_clear(struct layers_oracle *o)
{
    for (size_t i = 0; i < ORACLE_UNKNOWNS; i++)
        for (size_t j = 0; j <= ORACLE_UNKNOWNS; j++)
            mpfr_clear(o->rows[i][j]);
    for (size_t i = 0; i < DIPOLE_LAYER_LIMIT; i++)
        mpfr_clears(o->q[i], o->diffusion[i], o->sigma_t[i], o->down[i], o->up[i], (mpfr_ptr)0);
    mpfr_clears(o->a, o->b, o->c, (mpfr_ptr)0);
}

/* Enough bits for T^ down to 1e-300 to be right to 1e-60: what e^(-qd) takes away, and what thin layers do,
 * where the two solutions of a layer meet. */
static inline mpfr_prec_t oracle_bits(const struct layers_oracle *o, double k)
{
    double bits = 320.0, depth = 0.0;
    for (size_t i = 0; i < o->count; i++) {
        const dipole_medium *const m = &o->layers[i].medium;
        const double q = sqrt(k * k + 3.0 * m->sigma_a_per_mm * (m->sigma_a_per_mm + m->sigma_s_prime_per_mm));
        if (isinf(o->layers[i].thickness_mm))
            continue;
        depth += q * o->layers[i].thickness_mm;
        bits += 2.0 * fmax(0.0, -log2(q * o->layers[i].thickness_mm));
    }
    return (mpfr_prec_t)(bits + 1.5 * fmin(depth, 750.0));
}

/*
 * Adds layer i's part of a condition to a row: coefficient_phi phi + coefficient_flux D phi' at its top
 * (z = 0) or bottom, with the particular solution on the right side. Coefficients are doubles.
 */
static inline void oracle_condition(struct layers_oracle *o, size_t row, size_t i, bool is_bottom,
                                    double coefficient_phi, double coefficient_flux)
{
    const size_t n = o->unknowns;
    const bool is_infinite = isinf(o->layers[i].thickness_mm);
    const double d = o->layers[i].thickness_mm;
    for (int way = 0; way < 2 && !(is_infinite && way == 1); way++) { /* C decays downwards, E upwards */
        const bool is_far = is_bottom == (way == 0); /* e^(-qd) away from where the solution is 1 */
        /* homogeneous: phi = x, D phi' = -/+ D q x */
        mpfr_set_ui(o->a, 1, MPFR_RNDN);
        if (is_far) {
            mpfr_mul_d(o->a, o->q[i], -d, MPFR_RNDN);
            mpfr_exp(o->a, o->a, MPFR_RNDN);
        }
        mpfr_mul(o->b, o->diffusion[i], o->q[i], MPFR_RNDN);
        mpfr_mul_d(o->b, o->b, way == 0 ? -coefficient_flux : coefficient_flux, MPFR_RNDN);
        mpfr_add_d(o->b, o->b, coefficient_phi, MPFR_RNDN);
        mpfr_mul(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_add(o->rows[row][2 * i + (size_t)way], o->rows[row][2 * i + (size_t)way], o->a, MPFR_RNDN);
        /* particular: phi = sigma_s' beam/(D (q^2 - sigma_t^2)) e^(-sigma_t ...) */
        mpfr_sqr(o->a, o->q[i], MPFR_RNDN);
        mpfr_sqr(o->b, o->sigma_t[i], MPFR_RNDN);
        mpfr_sub(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_mul(o->a, o->a, o->diffusion[i], MPFR_RNDN);
        mpfr_div(o->a, way == 0 ? o->down[i] : o->up[i], o->a, MPFR_RNDN);
        mpfr_mul_d(o->a, o->a, o->layers[i].medium.sigma_s_prime_per_mm, MPFR_RNDN);
        if (is_far) {
            oracle_through(o, i, o->b);
            mpfr_mul(o->a, o->a, o->b, MPFR_RNDN);
        }
        mpfr_mul(o->b, o->diffusion[i], o->sigma_t[i], MPFR_RNDN);
        mpfr_mul_d(o->b, o->b, way == 0 ? -coefficient_flux : coefficient_flux, MPFR_RNDN);
        mpfr_add_d(o->b, o->b, coefficient_phi, MPFR_RNDN);
        mpfr_mul(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_sub(o->rows[row][n], o->rows[row][n], o->a, MPFR_RNDN);
    }
}

/* phi at the top or bottom over 2A: what leaves there. o->rows must be solved. */
static inline double oracle_leaving(struct layers_oracle *o, size_t i, bool is_bottom, double a)
{
    const size_t n = o->unknowns;
    const bool is_infinite = isinf(o->layers[i].thickness_mm);
    mpfr_set_zero(o->c, 1);
    for (int way = 0; way < 2 && !(is_infinite && way == 1); way++) {
        const bool is_far = is_bottom == (way == 0);
        mpfr_set(o->a, o->rows[2 * i + (size_t)way][n], MPFR_RNDN);
        if (is_far) {
            mpfr_mul_d(o->b, o->q[i], -o->layers[i].thickness_mm, MPFR_RNDN);
            mpfr_exp(o->b, o->b, MPFR_RNDN);
            mpfr_mul(o->a, o->a, o->b, MPFR_RNDN);
        }
        mpfr_add(o->c, o->c, o->a, MPFR_RNDN);
        mpfr_sqr(o->a, o->q[i], MPFR_RNDN);
        mpfr_sqr(o->b, o->sigma_t[i], MPFR_RNDN);
        mpfr_sub(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_mul(o->a, o->a, o->diffusion[i], MPFR_RNDN);
        mpfr_div(o->a, way == 0 ? o->down[i] : o->up[i], o->a, MPFR_RNDN);
        mpfr_mul_d(o->a, o->a, o->layers[i].medium.sigma_s_prime_per_mm, MPFR_RNDN);
        if (is_far) {
            oracle_through(o, i, o->b);
            mpfr_mul(o->a, o->a, o->b, MPFR_RNDN);
        }
        mpfr_add(o->c, o->c, o->a, MPFR_RNDN);
    }
    mpfr_div_d(o->c, o->c, 2.0 * a, MPFR_RNDN);
    return mpfr_get_d(o->c, MPFR_RNDN);
}

/* R^(k), T^(k), k > 0; as k goes to 0 the totals. */
static inline void layers_oracle_response(struct layers_oracle *o, double k, double out[2])
{
    const size_t n = 2 * o->count - (o->is_half_space ? 1 : 0);
    oracle_precision_set(o, n, oracle_bits(o, k));
    for (size_t i = 0; i < o->count; i++) {
        const dipole_medium *const m = &o->layers[i].medium;
        mpfr_set_d(o->sigma_t[i], m->sigma_a_per_mm, MPFR_RNDN);
        mpfr_add_d(o->sigma_t[i], o->sigma_t[i], m->sigma_s_prime_per_mm, MPFR_RNDN);
        mpfr_mul_ui(o->a, o->sigma_t[i], 3, MPFR_RNDN);
        mpfr_ui_div(o->diffusion[i], 1, o->a, MPFR_RNDN);
        mpfr_mul_d(o->a, o->a, m->sigma_a_per_mm, MPFR_RNDN);
        mpfr_set_d(o->b, k, MPFR_RNDN);
        mpfr_sqr(o->b, o->b, MPFR_RNDN);
        mpfr_add(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_sqrt(o->q[i], o->a, MPFR_RNDN);
    }
    oracle_condition(o, 0, 0, false, 1.0, -2.0 * o->boundary_a[0]); /* phi = 2A D phi' */
    for (size_t i = 0; i + 1 < o->count; i++) {
        const double n_above = o->layers[i].medium.eta, n_below = o->layers[i + 1].medium.eta;
        oracle_condition(o, 2 * i + 1, i, true, n_below * n_below, 0.0);
        oracle_condition(o, 2 * i + 1, i + 1, false, -n_above * n_above, 0.0);
        oracle_condition(o, 2 * i + 2, i, true, 0.0, 1.0);
        oracle_condition(o, 2 * i + 2, i + 1, false, 0.0, -1.0);
    }
    if (!o->is_half_space)
        oracle_condition(o, n - 1, o->count - 1, true, 1.0, 2.0 * o->boundary_a[1]);
    oracle_solve(o);
    out[0] = oracle_leaving(o, 0, false, o->boundary_a[0]);
    out[1] = o->is_half_space ? 0.0 : oracle_leaving(o, o->count - 1, true, o->boundary_a[1]);
}

#endif
