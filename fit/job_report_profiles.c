/* Profiles of what was found with their bands, beside those that were measured. */
#include "fit/job_report_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* From where on, in mean free paths, to where so much of the light leaves farther away. */
static const double nearest_paths = 0.03, beyond = 1e-4;
/* A profile has its mean over a disc at half the radius that halves its area, or farther out. */
static const double innermost = 0.5;
static const double deviations = 1.96; /* of a normal distribution: 95 % */
/* A band beyond a factor of a thousand either way would hide the curve's own shape. */
static const double widest_log = 6.907755278982137;

/* ---- what was found ---------------------------------------------------------------------------------- */

/* Variance of the logarithm of the profile whose derivative by the parameters' logarithms is given. */
static double variance_of(const struct fit_result *result, int channel,
                          const double gradient[FIT_COEFFICIENT_COUNT])
{
    const size_t n = result->problem.layout.parameter_count;
    const int *const at = result->problem.layout.coefficient[channel];
    double sum = 0;
    for (int i = 0; i < FIT_COEFFICIENT_COUNT; i++) {
        for (int k = 0; k < FIT_COEFFICIENT_COUNT; k++) {
            if (at[i] < 0 || at[k] < 0 || gradient[i] == 0 || gradient[k] == 0)
                continue;
            sum +=
                gradient[i] * gradient[k] * result->estimates.covariance[(size_t)at[i] * n + (size_t)at[k]];
        }
    }
    return sum;
}

/* Evenly on a logarithm; over what was measured, too, if that reaches farther. */
static void place_radii(const dipole_stack *stack, const struct io_profile *measured,
                        struct job_profile *out)
{
    double from_mm = nearest_paths * dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
    double to_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, beyond);
    for (size_t i = 0; measured && i < measured->count; i++) {
        const double r_mm = (measured->r_lo_mm[i] > 0 ? 1 : innermost) * io_profile_r_mm(measured, i);
        from_mm = r_mm > 0 ? fmin(from_mm, r_mm) : from_mm;
        to_mm = fmax(to_mm, r_mm);
    }
    to_mm = fmax(to_mm, 10 * from_mm);
    for (int i = 0; i < JOB_CURVE_COUNT; i++)
        out->r_mm[i] = from_mm * pow(to_mm / from_mm, (double)i / (JOB_CURVE_COUNT - 1));
}

/* False where the band is wider than is drawn. */
static bool evaluate(const struct fit_job *job, int channel, const dipole_stack *stack,
                     struct job_profile *out)
{
    dipole_stack_gradient gradients[JOB_CURVE_COUNT];
    bool is_whole = true;
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, out->r_mm, JOB_CURVE_COUNT, out->rd);
    dipole_stack_profile_gradient(stack, DIPOLE_FACE_LIT, job->form.layer, out->r_mm, JOB_CURVE_COUNT,
                                  gradients);
    for (int i = 0; i < JOB_CURVE_COUNT; i++) {
        const double rd = out->rd[i];
        const double gradient[FIT_COEFFICIENT_COUNT] = { gradients[i].d_log_sigma_a / rd,
                                                         gradients[i].d_log_sigma_s_prime / rd,
                                                         gradients[i].d_log_thickness / rd };
        const double variance = variance_of(&job->result, channel, gradient);
        const double half_width = fmin(deviations * sqrt(fmax(variance, 0)), widest_log);
        is_whole = is_whole && half_width < widest_log;
        out->low[i] = rd * exp(-half_width);
        out->high[i] = rd * exp(half_width);
    }
    return is_whole;
}

static void compute_curve(struct job_page *page, int channel, const dipole_stack *stack,
                          const struct io_profile *measured, struct job_profile *out)
{
    place_radii(stack, measured, out);
    if (!evaluate(page->job, channel, stack, out))
        job_text_add(
            job_page_note(page), JOB_NOTE_SIZE,
            "%s: the band of the profile is wider than a factor of 1000 either way, and drawn only "
            "that wide.",
            out->name);
}

/* ---- what was measured ------------------------------------------------------------------------------- */

/*
 * Where to draw a ring's mean: where the curve has the same mean over the ring, so that points of a perfect
 * fit lie on it (Lafferty and Wyatt 1995). Beyond the curve, what halves the ring's area.
 */
