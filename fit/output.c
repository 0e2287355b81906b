#include "fit/output.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- JSON -------------------------------------------------------------------------------------------- */

/* Every function that makes a value takes NULL for one that could not be made, and passes it on. */

static json_t *append(json_t *array, json_t *value)
{
    if (array && json_array_append_new(array, value) == 0)
        return array;
    json_decref(array);
    return NULL;
}

static json_t *add(json_t *object, const char *key, json_t *value)
{
    if (object && json_object_set_new(object, key, value) == 0)
        return object;
    json_decref(object);
    return NULL;
}

static json_t *pair_of(const struct fit_interval *interval)
{
    return json_pack("[f, f]", interval->ci95[0], interval->ci95[1]);
}

static json_t *add_interval(json_t *object, const char *key, const char *ci_key,
                            const struct fit_interval *interval)
{
    return add(add(object, key, json_real(interval->value)), ci_key, pair_of(interval));
}

static json_t *channel_of(const struct fit_job *job, int c)
{
    const struct fit_channel_estimate *const found = &job->result.estimates.channels[c];
    json_t *entry = json_object();
    if (job->form.channel_count > 1)
        entry = add(entry, "channel", json_string(io_channel_names[c]));
    entry = add_interval(entry, "sigma_a_per_mm", "sigma_a_ci95", &found->sigma_a_per_mm);
    entry = add_interval(entry, "sigma_s_prime_per_mm", "sigma_s_prime_ci95", &found->sigma_s_prime_per_mm);
    entry = add(entry, "correlation", json_real(found->correlation));
    if (job->form.is_thickness_sought)
        entry = add_interval(entry, "thickness_mm", "thickness_ci95", &found->thickness_mm);
    entry = add(entry, "identifiable", json_boolean(found->is_identifiable));
    if (found->combination != FIT_COMBINATION_NONE)
        entry = add_interval(entry, fit_combination_names[found->combination], "combination_ci95",
                             &found->combined);
    entry = add(entry, "rms_residual", json_real(found->rms_residual));
    return add(entry, "note", json_string(found->note));
}

static json_t *intervals_of(const struct fit_interval *intervals, int count)
{
    json_t *array = json_array();
    for (int c = 0; c < count; c++)
        array = append(
            array, json_pack("{s:f, s:o}", "value", intervals[c].value, "ci95", pair_of(&intervals[c])));
    return array;
}

static json_t *target_of(const struct fit_job *job, size_t t)
{
    const struct fit_target *const target = &job->result.targets[t];
    const struct fit_estimates *const estimates = &job->result.estimates;
    json_t *entry = json_pack("{s:s, s:i}", "name", target->name, "data", (int)target->datum_count);
    if (target->is_gain_free)
        entry = add_interval(entry, "exposure", "exposure_ci95", &estimates->gains[t]);
    if (target->is_ambient_free)
        entry = add(entry, "ambient", intervals_of(estimates->ambients[t], job->form.channel_count));
    if (target->is_black_free)
        entry = add(entry, "black_level", intervals_of(estimates->blacks[t], job->form.channel_count));
    if (t >= job->picture_count)
        return entry;
    const struct fit_pixels *const pixels = fit_picture_pixels(job->pictures[t]);
    json_t *uses = json_object();
    for (int use = 0; use < FIT_USE_COUNT; use++) {
        if (pixels->use_counts[use] > 0)
            uses = add(uses, fit_use_names[use], json_integer((json_int_t)pixels->use_counts[use]));
    }
    return add(entry, "pixels", uses);
}

json_t *fit_output_block(const struct fit_job *job)
{
    const struct fit_result *const result = &job->result;
    json_t *channels = json_array(), *targets = json_array();
    for (int c = 0; c < job->form.channel_count; c++)
        channels = append(channels, channel_of(job, c));
    for (size_t t = 0; t < result->problem.target_count; t++)
        targets = append(targets, target_of(job, t));
    json_t *block = add(json_object(), "converged", json_boolean(result->has_converged));
    if (result->is_interrupted)
        block = add(block, "interrupted", json_true());
    block = add(block, "model", json_string(io_model_names[job->form.model]));
    block = add(block, "rms_residual", json_real(result->estimates.rms_residual));
    block = add(block, "channels", channels);
    if (result->problem.is_balance_free)
        block =
            add(block, "white_balance", intervals_of(result->estimates.balances, job->form.channel_count));
    block = add(block, "targets", targets);
    return add(block, "seconds", json_real(job->seconds));
}

