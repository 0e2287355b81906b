#include "fit/profile.h"
#include "fit_targets.h"

enum { PIXELS = 400, SAMPLES = 500, MODELS = 5 };

static const dipole_model models[MODELS] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE,
                                             DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM,
                                             DIPOLE_MODEL_MODES };

/* Pictures, sharp and blurred, one of few pixels, and a profile: everything free that can be. */
struct joint {
    struct fit_made sharp, blurred, few;
    struct io_profile profile;
    double r_lo_mm[8], r_hi_mm[8], rd_per_mm2[8], sem_per_mm2[8];
    void *profile_memory;
    struct fit_target targets[4];
    struct fit_form form;
    struct fit_problem problem;
};

static void joint_create(struct joint *joint, const struct fit_form *form)
{
    static const struct fit_camera camera = { .gain = { 3, 2.5, 2 }, .ambient = 0.01, .black = 0.002 };
    struct fit_made *const made[] = { &joint->sharp, &joint->blurred, &joint->few };
    /* what has a pole at r = 0 has no value for a sharp picture of single samples */
    const bool has_pole = form->model == DIPOLE_MODEL_BEAM || form->model == DIPOLE_MODEL_MODES;
    joint->form = *form;
    for (size_t t = 0; t < 3; t++) {
        fit_made_sphere(made[t], &form->layers[0][form->layer].medium, t == 2 ? 60 : PIXELS, SAMPLES,
                        t == 1     ? 1.0
                        : has_pole ? 0.5
                                   : 0.0,
                        form->channel_count);
        made[t]->target.is_gain_free = made[t]->target.is_ambient_free = true;
        made[t]->target.is_black_free = t != 1;
        fit_made_predict(made[t], form, &camera);
        joint->targets[t] = made[t]->target;
    }
    joint->profile = (struct io_profile){ .count = 8,
                                          .has_rings = true,
                                          .r_lo_mm = joint->r_lo_mm,
                                          .r_hi_mm = joint->r_hi_mm,
                                          .rd_per_mm2 = joint->rd_per_mm2,
                                          .sem_per_mm2 = joint->sem_per_mm2 };
    for (size_t i = 0; i < 8; i++) {
        joint->r_lo_mm[i] = 0.5 * (double)i;
        joint->r_hi_mm[i] = 0.5 * (double)(i + 1);
        joint->rd_per_mm2[i] = 0.1 * exp(-(double)i);
        joint->sem_per_mm2[i] = joint->rd_per_mm2[i]; /* weighs about as much as the pictures */
    }
    assert_true(fit_profile_target(&joint->profile, "profile", form->channel_count > 1, form->model,
                                   &joint->targets[3], &joint->profile_memory, NULL));
    assert_true(fit_problem_init(form, joint->targets, 4, true, &joint->problem, NULL));
    assert_true(fit_problem_fold(&joint->problem, NULL));
}

static void joint_destroy(struct joint *joint)
{
    fit_problem_destroy(&joint->problem);
    fit_made_destroy(&joint->sharp);
    fit_made_destroy(&joint->blurred);
    fit_made_destroy(&joint->few);
    free(joint->profile_memory);
}

/* A point among the parameters, as far from the start as searches go. */
static void random_point(const struct fit_problem *problem, struct rng *rng, double *point)
{
    for (size_t p = 0; p < problem->layout.parameter_count; p++) {
        const double lo = fmax(problem->lower[p], problem->start[p] - 1);
        const double hi = fmin(problem->upper[p], problem->start[p] + 1);
        point[p] = uniform(rng, lo, hi);
    }
}

/* The largest error of the derivatives at a few points. */
static double derivative_error(const struct fit_form *form, int point_count)
{
    struct rng rng = { .seed = 4 };
    struct joint joint;
    struct fit_least_squares squares;
    double worst = 0;
    joint_create(&joint, form);
    fit_least_squares_of(&joint.problem, &squares);
    for (int i = 0; i < point_count; i++) {
        double point[FIT_PARAMETER_LIMIT];
        random_point(&joint.problem, &rng, point);
        worst = fmax(worst, fit_least_squares_jacobian_error(&squares, point));
    }
    joint_destroy(&joint);
    return worst;
}

