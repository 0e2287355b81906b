#include "check.h"
#include "fit/solve.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { COLUMNS = 7, ROWS = 50 };

/* Oracle: Pythagoras; reflections keep lengths. 1e-12: rounding of some hundred operations. */
static void folding_keeps_every_length(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    double rows[ROWS * COLUMNS], triangle[COLUMNS * COLUMNS] = { 0.0 };
    for (size_t i = 0; i < ROWS * COLUMNS; i++)
        rows[i] = uniform(&rng, -1.0, 1.0) * log_uniform(&rng, 1e-6, 1.0);
    /* in blocks of unequal size, one smaller than the triangle */
    assert_true(fit_triangle_fold(triangle, COLUMNS, rows, 31, NULL));
    assert_true(fit_triangle_fold(triangle, COLUMNS, rows + 31 * COLUMNS, 2, NULL));
    assert_true(fit_triangle_fold(triangle, COLUMNS, rows + 33 * COLUMNS, ROWS - 33, NULL));
    for (size_t i = 0; i < COLUMNS; i++) {
        for (size_t k = 0; k < i; k++)
            assert_true(triangle[i * COLUMNS + k] == 0.0);
    }
    for (int trial = 0; trial < 100; trial++) {
        double v[COLUMNS], long2 = 0.0, short2 = 0.0;
        for (size_t k = 0; k < COLUMNS; k++)
            v[k] = uniform(&rng, -1.0, 1.0);
        for (size_t i = 0; i < ROWS; i++) {
            double sum = 0.0;
            for (size_t k = 0; k < COLUMNS; k++)
                sum += rows[i * COLUMNS + k] * v[k];
            long2 += sum * sum;
        }
        for (size_t i = 0; i < COLUMNS; i++) {
            double sum = 0.0;
            for (size_t k = 0; k < COLUMNS; k++)
                sum += triangle[i * COLUMNS + k] * v[k];
            short2 += sum * sum;
        }
        assert_close(short2, long2, 1e-12, "trial %d", trial);
    }
}

/* y = exp(-a t) + b at 20 times, made with a = 2, b = 0.5. */
enum { TIMES = 20 };
static bool decay(const void *context, const double *parameters, double *residuals, double *jacobian)
{
    const double sign = *(const double *)context; /* -1 spoils the derivative */
    if (parameters[0] < 0.0)
        return false;
    for (int i = 0; i < TIMES; i++) {
        const double t = 0.1 * i;
        residuals[i] = exp(-parameters[0] * t) + parameters[1] - (exp(-2.0 * t) + 0.5);
        if (jacobian) {
            jacobian[2 * i] = -t * exp(-parameters[0] * t) * sign;
            jacobian[2 * i + 1] = 1.0;
        }
    }
    return true;
}

static struct fit_least_squares decay_problem(const double *sign)
{
    return (struct fit_least_squares){ .residuals = decay,
                                       .context = sign,
                                       .residual_count = TIMES,
                                       .parameter_count = 2,
                                       .lower = { -10.0, -10.0 },
                                       .upper = { 10.0, 10.0 } };
}

/* Oracle: the parameters that the data was made with. */
static void solver_finds_what_the_data_was_made_with(void **state)
{
    (void)state;
    const double sign = 1.0, start[] = { 0.1, -3.0 };
    const struct fit_least_squares problem = decay_problem(&sign);
    struct fit_minimum minimum;
    assert_true(fit_least_squares_solve(&problem, start, &minimum, NULL));
    assert_true(minimum.has_converged);
    assert_close(minimum.parameters[0], 2.0, 1e-8, "rate");
    assert_close(minimum.parameters[1], 0.5, 1e-8, "offset");
    assert_true(minimum.sum_of_squares < 1e-16);
}

/* Oracle: with b held at its bound the best a is that of the data, b being what it was made with. */
static void solver_stays_within_the_bounds(void **state)
{
    (void)state;
    const double sign = 1.0, start[] = { 0.5, 0.1 };
    struct fit_least_squares problem = decay_problem(&sign);
    problem.upper[0] = 1.5;
    struct fit_minimum minimum;
    assert_true(fit_least_squares_solve(&problem, start, &minimum, NULL));
    assert_true(minimum.has_converged);
    assert_close(minimum.parameters[0], 1.5, 1e-9, "rate at its bound");
    assert_true(minimum.parameters[1] < 0.5);
}

/* Oracle: the derivative worked out by hand, right and with a wrong sign. 1e-6: Ceres' default steps. */
static void jacobian_error_tells_right_from_wrong(void **state)
{
    (void)state;
    const double point[] = { 1.3, 0.2 }, right = 1.0, wrong = -1.0;
    struct fit_least_squares problem = decay_problem(&right);
    assert_true(fit_least_squares_jacobian_error(&problem, point) < 1e-6);
    problem = decay_problem(&wrong);
    assert_true(fit_least_squares_jacobian_error(&problem, point) > 1.0);
}

/* Oracle: solve.h; a start without a value is refused with a message. */
static void a_start_without_a_value_is_refused(void **state)
{
    (void)state;
    const double sign = 1.0, start[] = { -1.0, 0.0 };
    const struct fit_least_squares problem = decay_problem(&sign);
    struct fit_minimum minimum;
    dipole_status status;
    assert_false(fit_least_squares_solve(&problem, start, &minimum, &status));
    assert_int_equal(status.code, DIPOLE_NOT_CONVERGED);
}

/* Residuals that depend on the sum of the parameters alone. */
static bool only_the_sum(const void *context, const double *parameters, double *residuals, double *jacobian)
{
    (void)context;
    residuals[0] = parameters[0] + parameters[1] - 1.0;
    residuals[1] = 2.0 * residuals[0];
    for (int i = 0; jacobian && i < 4; i++)
        jacobian[i] = i < 2 ? 1.0 : 2.0;
    return true;
}

/* Oracle: every point with a + b = 1 is a minimum of 0; a problem of rank 1 must not end the process, and
 * nothing may be printed. */
static void a_problem_of_rank_one_is_survived_in_silence(void **state)
{
    (void)state;
    const struct fit_least_squares problem = { .residuals = only_the_sum,
                                               .residual_count = 2,
                                               .parameter_count = 2,
                                               .lower = { -9.0, -9.0 },
                                               .upper = { 9.0, 9.0 } };
    const double start[] = { 3.0, 3.0 };
    struct fit_minimum minimum;
    fflush(NULL);
    FILE *caught = tmpfile();
    assert_non_null(caught);
    const int kept[] = { dup(1), dup(2) };
    dup2(fileno(caught), 1);
    dup2(fileno(caught), 2);
    const bool done = fit_least_squares_solve(&problem, start, &minimum, NULL);
    fflush(NULL);
    for (int i = 0; i < 2; i++) {
        dup2(kept[i], i + 1);
        close(kept[i]);
    }
    assert_true(done && minimum.has_converged);
    assert_close(minimum.parameters[0] + minimum.parameters[1], 1.0, 1e-9, "sum");
    assert_int_equal(fseek(caught, 0, SEEK_END), 0);
    assert_int_equal(ftell(caught), 0);
    fclose(caught);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(folding_keeps_every_length),
        cmocka_unit_test(solver_finds_what_the_data_was_made_with),
        cmocka_unit_test(solver_stays_within_the_bounds),
        cmocka_unit_test(jacobian_error_tells_right_from_wrong),
        cmocka_unit_test(a_start_without_a_value_is_refused),
        cmocka_unit_test(a_problem_of_rank_one_is_survived_in_silence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
