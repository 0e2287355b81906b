#include "fit_targets.h"
#include "reference_file.h"

enum { MODELS = 5, TOTALS = 8, NODES = 6, PARTS = 1 + FIT_COEFFICIENT_COUNT };

static const dipole_model models[MODELS] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE,
                                             DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM,
                                             DIPOLE_MODEL_MODES };

/* A target that asks for totals only. */
static struct fit_target target_of_totals(const struct io_total *totals, size_t count)
{
    return (struct fit_target){ .node_count = count, .row_node_count = count, .totals = totals };
}

static double total_of(const struct fit_form *form, enum io_total_kind kind, double thickness_mm)
{
    const struct io_total total = { .kind = kind, .thickness_mm = thickness_mm };
    const struct fit_target target = target_of_totals(&total, 1);
    double logs[FIT_COEFFICIENT_COUNT], value;
    fit_form_start(form, 0, logs);
    assert_true(fit_target_evaluate(&target, form, 0, logs, NULL, &value, NULL));
    return value;
}

/* What of the light that arrives passes or returns without scattering. */
static double unscattered(const struct fit_form *form, bool is_far, double thickness_mm)
{
    const double f = dipole_fresnel_reflectance(form->layers[0][0].medium.eta, 1);
    const enum io_total_kind whole = is_far ? IO_TOTAL_TRANSMITTANCE : IO_TOTAL_REFLECTANCE;
    const enum io_total_kind part = is_far ? IO_TOTAL_DIFFUSE_TRANSMITTANCE : IO_TOTAL_DIFFUSE_REFLECTANCE;
    return total_of(form, whole, thickness_mm) - (1 - f) * total_of(form, part, thickness_mm);
}

/*
 * Oracle: adding-doubling, by others, of slabs and half-spaces that scatter evenly, so that sigma_s' is
 * sigma_s. What does not scatter follows from Fresnel and Beer alone and agrees to the digits of the table,
 * 1e-10. The rest is the model's: totals of a slab of at least one mean free path agree within 0.004 for
 * the modes and 0.03 for the beam model, and from alpha' 0.95 on within 0.003 and 0.025.
 */
static void totals_agree_with_adding_doubling(void **state)
{
    (void)state;
    struct reference_file rows;
    double worst[2] = { 0, 0 }, worst_bright[2] = { 0, 0 };
    int count = 0;
    reference_open(&rows, "adding_doubling.csv");
    while (reference_next(&rows)) {
        const double albedo = reference_number(&rows, "albedo"), tau = reference_number(&rows, "tau");
        const double n = reference_number(&rows, "n_slab");
        if (reference_number(&rows, "g") != 0 || !(albedo < 1))
            continue;
        const dipole_medium medium = { .sigma_a_per_mm = 1 - albedo,
                                       .sigma_s_prime_per_mm = albedo,
                                       .eta = n };
        for (int is_modes = 0; is_modes < 2; is_modes++) {
            const struct fit_form form =
                fit_form_of(is_modes ? DIPOLE_MODEL_MODES : DIPOLE_MODEL_BEAM, &medium, INFINITY, 1);
            for (int is_far = 0; is_far < 2; is_far++) {
                const double expected0 =
                    reference_number(&rows, is_far ? "T_unscattered" : "R_unscattered");
                const double expected = reference_number(&rows, is_far ? "T_total" : "R_total");
                assert_true(fabs(unscattered(&form, is_far, tau) - expected0) < 1e-10);
                const double found =
                    total_of(&form, is_far ? IO_TOTAL_TRANSMITTANCE : IO_TOTAL_REFLECTANCE, tau);
                const double error = fabs(found - expected);
                if (tau >= 1)
                    worst[is_modes] = fmax(worst[is_modes], error);
                if (tau >= 1 && albedo >= 0.95)
                    worst_bright[is_modes] = fmax(worst_bright[is_modes], error);
            }
        }
        count++;
    }
    print_message("%d slabs: beam within %.3f, modes %.3f; bright ones %.3f, %.3f\n", count, worst[0],
                  worst[1], worst_bright[0], worst_bright[1]);
    assert_true(count > 20);
    assert_true(worst[0] < 0.03 && worst[1] < 0.004);
    assert_true(worst_bright[0] < 0.025 && worst_bright[1] < 0.003);
}

/* Oracle: energy: without absorption all that arrives comes back or passes. 1e-3 where a model keeps energy
 * itself (dipole totals of slabs do not). */
static void nothing_is_lost_without_absorption(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 1e-12, .sigma_s_prime_per_mm = 1.3, .eta = 1.4 };
    for (size_t m = 3; m < MODELS; m++) {
        const struct fit_form form = fit_form_of(models[m], &medium, INFINITY, 1);
        for (double thickness_mm = 0.5; thickness_mm < 40; thickness_mm *= 2) {
            const double sum = total_of(&form, IO_TOTAL_REFLECTANCE, thickness_mm) +
                               total_of(&form, IO_TOTAL_TRANSMITTANCE, thickness_mm);
            assert_close(sum, 1, 1e-6, "model %d, %g mm", (int)models[m], thickness_mm);
        }
    }
}

