#include "accuracy/fits.h"

#include "cli/cli.h"
#include "fit/fit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const struct accuracy_fit_knob accuracy_fit_knobs[ACCURACY_FIT_KNOBS] = {
    { "fit_pixels",
      "Pixels of a fit",
      "How many pixels of the picture a fit takes at the most.",
      { 250, 500, 1000, 2000, 4000, (int)FIT_PIXEL_LIMIT },
      6 },
    { "fit_radii",
      "Radii of a fit",
      "At how many radii for each doubling of r\u00b2 a fit knows the profile.",
      { 1, 2, 4, FIT_NODES_PER_OCTAVE },
      4 },
};

/* The search begins off the truth by these. */
static const double start_factors[] = { 2, 0.6 };

static const char *why_not(const struct accuracy_fits_options *options)
{
    const struct io_scene *const scene = options->scene;
    return options->media->count != 1        ? "it has more than one material"
           : !options->media->has_scattering ? "nothing of it scatters"
           : scene->has_environment          ? "it has light from all around"
           : scene->light_count == 0         ? "it has no light"
                                             : NULL;
}

static struct fit_form start_of(const struct io_material *material)
{
    struct fit_form form = { .model = material->model,
                             .channel_count = FIT_CHANNEL_COUNT,
                             .layer_count = material->layer_count };
    memcpy(form.layers, material->layers, sizeof form.layers);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        dipole_medium *const medium = &form.layers[c][0].medium;
        medium->sigma_a_per_mm *= start_factors[FIT_SIGMA_A];
        medium->sigma_s_prime_per_mm *= start_factors[FIT_SIGMA_S_PRIME];
    }
    return form;
}

static void judge_interval(const struct fit_interval *found, double truth, struct accuracy_fit_point *point)
{
    const double error = fabs(found->value / truth - 1);
    const double half_width = (found->ci95[1] - found->ci95[0]) / (2 * truth);
    point->told_count++;
    point->inside_count += found->ci95[0] <= truth && truth <= found->ci95[1];
    point->error = fmax(point->error, error); /* NAN gives way */
    point->half_width = fmax(point->half_width, half_width);
}

static void judge(const struct fit_result *result, const struct io_material *truth,
                  struct accuracy_fit_point *point)
{
    point->told_count = point->inside_count = 0;
    point->error = point->half_width = NAN;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        const struct fit_channel_estimate *const found = &result->estimates.channels[c];
        const dipole_medium *const medium = &truth->layers[c][0].medium;
        if (!result->problem.has_light[c] || !found->is_identifiable || !(medium->sigma_a_per_mm > 0))
            continue;
        judge_interval(&found->sigma_a_per_mm, medium->sigma_a_per_mm, point);
        judge_interval(&found->sigma_s_prime_per_mm, medium->sigma_s_prime_per_mm, point);
    }
}

/* One fit, from getting a renderer to its intervals; the renderer is not timed. */
static bool run(const struct accuracy_fits_options *options, const struct fit_photo *photo,
                struct accuracy_fit_point *point, double *time_s_out, dipole_status *status)
{
    const struct io_material *const truth = options->media->media[0].material;
    const struct fit_picture_request request = {
        .scene = options->scene,
        .photo = photo,
        .photo_path = options->picture_path,
        .pixel_limit = point->knob == 0 ? (size_t)point->value : 0,
        .nodes_per_octave = point->knob == 1 ? point->value : 0,
    };
    const struct fit_form form = start_of(truth);
    struct fit_picture *picture;
    struct fit_result result;
    if (!fit_picture_create(&request, &picture, status))
        return false;
    const double start_s = cli_now_s();
    const bool done = fit_run(
        &(struct fit_request){
            .form = &form, .pictures = &picture, .picture_count = 1, .stop = options->stop },
        &result, status);
    *time_s_out = cli_now_s() - start_s;
    if (done) {
        judge(&result, truth, point);
        fit_result_destroy(&result);
    }
    fit_picture_destroy(picture);
    return done;
}

static void list_points(struct accuracy_fits *fits)
{
    for (size_t k = 0; k < ACCURACY_FIT_KNOBS; k++) {
        for (size_t i = 0; i < accuracy_fit_knobs[k].value_count; i++)
            fits->points[fits->point_count++] =
                (struct accuracy_fit_point){ .knob = k, .value = accuracy_fit_knobs[k].values[i] };
    }
}

static bool run_all(const struct accuracy_fits_options *options, const struct fit_photo *photo,
                    struct accuracy_fits *fits, dipole_status *status)
{
    const double step_count = (double)fits->point_count * (options->repeat_count + 1);
    double step = 0;
    for (int round = 0; round <= options->repeat_count; round++) {
        for (size_t i = 0; i < fits->point_count; i++) {
            struct accuracy_fit_point *const point = &fits->points[i];
            double time_s;
            if (options->show)
                options->show(options->context, "fits", step++ / step_count);
            if (!run(options, photo, point, &time_s, status))
                return false;
            if (*options->stop) {
                fits->point_count = 0;
                return true;
            }
            if (round > 0)
                point->times_s[point->time_count++] = time_s;
            point->time_s = accuracy_spread_of(point->times_s, point->time_count);
        }
    }
    return true;
}

bool accuracy_fits_measure(const struct accuracy_fits_options *options, struct accuracy_fits *out,
                           dipole_status *status)
{
    struct fit_photo photo;
    dipole_status why = { .code = DIPOLE_OK };
    *out = (struct accuracy_fits){ .point_count = 0 };
    const char *const reason = why_not(options);
    if (reason) {
        snprintf(out->refusal, sizeof out->refusal, "%s", reason);
        return true;
    }
    if (!fit_photo_read(options->picture_path, true, 1, &photo, status))
        return false;
    list_points(out);
    bool done = run_all(options, &photo, out, &why);
    if (!done) {
        out->point_count = 0;
        snprintf(out->refusal, sizeof out->refusal, "%s", why.message);
        done = why.code != DIPOLE_OUT_OF_MEMORY;
        if (!done && status)
            *status = why;
    }
    fit_photo_destroy(&photo);
    return done;
}

double accuracy_fits_halving_cost(const struct accuracy_fits *fits, size_t knob)
{
    double errors[ACCURACY_FIT_POINTS], times_s[ACCURACY_FIT_POINTS];
    size_t count = 0;
    for (size_t i = 0; i < fits->point_count; i++) {
        if (fits->points[i].knob != knob)
            continue;
        errors[count] = fits->points[i].error;
        times_s[count++] = fits->points[i].time_s.median;
    }
    return accuracy_halving_of(errors, times_s, count);
}
