#include "renderer/footprint.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum {
    STEPS = 8,   /* nodes and rings to a standard deviation                                       */
    REACH = 32,  /* of the table, in standard deviations; beyond, a spread changes little, a blur
                    nothing */
    KERNEL = 10, /* of the kernel: six standard deviations of its widest Gaussian                 */
    GAUSSIANS = 3,
    SPECTRUM_STEPS = 6, /* to a factor of two in frequency      */
    WIDTH_STEPS = 8,    /* to a factor of two in the width of patches */
    WIDTH_COUNT = 6,    /* down to 0.65 of the spacing: less light is seen of narrower ones */
    SPACING_GAIN = 4    /* at most, by spread                   */
};

/* Second moments take most of aliasing away where patches stand in rows (T82). Where they do not, as along
 * outlines, all that T11 tells of may be seen: so much of it is let stand. */
#define IRREGULAR_LIMIT 0.01

static const double gaussian_weights[GAUSSIANS] = { 3, -3, 1 }; /* of variances 1, 2, 3 */

/* x: frequency times blur. */
static double kernel_spectrum(double x)
{
    const double e = exp(-0.5 * x * x);
    return e * (3 + e * (-3 + e));
}

/* Of patches on a square lattice, at the frequency of their spacing: what is left of the lit face's profile
 * by the blur, by the spread, and by what the sample's own second moment asks for beyond it; T82. */
static double part_seen(double spacing_mm, const struct render_footprint_kernel *kernel)
{
    const double k_per_mm = 2 * PI / spacing_mm;
    const double blurred = kernel_spectrum(k_per_mm * kernel->blur_mm);
    if (!(kernel->spread_mm > 0))
        return blurred;
    const double spread = 0.5 * k_per_mm * k_per_mm * kernel->spread_mm * kernel->spread_mm;
    return blurred * exp(-spread) * fabs(1 + spread - PI * PI / 6);
}

/* Without spread the widest patches are the worst. */
static int width_count(double spread_mm)
{
    return spread_mm > 0 ? WIDTH_COUNT : 1;
}

/* Of the i-th of the widths that are looked at. */
static double width_mm(double spacing_mm, int i)
{
    return spacing_mm * exp2(-(double)i / WIDTH_STEPS);
}

/* Of patches so wide. */
static double aliasing_of(const dipole_stack *stack, double patch_mm,
                          const struct render_footprint_kernel *kernel)
{
    return 4 * part_seen(patch_mm, kernel) *
           dipole_stack_spectrum(stack, DIPOLE_FACE_LIT, 2 * PI / patch_mm) /
           dipole_stack_total(stack, DIPOLE_FACE_LIT);
}

double render_footprint_aliasing(const dipole_stack *stack, double spacing_mm,
                                 const struct render_footprint_kernel *kernel)
{
    double worst = 0;
    for (int i = 0; i < width_count(kernel->spread_mm); i++)
        worst = fmax(worst, aliasing_of(stack, width_mm(spacing_mm, i), kernel));
    return worst;
}

/* That leaves so much of the aliasing of patches so wide. */
static double blur_for(double aliasing, double limit, double patch_mm)
{
    if (!(aliasing > limit))
        return 0;
    const double part = cbrt(1 - limit / aliasing); /* 1 - e^(-x^2/2) */
    return patch_mm / (2 * PI) * sqrt(-2 * log1p(-part));
}

double render_footprint_blur_mm(const dipole_stack *stack, double spacing_mm, double spread_mm,
                                double epsilon)
{
    const struct render_footprint_kernel spread = { .spread_mm = spread_mm }, point = { .spread_mm = 0 };
    double blur_mm = 0;
    for (int i = 0; i < width_count(spread_mm); i++) {
        const double patch_mm = width_mm(spacing_mm, i);
        blur_mm = fmax(blur_mm, blur_for(aliasing_of(stack, patch_mm, &spread), epsilon, patch_mm));
    }
    return fmax(blur_mm, blur_for(aliasing_of(stack, spacing_mm, &point), fmax(epsilon, IRREGULAR_LIMIT),
                                  spacing_mm));
}

