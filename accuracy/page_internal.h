/* Parts of the page. */
#ifndef ACCURACY_PAGE_INTERNAL_H
#define ACCURACY_PAGE_INTERNAL_H

#include "accuracy/page.h"
#include "fit/report_page.h"

size_t accuracy_knob_count(void);

/* Points that are timed, of a knob or (NULL) the best of all, fastest first; their number. */
size_t accuracy_list_points(const struct accuracy_sweep *sweep, const struct accuracy_knob *knob,
                            const struct accuracy_point **list);

enum accuracy_norm { ACCURACY_RMSE = 0, ACCURACY_WEBER, ACCURACY_MAX };

/* SVGs, which the caller frees: errors of all points against their times; one knob's, measured and
 * predicted; times predicted against measured, effect by effect. Fail with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool accuracy_draw_main_plot(const struct accuracy_sweep *sweep, enum accuracy_norm norm,
                                            char **svg_out, size_t *size_out, dipole_status *status);
DIPOLE_CHECKED bool accuracy_draw_knob_plot(const struct accuracy_sweep *sweep,
                                            const struct accuracy_knob *knob, char **svg_out,
                                            size_t *size_out, dipole_status *status);
DIPOLE_CHECKED bool accuracy_draw_time_plot(const struct accuracy_sweep *sweep, char **svg_out,
                                            size_t *size_out, dipole_status *status);

bool accuracy_page_add_plot(struct plot_text *page, char *svg, size_t size);
void accuracy_page_add_cell(struct plot_text *page, double value, int digits);

/* Sections (page_predictions.c): how well errors and times are predicted; what the automatic choice leaves
 * out, and why. */
DIPOLE_CHECKED bool accuracy_page_add_predictions(struct plot_text *page,
                                                  const struct accuracy_sweep *sweep,
                                                  dipole_status *status);
void accuracy_page_add_plan(struct plot_text *page, const struct accuracy_sweep *sweep);

#endif
