#include "fit/profile.h"

#include "fit_targets.h"

enum { MODELS = 5, ROWS_MOST = 100 };

static const dipole_model models[MODELS] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE,
                                             DIPOLE_MODEL_MULTIPOLE, DIPOLE_MODEL_BEAM,
                                             DIPOLE_MODEL_MODES };

/* A profile in memory of the test. */
struct table {
    struct io_profile profile;
    double r_lo_mm[ROWS_MOST], r_hi_mm[ROWS_MOST], rd_per_mm2[ROWS_MOST], sem_per_mm2[ROWS_MOST];
};

static void table_init(struct table *table, size_t count, bool has_rings, bool has_sem)
{
    *table = (struct table){ .profile = { .count = count, .has_rings = has_rings } };
    table->profile.r_lo_mm = table->r_lo_mm;
    table->profile.r_hi_mm = table->r_hi_mm;
    table->profile.rd_per_mm2 = table->rd_per_mm2;
    table->profile.sem_per_mm2 = has_sem ? table->sem_per_mm2 : NULL;
}

static void target_of(const struct table *table, dipole_model model, struct fit_target *target,
                      void **memory)
{
    dipole_status status;
    if (!fit_profile_target(&table->profile, "profile", 0, model, target, memory, &status))
        fail_msg("%s", status.message);
}

/* The model's value of each datum. */
static void predict(const struct fit_target *target, const struct fit_form *form, double *values)
{
    double logs[FIT_COEFFICIENT_COUNT], *const nodes = malloc(target->node_count * sizeof *nodes);
    assert_non_null(nodes);
    fit_form_start(form, 0, logs);
    assert_true(fit_target_evaluate(target, form, 0, logs, NULL, nodes, NULL));
    for (size_t i = 0; i < target->datum_count; i++) {
        const struct fit_datum *const datum = &target->data[i];
        values[i] = datum->constant;
        for (size_t k = 0; k < datum->count; k++)
            values[i] += datum->factor * datum->row[k] * nodes[datum->first + k];
    }
    free(nodes);
}

/* Oracle: dipole_stack_ring_mean_per_mm2, by closed forms or by what the library knows to lie within radii,
 * over rings of equal width from r = 0 on. 1e-5 of rings up to five mean free paths wide; 1e-3 of a first
 * ring of twenty, over which the profile falls a thousandfold; and 1e-9 of the profile next to 0, which is
 * what the library errs by. */
static void ring_means_are_those_of_the_library(void **state)
{
    (void)state;
    const dipole_medium medium = { .sigma_a_per_mm = 0.05, .sigma_s_prime_per_mm = 0.95, .eta = 1.4 };
    static const double widths_mm[] = { 0.02, 0.2, 1, 2, 5, 20 };
    for (size_t m = 0; m < MODELS; m++) {
        const struct fit_form form = fit_form_of(models[m], &medium, INFINITY, 1);
        dipole_stack *stack;
        double logs[FIT_COEFFICIENT_COUNT];
        fit_form_start(&form, 0, logs);
        assert_true(fit_form_stack_create(&form, 0, logs, &stack, NULL));
        const double near_per_mm2 = dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT, 0, 0.1);
        for (size_t w = 0; w < sizeof widths_mm / sizeof *widths_mm; w++) {
            enum { RINGS = 12 };
            struct table table;
            struct fit_target target;
            void *memory;
            double found[RINGS], worst = 0, first = 0;
            table_init(&table, RINGS, true, false);
            for (size_t i = 0; i < RINGS; i++) {
                table.r_lo_mm[i] = widths_mm[w] * (double)i;
                table.r_hi_mm[i] = widths_mm[w] * (double)(i + 1);
                table.rd_per_mm2[i] = 1;
            }
            target_of(&table, models[m], &target, &memory);
            assert_int_equal(target.datum_count, RINGS);
            predict(&target, &form, found);
            for (size_t i = 0; i < RINGS; i++) {
                const double expected = dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT,
                                                                       table.r_lo_mm[i], table.r_hi_mm[i]);
                double *const most = i == 0 ? &first : &worst;
                *most = fmax(*most, fabs(found[i] - expected) / (expected + 1e-4 * near_per_mm2));
            }
            print_message("model %d, rings of %g mm: first %.2g, others %.2g\n", (int)models[m],
                          widths_mm[w], first, worst);
            assert_true(worst < 1e-5 && first < (widths_mm[w] > 5 ? 1e-3 : 1e-5));
            free(memory);
        }
        dipole_stack_destroy(stack);
    }
}

