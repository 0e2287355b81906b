/*
 * The loops over radii and over sources, for the file that includes this: it defines ROW_LOOPS, the name of
 * the table, and is compiled for one kind of processor. The compiler turns them into vector code.
 */
#include "internal.h"
#include "lobe.h"
#include "row.h"

static struct dd depth(const struct row *row, size_t k)
{
    return (struct dd){ row->depth_mm[k], row->depth_low_mm[k] };
}

static struct dd sigma_tr(const struct row *row)
{
    return (struct dd){ row->coefficients->sigma_tr_per_mm, row->coefficients->sigma_tr_low_per_mm };
}

/* Sum of count terms in place, by halves: log2(count) roundings. */
static double fold(double *restrict terms, size_t count)
{
    while (count > 1) {
        const size_t half = count / 2, rest = count - half;
        for (size_t k = 0; k < half; k++)
            terms[k] += terms[rest + k];
        count = rest;
    }
    return count == 1 ? terms[0] : 0.0;
}

/* What every integrand over the beam model's line does: it rises as depth^2 up to a depth of r or l. So
 * what lies less than 1e-9 of that deep adds less than 1e-17. */
static struct row row_from(const struct row *row, double r_mm)
{
    const double l = row->coefficients->mean_free_path_mm, shallow = 1e-9 * (r_mm < l ? r_mm : l);
    if (row->count == 2 || !(shallow > row->depth_mm[0]))
        return *row;
    const size_t skipped = (size_t)(log(shallow / row->depth_mm[0]) / ROW_STEP);
    return (struct row){ row->coefficients, row->count - skipped, row->depth_mm + skipped,
                         row->depth_low_mm + skipped, row->weight + skipped };
}

/* ---- profile -------------------------------------------------------------------------------------- */

/* At one radius, to the last digits. */
static double value(const struct row *row, double r_mm)
{
    double terms[ROW_LIMIT];
    const struct dd s = sigma_tr(row);
    const double r = lobe_distance(r_mm);
    const struct dd r2 = lobe_square(r);
    const struct row part = row_from(row, r);
    for (size_t k = 0; k < part.count; k++)
        terms[k] = part.weight[k] * lobe_value(depth(&part, k), s, r, r2);
    return r >= 0.0 ? row->coefficients->alpha_prime / (2.0 * PI) * fold(terms, part.count) : NAN;
}

/*
 * Two sources, many radii: the loop that bakes tables. For speed it leaves out the second doubles, which
 * costs half a rounding of x = sigma_tr d and so a relative error of 1e-16 x, and what only extreme inputs
 * need: for those it is not made, and they are done again one by one.
 */
struct pair {
    double sigma_tr, z2[2], weighted_z[2];
    double
        r_end; /* good for r up to here: x < 600, and no power of a length overflows; negative for none */
};

static struct pair pair_of(const struct row *row)
{
    struct pair pair = { .sigma_tr = row->coefficients->sigma_tr_per_mm };
    for (size_t k = 0; k < 2; k++) {
        pair.z2[k] = square(row->depth_mm[k]);
        pair.weighted_z[k] = row->weight[k] * row->depth_mm[k];
    }
    /* x up to 500 and lengths of 1e-15 to 1e15 mm: no lobe is below 1e-280 */
    const double length = row->depth_mm[1], x = pair.sigma_tr * length;
    const bool is_usual = length > 1e-15 && length < 1e15 && row->coefficients->alpha_prime > 1e-9;
    pair.r_end = is_usual ? fmin((500.0 - x) / pair.sigma_tr, 1e15) : -1.0;
    return pair;
}

/* Whether a radius is one that the fast loop is not made for. */
static int has_odd(const struct pair *pair, const double *r_mm, size_t count)
{
    int odd = 0;
    for (size_t i = 0; i < count; i++)
        odd |= !(r_mm[i] >= 0.0) | !(r_mm[i] <= pair->r_end);
    return odd;
}

/* sum_k w_k z_k (1 + x_k) e^(-x_k)/d_k^3, with one division */
static inline double pair_value(const struct pair *pair, double r_mm)
{
    const double a2 = MULTIPLY_ADD(r_mm, r_mm, pair->z2[0]), b2 = MULTIPLY_ADD(r_mm, r_mm, pair->z2[1]);
    const double d_a = sqrt(a2), d_b = sqrt(b2), x_a = pair->sigma_tr * d_a, x_b = pair->sigma_tr * d_b;
    const double w_a = pair->weighted_z[0], w_b = pair->weighted_z[1];
    const double a = decay_times_normal(MULTIPLY_ADD(w_a, x_a, w_a), x_a);
    const double b = decay_times_normal(MULTIPLY_ADD(w_b, x_b, w_b), x_b);
    const double a3 = d_a * a2, b3 = d_b * b2;
    return MULTIPLY_ADD(a, b3, b * a3) / (a3 * b3);
}

