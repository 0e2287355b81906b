#include "fit/job_report.h"

#include "fit/job_report_parts.h"
#include "io/file.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void job_text_add(char *text, size_t size, const char *format, ...)
{
    const size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, size - length, format, arguments);
    va_end(arguments);
}

char *job_page_note(struct job_page *page)
{
    const size_t i = page->report.note_count++;
    page->notes[i] = page->note_texts[i];
    return page->note_texts[i];
}

const char *job_channel_name(const struct fit_job *job, int channel)
{
    return job->form.channel_count > 1 ? io_channel_names[channel] : "";
}

/* ---- names ------------------------------------------------------------------------------------------- */

/* Two targets of one name, from two folders, are told apart by a number. */
static void name_targets(struct job_page *page)
{
    const struct fit_result *const result = &page->job->result;
    for (size_t t = 0; t < result->problem.target_count; t++) {
        char *const name = page->target_names[t];
        int number = 1;
        for (size_t k = 0; k < t; k++)
            number += strcmp(result->targets[k].name, result->targets[t].name) == 0;
        snprintf(name, sizeof page->target_names[t], "%s", result->targets[t].name);
        if (number > 1)
            job_text_add(name, sizeof page->target_names[t], " (%d)", number);
    }
}

static void add_title(struct job_page *page)
{
    const size_t others = page->job->result.problem.target_count - 1;
    job_text_add(page->title, sizeof page->title, "%s", page->target_names[0]);
    if (others > 0)
        job_text_add(page->title, sizeof page->title, " and %zu more", others);
    job_text_add(page->title, sizeof page->title, ": %s", page->job->material.name);
}

/* ---- the whole --------------------------------------------------------------------------------------- */

static void add_searches(struct job_page *page)
{
    const struct fit_search_log *const log = &page->job->result.log;
    for (int i = 0; i < log->count; i++) {
        page->searches[i] =
            (struct fit_report_search){ .name = log->searches[i].name,
                                        .count = (size_t)log->searches[i].count,
                                        .sum_of_squares = log->searches[i].sum_of_squares,
                                        .is_reweighed = strncmp(log->searches[i].name, "weights",
                                                                strlen("weights")) == 0 };
    }
    page->report.search_count = (size_t)log->count;
}

static void job_page_destroy(struct job_page *page)
{
    if (!page)
        return;
    for (size_t i = 0; i < FIT_TARGET_LIMIT; i++)
        io_image_destroy(page->models[i]);
    for (size_t i = 0; page->curves && i < JOB_PROFILE_LIMIT; i++)
        free(page->curves[i].measured);
    free(page->curves);
    free(page->correlations);
    free(page);
}

static struct job_page *job_page_create(const struct fit_job *job, dipole_status *status)
{
    struct job_page *const page = calloc(1, sizeof *page);
    if (!page) {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a report");
        return NULL;
    }
    page->job = job;
    page->report = (struct fit_report){
        .title = page->title,
        .verdict = page->verdict,
        .model = io_model_names[job->form.model],
        .has_converged = job->result.has_converged,
        .seconds = job->seconds,
        .rms_residual = job->result.estimates.rms_residual,
        .values = page->values,
        .pictures = page->pictures,
        .profiles = page->profiles,
        .searches = page->searches,
        .notes = page->notes,
        .correlation_names = page->correlation_names,
    };
    return page;
}

bool fit_job_report_check(const char *folder, dipole_status *status)
{
    const dipole_place place = { .source = folder };
    char path[4096];
    const int length = snprintf(path, sizeof path, "%s/index.html", folder);
    if (length < 0 || (size_t)length >= sizeof path)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "has %zu bytes, expected at most %zu",
                           strlen(folder), sizeof path - sizeof "/index.html");
    return io_folder_make(folder, status) && io_file_check_writable(path, status);
}

bool fit_job_report(const struct fit_job *job, dipole_status *status)
{
    struct job_page *const page = job_page_create(job, status);
    if (!page)
        return false;
    name_targets(page);
    add_title(page);
    job_page_add_values(page);
    job_page_add_verdict(page);
    job_page_add_notes(page);
    add_searches(page);
    const bool done = job_page_add_pictures(page, status) && job_page_add_profiles(page, status) &&
                      job_page_add_correlations(page, status) &&
                      fit_report_write(job->options->report_path, &page->report, status);
    job_page_destroy(page);
    return done;
}
