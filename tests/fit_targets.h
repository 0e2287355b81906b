/* Targets for the tests of fit: pictures of simple bodies, with what a camera adds to them. */
#ifndef FIT_TARGETS_H
#define FIT_TARGETS_H

#include "fit/blur.h"
#include "fit/problem.h"
#include "fit_scenes.h"

#include <string.h>

/* Everything that a target points to. */
struct fit_made {
    struct fit_scene scene;
    struct fit_operator *op;
    struct fit_blur *blur;
    struct fit_datum *data;
    struct fit_target target;
    double mean; /* of the values of the first channel */
};

static inline struct fit_form fit_form_of(dipole_model model, const dipole_medium *medium,
                                          double thickness_mm, int channel_count)
{
    struct fit_form form = { .model = model, .channel_count = channel_count, .layer_count = 1 };
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        form.layers[c][0] = (dipole_layer){ .medium = *medium, .thickness_mm = thickness_mm };
    return form;
}

/* The same form, beginning elsewhere. */
static inline struct fit_form fit_form_from(const struct fit_form *form, double a_factor, double s_factor)
{
    struct fit_form moved = *form;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        dipole_medium *const medium = &moved.layers[c][moved.layer].medium;
        medium->sigma_a_per_mm *= a_factor;
        medium->sigma_s_prime_per_mm *= s_factor;
    }
    return moved;
}

/* A target over scene, whose positions and samples are set. blur_mm 0: none. Values are still 0. */
static inline void fit_made_create(struct fit_made *made, double finest_mm, double blur_mm,
                                   int channel_count)
{
    struct fit_scene *const scene = &made->scene;
    const size_t pixel_count = scene->geometry.pixel_count;
    made->blur = NULL;
    scene->geometry.finest_mm = blur_mm > 0 ? fmax(finest_mm, 1.5 * blur_mm) : finest_mm;
    assert_true(fit_operator_create(&scene->geometry, NULL, &made->op, NULL));
    if (blur_mm > 0)
        assert_true(fit_blur_create(made->op->node_r_mm, made->op->node_count, blur_mm, blur_mm,
                                    &made->blur, NULL));
    made->data = calloc((size_t)channel_count * pixel_count, sizeof *made->data);
    assert_non_null(made->data);
    for (int c = 0; c < channel_count; c++) {
        for (size_t j = 0; j < pixel_count; j++) {
            const double exit_per_sr = 0.3 + 0.1 * sin((double)j);
            made->data[(size_t)c * pixel_count + j] = (struct fit_datum){
                .row = fit_operator_row(made->op, c, j),
                .count = made->op->node_count,
                .factor = exit_per_sr * made->op->colour[c],
                .constant = 1e-3 * (1 + cos(0.37 * (double)j)),
                .ambient_share = exit_per_sr,
                .sigma = 1,
                .robust = 1,
                .channel = c,
                .tile = scene->tiles[j],
            };
        }
    }
    made->target = (struct fit_target){
        .is_coloured_by_camera = true,
        .name = "picture",
        .node_count = made->blur ? made->blur->node_count : made->op->node_count,
        .node_r_mm = made->blur ? made->blur->node_r_mm : made->op->node_r_mm,
        .row_node_count = made->op->node_count,
        .data = made->data,
        .datum_count = (size_t)channel_count * pixel_count,
        .tile_count = FIT_SCENE_TILES,
        .finest_mm = finest_mm,
        .largest_mm = made->op->node_r_mm[made->op->node_count - 1],
    };
    for (int c = 0; made->blur && c < FIT_CHANNEL_COUNT; c++)
        made->target.blur[c] = made->blur->matrix;
}

static inline void fit_made_destroy(struct fit_made *made)
{
    fit_operator_destroy(made->op);
    free(made->blur);
    free(made->data);
    fit_scene_free(&made->scene);
}

/* Once the values are there: the scales, and a relative error with a floor, as pictures have it. */
static inline void fit_made_weigh(struct fit_made *made)
{
    fit_target_measure_scales(&made->target);
    for (size_t i = 0; i < made->target.datum_count; i++) {
        struct fit_datum *const datum = &made->data[i];
        datum->sigma = fmax(datum->value, 0) + 0.1 * made->target.value_scale[datum->channel];
        datum->robust = 1;
    }
    made->mean = made->target.value_scale[0];
}

/* What stands between the medium and the values. */
struct fit_camera {
    double gain[FIT_CHANNEL_COUNT], ambient, black;
};

