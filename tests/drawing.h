/* Pictures of scenes in memory, and how far they are from what was expected. */
#ifndef DRAWING_H
#define DRAWING_H

#include "check.h"
#include "scenes.h"

#include "renderer/render.h"

static const double PI = 3.14159265358979323846;

static inline struct renderer *renderer_of(const struct test_scene *test, enum render_context_kind kind)
{
    struct renderer *renderer;
    dipole_status status;
    if (!render_create(&test->scene, kind, &renderer, &status))
        fail_msg("%s", status.message);
    return renderer;
}

static inline struct io_image *draw(struct renderer *renderer, const struct render_options *options,
                                    struct render_report *report)
{
    struct io_image *image;
    dipole_status status;
    if (!render_draw(renderer, options, &image, report, &status))
        fail_msg("%s", status.message);
    return image;
}

static inline struct render_capture *capture(struct renderer *renderer, double spacing_mm)
{
    struct render_capture *captured;
    dipole_status status;
    if (!render_capture_create(renderer, spacing_mm, &captured, &status))
        fail_msg("%s", status.message);
    return captured;
}

/* Sums of squares of a picture's values and of their errors, over the exact pixels. */
struct deviation {
    double error2, value2, worst, peak;
    size_t count;
};

static inline void deviation_add(struct deviation *deviation, double found, double expected)
{
    deviation->error2 += (found - expected) * (found - expected);
    deviation->value2 += expected * expected;
    deviation->worst = fmax(deviation->worst, fabs(found - expected));
    deviation->peak = fmax(deviation->peak, fabs(expected));
    deviation->count++;
}

static inline double relative_rmse(const struct deviation *deviation)
{
    assert_true(deviation->count > 300);
    return sqrt(deviation->error2 / deviation->value2);
}

/* What leaves a surface that faces the eye, in radiance, for one unit of radiosity. */
static inline double exit_per_sr(double eta)
{
    return (1 - dipole_fresnel_reflectance(eta, 1)) / (PI * dipole_fdt_outside(eta));
}

/* One medium of a model, the same in all channels, or two layers of it. */
static inline struct io_material grey(dipole_model model, bool is_layered)
{
    struct io_material material = { .model = model, .layer_count = is_layered ? 2 : 1 };
    strcpy(material.name, io_model_names[model]);
    for (int c = 0; c < 3; c++) {
        const dipole_medium top = { .sigma_a_per_mm = 0.3, .sigma_s_prime_per_mm = 4, .eta = 1.4 };
        const dipole_medium base = { .sigma_a_per_mm = 0.1, .sigma_s_prime_per_mm = 2, .eta = 1.4 };
        material.layers[c][0] = (dipole_layer){ top, is_layered ? 0.8 : INFINITY };
        material.layers[c][1] = (dipole_layer){ base, INFINITY };
    }
    return material;
}

#endif
