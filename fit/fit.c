#include "fit/fit.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUND_LIMIT = 6 };

/* Another model must raise the log-likelihood by half of this to be taken: much more than what chance, or
 * what the data within a tile have in common, would do. */
static const double clearly_better = 50;
/* What a model misses by this much is nothing that another would meet. */
static const double hopeless_residual = 0.5;

/* Shows a part of a whole: rounds shrink towards the end of the bar. */
struct part {
    const struct fit_progress *whole;
    int round;
    double from, to; /* of the round */
};

static void show_part(void *context, const char *what, double fraction)
{
    const struct part *const part = context;
    if (!part->whole->show)
        return;
    char text[96];
    const double share = part->from + (part->to - part->from) * fraction;
    snprintf(text, sizeof text, "round %d: %s", part->round, what);
    part->whole->show(part->whole->context, text, 1 - pow(0.5, part->round - 1 + share));
}

static bool is_stopped(const struct fit_request *request)
{
    return request->stop && *request->stop;
}

/* Where the next round begins. */
static void take_coefficients(const struct fit_result *result, struct fit_form *form)
{
    for (int c = 0; c < form->channel_count; c++) {
        dipole_layer *const layer = &form->layers[c][form->layer];
        if (!result->problem.has_light[c])
            continue;
        layer->medium.sigma_a_per_mm = result->estimates.channels[c].sigma_a_per_mm.value;
        layer->medium.sigma_s_prime_per_mm = result->estimates.channels[c].sigma_s_prime_per_mm.value;
        if (form->is_thickness_sought)
            layer->thickness_mm = result->estimates.channels[c].thickness_mm.value;
    }
}

static void forget_round(struct fit_result *result)
{
    free(result->estimates.covariance);
    result->estimates.covariance = NULL;
    fit_problem_destroy(&result->problem);
}

void fit_result_destroy(struct fit_result *result)
{
    forget_round(result);
}

static bool run_round(const struct fit_request *request, const struct fit_form *form, struct part *part,
                      struct fit_result *result, dipole_status *status)
{
    const struct fit_progress progress = { .show = show_part, .context = part };
    const size_t target_count = request->picture_count + request->other_count;
    for (size_t i = 0; i < request->picture_count; i++) {
        part->from = 0.8 * (double)i / (double)request->picture_count;
        part->to = 0.8 * (double)(i + 1) / (double)request->picture_count;
        if (!fit_picture_prepare(request->pictures[i], &progress, &result->targets[i], status))
            return false;
    }
    for (size_t i = 0; i < request->other_count; i++)
        result->targets[request->picture_count + i] = request->others[i];
    part->from = 0.8;
    part->to = 1;
    show_part(part, "solving", 0);
    if (!fit_problem_init(form, result->targets, target_count, request->is_balance_free, &result->problem,
                          status))
        return false;
    if (!fit_search(&result->problem, false, request->stop, &result->log, &result->minimum, status) ||
        !fit_judge(&result->problem, &result->minimum, true, request->stop, &result->estimates, status)) {
        fit_problem_destroy(&result->problem);
        return false;
    }
    return true;
}

/* Whether a channel's search ended at the shortest mean free path that it could take. */
static bool is_at_shortest_path(const struct fit_result *result, int channel)
{
    const int at = result->problem.layout.coefficient[channel][FIT_SIGMA_S_PRIME];
    return result->minimum.parameters[at] > result->problem.upper[at] - 0.1;
}

/* What the channels that can be trusted are made of; NULL for the others. */
static void create_stacks(const struct fit_result *result, dipole_stack *stacks[FIT_CHANNEL_COUNT])
{
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        struct fit_state state;
        stacks[c] = NULL;
        if (!result->problem.has_light[c] ||
            !(result->estimates.channels[c].is_identifiable || is_at_shortest_path(result, c)))
            continue;
        fit_problem_state(&result->problem, 0, c, result->minimum.parameters, &state);
        if (!fit_form_stack_create(&result->problem.form, c, state.logs, &stacks[c], NULL))
            stacks[c] = NULL;
    }
}