/* Oracle: Ceres' numeric derivative of the residuals, of all targets together with everything free that can
 * be. 1e-8: what its extrapolation resolves, with room. */
static void derivatives_of_a_half_space_are_right(void **state)
{
    (void)state;
    static const dipole_medium medium = { .sigma_a_per_mm = 0.02, .sigma_s_prime_per_mm = 1.1, .eta = 1.4 };
    for (size_t m = 0; m < MODELS; m++) {
        const struct fit_form form = fit_form_of(models[m], &medium, INFINITY, 3);
        const double error = derivative_error(&form, models[m] == DIPOLE_MODEL_DIPOLE ? 10 : 1);
        print_message("model %d: %.2g\n", (int)models[m], error);
        assert_true(error <= 1e-8);
    }
}

/* The same of a layer over another, of which the thickness is sought, too, and of the one below. */
static void derivatives_of_layers_are_right(void **state)
{
    (void)state;
    static const dipole_medium medium = { .sigma_a_per_mm = 0.02, .sigma_s_prime_per_mm = 1.1, .eta = 1.4 };
    static const dipole_medium other = { .sigma_a_per_mm = 0.1, .sigma_s_prime_per_mm = 2, .eta = 1.4 };
    for (size_t m = 2; m < MODELS; m++) {
        for (size_t layer = 0; layer < 2; layer++) {
            struct fit_form form = fit_form_of(models[m], &medium, 3, 1);
            form.layer_count = 2;
            form.layer = layer;
            form.is_thickness_sought = layer == 0;
            for (int c = 0; c < 3; c++)
                form.layers[c][1] = (dipole_layer){ .medium = other, .thickness_mm = INFINITY };
            const double error = derivative_error(&form, 1);
            print_message("model %d, layer %zu: %.2g\n", (int)models[m], layer, error);
            assert_true(error <= 1e-8);
        }
    }
}

/* ---- folding ----------------------------------------------------------------------------------------- */

/* Residuals of all data, one by one, without folding: by their definition in target.h. */
struct unfolded {
    struct fit_problem *problem;
    const double *parameters;
    double *residuals, *jacobian;
    size_t count;
};

static void unfolded_datum(void *context, struct fit_datum *datum, const struct fit_datum_model *model)
{
    struct unfolded *const all = context;
    const double weight = sqrt(datum->robust) / datum->sigma;
    const size_t n = all->problem->layout.parameter_count;
    all->residuals[all->count] = weight * (model->value - datum->value);
    if (all->jacobian) {
        double *const row = all->jacobian + all->count * n;
        memset(row, 0, n * sizeof *row);
        for (int p = 0; p < model->parameter_count; p++)
            row[model->parameters[p]] = weight * model->derivatives[p];
    }
    all->count++;
}

static bool unfolded_residuals(const void *context, const double *parameters, double *residuals,
                               double *jacobian)
{
    struct unfolded all = *(const struct unfolded *)context;
    all.residuals = residuals;
    all.jacobian = jacobian;
    for (size_t t = 0; t < all.problem->target_count; t++) {
        for (int c = 0; c < all.problem->form.channel_count; c++) {
            if (!fit_problem_visit(all.problem, t, c, parameters, unfolded_datum, &all))
                return false;
        }
    }
    return true;
}

static size_t datum_count(const struct fit_problem *problem)
{
    size_t count = 0;
    for (size_t t = 0; t < problem->target_count; t++)
        count += problem->targets[t].datum_count;
    return count;
}

/* Oracle: the same problem with a residual for every datum, on noisy pictures so that something is left
 * over, some data without weight. 1e-6: what is promised; the two differ by rounding. */
