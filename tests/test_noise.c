#include "fit/noise.h"

#include "fit_targets.h"

enum { COUNT = 8000 };

/* One number from the medium, its diffuse reflectance, at COUNT brightnesses: what a datum's sigma is can
 * then be looked up. */
struct ramp {
    struct fit_datum data[COUNT];
    double exact[COUNT];
    struct fit_target target;
    struct io_total total;
    struct fit_form form;
    struct fit_problem problem;
    double parameters[FIT_PARAMETER_LIMIT];
};

static const double one = 1;

static struct ramp *ramp_create(size_t count, bool are_sigmas_stated)
{
    struct ramp *const ramp = calloc(1, sizeof *ramp);
    assert_non_null(ramp);
    ramp->total = (struct io_total){ .kind = IO_TOTAL_DIFFUSE_REFLECTANCE, .thickness_mm = INFINITY };
    ramp->form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    ramp->target = (struct fit_target){ .node_count = 1,
                                        .row_node_count = 1,
                                        .totals = &ramp->total,
                                        .data = ramp->data,
                                        .datum_count = count,
                                        .tile_count = 1,
                                        .are_sigmas_stated = are_sigmas_stated,
                                        .finest_mm = 0.01,
                                        .largest_mm = 100 };
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(&fit_marble_red, &coefficients, NULL));
    const double reflectance = dipole_diffuse_reflectance(&coefficients);
    for (size_t i = 0; i < count; i++) {
        /* in no order of brightness */
        const double share = (double)((i * 7919) % count + 1) / (double)count;
        ramp->exact[i] = share * share;
        ramp->data[i] = (struct fit_datum){ .row = &one,
                                            .count = 1,
                                            .factor = ramp->exact[i] / reflectance,
                                            .value = ramp->exact[i],
                                            .sigma = 1,
                                            .robust = 1 };
    }
    fit_target_measure_scales(&ramp->target);
    assert_true(fit_problem_init(&ramp->form, &ramp->target, 1, false, &ramp->problem, NULL));
    memcpy(ramp->parameters, ramp->problem.start, sizeof ramp->parameters);
    return ramp;
}

static void ramp_destroy(struct ramp *ramp)
{
    fit_problem_destroy(&ramp->problem);
    free(ramp);
}

struct law {
    double read, shot, relative; /* sigma^2 = read^2 + shot m + relative^2 m^2 */
};

static double law_sigma(const struct law *law, double m)
{
    return sqrt(law->read * law->read + law->shot * m + law->relative * law->relative * m * m);
}

/* Oracle: the noise that the data were made with: of each kind alone, of all, and with 3 % of junk among
 * it. 25 %: medians of 16 groups of 500 scatter by 4 % each, and where one of three terms is small it may
 * be taken for another; where noise falls below a tenth of the median one it is not believed. */
static void noise_is_learned(void **state)
{
    (void)state;
    static const struct law laws[] = { { .read = 0.01 },
                                       { .shot = 1e-3 },
                                       { .relative = 0.02 },
                                       { .read = 0.005, .shot = 1e-4, .relative = 0.03 },
                                       { .read = 1e-4, .shot = 1e-6, .relative = 1e-4 } };
    struct rng rng = { .seed = 41 };
    for (size_t l = 0; l < sizeof laws / sizeof *laws; l++) {
        for (int has_junk = 0; has_junk < 2; has_junk++) {
            struct ramp *const ramp = ramp_create(COUNT, false);
            double worst = 0;
            for (size_t i = 0; i < COUNT; i++) {
                ramp->data[i].value += law_sigma(&laws[l], ramp->exact[i]) * normal(&rng);
                if (has_junk && i % 33 == 0)
                    ramp->data[i].value = uniform(&rng, 0, 20);
            }
            assert_true(fit_noise_reweigh(&ramp->problem, ramp->parameters));
            const double middle = law_sigma(&laws[l], 0.25);
            for (size_t i = 0; i < COUNT; i++) {
                const double expected = fmax(law_sigma(&laws[l], ramp->exact[i]), 0.1 * middle);
                worst = fmax(worst, fabs(log(ramp->data[i].sigma / expected)));
            }
            print_message("law %zu%s: sigma within %.0f %%\n", l, has_junk ? " with junk" : "",
                          100 * worst);
            assert_true(worst < 0.25);
            ramp_destroy(ramp);
        }
    }
}

/* Oracle: Huber's loss and noise.h: full weight up to 2.5 sigmas, then 2.5 sigmas over the size, none
 * beyond FIT_NOISE_OUTLIER where sigmas are not stated. 10 %: what a sigma is known to. */
