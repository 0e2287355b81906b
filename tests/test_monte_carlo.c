/*
 * accuracy/monte_carlo.h against other people's programs, closed forms and conservation.
 *
 * z is a difference over its standard error. If errors are right one z in 370 is beyond 3, a little more
 * since 64 batches know their error to 9 % and MCML's 6 to 10 batches theirs to 25 to 35 %. So the few
 * totals must all be within 3, and of many rings a share of at most 1 % may be beyond, none beyond 5.
 */
#include "path_tracer.h"
#include "reference_cases.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

enum { POWERS = sizeof(struct accuracy_mc_powers) / sizeof(double) };

/* ---- what the tests share ----------------------------------------------------------------------- */

struct scores {
    int count, beyond_count;
    double chi2, worst;
};

static double score(struct scores *scores, double found, double expected, double error)
{
    const double z = found == expected ? 0 : (found - expected) / error;
    scores->count++;
    scores->beyond_count += fabs(z) > 3;
    scores->chi2 += z * z;
    scores->worst = fmax(scores->worst, fabs(z));
    return z;
}

/* The mean of z^2 is 1 with a spread of sqrt(2/count), and a tenth more since errors are only estimated. */
static void check_scores(const struct scores *scores, int least_count, double limit, const char *what)
{
    const double mean = scores->chi2 / scores->count;
    print_message("  %s: %d z, %d beyond 3, worst %.2f, mean square %.2f\n", what, scores->count,
                  scores->beyond_count, scores->worst, mean);
    assert_true(scores->count >= least_count);
    assert_true(scores->worst <= limit);
    assert_true(scores->beyond_count <= fmax(1, 0.01 * scores->count));
    assert_true(mean <= 1.1 + 4 * sqrt(2.0 / scores->count));
}

static struct accuracy_mc_result trace(const struct accuracy_mc_stack *stack, size_t photon_count,
                                       uint64_t seed, const struct accuracy_mc_rings *rings)
{
    const struct accuracy_mc_run run = { photon_count, seed, 0 };
    struct accuracy_mc_result result;
    dipole_status status;
    if (!accuracy_mc_trace(stack, &run, rings, &result, &status))
        fail_msg("%s", status.message);
    return result;
}

static struct accuracy_mc_stack one_layer(double sigma_a_per_mm, double sigma_s_per_mm, double g,
                                          double eta, double thickness_mm)
{
    return (struct accuracy_mc_stack){
        .layers = { { sigma_a_per_mm, sigma_s_per_mm, g, eta, thickness_mm } }, .layer_count = 1
    };
}

static void check_balance(const struct accuracy_mc_powers *mean, double tolerance)
{
    double sum = 0;
    for (int i = 0; i < POWERS; i++) {
        assert_true(isfinite(((const double *)mean)[i]));
        sum += ((const double *)mean)[i];
    }
    assert_close(sum, 1, tolerance, "energy");
}

static double all_absorbed(const struct accuracy_mc_powers *powers)
{
    double sum = 0;
    for (int i = 0; i < DIPOLE_LAYER_LIMIT; i++)
        sum += powers->absorbed[i];
    return sum;
}

/* A layer of anything, with layers in a stack that light gets through. */
static struct accuracy_mc_layer random_layer(struct rng *rng)
{
    return (struct accuracy_mc_layer){ .sigma_a_per_mm =
                                           uniform(rng, 0, 1) < 0.3 ? 0 : log_uniform(rng, 1e-3, 3),
                                       .sigma_s_per_mm =
                                           uniform(rng, 0, 1) < 0.2 ? 0 : log_uniform(rng, 1e-2, 30),
                                       .g = uniform(rng, -0.99, 0.99),
                                       .eta = uniform(rng, 0, 1) < 0.3 ? 1 : uniform(rng, 0.7, 2),
                                       .thickness_mm = log_uniform(rng, 1e-3, 1) };
}

/* ---- against MCML ------------------------------------------------------------------------------- */

struct profile {
    double found[2][ACCURACY_REFERENCE_RING_LIMIT], error[2][ACCURACY_REFERENCE_RING_LIMIT];
};

