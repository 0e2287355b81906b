/* What the parts of a report share: each adds its section to the page. The markup is also well-formed XML.
 */
#ifndef FIT_REPORT_PAGE_H
#define FIT_REPORT_PAGE_H

#include "fit/report.h"
#include "plot/text.h"

extern const char fit_report_style[];

/* Room for any number below, with its NUL. */
enum { FIT_NUMBER_SIZE = 32 };

/* value with digits (1 to 15) significant ones, "unknown" for NaN; with a decimal point in every locale. */
void fit_number_format(double value, int digits, char out[FIT_NUMBER_SIZE]);

/* As many digits as a value has that may as well be distance away: two of the distance's, at least 2. */
int fit_number_digits(double value, double distance);

/* Add markup as it is. */
void fit_page_add(struct plot_text *page, const char *markup);

/* Add <img>, which holds the picture; its pixels stay to be seen when it is shown larger. alt is text. */
DIPOLE_CHECKED bool fit_page_add_image(struct plot_text *page, const struct io_image *image,
                                       const char *alt, dipole_status *status);

void fit_page_add_values(struct plot_text *page, const struct fit_report *report);
void fit_page_add_correlations(struct plot_text *page, const struct fit_report *report);
DIPOLE_CHECKED bool fit_page_add_picture(struct plot_text *page, const struct fit_report_picture *picture,
                                         size_t pixel_limit, dipole_status *status);
DIPOLE_CHECKED bool fit_page_add_profile(struct plot_text *page, const struct fit_report_profile *profile,
                                         dipole_status *status);
DIPOLE_CHECKED bool fit_page_add_searches(struct plot_text *page, const struct fit_report *report,
                                          dipole_status *status);

#endif
