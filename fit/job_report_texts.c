/* What was found, in sentences. */
#include "fit/job_report_parts.h"
#include "fit/noise.h"
#include "fit/report_page.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A share in percent, with two digits. */
static const char *percent(double share, char out[FIT_NUMBER_SIZE])
{
    fit_number_format(100 * share, 2, out);
    return out;
}

/* ---- the verdict ------------------------------------------------------------------------------------- */

/* Few data may exceed their errors by so much. */
static const double largest_usual_chi = 2;
/* Where scene and model are right it is less: fit warns of as much. */
static const double largest_usual_misfit = 0.03;

#define VERDICT_ADD(page, ...) job_text_add((page)->verdict, sizeof(page)->verdict, __VA_ARGS__)

/* The longer side of an interval, relative. */
static double share_of(const struct fit_interval *found)
{
    return fmax(found->value - found->ci95[0], found->ci95[1] - found->value) / found->value;
}

static void say_known(struct job_page *page, int c)
{
    const struct fit_channel_estimate *const found = &page->job->result.estimates.channels[c];
    const char *const name = job_channel_name(page->job, c);
    char numbers[2][FIT_NUMBER_SIZE];
    VERDICT_ADD(page, "%s%ssigma_a is known to %s %%, sigma_s' to %s %%.\n", name, name[0] ? ": " : "",
                percent(share_of(&found->sigma_a_per_mm), numbers[0]),
                percent(share_of(&found->sigma_s_prime_per_mm), numbers[1]));
}

/* The channel's note, of all channels together that have the same one; it is said with the first. */
static void say_unknown(struct job_page *page, int c)
{
    const struct fit_channel_estimate *const channels = page->job->result.estimates.channels;
    const char *const name = job_channel_name(page->job, c);
    for (int k = 0; k < c; k++) {
        if (strcmp(channels[k].note, channels[c].note) == 0)
            return;
    }
    VERDICT_ADD(page, "%s", name);
    for (int k = c + 1; k < page->job->form.channel_count; k++) {
        if (strcmp(channels[k].note, channels[c].note) == 0)
            VERDICT_ADD(page, ", %s", job_channel_name(page->job, k));
    }
    if (name[0])
        VERDICT_ADD(page, ": %s.\n", channels[c].note);
    else
        VERDICT_ADD(page, "%c%s.\n", toupper((unsigned char)channels[c].note[0]), channels[c].note + 1);
}

static void say_channel(struct job_page *page, int c)
{
    if (page->job->result.estimates.channels[c].is_identifiable)
        say_known(page, c);
    else
        say_unknown(page, c);
}

static void say_state(struct job_page *page)
{
    const struct fit_result *const result = &page->job->result;
    VERDICT_ADD(page, "%s %d round%s%s.\n",
                result->is_interrupted  ? "The fit was interrupted after"
                : result->has_converged ? "The fit converged in"
                                        : "The fit did not settle in",
                result->round_count, result->round_count == 1 ? "" : "s",
                result->has_converged ? "" : ": this is the best so far");
}

/* Residuals over the errors that the data were given, the root of chi^2 per degree of freedom. */
static double chi_of(const struct fit_result *result)
{
    double freedom = -(double)result->problem.layout.parameter_count;
    for (size_t t = 0; t < result->problem.target_count; t++)
        freedom += (double)result->targets[t].datum_count;
    return freedom > 0 ? sqrt(result->minimum.sum_of_squares / freedom) : 0;
}

/* What of the residuals is the same over whole parts of a target is no noise: a model or a scene that are
 * not what was measured. T40 */
static void say_limits(struct job_page *page)
{
    const struct fit_result *const result = &page->job->result;
    const double misfit = result->estimates.misfit, rms = result->estimates.rms_residual;
    const double chi = chi_of(result);
    char number[FIT_NUMBER_SIZE];
    if (misfit > largest_usual_misfit) {
        VERDICT_ADD(page,
                    "The model does not describe the target: beyond noise it is off by %s %% over whole "
                    "parts of it. %s",
                    percent(misfit, number),
                    page->job->picture_count > 0 ? "The cause may be a tone curve, another shape or light, "
                                                   "or a medium that it does not describe."
                                                 : "Another model, or another index of refraction, may.");
    } else if (misfit > 0) {
        VERDICT_ADD(page,
                    "Beyond noise the model is off by %s %% over whole parts of the target, which the "
                    "intervals allow for%s.",
                    percent(misfit, number),
                    misfit * misfit > 0.5 * rms * rms ? ": that limits them more than noise does" : "");
    } else if (chi > largest_usual_chi) {
        fit_number_format(chi, 2, number);
        VERDICT_ADD(page,
                    "The residuals are %s times as large as the errors that were stated or assumed: the "
                    "model does not describe the target, or these errors are too small.",
                    number);
    } else {
        VERDICT_ADD(page, "The residuals have nothing in common over whole parts of the target: what "
                          "limits the intervals is noise.");
    }
    if (result->note_count > 0)
        VERDICT_ADD(page, " What else limits them stands in the notes.");
}

