/* Rows of sources: what they are for each model, and which loops run on this processor. T5, T22 */
#include "row.h"

#include "internal.h"

#include <assert.h>

void dipole_row_of_two_init(const dipole_coefficients *c, struct row_of_two *out)
{
    *out = (struct row_of_two){
        .row = { .coefficients = c, .count = 2 },
        .depth_mm = { c->z_r_mm, c->z_v_mm },
        .depth_low_mm = { c->z_r_low_mm, c->z_v_low_mm },
        .weight = { 0.5, 0.5 },
    };
    out->row.depth_mm = out->depth_mm;
    out->row.depth_low_mm = out->depth_low_mm;
    out->row.weight = out->weight;
}

/* ---- the beam model's line of sources (T22) ------------------------------------------------------- */

/*
 * In mean free paths, x = z/l and b = z_b/l = 2A/3:
 *   w(x) = (e^(-x) - e^(-x/b))/(1 - b),
 * by the trapezoidal rule in log x. Every integrand that is taken over it (lobe, its mean over a ring, the
 * part within and beyond) is analytic and no larger than on the real axis for |Im log x| < pi/4, falls at
 * least as x^2 to the left and as e^(-x/max(1, b)) to the right: a step of 1/8 leaves e^(-4 pi^2) = 7e-18,
 * and the ends lie where 1e-17 is left, for radii down to 1e-9 mean free paths.
 */
static const int row_first = -323; /* log(3e-18)/step */

static struct dd beam_b(const dipole_coefficients *c)
{
    return dd_divide(dd_product(2.0, c->boundary_a), (struct dd){ 3.0, 0.0 });
}

size_t dipole_row_beam_count(const dipole_coefficients *c)
{
    /* b is below 500 with the exact Fdr, and below 2^54 where the polynomial is next to 1 */
    const double larger = fmax(1.0, beam_b(c).hi);
    const int count = (int)ceil(log(45.0 * larger) / ROW_STEP) - row_first + 1;
    assert(count <= ROW_LIMIT);
    return (size_t)count;
}

/* The slower decay is taken out, so that b = 1 is no case of its own. */
double dipole_row_beam_weight(const dipole_coefficients *c, double x, double d_log_x)
{
    const struct dd b = beam_b(c), one = { 1.0, 0.0 };
    const struct dd larger = b.hi > 1.0 ? b : one, smaller = b.hi > 1.0 ? one : b;
    const struct dd rate = dd_divide(dd_add(larger, dd_negate(smaller)), dd_multiply(larger, smaller));
    int exponent;
    const struct dd decay = dd_decay(dd_divide((struct dd){ x, 0.0 }, larger), &exponent);
    return d_log_x * x * (x / (larger.hi * smaller.hi)) * decay_mean(x * rate.hi) *
           ldexp(decay.hi, exponent);
}

void dipole_row_beam_fill(const dipole_coefficients *c, double *depth_mm, double *depth_low_mm,
                          double *weight)
{
    const struct dd length = { c->z_r_mm, c->z_r_low_mm };
    const size_t count = dipole_row_beam_count(c);
    for (size_t k = 0; k < count; k++) {
        const double x = exp(((int)k + row_first) * ROW_STEP);
        const struct dd z = dd_scale(x, length);
        depth_mm[k] = z.hi;
        depth_low_mm[k] = z.lo;
        weight[k] = dipole_row_beam_weight(c, x, ROW_STEP);
    }
}

/* ---- what they send out --------------------------------------------------------------------------- */

static const struct row_loops *loops(void)
{
#ifdef DIPOLE_HAS_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return &dipole_row_loops_avx2;
#endif
    return &dipole_row_loops_portable;
}

double dipole_row_value(const struct row *row, double r_mm)
{
    return loops()->value(row, r_mm);
}

void dipole_row_profile(const struct row *row, const double *r_mm, size_t count, double *values)
{
    loops()->profile(row, r_mm, count, values);
}

void dipole_row_gradient(const struct row *row, const double *r_mm, size_t count, double *values,
                         double *d_log_sigma_a, double *d_log_sigma_s_prime)
{
    loops()->gradient(row, r_mm, count, values, d_log_sigma_a, d_log_sigma_s_prime);
}

double dipole_row_beyond(const struct row *row, double factor, double r_mm)
{
    return loops()->beyond(row, factor, r_mm);
}

double dipole_row_within(const struct row *row, double r_mm)
{
    return loops()->within(row, r_mm);
}

double dipole_row_ring_mean(const struct row *row, double r_lo_mm, double r_hi_mm)
{
    return loops()->ring_mean(row, r_lo_mm, r_hi_mm);
}