/* Neighbours are joined until each group's error is below 6 %: then errors are Gaussian. */
static void score_rings(const struct accuracy_reference_case *from, int side, const struct profile *profile,
                        struct scores *scores)
{
    const double *const theirs = side == 0 ? from->rd_per_mm2 : from->td_per_mm2;
    const double *const their_error = side == 0 ? from->rd_error : from->td_error;
    double found = 0, expected = 0, variance = 0;
    for (size_t i = 0; i < from->ring_count; i++) {
        const double lo_mm = from->edges_mm[i], hi_mm = from->edges_mm[i + 1];
        const double area_mm2 = PI * (hi_mm - lo_mm) * (hi_mm + lo_mm);
        found += area_mm2 * profile->found[side][i];
        expected += area_mm2 * theirs[i];
        const double error = area_mm2 * hypot(profile->error[side][i], their_error[i]);
        variance += error * error;
        if (found > 0 && sqrt(variance) < 0.06 * found) {
            score(scores, found, expected, sqrt(variance));
            found = expected = variance = 0;
        }
    }
}

/* Oracle: MCML, in total and ring by ring: half-spaces, slabs, two and three layers, equal and unequal
 * indices, g of 0 and 0.75. Its own light that did not scatter is counted, not known. */
static void agrees_with_mcml(void **state)
{
    (void)state;
    struct scores totals = { 0 }, rings = { 0 };
    struct accuracy_reference *const reference = read_reference();
    for (size_t i = 0; i < reference->case_count; i++) {
        const struct accuracy_reference_case *const from = &reference->cases[i];
        const bool is_slow = strcmp(from->name, "semi_lowabs_n10") == 0;
        struct profile profile;
        const struct accuracy_mc_rings of_case = { from->edges_mm,   from->ring_count, profile.found[0],
                                                   profile.error[0], profile.found[1], profile.error[1] };
        const struct accuracy_mc_result result = trace(&from->stack, is_slow ? 10000 : 64000, 7, &of_case);
        const struct accuracy_mc_powers *const mean = &result.mean, *const error = &result.error;
        check_balance(mean, 1e-12);
        assert_close(mean->specular, from->specular, 1e-6, "%s", from->name);
        assert_true(fabs(mean->unscattered_reflected - from->unscattered_reflected) < 1e-4);
        assert_true(fabs(mean->unscattered_transmitted - from->unscattered_transmitted) < 6e-4);
        score(&totals, mean->reflected, from->reflected, hypot(error->reflected, from->reflected_error));
        score_rings(from, 0, &profile, &rings);
        if (from->transmitted > 0) {
            score(&totals, mean->transmitted, from->transmitted,
                  hypot(error->transmitted, from->transmitted_error));
            score_rings(from, 1, &profile, &rings);
        }
    }
    free(reference);
    check_scores(&totals, 20, 3, "totals of MCML");
    check_scores(&rings, 1000, 5, "rings of MCML");
}

/* Oracle: adding and doubling, 168 slabs and half-spaces, g of 0 and 0.8; what did not scatter to 9 digits.
 */
static void agrees_with_adding_and_doubling(void **state)
{
    (void)state;
    struct scores scores = { 0 };
    struct accuracy_reference *const reference = read_reference();
    for (size_t i = 0; i < reference->slab_count; i++) {
        const struct accuracy_reference_slab *const slab = &reference->slabs[i];
        const struct accuracy_mc_result result = trace(&slab->stack, 6400, i, NULL);
        const struct accuracy_mc_powers *const p = &result.mean, *const e = &result.error;
        check_balance(p, 1e-12);
        const double r0 = p->specular + p->unscattered_reflected, t0 = p->unscattered_transmitted;
        assert_close(r0, slab->unscattered_r, 1e-9, "unscattered R");
        assert_close(t0, slab->unscattered_t, 1e-9, "unscattered T");
        score(&scores, r0 + p->reflected, slab->total_r, hypot(e->reflected, slab->error));
        /* Fewer than some hundred photons that passed have no Gaussian error. */
        if (p->transmitted > 0.03)
            score(&scores, t0 + p->transmitted, slab->total_t, hypot(e->transmitted, slab->error));
    }
    free(reference);
    check_scores(&scores, 250, 4.5, "adding and doubling");
}

