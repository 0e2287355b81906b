#include "fit/certainty.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* An interval wider than a factor of two either way tells an order of magnitude, not a value. */
static const double widest_log_half_width = 0.6931471805599453;
/* Where both are wider than a factor of three they run along a valley whose ends are the small errors of
 * picture and operator, not the medium: then each may be anything that was looked for. */
static const double valley_log_half_width = 1.0986122886681098;
/* A sum that is this part of its terms is what rounding left. */
static const double cancelled_share = 1e-10;

const char *const fit_combination_names[] = { NULL, "alpha_prime", "sigma_tr_per_mm",
                                              "sigma_t_prime_per_mm" };

static double log_half_width(const struct fit_interval *interval)
{
    return 0.5 * log(interval->ci95[1] / interval->ci95[0]);
}

/*
 * Standard error of a combination g whose gradient by log sigma_a and log sigma_s' is given: with u = A^-1
 * g its variance is u' M u. Where nothing is known of the other combination A^-1 is huge, and g' C g would
 * be the difference of huge numbers; u' M u is not.
 */
static double combined_error(const struct fit_certainty *certainty, const int *at, double by_a, double by_s)
{
    const size_t n = certainty->problem->layout.parameter_count;
    const size_t a = (size_t)at[FIT_SIGMA_A], s = (size_t)at[FIT_SIGMA_S_PRIME];
    if (!isfinite(certainty->inverse[a * n + a]) || !isfinite(certainty->inverse[s * n + s]))
        return INFINITY;
    const double parts[] = { by_a * by_a * certainty->inverse[a * n + a],
                             2 * by_a * by_s * certainty->inverse[a * n + s],
                             by_s * by_s * certainty->inverse[s * n + s] };
    const double whole = parts[0] + parts[1] + parts[2];
    double u[FIT_PARAMETER_LIMIT], noise = 0, form = 0;
    for (size_t i = 0; i < n; i++) {
        const double by_i = by_a * certainty->inverse[i * n + a] + by_s * certainty->inverse[i * n + s];
        u[i] = isfinite(by_i) ? by_i : 0;
    }
    for (size_t i = 0; i < n; i++) {
        double row = 0, length = 0;
        for (size_t k = 0; k < n; k++) {
            row += certainty->middle[i * n + k] * u[k];
            length += k >= i ? certainty->triangle[i * n + k] * u[k] : 0;
        }
        form += u[i] * row;
        noise += certainty->noise * length * length;
    }
    const bool is_cancelled = whole < cancelled_share * (parts[0] + fabs(parts[1]) + parts[2]);
    return sqrt(fmax(form, is_cancelled ? noise : certainty->noise * whole));
}

/* The best known of alpha', sigma_tr and sigma_t'. T41 */
static void find_combination(const struct fit_certainty *certainty, int channel,
                             struct fit_channel_estimate *out)
{
    const int *const at = certainty->problem->layout.coefficient[channel];
    const double a = out->sigma_a_per_mm.value, s = out->sigma_s_prime_per_mm.value, t = a + s;
    const struct {
        enum fit_combination name;
        double by_a, by_s, logarithm;
    } candidates[] = {
        { FIT_ALPHA_PRIME, -1, 1, log(s / a) }, /* the logit of alpha' */
        { FIT_SIGMA_TR, 0.5 + 0.5 * a / t, 0.5 * s / t, log(sqrt(3 * a * t)) },
        { FIT_SIGMA_T_PRIME, a / t, s / t, log(t) },
    };
    double least = widest_log_half_width;
    for (size_t i = 0; i < sizeof candidates / sizeof candidates[0]; i++) {
        const double half_width =
            certainty->quantile * combined_error(certainty, at, candidates[i].by_a, candidates[i].by_s);
        /* what counts for alpha' is alpha' itself, which a small albedo's logit overstates */
        const bool is_alpha = candidates[i].name == FIT_ALPHA_PRIME;
        const double counted = is_alpha ? half_width * fmin(1, 10 * a / t) : half_width;
        if (!(counted < least))
            continue;
        least = counted;
        out->combination = candidates[i].name;
        for (int k = 0; k < 3; k++) {
            const double log_value = candidates[i].logarithm + (k == 0   ? 0
                                                                : k == 1 ? -half_width
                                                                         : half_width);
            const double value = is_alpha ? 1 / (1 + exp(-log_value)) : exp(log_value);
            *(k == 0 ? &out->combined.value : &out->combined.ci95[k - 1]) = value;
        }
        if (is_alpha) { /* what both coefficients allow, where the logit is far from quadratic */
            const double *const by_a = out->sigma_a_per_mm.ci95, *const by_s =
                                                                     out->sigma_s_prime_per_mm.ci95;
            out->combined.ci95[0] = fmax(out->combined.ci95[0], by_s[0] / (by_s[0] + by_a[1]));
            out->combined.ci95[1] = fmin(out->combined.ci95[1], by_s[1] / (by_s[1] + by_a[0]));
        }
    }
}