static void folding_does_not_change_the_answer(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    struct joint joint;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    joint_create(&joint, &form);
    for (size_t t = 0; t < 3; t++) {
        for (size_t i = 0; i < joint.targets[t].datum_count; i++) {
            joint.targets[t].data[i].value *= uniform(&rng, 0.9, 1.1);
            joint.targets[t].data[i].robust = i % 7 ? 1 : uniform(&rng, -0.3, 1);
            joint.targets[t].data[i].robust = fmax(joint.targets[t].data[i].robust, 0);
        }
    }
    /* a profile that has nothing to do with the pictures would fight them: almost no weight */
    for (size_t i = 0; i < 8; i++)
        joint.targets[3].data[i].sigma *= 1e4;
    assert_true(fit_problem_fold(&joint.problem, NULL));
    assert_true(fit_problem_residual_count(&joint.problem) < datum_count(&joint.problem));
    struct fit_least_squares squares;
    struct fit_minimum folded, unfolded;
    const struct unfolded all = { .problem = &joint.problem };
    fit_least_squares_of(&joint.problem, &squares);
    double start[FIT_PARAMETER_LIMIT], logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT];
    for (int c = 0; c < 3; c++) {
        fit_form_start(&form, c, logs[c]);
        logs[c][FIT_SIGMA_A] += 0.5;
    }
    fit_problem_parameters(&joint.problem, logs, start);
    assert_true(fit_least_squares_solve(&squares, start, &folded, NULL));
    squares.residuals = unfolded_residuals;
    squares.context = &all;
    squares.residual_count = datum_count(&joint.problem);
    assert_true(fit_least_squares_solve(&squares, start, &unfolded, NULL));
    assert_true(folded.has_converged && unfolded.has_converged);
    for (size_t p = 0; p < joint.problem.layout.parameter_count; p++) {
        if (!(fabs(folded.parameters[p] - unfolded.parameters[p]) <= 1e-6))
            print_error("parameter %zu: %.9g, %.9g\n", p, folded.parameters[p], unfolded.parameters[p]);
        assert_true(fabs(folded.parameters[p] - unfolded.parameters[p]) <= 1e-6);
    }
    assert_close(folded.sum_of_squares, unfolded.sum_of_squares, 1e-6, "sum of squares");
    joint_destroy(&joint);
}

/* ---- data -------------------------------------------------------------------------------------------- */

/* Oracle: target.h's formula, summed here with the profile of libdipole. */
struct by_formula {
    const double *nodes;
    double gain, ambient, black, worst, worst_bare;
};

static void compare_datum(void *context, struct fit_datum *datum, const struct fit_datum_model *model)
{
    struct by_formula *const all = context;
    double sum = datum->constant;
    for (size_t k = 0; k < datum->count; k++)
        sum += datum->factor * datum->row[k] * all->nodes[datum->first + k];
    const double expected = all->gain * sum + all->ambient * datum->ambient_share + all->black;
    all->worst = fmax(all->worst, fabs(model->value / expected - 1));
    all->worst_bare = fmax(all->worst_bare, fabs(model->bare / (all->gain * sum) - 1));
}

/* Oracle: target.h's formula with the profile by libdipole. 1e-12: rounding of sums. */
static void the_model_of_a_datum_is_its_formula(void **state)
{
    (void)state;
    struct joint joint;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    joint_create(&joint, &form);
    struct rng rng = { .seed = 3 };
    double parameters[FIT_PARAMETER_LIMIT];
    random_point(&joint.problem, &rng, parameters);
    for (int c = 0; c < 3; c++) {
        const struct fit_layout *const layout = &joint.problem.layout;
        const dipole_medium medium = { .sigma_a_per_mm =
                                           exp(parameters[layout->coefficient[c][FIT_SIGMA_A]]),
                                       .sigma_s_prime_per_mm =
                                           exp(parameters[layout->coefficient[c][FIT_SIGMA_S_PRIME]]),
                                       .eta = fit_marble_red.eta };
        dipole_coefficients coefficients;
        assert_true(dipole_coefficients_init(&medium, &coefficients, NULL));
        const struct fit_target *const target = &joint.targets[0];
        double *const nodes = malloc(target->node_count * sizeof *nodes);
        assert_non_null(nodes);
        for (size_t k = 0; k < target->node_count; k++)
            nodes[k] = dipole_rd_per_mm2(&coefficients, target->node_r_mm[k]);
        struct by_formula all = {
            .nodes = nodes,
            .gain = exp(parameters[layout->gain[0]] + (c == 1 ? 0 : parameters[layout->balance[c]])),
            .ambient = parameters[layout->ambient[0][c]] * target->ambient_scale[c],
            .black = parameters[layout->black[0][c]] * target->value_scale[c],
        };
        assert_true(fit_problem_visit(&joint.problem, 0, c, parameters, compare_datum, &all));
        assert_true(all.worst < 1e-12 && all.worst_bare < 1e-12);
        struct fit_state found;
        fit_problem_state(&joint.problem, 0, c, parameters, &found);
        assert_close(found.gain, all.gain, 1e-15, "gain");
        assert_close(found.ambient, all.ambient, 1e-15, "ambient");
        assert_close(found.black, all.black, 1e-15, "black");
        free(nodes);
    }
    /* the white balance is the camera's: a profile has none, and no gain here */
    for (int c = 0; c < 3; c++) {
        struct fit_state found;
        fit_problem_state(&joint.problem, 3, c, parameters, &found);
        assert_true(found.gain == 1);
    }
    joint_destroy(&joint);
}

