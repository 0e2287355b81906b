/*
 * The beam model of layers (theory.md T23) in MPFR, by the textbook: in each layer phi = C e^(-qz) +
 * E e^(-q(d - z)) + particular solution, all conditions in one banded system, Gaussian elimination with
 * pivoting; the beams from a linear system of their own. Nothing is rearranged against cancellation: the
 * precision is raised until it does not matter. A is taken from the library (test_fresnel.c has its
 * oracle).
 *
 * Profiles from it: R^ and T^ along the real k axis, interpolated by polynomials on each octave, are
 * integrated against J_0(kr) k between the zeros of J_0, and the alternating sums averaged (Euler).
 */
#ifndef ORACLE_LAYERS_H
#define ORACLE_LAYERS_H

#include "libdipole/dipole.h"

#include <math.h>
#include <mpfr.h>
#include <stdbool.h>
#include <stdlib.h>

enum { ORACLE_UNKNOWNS = 2 * DIPOLE_LAYER_LIMIT };
enum {
    ORACLE_Q,
    ORACLE_SIGMA_T,
    ORACLE_DQ,
    ORACLE_D_SIGMA_T,
    ORACLE_FADE_Q,
    ORACLE_FADE_T,
    ORACLE_DOWN,
    ORACLE_UP,
    ORACLE_LAYER_NUMBERS
};

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
    /* of each layer q, sigma_t', D q, D sigma_t', e^(-qd), e^(-sigma_t' d), amplitudes of what the beams
     * cause */
    mpfr_t layer[DIPOLE_LAYER_LIMIT][ORACLE_LAYER_NUMBERS];
    mpfr_t a, b, c;
};

/* ---- linear equations ----------------------------------------------------------------------------- */

static inline void oracle_precision_set(struct layers_oracle *o, size_t unknowns, mpfr_prec_t bits)
{
    o->unknowns = unknowns;
    for (size_t i = 0; i < unknowns; i++)
        for (size_t j = i > 9 ? i - 9 : 0; j <= unknowns;
             j = j < unknowns && j == i + 9 ? unknowns : j + 1) {
            mpfr_set_prec(o->rows[i][j], bits);
            mpfr_set_zero(o->rows[i][j], 1);
        }
    for (size_t i = 0; i < o->count; i++)
        for (int k = 0; k < ORACLE_LAYER_NUMBERS; k++)
            mpfr_set_prec(o->layer[i][k], bits);
    mpfr_set_prec(o->a, bits);
    mpfr_set_prec(o->b, bits);
    mpfr_set_prec(o->c, bits);
}

/* Gauss; no entry is farther than 3 from the diagonal, 6 after swaps. The solution ends in the right side.
 */
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
 * Unknowns down_0, up_0, down_1, ...: at an interface with reflectance r, arriving from above and below
 * with a = down_i through_i and b = up_(i+1) through_(i+1), down_(i+1) = (1 - r) a + r b, up_i = r a + (1 -
 * r) b.
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
static inline void layers_oracle_init(struct layers_oracle *o, const dipole_layer *layers,
                                      const dipole_coefficients *coefficients, size_t count)
{
    o->count = count;
    o->layers = layers;
    o->is_half_space = isinf(layers[count - 1].thickness_mm);
    o->boundary_a[0] = coefficients[0].boundary_a;
    o->boundary_a[1] = coefficients[count - 1].boundary_a;
    for (size_t i = 0; i < ORACLE_UNKNOWNS; i++)
        for (size_t j = 0; j <= ORACLE_UNKNOWNS; j++)
            mpfr_init2(o->rows[i][j], 64);
    for (size_t i = 0; i < DIPOLE_LAYER_LIMIT; i++) {
        mpfr_inits2(512, o->down[i], o->up[i], (mpfr_ptr)0);
        for (int k = 0; k < ORACLE_LAYER_NUMBERS; k++)
            mpfr_init2(o->layer[i][k], 64);
    }
    mpfr_inits2(512, o->a, o->b, o->c, (mpfr_ptr)0);
    oracle_beams(o);
}