/* ---- against another Monte Carlo ------------------------------------------------------------------ */

/* Oracle: the tests' path tracer, which walks from the start, in three dimensions and with other formulas;
 * random slabs with g to 0.95 either way and eta from 0.7, some of them thin. Only the generator of random
 * numbers is shared, with other seeds. */
static void agrees_with_the_path_tracer(void **state)
{
    (void)state;
    enum { COUNT = 8 };
    struct rng rng = { .seed = 11 };
    struct scores totals = { 0 }, scores = { 0 };
    double edges_mm[COUNT + 1], values[8][COUNT];
    for (int i = 0; i < 30; i++) {
        const double sigma_s = log_uniform(&rng, 0.1, 3), sigma_a = i % 5 == 0 ? 0 : 0.1 * sigma_s;
        const double g = uniform(&rng, -0.95, 0.95), eta = i % 3 == 0 ? 0.7 : uniform(&rng, 1, 1.8);
        const double d_mm = log_uniform(&rng, 0.02, 5) / sigma_s;
        for (int k = 0; k <= COUNT; k++)
            edges_mm[k] = d_mm * (0.05 * k * k);
        const struct accuracy_mc_rings rings = {
            edges_mm, COUNT, values[0], values[1], values[2], values[3]
        };
        struct tracer_rings other_rings = { edges_mm, COUNT, values[4], values[5], values[6], values[7] };
        const struct accuracy_mc_stack stack = one_layer(sigma_a, sigma_s, g, eta, d_mm);
        const struct accuracy_mc_result result = trace(&stack, 20000, 1000 + (uint64_t)i, &rings);
        const struct tracer_scene scene = {
            .body = { .kind = TRACER_BOX, .half_size_mm = { 1e6, 0.5 * d_mm, 1e6 } },
            .medium = { sigma_a, sigma_s, g, eta },
            .light = { TRACER_PENCIL, { 0, -1, 0 }, { 0, d_mm, 0 }, 1 },
        };
        struct tracer_result other = { .rings = &other_rings };
        assert_true(
            tracer_trace(&scene, &(struct tracer_run){ 20000, 5000 + (uint64_t)i, 0 }, &other, NULL));
        score(&totals, result.mean.reflected, other.mean.scattered[3],
              hypot(result.error.reflected, other.error.scattered[3]));
        score(&totals, result.mean.transmitted, other.mean.scattered[2],
              hypot(result.error.transmitted, other.error.scattered[2]));
        for (int k = 0; k < COUNT; k++)
            for (int side = 0; side < 4; side += 2) {
                const double error = hypot(values[side + 1][k], values[side + 5][k]);
                if (error > 0 && error < 0.06 * values[side][k])
                    score(&scores, values[side][k], values[side + 4][k], error);
            }
    }
    check_scores(&totals, 60, 3.5, "totals of the path tracer");
    check_scores(&scores, 100, 5, "rings of the path tracer");
}

/* ---- closed forms --------------------------------------------------------------------------------- */

/* Oracle: Beer and Lambert, Fresnel and the geometric series of light between two faces. Nothing is left to
 * chance, so errors are 0. */
