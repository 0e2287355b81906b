#include "fit/problem_internal.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FOLD_ROWS = 512 };

/* A gain may be anything that a camera's units can make of it. */
static const double log_gain_limit = 46.0; /* 1e20 */
static const double thickness_factor_limit = 1e3;

/* ---- parameters -------------------------------------------------------------------------------------- */

static int add_parameter(struct fit_problem *problem, double start, double lower, double upper)
{
    const size_t i = problem->layout.parameter_count++;
    assert(i < FIT_PARAMETER_LIMIT);
    problem->start[i] = fmin(fmax(start, lower), upper);
    problem->lower[i] = lower;
    problem->upper[i] = upper;
    return (int)i;
}

/* A medium is worth considering when a target could show it: from mean free paths of finest_mm up to far
 * beyond the largest distance, and down to absorption that the longest path would not feel. */
static void add_coefficients(struct fit_problem *problem)
{
    double finest_mm = INFINITY, largest_mm = 0;
    for (size_t t = 0; t < problem->target_count; t++) {
        finest_mm = fmin(finest_mm, problem->targets[t].finest_mm);
        largest_mm = fmax(largest_mm, problem->targets[t].largest_mm);
    }
    const double lowest_a = fmax(1e-9 / largest_mm, DIPOLE_SIGMA_MIN_PER_MM);
    const double lowest_s = fmax(1e-3 / largest_mm, DIPOLE_SIGMA_MIN_PER_MM);
    const double highest = fmin(1 / finest_mm, DIPOLE_SIGMA_MAX_PER_MM);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        int *const at = problem->layout.coefficient[c];
        for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++)
            at[p] = -1;
        if (!problem->has_light[c])
            continue;
        double logs[FIT_COEFFICIENT_COUNT];
        fit_form_start(&problem->form, c, logs);
        at[FIT_SIGMA_A] = add_parameter(problem, logs[FIT_SIGMA_A], log(lowest_a), log(highest));
        at[FIT_SIGMA_S_PRIME] =
            add_parameter(problem, logs[FIT_SIGMA_S_PRIME], log(lowest_s), log(highest));
    }
    if (!problem->form.is_thickness_sought)
        return;
    const double start = log(problem->form.layers[0][problem->form.layer].thickness_mm);
    const double reach = log(thickness_factor_limit);
    const int at = add_parameter(problem, start, start - reach, start + reach);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        problem->layout.coefficient[c][FIT_THICKNESS] = at;
}

static void add_nuisances(struct fit_problem *problem)
{
    struct fit_layout *const layout = &problem->layout;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        const bool is_free = problem->is_balance_free && problem->form.channel_count > 1 && c != 1;
        layout->balance[c] = is_free && problem->has_light[c]
                                 ? add_parameter(problem, 0, -log_gain_limit, log_gain_limit)
                                 : -1;
    }
    for (size_t t = 0; t < problem->target_count; t++) {
        const struct fit_target *const target = &problem->targets[t];
        layout->gain[t] =
            target->is_gain_free ? add_parameter(problem, 0, -log_gain_limit, log_gain_limit) : -1;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            const bool has_data = target->value_scale[c] > 0 && problem->has_light[c];
            layout->ambient[t][c] = target->is_ambient_free && has_data && target->ambient_scale[c] > 0
                                        ? add_parameter(problem, 0, 0, 10)
                                        : -1;
            layout->black[t][c] = target->is_black_free && has_data ? add_parameter(problem, 0, -1, 1) : -1;
        }
    }
}

static double parameter_or(const double *parameters, int index, double otherwise)
{
    return index >= 0 ? parameters[index] : otherwise;
}

void fit_problem_state(const struct fit_problem *problem, size_t target, int channel,
                       const double *parameters, struct fit_state *out)
{
    const struct fit_layout *const layout = &problem->layout;
    fit_form_start(&problem->form, channel, out->logs);
    for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++)
        out->logs[p] = parameter_or(parameters, layout->coefficient[channel][p], out->logs[p]);
    const int balance = problem->targets[target].is_coloured_by_camera ? layout->balance[channel] : -1;
    out->gain =
        exp(parameter_or(parameters, layout->gain[target], 0) + parameter_or(parameters, balance, 0));
    out->ambient = parameter_or(parameters, layout->ambient[target][channel], 0) *
                   problem->targets[target].ambient_scale[channel];
    out->black = parameter_or(parameters, layout->black[target][channel], 0) *
                 problem->targets[target].value_scale[channel];
}