double render_footprint_sharp_spacing_mm(const dipole_stack *stack, double epsilon, double spread)
{
    double low_mm = dipole_stack_splat_spacing_mm(stack, DIPOLE_FACE_LIT, epsilon);
    double high_mm = SPACING_GAIN * low_mm;
    while (spread > 0 && high_mm > 1.002 * low_mm) {
        const double middle_mm = sqrt(low_mm * high_mm);
        const bool is_sharp =
            !(render_footprint_blur_mm(stack, middle_mm, spread * middle_mm, epsilon) > 0);
        *(is_sharp ? &low_mm : &high_mm) = middle_mm;
    }
    return low_mm;
}

/*
 * The response to an edge at 0 is 1/2 + (1/pi) int spectrum(k) sin(kx)/k dk, and so differs by at most
 * (1/pi) int spectrum(k) (1 - blur(k))/k dk: the trapezoidal rule in log k, over which the integrand rises
 * as k^6 and falls with the spectrum. A mean over w leaves |sin(kw/2)/(kw/2)| of each wave, at most 2/(kw).
 */
double render_footprint_error(const dipole_stack *stack, double blur_mm, double pixel_mm)
{
    const double step = log(2) / SPECTRUM_STEPS;
    double sum = 0;
    for (int i = -4 * SPECTRUM_STEPS; i <= 20 * SPECTRUM_STEPS; i++) {
        const double x = exp(i * step);
        const double lost = -expm1(-0.5 * x * x);
        const double k_per_mm = x / blur_mm, seen = fmin(2 / (k_per_mm * pixel_mm), 1);
        const double term =
            seen * lost * lost * lost * dipole_stack_spectrum(stack, DIPOLE_FACE_LIT, k_per_mm);
        sum += term;
        if (i > 0 && term < 1e-6 * sum)
            break;
    }
    return sum * step / PI / dipole_stack_total(stack, DIPOLE_FACE_LIT);
}

double render_footprint_spacing_mm(const dipole_stack *stack, double epsilon, double spread,
                                   double least_mm, double pixel_mm)
{
    double high_mm = least_mm;
    for (int i = 0; i < 40; i++) {
        const double blur_mm = render_footprint_blur_mm(stack, 2 * high_mm, 2 * spread * high_mm, epsilon);
        if (blur_mm > 0 && render_footprint_error(stack, blur_mm, pixel_mm) > epsilon)
            break;
        high_mm *= 2;
    }
    double low_mm = high_mm;
    high_mm *= 2;
    while (high_mm > 1.02 * low_mm) {
        const double middle_mm = sqrt(low_mm * high_mm);
        const double blur_mm = render_footprint_blur_mm(stack, middle_mm, spread * middle_mm, epsilon);
        if (blur_mm > 0 && render_footprint_error(stack, blur_mm, pixel_mm) > epsilon)
            high_mm = middle_mm;
        else
            low_mm = middle_mm;
    }
    return low_mm;
}

/* I_0(x) exp(-x), x >= 0: Abramowitz and Stegun 9.8.1 and 9.8.2, off by less than 2e-7. */
static double scaled_bessel_i0(double x)
{
    if (x < 3.75) {
        const double t = x / 3.75, t2 = t * t;
        const double sum =
            1 + t2 * (3.5156229 +
                      t2 * (3.0899424 +
                            t2 * (1.2067492 + t2 * (0.2659732 + t2 * (0.0360768 + t2 * 0.0045813)))));
        return sum * exp(-x);
    }
    const double u = 3.75 / x;
    const double sum =
        0.39894228 +
        u * (0.01328592 +
             u * (0.00225319 +
                  u * (-0.00157565 +
                       u * (0.00916281 +
                            u * (-0.02057706 + u * (0.02635537 + u * (-0.01647633 + u * 0.00392377)))))));
    return sum / sqrt(x);
}

