#include "fit/interval.h"

#include "fit/search.h"
#include "fit_targets.h"

enum { PIXELS = 600, SAMPLES = 900 };

/* Sanitizers make trials ten times slower: they look for other things, over fewer. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { TRIALS = 20, FEW_TRIALS = 5 };
#else
enum { TRIALS = 100, FEW_TRIALS = 40 };
#endif

/* Search and judge; the caller ends *problem and frees covariance. */
static void estimate(const struct fit_form *start, struct fit_target *target, bool is_quick,
                     struct fit_problem *problem, struct fit_minimum *minimum, struct fit_estimates *out)
{
    dipole_status status;
    if (!fit_problem_init(start, target, 1, false, problem, &status) ||
        !fit_search(problem, false, NULL, NULL, minimum, &status) ||
        !fit_judge(problem, minimum, is_quick, NULL, out, &status))
        fail_msg("%s", status.message);
}

static void estimate_only(const struct fit_form *start, struct fit_target *target, bool is_quick,
                          struct fit_estimates *out)
{
    struct fit_problem problem;
    struct fit_minimum minimum;
    estimate(start, target, is_quick, &problem, &minimum, out);
    free(out->covariance);
    out->covariance = out->singular_values = NULL;
    fit_problem_destroy(&problem);
}

static bool holds(const struct fit_interval *interval, double value)
{
    return interval->ci95[0] <= value && value <= interval->ci95[1];
}

static bool is_in_order(const struct fit_interval *interval)
{
    return isfinite(interval->ci95[0]) && isfinite(interval->ci95[1]) &&
           interval->ci95[0] <= interval->value && interval->value <= interval->ci95[1];
}

/* ---- coverage ---------------------------------------------------------------------------------------- */

/* How large the errors of a drawn picture are, relative: everything that intervals claim to cover. */
struct errors {
    double pixel, tile, scale, offset;
};

static void spoil(struct fit_made *made, const double *exact, const struct errors *errors, double gain,
                  struct rng *rng)
{
    double tiles[FIT_SCENE_TILES];
    for (int t = 0; t < FIT_SCENE_TILES; t++)
        tiles[t] = 1 + errors->tile * normal(rng);
    const double scale = gain * (1 + errors->scale * normal(rng));
    const double offset = gain * errors->offset * made->mean * normal(rng);
    for (size_t i = 0; i < made->target.datum_count; i++)
        made->data[i].value =
            offset + exact[i] * scale * tiles[made->data[i].tile] * (1 + errors->pixel * normal(rng));
}

/* How often intervals held the truth, and how far off the values were in units of what they state. */
struct coverage {
    int held[2];
    double z[2];
};

static struct coverage cover(dipole_model model, const dipole_medium *medium, const struct errors *errors,
                             bool is_gain_free, bool is_quick, uint64_t seed)
{
    struct rng rng = { .seed = seed };
    struct fit_made made;
    struct coverage all = { { 0 }, { 0 } };
    const struct fit_form form = fit_form_of(model, medium, INFINITY, 1);
    const double truth[2] = { medium->sigma_a_per_mm, medium->sigma_s_prime_per_mm };
    fit_made_sphere(&made, medium, PIXELS, SAMPLES, 0, 1);
    fit_made_predict(&made, &form, &fit_plain_camera);
    double exact[PIXELS];
    for (size_t i = 0; i < PIXELS; i++)
        exact[i] = made.data[i].value;
    const double mean = made.mean;
    made.target.is_gain_free = is_gain_free;
    /* what varies from tile to tile shows in the residuals; what is common to all does not */
    made.target.systematic = (struct fit_systematic){ .scale = errors->scale, .offset = errors->offset };
    for (int trial = 0; trial < TRIALS; trial++) {
        struct fit_estimates found;
        made.mean = mean;
        spoil(&made, exact, errors, is_gain_free ? log_uniform(&rng, 1e-3, 1e3) : 1, &rng);
        fit_made_weigh(&made);
        estimate_only(&form, &made.target, is_quick, &found);
        const struct fit_interval *const intervals[2] = { &found.channels[0].sigma_a_per_mm,
                                                          &found.channels[0].sigma_s_prime_per_mm };
        for (int p = 0; p < 2; p++) {
            assert_true(is_in_order(intervals[p]));
            all.held[p] += holds(intervals[p], truth[p]);
            const double deviation = log(intervals[p]->ci95[1] / intervals[p]->ci95[0]) / 2 / 1.96;
            all.z[p] += pow(log(intervals[p]->value / truth[p]) / deviation, 2) / TRIALS;
        }
    }
    for (int p = 0; p < 2; p++)
        all.z[p] = sqrt(all.z[p]);
    print_message("truth held %d and %d times of %d; z %.2f and %.2f\n", all.held[0], all.held[1], TRIALS,
                  all.z[0], all.z[1]);
    fit_made_destroy(&made);
    return all;
}