/* ---- blocks ------------------------------------------------------------------------------------------ */

static bool block_init(struct fit_block *block, struct fit_target *target, size_t index, int channel)
{
    *block = (struct fit_block){ .target = target, .target_index = index, .channel = channel };
    for (size_t i = 0; i < target->datum_count; i++)
        block->datum_count += target->data[i].channel == channel;
    const size_t column_count = target->row_node_count + FIT_BLOCK_EXTRA;
    const bool is_folded = block->datum_count > column_count && column_count > FIT_BLOCK_EXTRA;
    block->row_count = is_folded ? column_count : block->datum_count;
    block->nodes = calloc(target->row_node_count + 1, (1 + FIT_COEFFICIENT_COUNT) * sizeof(double));
    block->memory = calloc(1, sizeof *block->memory);
    block->scratch = calloc(target->node_count + 1, (1 + FIT_COEFFICIENT_COUNT) * sizeof(double));
    if (is_folded)
        block->rows = calloc(column_count, column_count * sizeof(double));
    return block->nodes && block->memory && block->scratch && (block->rows || !is_folded);
}

bool fit_problem_init(const struct fit_form *form, struct fit_target *targets, size_t target_count,
                      bool is_balance_free, struct fit_problem *out, dipole_status *status)
{
    assert(target_count > 0 && target_count <= FIT_TARGET_LIMIT);
    *out = (struct fit_problem){
        .form = *form, .targets = targets, .target_count = target_count, .is_balance_free = is_balance_free
    };
    for (int c = 0; c < form->channel_count; c++) {
        double logs[FIT_COEFFICIENT_COUNT];
        dipole_stack *stack = NULL;
        fit_form_start(form, c, logs);
        const bool is_legal = fit_form_stack_create(form, c, logs, &stack, status);
        dipole_stack_destroy(stack);
        if (!is_legal)
            return false;
        for (size_t t = 0; t < target_count; t++)
            out->has_light[c] = out->has_light[c] || targets[t].value_scale[c] > 0;
    }
    add_coefficients(out);
    add_nuisances(out);
    for (size_t t = 0; t < target_count; t++) {
        for (int c = 0; c < form->channel_count; c++) {
            if (!(targets[t].value_scale[c] > 0))
                continue;
            if (!block_init(&out->blocks[out->block_count++], &targets[t], t, c)) {
                fit_problem_destroy(out);
                return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the fit");
            }
        }
    }
    return true;
}

void fit_problem_destroy(struct fit_problem *problem)
{
    for (size_t b = 0; b < problem->block_count; b++) {
        free(problem->blocks[b].rows);
        free(problem->blocks[b].nodes);
        free(problem->blocks[b].scratch);
        free(problem->blocks[b].memory);
    }
    problem->block_count = 0;
}

static double weight_of(const struct fit_datum *datum)
{
    return sqrt(datum->robust) / datum->sigma;
}

/* One weighted row: what multiplies the nodes, and the extra columns. */
static void weighted_row(const struct fit_datum *datum, size_t row_node_count, double *row)
{
    const double weight = weight_of(datum), factor = weight * datum->factor;
    memset(row, 0, row_node_count * sizeof *row);
    for (size_t k = 0; k < datum->count; k++)
        row[datum->first + k] = factor * datum->row[k];
    row[row_node_count + FIT_BLOCK_CONSTANT] = weight * datum->constant;
    row[row_node_count + FIT_BLOCK_AMBIENT] = weight * datum->ambient_share;
    row[row_node_count + FIT_BLOCK_BLACK] = weight;
    row[row_node_count + FIT_BLOCK_VALUE] = weight * datum->value;
}

static bool block_fold(const struct fit_block *block, dipole_status *status)
{
    const size_t row_node_count = block->target->row_node_count;
    const size_t column_count = row_node_count + FIT_BLOCK_EXTRA;
    double *const rows = malloc(FOLD_ROWS * column_count * sizeof *rows);
    if (!rows)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the fit");
    memset(block->rows, 0, column_count * column_count * sizeof *rows);
    bool done = true;
    size_t count = 0;
    for (size_t i = 0; done && i < block->target->datum_count; i++) {
        const struct fit_datum *const datum = &block->target->data[i];
        if (datum->channel != block->channel || !(datum->robust > 0))
            continue;
        weighted_row(datum, row_node_count, rows + count++ * column_count);
        if (count == FOLD_ROWS) {
            done = fit_triangle_fold(block->rows, column_count, rows, count, status);
            count = 0;
        }
    }
    done = done && (count == 0 || fit_triangle_fold(block->rows, column_count, rows, count, status));
    free(rows);
    return done;
}

