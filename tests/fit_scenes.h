/* Scenes for the tests of fit: points on simple bodies, lit by formula, and pictures of them by direct sum.
 */
#ifndef FIT_SCENES_H
#define FIT_SCENES_H

#include "check.h"
#include "fit/operator.h"

#include <stdlib.h>

struct fit_scene {
    struct fit_geometry geometry;
    float *positions_mm;
    struct render_light_sample *samples;
    int *tiles;
};

static inline void fit_scene_allocate(struct fit_scene *scene, size_t pixel_count, size_t sample_count)
{
    *scene = (struct fit_scene){
        .positions_mm = calloc(3 * pixel_count, sizeof(float)),
        .samples = calloc(sample_count, sizeof(struct render_light_sample)),
        .tiles = calloc(pixel_count, sizeof(int)),
    };
    assert_true(scene->positions_mm && scene->samples && scene->tiles);
    scene->geometry = (struct fit_geometry){ .positions_mm = scene->positions_mm,
                                             .pixel_count = pixel_count,
                                             .samples = scene->samples,
                                             .sample_count = sample_count,
                                             .cut_mm = INFINITY };
}

static inline void fit_scene_free(struct fit_scene *scene)
{
    free(scene->positions_mm);
    free(scene->samples);
    free(scene->tiles);
}

/* Point i of count on the unit sphere, spread evenly (Fibonacci), the first at +z, the last at -z. */
static inline void sphere_point(size_t i, size_t count, double out[3])
{
    const double z = 1.0 - 2.0 * ((double)i + 0.5) / (double)count;
    const double angle_rad = 2.399963229728653 * (double)i;
    const double across = sqrt(1.0 - z * z);
    out[0] = across * cos(angle_rad);
    out[1] = across * sin(angle_rad);
    out[2] = z;
}

/* A sphere lit along -z and seen along -x: half the picture is lit, half in shadow. Tiles are 8 x 8 in
 * the picture's plane. */
static inline void fit_scene_sphere(struct fit_scene *scene, double radius_mm, size_t pixel_count,
                                    size_t sample_count)
{
    fit_scene_allocate(scene, pixel_count, sample_count);
    for (size_t i = 0; i < sample_count; i++) {
        double p[3];
        sphere_point(i, 2 * sample_count, p);
        for (int a = 0; a < 3; a++) {
            scene->samples[i].position_mm[a] = (float)(radius_mm * p[a]);
            scene->samples[i].flux_w[a] = (float)p[2];
        }
    }
    for (size_t j = 0; j < pixel_count; j++) {
        double p[3];
        sphere_point(j, 2 * pixel_count, p); /* z becomes x */
        scene->positions_mm[3 * j] = (float)(radius_mm * p[2]);
        scene->positions_mm[3 * j + 1] = (float)(radius_mm * p[0]);
        scene->positions_mm[3 * j + 2] = (float)(radius_mm * p[1]);
        scene->tiles[j] = (int)(4.0 + 4.0 * p[0]) + 8 * (int)(4.0 + 4.0 * p[1]);
    }
}
enum { FIT_SCENE_TILES = 64 };

/* Radiosity at one pixel: the definition, sample by sample. */
static inline double direct_radiosity(const struct fit_scene *scene,
                                      const dipole_coefficients *coefficients, int channel, size_t pixel)
{
    const float *x = scene->positions_mm + 3 * pixel;
    double sum = 0.0;
    for (size_t i = 0; i < scene->geometry.sample_count; i++) {
        const struct render_light_sample *sample = &scene->samples[i];
        const double dx = (double)x[0] - (double)sample->position_mm[0];
        const double dy = (double)x[1] - (double)sample->position_mm[1];
        const double dz = (double)x[2] - (double)sample->position_mm[2];
        const double r_mm = sqrt(dx * dx + dy * dy + dz * dz);
        if (r_mm <= scene->geometry.cut_mm)
            sum += (double)sample->flux_w[channel] * dipole_rd_per_mm2(coefficients, r_mm);
    }
    return sum;
}

#endif