/* Fewer than 90 would happen to 95 % intervals once in 90 times; the root mean square of z, 1 where the
 * width is right, tells intervals that are far too wide. It is less by what a misfit that may hide is
 * given, which chance and errors by tiles look like. */
static void check_coverage(const struct coverage *found, double z_least, double z_most)
{
    for (int p = 0; p < 2; p++) {
        assert_true(found->held[p] >= (TRIALS >= 100 ? 0.9 : 0.75) * TRIALS);
        if (TRIALS >= 100) /* a few say nothing of it */
            assert_true(found->z[p] > z_least && found->z[p] < z_most);
    }
}

/* Oracle: the stated probability, over pictures whose noise of 1 % is drawn anew. */
static void intervals_hold_the_truth_as_often_as_they_say(void **state)
{
    (void)state;
    static const struct errors errors = { .pixel = 0.01 };
    const struct coverage found = cover(DIPOLE_MODEL_DIPOLE, &fit_marble_red, &errors, false, false, 6);
    check_coverage(&found, 0.6, 1.25);
}

/* The same with an exposure that is not known. */
static void they_do_with_unknown_exposure(void **state)
{
    (void)state;
    static const struct errors errors = { .pixel = 0.01 };
    const struct coverage found = cover(DIPOLE_MODEL_DIPOLE, &fit_marble_red, &errors, true, false, 7);
    check_coverage(&found, 0.6, 1.25);
}

/* The same with every kind of error: of pixels, common to a tile, to the whole, and added everywhere. */
static void they_do_with_every_kind_of_error(void **state)
{
    (void)state;
    static const struct errors errors = { .pixel = 0.03, .tile = 0.004, .scale = 0.003, .offset = 0.002 };
    const struct coverage found = cover(DIPOLE_MODEL_DIPOLE, &fit_marble_red, &errors, false, true, 8);
    check_coverage(&found, 0.15, 1.25);
}

/* The same where the noise is so large that the sum of squares is not quadratic: 30 % of a medium that is
 * hardly thicker than its mean free path. */
static void they_do_where_nothing_is_quadratic(void **state)
{
    (void)state;
    static const struct errors errors = { .pixel = 0.3 };
    const dipole_medium skin = { .sigma_a_per_mm = 0.07, .sigma_s_prime_per_mm = 1.59, .eta = 1.3 };
    const struct coverage found = cover(DIPOLE_MODEL_DIPOLE, &skin, &errors, true, false, 9);
    check_coverage(&found, 0.5, 1.3);
}

/* Oracle: the stated probability of few numbers: reflectance and transmittance of one slab or two, with
 * errors that are stated, and which alone say how far off they may be. Fewer than 34 of 40 would happen to
 * 95 % intervals once in 300 times; of 300 trials 292 and 281 held it. */