/* Whether brightness tells next to nothing, as the exposure of every target of the channel is free and
 * unknown. */
static bool is_exposure_unknown(const struct fit_certainty *certainty, int channel)
{
    const struct fit_problem *const problem = certainty->problem;
    const size_t n = problem->layout.parameter_count;
    bool is_unknown = true;
    for (size_t t = 0; t < problem->target_count; t++) {
        const int at = problem->layout.gain[t];
        if (!(problem->targets[t].value_scale[channel] > 0))
            continue;
        is_unknown = is_unknown && at >= 0 &&
                     !(certainty->quantile * sqrt(certainty->covariance[(size_t)at * n + (size_t)at]) <
                       valley_log_half_width);
    }
    return is_unknown;
}

static void open_valley(const struct fit_certainty *certainty, int channel,
                        struct fit_channel_estimate *out)
{
    const int *const at = certainty->problem->layout.coefficient[channel];
    struct fit_interval *const intervals[] = { &out->sigma_a_per_mm, &out->sigma_s_prime_per_mm };
    const bool is_valley = log_half_width(intervals[0]) > valley_log_half_width &&
                           log_half_width(intervals[1]) > valley_log_half_width;
    if (!is_valley && !is_exposure_unknown(certainty, channel))
        return;
    for (int p = 0; p < FIT_THICKNESS; p++) {
        intervals[p]->ci95[0] = exp(certainty->problem->lower[at[p]]);
        intervals[p]->ci95[1] = exp(certainty->problem->upper[at[p]]);
    }
}

/* The least absorption that is looked for cannot be told from none. */
static void let_absorption_vanish(const struct fit_certainty *certainty, int channel,
                                  struct fit_channel_estimate *out)
{
    const int at = certainty->problem->layout.coefficient[channel][FIT_SIGMA_A];
    if (out->sigma_a_per_mm.ci95[0] > 1.001 * exp(certainty->problem->lower[at]))
        return;
    out->sigma_a_per_mm.ci95[0] = 0;
    if (out->combination == FIT_ALPHA_PRIME)
        out->combined.ci95[1] = 1;
}

static void explain(const struct fit_certainty *certainty, int channel, struct fit_channel_estimate *out)
{
    static const char *const texts[] = { "", "the albedo alpha' is", "sigma_tr is", "sigma_t' is" };
    static const char *const units[] = { "", "", "/mm", "/mm" };
    const bool is_a_known = log_half_width(&out->sigma_a_per_mm) <= widest_log_half_width;
    const bool is_s_known = log_half_width(&out->sigma_s_prime_per_mm) <= widest_log_half_width;
    out->is_identifiable = is_a_known && is_s_known;
    if (out->is_identifiable)
        return;
    find_combination(certainty, channel, out);
    open_valley(certainty, channel, out);
    let_absorption_vanish(certainty, channel, out);
    const bool is_a_told = log_half_width(&out->sigma_a_per_mm) <= widest_log_half_width;
    const bool is_s_told = log_half_width(&out->sigma_s_prime_per_mm) <= widest_log_half_width;
    char told[96] = "nothing else either";
    if (out->combination != FIT_COMBINATION_NONE)
        snprintf(told, sizeof told, "%s %.4g%s [%.4g, %.4g]", texts[out->combination], out->combined.value,
                 units[out->combination], out->combined.ci95[0], out->combined.ci95[1]);
    if (is_s_told) {
        const bool is_low = out->sigma_a_per_mm.ci95[0] < 1e-3 * out->sigma_a_per_mm.ci95[1];
        snprintf(out->note, sizeof out->note,
                 is_low
                     ? "the target does not show how little light is absorbed: sigma_a may be anything up "
                       "to %.3g/mm"
                     : "the target does not show how much light is absorbed: sigma_a may be up to %.3g/mm",
                 out->sigma_a_per_mm.ci95[1]);
    } else if (is_a_told) {
        snprintf(
            out->note, sizeof out->note,
            "the target does not show how the light is scattered: sigma_s' may be anything from %.3g to "
            "%.3g/mm",
            out->sigma_s_prime_per_mm.ci95[0], out->sigma_s_prime_per_mm.ci95[1]);
    } else {
        snprintf(
            out->note, sizeof out->note,
            "the target cannot tell sigma_a from sigma_s', which can change together; what it tells: %s; "
            "a shadow's edge, a narrow beam or a thin part would tell them apart",
            told);
    }
}