static void profile(const struct row *row, const double *restrict r_mm, size_t count,
                    double *restrict values)
{
    const struct pair pair = pair_of(row);
    const double scale = row->coefficients->alpha_prime / (2.0 * PI);
    for (size_t i = 0; i < count; i++)
        values[i] = scale * pair_value(&pair, r_mm[i]);
    if (has_odd(&pair, r_mm, count))
        for (size_t i = 0; i < count; i++)
            if (!(r_mm[i] >= 0.0 && r_mm[i] <= pair.r_end))
                values[i] = value(row, r_mm[i]);
}

/* ---- derivatives (T12) ---------------------------------------------------------------------------- */

/*
 * The weighted sums of value and slopes (lobe.h) make the derivatives with absorbed = 1 - alpha':
 *   d alpha'/d log sigma_a = -alpha' absorbed = -d alpha'/d log sigma_s'
 *   d log z/d log sigma_a = -absorbed          d log z/d log sigma_s' = -alpha'
 *   d sigma_tr^2/d log sigma_a = 3 sigma_a (sigma_t' + sigma_a)    .../d log sigma_s' = 3 sigma_a sigma_s'
 */
struct chain {
    double scale, absorbed, alpha_prime, by_sigma_a, by_sigma_s_prime;
};

static struct chain chain_of(const dipole_coefficients *c)
{
    return (struct chain){
        .scale = c->alpha_prime / (2.0 * PI),
        .absorbed = c->sigma_a_per_mm * c->mean_free_path_mm,
        .alpha_prime = c->alpha_prime,
        .by_sigma_a = 3.0 * c->sigma_a_per_mm * (c->sigma_t_prime_per_mm + c->sigma_a_per_mm),
        .by_sigma_s_prime = 3.0 * c->sigma_a_per_mm * c->sigma_s_prime_per_mm,
    };
}

static inline double chain_sigma_a(const struct chain *chain, struct lobe_slopes sum)
{
    return chain->scale *
           (chain->by_sigma_a * sum.d_sigma_tr2 - chain->absorbed * (sum.value + sum.d_log_z));
}

static inline double chain_sigma_s_prime(const struct chain *chain, struct lobe_slopes sum)
{
    return chain->scale * (chain->by_sigma_s_prime * sum.d_sigma_tr2 +
                           (chain->absorbed * sum.value - chain->alpha_prime * sum.d_log_z));
}

static struct lobe_slopes slopes(const struct row *row, double r_mm)
{
    double lobes[ROW_LIMIT], d_log_z[ROW_LIMIT], d_sigma_tr2[ROW_LIMIT];
    const struct dd s = sigma_tr(row);
    const double r = lobe_distance(r_mm);
    const struct dd r2 = lobe_square(r);
    const struct row part = row_from(row, r);
    for (size_t k = 0; k < part.count; k++) {
        const struct lobe_slopes lobe = lobe_slopes(depth(&part, k), s, r, r2);
        lobes[k] = part.weight[k] * lobe.value;
        d_log_z[k] = part.weight[k] * lobe.d_log_z;
        d_sigma_tr2[k] = part.weight[k] * lobe.d_sigma_tr2;
    }
    return (struct lobe_slopes){ fold(lobes, part.count), fold(d_log_z, part.count),
                                 fold(d_sigma_tr2, part.count) };
}

struct gradient_out {
    double *values, *d_log_sigma_a, *d_log_sigma_s_prime;
};

static void gradient_at(const struct row *row, const struct chain *chain, double r_mm,
                        struct gradient_out out, size_t i)
{
    const struct lobe_slopes sum = slopes(row, r_mm);
    const bool is_distance = r_mm >= 0.0;
    out.values[i] = is_distance ? chain->scale * sum.value : NAN;
    out.d_log_sigma_a[i] = is_distance ? chain_sigma_a(chain, sum) : NAN;
    out.d_log_sigma_s_prime[i] = is_distance ? chain_sigma_s_prime(chain, sum) : NAN;
}

