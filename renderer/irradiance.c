#include "renderer/environment.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum {
    KERNEL_POINTS = RENDER_RULE_LIMIT, /* of Gauss's rule on each panel, exact for degree 127 */
    KERNEL_PANELS = 20,                /* each half as wide as the one before                 */
    ORDERS = RENDER_HARMONIC_LIMIT + 1,
};

/* ---- the kernel --------------------------------------------------------------------------------- */

static void add_point(double eta, double cosine, double weight, const double shares[ORDERS],
                      struct render_kernel *kernel)
{
    const double value = (1 - dipole_fresnel_reflectance(eta, cosine)) * cosine;
    double p = 1, before = 0;
    for (int l = 0; l < ORDERS; l++) {
        kernel->transfer[l] += 2 * PI * weight * value * p;
        const double next = cosine * p + (cosine * p - before) * shares[l];
        before = p;
        p = next;
    }
    kernel->square += 2 * PI * weight * value * value;
}

/*
 * F_t is analytic in the cosine but for where the square root of eta^2 - 1 + mu^2 begins: at total
 * reflection, or close to 0 for an eta just above 1. Panels are finer and finer toward it; where it lies in
 * the range the variable is the root itself.
 */
void render_kernel_init(double eta, struct render_kernel *kernel)
{
    double points[KERNEL_POINTS], weights[KERNEL_POINTS], shares[ORDERS];
    const double least = eta < 1 ? sqrt((1 - eta) * (1 + eta)) : 0;
    render_legendre_rule(KERNEL_POINTS, points, weights);
    *kernel = (struct render_kernel){ .square = 0 };
    for (int l = 0; l < ORDERS; l++)
        shares[l] = l / (l + 1.0);
    for (int panel = 0; panel < KERNEL_PANELS; panel++) {
        const double end = ldexp(1, -panel), begin = panel + 1 < KERNEL_PANELS ? 0.5 * end : 0;
        for (int i = 0; i < KERNEL_POINTS; i++) {
            const double half = 0.5 * (end - begin), u = begin + half * (1 + points[i]);
            const double cosine = eta < 1 ? least + (1 - least) * u * u : u;
            const double slope = eta < 1 ? 2 * (1 - least) * u : 1;
            add_point(eta, fmin(cosine, 1), half * weights[i] * slope, shares, kernel);
        }
    }
}

/* ---- irradiance --------------------------------------------------------------------------------- */

double render_irradiance_error(const struct render_environment *environment,
                               const struct render_kernel *kernel, int order)
{
    double largest = 0, square = kernel->square;
    for (int l = 0; l < ORDERS; l++)
        square -= (2 * l + 1) / (4 * PI) * kernel->transfer[l] * kernel->transfer[l];
    for (int c = 0; c < 3; c++) {
        const double uniform = 4 * PI * environment->mean[c] * environment->mean[c];
        double sum = fmax(square, 0) * fmin(environment->rest[c] / (2 * ORDERS + 1), uniform);
        for (int l = order + 1; l < ORDERS; l++)
            sum += kernel->transfer[l] * kernel->transfer[l] * environment->power[l][c] / (4 * PI);
        if (environment->mean[c] > 0)
            largest = fmax(largest, sqrt(sum) / (kernel->transfer[0] * environment->mean[c]));
    }
    return largest;
}

static bool create(const struct render_environment *environment, double eta,
                   const struct render_kernel *kernel, int order, struct render_irradiance **irradiance_out,
                   dipole_status *status)
{
    const size_t count = (size_t)(order + 1) * (size_t)(order + 1);
    struct render_irradiance *const irradiance = calloc(1, sizeof *irradiance);
    double(*const coefficients)[3] = calloc(count, sizeof *coefficients);
    if (!irradiance || !coefficients) {
        free(irradiance);
        free(coefficients);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu harmonics", count);
    }
    *irradiance = (struct render_irradiance){ .environment = environment,
                                              .eta = eta,
                                              .order = order,
                                              .error = render_irradiance_error(environment, kernel, order),
                                              .coefficients = coefficients };
    for (int l = 0; l <= order; l++) {
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            for (int c = 0; c < 3; c++)
                coefficients[i][c] = kernel->transfer[l] * environment->coefficients[i][c];
        }
    }
    for (int c = 0; c < 3; c++)
        irradiance->mean[c] = kernel->transfer[0] * environment->mean[c];
    *irradiance_out = irradiance;
    return true;
}

bool render_irradiance_create_of_order(const struct render_environment *environment, double eta, int order,
                                       struct render_irradiance **irradiance_out, dipole_status *status)
{
    struct render_kernel kernel;
    *irradiance_out = NULL;
    render_kernel_init(eta, &kernel);
    return create(environment, eta, &kernel, order, irradiance_out, status);
}

bool render_irradiance_create(const struct render_environment *environment, double eta, double epsilon,
                              struct render_irradiance **irradiance_out, dipole_status *status)
{
    struct render_kernel kernel;
    int order = 0;
    *irradiance_out = NULL;
    render_kernel_init(eta, &kernel);
    while (order < RENDER_HARMONIC_LIMIT && render_irradiance_error(environment, &kernel, order) > epsilon)
        order++;
    return create(environment, eta, &kernel, order, irradiance_out, status);
}

void render_irradiance_destroy(struct render_irradiance *irradiance)
{
    if (!irradiance)
        return;
    free(irradiance->coefficients);
    free(irradiance);
}

void render_irradiance_at(const struct render_irradiance *irradiance, const double normal[3], double rgb[3])
{
    render_harmonics_sum(&irradiance->environment->harmonics, irradiance->order,
                         (const double(*)[3])irradiance->coefficients, normal, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(rgb[c], 0);
}
