#include "fit/certainty.h"

#include <math.h>
#include <string.h>

/* Below this half-width, in the logarithm, the sum of squares is as good as quadratic. */
static const double quadratic_log_half_width = 0.1;
/* Ends are found to this part of their distance from the value. */
static const double end_tolerance = 0.02;

enum { HELD_ITERATIONS = 25, HELD_ATTEMPTS = 4, HALVINGS = 12 };

/* Least sum of squares with one parameter held, or any that is allowed. The search begins where the others
 * would go if all were linear, which along the valley of a poor problem is far from where they are. */
static double held_cost(const struct fit_certainty *certainty, struct fit_least_squares *squares,
                        int parameter, double value, double allowed)
{
    const size_t n = certainty->problem->layout.parameter_count, i = (size_t)parameter;
    const double *const at = certainty->minimum->parameters;
    struct fit_minimum minimum;
    double parameters[FIT_PARAMETER_LIMIT], before = INFINITY;
    for (size_t k = 0; k < n; k++) {
        const double slope = certainty->inverse[k * n + i] / certainty->inverse[i * n + i];
        const double moved = at[k] + (isfinite(slope) ? slope * (value - at[i]) : 0);
        parameters[k] = fmin(fmax(moved, squares->lower[k]), squares->upper[k]);
    }
    parameters[i] = value;
    for (int attempt = 0; attempt < HELD_ATTEMPTS; attempt++) {
        if (!fit_least_squares_solve(squares, parameters, &minimum, NULL))
            return INFINITY;
        if (minimum.has_converged || minimum.sum_of_squares <= allowed ||
            minimum.sum_of_squares > 0.9 * before)
            break;
        before = minimum.sum_of_squares;
        memcpy(parameters, minimum.parameters, n * sizeof *parameters);
    }
    return minimum.sum_of_squares;
}

/*
 * The end of an interval where the sum of squares, all else as good as it can be, has risen as much as it
 * does over the interval of the covariance where it is quadratic. A bound that is met before is the end.
 */
static double end_of_interval(const struct fit_certainty *certainty, int parameter, int side)
{
    const struct fit_problem *const problem = certainty->problem;
    const size_t n = problem->layout.parameter_count, i = (size_t)parameter;
    const double variance = certainty->covariance[i * n + i], inverse = certainty->inverse[i * n + i];
    const double bound = side == 0 ? problem->lower[i] : problem->upper[i];
    const double rise = certainty->quantile * certainty->quantile * variance / inverse;
    if (!isfinite(variance) || !isfinite(rise))
        return bound;
    struct fit_least_squares squares = { .residuals = fit_problem_residuals,
                                         .context = problem,
                                         .residual_count = fit_problem_residual_count(problem),
                                         .parameter_count = n,
                                         .iteration_limit = HELD_ITERATIONS,
                                         .stop = certainty->stop };
    memcpy(squares.lower, problem->lower, sizeof squares.lower);
    memcpy(squares.upper, problem->upper, sizeof squares.upper);
    squares.is_held[i] = true;
    const double allowed = certainty->minimum->sum_of_squares + rise;
    double inside = certainty->minimum->parameters[i], outside = inside;
    double step = fmin(fmax(certainty->quantile * sqrt(variance), 1e-6), 2);
    double outside_cost = certainty->minimum->sum_of_squares;
    while (outside != bound && outside_cost <= allowed) {
        inside = outside;
        outside += side == 0 ? -step : step;
        outside = side == 0 ? fmax(outside, bound) : fmin(outside, bound);
        outside_cost = held_cost(certainty, &squares, parameter, outside, allowed);
        step *= 2;
    }
    if (outside_cost <= allowed)
        return bound;
    const double at = certainty->minimum->parameters[i];
    for (int k = 0; k < HALVINGS && fabs(outside - inside) > end_tolerance * fabs(outside - at); k++) {
        /* a parabola through the minimum would meet the level here; halving keeps it safe */
        const double reach = sqrt(rise / fmax(outside_cost - certainty->minimum->sum_of_squares, rise));
        double middle = k % 2 == 0 ? at + (outside - at) * reach : 0.5 * (inside + outside);
        if ((middle - inside) * (middle - outside) >= 0)
            middle = 0.5 * (inside + outside);
        const double cost = held_cost(certainty, &squares, parameter, middle, allowed);
        if (cost > allowed) {
            outside = middle;
            outside_cost = cost;
        } else {
            inside = middle;
        }
    }
    return outside;
}

static bool is_at_bound(const struct fit_problem *problem, int parameter, double value)
{
    const double reach = 1e-6 * (problem->upper[parameter] - problem->lower[parameter]);
    return value - problem->lower[parameter] < reach || problem->upper[parameter] - value < reach;
}

struct fit_interval fit_certainty_of_logarithm(const struct fit_certainty *certainty, int parameter,
                                               bool is_nuisance)
{
    const struct fit_problem *const problem = certainty->problem;
    const size_t n = problem->layout.parameter_count, i = (size_t)parameter;
    const double value = certainty->minimum->parameters[i];
    const double half_width = certainty->quantile * sqrt(certainty->covariance[i * n + i]);
    double ends[2] = { value - half_width, value + half_width };
    const bool is_quick = is_nuisance || certainty->is_quick || (certainty->stop && *certainty->stop);
    if (!is_quick && (!(half_width < quadratic_log_half_width) || is_at_bound(problem, parameter, value))) {
        for (int side = 0; side < 2; side++)
            ends[side] = end_of_interval(certainty, parameter, side);
    }
    return (struct fit_interval){
        exp(value), { exp(fmax(ends[0], problem->lower[i])), exp(fmin(ends[1], problem->upper[i])) }
    };
}

struct fit_interval fit_certainty_of_number(const struct fit_certainty *certainty, int parameter,
                                            double unit)
{
    const size_t n = certainty->problem->layout.parameter_count, i = (size_t)parameter;
    const double value = certainty->minimum->parameters[i];
    const double half_width = certainty->quantile * sqrt(certainty->covariance[i * n + i]);
    const double low = fmax(value - half_width, certainty->problem->lower[i]);
    const double high = fmin(value + half_width, certainty->problem->upper[i]);
    return (struct fit_interval){ unit * value, { unit * low, unit * high } };
}