static void absorbers_are_exact(void **state)
{
    (void)state;
    struct rng rng = { .seed = 2 };
    for (int i = 0; i < 200; i++) {
        const double sigma_a = i % 7 == 0 ? 0 : log_uniform(&rng, 1e-6, 10),
                     d_mm = log_uniform(&rng, 1e-3, 3);
        const double eta = i % 3 == 0 ? 1 : log_uniform(&rng, 0.1, 10);
        const struct accuracy_mc_stack stack = one_layer(sigma_a, 0, 0.5, eta, d_mm);
        const struct accuracy_mc_result result = trace(&stack, 1, 1, NULL);
        const double rho = dipole_fresnel_reflectance(eta, 1), t = exp(-sigma_a * d_mm);
        const double series = 1 / (1 - rho * rho * t * t);
        const struct accuracy_mc_powers *const p = &result.mean;
        assert_close(p->specular, rho, 1e-13, "case %d: mirrored", i);
        assert_close(p->unscattered_transmitted, (1 - rho) * (1 - rho) * t * series, 1e-13, "case %d", i);
        assert_close(p->unscattered_reflected, rho * (1 - rho) * (1 - rho) * t * t * series, 1e-13,
                     "case %d", i);
        assert_close(p->absorbed[0], (1 - rho) * -expm1(-sigma_a * d_mm) / (1 - rho * t), 1e-13, "case %d",
                     i);
        assert_true(p->reflected == 0 && p->transmitted == 0 && p->lost == 0 && result.scatterings == 0);
        for (int k = 0; k < POWERS; k++)
            assert_true(((const double *)&result.error)[k] == 0);
    }
}

/* Oracle: the integral over the backward half of Henyey and Greenstein's function; light that scatters once
 * in a thin layer of index 1 has no other way. Scattering twice has a part of order tau log(tau). */
static void thin_layers_scatter_once(void **state)
{
    (void)state;
    static const double means[] = { -0.99, -0.5, -1e-9, 0, 1e-12, 1e-4, 0.3, 0.9, 0.99 };
    for (size_t i = 0; i < sizeof means / sizeof *means; i++) {
        const double g = means[i], tau = 1e-7;
        const struct accuracy_mc_stack stack = one_layer(0.25, 0.75, g, 1, tau);
        const struct accuracy_mc_result result = trace(&stack, 256000, 3, NULL);
        const double back =
            fabs(g) < 1e-3 ? 0.5 - 0.75 * g : (1 - g * g) / (2 * g) * (1 / sqrt(1 + g * g) - 1 / (1 + g));
        struct scores scores = { 0 };
        const double scattered = 0.75 * tau;
        score(&scores, result.mean.reflected / scattered, back, result.error.reflected / scattered + 1e-5);
        score(&scores, result.mean.transmitted / scattered, 1 - back,
              result.error.transmitted / scattered + 1e-5);
        assert_true(scores.worst <= 3);
        assert_close(result.mean.absorbed[0], 0.25 * tau, 1e-5, "g %g", g);
    }
}

/* Oracle: a quadrature over angles. A film that scatters once lies on a clear plate; light goes through it
 * by Snell and Fresnel, to and fro, and leaves at its bottom at odd multiples of its thickness times the
 * tangent inside. */
static void plates_refract(void **state)
{
    (void)state;
    enum { COUNT = 12, STEPS = 20000 };
    static const double etas[] = { 1.5, 0.8 };
    for (int e = 0; e < 2; e++) {
        const double eta = etas[e];
        double edges_mm[COUNT + 1] = { 0 }, values[4][COUNT], expected[COUNT] = { 0 };
        for (int k = 1; k <= COUNT; k++)
            edges_mm[k] = 0.25 * k;
        const struct accuracy_mc_rings rings = {
            edges_mm, COUNT, values[0], values[1], values[2], values[3]
        };
        const struct accuracy_mc_stack stack = { .layers = { { 0, 1, 0, 1, 1e-7 }, { 0, 0, 0, eta, 1 } },
                                                 .layer_count = 2 };
        const struct accuracy_mc_result result = trace(&stack, 512000, 5, &rings);
        const struct accuracy_mc_powers *const mean = &result.mean;
        const double scattered = mean->reflected + mean->transmitted;
        for (int i = 0; i < STEPS; i++) {
            const double mu = (i + 0.5) / STEPS, rho = dipole_fresnel_reflectance(eta, mu);
            const double sine2 = (1 - mu * mu) / (eta * eta);
            double power = 0.5 / STEPS * (1 - rho) * (1 - rho);
            for (double ways = 1; power > 1e-9 / STEPS && sine2 < 1; ways += 2, power *= rho * rho) {
                const double r_mm = ways * sqrt(sine2 / (1 - sine2));
                if (r_mm < edges_mm[COUNT])
                    expected[(int)(r_mm / 0.25)] += power;
            }
        }
        struct scores scores = { 0 };
        for (int k = 0; k < COUNT; k++) {
            const double area_mm2 = PI * (edges_mm[k + 1] - edges_mm[k]) * (edges_mm[k + 1] + edges_mm[k]);
            if (expected[k] > 1e-4) /* the quadrature's steps in a ring: 1e-4 of a half */
                score(&scores, area_mm2 * values[2][k] / scattered, expected[k],
                      area_mm2 * values[3][k] / scattered + 5e-5);
        }
        check_scores(&scores, 5, 3.5, "plate");
    }
}