/* The lobe and its slopes as in lobe.h, from 1/d. */
static inline struct lobe_slopes pair_slopes(const struct pair *pair, size_t k, double d, double over_d)
{
    const double x = pair->sigma_tr * d, over_d2 = over_d * over_d;
    const double faded = decay_times_normal(pair->weighted_z[k] * over_d, x);
    const double bracket = (1.0 + x) - pair->z2[k] * over_d2 * MULTIPLY_ADD(x + 3.0, x, 3.0);
    return (struct lobe_slopes){ faded * over_d2 * (1.0 + x), faded * over_d2 * bracket, -0.5 * faded };
}

static void pair_gradient(const struct row *row, const struct chain *chain_in, const double *restrict r_mm,
                          size_t count, double *restrict values, double *restrict d_log_sigma_a,
                          double *restrict d_log_sigma_s_prime)
{
    const struct pair pair = pair_of(row);
    const struct chain chain = *chain_in;
    const struct gradient_out out = { values, d_log_sigma_a, d_log_sigma_s_prime };
    for (size_t i = 0; i < count; i++) {
        const double d_a = sqrt(MULTIPLY_ADD(r_mm[i], r_mm[i], pair.z2[0]));
        const double d_b = sqrt(MULTIPLY_ADD(r_mm[i], r_mm[i], pair.z2[1]));
        const double over = 1.0 / (d_a * d_b);
        const struct lobe_slopes a = pair_slopes(&pair, 0, d_a, over * d_b);
        const struct lobe_slopes b = pair_slopes(&pair, 1, d_b, over * d_a);
        const struct lobe_slopes sum = { a.value + b.value, a.d_log_z + b.d_log_z,
                                         a.d_sigma_tr2 + b.d_sigma_tr2 };
        values[i] = chain.scale * sum.value;
        d_log_sigma_a[i] = chain_sigma_a(&chain, sum);
        d_log_sigma_s_prime[i] = chain_sigma_s_prime(&chain, sum);
    }
    if (has_odd(&pair, r_mm, count))
        for (size_t i = 0; i < count; i++)
            if (!(r_mm[i] >= 0.0 && r_mm[i] <= pair.r_end))
                gradient_at(row, &chain, r_mm[i], out, i);
}

static void gradient(const struct row *row, const double *r_mm, size_t count, double *values,
                     double *d_log_sigma_a, double *d_log_sigma_s_prime)
{
    const struct chain chain = chain_of(row->coefficients);
    const struct gradient_out out = { values, d_log_sigma_a, d_log_sigma_s_prime };
    if (row->count == 2) {
        pair_gradient(row, &chain, r_mm, count, values, d_log_sigma_a, d_log_sigma_s_prime);
        return;
    }
    for (size_t i = 0; i < count; i++)
        gradient_at(row, &chain, r_mm[i], out, i);
}

/* ---- integrals ------------------------------------------------------------------------------------ */

static double beyond(const struct row *row, double factor, double r_mm)
{
    double terms[ROW_LIMIT];
    const struct dd s = sigma_tr(row);
    const double r = lobe_distance(r_mm);
    const struct dd r2 = lobe_square(r);
    const struct row part = row_from(row, r_mm);
    for (size_t k = 0; k < part.count; k++)
        terms[k] = lobe_beyond(depth(&part, k), s, factor * part.weight[k], r, r2);
    return fold(terms, part.count);
}

static double within(const struct row *row, double r_mm)
{
    double terms[ROW_LIMIT];
    const struct dd s = sigma_tr(row);
    const double r = lobe_distance(r_mm);
    const struct dd r2 = lobe_square(r);
    const struct row part = row_from(row, r_mm);
    for (size_t k = 0; k < part.count; k++)
        terms[k] = part.weight[k] * lobe_within(depth(&part, k), s, r, r2);
    return fold(terms, part.count);
}

static double ring_mean(const struct row *row, double r_lo_mm, double r_hi_mm)
{
    double terms[ROW_LIMIT];
    const struct dd s = sigma_tr(row);
    const double r_lo = lobe_distance(r_lo_mm), r_hi = lobe_distance(r_hi_mm);
    const struct dd r2_lo = lobe_square(r_lo), r2_hi = lobe_square(r_hi);
    const struct row part = row_from(row, r_hi_mm);
    for (size_t k = 0; k < part.count; k++)
        terms[k] = part.weight[k] * lobe_ring_mean(depth(&part, k), s, r_lo, r2_lo, r_hi, r2_hi);
    return fold(terms, part.count);
}

const struct row_loops ROW_LOOPS = { value, profile, gradient, beyond, within, ring_mean };