static inline void layers_oracle_clear(struct layers_oracle *o)
{
    for (size_t i = 0; i < ORACLE_UNKNOWNS; i++)
        for (size_t j = 0; j <= ORACLE_UNKNOWNS; j++)
            mpfr_clear(o->rows[i][j]);
    for (size_t i = 0; i < DIPOLE_LAYER_LIMIT; i++) {
        mpfr_clears(o->down[i], o->up[i], (mpfr_ptr)0);
        for (int k = 0; k < ORACLE_LAYER_NUMBERS; k++)
            mpfr_clear(o->layer[i][k]);
    }
    mpfr_clears(o->a, o->b, o->c, (mpfr_ptr)0);
}

/* Enough bits for T^ down to 1e-300 to be right to 1e-60: what e^(-qd) takes away, and what thin layers do,
 * where the two solutions of a layer meet. */
static inline mpfr_prec_t oracle_bits(const struct layers_oracle *o, double k)
{
    double bits = 320.0, depth = 0.0;
    for (size_t i = 0; i < o->count; i++) {
        const dipole_medium *const m = &o->layers[i].medium;
        const double q =
            sqrt(k * k + 3.0 * m->sigma_a_per_mm * (m->sigma_a_per_mm + m->sigma_s_prime_per_mm));
        if (isinf(o->layers[i].thickness_mm))
            continue;
        depth += q * o->layers[i].thickness_mm;
        bits += 2.0 * fmax(0.0, -log2(q * o->layers[i].thickness_mm));
    }
    return (mpfr_prec_t)(bits + 1.5 * fmin(depth, 750.0));
}

/* Adds coefficient_phi phi + coefficient_flux D phi' at the top or bottom of a layer to a row: what C (way
 * 0, decaying downwards) or E (way 1, upwards) contributes, and the particular solution on the right side.
 */
static inline void oracle_condition(struct layers_oracle *o, size_t row, size_t i, bool is_bottom,
                                    double coefficient_phi, double coefficient_flux)
{
    const size_t n = o->unknowns;
    const size_t way_count = isinf(o->layers[i].thickness_mm) ? 1 : 2;
    for (size_t way = 0; way < way_count; way++) {
        const bool is_far = is_bottom == (way == 0); /* from where the exponential is 1 */
        const double flux = way == 0 ? -coefficient_flux : coefficient_flux;
        mpfr_mul_d(o->a, o->layer[i][ORACLE_DQ], flux, MPFR_RNDN);
        mpfr_add_d(o->a, o->a, coefficient_phi, MPFR_RNDN);
        if (is_far)
            mpfr_mul(o->a, o->a, o->layer[i][ORACLE_FADE_Q], MPFR_RNDN);
        mpfr_add(o->rows[row][2 * i + way], o->rows[row][2 * i + way], o->a, MPFR_RNDN);
        mpfr_mul_d(o->a, o->layer[i][ORACLE_D_SIGMA_T], flux, MPFR_RNDN);
        mpfr_add_d(o->a, o->a, coefficient_phi, MPFR_RNDN);
        mpfr_mul(o->a, o->a, o->layer[i][way == 0 ? ORACLE_DOWN : ORACLE_UP], MPFR_RNDN);
        if (is_far)
            mpfr_mul(o->a, o->a, o->layer[i][ORACLE_FADE_T], MPFR_RNDN);
        mpfr_sub(o->rows[row][n], o->rows[row][n], o->a, MPFR_RNDN);
    }
}

/* phi at the top or bottom over 2A: what leaves there. o->rows must be solved. */
static inline double oracle_leaving(struct layers_oracle *o, size_t i, bool is_bottom, double a)
{
    const size_t way_count = isinf(o->layers[i].thickness_mm) ? 1 : 2;
    mpfr_set_zero(o->c, 1);
    for (size_t way = 0; way < way_count; way++) {
        const bool is_far = is_bottom == (way == 0);
        mpfr_set(o->a, o->rows[2 * i + way][o->unknowns], MPFR_RNDN);
        mpfr_set(o->b, o->layer[i][way == 0 ? ORACLE_DOWN : ORACLE_UP], MPFR_RNDN);
        if (is_far) {
            mpfr_mul(o->a, o->a, o->layer[i][ORACLE_FADE_Q], MPFR_RNDN);
            mpfr_mul(o->b, o->b, o->layer[i][ORACLE_FADE_T], MPFR_RNDN);
        }
        mpfr_add(o->c, o->c, o->a, MPFR_RNDN);
        mpfr_add(o->c, o->c, o->b, MPFR_RNDN);
    }
    mpfr_div_d(o->c, o->c, 2.0 * a, MPFR_RNDN);
    return mpfr_get_d(o->c, MPFR_RNDN);
}