bool fit_output_print_json(json_t *block, dipole_status *status)
{
    char *const text = io_json_format(block);
    if (!text)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result");
    fputs(text, stdout);
    free(text);
    return true;
}

/* ---- the table --------------------------------------------------------------------------------------- */

static void print_channel(const struct fit_job *job, int c)
{
    const struct fit_channel_estimate *const found = &job->result.estimates.channels[c];
    char intervals[2][48];
    snprintf(intervals[0], sizeof intervals[0], "[%.4g, %.4g]", found->sigma_a_per_mm.ci95[0],
             found->sigma_a_per_mm.ci95[1]);
    snprintf(intervals[1], sizeof intervals[1], "[%.4g, %.4g]", found->sigma_s_prime_per_mm.ci95[0],
             found->sigma_s_prime_per_mm.ci95[1]);
    printf("%-7s %11.4g  %22s  %10.4g  %22s\n", job->form.channel_count > 1 ? io_channel_names[c] : "",
           found->sigma_a_per_mm.value, intervals[0], found->sigma_s_prime_per_mm.value, intervals[1]);
}

static void print_interval(const char *what, const char *unit, const struct fit_interval *interval)
{
    printf("%s %.4g%s [%.4g, %.4g]\n", what, interval->value, unit, interval->ci95[0], interval->ci95[1]);
}

static void print_target(const struct fit_job *job, size_t t)
{
    const struct fit_target *const target = &job->result.targets[t];
    const struct fit_estimates *const estimates = &job->result.estimates;
    printf("%s: %zu values", target->name, target->datum_count);
    if (t < job->picture_count) {
        const struct fit_pixels *const pixels = fit_picture_pixels(job->pictures[t]);
        printf(" of %zu pixels (", pixels->count);
        const char *between = "";
        for (int use = 0; use < FIT_USE_COUNT; use++) {
            if (pixels->use_counts[use] == 0)
                continue;
            printf("%s%zu %s", between, pixels->use_counts[use], fit_use_names[use]);
            between = ", ";
        }
        printf(")");
    }
    printf("\n");
    if (target->is_gain_free)
        print_interval("  exposure", "", &estimates->gains[t]);
    for (int c = 0; c < job->form.channel_count; c++) {
        char what[32];
        snprintf(what, sizeof what, "  ambient %s", io_channel_names[c]);
        if (target->is_ambient_free)
            print_interval(what, " W/mm^2", &estimates->ambients[t][c]);
        snprintf(what, sizeof what, "  black level %s", io_channel_names[c]);
        if (target->is_black_free)
            print_interval(what, "", &estimates->blacks[t][c]);
    }
}

void fit_output_print_table(const struct fit_job *job)
{
    const struct fit_result *const result = &job->result;
    printf("channel     sigma_a                    95 %%    sigma_s'                    95 %%\n");
    printf("               1/mm                    1/mm        1/mm                    1/mm\n");
    for (int c = 0; c < job->form.channel_count; c++)
        print_channel(job, c);
    if (job->form.is_thickness_sought)
        print_interval("thickness", " mm", &result->estimates.channels[0].thickness_mm);
    for (int c = 0; c < job->form.channel_count; c++) {
        if (result->estimates.channels[c].note[0])
            printf("%s%s%s\n", job->form.channel_count > 1 ? io_channel_names[c] : "",
                   job->form.channel_count > 1 ? ": " : "", result->estimates.channels[c].note);
    }
    for (int c = 0; c < job->form.channel_count && result->problem.is_balance_free; c++) {
        char what[32];
        snprintf(what, sizeof what, "white balance %s", io_channel_names[c]);
        print_interval(what, "", &result->estimates.balances[c]);
    }
    for (size_t t = 0; t < result->problem.target_count; t++)
        print_target(job, t);
    printf("model %s, rms residual %.2g %%, %d round%s, %.1f s\n", io_model_names[job->form.model],
           100 * result->estimates.rms_residual, result->round_count, result->round_count == 1 ? "" : "s",
           job->seconds);
}
