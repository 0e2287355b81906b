/*
 * The exponential modes of layers (theory.md T29) in MPFR, by the textbook: in each layer the phi_m are
 * sums of decaying exponentials with eigenvectors, six unknowns, and a particular solution for each beam;
 * the conditions on waves down and up in one banded system, Gaussian elimination with pivoting. Nothing is
 * rearranged against cancellation: the precision is raised until it does not matter. The means of F over
 * ranges of cosines are taken from the library (test_fresnel.c has their oracle), the beams from
 * oracle_layers.h.
 */
#ifndef ORACLE_MODES_H
#define ORACLE_MODES_H

#include "libdipole/internal.h"
#include "oracle_layers.h"

enum { ORACLE_MODES = 3, MODES_BAND = 9, MODES_UNKNOWNS = 2 * ORACLE_MODES * DIPOLE_LAYER_LIMIT };

struct modes_oracle {
    struct layers_oracle beams;
    size_t unknowns;
    mpfr_t rows[MODES_UNKNOWNS][MODES_UNKNOWNS + 1];
    mpfr_t rate[ORACLE_MODES], weight[ORACLE_MODES], gauss[ORACLE_MODES]; /* t, w and g of Gauss's rule */
    /* of each layer: sigma, q_j, e^(-q_j d), e^(-sigma d), phi_m of each exponential and of a unit of beam,
     * s_m */
    mpfr_t sigma[DIPOLE_LAYER_LIMIT], fade_t[DIPOLE_LAYER_LIMIT];
    mpfr_t q[DIPOLE_LAYER_LIMIT][ORACLE_MODES], fade_q[DIPOLE_LAYER_LIMIT][ORACLE_MODES];
    mpfr_t shape[DIPOLE_LAYER_LIMIT][ORACLE_MODES][ORACLE_MODES]; /* by exponential, then m */
    mpfr_t driven[DIPOLE_LAYER_LIMIT][ORACLE_MODES], s[DIPOLE_LAYER_LIMIT][ORACLE_MODES];
    mpfr_t reflected[2][ORACLE_MODES]; /* F_m(k) of both faces */
    mpfr_t a, b, c, d, k2;
};

/* Calls f for every number, for beginning, ending and changing the precision. */
#define MODES_EACH(o, f)                                                                                   \
    do {                                                                                                   \
        for (size_t i_ = 0; i_ < MODES_UNKNOWNS; i_++)                                                     \
            for (size_t j_ = 0; j_ <= MODES_UNKNOWNS; j_++)                                                \
                f((o)->rows[i_][j_]);                                                                      \
        for (int m_ = 0; m_ < ORACLE_MODES; m_++) {                                                        \
            f((o)->rate[m_]);                                                                              \
            f((o)->weight[m_]);                                                                            \
            f((o)->gauss[m_]);                                                                             \
            f((o)->reflected[0][m_]);                                                                      \
            f((o)->reflected[1][m_]);                                                                      \
        }                                                                                                  \
        for (size_t i_ = 0; i_ < DIPOLE_LAYER_LIMIT; i_++) {                                               \
            f((o)->sigma[i_]);                                                                             \
            f((o)->fade_t[i_]);                                                                            \
            for (int m_ = 0; m_ < ORACLE_MODES; m_++) {                                                    \
                f((o)->q[i_][m_]);                                                                         \
                f((o)->fade_q[i_][m_]);                                                                    \
                f((o)->driven[i_][m_]);                                                                    \
                f((o)->s[i_][m_]);                                                                         \
                for (int j_ = 0; j_ < ORACLE_MODES; j_++)                                                  \
                    f((o)->shape[i_][m_][j_]);                                                             \
            }                                                                                              \
        }                                                                                                  \
        f((o)->a);                                                                                         \
        f((o)->b);                                                                                         \
        f((o)->c);                                                                                         \
        f((o)->d);                                                                                         \
        f((o)->k2);                                                                                        \
    } while (0)

static inline void modes_oracle_begin(struct modes_oracle *o)
{
    MODES_EACH(o, mpfr_init);
}

static inline void modes_oracle_end(struct modes_oracle *o)
{
    MODES_EACH(o, mpfr_clear);
}

/* layers must stay; light from above. Between modes_oracle_begin() and _end(), any number of times. */
static inline void modes_oracle_init(struct modes_oracle *o, const dipole_layer *layers,
                                     const dipole_coefficients *coefficients, size_t count)
{
    layers_oracle_init(&o->beams, layers, coefficients, count);
}

