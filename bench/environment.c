/*
 * What each order of harmonics leaves of a map's irradiance.
 * usage: bench_environment MAP.exr ETA
 *
 * Markdown rows: order; predicted error, largest error and root mean square over 500 normals, by the mean
 * irradiance, in %; the lowest irradiance before it is kept above 0, the same; microseconds for each
 * normal.
 */
#include "renderer/reference_environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { NORMALS = 500 };

static double now_us(void)
{
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec * 1e-3;
}

/* Even over the sphere: a spiral. */
static void normal_of(int i, double normal[3])
{
    const double y = 1 - (2 * i + 1.0) / NORMALS, s = sqrt(1 - y * y), phi = 2.39996322972865332 * i;
    normal[0] = s * sin(phi);
    normal[1] = y;
    normal[2] = s * cos(phi);
}

static void print_order(const struct render_environment *environment, double eta, int order,
                        double (*exact)[3])
{
    struct render_irradiance *irradiance;
    double largest = 0, square = 0, lowest = INFINITY;
    if (!render_irradiance_create_of_order(environment, eta, order, &irradiance, NULL))
        return;
    const double start_us = now_us();
    for (int i = 0; i < NORMALS; i++) {
        double normal[3], rgb[3];
        normal_of(i, normal);
        render_harmonics_sum(&environment->harmonics, order, (const double(*)[3])irradiance->coefficients,
                             normal, rgb);
        for (int c = 0; c < 3; c++) {
            const double error = (rgb[c] - exact[i][c]) / irradiance->mean[c];
            largest = fmax(largest, fabs(error));
            square += error * error / (3 * NORMALS);
            lowest = fmin(lowest, rgb[c] / irradiance->mean[c]);
        }
    }
    const double us = (now_us() - start_us) / NORMALS;
    printf("%d | %.2g | %.2g | %.2g | %.2g | %.2g\n", order, 100 * irradiance->error, 100 * largest,
           100 * sqrt(square), 100 * lowest, us);
    render_irradiance_destroy(irradiance);
}

int main(int argc, char **argv)
{
    static const int orders[] = { 0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64 };
    struct io_environment source = { .rgb = { 1, 1, 1 } };
    struct render_environment *environment;
    struct render_exact_irradiance *exact;
    static double sums[NORMALS][3];
    dipole_status status = { 0 };
    if (argc != 3) {
        fputs("usage: bench_environment MAP.exr ETA\n", stderr);
        return 2;
    }
    const double eta = strtod(argv[2], NULL);
    snprintf(source.path, sizeof source.path, "%s", argv[1]);
    if (!render_environment_read(&source, &environment, &status) ||
        !render_exact_irradiance_create(environment, eta, 0, &exact, &status)) {
        fprintf(stderr, "bench_environment: %s\n", status.message);
        return 1;
    }
    for (int i = 0; i < NORMALS; i++) {
        double normal[3];
        normal_of(i, normal);
        render_exact_irradiance_sum(exact, normal, sums[i]);
    }
    for (size_t i = 0; i < sizeof orders / sizeof *orders; i++)
        print_order(environment, eta, orders[i], sums);
    render_exact_irradiance_destroy(exact);
    render_environment_destroy(environment);
    return 0;
}