static void few_totals_hold_the_truth(void **state)
{
    (void)state;
    static const double one = 1, sigma = 0.004;
    struct rng rng = { .seed = 11 };
    const dipole_medium truth = { .sigma_a_per_mm = 0.03, .sigma_s_prime_per_mm = 0.97, .eta = 1.4 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_MULTIPOLE, &truth, INFINITY, 1);
    const struct io_total totals[] = { { .kind = IO_TOTAL_REFLECTANCE, .thickness_mm = 3 },
                                       { .kind = IO_TOTAL_TRANSMITTANCE, .thickness_mm = 3 },
                                       { .kind = IO_TOTAL_DIFFUSE_REFLECTANCE, .thickness_mm = 8 },
                                       { .kind = IO_TOTAL_DIFFUSE_TRANSMITTANCE, .thickness_mm = 8 } };
    for (size_t count = 2; count <= 4; count += 2) {
        struct fit_datum data[4];
        struct fit_target target = { .node_count = count,
                                     .row_node_count = count,
                                     .totals = totals,
                                     .data = data,
                                     .datum_count = count,
                                     .tile_count = 4,
                                     .are_sigmas_stated = true,
                                     .finest_mm = 0.01,
                                     .largest_mm = 100 };
        double logs[FIT_COEFFICIENT_COUNT], exact[4];
        int held[2] = { 0, 0 };
        fit_form_start(&form, 0, logs);
        assert_true(fit_target_evaluate(&target, &form, 0, logs, NULL, exact, NULL));
        for (int trial = 0; trial < FEW_TRIALS; trial++) {
            struct fit_estimates found;
            for (size_t i = 0; i < count; i++)
                data[i] = (struct fit_datum){ .row = &one,
                                              .first = i,
                                              .count = 1,
                                              .factor = 1,
                                              .value = exact[i] + sigma * normal(&rng),
                                              .sigma = sigma,
                                              .stated = sigma,
                                              .robust = 1,
                                              .tile = (int)i };
            fit_target_measure_scales(&target);
            estimate_only(&form, &target, count == 4, &found);
            held[0] += holds(&found.channels[0].sigma_a_per_mm, truth.sigma_a_per_mm);
            held[1] += holds(&found.channels[0].sigma_s_prime_per_mm, truth.sigma_s_prime_per_mm);
        }
        print_message("%zu totals: truth held %d and %d times of %d\n", count, held[0], held[1],
                      FEW_TRIALS);
        assert_true(held[0] * 40 >= 34 * FEW_TRIALS && held[1] * 40 >= 34 * FEW_TRIALS);
    }
}

/* ---- what cannot be told ----------------------------------------------------------------------------- */

/* Oracle: scale invariance. On an endless face R_d integrates to a function of alpha' alone, so sigma_a and
 * sigma_s' may grow together; alpha' itself is found, under noise of 1 % that hides the
 * ends of this face. 1 %: what is asked for. */
