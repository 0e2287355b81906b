/* Reflection at the smooth surface between medium and outside. docs/theory.md T1 to T3. */
#include "internal.h"

/* ---- one direction (T1) --------------------------------------------------------------------------- */

/*
 * With c the cosine and g = eta cos(theta_t) = sqrt(eta^2 - 1 + c^2), the textbook amplitudes
 * (c - g)/(c + g) and (eta^2 c - g)/(eta^2 c + g) are rationalised, so that nothing cancels near eta = 1.
 */
double dipole_fresnel_reflectance(double eta, double cosine)
{
    if (!(eta > 0.0 && cosine >= 0.0 && cosine <= 1.0))
        return NAN;
    if (eta == 1.0)
        return 0.0;
    const double step = (eta - 1.0) * (eta + 1.0); /* eta^2 - 1 */
    const double g2 = step + cosine * cosine;
    if (g2 <= 0.0)
        return 1.0;
    const double g = sqrt(g2), eta2 = eta * eta;
    const double r_s = step / square(cosine + g);
    const double r_p = step * ((eta2 + 1.0) * cosine * cosine - 1.0) / square(eta2 * cosine + g);
    return fmin(0.5 * (r_s * r_s + r_p * r_p), 1.0);
}

double dipole_fresnel_reflectance_schlick(double eta, double cosine)
{
    if (!(eta > 0.0 && cosine >= 0.0 && cosine <= 1.0))
        return NAN;
    double c = cosine;
    if (eta < 1.0) {
        const double g2 = (eta - 1.0) * (eta + 1.0) + cosine * cosine;
        if (g2 <= 0.0)
            return 1.0;
        c = sqrt(g2) / eta;
    }
    const double f0 = square((eta - 1.0) / (eta + 1.0));
    const double x = 1.0 - c;
    return f0 + (1.0 - f0) * x * square(x * x);
}

/* ---- all directions (T2) -------------------------------------------------------------------------- */

/* Nodes and weights of the Gauss-Legendre rule with 16 points on [-1, 1], positive half. */
static const double legendre[8][2] = {
    { 0.095012509837637440185, 0.18945061045506849629 }, { 0.28160355077925891323, 0.18260341504492358887 },
    { 0.45801677765722738634, 0.16915651939500253819 },  { 0.61787624440264374845, 0.14959598881657673208 },
    { 0.7554044083550030339, 0.12462897125553387205 },   { 0.86563120238783174388, 0.09515851168249278481 },
    { 0.94457502307323257608, 0.062253523938647892863 }, { 0.9894009349916499326, 0.027152459411754094852 },
};

struct moments {
    double reflected, transmitted; /* 2 int F mu dmu and 2 int (1 - F) mu dmu; their sum is 1      */
    double thin, dense;            /* 2 int F mu mu' dmu, mu' the cosine on the thin, dense side   */
};

/*
 * Moments for light going from the thin side to the dense side, x >= 1 their index ratio, over the cosines
 * on the thin side from sqrt(x^2 - 1) sinh(v_lo/2) to sqrt(x^2 - 1) sinh(v_hi/2).
 *
 * With s = -r_s, the amplitude of s-polarised light, the cosine obeys mu^2 = (x^2 - 1)(1 - s)^2/(4 s) and
 * everything is rational in s from s_0 = (x - 1)/(x + 1) at normal incidence to 1 at grazing. In v = -log s
 * the integrands are smooth on the scale of 1 and their nearest pole lies 2/(x^2 - 1) beyond v = 0, so
 * panels no longer than 1 and at least four of them bring 16 points to rounding for x up to 10.
 * step = x^2 - 1 and the limits come from the caller, who knows them without cancellation.
 */
static struct moments moments_between(double step, double v_lo, double v_hi)
{
    const double x2 = 1.0 + step, length = v_hi - v_lo;
    const int panel_count = (int)fmax(4.0, ceil(length));
    const double half = 0.5 * length / panel_count;
    struct moments sum = { 0.0, 0.0, 0.0, 0.0 };
    for (int panel = 0; panel < panel_count; panel++) {
        const double middle = v_lo + (2 * panel + 1) * half;
        for (int node = 0; node < 16; node++) {
            const double *const rule = legendre[node / 2];
            const double v = middle + (node % 2 == 0 ? half : -half) * rule[0];
            const double s_root = exp(-0.5 * v), s = s_root * s_root, denominator = (x2 + 1.0) - s * step;
            const double r_p = (step - s * (x2 + 1.0)) / denominator;
            const double one_minus_s = -expm1(-v), one_minus_s2 = one_minus_s * (1.0 + s);
            const double reflected = 0.5 * (s * s + r_p * r_p);
            const double transmitted = 0.5 * one_minus_s2 * (1.0 + 4.0 * x2 / square(denominator));
            /* 2 mu dmu = (x^2 - 1)/4 (1/s^2 - 1) ds, and ds = s dv */
            const double weight = rule[1] * half * 0.25 * step * one_minus_s2 / s;
            sum.reflected += weight * reflected;
            sum.transmitted += weight * transmitted;
            /* mu = sqrt(x^2 - 1) (1 - s)/(2 sqrt(s)) on the thin side, and with a plus over x on the dense
             */
            sum.thin += weight * reflected * sqrt(step) * (0.5 * one_minus_s / s_root);
            sum.dense += weight * reflected * sqrt(step / x2) * (0.5 * (1.0 + s) / s_root);
        }
    }
    return sum;
}

