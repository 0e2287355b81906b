#include "fit/picture.h"

#include "fit/pixels.h"
#include "renderer/render.h"

#include <math.h>
#include <stdio.h>

/*
 * How far apart light samples may be, where the picture does not say it, is known once the medium is. The
 * first round takes what samples it can afford, whatever the start says: samples too far apart make dots,
 * and a fit to dots finds a medium that hides them. Later rounds take the spacing that the coefficients
 * found ask for.
 */
#define OPERATOR_EPSILON 0.001    /* aliasing of the operator's own light samples             */
#define OPERATOR_EPSILON_MAX 0.02 /* the same where samples run out: more is no answer         */
#define PROBE_ACROSS 48.0         /* samples across the scene in the first drawing             */
#define FIRST_SAMPLES 60000.0
#define SAMPLE_LIMIT 400000.0
#define PAIR_LIMIT 1e9 /* pixels times samples: a few seconds on two cores          */
#define PIXEL_LIMIT 20000.0
#define PIXEL_LOW_LIMIT 4000.0
#define FINEST_SHARE 0.1 /* of the spacing: shortest mean free path looked for        */
#define PI 3.14159265358979323846
enum { ROUND_LIMIT = 6, PROBE_LIMIT = 3 };

/* What a picture of render says about its errors are bounds. Taken as even distributions they have a
 * standard deviation of bound / sqrt(3), and 95 % intervals still reach the bounds. */
#define BOUND_TO_DEVIATION 0.5773502691896258

/* What no stated bound covers. Single precision: pictures drawn to 1e-3 and better still differ from the
 * operator by 1e-4 to 2e-4. And far light samples put together on curved surfaces: spheres, knots and the
 * dark side of back-lit shapes have up to 4e-4 of their mean too much everywhere. */
#define PRECISION_ERROR 2e-4
#define FAR_LIGHT_ERROR 4e-4

/* Relative errors of a picture that says nothing about itself: a camera's exposure and flat field. */
#define UNSTATED_SCALE_ERROR 0.01
#define UNSTATED_TILE_ERROR 0.005

/* What the picture says about its own making. */
struct picture_errors {
    double cut_mm, scale_error, tile_error, offset_error;
    double spacing_mm; /* of its light samples; 0: not stated */
};

static double attribute_number(const struct io_image *picture, const char *name, double fallback)
{
    const struct io_attribute *attribute = io_image_find(picture, name);
    const bool is_number = attribute && attribute->kind == IO_ATTRIBUTE_NUMBER &&
                           attribute->numbers[0] > 0.0 && isfinite(attribute->numbers[0]);
    return is_number ? attribute->numbers[0] : fallback;
}

/*
 * A picture by splats is cut off at r_max, as if the medium absorbed more, and it has light samples of a
 * known spacing. The operator does the same, so that what is left is the error of the table and of far
 * samples put together, which scales the picture. With epsilon alone everything may be in the scale.
 */
static struct picture_errors picture_errors(const struct io_image *picture)
{
    const double epsilon = attribute_number(picture, "dipole:epsilon", 0.0);
    if (!(epsilon > 0.0))
        return (struct picture_errors){ .cut_mm = INFINITY,
                                        .scale_error = UNSTATED_SCALE_ERROR,
                                        .tile_error = UNSTATED_TILE_ERROR };
    const double spacing_mm = attribute_number(picture, "dipole:spacing_mm", 0.0);
    const double bound = spacing_mm > 0.0 ? attribute_number(picture, "dipole:table_error", epsilon) +
                                                attribute_number(picture, "dipole:banding_error", 0.0) +
                                                attribute_number(picture, "dipole:blur_error", 0.0)
                                          : epsilon;
    const double deviation = hypot(bound * BOUND_TO_DEVIATION, PRECISION_ERROR);
    return (struct picture_errors){ .cut_mm = attribute_number(picture, "dipole:r_max_mm", INFINITY),
                                    .spacing_mm = spacing_mm,
                                    .scale_error = deviation,
                                    .tile_error = deviation,
                                    .offset_error = FAR_LIGHT_ERROR };
}

/* ---- one round --------------------------------------------------------------------------------------- */

struct round {
    const struct fit_picture_request *request;
    struct picture_errors errors;
    double spacing_mm;
    dipole_medium media[FIT_CHANNEL_COUNT]; /* where the search begins */
};

/* Shows a part of a whole: rounds shrink towards the end of the bar. */
struct part {
    const struct fit_progress *whole;
    int round;
};

static void show_part(void *context, const char *what, double fraction)
{
    const struct part *part = context;
    if (!part->whole->show)
        return;
    char text[96];
    snprintf(text, sizeof text, "round %d: %s", part->round, what);
    const double done = 1.0 - pow(0.5, part->round - 1 + fraction);
    part->whole->show(part->whole->context, text, done);
}