static void an_even_face_tells_only_the_albedo(void **state)
{
    (void)state;
    struct rng rng = { .seed = 20 };
    const dipole_medium truth = { .sigma_a_per_mm = 0.03, .sigma_s_prime_per_mm = 0.97, .eta = 1.3 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    const struct fit_form start = fit_form_from(&form, 2, 0.7);
    struct fit_made made;
    struct fit_estimates found;
    fit_made_face(&made, PIXELS);
    fit_made_sum(&made, &form);
    for (size_t i = 0; i < PIXELS; i++)
        made.data[i].value *= 1 + 0.01 * normal(&rng);
    fit_made_weigh(&made);
    made.target.systematic = (struct fit_systematic){ .scale = 0.002, .tile = 0.002 };
    estimate_only(&start, &made.target, false, &found);
    const struct fit_channel_estimate *const channel = &found.channels[0];
    assert_false(channel->is_identifiable);
    assert_int_equal(channel->combination, FIT_ALPHA_PRIME);
    assert_string_equal(fit_combination_names[channel->combination], "alpha_prime");
    assert_close(channel->combined.value, 0.97, 0.01, "albedo");
    assert_true(holds(&channel->combined, 0.97) && is_in_order(&channel->combined));
    assert_true(channel->combined.ci95[1] - channel->combined.ci95[0] < 0.02);
    assert_non_null(strstr(channel->note, "albedo"));
    assert_true(holds(&channel->sigma_a_per_mm, truth.sigma_a_per_mm));
    assert_true(holds(&channel->sigma_s_prime_per_mm, truth.sigma_s_prime_per_mm));
    assert_true(channel->sigma_a_per_mm.ci95[1] > 4 * channel->sigma_a_per_mm.ci95[0]);

    /* where the exposure is not known, not even that */
    made.target.is_gain_free = true;
    estimate_only(&start, &made.target, false, &found);
    assert_false(channel->is_identifiable);
    assert_int_equal(channel->combination, FIT_COMBINATION_NONE);
    assert_non_null(strstr(channel->note, "nothing else either"));
    assert_true(holds(&channel->sigma_a_per_mm, truth.sigma_a_per_mm));
    assert_true(holds(&found.gains[0], 1));
    fit_made_destroy(&made);
}

/* Oracle: spectralon absorbs nothing; an upper bound is all there is to find, and pictures with less and
 * with more absorption than it agree with it. */
static void no_absorption_gives_an_upper_bound(void **state)
{
    (void)state;
    const dipole_medium truth = { .sigma_a_per_mm = 0, .sigma_s_prime_per_mm = 11.6, .eta = 1.3 };
    struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    struct fit_form start = form;
    start.layers[0][0].medium.sigma_a_per_mm = 0.1;
    start.layers[0][0].medium.sigma_s_prime_per_mm = 1;
    struct fit_made made;
    struct fit_estimates found;
    const struct fit_channel_estimate *const channel = &found.channels[0];
    fit_made_sphere(&made, &truth, PIXELS, SAMPLES, 0, 1);
    made.target.systematic = (struct fit_systematic){ .scale = 0.002, .tile = 0.002 };
    fit_made_sum(&made, &form);
    estimate_only(&start, &made.target, false, &found);
    assert_false(channel->is_identifiable);
    assert_non_null(strstr(channel->note, "may be anything up to"));
    const double most_per_mm = channel->sigma_a_per_mm.ci95[1];
    print_message("sigma_a up to %.3g/mm\n", most_per_mm);
    assert_true(holds(&channel->sigma_s_prime_per_mm, 11.6));
    assert_close(channel->sigma_s_prime_per_mm.value, 11.6, 0.01, "sigma_s'");
    assert_int_equal(channel->combination, FIT_ALPHA_PRIME);
    assert_true(channel->combined.ci95[0] > 1 - 2 * most_per_mm / 11.6);
    assert_true(holds(&channel->combined, 1 - 1e-9));

    /* a third of what may hide does hide; five times as much shows */
    form.layers[0][0].medium.sigma_a_per_mm = most_per_mm / 3;
    fit_made_sum(&made, &form);
    estimate_only(&start, &made.target, false, &found);
    assert_false(channel->is_identifiable);
    assert_true(holds(&channel->sigma_a_per_mm, most_per_mm / 3));
    form.layers[0][0].medium.sigma_a_per_mm = most_per_mm * 5;
    fit_made_sum(&made, &form);
    estimate_only(&start, &made.target, false, &found);
    assert_true(channel->is_identifiable);
    assert_string_equal(channel->note, "");
    assert_true(holds(&channel->sigma_a_per_mm, most_per_mm * 5));
    fit_made_destroy(&made);
}

/* Oracle: nothing can be learnt from a channel without light; the start stands, finite and unsure, and the
 * other channels are found all the same. */
static void a_dark_channel_tells_nothing(void **state)
{
    (void)state;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 3);
    const struct fit_form start = fit_form_from(&form, 2, 0.7);
    struct fit_made made;
    struct fit_estimates found;
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 3);
    fit_made_predict(&made, &form, &fit_plain_camera);
    made.target.datum_count = 2 * PIXELS;
    fit_target_measure_scales(&made.target);
    estimate_only(&start, &made.target, false, &found);
    const struct fit_channel_estimate *const dark = &found.channels[2];
    assert_false(dark->is_identifiable);
    assert_non_null(strstr(dark->note, "no light"));
    assert_close(dark->sigma_a_per_mm.value, 2 * fit_marble_red.sigma_a_per_mm, 1e-14, "start");
    assert_true(is_in_order(&dark->sigma_a_per_mm) && is_in_order(&dark->sigma_s_prime_per_mm));
    assert_true(dark->sigma_a_per_mm.ci95[0] < 1e-20 && dark->sigma_a_per_mm.ci95[1] > 1e20);
    assert_true(found.channels[0].is_identifiable && found.channels[1].is_identifiable);
    assert_close(found.channels[1].sigma_a_per_mm.value, fit_marble_red.sigma_a_per_mm, 1e-4, "sigma_a");
    fit_made_destroy(&made);
}

/* ---- degenerate problems ----------------------------------------------------------------------------- */

/* Oracle: counting. Two coefficients cannot follow from one number, nor from many that are the same; and an
 * even face with everything free fits any medium. None may crash, nor claim to know a coefficient. */
