/* The page of a run: what was found, seen beside what was measured. */
#ifndef FIT_JOB_REPORT_H
#define FIT_JOB_REPORT_H

#include "fit/job.h"

/* Make the folder, and fail unless a report can be written there: before the fit, not after. */
DIPOLE_CHECKED bool fit_job_report_check(const char *folder, dipole_status *status);

/*
 * Write the report of a job that has run into options->report_path. The scenes are drawn again with what
 * was found; where that fails the report says so and has no such picture. Fails as fit_report_write does.
 */
DIPOLE_CHECKED bool fit_job_report(const struct fit_job *job, dipole_status *status);

#endif