/* The numbers of a layer at k. A beam causes sigma_s' beam/(D (q^2 - sigma_t'^2)) e^(-sigma_t' ...). */
static inline void oracle_layer_fill(struct layers_oracle *o, size_t i, double k)
{
    const dipole_medium *const m = &o->layers[i].medium;
    mpfr_t *const x = o->layer[i];
    mpfr_set_d(x[ORACLE_SIGMA_T], m->sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(x[ORACLE_SIGMA_T], x[ORACLE_SIGMA_T], m->sigma_s_prime_per_mm, MPFR_RNDN);
    mpfr_mul_ui(o->a, x[ORACLE_SIGMA_T], 3, MPFR_RNDN);
    mpfr_ui_div(o->b, 1, o->a, MPFR_RNDN); /* D */
    mpfr_mul_d(o->a, o->a, m->sigma_a_per_mm, MPFR_RNDN);
    mpfr_set_d(o->c, k, MPFR_RNDN);
    mpfr_sqr(o->c, o->c, MPFR_RNDN);
    mpfr_add(o->c, o->c, o->a, MPFR_RNDN); /* q^2 */
    mpfr_sqrt(x[ORACLE_Q], o->c, MPFR_RNDN);
    mpfr_mul(x[ORACLE_DQ], o->b, x[ORACLE_Q], MPFR_RNDN);
    mpfr_mul(x[ORACLE_D_SIGMA_T], o->b, x[ORACLE_SIGMA_T], MPFR_RNDN);
    mpfr_sqr(o->a, x[ORACLE_SIGMA_T], MPFR_RNDN);
    mpfr_sub(o->c, o->c, o->a, MPFR_RNDN);
    mpfr_mul(o->c, o->c, o->b, MPFR_RNDN);
    mpfr_d_div(o->c, m->sigma_s_prime_per_mm, o->c, MPFR_RNDN);
    mpfr_mul(x[ORACLE_DOWN], o->c, o->down[i], MPFR_RNDN);
    mpfr_mul(x[ORACLE_UP], o->c, o->up[i], MPFR_RNDN);
    if (isinf(o->layers[i].thickness_mm))
        return;
    oracle_through(o, i, x[ORACLE_FADE_T]);
    mpfr_mul_d(x[ORACLE_FADE_Q], x[ORACLE_Q], -o->layers[i].thickness_mm, MPFR_RNDN);
    mpfr_exp(x[ORACLE_FADE_Q], x[ORACLE_FADE_Q], MPFR_RNDN);
}

/* R^(k), T^(k), k > 0; as k goes to 0 the totals. */
static inline void layers_oracle_response(void *oracle, double k, double out[2])
{
    struct layers_oracle *const o = oracle;
    const size_t n = 2 * o->count - (o->is_half_space ? 1 : 0);
    oracle_precision_set(o, n, oracle_bits(o, k));
    for (size_t i = 0; i < o->count; i++)
        oracle_layer_fill(o, i, k);
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

/* ---- profiles ------------------------------------------------------------------------------------- */

enum { ORACLE_POINTS = 22, ORACLE_OCTAVES = 80 };

/* R^ and T^ at k of what an oracle knows. */
typedef void oracle_response(void *oracle, double k, double out[2]);

/* R^ and T^ from k_lo on, each octave at Chebyshev's points. Below k_lo they are constant. */
struct layers_spectrum {
    oracle_response *response;
    void *oracle;
    double k_lo;
    int octave_count;
    double values[2][ORACLE_OCTAVES][ORACLE_POINTS];
};

static inline double oracle_chebyshev(int i)
{
    return cos(3.14159265358979323846 * (i + 0.5) / ORACLE_POINTS);
}

/* The octaves are solved as they are asked for. */
static inline void layers_spectrum_init(struct layers_spectrum *s, oracle_response *response, void *oracle,
                                        double k_lo)
{
    s->response = response;
    s->oracle = oracle;
    s->k_lo = k_lo;
    s->octave_count = 0;
}

static inline double layers_spectrum_at(struct layers_spectrum *s, int face, double k)
{
    if (k < s->k_lo)
        k = s->k_lo;
    const int octave = (int)floor(log2(k / s->k_lo));
    while (s->octave_count <= octave) {
        for (int i = 0; i < ORACLE_POINTS; i++) {
            double f[2];
            s->response(s->oracle, ldexp(s->k_lo, s->octave_count) * (1.5 + 0.5 * oracle_chebyshev(i)), f);
            s->values[0][s->octave_count][i] = f[0];
            s->values[1][s->octave_count][i] = f[1];
        }
        s->octave_count++;
    }
    /* barycentric */
    const double x = 2.0 * (k / ldexp(s->k_lo, octave)) - 3.0;
    double above = 0.0, below = 0.0;
    for (int i = 0; i < ORACLE_POINTS; i++) {
        const double gap = x - oracle_chebyshev(i);
        if (gap == 0.0)
            return s->values[face][octave][i];
        const double weight =
            (i % 2 ? -1.0 : 1.0) * sin(3.14159265358979323846 * (i + 0.5) / ORACLE_POINTS) / gap;
        above += weight * s->values[face][octave][i];
        below += weight;
    }
    return above / below;
}

/* int F J_0(kr) k dk over an interval, within one octave of k and 4 of kr, by Gauss's rule. */
static inline double oracle_piece(struct layers_spectrum *s, int face, double r_mm, double lo, double hi)
{
    static const double gauss[8][2] = {
        { 0.095012509837637440185, 0.189450610455068496285 },
        { 0.281603550779258913230, 0.182603415044923588867 },
        { 0.458016777657227386342, 0.169156519395002538189 },
        { 0.617876244402643748447, 0.149595988816576732081 },
        { 0.755404408355003033895, 0.124628971255533872052 },
        { 0.865631202387831743880, 0.095158511682492784810 },
        { 0.944575023073232576078, 0.062253523938647892863 },
        { 0.989400934991649932596, 0.027152459411754094852 },
    };
    double sum = 0.0;
    for (int i = 0; i < 16; i++) {
        const double k = 0.5 * (lo + hi) + (i % 2 ? -0.5 : 0.5) * (hi - lo) * gauss[i / 2][0];
        sum += gauss[i / 2][1] * layers_spectrum_at(s, face, k) * j0(k * r_mm) * k;
    }
    return 0.5 * (hi - lo) * sum;
}

/* The same over any interval. */
static inline double oracle_integral(struct layers_spectrum *s, int face, double r_mm, double lo, double hi)
{
    double sum = 0.0;
    if (lo < s->k_lo) {
        const double end = fmin(hi, s->k_lo);
        sum = 0.5 * (end - lo) * (end + lo) * layers_spectrum_at(s, face, s->k_lo); /* k_lo r is small */
        lo = end;
    }
    while (lo < hi) {
        const int octave = (int)floor(log2(lo / s->k_lo * (1.0 + 1e-12)));
        const double end = fmin(fmin(hi, ldexp(s->k_lo, octave + 1)), lo + 4.0 / r_mm);
        sum += oracle_piece(s, face, r_mm, lo, end * (1.0 - 1e-15));
        lo = end;
    }
    return sum;
}

/* The profile: integrals between zeros of J_0, near (n - 1/4) pi, until F is nothing; else the limit of
 * their alternating sum by averaging neighbouring partial sums again and again, which is kind to rounding.
 */
static inline double layers_oracle_profile(struct layers_spectrum *s, int face, double r_mm)
{
    enum { STEPS = 72, PLAIN = 24 };
    const double pi = 3.14159265358979323846;
    double sums[STEPS], sum = 0.0, lo = 0.0, largest = 0.0;
    for (int n = 0; n < STEPS; n++) {
        const double hi = (n + 0.75) * pi / r_mm, piece = oracle_integral(s, face, r_mm, lo, hi);
        sum += piece;
        largest = fmax(largest, fabs(sum));
        lo = hi;
        if (fabs(piece) < 1e-17 * largest && n > 1)
            return sum / (2.0 * pi);
        sums[n] = sum;
    }
    for (int end = STEPS - 1; end > PLAIN; end--)
        for (int n = PLAIN; n < end; n++)
            sums[n] = 0.5 * (sums[n] + sums[n + 1]);
    return sums[PLAIN] / (2.0 * pi);
}

#endif
