#include "renderer/harmonics.h"

#include <assert.h>
#include <math.h>

#define PI 3.14159265358979323846

void render_harmonics_init(struct render_harmonics *harmonics)
{
    for (int l = 0; l <= RENDER_HARMONIC_LIMIT; l++) {
        for (int m = 0; m <= l; m++) {
            const double l2 = (double)l * l, m2 = (double)m * m, before2 = (l - 1.0) * (l - 1.0);
            double *const rise = &harmonics->rise[render_legendre_index(l, m)];
            double *const fall = &harmonics->fall[render_legendre_index(l, m)];
            if (m == l) { /* from degree and order one less, times the sine */
                *rise = l == 0 ? sqrt(1 / (4 * PI)) : sqrt((2.0 * l + 1) / (2.0 * l));
                *fall = 0;
            } else {
                *rise = sqrt((4 * l2 - 1) / (l2 - m2));
                *fall = l - 1 > m ? *rise * sqrt((before2 - m2) / (4 * before2 - 1)) : 0;
            }
        }
    }
}

void render_harmonics_legendre(const struct render_harmonics *harmonics, int degree, double cosine,
                               double sine, double functions[RENDER_LEGENDRE_COUNT])
{
    assert(degree >= 0 && degree <= RENDER_HARMONIC_LIMIT);
    for (int l = 0; l <= degree; l++) {
        const int row = render_legendre_index(l, 0), before = row - l, second = before - l + 1;
        for (int m = 0; m + 1 < l; m++)
            functions[row + m] = harmonics->rise[row + m] * cosine * functions[before + m] -
                                 harmonics->fall[row + m] * functions[second + m];
        if (l > 0)
            functions[row + l - 1] = harmonics->rise[row + l - 1] * cosine * functions[before + l - 1];
        functions[row + l] = harmonics->rise[row + l] * (l > 0 ? sine * functions[before + l - 1] : 1);
    }
}

void render_harmonics_sum(const struct render_harmonics *harmonics, int degree,
                          const double (*coefficients)[3], const double direction[3], double sum[3])
{
    double functions[RENDER_LEGENDRE_COUNT];
    const double cosine = fmin(fmax(direction[1], -1), 1), sine = hypot(direction[0], direction[2]);
    const double cosine_phi = sine > 0 ? direction[2] / sine : 1,
                 sine_phi = sine > 0 ? direction[0] / sine : 0;
    double along = 1, across = 0; /* cos(m phi), sin(m phi) */
    render_harmonics_legendre(harmonics, degree, cosine, sine, functions);
    for (int c = 0; c < 3; c++)
        sum[c] = 0;
    for (int m = 0; m <= degree; m++) {
        const double norm = m > 0 ? sqrt(2.0) : 1;
        double cosines[3] = { 0 }, sines[3] = { 0 };
        for (int l = m; l <= degree; l++) {
            const double p = functions[render_legendre_index(l, m)];
            const double *const a = coefficients[render_harmonic_index(l, m)];
            const double *const b = coefficients[render_harmonic_index(l, -m)];
            for (int c = 0; c < 3; c++) {
                cosines[c] += p * a[c];
                sines[c] += p * b[c];
            }
        }
        for (int c = 0; c < 3; c++)
            sum[c] += norm * (along * cosines[c] + across * sines[c]);
        const double next = along * cosine_phi - across * sine_phi;
        across = across * cosine_phi + along * sine_phi;
        along = next;
    }
}

void render_legendre_rule(int count, double points[], double weights[])
{
    assert(count > 0 && count <= RENDER_RULE_LIMIT);
    for (int i = 0; i < count; i++) {
        double x = cos(PI * (i + 0.75) / (count + 0.5)), slope = 1;
        for (int step = 0; step < 8; step++) { /* Newton's, which is done after five */
            double value = 1, before = 0;
            for (int l = 1; l <= count; l++) {
                const double next = ((2.0 * l - 1) * x * value - (l - 1.0) * before) / l;
                before = value;
                value = next;
            }
            slope = count * (x * value - before) / (x * x - 1);
            x -= value / slope;
        }
        points[i] = x;
        weights[i] = 2 / ((1 - x * x) * slope * slope);
    }
}
