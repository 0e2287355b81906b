/* Coefficients from everything that was measured: what `fit` does between reading and writing files. */
#ifndef FIT_FIT_H
#define FIT_FIT_H

#include "fit/interval.h"
#include "fit/picture.h"
#include "fit/search.h"

struct fit_request {
    const struct fit_form *form;
    struct fit_picture *const *pictures; /* picture_count                                              */
    size_t picture_count;
    const struct fit_target *others; /* other_count: profiles and totals                              */
    size_t other_count;              /* with the pictures 1 to FIT_TARGET_LIMIT                        */
    bool is_balance_free;
    const dipole_model *models; /* model_count: to be tried besides the form's, which stays where none is */
    size_t model_count; /* clearly better                                                          */
    struct fit_progress progress;
    const volatile sig_atomic_t *stop; /* not 0: end with the best so far; NULL: never                  */
};

enum { FIT_NOTE_LIMIT = FIT_TARGET_LIMIT, FIT_MODEL_LIMIT = 5 };

/* How well a model fits. */
struct fit_trial {
    dipole_model model;
    double rms_residual;
};

/* End it with fit_result_destroy. */
struct fit_result {
    bool has_converged, is_interrupted;
    int round_count;
    struct fit_estimates estimates;
    struct fit_minimum minimum;
    struct fit_problem problem;                  /* the last one, at the minimum         */
    struct fit_target targets[FIT_TARGET_LIMIT]; /* pictures first                       */
    struct fit_search_log log;                   /* of the last round                    */
    struct fit_trial trials[FIT_MODEL_LIMIT];    /* the form's model first               */
    size_t trial_count;                          /* 0: there was no choice               */
    char notes[FIT_NOTE_LIMIT][256];             /* promises that could not be kept      */
    size_t note_count;
};

/*
 * Fit; try the other models on the same data; and draw the pictures' light again with samples as close as
 * the coefficients found need them, until that changes nothing. Not converging is an answer. Fails as
 * fit_picture_prepare, fit_problem_init and fit_search do; nothing is then to be destroyed.
 */
DIPOLE_CHECKED bool fit_run(const struct fit_request *request, struct fit_result *result_out,
                            dipole_status *status);
void fit_result_destroy(struct fit_result *result);

#endif