static void judge_channel(const struct fit_certainty *certainty, int channel,
                          struct fit_channel_estimate *out)
{
    const struct fit_problem *const problem = certainty->problem;
    const int *const at = problem->layout.coefficient[channel];
    if (!problem->has_light[channel]) {
        double logs[FIT_COEFFICIENT_COUNT];
        fit_form_start(&problem->form, channel, logs);
        const double lowest = DIPOLE_SIGMA_MIN_PER_MM, highest = DIPOLE_SIGMA_MAX_PER_MM;
        out->sigma_a_per_mm = (struct fit_interval){ exp(logs[FIT_SIGMA_A]), { lowest, highest } };
        out->sigma_s_prime_per_mm =
            (struct fit_interval){ exp(logs[FIT_SIGMA_S_PRIME]), { lowest, highest } };
        snprintf(out->note, sizeof out->note,
                 "no light enters or leaves in this channel: it tells nothing, the start stands");
        return;
    }
    out->sigma_a_per_mm = fit_certainty_of_logarithm(certainty, at[FIT_SIGMA_A], false);
    out->sigma_s_prime_per_mm = fit_certainty_of_logarithm(certainty, at[FIT_SIGMA_S_PRIME], false);
    const size_t n = problem->layout.parameter_count;
    const size_t a = (size_t)at[FIT_SIGMA_A], s = (size_t)at[FIT_SIGMA_S_PRIME];
    const double *const c = certainty->covariance;
    const double both = c[a * n + s] / sqrt(c[a * n + a] * c[s * n + s]);
    out->correlation = isfinite(both) ? fmin(fmax(both, -1), 1) : 0;
    explain(certainty, channel, out);
}

static void judge_thickness(const struct fit_certainty *certainty, struct fit_estimates *out)
{
    const struct fit_form *const form = &certainty->problem->form;
    struct fit_interval found = { 0 };
    if (form->is_thickness_sought)
        found = fit_certainty_of_logarithm(certainty,
                                           certainty->problem->layout.coefficient[0][FIT_THICKNESS], false);
    for (int c = 0; c < form->channel_count; c++) {
        const double known_mm = form->layers[c][form->layer].thickness_mm;
        out->channels[c].thickness_mm =
            form->is_thickness_sought ? found : (struct fit_interval){ known_mm, { known_mm, known_mm } };
    }
}

static void judge_nuisances(const struct fit_certainty *certainty, struct fit_estimates *out)
{
    const struct fit_problem *const problem = certainty->problem;
    const struct fit_layout *const layout = &problem->layout;
    const struct fit_interval one = { 1, { 1, 1 } };
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        out->balances[c] =
            layout->balance[c] >= 0 ? fit_certainty_of_logarithm(certainty, layout->balance[c], true) : one;
    for (size_t t = 0; t < problem->target_count; t++) {
        const struct fit_target *const target = &problem->targets[t];
        out->gains[t] =
            layout->gain[t] >= 0 ? fit_certainty_of_logarithm(certainty, layout->gain[t], true) : one;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            if (layout->ambient[t][c] >= 0)
                out->ambients[t][c] = fit_certainty_of_number(
                    certainty, layout->ambient[t][c],
                    target->ambient_scale[c] / (out->gains[t].value * out->balances[c].value));
            if (layout->black[t][c] >= 0)
                out->blacks[t][c] =
                    fit_certainty_of_number(certainty, layout->black[t][c], target->value_scale[c]);
        }
    }
}

bool fit_judge(struct fit_problem *problem, const struct fit_minimum *minimum, bool is_quick,
               const volatile sig_atomic_t *stop, struct fit_estimates *out, dipole_status *status)
{
    const size_t n = problem->layout.parameter_count;
    struct fit_certainty certainty = {
        .problem = problem, .minimum = minimum, .is_quick = is_quick, .stop = stop
    };
    *out = (struct fit_estimates){ 0 };
    double *const memory = calloc(4 * n * n + n + 1, sizeof *memory);
    if (!memory)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the intervals");
    certainty.covariance = memory;
    certainty.singular = memory + n * n;
    certainty.inverse = certainty.singular + n;
    certainty.triangle = certainty.inverse + n * n;
    certainty.middle = certainty.triangle + n * n;
    if (n > 0 && !fit_certainty_find(&certainty, out, status)) {
        free(memory);
        return false;
    }
    for (int c = 0; c < problem->form.channel_count; c++)
        judge_channel(&certainty, c, &out->channels[c]);
    judge_thickness(&certainty, out);
    judge_nuisances(&certainty, out);
    out->covariance = certainty.covariance;
    out->singular_values = certainty.singular;
    return true;
}
