/* What was found, as rows of numbers, and how parameters go together. */
#include "fit/job_report_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char *const ambient_names[FIT_CHANNEL_COUNT] = { "ambient R", "ambient G", "ambient B" };
static const char *const black_names[FIT_CHANNEL_COUNT] = { "black level R", "black level G",
                                                            "black level B" };

/* ---- values ------------------------------------------------------------------------------------------ */

static void add_value(struct job_page *page, const char *group, const char *name, const char *unit,
                      const struct fit_interval *found, const char *note)
{
    page->values[page->report.value_count++] =
        (struct fit_report_value){ .group = group,
                                   .name = name,
                                   .unit = unit,
                                   .value = found->value,
                                   .ci95 = { found->ci95[0], found->ci95[1] },
                                   .note = note };
}

static void add_channel(struct job_page *page, int c)
{
    static const char *const names[] = { "", "alpha'", "sigma_tr", "sigma_t'" };
    static const char *const units[] = { "", "", "1/mm", "1/mm" };
    const struct fit_channel_estimate *const found = &page->job->result.estimates.channels[c];
    const char *const name = job_channel_name(page->job, c);
    const char *const group = name[0] ? name : "medium";
    const bool has_light = page->job->result.problem.has_light[c];
    const char *const note =
        found->is_identifiable || !has_light ? "" : "one of many that would look the same";
    struct fit_interval sigma_a = found->sigma_a_per_mm, sigma_s = found->sigma_s_prime_per_mm;
    if (!has_light) { /* nothing is known, which the range of what is legal hides */
        sigma_a.ci95[0] = sigma_s.ci95[0] = 0;
        sigma_a.ci95[1] = sigma_s.ci95[1] = INFINITY;
    }
    add_value(page, group, "sigma_a", "1/mm", &sigma_a, found->note);
    add_value(page, group, "sigma_s'", "1/mm", &sigma_s, note);
    if (found->combination != FIT_COMBINATION_NONE)
        add_value(page, group, names[found->combination], units[found->combination], &found->combined,
                  "what can be told of both together");
}

static void add_target(struct job_page *page, size_t t)
{
    const struct fit_problem *const problem = &page->job->result.problem;
    const struct fit_estimates *const estimates = &page->job->result.estimates;
    const char *const group = page->target_names[t];
    if (problem->layout.gain[t] >= 0)
        add_value(page, group, "exposure", "", &estimates->gains[t],
                  "what the scene's light is multiplied by");
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (problem->layout.ambient[t][c] >= 0)
            add_value(page, group, ambient_names[c], "W/mm²", &estimates->ambients[t][c],
                      "light from all around");
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (problem->layout.black[t][c] >= 0)
            add_value(page, group, black_names[c], "", &estimates->blacks[t][c],
                      "what the picture shows where there is no light");
    }
}

void job_page_add_values(struct job_page *page)
{
    const struct fit_job *const job = page->job;
    const struct fit_result *const result = &job->result;
    for (int c = 0; c < job->form.channel_count; c++)
        add_channel(page, c);
    if (job->form.is_thickness_sought)
        add_value(page, job->form.channel_count > 1 ? "R, G, B" : "medium", "thickness", "mm",
                  &result->estimates.channels[0].thickness_mm, "");
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (result->problem.layout.balance[c] >= 0)
            add_value(page, io_channel_names[c], "white balance", "", &result->estimates.balances[c],
                      "against G, of all targets");
    }
    for (size_t t = 0; t < result->problem.target_count; t++)
        add_target(page, t);
}

/* ---- correlations ------------------------------------------------------------------------------------ */

static void name_parameter(struct job_page *page, int parameter, const char *group, const char *name)
{
    if (parameter >= 0)
        snprintf(page->correlation_texts[parameter], sizeof page->correlation_texts[0], "%s%s%s", group,
                 group[0] ? " " : "", name);
}

static void name_parameters(struct job_page *page)
{
    static const char *const names[FIT_COEFFICIENT_COUNT] = { "sigma_a", "sigma_s'", "thickness" };
    const struct fit_problem *const problem = &page->job->result.problem;
    const struct fit_layout *const layout = &problem->layout;
    for (int c = 0; c < page->job->form.channel_count; c++) {
        for (int p = 0; p < FIT_COEFFICIENT_COUNT; p++)
            name_parameter(page, layout->coefficient[c][p],
                           p == FIT_THICKNESS ? "" : job_channel_name(page->job, c), names[p]);
        name_parameter(page, layout->balance[c], io_channel_names[c], "white balance");
    }
    for (size_t t = 0; t < problem->target_count; t++) {
        name_parameter(page, layout->gain[t], page->target_names[t], "exposure");
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            name_parameter(page, layout->ambient[t][c], page->target_names[t], ambient_names[c]);
            name_parameter(page, layout->black[t][c], page->target_names[t], black_names[c]);
        }
    }
    for (size_t p = 0; p < layout->parameter_count; p++)
        page->correlation_names[p] = page->correlation_texts[p];
}

bool job_page_add_correlations(struct job_page *page, dipole_status *status)
{
    const size_t n = page->job->result.problem.layout.parameter_count;
    const double *const covariance = page->job->result.estimates.covariance;
    page->correlations = malloc((n * n + 1) * sizeof *page->correlations);
    if (!page->correlations)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a report");
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++) {
            const double scale = sqrt(covariance[i * n + i]) * sqrt(covariance[k * n + k]);
            const double value = covariance[i * n + k] / scale;
            page->correlations[i * n + k] =
                scale > 0 && isfinite(scale) ? fmin(fmax(value, -1), 1) : (double)NAN;
        }
    }
    name_parameters(page);
    page->report.correlations = page->correlations;
    page->report.correlation_count = n;
    return true;
}