/* Mean of a Gaussian over a ring of radius s_mm about a point at r_mm. */
static double gaussian_over_ring(double variance_mm2, double r_mm, double s_mm)
{
    return exp(-0.5 * (r_mm - s_mm) * (r_mm - s_mm) / variance_mm2) *
           scaled_bessel_i0(r_mm * s_mm / variance_mm2) / (2 * PI * variance_mm2);
}

double render_footprint_kernel_per_mm2(const struct render_footprint_kernel *kernel, double r_mm,
                                       double s_mm)
{
    const double blur2_mm2 = kernel->blur_mm * kernel->blur_mm,
                 spread2_mm2 = kernel->spread_mm * kernel->spread_mm;
    if (!(blur2_mm2 > 0))
        return gaussian_over_ring(spread2_mm2, r_mm, s_mm);
    double sum = 0;
    for (int i = 0; i < GAUSSIANS; i++)
        sum += gaussian_weights[i] * gaussian_over_ring((i + 1) * blur2_mm2 + spread2_mm2, r_mm, s_mm);
    return sum;
}

double render_footprint_exact_per_mm2(const struct render_footprint *footprint, double r_mm)
{
    const int near = (int)(r_mm / footprint->step_mm), reach = KERNEL * STEPS;
    const int first = near > reach ? near - reach : 0;
    const int last = near + reach < footprint->ring_count ? near + reach : footprint->ring_count - 1;
    double sum = 0;
    for (int i = first; i <= last; i++)
        sum += footprint->power[i] *
               render_footprint_kernel_per_mm2(&footprint->kernel, r_mm, i * footprint->step_mm);
    return sum;
}

/* f + spread^2/2 (f'' + f'/r): in log r the second derivative over r^2. A blur has no second moment. */
double render_footprint_far_per_mm2(const struct render_footprint *footprint, double r_mm,
                                    const double profile_per_mm2[3])
{
    const double stride = log(RENDER_FOOTPRINT_STRIDE), *const f = profile_per_mm2;
    const double ratio = footprint->kernel.spread_mm / (r_mm * stride);
    return f[1] + 0.5 * ratio * ratio * (f[0] - 2 * f[1] + f[2]);
}

bool render_footprint_create(const dipole_stack *stack, const struct render_footprint_kernel *kernel,
                             struct render_footprint **footprint_out, dipole_status *status)
{
    const int count = REACH * STEPS + 2, ring_count = (REACH + KERNEL) * STEPS + 1;
    struct render_footprint *const footprint =
        malloc(sizeof *footprint + (size_t)(count + ring_count) * sizeof *footprint->values_per_mm2);
    *footprint_out = NULL;
    if (!footprint)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a profile of %d nodes",
                           count);
    const double step_mm = hypot(kernel->blur_mm, kernel->spread_mm) / STEPS;
    double *const power = footprint->values_per_mm2 + count;
    double within = 0;
    for (int i = 0; i < ring_count; i++) { /* the rings about i steps; the first is a disc */
        const double next = dipole_stack_within(stack, DIPOLE_FACE_LIT, (i + 0.5) * step_mm);
        power[i] = fmax(next - within, 0);
        within = next;
    }
    *footprint = (struct render_footprint){ .kernel = *kernel,
                                            .step_mm = step_mm,
                                            .reach_mm = (count - 2) * step_mm,
                                            .count = count,
                                            .ring_count = ring_count,
                                            .power = power };
    for (int node = 0; node < count; node++)
        footprint->values_per_mm2[node] = render_footprint_exact_per_mm2(footprint, node * step_mm);
    *footprint_out = footprint;
    return true;
}

/* A cubic through four nodes; even about 0. */
double render_footprint_sample(const struct render_footprint *footprint, double r_mm)
{
    const double index = r_mm / footprint->step_mm;
    const int i = (int)fmin(index, footprint->count - 3), before = i > 0 ? i - 1 : 1;
    const double t = index - i, *const v = footprint->values_per_mm2;
    return -t * (t - 1) * (t - 2) / 6 * v[before] + (t + 1) * (t - 1) * (t - 2) / 2 * v[i] -
           (t + 1) * t * (t - 2) / 2 * v[i + 1] + (t + 1) * t * (t - 1) / 6 * v[i + 2];
}
