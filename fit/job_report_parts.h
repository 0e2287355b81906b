/* What the parts of a job's report share: each fills in its rows. */
#ifndef FIT_JOB_REPORT_PARTS_H
#define FIT_JOB_REPORT_PARTS_H

#include "fit/job.h"
#include "fit/report.h"

enum {
    JOB_VALUE_LIMIT = FIT_CHANNEL_COUNT * 4 + 1 + FIT_TARGET_LIMIT * (1 + 2 * FIT_CHANNEL_COUNT),
    JOB_PROFILE_LIMIT = FIT_TARGET_LIMIT + FIT_CHANNEL_COUNT,
    JOB_SEARCH_LIMIT = FIT_SEARCH_START_LIMIT + FIT_SEARCH_PASS_LIMIT,
    JOB_NOTE_LIMIT = FIT_NOTE_LIMIT + 4 * FIT_TARGET_LIMIT + 2,
    JOB_NOTE_SIZE = 1024,
    JOB_CURVE_COUNT = 120,
};

/* A profile's numbers, which its row of the report points to. */
struct job_profile {
    char name[192];
    double r_mm[JOB_CURVE_COUNT], rd[JOB_CURVE_COUNT], low[JOB_CURVE_COUNT], high[JOB_CURVE_COUNT];
    double *measured; /* r, rd, sem: 3 x measured_count; NULL: none */
};

/* All that a report points to; end it with job_page_destroy. */
struct job_page {
    const struct fit_job *job;
    struct fit_report report;
    char title[512], verdict[2048];
    char target_names[FIT_TARGET_LIMIT][160]; /* of targets, each its own */
    struct fit_report_value values[JOB_VALUE_LIMIT];
    struct fit_report_picture pictures[FIT_TARGET_LIMIT];
    struct io_image *models[FIT_TARGET_LIMIT];
    struct fit_report_profile profiles[JOB_PROFILE_LIMIT];
    struct job_profile *curves; /* JOB_PROFILE_LIMIT */
    struct fit_report_search searches[JOB_SEARCH_LIMIT];
    char note_texts[JOB_NOTE_LIMIT][JOB_NOTE_SIZE];
    const char *notes[JOB_NOTE_LIMIT];
    char correlation_texts[FIT_PARAMETER_LIMIT][192];
    const char *correlation_names[FIT_PARAMETER_LIMIT];
    double *correlations;
};

/* Add to a text of size bytes, as far as it has room. */
void job_text_add(char *text, size_t size, const char *format, ...) DIPOLE_PRINTF(3, 4);

/* One more note, empty, of JOB_NOTE_SIZE bytes. */
char *job_page_note(struct job_page *page);

/* "R", or "" where there is but one channel. */
const char *job_channel_name(const struct fit_job *job, int channel);

void job_page_add_values(struct job_page *page);
DIPOLE_CHECKED bool job_page_add_correlations(struct job_page *page, dipole_status *status);
void job_page_add_verdict(struct job_page *page);
void job_page_add_notes(struct job_page *page);
DIPOLE_CHECKED bool job_page_add_pictures(struct job_page *page, dipole_status *status);
DIPOLE_CHECKED bool job_page_add_profiles(struct job_page *page, dipole_status *status);

#endif
