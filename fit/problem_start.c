#include "fit/problem_internal.h"

#include <math.h>
#include <string.h>

/* The normal equations of gain, ambient and black in one block. */
enum { LINEAR_COUNT = 3 };
struct linear {
    double matrix[LINEAR_COUNT][LINEAR_COUNT], right[LINEAR_COUNT], square;
    bool is_free[LINEAR_COUNT];
};

static void linear_add(struct linear *linear, const struct fit_row_sums *sums)
{
    const double columns[LINEAR_COUNT] = { sums->nodes + sums->constant, sums->ambient, sums->black };
    double rest = sums->value - (linear->is_free[0] ? 0 : columns[0]);
    for (int i = 0; i < LINEAR_COUNT; i++) {
        for (int k = 0; k < LINEAR_COUNT; k++)
            linear->matrix[i][k] += columns[i] * columns[k];
        linear->right[i] += columns[i] * rest;
    }
    linear->square += rest * rest;
}

/* Minimises over the free columns by elimination; what is not free, or says nothing new, stays 0. */
static double linear_solve(const struct linear *linear, double found[LINEAR_COUNT])
{
    double m[LINEAR_COUNT][LINEAR_COUNT + 1];
    double cost = linear->square;
    for (int i = 0; i < LINEAR_COUNT; i++) {
        memcpy(m[i], linear->matrix[i], sizeof linear->matrix[i]);
        m[i][LINEAR_COUNT] = linear->right[i];
        found[i] = 0;
    }
    bool is_taken[LINEAR_COUNT] = { false };
    for (int i = 0; i < LINEAR_COUNT; i++) {
        is_taken[i] = linear->is_free[i] && m[i][i] > 1e-9 * linear->matrix[i][i];
        if (!is_taken[i])
            continue;
        cost -= m[i][LINEAR_COUNT] * m[i][LINEAR_COUNT] / m[i][i];
        for (int k = i + 1; k < LINEAR_COUNT; k++) {
            const double share = m[k][i] / m[i][i];
            for (int j = i; j <= LINEAR_COUNT; j++)
                m[k][j] -= share * m[i][j];
        }
    }
    for (int i = LINEAR_COUNT - 1; i >= 0; i--) {
        if (!is_taken[i])
            continue;
        double rest = m[i][LINEAR_COUNT];
        for (int k = i + 1; k < LINEAR_COUNT; k++)
            rest -= m[i][k] * found[k];
        found[i] = rest / m[i][i];
    }
    return fmax(cost, 0);
}

static double block_cost(const struct fit_problem *problem, const struct fit_block *block,
                         struct fit_state *found)
{
    struct linear linear = { .is_free = {
                                 block->target->is_gain_free ||
                                     (problem->is_balance_free && block->target->is_coloured_by_camera),
                                 block->target->is_ambient_free, block->target->is_black_free } };
    struct fit_row_sums sums;
    if (!fit_block_evaluate(problem, block, found->logs, false))
        return INFINITY;
    struct fit_block_cursor cursor = { 0 };
    while (fit_block_next(block, false, &cursor, &sums))
        linear_add(&linear, &sums);
    double values[LINEAR_COUNT];
    double cost = linear_solve(&linear, values);
    if (linear.is_free[1] && values[1] < 0) { /* there is no negative light */
        linear.is_free[1] = false;
        cost = linear_solve(&linear, values);
    }
    found->gain = linear.is_free[0] ? values[0] : 1;
    found->ambient = values[1];
    found->black = values[2];
    return linear.is_free[0] && !(values[0] > 0) ? INFINITY : cost;
}

double fit_problem_channel_cost(const struct fit_problem *problem, int channel,
                                const double logs[FIT_COEFFICIENT_COUNT],
                                struct fit_state found[FIT_TARGET_LIMIT])
{
    double cost = 0;
    for (size_t b = 0; b < problem->block_count; b++) {
        if (problem->blocks[b].channel != channel)
            continue;
        struct fit_state *const state = &found[problem->blocks[b].target_index];
        memcpy(state->logs, logs, sizeof state->logs);
        cost += block_cost(problem, &problem->blocks[b], state);
    }
    return cost;
}

void fit_problem_parameters(const struct fit_problem *problem,
                            double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT], double *parameters)
{
    const struct fit_layout *const layout = &problem->layout;
    memcpy(parameters, problem->start, layout->parameter_count * sizeof *parameters);
    double gains[FIT_TARGET_LIMIT][FIT_CHANNEL_COUNT] = { { 0 } }, balances[FIT_CHANNEL_COUNT] = { 0 };
    double log_gains[FIT_TARGET_LIMIT] = { 0 }, counts[FIT_TARGET_LIMIT] = { 0 };
    double camera_count = 0;
    for (int c = 0; c < problem->form.channel_count; c++) {
        struct fit_state found[FIT_TARGET_LIMIT] = { 0 };
        if (!problem->has_light[c])
            continue;
        for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++) {
            if (layout->coefficient[c][p] >= 0)
                parameters[layout->coefficient[c][p]] = logs[c][p];
        }
        if (!isfinite(fit_problem_channel_cost(problem, c, logs[c], found)))
            continue;
        for (size_t t = 0; t < problem->target_count; t++) {
            const struct fit_target *const target = &problem->targets[t];
            if (!(target->value_scale[c] > 0))
                continue;
            gains[t][c] = log(found[t].gain);
            log_gains[t] += gains[t][c];
            counts[t] += 1;
            if (layout->ambient[t][c] >= 0)
                parameters[layout->ambient[t][c]] = found[t].ambient / target->ambient_scale[c];
            if (layout->black[t][c] >= 0)
                parameters[layout->black[t][c]] = found[t].black / target->value_scale[c];
        }
    }
    for (size_t t = 0; t < problem->target_count; t++) {
        const bool has_middle = problem->is_balance_free && problem->targets[t].is_coloured_by_camera &&
                                problem->targets[t].value_scale[1] > 0;
        const double log_gain = has_middle ? gains[t][1] : log_gains[t] / fmax(counts[t], 1);
        if (layout->gain[t] >= 0)
            parameters[layout->gain[t]] = log_gain;
        if (!problem->targets[t].is_coloured_by_camera)
            continue;
        camera_count += 1;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            balances[c] += gains[t][c] - (layout->gain[t] >= 0 ? log_gain : 0);
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (layout->balance[c] >= 0)
            parameters[layout->balance[c]] = balances[c] / fmax(camera_count, 1);
    }
    for (size_t p = 0; p < layout->parameter_count; p++)
        parameters[p] = fmin(fmax(parameters[p], problem->lower[p]), problem->upper[p]);
}