/* All cosines: s from s_0 = (x - 1)/(x + 1) to 1. */
static struct moments moments_thin_to_dense(double step, double s_0)
{
    return moments_between(step, 0.0, -log(s_0));
}

static bool eta_is_legal(double eta)
{
    return eta >= DIPOLE_ETA_MIN && eta <= DIPOLE_ETA_MAX;
}

/* The moments for light from inside. From the dense side they follow from the other side's by
 * reciprocity: eta^2 (1 - F_inside) = 1 - F_outside, the rest is total reflection. */
static struct moments moments_inside(double eta)
{
    if (!eta_is_legal(eta))
        return (struct moments){ NAN, NAN, NAN, NAN };
    if (eta == 1.0)
        return (struct moments){ 0.0, 1.0, 0.0, 0.0 };
    const double eta2 = eta * eta;
    if (eta > 1.0) {
        const double step = (eta - 1.0) * (eta + 1.0);
        const struct moments outside = moments_thin_to_dense(step, (eta - 1.0) / (eta + 1.0));
        return (struct moments){ (step + outside.reflected) / eta2, outside.transmitted / eta2,
                                 outside.thin / eta2, outside.dense / eta2 };
    }
    return moments_thin_to_dense((1.0 - eta) * (1.0 + eta) / eta2, (1.0 - eta) / (1.0 + eta));
}

double dipole_fdr_exact(double eta)
{
    return moments_inside(eta).reflected;
}

double dipole_fdt_exact(double eta)
{
    return moments_inside(eta).transmitted;
}

double dipole_fdt_outside(double eta)
{
    return eta * eta * moments_inside(eta).transmitted;
}

/* int_0^1 F(mu) mu^2 dmu for light inside; total reflection from the critical angle on adds its own. T24 */
double dipole_fresnel_second_moment_inside(double eta)
{
    const struct moments moments = moments_inside(eta);
    if (!(eta > 1.0))
        return 0.5 * moments.thin;
    const double critical = sqrt((eta - 1.0) * (eta + 1.0)) / eta;
    return 0.5 * moments.dense + critical * critical * critical / 3.0;
}

/* Over a range of squared cosines on the thin side; the whole range as moments_thin_to_dense(). */
static struct moments moments_of_range(double step, double cosine2_lo, double cosine2_hi)
{
    return moments_between(step, 2.0 * asinh(sqrt(cosine2_lo / step)),
                           2.0 * asinh(sqrt(cosine2_hi / step)));
}

void dipole_fresnel_mean_inside(double eta, double cosine2_lo, double cosine2_hi, double *reflected,
                                double *transmitted)
{
    *reflected = 0.0;
    *transmitted = 1.0;
    if (eta == 1.0)
        return;
    const double width = cosine2_hi - cosine2_lo;
    if (eta < 1.0) {
        const double step = (1.0 - eta) * (1.0 + eta) / (eta * eta);
        const struct moments moments = moments_of_range(step, cosine2_lo, cosine2_hi);
        *reflected = moments.reflected / width;
        *transmitted = moments.transmitted / width;
        return;
    }
    /* mu on the dense side becomes eta sqrt(mu^2 - critical^2) on the thin side; below the critical cosine
     * all is reflected */
    const double step = (eta - 1.0) * (eta + 1.0), eta2 = eta * eta, critical2 = step / eta2;
    *reflected = (fmin(cosine2_hi, critical2) - fmin(cosine2_lo, critical2)) / width;
    *transmitted = 0.0;
    const double thin_lo = eta2 * fmax(cosine2_lo - critical2, 0.0),
                 thin_hi = eta2 * fmax(cosine2_hi - critical2, 0.0);
    if (thin_hi > thin_lo) {
        const struct moments moments = moments_of_range(step, thin_lo, thin_hi);
        *reflected += moments.reflected / (eta2 * width);
        *transmitted += moments.transmitted / (eta2 * width);
    }
}

/* ---- the fit (T3) --------------------------------------------------------------------------------- */

double dipole_fdr_polynomial(double eta)
{
    if (!(eta > 0.0))
        return NAN;
    const double x = 1.0 / eta;
    if (eta >= 1.0)
        return -1.440 * x * x + 0.710 * x + 0.668 + 0.0636 * eta;
    return -0.4399 + 0.7099 * x - 0.3319 * x * x + 0.0636 * x * x * x;
}