/* The values that the target itself predicts. */
static inline void fit_made_predict(struct fit_made *made, const struct fit_form *form,
                                    const struct fit_camera *camera)
{
    struct fit_target *const target = &made->target;
    double *const scratch = malloc(target->node_count * (1 + FIT_COEFFICIENT_COUNT) * sizeof *scratch);
    double *const nodes = malloc(target->row_node_count * sizeof *nodes);
    assert_true(scratch && nodes);
    for (int c = 0; c < form->channel_count; c++) {
        double logs[FIT_COEFFICIENT_COUNT];
        fit_form_start(form, c, logs);
        assert_true(fit_target_evaluate(target, form, c, logs, scratch, nodes, NULL));
        for (size_t i = 0; i < target->datum_count; i++) {
            struct fit_datum *const datum = &target->data[i];
            double sum = 0;
            if (datum->channel != c)
                continue;
            for (size_t k = 0; k < datum->count; k++)
                sum += datum->row[k] * nodes[datum->first + k];
            datum->value = camera->gain[c] * (datum->factor * sum + datum->constant) +
                           camera->ambient * datum->ambient_share + camera->black;
        }
    }
    free(scratch);
    free(nodes);
    fit_made_weigh(made);
}

static const struct fit_camera fit_plain_camera = { .gain = { 1, 1, 1 } };

/* The dipole's values by the direct sum over light samples, without the operator. */
static inline void fit_made_sum(struct fit_made *made, const struct fit_form *form)
{
    dipole_coefficients coefficients[FIT_CHANNEL_COUNT];
    const size_t pixel_count = made->scene.geometry.pixel_count;
    for (int c = 0; c < form->channel_count; c++)
        assert_true(dipole_coefficients_init(&form->layers[c][0].medium, &coefficients[c], NULL));
    for (size_t i = 0; i < made->target.datum_count; i++) {
        struct fit_datum *const datum = &made->data[i];
        const double exit_per_sr = datum->ambient_share;
        datum->value =
            datum->constant + exit_per_sr * direct_radiosity(&made->scene, &coefficients[datum->channel],
                                                             datum->channel, i % pixel_count);
    }
    fit_made_weigh(made);
}

/* A sphere of a medium: a few tens of mean free paths, no more than a few diffuse ones. */
static inline void fit_made_sphere(struct fit_made *made, const dipole_medium *medium, size_t pixel_count,
                                   size_t sample_count, double blur_share, int channel_count)
{
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(medium, &coefficients, NULL));
    const double mean_free_path_mm = coefficients.mean_free_path_mm;
    const double thick_mm = fmin(2.0 / coefficients.sigma_tr_per_mm, 30.0 * mean_free_path_mm);
    fit_scene_sphere(&made->scene, fmax(thick_mm, 4.0 * mean_free_path_mm), pixel_count, sample_count);
    fit_made_create(made, 0.3 * mean_free_path_mm, blur_share * mean_free_path_mm, channel_count);
}

/* The middle of a large flat face, evenly lit: a square grid of samples 0.5 mm apart, 100 x 100. */
static inline void fit_made_face(struct fit_made *made, size_t pixel_count)
{
    enum { SIDE = 100 };
    struct rng rng = { .seed = 7 };
    struct fit_scene *const scene = &made->scene;
    fit_scene_allocate(scene, pixel_count, SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int column = i % SIDE - SIDE / 2, row = i / SIDE - SIDE / 2;
        scene->samples[i].position_mm[0] = 0.5f * (float)column;
        scene->samples[i].position_mm[1] = 0.5f * (float)row;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            scene->samples[i].flux_w[c] = 0.25f;
    }
    for (size_t j = 0; j < pixel_count; j++) {
        float *const at_mm = scene->positions_mm + 3 * j;
        for (int a = 0; a < 2; a++)
            at_mm[a] = (float)uniform(&rng, -4.0, 4.0);
        scene->tiles[j] = (int)(4.0f + at_mm[0]) + 8 * (int)(4.0f + at_mm[1]);
    }
    fit_made_create(made, 0.3, 0, 1);
    for (size_t j = 0; j < pixel_count; j++)
        made->data[j].constant = 0; /* mirrored light would tell the exposure */
}

/* A standard normal deviate (Box and Muller). */
static inline double normal(struct rng *rng)
{
    const double radius = sqrt(-2.0 * log(1.0 - uniform(rng, 0.0, 1.0)));
    return radius * cos(6.283185307179586 * uniform(rng, 0.0, 1.0));
}

static inline void fit_least_squares_of(const struct fit_problem *problem, struct fit_least_squares *out)
{
    *out = (struct fit_least_squares){ .residuals = fit_problem_residuals,
                                       .context = problem,
                                       .residual_count = fit_problem_residual_count(problem),
                                       .parameter_count = problem->layout.parameter_count };
    memcpy(out->lower, problem->lower, sizeof out->lower);
    memcpy(out->upper, problem->upper, sizeof out->upper);
}

static const dipole_medium fit_marble_red = { .sigma_a_per_mm = 0.0021,
                                              .sigma_s_prime_per_mm = 2.19,
                                              .eta = 1.5 };

#endif
