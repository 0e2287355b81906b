/* How sure the parameters are: 95 % intervals, and what cannot be told. theory.md T40, T41. */
#ifndef FIT_INTERVAL_H
#define FIT_INTERVAL_H

#include "fit/problem.h"

struct fit_interval {
    double value, ci95[2];
};

/* What a channel's targets tell when they do not tell both coefficients. */
enum fit_combination { FIT_COMBINATION_NONE = 0, FIT_ALPHA_PRIME, FIT_SIGMA_TR, FIT_SIGMA_T_PRIME };
/* NULL, "alpha_prime", "sigma_tr_per_mm", "sigma_t_prime_per_mm" */
extern const char *const fit_combination_names[];

/* One channel's answer. Values stand even where is_identifiable is false: then they are one choice among
 * the many that make the same picture, and the intervals say how many. */
struct fit_channel_estimate {
    struct fit_interval sigma_a_per_mm, sigma_s_prime_per_mm, thickness_mm;
    bool is_identifiable;
    enum fit_combination combination;
    struct fit_interval combined;
    double
        correlation; /* of the errors of log sigma_a and log sigma_s', -1 to 1; 0 where one is unbounded */
    double rms_residual; /* of (model - value) / (|value| + 10 % of the mean)            */
    char note[256];      /* a plain sentence where is_identifiable is false, or ""        */
};

struct fit_estimates {
    struct fit_channel_estimate channels[FIT_CHANNEL_COUNT];
    struct fit_interval gains[FIT_TARGET_LIMIT], balances[FIT_CHANNEL_COUNT];
    struct fit_interval ambients[FIT_TARGET_LIMIT][FIT_CHANNEL_COUNT]; /* W/mm^2: the gain is taken out */
    struct fit_interval blacks[FIT_TARGET_LIMIT][FIT_CHANNEL_COUNT];
    double rms_residual;
    double misfit; /* relative, of the model and not of noise: what residuals have in common within tiles */
    double *covariance;      /* parameter_count^2; free() it                                           */
    double *singular_values; /* parameter_count, of the scaled derivatives; in the same memory         */
};

/*
 * Judge a minimum of the problem, whose data must have the weights it was found with. Where the sum of
 * squares is not quadratic an interval's ends are searched for, which takes most of the time: not if
 * is_quick. stop (may be NULL) ends that early, too. Fails with DIPOLE_OUT_OF_MEMORY; nothing is then to be
 * freed.
 */
DIPOLE_CHECKED bool fit_judge(struct fit_problem *problem, const struct fit_minimum *minimum, bool is_quick,
                              const volatile sig_atomic_t *stop, struct fit_estimates *out,
                              dipole_status *status);

#endif
