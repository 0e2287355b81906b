#include "fit/search.h"

#include "fit/profile.h"
#include "fit_targets.h"

enum { PIXELS = 600, SAMPLES = 900 };

static void search(struct fit_problem *problem, struct fit_minimum *out)
{
    dipole_status status;
    if (!fit_search(problem, false, NULL, NULL, out, &status))
        fail_msg("%s", status.message);
}

/* The coefficients of a channel at a minimum. */
static double found_of(const struct fit_problem *problem, const struct fit_minimum *minimum, int channel,
                       enum fit_coefficient which)
{
    return exp(minimum->parameters[problem->layout.coefficient[channel][which]]);
}

/* Coefficients in 1/mm, Jensen et al. 2001, red, green, blue; eta 1.3, marble 1.5. */
struct measured {
    const char *name;
    double sigma_a_per_mm[3], sigma_s_prime_per_mm[3], eta;
};
static const struct measured measured[] = {
    { "apple", { 0.0030, 0.0034, 0.046 }, { 2.29, 2.39, 1.97 }, 1.3 },
    { "chicken1", { 0.015, 0.077, 0.19 }, { 0.15, 0.21, 0.38 }, 1.3 },
    { "chicken2", { 0.018, 0.088, 0.20 }, { 0.19, 0.25, 0.32 }, 1.3 },
    { "cream", { 0.0002, 0.0028, 0.0163 }, { 7.38, 5.47, 3.15 }, 1.3 },
    { "ketchup", { 0.061, 0.97, 1.45 }, { 0.18, 0.07, 0.03 }, 1.3 },
    { "marble", { 0.0021, 0.0041, 0.0071 }, { 2.19, 2.62, 3.00 }, 1.5 },
    { "potato", { 0.0024, 0.0090, 0.12 }, { 0.68, 0.70, 0.55 }, 1.3 },
    { "skimmilk", { 0.0014, 0.0025, 0.0142 }, { 0.70, 1.22, 1.90 }, 1.3 },
    { "skin1", { 0.032, 0.17, 0.48 }, { 0.74, 0.88, 1.01 }, 1.3 },
    { "skin2", { 0.013, 0.070, 0.145 }, { 1.09, 1.59, 1.79 }, 1.3 },
    { "wholemilk", { 0.0011, 0.0024, 0.014 }, { 2.55, 3.21, 3.77 }, 1.3 },
};

/* Oracle: the coefficients that the picture, a direct sum, was made with; the search starts ten times off,
 * up and down. 1e-3: clusters of light samples and the operator err by up to 1e-4 of the whole's
 * brightness, which is ten times that in sigma_a. */
static void coefficients_come_back_from_an_exact_picture(void **state)
{
    (void)state;
    double worst[2] = { 0, 0 };
    for (size_t m = 0; m < sizeof measured / sizeof *measured; m++) {
        for (int c = 0; c < 3; c++) {
            const dipole_medium truth = { .sigma_a_per_mm = measured[m].sigma_a_per_mm[c],
                                          .sigma_s_prime_per_mm = measured[m].sigma_s_prime_per_mm[c],
                                          .eta = measured[m].eta };
            const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
            const struct fit_form start = fit_form_from(&form, c % 2 ? 10 : 0.1, m % 2 ? 10 : 0.1);
            struct fit_made made;
            struct fit_problem problem;
            struct fit_minimum minimum;
            fit_made_sphere(&made, &truth, PIXELS, SAMPLES, 0, 1);
            fit_made_sum(&made, &form);
            assert_true(fit_problem_init(&start, &made.target, 1, false, &problem, NULL));
            search(&problem, &minimum);
            assert_true(minimum.has_converged);
            const double a = found_of(&problem, &minimum, 0, FIT_SIGMA_A);
            const double s = found_of(&problem, &minimum, 0, FIT_SIGMA_S_PRIME);
            assert_close(a, truth.sigma_a_per_mm, 1e-3, "%s %d sigma_a", measured[m].name, c);
            assert_close(s, truth.sigma_s_prime_per_mm, 1e-3, "%s %d sigma_s'", measured[m].name, c);
            worst[0] = fmax(worst[0], fabs(a / truth.sigma_a_per_mm - 1));
            worst[1] = fmax(worst[1], fabs(s / truth.sigma_s_prime_per_mm - 1));
            fit_problem_destroy(&problem);
            fit_made_destroy(&made);
        }
    }
    print_message("largest relative errors %.2g of sigma_a, %.2g of sigma_s'\n", worst[0], worst[1]);
}

/* Oracle: what the picture was made with. Three channels at once, of the strongest absorber, from starts
 * that lead each channel into another valley: no single start ends well for all of them. */