void job_page_add_verdict(struct job_page *page)
{
    for (int c = 0; c < page->job->form.channel_count; c++)
        say_channel(page, c);
    if (page->job->form.is_thickness_sought) {
        const struct fit_interval *const found = &page->job->result.estimates.channels[0].thickness_mm;
        char number[FIT_NUMBER_SIZE];
        VERDICT_ADD(page, "The thickness is known to %s %%.\n", percent(share_of(found), number));
    }
    say_state(page);
    say_limits(page);
}

/* ---- notes ------------------------------------------------------------------------------------------- */

#define NOTE_ADD(note, ...) job_text_add(note, JOB_NOTE_SIZE, __VA_ARGS__)

static const char *const reasons[FIT_USE_COUNT] = {
    [FIT_USE_NOT_COVERED] = "not wholly covered by one surface (background, silhouettes)",
    [FIT_USE_MASKED] = "masked, as was asked for",
    [FIT_USE_NOT_FINITE] = "not finite",
    [FIT_USE_CLIPPED] = "clipped or beside clipped ones",
    [FIT_USE_DARK] = "too dark to hold a value",
    [FIT_USE_SPECULAR] = "mostly light mirrored at the surface",
    [FIT_USE_SHADOW_EDGE] = "crossed by the edge of a shadow",
};

static void note_picture(struct job_page *page, size_t i)
{
    const struct fit_pixels *const pixels = fit_picture_pixels(page->job->pictures[i]);
    char *const note = job_page_note(page);
    const size_t usable = pixels->use_counts[FIT_USE_OK] + pixels->use_counts[FIT_USE_OUTLIER];
    NOTE_ADD(note, "%s: of %d × %d pixels %zu may be used; ", page->target_names[i], pixels->width_px,
             pixels->height_px, usable);
    if (pixels->count < usable)
        NOTE_ADD(note, "%zu of them, spread evenly, were fitted to", pixels->count);
    else
        NOTE_ADD(note, "all of them were fitted to");
    const char *between = "; not used: ";
    for (int use = 0; use < FIT_USE_COUNT; use++) {
        if (!reasons[use] || pixels->use_counts[use] == 0)
            continue;
        NOTE_ADD(note, "%s%zu %s", between, pixels->use_counts[use], reasons[use]);
        between = ", ";
    }
    if (pixels->use_counts[FIT_USE_OUTLIER] > 0)
        NOTE_ADD(note,
                 "; and %zu of those fitted to were given no weight, for they are farther from the model "
                 "than %g standard deviations",
                 pixels->use_counts[FIT_USE_OUTLIER], FIT_NOISE_OUTLIER);
    NOTE_ADD(note, ".");
    const bool is_asked_for = page->job->options->free >> FIT_FREE_EXPOSURE & 1u;
    if (page->job->result.problem.layout.gain[i] >= 0 && !is_asked_for)
        NOTE_ADD(note,
                 " A light's brightness is not stated in its scene, so the exposure was fitted, too.");
}

/* Of a profile or of totals. */
static void note_values(struct job_page *page, size_t t)
{
    const struct fit_target *const target = &page->job->result.targets[t];
    char *const note = job_page_note(page);
    size_t ignored = 0;
    for (size_t i = 0; i < target->datum_count; i++)
        ignored += !(target->data[i].robust > 0);
    NOTE_ADD(note, "%s: %zu values were fitted to", page->target_names[t], target->datum_count);
    if (ignored > 0)
        NOTE_ADD(note,
                 ", of which %zu were given no weight, for they are farther from the model than %g "
                 "standard deviations",
                 ignored, FIT_NOISE_OUTLIER);
    NOTE_ADD(note, ".%s",
             target->are_sigmas_stated ? ""
                                       : " The file has no standard errors: each value was given the same "
                                         "relative one, until the residuals told more.");
    const size_t profile = t - page->job->picture_count;
    if (profile < page->job->profile_count && page->job->profiles[profile]->has_rings)
        NOTE_ADD(note, " A ring's mean is drawn where the profile found has its own mean over the ring.");
}

/* Which models were tried, and what they left. */
static void note_models(struct job_page *page)
{
    const struct fit_result *const result = &page->job->result;
    char number[FIT_NUMBER_SIZE];
    if (result->trial_count < 2)
        return;
    char *const note = job_page_note(page);
    NOTE_ADD(note, "No model was asked for; the rms residuals are");
    for (size_t i = 0; i < result->trial_count; i++)
        NOTE_ADD(note, "%s %s %% with %s", i == 0 ? "" : ",",
                 percent(result->trials[i].rms_residual, number), io_model_names[result->trials[i].model]);
    NOTE_ADD(note, ", and %s was taken.", io_model_names[page->job->form.model]);
}

void job_page_add_notes(struct job_page *page)
{
    const struct fit_job *const job = page->job;
    for (size_t i = 0; i < job->result.note_count; i++)
        NOTE_ADD(job_page_note(page), "%s", job->result.notes[i]);
    if (job->material.warning[0])
        NOTE_ADD(job_page_note(page), "%s", job->material.warning);
    note_models(page);
    for (size_t i = 0; i < job->picture_count; i++)
        note_picture(page, i);
    for (size_t t = job->picture_count; t < job->result.problem.target_count; t++)
        note_values(page, t);
}