/* Values at logs. */
static void evaluate(const struct fit_target *target, const struct fit_form *form, const double *logs,
                     double *values, double *gradients)
{
    double *const scratch = malloc(PARTS * target->node_count * sizeof *scratch);
    assert_non_null(scratch);
    assert_true(fit_target_evaluate(target, form, 0, logs, scratch, values, gradients));
    free(scratch);
}

/* Oracle: differences of the values at four points, of the fourth order in a step of 1e-3. Values err by
 * 1e-10 of the largest, differences by 1e-7 of it; 1e-6 leaves room. */
static void check_gradients(const struct fit_target *target, const struct fit_form *form)
{
    static const double step = 1e-3;
    static const double places[] = { -2, -1, 1, 2 }, weights[] = { 1, -8, 8, -1 };
    const size_t count = target->row_node_count;
    double *const values = malloc((3 + PARTS) * count * sizeof *values);
    assert_non_null(values);
    double *const moved = values + count, *const slopes = moved + count, *const gradients = slopes + count;
    double logs[FIT_COEFFICIENT_COUNT], largest = 0;
    fit_form_start(form, 0, logs);
    evaluate(target, form, logs, values, gradients);
    evaluate(target, form, logs, moved, NULL);
    for (size_t k = 0; k < count; k++) {
        assert_true(fabs(moved[k] - values[k]) <= 1e-12 * fabs(values[k]));
        largest = fmax(largest, fabs(values[k]));
    }
    for (size_t p = 0; p < FIT_COEFFICIENT_COUNT; p++) {
        const double at = logs[p];
        memset(slopes, 0, count * sizeof *slopes);
        for (int i = 0; i < 4; i++) {
            logs[p] = at + places[i] * step;
            evaluate(target, form, logs, moved, NULL);
            for (size_t k = 0; k < count; k++)
                slopes[k] += weights[i] * moved[k] / (12 * step);
        }
        logs[p] = at;
        for (size_t k = 0; k < count; k++) {
            const double found = gradients[p * count + k];
            if (!(fabs(found - slopes[k]) < 1e-6 * largest))
                print_error("model %d, parameter %zu, row %zu: %.9g, expected %.9g\n", (int)form->model, p,
                            k, found, slopes[k]);
            assert_true(fabs(found - slopes[k]) < 1e-6 * largest);
        }
    }
    free(values);
}

static void gradients_of_profiles_are_slopes(void **state)
{
    (void)state;
    static const double r_mm[NODES] = { 0.05, 0.3, 0.7, 1.5, 3, 6 };
    struct rng rng = { .seed = 61 };
    for (int trial = 0; trial < 10; trial++) {
        const struct fit_target target = { .node_count = NODES,
                                           .row_node_count = NODES,
                                           .node_r_mm = r_mm };
        const dipole_medium medium = { .sigma_a_per_mm = log_uniform(&rng, 1e-3, 1),
                                       .sigma_s_prime_per_mm = log_uniform(&rng, 0.3, 3),
                                       .eta = uniform(&rng, 1, 1.6) };
        const dipole_medium other = { .sigma_a_per_mm = 0.1, .sigma_s_prime_per_mm = 2, .eta = medium.eta };
        struct fit_form form = fit_form_of(models[trial % MODELS], &medium, INFINITY, 1);
        check_gradients(&target, &form);
        if (trial % MODELS < 2)
            continue;
        form = fit_form_of(models[trial % MODELS], &medium, 5, 1);
        form.layer_count = 2;
        form.layers[0][1] = (dipole_layer){ .medium = other, .thickness_mm = INFINITY };
        form.is_thickness_sought = trial % 2;
        check_gradients(&target, &form);
    }
}

static void gradients_of_totals_are_slopes(void **state)
{
    (void)state;
    struct rng rng = { .seed = 62 };
    struct io_total totals[TOTALS];
    for (int trial = 0; trial < 10; trial++) {
        const dipole_medium medium = { .sigma_a_per_mm = log_uniform(&rng, 1e-3, 1),
                                       .sigma_s_prime_per_mm = log_uniform(&rng, 0.3, 3),
                                       .eta = uniform(&rng, 1, 1.6) };
        const bool does_slabs = trial % MODELS >= 2;
        struct fit_form form = fit_form_of(models[trial % MODELS], &medium, INFINITY, 1);
        size_t count = 0;
        for (int kind = 0; kind < IO_TOTAL_KIND_COUNT; kind++) {
            const bool is_far = kind == IO_TOTAL_DIFFUSE_TRANSMITTANCE || kind == IO_TOTAL_TRANSMITTANCE;
            if (!is_far)
                totals[count++] =
                    (struct io_total){ .kind = (enum io_total_kind)kind, .thickness_mm = INFINITY };
            if (does_slabs)
                totals[count++] = (struct io_total){ .kind = (enum io_total_kind)kind,
                                                     .thickness_mm = uniform(&rng, 2, 6) };
        }
        const struct fit_target target = target_of_totals(totals, count);
        check_gradients(&target, &form);
        /* a thickness that is sought elsewhere is not theirs */
        if (does_slabs) {
            form.layers[0][0].thickness_mm = 1.5;
            form.is_thickness_sought = true;
            check_gradients(&target, &form);
        }
    }
}