static void each_channel_finds_its_own_valley(void **state)
{
    (void)state;
    static const double a_factors[2][3] = { { 10, 0.1, 10 }, { 0.1, 10, 0.1 } },
                        s_factors[3] = { 10, 0.1, 0.1 };
    const struct measured *const ketchup = &measured[4];
    struct fit_form truth = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    for (int c = 0; c < 3; c++)
        truth.layers[c][0].medium =
            (dipole_medium){ .sigma_a_per_mm = ketchup->sigma_a_per_mm[c],
                             .sigma_s_prime_per_mm = ketchup->sigma_s_prime_per_mm[c],
                             .eta = ketchup->eta };
    struct fit_made made;
    fit_made_sphere(&made, &truth.layers[2][0].medium, PIXELS, SAMPLES, 0, 3);
    fit_made_predict(&made, &truth, &fit_plain_camera);
    for (int i = 0; i < 2; i++) {
        struct fit_form start = truth;
        struct fit_problem problem;
        struct fit_minimum minimum;
        for (int c = 0; c < 3; c++) {
            start.layers[c][0].medium.sigma_a_per_mm *= a_factors[i][c];
            start.layers[c][0].medium.sigma_s_prime_per_mm *= s_factors[c];
        }
        assert_true(fit_problem_init(&start, &made.target, 1, false, &problem, NULL));
        search(&problem, &minimum);
        for (int c = 0; c < 3; c++) {
            assert_close(found_of(&problem, &minimum, c, FIT_SIGMA_A), ketchup->sigma_a_per_mm[c], 1e-3,
                         "start %d, channel %d, sigma_a", i, c);
            assert_close(found_of(&problem, &minimum, c, FIT_SIGMA_S_PRIME),
                         ketchup->sigma_s_prime_per_mm[c], 1e-3, "start %d, channel %d, sigma_s'", i, c);
        }
        fit_problem_destroy(&problem);
    }
    fit_made_destroy(&made);
}

/* Oracle: what the pictures were made with, by each model, under a camera of which nothing is known; the
 * pictures are the model's own, so that 1e-4 is the search's. */
static void everything_comes_back_from_two_pictures(void **state)
{
    (void)state;
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE,
                                           DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES };
    static const struct fit_camera cameras[] = {
        { .gain = { 300, 250, 200 }, .ambient = 1, .black = 0.2 },
        { .gain = { 3e-3, 2.5e-3, 2e-3 }, .ambient = 1e-5, .black = 2e-6 },
    };
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        const bool is_smooth = models[m] != DIPOLE_MODEL_BEAM && models[m] != DIPOLE_MODEL_MODES;
        const int channel_count = is_smooth ? 3 : 1;
        struct fit_form form = fit_form_of(models[m], &fit_marble_red, INFINITY, channel_count);
        for (int c = 0; c < 3; c++)
            form.layers[c][0].medium.sigma_a_per_mm *= 1 + c;
        const struct fit_form start = fit_form_from(&form, 5, 0.3);
        struct fit_made made[2];
        struct fit_target targets[2];
        for (int t = 0; t < 2; t++) {
            fit_made_sphere(&made[t], &fit_marble_red, PIXELS / 2, SAMPLES / 2, is_smooth ? 0 : 1,
                            channel_count);
            made[t].target.is_gain_free = true;
            made[t].target.is_ambient_free = made[t].target.is_black_free = is_smooth;
            const struct fit_camera plain = { .gain = { cameras[t].gain[0] } };
            fit_made_predict(&made[t], &form, is_smooth ? &cameras[t] : &plain);
            targets[t] = made[t].target;
        }
        struct fit_problem problem;
        struct fit_minimum minimum;
        assert_true(fit_problem_init(&start, targets, 2, is_smooth, &problem, NULL));
        search(&problem, &minimum);
        for (int c = 0; c < channel_count; c++) {
            const dipole_medium *const truth = &form.layers[c][0].medium;
            struct fit_state found;
            fit_problem_state(&problem, 1, c, minimum.parameters, &found);
            assert_close(exp(found.logs[FIT_SIGMA_A]), truth->sigma_a_per_mm, 1e-4, "model %zu %d", m, c);
            assert_close(exp(found.logs[FIT_SIGMA_S_PRIME]), truth->sigma_s_prime_per_mm, 1e-4,
                         "model %zu %d", m, c);
            assert_close(found.gain, cameras[1].gain[c], 1e-4, "gain, model %zu", m);
            if (is_smooth) {
                assert_close(found.ambient, cameras[1].ambient, 1e-3, "ambient, model %zu", m);
                assert_close(found.black, cameras[1].black, 1e-3, "black, model %zu", m);
            }
        }
        fit_problem_destroy(&problem);
        for (int t = 0; t < 2; t++)
            fit_made_destroy(&made[t]);
    }
}