/* Oracle: the library's profile: points need no quadrature, and a ring without width is a point. */
static void points_are_points(void **state)
{
    (void)state;
    const struct fit_form form = fit_form_of(DIPOLE_MODEL_DIPOLE, &fit_marble_red, INFINITY, 1);
    dipole_coefficients coefficients;
    assert_true(dipole_coefficients_init(&fit_marble_red, &coefficients, NULL));
    for (int has_rings = 0; has_rings < 2; has_rings++) {
        struct table table;
        struct fit_target target;
        void *memory;
        double found[10];
        table_init(&table, 10, has_rings, false);
        for (size_t i = 0; i < 10; i++) {
            table.r_lo_mm[i] = table.r_hi_mm[i] = 0.3 * (double)i;
            table.rd_per_mm2[i] = 2 + (double)i;
        }
        target_of(&table, DIPOLE_MODEL_DIPOLE, &target, &memory);
        predict(&target, &form, found);
        for (size_t i = 0; i < 10; i++) {
            assert_close(found[i], dipole_rd_per_mm2(&coefficients, 0.3 * (double)i), 1e-14, "row %zu", i);
            assert_true(target.data[i].value == 2 + (double)i);
        }
        free(memory);
    }
}

/* Oracle: order: the same rows shuffled make the same target; a value stays with its radius. */
static void rows_may_come_in_any_order(void **state)
{
    (void)state;
    struct table sorted, shuffled;
    struct fit_target targets[2];
    void *memory[2];
    table_init(&sorted, 50, true, true);
    for (size_t i = 0; i < 50; i++) {
        sorted.r_lo_mm[i] = 0.1 * (double)i;
        sorted.r_hi_mm[i] = 0.1 * (double)(i + 1);
        sorted.rd_per_mm2[i] = exp(-0.2 * (double)i);
        sorted.sem_per_mm2[i] = 0.01 * sorted.rd_per_mm2[i] + 1e-4;
    }
    table_init(&shuffled, 50, true, true);
    for (size_t i = 0; i < 50; i++) {
        const size_t from = (i * 17 + 3) % 50;
        shuffled.r_lo_mm[i] = sorted.r_lo_mm[from];
        shuffled.r_hi_mm[i] = sorted.r_hi_mm[from];
        shuffled.rd_per_mm2[i] = sorted.rd_per_mm2[from];
        shuffled.sem_per_mm2[i] = sorted.sem_per_mm2[from];
    }
    target_of(&sorted, DIPOLE_MODEL_DIPOLE, &targets[0], &memory[0]);
    target_of(&shuffled, DIPOLE_MODEL_DIPOLE, &targets[1], &memory[1]);
    assert_int_equal(targets[1].datum_count, 50);
    assert_memory_equal(targets[0].node_r_mm, targets[1].node_r_mm, targets[0].node_count * sizeof(double));
    for (size_t i = 0; i < 50; i++) {
        assert_true(targets[0].data[i].value == targets[1].data[i].value);
        assert_true(targets[0].data[i].sigma == targets[1].data[i].sigma);
        assert_true(targets[0].data[i].tile == targets[1].data[i].tile);
        assert_in_range(targets[0].data[i].tile, 0, targets[0].tile_count - 1);
        assert_true(i == 0 || targets[0].data[i].tile >= targets[0].data[i - 1].tile);
    }
    assert_int_equal(targets[0].tile_count, 20);
    free(memory[0]);
    free(memory[1]);
}

/* Oracle: profile.h: stated errors are squared and meaned over neighbours; of rings that nothing hit, at
 * the end and in between, they are 0 and still must weigh finitely; without errors 1 % of the value about
 * it. */