static double ring_r_mm(const struct io_profile *measured, size_t i, const dipole_stack *stack,
                        const struct job_profile *curve)
{
    const double lo_mm = measured->r_lo_mm[i], hi_mm = measured->r_hi_mm[i];
    const double middle_mm = io_profile_r_mm(measured, i);
    if (!(hi_mm > lo_mm))
        return middle_mm;
    const double mean = dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT, lo_mm, hi_mm);
    for (int k = 0; k + 1 < JOB_CURVE_COUNT; k++) {
        const double *const rd = curve->rd + k, *const r_mm = curve->r_mm + k;
        if (!(rd[0] >= mean && mean >= rd[1] && rd[1] > 0 && rd[0] > rd[1]))
            continue;
        const double found_mm = r_mm[0] * pow(r_mm[1] / r_mm[0], log(mean / rd[0]) / log(rd[1] / rd[0]));
        return fmin(fmax(found_mm, lo_mm), hi_mm);
    }
    return middle_mm;
}

/* In units of the profile: without the exposure. */
static bool take_measured(const struct io_profile *measured, double gain, const dipole_stack *stack,
                          struct job_profile *curve, struct fit_report_profile *row, dipole_status *status)
{
    const size_t count = measured->count;
    curve->measured = malloc(3 * count * sizeof *curve->measured);
    if (!curve->measured)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a report");
    double *const r_mm = curve->measured, *const rd = r_mm + count, *const sem = rd + count;
    for (size_t i = 0; i < count; i++) {
        r_mm[i] = ring_r_mm(measured, i, stack, curve);
        rd[i] = measured->rd_per_mm2[i] / gain;
        sem[i] = measured->sem_per_mm2 ? measured->sem_per_mm2[i] / gain : 0;
    }
    row->measured_count = count;
    row->measured_r_mm = r_mm;
    row->measured_rd_per_mm2 = rd;
    row->measured_sem_per_mm2 = measured->sem_per_mm2 ? sem : NULL;
    return true;
}

/* target: of a profile, or -1. */
static bool add_profile(struct job_page *page, int channel, int target, dipole_status *status)
{
    const struct fit_job *const job = page->job;
    struct fit_report_profile *const row = &page->profiles[page->report.profile_count];
    struct job_profile *const curve = &page->curves[page->report.profile_count++];
    const struct io_profile *const measured =
        target >= 0 ? job->profiles[(size_t)target - job->picture_count] : NULL;
    const char *const name = job_channel_name(job, channel);
    snprintf(curve->name, sizeof curve->name, "%s%s%s", name, name[0] && target >= 0 ? ": " : "",
             target >= 0 ? page->target_names[target] : "");
    struct fit_state state;
    dipole_stack *stack;
    fit_problem_state(&job->result.problem, target >= 0 ? (size_t)target : 0, channel,
                      job->result.minimum.parameters, &state);
    if (!fit_form_stack_create(&job->result.problem.form, channel, state.logs, &stack, status))
        return false;
    compute_curve(page, channel, stack, measured, curve);
    *row = (struct fit_report_profile){ .name = curve->name,
                                        .count = JOB_CURVE_COUNT,
                                        .r_mm = curve->r_mm,
                                        .rd_per_mm2 = curve->rd,
                                        .low_per_mm2 = curve->low,
                                        .high_per_mm2 = curve->high };
    const bool done = !measured || take_measured(measured, state.gain, stack, curve, row, status);
    dipole_stack_destroy(stack);
    return done;
}

bool job_page_add_profiles(struct job_page *page, dipole_status *status)
{
    const struct fit_job *const job = page->job;
    page->curves = calloc(JOB_PROFILE_LIMIT, sizeof *page->curves);
    bool done = page->curves || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a report");
    for (int c = 0; done && c < job->form.channel_count; c++) {
        bool is_measured = false;
        if (!job->result.problem.has_light[c])
            continue;
        for (size_t t = job->picture_count; done && t < job->result.problem.target_count; t++) {
            const struct fit_target *const target = &job->result.targets[t];
            if (target->totals || target->data[0].channel != c)
                continue;
            is_measured = true;
            done = add_profile(page, c, (int)t, status);
        }
        if (done && !is_measured)
            done = add_profile(page, c, -1, status);
    }
    return done;
}