/* Oracle: symmetry. In a thin layer that guides light what scattered once leaves by both faces alike. Most
 * of it meets the faces some 10^8 times before it scatters again, which must not take that long. */
static void guided_light_takes_no_time(void **state)
{
    (void)state;
    const struct accuracy_mc_stack stack = one_layer(0, 1, 0, 1.5, 1e-8);
    const struct accuracy_mc_result result = trace(&stack, 64000, 4, NULL);
    struct scores scores = { 0 };
    score(&scores, result.mean.reflected, result.mean.transmitted, 2 * result.error.reflected);
    assert_true(scores.worst <= 3 && result.mean.lost == 0);
    check_balance(&result.mean, 1e-12);
}

/* ---- invariants ----------------------------------------------------------------------------------- */

/* Oracle: conservation, over random stacks; Russian roulette and light no longer followed are counted. */
static void energy_is_kept(void **state)
{
    (void)state;
    struct rng rng = { .seed = 6 };
    struct scores roulette = { 0 };
    for (int i = 0; i < 60; i++) {
        struct accuracy_mc_stack stack = { .layer_count = 1 + (size_t)i % DIPOLE_LAYER_LIMIT };
        for (size_t k = 0; k < stack.layer_count; k++)
            stack.layers[k] = random_layer(&rng);
        struct accuracy_mc_layer *const last = &stack.layers[stack.layer_count - 1];
        if (i % 3 == 0)
            last->thickness_mm = INFINITY;
        if (i % 6 == 0)
            last->sigma_a_per_mm = last->sigma_s_per_mm = 0;
        else if (i % 3 == 0)
            last->sigma_a_per_mm = 0.1;
        const struct accuracy_mc_result result = trace(&stack, 6400, (uint64_t)i, NULL);
        check_balance(&result.mean, 1e-12);
        for (int k = 0; k < POWERS; k++)
            assert_true(((const double *)&result.mean)[k] >= 0 ||
                        &((const double *)&result.mean)[k] == &result.mean.roulette);
        if (result.error.roulette > 0)
            score(&roulette, result.mean.roulette, 0, result.error.roulette);
    }
    check_scores(&roulette, 20, 4, "roulette");
}

/* Oracle: the stack that is the same in one piece. */
static void cutting_a_layer_changes_nothing(void **state)
{
    (void)state;
    static const double edges_mm[] = { 0, 0.2, 0.5, 1, 2, 4 };
    enum { COUNT = sizeof edges_mm / sizeof *edges_mm - 1 };
    double values[8][COUNT];
    const struct accuracy_mc_stack whole = one_layer(0.1, 2, 0.6, 1.4, 3);
    const struct accuracy_mc_stack cut = {
        .layers = { { 0.1, 2, 0.6, 1.4, 0.1 }, { 0.1, 2, 0.6, 1.4, 2 }, { 0.1, 2, 0.6, 1.4, 0.9 } },
        .layer_count = 3
    };
    const struct accuracy_mc_rings rings = { edges_mm, COUNT, values[0], values[1], values[2], values[3] };
    const struct accuracy_mc_rings cut_rings = {
        edges_mm, COUNT, values[4], values[5], values[6], values[7]
    };
    const struct accuracy_mc_result a = trace(&whole, 100000, 1, &rings);
    const struct accuracy_mc_result b = trace(&cut, 100000, 2, &cut_rings);
    struct scores scores = { 0 };
    assert_close(a.mean.unscattered_transmitted, b.mean.unscattered_transmitted, 1e-13, "unscattered");
    score(&scores, a.mean.reflected, b.mean.reflected, hypot(a.error.reflected, b.error.reflected));
    score(&scores, a.mean.transmitted, b.mean.transmitted, hypot(a.error.transmitted, b.error.transmitted));
    score(&scores, all_absorbed(&a.mean), all_absorbed(&b.mean), /* A is what R and T leave */
          hypot(hypot(a.error.reflected, b.error.reflected),
                hypot(a.error.transmitted, b.error.transmitted)));
    for (int i = 0; i < COUNT; i++) {
        score(&scores, values[0][i], values[4][i], hypot(values[1][i], values[5][i]));
        score(&scores, values[2][i], values[6][i], hypot(values[3][i], values[7][i]));
    }
    check_scores(&scores, 13, 3, "cut");
}

