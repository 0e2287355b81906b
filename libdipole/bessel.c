/* Modified Bessel functions K_0 and K_1 of complex argument. docs/theory.md T27. */
#include "internal.h"

/*
 * sqrt(2z/pi) e^z K_n(z) = 1 + sum_i weight_i/(z + node_i) for |z| >= 2: it is 1 plus a Stieltjes transform
 * (its jump over the negative axis has one sign), so the rational function that agrees with it at 22 points
 * between 2 and 14 has real poles, and an error below 1e-16 for |arg z| <= pi/4. Rows: node, weight.
 */
enum { POLES = 11 };
static const double k0_poles[POLES][2] = {
    { 0.030200118286693691062, -0.010212317550678322893 },
    { 0.13541612048265930812, -0.025372798607247376547 },
    { 0.32561562158534110651, -0.032124045985886429008 },
    { 0.61358947244527163444, -0.028035512980087923017 },
    { 1.0177387775399467359, -0.017869983236978659833 },
    { 1.563865698714477372, -0.0082209636407062970803 },
    { 2.288136377217844813, -0.0025938216261184432397 },
    { 3.2429696969137892068, -0.00051316823791549535423 },
    { 4.5103430646965341478, -0.000054929318611708999803 },
    { 6.2382455304080430946, -2.4350078698351406762e-6 },
    { 8.785899951145772401, -2.3807899492537826089e-8 },
};
static const double k1_poles[POLES][2] = {
    { 0.01072167057268607333, 0.10411298448527889766 },
    { 0.09715595053009409073, 0.09524319516559631435 },
    { 0.27431862966589464809, 0.077017073301936689404 },
    { 0.5523255382147429416, 0.052731995120875178443 },
    { 0.94809655401618576442, 0.029150004215050120624 },
    { 1.486633551968424202, 0.012291431011093160277 },
    { 2.2036774922697811697, 0.0036735057071289281478 },
    { 3.1514182694768736724, 0.00070280880640707473608 },
    { 4.4116897556736909758, 0.000073737251783505255307 },
    { 6.1323268119085745394, 3.2334552692204046106e-6 },
    { 8.6721756549597996422, 3.1479580888058142189e-8 },
};

static double complex bessel_large(double complex z, double complex log_z, const double poles[POLES][2])
{
    const double log_sqrt_half_pi = 0.22579135264472743236;
    const double x = creal(z), y = cimag(z);
    double re = 1.0, im = 0.0;
    for (int i = 0; i < POLES; i++) {
        const double a = x + poles[i][0], w = poles[i][1] / (a * a + y * y);
        re += w * a;
        im -= w * y;
    }
    return cexp(log_sqrt_half_pi - z - 0.5 * log_z) * (re + I * im);
}

/*
 * The ascending series for |z| < 2, where they lose one digit at most. With y = z^2/4 and L = log(z/2) +
 * gamma, K_0 = sum y^k (H_k - L)/(k!)^2,   1 - z K_1 = 2y sum y^k (H_k + 1/(2k + 2) - L)/(k! (k + 1)!).
 * Rows: 1/(k!)^2, H_k/(k!)^2; 1/(k! (k + 1)!), (H_k + 1/(2k + 2))/(k! (k + 1)!).
 */
enum { TERMS = 12 };
static const double k0_series[TERMS][2] = {
    { 1.0, 0.0 },
    { 1.0, 1.0 },
    { 0.25, 0.375 },
    { 0.027777777777777777778, 0.050925925925925925926 },
    { 0.0017361111111111111111, 0.0036168981481481481481 },
    { 0.000069444444444444444444, 0.00015856481481481481481 },
    { 1.9290123456790123457e-6, 4.7260802469135802469e-6 },
    { 3.9367598891408415218e-8, 1.0207455998272324803e-7 },
    { 6.1511873267825648778e-10, 1.6718048413148328114e-9 },
    { 7.5940584281266233059e-12, 2.1483350211950276805e-11 },
    { 7.5940584281266233059e-14, 2.2242756054762939135e-13 },
    { 6.2760813455591928148e-16, 1.8952995870061529211e-15 },
};
static const double k1_series[TERMS][2] = {
    { 1.0, 0.5 },
    { 0.5, 0.625 },
    { 0.083333333333333333333, 0.13888888888888888889 },
    { 0.0069444444444444444444, 0.013599537037037037037 },
    { 0.00034722222222222222222, 0.00075810185185185185185 },
    { 0.000011574074074074074074, 0.000027391975308641975309 },
    { 2.7557319223985890653e-7, 6.948381204333585286e-7 },
    { 4.9209498614260519022e-9, 1.3066879364179534248e-8 },
    { 6.8346525853139609753e-11, 1.8955312269348917959e-10 },
    { 7.5940584281266233059e-13, 2.186305313335660797e-12 },
    { 6.9036894801151120963e-15, 2.0534491389789722491e-14 },
    { 5.2300677879659940123e-17, 1.6012082716216524093e-16 },
};

static double complex bessel_small(double complex y, double complex log_z, const double series[TERMS][2])
{
    const double euler = 0.57721566490153286061, log_2 = 0.69314718055994530942;
    const double a = creal(y), b = cimag(y);
    double plain_re = 0.0, plain_im = 0.0, re = 0.0, im = 0.0;
    for (int k = TERMS - 1; k >= 0; k--) {
        const double plain_next = plain_re * a - plain_im * b + series[k][0];
        plain_im = plain_re * b + plain_im * a;
        plain_re = plain_next;
        const double next = re * a - im * b + series[k][1];
        im = re * b + im * a;
        re = next;
    }
    const double l_re = creal(log_z) + (euler - log_2), l_im = cimag(log_z);
    return re - (plain_re * l_re - plain_im * l_im) + I * (im - (plain_re * l_im + plain_im * l_re));
}

static bool is_small(double complex z)
{
    return square(creal(z)) + square(cimag(z)) < 4.0;
}

double complex dipole_bessel_k0(double complex z, double complex log_z)
{
    return is_small(z) ? bessel_small(0.25 * z * z, log_z, k0_series) : bessel_large(z, log_z, k0_poles);
}

double complex dipole_bessel_zk1(double complex z, double complex log_z)
{
    return is_small(z) ? 1.0 - 0.5 * z * z * bessel_small(0.25 * z * z, log_z, k1_series)
                       : z * bessel_large(z, log_z, k1_poles);
}

double complex dipole_bessel_zk1_complement(double complex z, double complex log_z)
{
    return is_small(z) ? 0.5 * z * z * bessel_small(0.25 * z * z, log_z, k1_series)
                       : 1.0 - z * bessel_large(z, log_z, k1_poles);
}