static bool estimate_channels(const struct round *round, const struct fit_operator *op,
                              const struct fit_measurement *measurement, double finest_mm,
                              struct part *part, struct fit_picture_result *result, dipole_status *status)
{
    double squares = 0.0;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        struct fit_estimate *estimate = &result->channels[c];
        show_part(part, "solving", 0.9 + 0.03 * c);
        if (!fit_estimate_channel(op, c, measurement, &round->media[c], finest_mm, estimate, status))
            return false;
        squares += estimate->rms_residual * estimate->rms_residual;
    }
    result->rms_residual = sqrt(squares / FIT_CHANNEL_COUNT);
    return true;
}

static bool estimate_from_pixels(const struct round *round, const struct render_capture *capture,
                                 const struct fit_pixels *pixels, struct part *part,
                                 struct fit_picture_result *result, dipole_status *status)
{
    const double finest_mm = FINEST_SHARE * round->spacing_mm;
    const struct fit_geometry geometry = {
        .positions_mm = pixels->positions_mm,
        .pixel_count = pixels->count,
        .samples = capture->samples.samples,
        .sample_count = capture->samples.count,
        .cut_mm = round->errors.cut_mm,
        .finest_mm = finest_mm,
    };
    const struct fit_measurement measurement = {
        .radiosity_w_per_mm2 = pixels->radiosity_w_per_mm2,
        .tiles = pixels->tiles,
        .tile_count = pixels->tile_count,
        .scale_error = round->errors.scale_error,
        .tile_error = round->errors.tile_error,
        .offset_error = round->errors.offset_error,
    };
    const struct fit_progress progress = { .show = show_part, .context = part };
    struct fit_operator *op = NULL;
    const bool done = fit_operator_create(&geometry, &progress, &op, status) &&
                      estimate_channels(round, op, &measurement, finest_mm, part, result, status);
    fit_operator_destroy(op);
    return done;
}

static bool capture_light(struct renderer *renderer, double spacing_mm, struct render_capture **capture_out,
                          dipole_status *status)
{
    if (!render_capture_create(renderer, spacing_mm, capture_out, status))
        return false;
    if ((*capture_out)->samples.count == 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "no light enters an object of the scene, expected some to fit");
    return true;
}

static bool run_round(const struct round *round, struct renderer *renderer, struct part *part,
                      struct fit_picture_result *result, dipole_status *status)
{
    struct render_capture *capture = NULL;
    struct fit_pixels *pixels = NULL;
    const dipole_place place = { .source = round->request->picture_path };
    show_part(part, "drawing", 0.0);
    bool done = capture_light(renderer, round->spacing_mm, &capture, status);
    if (done) {
        const double sample_count = (double)capture->samples.count;
        const double limit = fmin(fmax(PAIR_LIMIT / sample_count, PIXEL_LOW_LIMIT), PIXEL_LIMIT);
        result->sample_count = capture->samples.count;
        done = fit_pixels_create(capture, round->request->picture, (size_t)limit, &place, &pixels, status);
    }
    if (done) {
        result->pixel_count = pixels->count;
        result->usable_pixel_count = pixels->usable_count;
        done = estimate_from_pixels(round, capture, pixels, part, result, status);
    }
    fit_pixels_destroy(pixels);
    render_capture_destroy(capture);
    return done;
}

/* ---- the rounds -------------------------------------------------------------------------------------- */

static double diagonal_mm(const struct io_scene *scene)
{
    double squares = 0.0;
    for (int a = 0; a < 3; a++)
        squares += pow(scene->max_mm[a] - scene->min_mm[a], 2.0);
    return sqrt(squares);
}

/* The spacing at which about limit samples cover what count samples cover now. */
static double spacing_for(double limit, double spacing_mm, size_t count)
{
    return spacing_mm * sqrt((double)count / limit);
}

/* Draw only to count, until the spacing makes about as many samples as the first round should have: coarse
 * drawings follow the shape's depth, not its area. */
static bool find_first_spacing(const struct fit_picture_request *request, struct renderer *renderer,
                               double *spacing_mm_out, dipole_status *status)
{
    double spacing_mm = diagonal_mm(request->scene) / PROBE_ACROSS;
    bool done = true, is_found = false;
    for (int probe = 0; done && !is_found && probe < PROBE_LIMIT; probe++) {
        struct render_capture *capture = NULL;
        done = capture_light(renderer, spacing_mm, &capture, status);
        if (done) {
            const double wanted_mm = spacing_for(FIRST_SAMPLES, spacing_mm, capture->samples.count);
            is_found = wanted_mm > 0.7 * spacing_mm && wanted_mm < 1.4 * spacing_mm;
            spacing_mm = wanted_mm;
        }
        render_capture_destroy(capture);
    }
    *spacing_mm_out = spacing_mm;
    return done;
}

/* The spacing that the media found ask for, INFINITY where no channel says anything. A channel whose search
 * ended at the shortest mean free path it may take asks for the next finer one. */