static void outliers_lose_their_weight(void **state)
{
    (void)state;
    static const double sizes[] = { 0, 2, 3.5, 6, 20 };
    struct rng rng = { .seed = 42 };
    for (int is_stated = 0; is_stated < 2; is_stated++) {
        struct ramp *const ramp = ramp_create(COUNT, is_stated);
        for (size_t i = 0; i < COUNT; i++) {
            ramp->data[i].sigma = 0.01;
            ramp->data[i].stated = is_stated ? 0.01 : 0;
            ramp->data[i].value += 0.01 * normal(&rng);
        }
        for (size_t i = 0; i < 5; i++)
            ramp->data[10 * i].value = ramp->exact[10 * i] - 0.01 * sizes[i];
        assert_true(fit_noise_reweigh(&ramp->problem, ramp->parameters));
        for (size_t i = 0; i < 5; i++) {
            const double found = ramp->data[10 * i].robust;
            const double expected = sizes[i] < 2.5                   ? 1
                                    : sizes[i] < 8 || is_stated != 0 ? 2.5 / sizes[i]
                                                                     : 0;
            assert_close(found, expected, 0.1, "%g sigmas, stated %d", sizes[i], is_stated);
        }
        if (is_stated) {
            for (size_t i = 0; i < COUNT; i++)
                assert_close(ramp->data[i].sigma, 0.01, 0.1, "datum %zu", i);
        }
        ramp_destroy(ramp);
    }
}

/* Oracle: the error that the data were made with: sigmas that are stated stay where they are enough, and no
 * half of the data is called outliers; what the residuals show above them is the model's, relative to it.
 * 20 %: it is the difference of two variances. */
static void stated_sigmas_are_the_least(void **state)
{
    (void)state;
    static const double relative[] = { 0, 0.03 };
    struct rng rng = { .seed = 43 };
    for (int k = 0; k < 3; k++) {
        struct ramp *const ramp = ramp_create(2000, true);
        const double off = k < 2 ? relative[k] : 0;
        size_t full_count = 0;
        double worst = 0;
        for (size_t i = 0; i < 2000; i++) {
            ramp->data[i].stated = ramp->data[i].sigma = 0.01 * ramp->exact[i] + 1e-4;
            /* of the third, far smaller errors than stated */
            ramp->data[i].value += (k < 2 ? 1 : 0.01) * ramp->data[i].stated * normal(&rng) +
                                   off * ramp->exact[i] * normal(&rng);
        }
        assert_true(fit_noise_reweigh(&ramp->problem, ramp->parameters));
        for (size_t i = 0; i < 2000; i++) {
            const double expected = hypot(ramp->data[i].stated, off * ramp->exact[i]);
            worst = fmax(worst, fabs(ramp->data[i].sigma / expected - 1));
            assert_true(ramp->data[i].sigma >= ramp->data[i].stated);
            full_count += ramp->data[i].robust == 1;
        }
        print_message("model error %g: sigma within %.0f %%\n", off, 100 * worst);
        assert_true(worst < 0.2);
        assert_true(full_count > 1900);
        ramp_destroy(ramp);
    }
}

/* Oracle: counting: too few to see noise grow with the signal still say how large it is (30 of them to 40 %
 * at 3 sigma), and an exact fit leaves sigmas that are finite, above 0, and small. */
static void few_data_and_exact_ones_have_a_sigma(void **state)
{
    (void)state;
    struct rng rng = { .seed = 44 };
    struct ramp *ramp = ramp_create(30, false);
    for (size_t i = 0; i < 30; i++) {
        ramp->data[i].sigma = ramp->exact[i] + 0.1;
        ramp->data[i].value += 0.02 * ramp->data[i].sigma * normal(&rng);
    }
    assert_true(fit_noise_reweigh(&ramp->problem, ramp->parameters));
    for (size_t i = 0; i < 30; i++)
        assert_close(ramp->data[i].sigma, 0.02 * (ramp->exact[i] + 0.1), 0.4, "datum %zu", i);
    ramp_destroy(ramp);
    ramp = ramp_create(1000, false);
    for (size_t i = 0; i < 1000; i++) {
        const double value = ramp->data[i].factor;
        ramp->data[i].value = 0;
        ramp->data[i].factor = 0;
        ramp->data[i].constant = 0;
        ramp->data[i].sigma = value;
    }
    for (int pass = 0; pass < 3; pass++)
        assert_true(fit_noise_reweigh(&ramp->problem, ramp->parameters));
    for (size_t i = 0; i < 1000; i++) {
        assert_true(ramp->data[i].sigma > 0 && ramp->data[i].sigma < 1e-9);
        assert_true(ramp->data[i].robust == 1);
    }
    ramp_destroy(ramp);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_learned),
        cmocka_unit_test(outliers_lose_their_weight),
        cmocka_unit_test(stated_sigmas_are_the_least),
        cmocka_unit_test(few_data_and_exact_ones_have_a_sigma),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