static bool are_pictures_fine(const struct fit_request *request, struct fit_result *result)
{
    dipole_stack *stacks[FIT_CHANNEL_COUNT];
    bool is_fine = true;
    create_stacks(result, stacks);
    result->note_count = 0;
    for (size_t i = 0; i < request->picture_count; i++) {
        char *const note = result->notes[result->note_count];
        note[0] = '\0';
        if (!fit_picture_is_fine(request->pictures[i], stacks, &result->targets[i], note,
                                 sizeof result->notes[0]))
            is_fine = false;
        result->note_count += note[0] != '\0';
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        dipole_stack_destroy(stacks[c]);
    return is_fine;
}

/* ---- other models ------------------------------------------------------------------------------------ */

/* Weights of all data, so that a trial can be taken back. */
static double *weights_save(const struct fit_problem *problem)
{
    size_t count = 0;
    for (size_t t = 0; t < problem->target_count; t++)
        count += problem->targets[t].datum_count;
    double *const weights = calloc(2 * count + 1, sizeof *weights);
    double *next = weights;
    for (size_t t = 0; weights && t < problem->target_count; t++) {
        for (size_t i = 0; i < problem->targets[t].datum_count; i++) {
            *next++ = problem->targets[t].data[i].sigma;
            *next++ = problem->targets[t].data[i].robust;
        }
    }
    return weights;
}

static void weights_restore(const struct fit_problem *problem, const double *weights)
{
    for (size_t t = 0; t < problem->target_count; t++) {
        for (size_t i = 0; i < problem->targets[t].datum_count; i++) {
            problem->targets[t].data[i].sigma = *weights++;
            problem->targets[t].data[i].robust = *weights++;
        }
    }
}

static double datum_count_of(const struct fit_problem *problem)
{
    double count = 0;
    for (size_t t = 0; t < problem->target_count; t++)
        count += (double)problem->targets[t].datum_count;
    return count;
}

/* Fit another model to the same data, from where the best one ended; keep it if it is clearly better. A
 * model that has no value there, or does not converge, is passed over. */
static bool try_model(const struct fit_request *request, dipole_model model, struct fit_form *form,
                      struct fit_result *result, dipole_status *status)
{
    struct fit_form other = *form;
    struct fit_problem problem;
    struct fit_minimum minimum;
    struct fit_estimates estimates;
    struct fit_search_log course;
    double *const weights = weights_save(&result->problem);
    if (!weights)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for another model");
    take_coefficients(result, &other);
    other.model = model;
    if (fit_problem_init(&other, result->targets, result->problem.target_count, request->is_balance_free,
                         &problem, NULL)) {
        bool is_taken = false;
        if (fit_search(&problem, true, request->stop, &course, &minimum, NULL) &&
            fit_judge(&problem, &minimum, true, request->stop, &estimates, NULL)) {
            const double gain =
                datum_count_of(&problem) * 2 * log(result->estimates.rms_residual / estimates.rms_residual);
            result->trials[result->trial_count++] = (struct fit_trial){ model, estimates.rms_residual };
            is_taken = minimum.has_converged && gain > clearly_better;
            if (is_taken) {
                forget_round(result);
                *form = other;
                result->problem = problem;
                result->minimum = minimum;
                result->estimates = estimates;
                result->log = course;
            } else {
                free(estimates.covariance);
            }
        }
        if (!is_taken) {
            fit_problem_destroy(&problem);
            weights_restore(&result->problem, weights);
        }
    }
    free(weights);
    return true;
}

static bool try_models(const struct fit_request *request, struct fit_form *form, struct fit_result *result,
                       dipole_status *status)
{
    if (request->model_count == 0 || result->trial_count > 0 || is_stopped(request) ||
        result->estimates.rms_residual > hopeless_residual)
        return true;
    result->trials[result->trial_count++] =
        (struct fit_trial){ form->model, result->estimates.rms_residual };
    for (size_t m = 0; m < request->model_count; m++) {
        if (!try_model(request, request->models[m], form, result, status))
            return false;
    }
    return true;
}

bool fit_run(const struct fit_request *request, struct fit_result *result_out, dipole_status *status)
{
    assert(request->picture_count + request->other_count <= FIT_TARGET_LIMIT);
    assert(request->model_count < FIT_MODEL_LIMIT);
    struct fit_result *const result = result_out;
    struct fit_form form = *request->form;
    struct part part = { .whole = &request->progress };
    bool is_fine = false;
    *result = (struct fit_result){ 0 };
    while (!is_fine && result->round_count < ROUND_LIMIT) {
        if (result->round_count > 0) {
            if (is_stopped(request))
                break;
            take_coefficients(result, &form);
            forget_round(result);
        }
        part.round = ++result->round_count;
        if (!run_round(request, &form, &part, result, status))
            return false;
        is_fine = are_pictures_fine(request, result);
        if (is_fine) {
            const dipole_model model = form.model;
            if (!try_models(request, &form, result, status)) {
                fit_result_destroy(result);
                return false;
            }
            is_fine = form.model == model || are_pictures_fine(request, result);
        }
    }
    result->is_interrupted = is_stopped(request);
    result->has_converged = is_fine && result->minimum.has_converged && !result->is_interrupted;
    free(result->estimates.covariance);
    show_part(&part, "intervals", 0.9);
    if (!fit_judge(&result->problem, &result->minimum, false, request->stop, &result->estimates, status)) {
        fit_problem_destroy(&result->problem);
        return false;
    }
    return true;
}
