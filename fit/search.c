#include "fit/search.h"

#include "fit/noise.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { GRID_SIDE = 8, GRID_ALBEDO_COUNT = 6 };

/* Passes end when no coefficient moves by more than this: far below any interval. */
static const double settled_log = 1e-4;

/* ---- starts ------------------------------------------------------------------------------------------ */

struct candidate {
    double logs[FIT_COEFFICIENT_COUNT];
    double cost;
};

/* Keep the best candidates, best first. */
static void candidate_insert(struct candidate *best, size_t count, const struct candidate *candidate)
{
    struct candidate moving = *candidate;
    for (size_t i = 0; i < count; i++) {
        if (moving.cost < best[i].cost) {
            const struct candidate pushed = best[i];
            best[i] = moving;
            moving = pushed;
        }
    }
}

static double within(const struct fit_problem *problem, int parameter, double value)
{
    return fmin(fmax(value, problem->lower[parameter]), problem->upper[parameter]);
}

/* The given start, and the best few of a coarse grid over the whole range, of each channel for itself: one
 * search costs milliseconds, a wrong valley costs the answer. */
static void choose_starts(const struct fit_problem *problem, int channel, int start_count,
                          struct candidate starts[FIT_SEARCH_START_LIMIT])
{
    static const double grid_albedos[GRID_ALBEDO_COUNT] = { 0.9999, 0.995, 0.9, 0.5, 0.1, 0.02 };
    const int *const at = problem->layout.coefficient[channel];
    struct fit_state found[FIT_TARGET_LIMIT];
    for (size_t i = 0; i < FIT_SEARCH_START_LIMIT; i++) {
        fit_form_start(&problem->form, channel, starts[i].logs);
        for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++) {
            if (at[p] >= 0)
                starts[i].logs[p] = within(problem, at[p], starts[i].logs[p]);
        }
        starts[i].cost = INFINITY;
    }
    if (start_count == 1)
        return;
    double longest_mm = 0;
    for (size_t t = 0; t < problem->target_count; t++)
        longest_mm = fmax(longest_mm, problem->targets[t].largest_mm);
    const double lowest = log(3 / longest_mm), highest = problem->upper[at[FIT_SIGMA_S_PRIME]];
    for (int i = 0; i < GRID_SIDE; i++) {
        const double share = (i + 0.5) / GRID_SIDE;
        const double log_sigma_t = (1 - share) * lowest + share * highest;
        for (int k = 0; k < GRID_ALBEDO_COUNT; k++) {
            struct candidate candidate = starts[0];
            candidate.logs[FIT_SIGMA_A] =
                within(problem, at[FIT_SIGMA_A], log_sigma_t + log1p(-grid_albedos[k]));
            candidate.logs[FIT_SIGMA_S_PRIME] =
                within(problem, at[FIT_SIGMA_S_PRIME], log_sigma_t + log(grid_albedos[k]));
            candidate.cost = fit_problem_channel_cost(problem, channel, candidate.logs, found);
            candidate_insert(starts + 1, FIT_SEARCH_START_LIMIT - 1, &candidate);
        }
    }
}

/* ---- searches ---------------------------------------------------------------------------------------- */

static void log_search(struct fit_search_log *log, const char *name, int number,
                       const struct fit_minimum *minimum)
{
    if (!log)
        return;
    snprintf(log->searches[log->count].name, sizeof log->searches[0].name, "%s %d", name, number);
    log->searches[log->count].count = minimum->history_count;
    memcpy(log->searches[log->count].sum_of_squares, minimum->history, sizeof minimum->history);
    log->count++;
}

static void least_squares_of(const struct fit_problem *problem, const volatile sig_atomic_t *stop,
                             struct fit_least_squares *out)
{
    *out = (struct fit_least_squares){ .residuals = fit_problem_residuals,
                                       .context = problem,
                                       .residual_count = fit_problem_residual_count(problem),
                                       .parameter_count = problem->layout.parameter_count,
                                       .stop = stop };
    memcpy(out->lower, problem->lower, sizeof out->lower);
    memcpy(out->upper, problem->upper, sizeof out->upper);
}

static bool is_stopped(const volatile sig_atomic_t *stop)
{
    return stop && *stop;
}

/* Of each channel the coefficients that fit it best, whichever start they came from. */
static void keep_best_of_channels(const struct fit_problem *problem, const double *parameters,
                                  struct candidate best[FIT_CHANNEL_COUNT])
{
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        struct fit_state state, found[FIT_TARGET_LIMIT];
        struct candidate candidate;
        if (!problem->has_light[c])
            continue;
        fit_problem_state(problem, 0, c, parameters, &state);
        memcpy(candidate.logs, state.logs, sizeof candidate.logs);
        candidate.cost = fit_problem_channel_cost(problem, c, candidate.logs, found);
        if (candidate.cost < 0.999 * best[c].cost)
            best[c] = candidate;
    }
}

