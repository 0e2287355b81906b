/* Inverse Hankel transforms along a contour. docs/theory.md T26. */
#include "internal.h"

/*
 * (1/2 pi) int_0^inf F(k) J_0(kr) k dk = (1/pi^2) Im int F(k^2 = -kappa^2) K_0(kappa r) kappa dkappa, from
 * the real axis below the first singularity kappa_1 to infinity. All singularities of a response lie on the
 * real axis from kappa_1 on. Along the hyperbola kappa = kappa_1 cosh(t + i angle) the integrand is
 * analytic at a distance `angle` in t on either side and falls as e^(-r Re kappa), so the midpoint rule in
 * t with step angle/7 leaves e^(-2 pi 7) = 1e-19 of what it is at the edges of that strip. The hyperbola
 * starts at kappa_1 cos(angle), where K_0 is e^(kappa_1 r (1 - cos(angle))) times the result: contours that
 * serve large kappa_1 r have smaller angles, and this stays below 40. Where kappa_1 = 0 one ray
 * e^(t + i pi/4) serves all.
 */
static double complex contour_point(const struct hankel *hankel, const struct hankel_contour *contour,
                                    size_t index, double complex *slope)
{
    const double complex t = ((double)index + 0.5) * contour->step + I * contour->angle;
    if (hankel->singularity_per_mm > 0.0) {
        *slope = hankel->singularity_per_mm * csinh(t);
        return hankel->singularity_per_mm * ccosh(t);
    }
    return *slope = cexp(t + hankel->log_start);
}

size_t dipole_hankel_plan(struct hankel *hankel, double singularity_per_mm, double r_min_mm,
                          double longest_mm)
{
    /* The profile needs wave numbers up to 160/r, where e^(-r Re kappa) is below 1e-17; the power within r,
     * a sum that falls as kappa^-2 only, needs more. */
    const double kappa_end = 1e7 / r_min_mm;
    *hankel = (struct hankel){ .singularity_per_mm = singularity_per_mm };
    /* The ray begins at 1e-26 of the smallest wave number: kappa^2 K_0 has died there. */
    hankel->log_start = -60.0 - log(longest_mm);
    for (int i = 0; i < HANKEL_CONTOURS; i++) {
        struct hankel_contour *const contour = &hankel->contours[i];
        contour->angle = 0.25 * PI * pow(0.5, i);
        contour->step = contour->angle / 7.0;
        contour->first = hankel->node_count;
        contour->kappa_r_min = i == 0 ? 0.0 : 8.0 * pow(4.0, i - 1);
        double length = 0.0; /* in t */
        if (singularity_per_mm > 0.0)
            length = i == 0 ? acosh(fmax(2.0, kappa_end / singularity_per_mm))
                            : acosh(1.0 + 60.0 / contour->kappa_r_min);
        else if (i == 0)
            length = log(kappa_end) - hankel->log_start;
        contour->count = (size_t)ceil(length / contour->step);
        hankel->node_count += contour->count;
    }
    return hankel->node_count;
}

void dipole_hankel_fill(struct hankel *hankel, struct hankel_node *nodes)
{
    hankel->nodes = nodes;
    for (int i = 0; i < HANKEL_CONTOURS; i++) {
        const struct hankel_contour *const contour = &hankel->contours[i];
        for (size_t j = 0; j < contour->count; j++) {
            double complex slope;
            const double complex kappa = contour_point(hankel, contour, j, &slope);
            nodes[contour->first + j] =
                (struct hankel_node){ kappa, contour->step / (PI * PI) * kappa * slope };
        }
    }
}

struct hankel_range dipole_hankel_range_for(const struct hankel *hankel, double r_mm)
{
    int i = HANKEL_CONTOURS - 1;
    while (i > 0 && (hankel->contours[i].count == 0 ||
                     hankel->singularity_per_mm * r_mm < hankel->contours[i].kappa_r_min))
        i--;
    const struct hankel_contour *const contour = &hankel->contours[i];
    /* What is e^(-60) of the first node is lost beside it. Re kappa grows with the index. */
    const double last = hankel->singularity_per_mm * r_mm + 60.0;
    size_t lo = 0, hi = contour->count;
    while (lo < hi) {
        const size_t middle = lo + (hi - lo) / 2;
        if (creal(hankel->nodes[contour->first + middle].kappa) * r_mm > last)
            hi = middle;
        else
            lo = middle + 1;
    }
    return (struct hankel_range){ contour->first, lo };
}

struct hankel_range dipole_hankel_range_all(const struct hankel *hankel)
{
    return (struct hankel_range){ hankel->contours[0].first, hankel->contours[0].count };
}

double dipole_hankel_start_share(const struct hankel *hankel)
{
    return hankel->singularity_per_mm > 0.0 ? 0.0 : hankel->contours[0].angle / (0.5 * PI);
}

double complex dipole_hankel_profile_kernel(double complex kappa, double r_mm)
{
    const double complex x = kappa * r_mm;
    return dipole_bessel_k_scaled(x).k0 * cexp(-x);
}

double complex dipole_hankel_beyond_kernel(double complex kappa, double r_mm)
{
    const double complex x = kappa * r_mm;
    return 2.0 * PI * r_mm / kappa * dipole_bessel_k_scaled(x).k1 * cexp(-x);
}

/* 1 - x K_1(x) by its series where x is small and it would cancel. */
double complex dipole_hankel_within_kernel(double complex kappa, double r_mm)
{
    const double complex x = kappa * r_mm;
    const double complex scale = 2.0 * PI / (kappa * kappa);
    if (creal(x) > 60.0)
        return scale;
    if (cabs(x) > 0.5)
        return scale * (1.0 - x * dipole_bessel_k_scaled(x).k1 * cexp(-x));
    const double euler = 0.57721566490153286061;
    const double complex y = 0.25 * x * x, log_half = clog(0.5 * x) + euler;
    double complex term = 1.0, sum = log_half - 0.5;
    double harmonic = 0.0;
    for (int k = 1; k < 12; k++) {
        harmonic += 1.0 / k;
        term *= y / ((double)k * (k + 1));
        sum += term * (log_half - harmonic - 0.5 / (k + 1));
    }
    return scale * (-2.0 * y * sum);
}