struct fold {
    struct fit_problem *problem;
    bool done[FIT_TARGET_LIMIT * FIT_CHANNEL_COUNT];
};

static void fold_one(void *context, int index)
{
    struct fold *const fold = context;
    const struct fit_block *const block = &fold->problem->blocks[index];
    fold->done[index] = !block->rows || block_fold(block, NULL);
}

bool fit_problem_fold(struct fit_problem *problem, dipole_status *status)
{
    struct fold fold = { .problem = problem };
    lut_parallel_for((int)problem->block_count, 0, fold_one, &fold);
    for (size_t b = 0; b < problem->block_count; b++) {
        if (!fold.done[b])
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the fit");
    }
    return true;
}

size_t fit_problem_residual_count(const struct fit_problem *problem)
{
    size_t count = 0;
    for (size_t b = 0; b < problem->block_count; b++)
        count += problem->blocks[b].row_count;
    return count;
}

/* ---- residuals --------------------------------------------------------------------------------------- */

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Row i of a block; of a triangle the part from its diagonal on. */
static void block_row(const struct fit_block *block, size_t i, bool has_gradients, struct fit_row_sums *out)
{
    const size_t count = block->target->row_node_count;
    const double *const row = block->rows + i * (count + FIT_BLOCK_EXTRA), *const extra = row + count;
    const size_t first = i < count ? i : count;
    out->nodes = dot(row + first, block->nodes + first, count - first);
    for (size_t p = 0; has_gradients && p < FIT_COEFFICIENT_COUNT; p++)
        out->gradients[p] = dot(row + first, block->nodes + (1 + p) * count + first, count - first);
    out->constant = extra[FIT_BLOCK_CONSTANT];
    out->ambient = extra[FIT_BLOCK_AMBIENT];
    out->black = extra[FIT_BLOCK_BLACK];
    out->value = extra[FIT_BLOCK_VALUE];
}

static void datum_row(const struct fit_block *block, const struct fit_datum *datum, double weight,
                      bool has_gradients, struct fit_row_sums *out)
{
    const size_t count = block->target->row_node_count;
    const double factor = weight * datum->factor;
    out->nodes = factor * dot(datum->row, block->nodes + datum->first, datum->count);
    for (size_t p = 0; has_gradients && p < FIT_COEFFICIENT_COUNT; p++)
        out->gradients[p] =
            factor * dot(datum->row, block->nodes + (1 + p) * count + datum->first, datum->count);
    out->constant = weight * datum->constant;
    out->ambient = weight * datum->ambient_share;
    out->black = weight;
    out->value = weight * datum->value;
}

bool fit_block_next(const struct fit_block *block, bool has_gradients, struct fit_block_cursor *cursor,
                    struct fit_row_sums *out)
{
    if (block->rows) {
        if (cursor->row == block->row_count)
            return false;
        block_row(block, cursor->row++, has_gradients, out);
        return true;
    }
    while (cursor->datum < block->target->datum_count) {
        const struct fit_datum *const datum = &block->target->data[cursor->datum++];
        if (datum->channel != block->channel)
            continue;
        datum_row(block, datum, weight_of(datum), has_gradients, out);
        return true;
    }
    return false;
}

static double model_of(const struct fit_row_sums *sums, const struct fit_state *state)
{
    return state->gain * (sums->nodes + sums->constant) + state->ambient * sums->ambient +
           state->black * sums->black;
}

/* Which parameters a row of a block depends on, and how. */
static void derivatives_of(const struct fit_problem *problem, const struct fit_block *block,
                           const struct fit_state *state, const struct fit_row_sums *sums,
                           struct fit_datum_model *out)
{
    const struct fit_layout *const layout = &problem->layout;
    const int c = block->channel;
    const size_t t = block->target_index;
    const int indices[FIT_DATUM_PARAMETER_LIMIT] = {
        layout->coefficient[c][FIT_SIGMA_A],
        layout->coefficient[c][FIT_SIGMA_S_PRIME],
        layout->coefficient[c][FIT_THICKNESS],
        layout->gain[t],
        block->target->is_coloured_by_camera ? layout->balance[c] : -1,
        layout->ambient[t][c],
        layout->black[t][c],
    };
    const double derivatives[FIT_DATUM_PARAMETER_LIMIT] = {
        state->gain * sums->gradients[FIT_SIGMA_A],   state->gain * sums->gradients[FIT_SIGMA_S_PRIME],
        state->gain * sums->gradients[FIT_THICKNESS], state->gain * (sums->nodes + sums->constant),
        state->gain * (sums->nodes + sums->constant), sums->ambient * block->target->ambient_scale[c],
        sums->black * block->target->value_scale[c],
    };
    out->parameter_count = 0;
    for (size_t p = 0; p < FIT_DATUM_PARAMETER_LIMIT; p++) {
        if (indices[p] < 0)
            continue;
        out->parameters[out->parameter_count] = indices[p];
        out->derivatives[out->parameter_count++] = derivatives[p];
    }
}