/* Oracle: the layer that the profile was made with: its coefficients and its thickness, over a medium that
 * is known; from a start a third off. 1e-4: the profile is the model's own. */
static void a_layer_comes_back_with_its_thickness(void **state)
{
    (void)state;
    enum { ROWS = 60 };
    static const dipole_model models[] = { DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM };
    const dipole_medium truth = { .sigma_a_per_mm = 0.3, .sigma_s_prime_per_mm = 1.5, .eta = 1.4 };
    const dipole_medium below = { .sigma_a_per_mm = 0.01, .sigma_s_prime_per_mm = 4, .eta = 1.4 };
    for (size_t m = 0; m < 2; m++) {
        struct fit_form form = fit_form_of(models[m], &truth, 1.5, 1);
        form.layer_count = 2;
        form.layers[0][1] = (dipole_layer){ .medium = below, .thickness_mm = INFINITY };
        form.is_thickness_sought = true;
        double r_mm[ROWS], rd_per_mm2[ROWS], logs[FIT_COEFFICIENT_COUNT];
        for (size_t i = 0; i < ROWS; i++)
            r_mm[i] = 0.1 * exp(0.08 * (double)i);
        const struct io_profile profile = {
            .count = ROWS, .r_lo_mm = r_mm, .r_hi_mm = r_mm, .rd_per_mm2 = rd_per_mm2
        };
        dipole_stack *stack;
        fit_form_start(&form, 0, logs);
        assert_true(fit_form_stack_create(&form, 0, logs, &stack, NULL));
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, r_mm, ROWS, rd_per_mm2);
        dipole_stack_destroy(stack);
        struct fit_form start = fit_form_from(&form, 1.3, 0.75);
        start.layers[0][0].thickness_mm = 2;
        struct fit_target target;
        struct fit_problem problem;
        struct fit_minimum minimum;
        void *memory;
        assert_true(fit_profile_target(&profile, "layer", 0, models[m], &target, &memory, NULL));
        assert_true(fit_problem_init(&start, &target, 1, false, &problem, NULL));
        search(&problem, &minimum);
        assert_close(found_of(&problem, &minimum, 0, FIT_SIGMA_A), 0.3, 1e-4, "sigma_a, model %zu", m);
        assert_close(found_of(&problem, &minimum, 0, FIT_SIGMA_S_PRIME), 1.5, 1e-4, "sigma_s', model %zu",
                     m);
        assert_close(found_of(&problem, &minimum, 0, FIT_THICKNESS), 1.5, 1e-4, "thickness, model %zu", m);
        fit_problem_destroy(&problem);
        free(memory);
    }
}

/* Oracle: the same pictures without junk: noise of 1 %, and 5 % of the pixels replaced by what hair, dust
 * and mirrored lamps may leave. 0.5 % and 0.25 %: about the standard deviations that the noise itself
 * leaves. */
static void junk_does_not_move_the_answer(void **state)
{
    (void)state;
    struct rng rng = { .seed = 12 };
    struct fit_made made;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 1);
    for (int trial = 0; trial < 6; trial++) {
        double found[2][2];
        fit_made_predict(&made, &form, &fit_plain_camera);
        for (size_t i = 0; i < PIXELS; i++)
            made.data[i].value *= 1 + 0.01 * normal(&rng);
        for (int is_spoilt = 0; is_spoilt < 2; is_spoilt++) {
            for (size_t i = 0; is_spoilt && i < PIXELS / 20; i++) {
                const size_t at = (size_t)uniform(&rng, 0, PIXELS);
                made.data[at].value = trial % 2 ? 0 : made.mean * uniform(&rng, 0, 30);
            }
            struct fit_problem problem;
            struct fit_minimum minimum;
            fit_made_weigh(&made);
            assert_true(fit_problem_init(&form, &made.target, 1, false, &problem, NULL));
            search(&problem, &minimum);
            found[is_spoilt][0] = found_of(&problem, &minimum, 0, FIT_SIGMA_A);
            found[is_spoilt][1] = found_of(&problem, &minimum, 0, FIT_SIGMA_S_PRIME);
            fit_problem_destroy(&problem);
        }
        print_message("sigma_a %.5g, with junk %.5g; sigma_s' %.5g, with junk %.5g\n", found[0][0],
                      found[1][0], found[0][1], found[1][1]);
        assert_close(found[1][0], found[0][0], 5e-3, "sigma_a");
        assert_close(found[1][1], found[0][1], 2.5e-3, "sigma_s'");
    }
    fit_made_destroy(&made);
}

