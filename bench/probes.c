/*
 * Makes the maps of scenes/probes, by formulas: no photograph is needed.
 * usage: bench_probes FOLDER
 */
#include "io/exr.h"

#include <math.h>
#include <stdio.h>

#define PI 3.14159265358979323846

enum { HEIGHT_PX = 64, WIDTH_PX = 2 * HEIGHT_PX, PARTS = 8 };

static double smooth(double from, double to, double x)
{
    const double t = fmin(fmax((x - from) / (to - from), 0), 1);
    return t * t * (3 - 2 * t);
}

static double degrees_between(const double a[3], double elevation_deg, double azimuth_deg)
{
    const double e = elevation_deg * PI / 180, z = azimuth_deg * PI / 180;
    const double b[3] = { cos(e) * sin(z), sin(e), cos(e) * cos(z) };
    return acos(fmin(fmax(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], -1), 1)) * 180 / PI;
}

/* Blue above, pale at the horizon, brown ground, and a sun 30 degrees high with four times its real width.
 */
static void sky(const double direction[3], double rgb[3])
{
    const double zenith[3] = { 0.12, 0.25, 0.6 }, horizon[3] = { 0.75, 0.8, 0.85 },
                 ground[3] = { 0.16, 0.13, 0.1 }, sun[3] = { 700, 620, 470 };
    const double up = direction[1], blend = sqrt(fmax(up, 0)), below = smooth(-0.03, 0.03, up);
    const double disc = degrees_between(direction, 30, 60) < 1 ? 1 : 0;
    for (int c = 0; c < 3; c++)
        rgb[c] = below * (horizon[c] + blend * (zenith[c] - horizon[c])) + (1 - below) * ground[c] +
                 disc * sun[c];
}

static double box(const double direction[3], double elevation_deg, double azimuth_deg, double half_width,
                  double half_height)
{
    const double azimuth = atan2(direction[0], direction[2]) * 180 / PI;
    const double elevation = asin(fmin(fmax(direction[1], -1), 1)) * 180 / PI;
    double across = fabs(azimuth - azimuth_deg);
    across = fmin(across, 360 - across);
    return (1 - smooth(half_width - 4, half_width + 4, across)) *
           (1 - smooth(half_height - 4, half_height + 4, fabs(elevation - elevation_deg)));
}

/* A warm box at the left, a cold one behind at the right, and a dim room. */
static void studio(const double direction[3], double rgb[3])
{
    const double warm = box(direction, 25, -55, 25, 30), cold = box(direction, 10, 140, 15, 40);
    rgb[0] = 0.05 + 6.0 * warm + 2.4 * cold;
    rgb[1] = 0.05 + 5.2 * warm + 3.0 * cold;
    rgb[2] = 0.05 + 4.0 * warm + 4.2 * cold;
}

/* One bright lamp in the dark, 6 degrees wide. */
static void lamp(const double direction[3], double rgb[3])
{
    const double disc = degrees_between(direction, 40, -35) < 3 ? 1 : 0;
    for (int c = 0; c < 3; c++)
        rgb[c] = 0.004 + disc * (c == 0 ? 400 : c == 1 ? 360 : 300);
}

static bool make(const char *folder, const char *name,
                 void (*radiance)(const double direction[3], double rgb[3]), dipole_status *status)
{
    char path[4096];
    struct io_image *image;
    snprintf(path, sizeof path, "%s/%s.exr", folder, name);
    if (!io_image_create(WIDTH_PX, HEIGHT_PX, 3, &image, status))
        return false;
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++) {
        double sum[3] = { 0 };
        for (int part = 0; part < PARTS * PARTS; part++) {
            const double x = i % WIDTH_PX + (part % PARTS + 0.5) / PARTS;
            const int row = i / WIDTH_PX, down = part / PARTS;
            const double y = row + (down + 0.5) / PARTS;
            const double phi = PI - 2 * PI * x / WIDTH_PX, theta = PI * y / HEIGHT_PX;
            const double direction[3] = { sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi) };
            double rgb[3];
            radiance(direction, rgb);
            for (int c = 0; c < 3; c++)
                sum[c] += rgb[c] / (PARTS * PARTS);
        }
        for (int c = 0; c < 3; c++)
            image->pixels[3 * i + c] = (float)sum[c];
    }
    const bool done = io_exr_write(path, image, true, status);
    io_image_destroy(image);
    return done;
}

int main(int argc, char **argv)
{
    dipole_status status = { 0 };
    if (argc != 2) {
        fputs("usage: bench_probes FOLDER\n", stderr);
        return 2;
    }
    if (!make(argv[1], "sky", sky, &status) || !make(argv[1], "studio", studio, &status) ||
        !make(argv[1], "lamp", lamp, &status)) {
        fprintf(stderr, "bench_probes: %s\n", status.message);
        return 1;
    }
    return 0;
}