bool fit_block_evaluate(const struct fit_problem *problem, const struct fit_block *block,
                        const double logs[FIT_COEFFICIENT_COUNT], bool has_gradients)
{
    struct fit_block_memory *const memory = block->memory;
    bool is_known = memory->has_nodes && (memory->has_gradients || !has_gradients);
    for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++)
        is_known = is_known && memory->logs[p] == logs[p];
    if (is_known)
        return true;
    double *const gradients = has_gradients ? block->nodes + block->target->row_node_count : NULL;
    memory->has_nodes = fit_target_evaluate(block->target, &problem->form, block->channel, logs,
                                            block->scratch, block->nodes, gradients);
    memory->has_gradients = has_gradients;
    memcpy(memory->logs, logs, sizeof memory->logs);
    return memory->has_nodes;
}

static void write_residual(const struct fit_problem *problem, const struct fit_block *block,
                           const struct fit_state *state, const struct fit_row_sums *sums, double *residual,
                           double *jacobian)
{
    *residual = model_of(sums, state) - sums->value;
    if (!jacobian)
        return;
    struct fit_datum_model model;
    derivatives_of(problem, block, state, sums, &model);
    memset(jacobian, 0, problem->layout.parameter_count * sizeof *jacobian);
    for (int p = 0; p < model.parameter_count; p++)
        jacobian[model.parameters[p]] = model.derivatives[p];
}

static bool block_residuals(const struct fit_problem *problem, const struct fit_block *block,
                            const double *parameters, double *residuals, double *jacobian)
{
    const size_t stride = problem->layout.parameter_count;
    struct fit_state state;
    struct fit_row_sums sums;
    fit_problem_state(problem, block->target_index, block->channel, parameters, &state);
    /* derivatives are asked for at most points that values are asked for, and cost little more */
    if (!fit_block_evaluate(problem, block, state.logs, true))
        return false;
    struct fit_block_cursor cursor = { 0 };
    for (size_t i = 0; fit_block_next(block, jacobian != NULL, &cursor, &sums); i++)
        write_residual(problem, block, &state, &sums, &residuals[i],
                       jacobian ? jacobian + i * stride : NULL);
    return true;
}

bool fit_problem_residuals(const void *context, const double *parameters, double *residuals,
                           double *jacobian)
{
    const struct fit_problem *const problem = context;
    size_t at = 0;
    for (size_t b = 0; b < problem->block_count; b++) {
        const struct fit_block *const block = &problem->blocks[b];
        if (!block_residuals(problem, block, parameters, residuals + at,
                             jacobian ? jacobian + at * problem->layout.parameter_count : NULL))
            return false;
        at += block->row_count;
    }
    return true;
}

/* ---- datum by datum ---------------------------------------------------------------------------------- */

bool fit_problem_visit(struct fit_problem *problem, size_t target, int channel, const double *parameters,
                       fit_datum_visit *visit, void *context)
{
    for (size_t b = 0; b < problem->block_count; b++) {
        const struct fit_block *const block = &problem->blocks[b];
        if (block->target_index != target || block->channel != channel)
            continue;
        struct fit_state state;
        fit_problem_state(problem, target, channel, parameters, &state);
        if (!fit_block_evaluate(problem, block, state.logs, true))
            return false;
        for (size_t j = 0; j < block->target->datum_count; j++) {
            struct fit_datum *const datum = &block->target->data[j];
            struct fit_row_sums sums;
            struct fit_datum_model model;
            if (datum->channel != channel)
                continue;
            datum_row(block, datum, 1, true, &sums);
            model.value = model_of(&sums, &state);
            model.bare = state.gain * (sums.nodes + sums.constant);
            derivatives_of(problem, block, &state, &sums, &model);
            visit(context, datum, &model);
        }
    }
    return true;
}
