/* Bodies for the tests of the path tracer, and what they compare with. */
#ifndef TRACER_SCENES_H
#define TRACER_SCENES_H

#include "check.h"
#include "path_tracer.h"
#include "path_tracer_parts.h"

static inline void trace(const struct tracer_scene *scene, size_t photon_count, uint64_t seed,
                         struct tracer_result *result)
{
    const struct tracer_run run = { photon_count, seed, 0 };
    dipole_status status;
    if (!tracer_trace(scene, &run, result, &status))
        fail_msg("%s", status.message);
}

/* Squared differences over squared errors. If errors are right their mean is 1 and its spread is
 * sqrt(2/count), a little more since 32 batches know their error to 13 %. */
struct chi2 {
    double sum;
    int count;
};

static inline void chi2_add(struct chi2 *chi2, double found, double expected, double error)
{
    chi2->sum += (found - expected) * (found - expected) / (error * error);
    chi2->count++;
}

static inline void chi2_check(const struct chi2 *chi2, int least_count, const char *what)
{
    assert_true(chi2->count >= least_count);
    const double mean = chi2->sum / chi2->count, allowed = 1.1 + 5 * sqrt(2.0 / chi2->count);
    if (mean > allowed)
        fail_msg("%s: chi^2 %g for %d numbers", what, chi2->sum, chi2->count);
}

static inline void check_number(double found, double expected, double error, const char *what)
{
    if (!(fabs(found - expected) <= 5 * error))
        fail_msg("%s: found %.9g, expected %.9g, error %.3g", what, found, expected, error);
}

/* Light in W and what became of it. Russian roulette is counted, so this holds to rounding. */
static inline void check_balance(const struct tracer_powers *powers)
{
    double sum = powers->mirrored + powers->absorbed + powers->roulette;
    for (int face = 0; face < TRACER_FACES; face++)
        sum += powers->scattered[face] + powers->unscattered[face];
    assert_close(sum, powers->incident, 1e-10, "energy");
}

/* Wide boxes have sides so far away that nothing comes there. */
#define WIDE_MM 1e6

/* Lit from +z. */
static inline struct tracer_scene sphere_scene(double sigma_a_per_mm, double sigma_s_per_mm, double g,
                                               double eta)
{
    return (struct tracer_scene){
        .body = { .kind = TRACER_SPHERE, .centre_mm = { 1, 2, 3 }, .radius_mm = 2 },
        .medium = { sigma_a_per_mm, sigma_s_per_mm, g, eta },
        .light = { TRACER_DIRECTIONAL, { 0, 0, -1 }, { 0 }, 3 },
    };
}

enum { SIDE = 24, PIXELS = SIDE * SIDE };

/* From a direction onto the sphere of sphere_scene(). */
static inline struct tracer_view sphere_view(const double toward_eye[3], enum tracer_estimator estimator)
{
    return (struct tracer_view){
        .camera = { .eye_mm = { 1 + 50 * toward_eye[0], 2 + 50 * toward_eye[1], 3 + 50 * toward_eye[2] },
                    .target_mm = { 1, 2, 3 },
                    .up = { 0, 1, 0 },
                    .is_orthographic = true,
                    .height_mm = 4.2,
                    .width_px = SIDE,
                    .height_px = SIDE },
        .estimator = estimator,
        .cone_rad = 0.15,
    };
}

struct picture {
    float radiance[PIXELS], error[PIXELS];
    struct tracer_result result;
};

static inline void draw(struct tracer_scene scene, const struct tracer_view *view, size_t photon_count,
                        struct picture *out)
{
    scene.view = view;
    out->result = (struct tracer_result){ .radiance = out->radiance, .radiance_error = out->error };
    trace(&scene, photon_count, 77, &out->result);
}

#endif