/* Oracle: the definition: scales are means, by channel. */
static void scales_are_means(void **state)
{
    (void)state;
    struct fit_datum data[] = {
        { .value = 3, .ambient_share = 0.5, .channel = 0 },
        { .value = -1, .ambient_share = 0.25, .channel = 0 },
        { .value = 5, .ambient_share = 0, .channel = 2 },
    };
    struct fit_target target = { .data = data, .datum_count = 3 };
    fit_target_measure_scales(&target);
    assert_close(target.value_scale[0], 2, 1e-15, "mean size");
    assert_close(target.ambient_scale[0], 4 / 0.75, 1e-15, "ambient");
    assert_true(target.value_scale[1] == 0 && target.ambient_scale[1] == 0);
    assert_close(target.value_scale[2], 5, 1e-15, "mean size");
    assert_true(target.ambient_scale[2] == 0);
}

/* ---- starts ------------------------------------------------------------------------------------------ */

/* Oracle: what the pictures were made with: gain, ambient and black are linear, and the best ones make the
 * sum of squares 0, however they were weighed. 1e-6: normal equations square the digits. */
static void what_is_linear_is_found_at_once(void **state)
{
    (void)state;
    static const struct fit_camera camera = { .gain = { 3, 2.5, 2 }, .ambient = 0.04, .black = 0.01 };
    struct joint joint;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    joint_create(&joint, &form);
    for (size_t t = 0; t < 3; t += 2) { /* one that is folded, one that is not */
        struct fit_made *const made = t == 0 ? &joint.sharp : &joint.few;
        fit_made_predict(made, &form, &camera);
        struct fit_problem problem;
        assert_true(fit_problem_init(&form, &made->target, 1, true, &problem, NULL));
        assert_true(fit_problem_fold(&problem, NULL));
        double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT], parameters[FIT_PARAMETER_LIMIT];
        for (int c = 0; c < 3; c++) {
            struct fit_state found[FIT_TARGET_LIMIT];
            fit_form_start(&form, c, logs[c]);
            const double cost = fit_problem_channel_cost(&problem, c, logs[c], found);
            assert_true(cost < 1e-9 * (double)made->target.datum_count);
            assert_close(found[0].gain, camera.gain[c], 1e-6, "gain");
            assert_close(found[0].ambient, camera.ambient, 1e-5, "ambient");
            assert_close(found[0].black, camera.black, 1e-5, "black");
        }
        fit_problem_parameters(&problem, logs, parameters);
        assert_close(exp(parameters[problem.layout.gain[0]]), 2.5, 1e-6, "gain");
        assert_close(exp(parameters[problem.layout.balance[0]]), 3 / 2.5, 1e-6, "red");
        assert_close(exp(parameters[problem.layout.balance[2]]), 2 / 2.5, 1e-6, "blue");
        assert_int_equal(problem.layout.balance[1], -1);
        fit_problem_destroy(&problem);
    }
    joint_destroy(&joint);
}

/* Oracle: the search with the coefficients held, which minimises over the rest step by step; noise leaves a
 * cost. 1e-6 of the cost. */
