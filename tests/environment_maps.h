/* Maps of radiance in memory, for tests of light from all around. */
#ifndef ENVIRONMENT_MAPS_H
#define ENVIRONMENT_MAPS_H

#include "check.h"

#include "renderer/environment.h"

#define MAP_PI 3.14159265358979323846

/* Radiance of a direction, the same in all channels. */
typedef double sky_function(const double direction[3], const void *context);

/* Each pixel is its middle's. */
static inline struct io_image *map_of(int height_px, sky_function *radiance, const void *context)
{
    struct io_image *image;
    assert_true(io_image_create(2 * height_px, height_px, 3, &image, NULL));
    for (int i = 0; i < 2 * height_px * height_px; i++) {
        const double phi = MAP_PI - MAP_PI * (i % (2 * height_px) + 0.5) / height_px;
        const double theta = MAP_PI * (i / (2 * height_px) + 0.5) / height_px;
        const double direction[3] = { sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi) };
        for (int c = 0; c < 3; c++)
            image->pixels[3 * i + c] = (float)radiance(direction, context);
    }
    return image;
}

static inline struct render_environment *environment_of(const struct io_image *image, double rotate_rad)
{
    const double rgb[3] = { 1, 1, 1 };
    struct render_environment *environment;
    dipole_status status;
    if (!render_environment_create(image, rgb, rotate_rad, NULL, &environment, &status))
        fail_msg("%s", status.message);
    return environment;
}

static inline struct render_environment *sky_of(int height_px, sky_function *radiance, const void *context)
{
    struct io_image *const image = map_of(height_px, radiance, context);
    struct render_environment *const environment = environment_of(image, 0);
    io_image_destroy(image);
    return environment;
}

/* One of the bundled maps. */
static inline struct render_environment *probe(const char *name)
{
    struct io_environment source = { .rgb = { 1, 1, 1 } };
    struct render_environment *environment;
    dipole_status status;
    snprintf(source.path, sizeof source.path, SOURCE_FOLDER "/scenes/probes/%s.exr", name);
    if (!render_environment_read(&source, &environment, &status))
        fail_msg("%s", status.message);
    return environment;
}

static inline double constant_sky(const double direction[3], const void *context)
{
    (void)direction;
    return *(const double *)context;
}

static inline void random_direction(struct rng *rng, double direction[3])
{
    const double z = uniform(rng, -1, 1), phi = uniform(rng, 0, 2 * MAP_PI), s = sqrt(1 - z * z);
    direction[0] = s * cos(phi);
    direction[1] = s * sin(phi);
    direction[2] = z;
}

static const char *const probe_names[] = { "sky", "studio", "lamp" };
enum { PROBES = 3 };

#endif