static void every_row_has_an_error(void **state)
{
    (void)state;
    struct table table;
    struct fit_target target;
    void *memory;
    table_init(&table, 40, true, true);
    for (size_t i = 0; i < 40; i++) {
        table.r_lo_mm[i] = 0.1 * (double)i;
        table.r_hi_mm[i] = 0.1 * (double)(i + 1);
        table.rd_per_mm2[i] = i < 25 && i != 12 ? exp(-0.2 * (double)i) : 0;
        table.sem_per_mm2[i] = 0.01 * table.rd_per_mm2[i];
    }
    target_of(&table, DIPOLE_MODEL_DIPOLE, &target, &memory);
    assert_true(target.are_sigmas_stated);
    assert_true(target.systematic.scale == 0);
    for (size_t i = 0; i < 40; i++) {
        assert_true(target.data[i].sigma > 0 && isfinite(target.data[i].sigma));
        if (i >= 3 && i + 3 < 25) {
            double squares = 0;
            for (size_t k = i - 3; k <= i + 3; k++)
                squares += pow(table.sem_per_mm2[k], 2) / 7;
            assert_close(target.data[i].sigma, sqrt(squares), 1e-12, "row %zu", i);
        }
    }
    /* no row is surer than the surest that says so */
    assert_close(target.data[39].sigma, table.sem_per_mm2[24], 1e-12, "rows that nothing hit");
    free(memory);

    table.profile.sem_per_mm2 = NULL;
    target_of(&table, DIPOLE_MODEL_DIPOLE, &target, &memory);
    assert_false(target.are_sigmas_stated);
    assert_close(target.systematic.scale, 0.01, 1e-12, "scale");
    for (size_t i = 3; i + 3 < 25; i++) {
        double mean = 0;
        for (size_t k = i - 3; k <= i + 3; k++)
            mean += table.rd_per_mm2[k] / 7;
        assert_close(target.data[i].sigma, 0.01 * mean, 1e-12, "row %zu", i);
    }
    assert_true(target.data[39].sigma > 0);
    free(memory);

    /* all zero, all without error: still numbers */
    for (size_t i = 0; i < 40; i++)
        table.rd_per_mm2[i] = table.sem_per_mm2[i] = 0;
    table.profile.sem_per_mm2 = table.sem_per_mm2;
    target_of(&table, DIPOLE_MODEL_DIPOLE, &target, &memory);
    for (size_t i = 0; i < 40; i++)
        assert_true(target.data[i].sigma > 0 && isfinite(1 / target.data[i].sigma));
    free(memory);
}

/* Oracle: the pole of the beam model and the modes at r = 0: a point there has no value and is left out, a
 * ring that begins there is not. Fewer than two rows are refused, by name. */
static void a_point_at_a_pole_is_left_out(void **state)
{
    (void)state;
    struct table table;
    struct fit_target target;
    void *memory;
    dipole_status status;
    for (size_t m = 0; m < MODELS; m++) {
        const bool has_pole = models[m] == DIPOLE_MODEL_BEAM || models[m] == DIPOLE_MODEL_MODES;
        table_init(&table, 3, false, false);
        for (size_t i = 0; i < 3; i++) {
            table.r_lo_mm[i] = table.r_hi_mm[i] = (double)(2 - i);
            table.rd_per_mm2[i] = 1 + (double)i;
        }
        target_of(&table, models[m], &target, &memory);
        assert_int_equal(target.datum_count, has_pole ? 2 : 3);
        assert_true(target.data[0].value == (has_pole ? 2 : 3));
        assert_close(target.largest_mm, 2, 1e-14, "largest");
        free(memory);
        table.profile.count = 2;
        table.r_lo_mm[0] = table.r_hi_mm[0] = 0;
        const bool done =
            fit_profile_target(&table.profile, "thin.csv", 0, models[m], &target, &memory, &status);
        assert_true(done == !has_pole);
        if (!done) {
            assert_int_equal(status.code, DIPOLE_BAD_VALUE);
            assert_string_equal(status.source, "thin.csv");
            assert_non_null(strstr(status.message, "1 rows"));
            assert_null(memory);
        }
        free(memory);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ring_means_are_those_of_the_library), cmocka_unit_test(points_are_points),
        cmocka_unit_test(rows_may_come_in_any_order),          cmocka_unit_test(every_row_has_an_error),
        cmocka_unit_test(a_point_at_a_pole_is_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