static void the_cost_of_a_channel_is_the_least(void **state)
{
    (void)state;
    struct rng rng = { .seed = 9 };
    struct fit_made made;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 1);
    made.target.is_gain_free = made.target.is_ambient_free = made.target.is_black_free = true;
    for (int trial = 0; trial < 12; trial++) {
        /* sometimes less light than none in the shadow, so that ambient stays at 0 */
        const struct fit_camera camera = { .gain = { 2 }, .ambient = trial % 2 ? 0.02 : -0.02 };
        fit_made_predict(&made, &form, &camera);
        for (size_t i = 0; i < PIXELS; i++)
            made.data[i].value *= uniform(&rng, 0.9, 1.1);
        fit_made_weigh(&made);
        struct fit_problem problem;
        assert_true(fit_problem_init(&form, &made.target, 1, false, &problem, NULL));
        assert_true(fit_problem_fold(&problem, NULL));
        struct fit_state found[FIT_TARGET_LIMIT];
        double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT], start[FIT_PARAMETER_LIMIT];
        fit_form_start(&form, 0, logs[0]);
        for (int p = 0; p < 2; p++)
            logs[0][p] += uniform(&rng, -0.5, 0.5);
        const double cost = fit_problem_channel_cost(&problem, 0, logs[0], found);
        fit_problem_parameters(&problem, logs, start);
        struct fit_least_squares squares;
        struct fit_minimum minimum;
        fit_least_squares_of(&problem, &squares);
        squares.is_held[0] = squares.is_held[1] = true;
        assert_true(fit_least_squares_solve(&squares, start, &minimum, NULL));
        assert_close(minimum.history[0], cost, 1e-6, "at the start, trial %d", trial);
        assert_close(minimum.sum_of_squares, cost, 1e-6, "least, trial %d", trial);
        assert_true(found[0].ambient >= 0);
        fit_problem_destroy(&problem);
    }
    fit_made_destroy(&made);
}

/* ---- edges ------------------------------------------------------------------------------------------- */

/* Oracle: the range of eta in dipole.h. */
static void a_start_that_is_no_medium_is_refused(void **state)
{
    (void)state;
    struct fit_made made;
    struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 1);
    fit_made_predict(&made, &form, &fit_plain_camera);
    form.layers[0][0].medium.eta = -1;
    struct fit_problem problem;
    dipole_status status;
    assert_false(fit_problem_init(&form, &made.target, 1, false, &problem, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_non_null(strstr(status.message, "eta"));
    fit_made_destroy(&made);
}

/* Oracle: problem.h; a channel without light has no parameters, and a medium that absorbs nothing a start
 * within the bounds. */
static void the_layout_holds_what_is_sought(void **state)
{
    (void)state;
    struct fit_made made;
    struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 3);
    fit_made_predict(&made, &form, &fit_plain_camera);
    made.target.datum_count = 2 * PIXELS; /* no blue */
    made.target.is_gain_free = made.target.is_black_free = true;
    fit_target_measure_scales(&made.target);
    form.layers[0][0].medium.sigma_a_per_mm = 0;
    struct fit_problem problem;
    assert_true(fit_problem_init(&form, &made.target, 1, true, &problem, NULL));
    const struct fit_layout *const layout = &problem.layout;
    /* four coefficients, red's balance, a gain, two black levels */
    assert_int_equal(layout->parameter_count, 8);
    assert_true(problem.has_light[0] && problem.has_light[1] && !problem.has_light[2]);
    assert_int_equal(layout->coefficient[2][FIT_SIGMA_A], -1);
    assert_int_equal(layout->balance[2], -1);
    assert_int_equal(layout->black[0][2], -1);
    assert_int_equal(layout->ambient[0][0], -1);
    assert_int_equal(layout->coefficient[0][FIT_THICKNESS], -1);
    for (size_t p = 0; p < layout->parameter_count; p++)
        assert_true(problem.lower[p] <= problem.start[p] && problem.start[p] <= problem.upper[p]);
    fit_problem_destroy(&problem);
    fit_made_destroy(&made);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_of_a_half_space_are_right),
        cmocka_unit_test(derivatives_of_layers_are_right),
        cmocka_unit_test(folding_does_not_change_the_answer),
        cmocka_unit_test(the_model_of_a_datum_is_its_formula),
        cmocka_unit_test(scales_are_means),
        cmocka_unit_test(what_is_linear_is_found_at_once),
        cmocka_unit_test(the_cost_of_a_channel_is_the_least),
        cmocka_unit_test(a_start_that_is_no_medium_is_refused),
        cmocka_unit_test(the_layout_holds_what_is_sought),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