static inline void modes_oracle_clear(struct modes_oracle *o)
{
    layers_oracle_clear(&o->beams);
}

/* Gauss's rule with three nodes: mu = (1 +- sqrt(3/5))/2 and 1/2; w = g/mu^2. */
static inline void modes_rule_fill(struct modes_oracle *o)
{
    for (int m = 0; m < ORACLE_MODES; m++) {
        mpfr_set_ui(o->a, 3, MPFR_RNDN);
        mpfr_div_ui(o->a, o->a, 5, MPFR_RNDN);
        mpfr_sqrt(o->a, o->a, MPFR_RNDN);
        mpfr_mul_si(o->a, o->a, 1 - m, MPFR_RNDN);
        mpfr_add_ui(o->a, o->a, 1, MPFR_RNDN);
        mpfr_ui_div(o->rate[m], 2, o->a, MPFR_RNDN);
        mpfr_set_ui(o->gauss[m], m == 1 ? 8 : 5, MPFR_RNDN);
        mpfr_div_ui(o->gauss[m], o->gauss[m], 18, MPFR_RNDN);
        mpfr_sqr(o->weight[m], o->rate[m], MPFR_RNDN);
        mpfr_mul(o->weight[m], o->weight[m], o->gauss[m], MPFR_RNDN);
    }
}

/* ---- a layer -------------------------------------------------------------------------------------- */

/* o->a = alpha' sum w_m/(t_m^2 - x) - 1 at x = nu^2, o->b its slope over alpha'; uses c. o->d is alpha'. */
static inline void modes_secular(struct modes_oracle *o, mpfr_t x)
{
    mpfr_set_zero(o->a, 1);
    mpfr_set_zero(o->b, 1);
    for (int m = 0; m < ORACLE_MODES; m++) {
        mpfr_sqr(o->c, o->rate[m], MPFR_RNDN);
        mpfr_sub(o->c, o->c, x, MPFR_RNDN);
        mpfr_ui_div(o->c, 1, o->c, MPFR_RNDN);
        mpfr_fma(o->a, o->c, o->weight[m], o->a, MPFR_RNDN);
        mpfr_sqr(o->c, o->c, MPFR_RNDN);
        mpfr_fma(o->b, o->c, o->weight[m], o->b, MPFR_RNDN);
    }
    mpfr_mul(o->a, o->a, o->d, MPFR_RNDN);
    mpfr_sub_ui(o->a, o->a, 1, MPFR_RNDN);
}

/* o->q[i][j] = nu_j^2: bisection, between the t^2 below and its own, until Newton's method takes over. */
static inline void modes_rate_find(struct modes_oracle *o, size_t i, int j)
{
    mpfr_t lo, hi, x;
    const mpfr_prec_t bits = mpfr_get_prec(o->a);
    mpfr_inits2(bits, lo, hi, x, (mpfr_ptr)0);
    mpfr_set_zero(lo, 1);
    if (j > 0)
        mpfr_sqr(lo, o->rate[j - 1], MPFR_RNDN);
    mpfr_sqr(hi, o->rate[j], MPFR_RNDN);
    mpfr_add(x, lo, hi, MPFR_RNDN);
    mpfr_div_2ui(x, x, 1, MPFR_RNDN);
    for (int step = 0; step < 2000; step++) {
        modes_secular(o, x);
        mpfr_set(mpfr_sgn(o->a) < 0 ? lo : hi, x, MPFR_RNDN);
        mpfr_mul(o->b, o->b, o->d, MPFR_RNDN);
        mpfr_div(o->a, o->a, o->b, MPFR_RNDN);
        mpfr_sub(o->c, x, o->a, MPFR_RNDN);
        if (mpfr_cmp(o->c, lo) <= 0 || mpfr_cmp(o->c, hi) >= 0) {
            mpfr_add(o->c, lo, hi, MPFR_RNDN);
            mpfr_div_2ui(o->c, o->c, 1, MPFR_RNDN);
        }
        mpfr_sub(o->a, o->c, x, MPFR_RNDN);
        mpfr_swap(x, o->c);
        if (mpfr_zero_p(o->a) || mpfr_get_exp(o->a) < 4 - (long)bits / 2)
            break;
    }
    /* one more, which doubles the digits */
    modes_secular(o, x);
    mpfr_mul(o->b, o->b, o->d, MPFR_RNDN);
    mpfr_div(o->a, o->a, o->b, MPFR_RNDN);
    mpfr_sub(o->q[i][j], x, o->a, MPFR_RNDN);
    mpfr_clears(lo, hi, x, (mpfr_ptr)0);
}