/* Oracle: all of the light that leaves does so within some radius. */
static void rings_hold_what_leaves(void **state)
{
    (void)state;
    static const double edges_mm[] = { 0, 0.3, 1, 10, 1e100 };
    enum { COUNT = sizeof edges_mm / sizeof *edges_mm - 1 };
    double values[4][COUNT];
    const struct accuracy_mc_rings rings = { edges_mm, COUNT, values[0], values[1], values[2], values[3] };
    const struct accuracy_mc_stack stack = one_layer(0.01, 1, -0.3, 1.33, 2);
    const struct accuracy_mc_result result = trace(&stack, 10000, 9, &rings);
    double r = 0, t = 0;
    for (int i = 0; i < COUNT; i++) {
        const double area_mm2 = PI * (edges_mm[i + 1] - edges_mm[i]) * (edges_mm[i + 1] + edges_mm[i]);
        r += values[0][i] * area_mm2;
        t += values[2][i] * area_mm2;
    }
    assert_close(r, result.mean.reflected, 1e-12, "reflected");
    assert_close(t, result.mean.transmitted, 1e-12, "transmitted");
}

/* Oracle: the same run on another number of threads, to the last bit; another seed is another run. */
static void threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const double edges_mm[] = { 0, 0.1, 1, 3 };
    const struct accuracy_mc_stack stack = {
        .layers = { { 0.1, 3, 0.8, 1.4, 0.3 }, { 0.01, 1, 0, 1.5, INFINITY } }, .layer_count = 2
    };
    struct accuracy_mc_result results[5];
    double values[5][4][3];
    for (int i = 0; i < 5; i++) {
        const struct accuracy_mc_run run = { 5000, i == 4 ? 2 : 1, (int[]){ 1, 2, 5, 0, 0 }[i] };
        const struct accuracy_mc_rings rings = { edges_mm,     3,           values[i][0], values[i][1],
                                                 values[i][2], values[i][3] };
        memset(&results[i], 0, sizeof results[i]);
        assert_true(accuracy_mc_trace(&stack, &run, &rings, &results[i], NULL));
        assert_int_equal(results[i].photon_count, 5056);
    }
    for (int i = 1; i < 4; i++) {
        assert_memory_equal(&results[i], &results[0], sizeof results[0]);
        assert_memory_equal(values[i], values[0], sizeof values[0]);
    }
    assert_true(results[4].mean.reflected != results[0].mean.reflected);
}