static double spacing_wanted_mm(const struct round *round, const struct fit_picture_result *result)
{
    double wanted_mm = INFINITY;
    const double bound_per_mm = 1.0 / (FINEST_SHARE * round->spacing_mm);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        dipole_coefficients coefficients;
        const bool is_dark = result->channels[c].iteration_count == 0;
        if (is_dark || !dipole_coefficients_init(&round->media[c], &coefficients, NULL))
            continue;
        const bool is_at_bound = round->media[c].sigma_s_prime_per_mm > 0.9 * bound_per_mm ||
                                 round->media[c].sigma_a_per_mm > 0.9 * bound_per_mm;
        if (result->channels[c].is_identifiable || is_at_bound)
            wanted_mm = fmin(wanted_mm, dipole_splat_spacing_mm(&coefficients, OPERATOR_EPSILON));
    }
    return wanted_mm;
}

static void take_media(struct round *round, const struct fit_picture_result *result)
{
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        round->media[c].sigma_a_per_mm = result->channels[c].sigma_a_per_mm;
        round->media[c].sigma_s_prime_per_mm = result->channels[c].sigma_s_prime_per_mm;
    }
}

/* Whether the samples that could be had do, though the coefficients found ask for more. */
static bool are_samples_close(const struct round *round, struct fit_picture_result *result,
                              double wanted_mm)
{
    double aliasing = 0.0;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        dipole_coefficients coefficients;
        if (result->channels[c].is_identifiable &&
            dipole_coefficients_init(&round->media[c], &coefficients, NULL))
            aliasing = fmax(aliasing, 4.0 * dipole_spectrum(&coefficients, 2.0 * PI / round->spacing_mm) /
                                          dipole_spectrum(&coefficients, 0.0));
    }
    snprintf(
        result->note, sizeof result->note,
        "the coefficients found ask for light samples %.3g mm apart, more than %.0f of them; with %.3g mm "
        "sampling errs by up to %.2g %%",
        wanted_mm, SAMPLE_LIMIT, round->spacing_mm, 100.0 * aliasing);
    return aliasing <= OPERATOR_EPSILON_MAX;
}

static bool run_rounds(struct round *round, struct renderer *renderer, struct fit_picture_result *result,
                       dipole_status *status)
{
    bool is_spaced = false, is_limited = false;
    while (!is_spaced && !is_limited && result->round_count < ROUND_LIMIT) {
        struct part part = { .whole = &round->request->progress, .round = ++result->round_count };
        if (!run_round(round, renderer, &part, result, status))
            return false;
        take_media(round, result);
        result->spacing_mm = round->spacing_mm;
        const double wanted_mm = spacing_wanted_mm(round, result);
        const double least_mm = spacing_for(SAMPLE_LIMIT, round->spacing_mm, result->sample_count);
        is_spaced = round->errors.spacing_mm > 0.0 || wanted_mm >= 0.95 * round->spacing_mm;
        is_limited = !is_spaced && least_mm >= 0.9 * round->spacing_mm;
        if (is_limited)
            is_spaced = are_samples_close(round, result, wanted_mm);
        else
            round->spacing_mm = fmax(0.98 * wanted_mm, least_mm);
    }
    result->has_converged = is_spaced;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        result->has_converged = result->has_converged && result->channels[c].has_converged;
    return true;
}

static bool check_picture(const struct fit_picture_request *request, dipole_status *status)
{
    const struct io_image *picture = request->picture;
    const struct io_camera *camera = &request->scene->camera;
    const dipole_place place = { .source = request->picture_path };
    if (picture->width_px != camera->width_px || picture->height_px != camera->height_px)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "the picture is %dx%d pixels, expected the %dx%d of the scene's camera",
                           picture->width_px, picture->height_px, camera->width_px, camera->height_px);
    if (picture->channel_count < FIT_CHANNEL_COUNT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "the picture has %d channel, expected red, green and blue",
                           picture->channel_count);
    return true;
}

bool fit_picture(const struct fit_picture_request *request, struct fit_picture_result *result_out,
                 dipole_status *status)
{
    if (!check_picture(request, status))
        return false;
    struct fit_picture_result result = { 0 };
    struct round round = { .request = request, .errors = picture_errors(request->picture) };
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        round.media[c] = request->scene->objects[0].material.layers[c][0].medium;
        round.media[c].sigma_a_per_mm = request->start[c].sigma_a_per_mm;
        round.media[c].sigma_s_prime_per_mm = request->start[c].sigma_s_prime_per_mm;
    }
    result.scale_error = round.errors.scale_error;
    result.tile_error = round.errors.tile_error;

    struct renderer *renderer = NULL;
    round.spacing_mm = round.errors.spacing_mm;
    const bool done =
        render_create(request->scene, RENDER_CONTEXT_DEFAULT, &renderer, status) &&
        (round.spacing_mm > 0.0 || find_first_spacing(request, renderer, &round.spacing_mm, status)) &&
        run_rounds(&round, renderer, &result, status);
    render_destroy(renderer);
    if (done)
        *result_out = result;
    return done;
}