/* Oracle: the matrix product, of values and of gradients. */
static void a_blur_is_a_matrix(void **state)
{
    (void)state;
    static const double r_mm[NODES] = { 0.05, 0.3, 0.7, 1.5, 3, 6 };
    struct rng rng = { .seed = 63 };
    enum { ROWS = 4 };
    double blur[ROWS * NODES], nodes[PARTS * NODES], rows[PARTS * ROWS], logs[FIT_COEFFICIENT_COUNT];
    for (size_t i = 0; i < ROWS * NODES; i++)
        blur[i] = uniform(&rng, -1, 1);
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    struct fit_target target = { .node_count = NODES, .row_node_count = NODES, .node_r_mm = r_mm };
    fit_form_start(&form, 0, logs);
    evaluate(&target, &form, logs, nodes, nodes + NODES);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        target.blur[c] = blur;
    target.row_node_count = ROWS;
    evaluate(&target, &form, logs, rows, rows + ROWS);
    for (size_t part = 0; part < PARTS; part++) {
        for (size_t i = 0; i < ROWS; i++) {
            double expected = 0;
            for (size_t k = 0; k < NODES; k++)
                expected += blur[i * NODES + k] * nodes[part * NODES + k];
            assert_close(rows[part * ROWS + i], expected, 1e-13, "part %zu, row %zu", part, i);
        }
    }
}

/* Oracle: form.h: the start is the form's own, where it is 0 1e-9 of the other coefficient. */
static void a_form_begins_at_its_layers(void **state)
{
    (void)state;
    const dipole_medium clear = { .sigma_a_per_mm = 0, .sigma_s_prime_per_mm = 2, .eta = 1.3 };
    struct fit_form form = fit_form_of(DIPOLE_MODEL_MULTIPOLE, &clear, 3, 1);
    double logs[FIT_COEFFICIENT_COUNT];
    form.layer_count = 2;
    form.layers[0][1] = (dipole_layer){ .medium = fit_marble_red, .thickness_mm = INFINITY };
    form.layers[0][1].medium.eta = 1.3;
    fit_form_start(&form, 0, logs);
    assert_close(exp(logs[FIT_SIGMA_A]), 2e-9, 1e-12, "sigma_a");
    assert_close(exp(logs[FIT_SIGMA_S_PRIME]), 2, 1e-14, "sigma_s'");
    assert_close(exp(logs[FIT_THICKNESS]), 3, 1e-14, "thickness");
    form.layer = 1;
    fit_form_start(&form, 0, logs);
    assert_close(exp(logs[FIT_SIGMA_A]), fit_marble_red.sigma_a_per_mm, 1e-14, "sigma_a");
    /* only the sought layer changes */
    dipole_stack *stack;
    logs[FIT_SIGMA_A] = log(0.5);
    logs[FIT_THICKNESS] = log(7);
    assert_true(fit_form_stack_create(&form, 0, logs, &stack, NULL));
    assert_close(dipole_stack_layer(stack, 1)->medium.sigma_a_per_mm, 0.5, 1e-14, "sigma_a");
    assert_true(dipole_stack_layer(stack, 0)->medium.sigma_a_per_mm == 0);
    assert_true(isinf(dipole_stack_layer(stack, 1)->thickness_mm));
    dipole_stack_destroy(stack);
    form.layer = 0;
    form.is_thickness_sought = true;
    assert_true(fit_form_stack_create(&form, 0, logs, &stack, NULL));
    assert_close(dipole_stack_layer(stack, 0)->thickness_mm, 7, 1e-14, "thickness");
    dipole_stack_destroy(stack);
    /* no value there */
    const double r_mm = 1;
    const struct fit_target target = { .node_count = 1, .row_node_count = 1, .node_r_mm = &r_mm };
    double value;
    logs[FIT_SIGMA_A] = log(1e60);
    assert_false(fit_target_evaluate(&target, &form, 0, logs, NULL, &value, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(totals_agree_with_adding_doubling),
        cmocka_unit_test(nothing_is_lost_without_absorption),
        cmocka_unit_test(gradients_of_profiles_are_slopes),
        cmocka_unit_test(gradients_of_totals_are_slopes),
        cmocka_unit_test(a_blur_is_a_matrix),
        cmocka_unit_test(a_form_begins_at_its_layers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