static void rank_deficient_problems_claim_nothing(void **state)
{
    (void)state;
    const dipole_medium truth = { .sigma_a_per_mm = 0.03, .sigma_s_prime_per_mm = 0.97, .eta = 1.3 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    const double one = 1;
    struct io_total totals[] = { { .kind = IO_TOTAL_DIFFUSE_REFLECTANCE, .thickness_mm = INFINITY } };
    struct fit_datum data[30];
    for (size_t count = 1; count <= 30; count += 29) {
        struct fit_target target = { .node_count = 1,
                                     .row_node_count = 1,
                                     .totals = totals,
                                     .data = data,
                                     .datum_count = count,
                                     .tile_count = 30,
                                     .are_sigmas_stated = true,
                                     .finest_mm = 0.01,
                                     .largest_mm = 100 };
        for (size_t i = 0; i < count; i++)
            data[i] = (struct fit_datum){ .row = &one,
                                          .count = 1,
                                          .factor = 1,
                                          .value = 0.4,
                                          .sigma = 0.004,
                                          .stated = 0.004,
                                          .robust = 1,
                                          .tile = (int)i };
        fit_target_measure_scales(&target);
        struct fit_estimates found;
        estimate_only(&form, &target, false, &found);
        const struct fit_channel_estimate *const channel = &found.channels[0];
        assert_false(channel->is_identifiable);
        assert_int_equal(channel->combination, FIT_ALPHA_PRIME);
        assert_true(is_in_order(&channel->sigma_a_per_mm) && is_in_order(&channel->sigma_s_prime_per_mm));
        assert_true(channel->sigma_a_per_mm.ci95[1] > 1e2 * channel->sigma_a_per_mm.ci95[0]);
        assert_true(channel->sigma_s_prime_per_mm.ci95[1] > 1e2 * channel->sigma_s_prime_per_mm.ci95[0]);
    }
    struct fit_made made;
    struct fit_problem problem;
    struct fit_minimum minimum;
    struct fit_estimates found;
    struct rng rng = { .seed = 21 };
    fit_made_face(&made, PIXELS);
    fit_made_sum(&made, &form);
    for (size_t i = 0; i < PIXELS; i++)
        made.data[i].value *= 1 + 0.01 * normal(&rng);
    fit_made_weigh(&made);
    made.target.is_gain_free = made.target.is_ambient_free = made.target.is_black_free = true;
    estimate(&form, &made.target, false, &problem, &minimum, &found);
    const struct fit_channel_estimate *const channel = &found.channels[0];
    assert_false(channel->is_identifiable);
    assert_true(is_in_order(&channel->sigma_a_per_mm) && is_in_order(&channel->sigma_s_prime_per_mm));
    assert_true(is_in_order(&found.gains[0]) && is_in_order(&found.ambients[0][0]) &&
                is_in_order(&found.blacks[0][0]));
    assert_true(channel->sigma_a_per_mm.ci95[1] > 10 * channel->sigma_a_per_mm.ci95[0]);
    const size_t n = problem.layout.parameter_count;
    assert_int_equal(n, 5);
    for (size_t i = 0; i + 1 < n; i++)
        assert_true(found.singular_values[i] >= found.singular_values[i + 1]);
    /* coefficients, gain and ambient all scale one and the same picture */
    assert_true(found.singular_values[n - 1] < 1e-2 * found.singular_values[0]);
    free(found.covariance);
    fit_problem_destroy(&problem);
    fit_made_destroy(&made);
}

/* Oracle: the truth: a camera adds no light, ambient light ends at its bound, and the interval begins there
 * and holds it. */
static void an_interval_may_begin_at_a_bound(void **state)
{
    (void)state;
    struct rng rng = { .seed = 31 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    struct fit_made made;
    fit_made_sphere(&made, &fit_marble_red, PIXELS, SAMPLES, 0, 1);
    made.target.is_ambient_free = made.target.is_black_free = true;
    int bound_count = 0;
    for (int trial = 0; trial < 8; trial++) {
        struct fit_estimates found;
        fit_made_predict(&made, &form, &fit_plain_camera);
        for (size_t i = 0; i < PIXELS; i++)
            made.data[i].value *= 1 + 0.01 * normal(&rng);
        fit_made_weigh(&made);
        estimate_only(&form, &made.target, false, &found);
        assert_true(is_in_order(&found.ambients[0][0]) && is_in_order(&found.blacks[0][0]));
        assert_true(found.ambients[0][0].ci95[0] >= 0);
        bound_count += found.ambients[0][0].ci95[0] == 0;
        assert_true(found.channels[0].sigma_a_per_mm.ci95[1] <
                    3 * found.channels[0].sigma_a_per_mm.ci95[0]);
    }
    assert_true(bound_count >= 6);
    fit_made_destroy(&made);
}

/* ---- profile likelihood ------------------------------------------------------------------------------ */

/* The least cost with log sigma_a held, or (which = 1) log sigma_s': by golden sections over the other. */
static double least_cost(const struct fit_problem *problem, int which, double held)
{
    const double golden = 0.6180339887498949;
    const int other = problem->layout.coefficient[0][1 - which];
    double lo = problem->lower[other], hi = problem->upper[other];
    struct fit_state state[FIT_TARGET_LIMIT];
    double logs[FIT_COEFFICIENT_COUNT] = { 0 };
    logs[which] = held;
    /* a coarse look first: there may be more than one valley */
    double least = INFINITY, at = lo;
    for (int i = 0; i <= 200; i++) {
        logs[1 - which] = lo + (hi - lo) * i / 200;
        const double cost = fit_problem_channel_cost(problem, 0, logs, state);
        if (cost < least) {
            least = cost;
            at = logs[1 - which];
        }
    }
    const double reach = (hi - lo) / 200;
    lo = fmax(at - reach, lo);
    hi = fmin(at + reach, hi);
    for (int i = 0; i < 40; i++) {
        const double left = hi - golden * (hi - lo), right = lo + golden * (hi - lo);
        logs[1 - which] = left;
        const double cost_left = fit_problem_channel_cost(problem, 0, logs, state);
        logs[1 - which] = right;
        const double cost_right = fit_problem_channel_cost(problem, 0, logs, state);
        *(cost_left < cost_right ? &hi : &lo) = cost_left < cost_right ? right : left;
        least = fmin(least, fmin(cost_left, cost_right));
    }
    return least;
}

/* The first point from the minimum where the least cost has risen by rise: steps of 0.02, then halves. */
static double brute_end(const struct fit_problem *problem, const struct fit_minimum *minimum, int which,
                        int side, double rise)
{
    const int parameter = problem->layout.coefficient[0][which];
    const double bound = side == 0 ? problem->lower[parameter] : problem->upper[parameter];
    const double level = minimum->sum_of_squares + rise;
    double inside = minimum->parameters[parameter], outside = inside;
    do {
        inside = outside;
        outside += side == 0 ? -0.02 : 0.02;
        if (side == 0 ? outside <= bound : outside >= bound)
            return bound;
    } while (least_cost(problem, which, outside) <= level);
    for (int i = 0; i < 12; i++) {
        const double middle = 0.5 * (inside + outside);
        *(least_cost(problem, which, middle) <= level ? &inside : &outside) = middle;
    }
    return outside;
}

/* J'J inverted, of two parameters. */
static void invert_information(const struct fit_problem *problem, const double *parameters,
                               double variances[2])
{
    const size_t rows = fit_problem_residual_count(problem);
    double *const residuals = malloc(3 * rows * sizeof *residuals), a[3] = { 0 };
    assert_non_null(residuals);
    assert_int_equal(problem->layout.parameter_count, 2);
    assert_true(fit_problem_residuals(problem, parameters, residuals, residuals + rows));
    for (size_t i = 0; i < rows; i++) {
        const double *const row = residuals + rows + 2 * i;
        a[0] += row[0] * row[0];
        a[1] += row[0] * row[1];
        a[2] += row[1] * row[1];
    }
    free(residuals);
    variances[0] = a[2] / (a[0] * a[2] - a[1] * a[1]);
    variances[1] = a[0] / (a[0] * a[2] - a[1] * a[1]);
}

/* Oracle: brute force. Few pixels and much noise, so that the sum of squares is no parabola; the level is
 * what the covariance makes it, and where the least cost meets it is found on a grid. 0.01 in the
 * logarithm: where the program's search stops is a tenth of that. */
static void ends_are_where_the_likelihood_falls(void **state)
{
    (void)state;
    struct rng rng = { .seed = 77 };
    const dipole_medium truth = { .sigma_a_per_mm = 0.07, .sigma_s_prime_per_mm = 1.59, .eta = 1.3 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    struct fit_made made;
    double most_asymmetry = 0;
    fit_made_sphere(&made, &truth, 300, 300, 0, 1);
    for (int trial = 0; trial < 4; trial++) {
        struct fit_problem problem;
        struct fit_minimum minimum;
        struct fit_estimates quick, found;
        fit_made_predict(&made, &form, &fit_plain_camera);
        for (size_t i = 0; i < made.target.datum_count; i++)
            made.data[i].value *= 1 + 0.6 * normal(&rng);
        fit_made_weigh(&made);
        estimate(&form, &made.target, false, &problem, &minimum, &found);
        assert_true(fit_judge(&problem, &minimum, true, NULL, &quick, NULL));
        double variances[2];
        invert_information(&problem, minimum.parameters, variances);
        for (int which = 0; which < 2; which++) {
            const struct fit_interval *const interval =
                which == 0 ? &found.channels[0].sigma_a_per_mm : &found.channels[0].sigma_s_prime_per_mm;
            const struct fit_interval *const by_width =
                which == 0 ? &quick.channels[0].sigma_a_per_mm : &quick.channels[0].sigma_s_prime_per_mm;
            const double half_width = log(by_width->ci95[1] / by_width->value);
            assert_true(half_width > 0.1); /* else there is nothing to test */
            const double rise = half_width * half_width / variances[which];
            for (int side = 0; side < 2; side++) {
                const double expected = brute_end(&problem, &minimum, which, side, rise);
                const double end = log(interval->ci95[side]);
                if (!(fabs(end - expected) <= 0.01))
                    print_error("trial %d, %d %d: %g, expected %g\n", trial, which, side, end, expected);
                assert_true(fabs(end - expected) <= 0.01);
            }
            const double up = log(interval->ci95[1] / interval->value);
            const double down = log(interval->value / interval->ci95[0]);
            most_asymmetry = fmax(most_asymmetry, fabs(up - down) / (up + down));
        }
        free(quick.covariance);
        free(found.covariance);
        fit_problem_destroy(&problem);
    }
    print_message("largest asymmetry %.2g\n", most_asymmetry);
    assert_true(most_asymmetry > 0.02);
    fit_made_destroy(&made);
}

/* Oracle: interval.h; a stop that was asked for leaves out what takes time, and quick does the same. */
static void a_stop_makes_it_quick(void **state)
{
    (void)state;
    struct rng rng = { .seed = 78 };
    const dipole_medium truth = { .sigma_a_per_mm = 0.07, .sigma_s_prime_per_mm = 1.59, .eta = 1.3 };
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &truth, INFINITY, 1);
    struct fit_made made;
    struct fit_problem problem;
    struct fit_minimum minimum;
    struct fit_estimates found, stopped;
    fit_made_sphere(&made, &truth, 300, 300, 0, 1);
    fit_made_predict(&made, &form, &fit_plain_camera);
    for (size_t i = 0; i < made.target.datum_count; i++)
        made.data[i].value *= 1 + 0.6 * normal(&rng);
    fit_made_weigh(&made);
    estimate(&form, &made.target, true, &problem, &minimum, &found);
    const volatile sig_atomic_t stop = 1;
    assert_true(fit_judge(&problem, &minimum, false, &stop, &stopped, NULL));
    assert_memory_equal(&found.channels[0].sigma_a_per_mm, &stopped.channels[0].sigma_a_per_mm,
                        sizeof(struct fit_interval));
    /* symmetric in the logarithm */
    const struct fit_interval *const interval = &found.channels[0].sigma_a_per_mm;
    assert_close(interval->ci95[1] / interval->value, interval->value / interval->ci95[0], 1e-9, "ends");
    free(found.covariance);
    free(stopped.covariance);
    fit_problem_destroy(&problem);
    fit_made_destroy(&made);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(intervals_hold_the_truth_as_often_as_they_say),
        cmocka_unit_test(they_do_with_unknown_exposure),
        cmocka_unit_test(they_do_with_every_kind_of_error),
        cmocka_unit_test(they_do_where_nothing_is_quadratic),
        cmocka_unit_test(few_totals_hold_the_truth),
        cmocka_unit_test(an_even_face_tells_only_the_albedo),
        cmocka_unit_test(no_absorption_gives_an_upper_bound),
        cmocka_unit_test(a_dark_channel_tells_nothing),
        cmocka_unit_test(rank_deficient_problems_claim_nothing),
        cmocka_unit_test(an_interval_may_begin_at_a_bound),
        cmocka_unit_test(ends_are_where_the_likelihood_falls),
        cmocka_unit_test(a_stop_makes_it_quick),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