/* Oracle: search.h; a stop that is asked for at once ends with the best so far, not converged; every search
 * is logged, its sums of squares falling. */
static void a_search_can_be_stopped_and_is_logged(void **state)
{
    (void)state;
    struct fit_made made;
    struct fit_problem problem;
    struct fit_minimum minimum;
    static struct fit_search_log log;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    const struct fit_form start = fit_form_from(&form, 10, 0.2);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 1);
    fit_made_predict(&made, &form, &fit_plain_camera);
    assert_true(fit_problem_init(&start, &made.target, 1, false, &problem, NULL));
    const volatile sig_atomic_t stop = 1;
    assert_true(fit_search(&problem, false, &stop, &log, &minimum, NULL));
    assert_false(minimum.has_converged);
    assert_int_equal(log.count, 1);
    assert_true(isfinite(minimum.sum_of_squares));
    assert_true(fit_search(&problem, false, NULL, &log, &minimum, NULL));
    assert_true(minimum.has_converged);
    assert_in_range(log.count, FIT_SEARCH_START_LIMIT + 1, FIT_SEARCH_START_LIMIT + FIT_SEARCH_PASS_LIMIT);
    assert_string_equal(log.searches[0].name, "start 1");
    assert_string_equal(log.searches[FIT_SEARCH_START_LIMIT].name, "weights 1");
    for (int i = 0; i < log.count; i++) {
        assert_true(log.searches[i].count > 0);
        const double *const squares = log.searches[i].sum_of_squares;
        assert_true(squares[log.searches[i].count - 1] <= squares[0]);
    }
    fit_problem_destroy(&problem);
    fit_made_destroy(&made);
}

/* Oracle: itself; threads fold as they come, the numbers must not depend on it. */
static void the_same_targets_give_the_same_answer(void **state)
{
    (void)state;
    struct fit_made made;
    struct fit_minimum minimum[2];
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 3);
    for (int i = 0; i < 2; i++) {
        struct fit_problem problem;
        fit_made_predict(&made, &form, &fit_plain_camera);
        for (size_t k = 0; k < made.target.datum_count; k++)
            made.data[k].value *= 1 + 0.02 * sin((double)(k * k));
        assert_true(fit_problem_init(&form, &made.target, 1, false, &problem, NULL));
        search(&problem, &minimum[i]);
        fit_problem_destroy(&problem);
    }
    assert_memory_equal(minimum[0].parameters, minimum[1].parameters, 6 * sizeof(double));
    fit_made_destroy(&made);
}

/* Oracle: the bound itself: less scattering than any medium has ends at the least, not outside, and no
 * absorption at a sigma_a that changes nothing. */
static void parameters_may_end_at_their_bounds(void **state)
{
    (void)state;
    struct fit_made made;
    struct fit_problem problem;
    struct fit_minimum minimum;
    const dipole_medium truth = { .sigma_a_per_mm = 0, .sigma_s_prime_per_mm = 11.6, .eta = 1.3 };
    struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    fit_made_sphere(&made, &truth, PIXELS, SAMPLES, 0, 1);
    made.target.is_ambient_free = true; /* and there is none */
    fit_made_predict(&made, &form, &fit_plain_camera);
    form = fit_form_from(&form, 1, 0.2);
    form.layers[0][0].medium.sigma_a_per_mm = 0.1;
    assert_true(fit_problem_init(&form, &made.target, 1, false, &problem, NULL));
    search(&problem, &minimum);
    for (size_t p = 0; p < problem.layout.parameter_count; p++)
        assert_true(problem.lower[p] <= minimum.parameters[p] && minimum.parameters[p] <= problem.upper[p]);
    assert_close(found_of(&problem, &minimum, 0, FIT_SIGMA_S_PRIME), 11.6, 1e-3, "sigma_s'");
    assert_true(found_of(&problem, &minimum, 0, FIT_SIGMA_A) < 1e-5 * 11.6);
    assert_true(minimum.parameters[problem.layout.ambient[0][0]] < 1e-4);
    fit_problem_destroy(&problem);
    fit_made_destroy(&made);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coefficients_come_back_from_an_exact_picture),
        cmocka_unit_test(each_channel_finds_its_own_valley),
        cmocka_unit_test(everything_comes_back_from_two_pictures),
        cmocka_unit_test(a_layer_comes_back_with_its_thickness),
        cmocka_unit_test(junk_does_not_move_the_answer),
        cmocka_unit_test(a_search_can_be_stopped_and_is_logged),
        cmocka_unit_test(the_same_targets_give_the_same_answer),
        cmocka_unit_test(parameters_may_end_at_their_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
