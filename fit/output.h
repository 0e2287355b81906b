/* What is said of a fit: JSON and a table. */
#ifndef FIT_OUTPUT_H
#define FIT_OUTPUT_H

#include "fit/job.h"

#include <jansson.h>

/* The "fit" block of docs/formats.md; NULL without memory. The caller ends it with json_decref. */
json_t *fit_output_block(const struct fit_job *job);

DIPOLE_CHECKED bool fit_output_print_json(json_t *block, dipole_status *status);
void fit_output_print_table(const struct fit_job *job);

#endif