/* Oracle: conservation at the ends of all ranges, where nothing may overflow or go on for ever. */
static void extremes_are_finite(void **state)
{
    (void)state;
    static const double sigmas[] = { 0, 1e-50, 1, 1e50 }, thicknesses[] = { 1e-50, 1, 1e50, INFINITY };
    int lost_count = 0;
    for (int i = 0; i < 4 * 4 * 4 * 3; i++) {
        const double sigma_a = sigmas[i % 4], sigma_s = sigmas[i / 4 % 4];
        const double d_mm = thicknesses[i / 16 % 4], eta = (double[]){ 0.1, 1, 10 }[i / 64];
        /* Where nothing absorbs, light in the deep is followed until it is lost: for long, so once. */
        const bool is_slow = sigma_a < 1e-3 * sigma_s && sigma_s * d_mm > 1e3;
        if (is_slow && !(eta == 1 && sigma_s == 1 && isinf(d_mm)))
            continue;
        const struct accuracy_mc_stack stack = one_layer(sigma_a, sigma_s, 0.9, eta, d_mm);
        const struct accuracy_mc_result result = trace(&stack, is_slow ? 64 : 640, 1, NULL);
        lost_count += result.mean.lost > 0;
        check_balance(&result.mean, 1e-11);
    }
    assert_true(lost_count > 0);
}

/* Oracle: exact messages; nothing is written. */
static void what_has_no_meaning_is_refused(void **state)
{
    (void)state;
    static const double edges_mm[] = { 1, 1 };
    double values[4] = { 0 };
    const struct accuracy_mc_rings rings = { edges_mm, 1, &values[0], &values[1], &values[2], &values[3] };
    const struct accuracy_mc_run run = { 100, 1, 1 };
    const struct {
        struct accuracy_mc_layer layer;
        const char *message;
    } cases[] = {
        { { -1, 1, 0, 1, 1 }, "layers[1].sigma_a_per_mm is -1, expected 0 or 1e-50 to 1e50" },
        { { 1, NAN, 0, 1, 1 }, "layers[1].sigma_s_per_mm is nan, expected 0 or 1e-50 to 1e50" },
        { { 1, 1, 1, 1, 1 }, "layers[1].g is 1, expected above -1 and below 1" },
        { { 1, 1, 0, 11, 1 }, "layers[1].eta is 11, expected 0.1 to 10" },
        { { 1, 1, 0, 1, 0 }, "layers[1].thickness_mm is 0, expected 1e-50 to 1e50, or infinite" },
    };
    struct accuracy_mc_result result = { .photon_count = 77 };
    dipole_status status;
    struct accuracy_mc_stack stack = { .layers = { { 1, 1, 0, 1, 1 } }, .layer_count = 2 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        stack.layers[1] = cases[i].layer;
        assert_false(accuracy_mc_trace(&stack, &run, NULL, &result, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_string_equal(status.message, cases[i].message);
    }
    stack.layers[1] = stack.layers[0];
    stack.layers[0].thickness_mm = INFINITY;
    assert_false(accuracy_mc_trace(&stack, &run, NULL, &result, &status));
    assert_string_equal(status.message, "layers[0].thickness_mm is inf, expected 1e-50 to 1e50");
    stack.layer_count = 17;
    assert_false(accuracy_mc_trace(&stack, &run, NULL, &result, &status));
    assert_string_equal(status.message, "layer_count is 17, expected 1 to 16");
    stack = one_layer(1, 1, 0, 1, 1);
    assert_false(accuracy_mc_trace(&stack, &run, &rings, &result, &status));
    assert_string_equal(status.message, "edges_mm[1] is 1, expected >= 0 and above the one before");
    assert_false(accuracy_mc_trace(&stack, &(struct accuracy_mc_run){ 0 }, NULL, &result, &status));
    assert_string_equal(status.message, "photon_count is 0, expected 1 to 1e12");
    assert_int_equal(result.photon_count, 77);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_mcml),
        cmocka_unit_test(agrees_with_adding_and_doubling),
        cmocka_unit_test(agrees_with_the_path_tracer),
        cmocka_unit_test(absorbers_are_exact),
        cmocka_unit_test(thin_layers_scatter_once),
        cmocka_unit_test(plates_refract),
        cmocka_unit_test(guided_light_takes_no_time),
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(cutting_a_layer_changes_nothing),
        cmocka_unit_test(rings_hold_what_leaves),
        cmocka_unit_test(threads_do_not_change_a_bit),
        cmocka_unit_test(extremes_are_finite),
        cmocka_unit_test(what_has_no_meaning_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