/* From the best of each channel: one start may end in the right valley for one channel and in a wrong one
 * for another. */
static bool search_from_channels(const struct fit_problem *problem, const struct fit_least_squares *squares,
                                 const struct candidate channels[FIT_CHANNEL_COUNT],
                                 struct fit_search_log *log, struct fit_minimum *best,
                                 dipole_status *status)
{
    double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT] = { { 0 } }, parameters[FIT_PARAMETER_LIMIT];
    struct fit_minimum minimum;
    double cost = 0;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (!problem->has_light[c])
            continue;
        memcpy(logs[c], channels[c].logs, sizeof logs[c]);
        cost += channels[c].cost;
    }
    if (!(cost < 0.999 * best->sum_of_squares))
        return true;
    fit_problem_parameters(problem, logs, parameters);
    if (!fit_least_squares_solve(squares, parameters, &minimum, status))
        return !status || status->code != DIPOLE_OUT_OF_MEMORY;
    log_search(log, "channels", 1, &minimum);
    minimum.iteration_count += best->iteration_count;
    if (minimum.sum_of_squares < 0.999 * best->sum_of_squares)
        *best = minimum;
    return true;
}

/* From every start; what has no value there is passed over. */
static bool search_from_starts(const struct fit_problem *problem, int start_count,
                               const struct fit_least_squares *squares, struct fit_search_log *log,
                               struct fit_minimum *best, dipole_status *status)
{
    struct candidate starts[FIT_CHANNEL_COUNT][FIT_SEARCH_START_LIMIT];
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (problem->has_light[c])
            choose_starts(problem, c, start_count, starts[c]);
    }
    struct candidate channels[FIT_CHANNEL_COUNT] = { { .cost = INFINITY },
                                                     { .cost = INFINITY },
                                                     { .cost = INFINITY } };
    bool has_found = false;
    int iteration_count = 0;
    for (int i = 0; i < start_count && !(has_found && is_stopped(squares->stop)); i++) {
        double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT], parameters[FIT_PARAMETER_LIMIT];
        struct fit_minimum minimum;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            if (problem->has_light[c])
                memcpy(logs[c], starts[c][i].logs, sizeof logs[c]);
        }
        fit_problem_parameters(problem, logs, parameters);
        if (!fit_least_squares_solve(squares, parameters, &minimum, status)) {
            if (status && status->code == DIPOLE_OUT_OF_MEMORY)
                return false;
            continue;
        }
        log_search(log, "start", i + 1, &minimum);
        iteration_count += minimum.iteration_count;
        keep_best_of_channels(problem, minimum.parameters, channels);
        /* of equal minima the first, so that the given start decides where the targets cannot */
        if (!has_found || minimum.sum_of_squares < 0.999 * best->sum_of_squares)
            *best = minimum;
        has_found = true;
    }
    best->iteration_count = iteration_count;
    if (!has_found || start_count == 1 || is_stopped(squares->stop))
        return has_found;
    return search_from_channels(problem, squares, channels, log, best, status);
}

static double largest_move(const struct fit_problem *problem, const double *from, const double *to)
{
    double largest = 0;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++) {
            const int at = problem->layout.coefficient[c][p];
            if (at >= 0)
                largest = fmax(largest, fabs(to[at] - from[at]));
        }
    }
    return largest;
}

static bool search_with_new_weights(struct fit_problem *problem, const struct fit_least_squares *squares,
                                    struct fit_search_log *log, struct fit_minimum *best,
                                    dipole_status *status)
{
    for (int pass = 1; pass <= FIT_SEARCH_PASS_LIMIT && !is_stopped(squares->stop); pass++) {
        struct fit_minimum minimum;
        if (!fit_noise_reweigh(problem, best->parameters) || !fit_problem_fold(problem, status) ||
            !fit_least_squares_solve(squares, best->parameters, &minimum, status))
            return false;
        log_search(log, "weights", pass, &minimum);
        const double moved = largest_move(problem, best->parameters, minimum.parameters);
        minimum.iteration_count += best->iteration_count;
        *best = minimum;
        if (moved < settled_log)
            break;
    }
    return true;
}

bool fit_search(struct fit_problem *problem, bool is_warm, const volatile sig_atomic_t *stop,
                struct fit_search_log *log, struct fit_minimum *out, dipole_status *status)
{
    struct fit_least_squares squares;
    if (log)
        log->count = 0;
    if (!fit_problem_fold(problem, status))
        return false;
    least_squares_of(problem, stop, &squares);
    const bool done =
        search_from_starts(problem, is_warm ? 1 : FIT_SEARCH_START_LIMIT, &squares, log, out, status) &&
        search_with_new_weights(problem, &squares, log, out, status);
    if (done && is_stopped(stop))
        out->has_converged = false;
    return done;
}
