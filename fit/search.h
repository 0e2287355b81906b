/* The best parameters of a problem: several starts, and weights that follow the residuals. theory.md T39.
 */
#ifndef FIT_SEARCH_H
#define FIT_SEARCH_H

#include "fit/problem.h"

enum { FIT_SEARCH_START_LIMIT = 4, FIT_SEARCH_PASS_LIMIT = 6 };

/* How it went, for the report. */
struct fit_search_log {
    int count;
    struct {
        char name[40];
        int count;
        double sum_of_squares[FIT_HISTORY_LIMIT];
    } searches[FIT_SEARCH_START_LIMIT + 1 + FIT_SEARCH_PASS_LIMIT];
};

/*
 * Fold the problem and search from its own start and, unless is_warm, from the best few points of a coarse
 * grid; then let the weights follow the residuals (noise that grows with the signal, outliers) until that
 * moves nothing. stop (may be NULL) ends it early: out then has the best so far, not converged. log may be
 * NULL. Not converging is an answer. Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_NOT_CONVERGED (no start has
 * a value).
 */
DIPOLE_CHECKED bool fit_search(struct fit_problem *problem, bool is_warm, const volatile sig_atomic_t *stop,
                               struct fit_search_log *log, struct fit_minimum *out, dipole_status *status);

#endif