/*
 * Of the k^2 in o->k2. An exponential e^(-q_j z) has phi_m = 1/(t_m^2 - nu_j^2). A beam e^(-sigma z) causes
 *   phi_m = alpha' sigma^2 (1 + Phi)/(sigma^2 (t_m^2 - 1) + k^2),   Phi = sum w_m phi_m.
 */
static inline void modes_layer_fill(struct modes_oracle *o, size_t i)
{
    const dipole_layer *const layer = &o->beams.layers[i];
    const dipole_medium *const medium = &layer->medium;
    mpfr_set_d(o->sigma[i], medium->sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(o->sigma[i], o->sigma[i], medium->sigma_s_prime_per_mm, MPFR_RNDN);
    mpfr_d_div(o->d, medium->sigma_s_prime_per_mm, o->sigma[i], MPFR_RNDN); /* alpha' */
    for (int j = 0; j < ORACLE_MODES; j++) {
        if (mpfr_zero_p(o->d))
            mpfr_sqr(o->q[i][j], o->rate[j], MPFR_RNDN);
        else if (j == 0 && medium->sigma_a_per_mm == 0.0)
            mpfr_set_zero(o->q[i][j], 1);
        else
            modes_rate_find(o, i, j);
        for (int m = 0; m < ORACLE_MODES; m++) {
            mpfr_set_ui(o->shape[i][j][m], m == j, MPFR_RNDN);
            if (mpfr_zero_p(o->d))
                continue;
            mpfr_sqr(o->a, o->rate[m], MPFR_RNDN);
            mpfr_sub(o->a, o->a, o->q[i][j], MPFR_RNDN);
            mpfr_ui_div(o->shape[i][j][m], 1, o->a, MPFR_RNDN);
        }
        mpfr_sqr(o->a, o->sigma[i], MPFR_RNDN);
        mpfr_fma(o->a, o->a, o->q[i][j], o->k2, MPFR_RNDN);
        mpfr_sqrt(o->q[i][j], o->a, MPFR_RNDN);
    }
    mpfr_set_zero(o->b, 1);
    for (int m = 0; m < ORACLE_MODES; m++) {
        mpfr_sqr(o->a, o->rate[m], MPFR_RNDN);
        mpfr_sqr(o->c, o->sigma[i], MPFR_RNDN);
        mpfr_fma(o->s[i][m], o->a, o->c, o->k2, MPFR_RNDN); /* s^2 */
        mpfr_sub(o->a, o->s[i][m], o->c, MPFR_RNDN);
        mpfr_sqrt(o->s[i][m], o->s[i][m], MPFR_RNDN);
        mpfr_mul(o->c, o->c, o->d, MPFR_RNDN);
        mpfr_div(o->driven[i][m], o->c, o->a, MPFR_RNDN);
        mpfr_fma(o->b, o->driven[i][m], o->weight[m], o->b, MPFR_RNDN);
    }
    mpfr_ui_sub(o->b, 1, o->b, MPFR_RNDN);
    for (int m = 0; m < ORACLE_MODES; m++)
        mpfr_div(o->driven[i][m], o->driven[i][m], o->b, MPFR_RNDN);
    if (isinf(layer->thickness_mm))
        return;
    mpfr_mul_d(o->fade_t[i], o->sigma[i], -layer->thickness_mm, MPFR_RNDN);
    mpfr_exp(o->fade_t[i], o->fade_t[i], MPFR_RNDN);
    for (int j = 0; j < ORACLE_MODES; j++) {
        mpfr_mul_d(o->fade_q[i][j], o->q[i][j], -layer->thickness_mm, MPFR_RNDN);
        mpfr_exp(o->fade_q[i][j], o->fade_q[i][j], MPFR_RNDN);
    }
}

/* ---- a face --------------------------------------------------------------------------------------- */

/* o->d = 1/(2 mean depth), at least the outer sigma; layer numbers must be filled. */
static inline void modes_scale_find(struct modes_oracle *o, int face)
{
    const size_t count = o->beams.count;
    mpfr_t moment, weight, depth, arriving;
    mpfr_inits2(mpfr_get_prec(o->a), moment, weight, depth, arriving, (mpfr_ptr)0);
    mpfr_set_zero(moment, 1);
    mpfr_set_zero(weight, 1);
    mpfr_set_zero(depth, 1);
    mpfr_set_ui(arriving, 1, MPFR_RNDN);
    for (size_t n = 0; n < count; n++) {
        const size_t i = face == 0 ? n : count - 1 - n;
        const double thickness = o->beams.layers[i].thickness_mm;
        /* int_0^d (depth + z) 2 sigma e^(-2 sigma z) dz = (depth + l/2) (1 - T) - d T, T = e^(-2 sigma d)
         */
        mpfr_set_zero(o->a, 1);
        if (!isinf(thickness))
            mpfr_sqr(o->a, o->fade_t[i], MPFR_RNDN);
        mpfr_ui_div(o->b, 1, o->sigma[i], MPFR_RNDN);
        mpfr_div_2ui(o->b, o->b, 1, MPFR_RNDN);
        mpfr_add(o->b, o->b, depth, MPFR_RNDN);
        mpfr_ui_sub(o->c, 1, o->a, MPFR_RNDN);
        mpfr_mul(o->b, o->b, o->c, MPFR_RNDN);
        if (!isinf(thickness)) {
            mpfr_mul_d(o->d, o->a, thickness, MPFR_RNDN);
            mpfr_sub(o->b, o->b, o->d, MPFR_RNDN);
            mpfr_add_d(depth, depth, thickness, MPFR_RNDN);
        }
        mpfr_fma(moment, arriving, o->b, moment, MPFR_RNDN);
        mpfr_fma(weight, arriving, o->c, weight, MPFR_RNDN);
        mpfr_mul(arriving, arriving, o->a, MPFR_RNDN);
    }
    mpfr_div(o->d, weight, moment, MPFR_RNDN);
    mpfr_div_2ui(o->d, o->d, 1, MPFR_RNDN);
    mpfr_max(o->d, o->d, o->sigma[face == 0 ? 0 : count - 1], MPFR_RNDN);
    mpfr_clears(moment, weight, depth, arriving, (mpfr_ptr)0);
}

/* sum = sum over Gauss's 8 nodes in mu = lo + (hi - lo) u^2 (3 - 2u) of F mu/sqrt((1 + mu)^2 + kk (1 -
 * mu^2)); F from the library's formula for one cosine. */
static inline void modes_collision_add(struct modes_oracle *o, double eta, double lo, double hi, mpfr_t kk,
                                       mpfr_t sum)
{
    static const double legendre[4][2] = {
        { 0.18343464249564980494, 0.36268378337836198297 },
        { 0.52553240991632898582, 0.31370664587788728734 },
        { 0.79666647741362673959, 0.22238103445337447054 },
        { 0.96028985649753623168, 0.10122853629037625915 },
    };
    for (int node = 0; node < 8; node++) {
        const double x = legendre[node % 4][0] * (node < 4 ? -1.0 : 1.0), u = 0.5 * (1.0 + x);
        const double mu = lo + (hi - lo) * u * u * (3.0 - 2.0 * u);
        const double f = hi < 1.0 ? 1.0 : dipole_fresnel_reflectance(1.0 / eta, mu);
        const double weight = f * mu * (hi - lo) * u * (1.0 - u) * legendre[node % 4][1];
        mpfr_set_d(o->a, mu, MPFR_RNDN);
        mpfr_sqr(o->b, o->a, MPFR_RNDN);
        mpfr_ui_sub(o->b, 1, o->b, MPFR_RNDN);
        mpfr_add_ui(o->a, o->a, 1, MPFR_RNDN);
        mpfr_sqr(o->a, o->a, MPFR_RNDN);
        mpfr_fma(o->a, o->b, kk, o->a, MPFR_RNDN);
        mpfr_rec_sqrt(o->a, o->a, MPFR_RNDN);
        mpfr_mul_d(o->a, o->a, weight, MPFR_RNDN);
        mpfr_add(sum, sum, o->a, MPFR_RNDN);
    }
}

/* F_m(k) = F_m(0) [E(k)/E(0)] [S(0)/S(k)] */
static inline void modes_face_fill(struct modes_oracle *o, int face)
{
    static const double edges[4] = { 1.0, 0.5070564807662546, 0.0626120363218102, 0.0 };
    const double eta = o->beams.layers[face == 0 ? 0 : o->beams.count - 1].medium.eta;
    double transmitted[ORACLE_MODES];
    mpfr_t kk[2], e[2], s[2];
    for (int n = 0; n < 2; n++)
        mpfr_inits2(mpfr_get_prec(o->a), kk[n], e[n], s[n], (mpfr_ptr)0);
    mpfr_set_zero(kk[0], 1);
    modes_scale_find(o, face);
    mpfr_sqr(o->d, o->d, MPFR_RNDN);
    mpfr_div(kk[1], o->k2, o->d, MPFR_RNDN);
    for (int n = 0; n < 2; n++) {
        mpfr_set_zero(e[n], 1);
        mpfr_set_zero(s[n], 1);
        const double critical = eta > 1.0 ? sqrt((eta - 1.0) * (eta + 1.0)) / eta : 0.0;
        if (eta > 1.0)
            modes_collision_add(o, eta, 0.0, critical, kk[n], e[n]);
        modes_collision_add(o, eta, critical, 1.0, kk[n], e[n]);
        for (int m = 0; m < ORACLE_MODES; m++) {
            double reflected;
            dipole_fresnel_mean_inside(eta, edges[m + 1], edges[m], &reflected, &transmitted[m]);
            mpfr_set_d(o->reflected[face][m], transmitted[m], MPFR_RNDN);
            mpfr_ui_sub(o->reflected[face][m], 1, o->reflected[face][m], MPFR_RNDN);
            if (reflected < 0.5)
                mpfr_set_d(o->reflected[face][m], reflected, MPFR_RNDN);
            mpfr_sqr(o->a, o->rate[m], MPFR_RNDN);
            mpfr_add(o->a, o->a, kk[n], MPFR_RNDN);
            mpfr_sqrt(o->a, o->a, MPFR_RNDN);
            mpfr_add_ui(o->a, o->a, 1, MPFR_RNDN);
            mpfr_div(o->a, o->gauss[m], o->a, MPFR_RNDN);
            mpfr_fma(s[n], o->a, o->reflected[face][m], s[n], MPFR_RNDN);
        }
    }
    for (int m = 0; eta != 1.0 && m < ORACLE_MODES; m++) {
        mpfr_mul(o->reflected[face][m], o->reflected[face][m], e[1], MPFR_RNDN);
        mpfr_div(o->reflected[face][m], o->reflected[face][m], e[0], MPFR_RNDN);
        mpfr_mul(o->reflected[face][m], o->reflected[face][m], s[0], MPFR_RNDN);
        mpfr_div(o->reflected[face][m], o->reflected[face][m], s[1], MPFR_RNDN);
    }
    for (int n = 0; n < 2; n++)
        mpfr_clears(kk[n], e[n], s[n], (mpfr_ptr)0);
}

/* ---- the equations -------------------------------------------------------------------------------- */

static inline void modes_solve(struct modes_oracle *o)
{
    const size_t n = o->unknowns;
    for (size_t k = 0; k < n; k++) {
        const size_t below = k + MODES_BAND < n ? k + MODES_BAND : n - 1,
                     right = k + 2 * MODES_BAND < n ? k + 2 * MODES_BAND : n - 1;
        size_t pivot = k;
        for (size_t i = k + 1; i <= below; i++)
            if (mpfr_cmpabs(o->rows[i][k], o->rows[pivot][k]) > 0)
                pivot = i;
        for (size_t j = k; pivot != k && j <= n; j++)
            mpfr_swap(o->rows[k][j], o->rows[pivot][j]);
        for (size_t i = k + 1; i <= below; i++) {
            if (mpfr_zero_p(o->rows[i][k]))
                continue;
            mpfr_div(o->a, o->rows[i][k], o->rows[k][k], MPFR_RNDN);
            for (size_t j = k + 1; j <= n; j = j == right ? n : j + 1) {
                mpfr_mul(o->b, o->a, o->rows[k][j], MPFR_RNDN);
                mpfr_sub(o->rows[i][j], o->rows[i][j], o->b, MPFR_RNDN);
            }
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n && j <= k + 2 * MODES_BAND; j++) {
            mpfr_mul(o->b, o->rows[k][j], o->rows[j][n], MPFR_RNDN);
            mpfr_sub(o->rows[k][n], o->rows[k][n], o->b, MPFR_RNDN);
        }
        mpfr_div(o->rows[k][n], o->rows[k][n], o->rows[k][k], MPFR_RNDN);
    }
}

/* Unknown n of layer i: way n/3 (0 decays downwards, 1 upwards), exponential n%3. The beams' are way 0, 1.
 */
enum { MODES_BEAM = -1 };

/* o->a = (s phi - slope_sign phi')/sigma of mode m at the top or bottom of layer i, of one exponential or
 * beam. */
static inline void modes_wave(struct modes_oracle *o, size_t i, int m, bool is_bottom, int way,
                              int exponential, int slope_sign)
{
    const bool is_beam = exponential == MODES_BEAM, is_far = is_bottom == (way == 0);
    mpfr_set(o->a, is_beam ? o->sigma[i] : o->q[i][exponential], MPFR_RNDN);
    if ((way == 0) == (slope_sign < 0))
        mpfr_neg(o->a, o->a, MPFR_RNDN);
    mpfr_add(o->a, o->a, o->s[i][m], MPFR_RNDN);
    mpfr_div(o->a, o->a, o->sigma[i], MPFR_RNDN);
    mpfr_mul(o->a, o->a, is_beam ? o->driven[i][m] : o->shape[i][exponential][m], MPFR_RNDN);
    if (is_beam)
        mpfr_mul(o->a, o->a, way == 0 ? o->beams.down[i] : o->beams.up[i], MPFR_RNDN);
    if (is_far)
        mpfr_mul(o->a, o->a, is_beam ? o->fade_t[i] : o->fade_q[i][exponential], MPFR_RNDN);
}

/* row += factor (wave down, sign 1, or up, sign -1) of mode m at the top or bottom of layer i */
static inline void modes_condition(struct modes_oracle *o, size_t row, size_t i, int m, bool is_bottom,
                                   int sign, mpfr_t factor)
{
    const bool is_infinite = isinf(o->beams.layers[i].thickness_mm);
    for (int way = 0; way < (is_infinite ? 1 : 2); way++) {
        for (int j = 0; j < ORACLE_MODES; j++) {
            modes_wave(o, i, m, is_bottom, way, j, sign);
            mpfr_t *const at = &o->rows[row][2 * ORACLE_MODES * i + (size_t)(ORACLE_MODES * way + j)];
            mpfr_fma(*at, o->a, factor, *at, MPFR_RNDN);
        }
        modes_wave(o, i, m, is_bottom, way, MODES_BEAM, sign);
        mpfr_neg(o->a, o->a, MPFR_RNDN);
        mpfr_fma(o->rows[row][o->unknowns], o->a, factor, o->rows[row][o->unknowns], MPFR_RNDN);
    }
}

/* sum over modes of w mu^2/2 (1 - F) wave */
static inline double modes_leaving(struct modes_oracle *o, int face)
{
    const size_t i = face == 0 ? 0 : o->beams.count - 1;
    const bool is_infinite = isinf(o->beams.layers[i].thickness_mm);
    mpfr_set_zero(o->d, 1);
    for (int m = 0; m < ORACLE_MODES; m++) {
        mpfr_set_zero(o->b, 1);
        for (int way = 0; way < (is_infinite ? 1 : 2); way++) {
            for (int j = 0; j < ORACLE_MODES; j++) {
                modes_wave(o, i, m, face == 1, way, j, face == 1 ? 1 : -1);
                mpfr_fma(o->b, o->a,
                         o->rows[2 * ORACLE_MODES * i + (size_t)(ORACLE_MODES * way + j)][o->unknowns],
                         o->b, MPFR_RNDN);
            }
            modes_wave(o, i, m, face == 1, way, MODES_BEAM, face == 1 ? 1 : -1);
            mpfr_add(o->b, o->b, o->a, MPFR_RNDN);
        }
        mpfr_ui_sub(o->c, 1, o->reflected[face][m], MPFR_RNDN);
        mpfr_mul(o->c, o->c, o->gauss[m], MPFR_RNDN); /* w mu^2 = g */
        mpfr_fma(o->d, o->b, o->c, o->d, MPFR_RNDN);
    }
    mpfr_div_2ui(o->d, o->d, 1, MPFR_RNDN);
    return mpfr_get_d(o->d, MPFR_RNDN);
}

/* Enough bits as oracle_bits(), whose q is the slowest here, too, but for a factor near 1; three times as
 * many for thin layers, where all three pairs of solutions meet. */
static inline mpfr_prec_t modes_bits(const struct modes_oracle *o, double k)
{
    double bits = 400.0;
    for (size_t i = 0; i < o->beams.count; i++) {
        const dipole_medium *const m = &o->beams.layers[i].medium;
        const double sigma = m->sigma_a_per_mm + m->sigma_s_prime_per_mm;
        if (isinf(o->beams.layers[i].thickness_mm))
            continue;
        const double q = sqrt(k * k + 3.0 * m->sigma_a_per_mm * sigma);
        bits += 2.0 * fmax(0.0, -log2(q * o->beams.layers[i].thickness_mm)) +
                4.0 * fmax(0.0, -log2(sigma * o->beams.layers[i].thickness_mm)) +
                4.0 * fmax(0.0, log2(k / sigma)); /* where all q are nearly k */
    }
    return oracle_bits(&o->beams, k) + (mpfr_prec_t)bits;
}

/* R^(k), T^(k), k > 0; as k goes to 0 the totals. */
static inline void modes_oracle_response(void *oracle, double k, double out[2])
{
    struct modes_oracle *const o = oracle;
    const size_t count = o->beams.count, n = ORACLE_MODES * (2 * count - (o->beams.is_half_space ? 1 : 0));
    const mpfr_prec_t bits = modes_bits(o, k);
    o->unknowns = n;
#define SET_BITS(x) mpfr_set_prec(x, bits)
    MODES_EACH(o, SET_BITS);
#undef SET_BITS
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= n; j++)
            mpfr_set_zero(o->rows[i][j], 1);
    mpfr_set_d(o->k2, k, MPFR_RNDN);
    mpfr_sqr(o->k2, o->k2, MPFR_RNDN);
    modes_rule_fill(o);
    for (size_t i = 0; i < count; i++)
        modes_layer_fill(o, i);
    for (int face = 0; face < (o->beams.is_half_space ? 1 : 2); face++)
        modes_face_fill(o, face);
    mpfr_t factor;
    mpfr_init2(factor, bits);
    for (int m = 0; m < ORACLE_MODES; m++) {
        mpfr_set_ui(factor, 1, MPFR_RNDN); /* down = F up */
        modes_condition(o, (size_t)m, 0, m, false, 1, factor);
        mpfr_neg(factor, o->reflected[0][m], MPFR_RNDN);
        modes_condition(o, (size_t)m, 0, m, false, -1, factor);
        for (size_t i = 0; i + 1 < count; i++) { /* down - up and (down + up)/n^2 are continuous */
            const size_t row = ORACLE_MODES * (2 * i + 1) + (size_t)m;
            for (int sign = -1; sign <= 1; sign += 2) {
                mpfr_set_si(factor, sign, MPFR_RNDN);
                modes_condition(o, row, i, m, true, sign, factor);
                mpfr_set_si(factor, -sign, MPFR_RNDN);
                modes_condition(o, row, i + 1, m, false, sign, factor);
                mpfr_set_d(factor, o->beams.layers[i + 1].medium.eta, MPFR_RNDN);
                mpfr_sqr(factor, factor, MPFR_RNDN);
                modes_condition(o, row + ORACLE_MODES, i, m, true, sign, factor);
                mpfr_set_d(factor, o->beams.layers[i].medium.eta, MPFR_RNDN);
                mpfr_sqr(factor, factor, MPFR_RNDN);
                mpfr_neg(factor, factor, MPFR_RNDN);
                modes_condition(o, row + ORACLE_MODES, i + 1, m, false, sign, factor);
            }
        }
        if (o->beams.is_half_space)
            continue;
        const size_t row = n - ORACLE_MODES + (size_t)m;
        mpfr_set_ui(factor, 1, MPFR_RNDN);
        modes_condition(o, row, count - 1, m, true, -1, factor);
        mpfr_neg(factor, o->reflected[1][m], MPFR_RNDN);
        modes_condition(o, row, count - 1, m, true, 1, factor);
    }
    mpfr_clear(factor);
    modes_solve(o);
    out[0] = modes_leaving(o, 0);
    out[1] = o->beams.is_half_space ? 0.0 : modes_leaving(o, 1);
}

#endif
