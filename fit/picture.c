#include "fit/picture.h"

#include "fit/blur.h"
#include "renderer/footprint.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/*
 * How far apart light samples may be is known once the medium is. The first round takes what samples it can
 * afford, whatever the start says: samples too far apart make dots, and a fit to dots finds a medium that
 * hides them. Later rounds take the spacing that the coefficients found ask for.
 */
static const double blur_share = 0.65; /* of the spacing: aliasing is then below 2e-3 of the total     */
static const double blur_error_aim = 0.003; /* of the edge of a shadow, T34 */
static const double probe_across = 48; /* samples across the scene in the first drawing                 */
static const double first_samples = 200000, sample_limit = 1500000;
static const double finest_share = 0.1; /* of the spacing: shortest mean free path looked for           */
static const double bound_to_deviation = 0.5773502691896258;
enum { PROBE_LIMIT = 3 };

struct fit_picture {
    struct fit_picture_request request;
    struct renderer *renderer;
    struct io_image *direct; /* by direct light alone */
    struct render_capture *capture;
    struct fit_pixels *pixels;
    struct fit_operator *op;
    struct fit_blur *blurs[FIT_CHANNEL_COUNT]; /* with the same nodes; alike ones only once */
    struct fit_datum *data;
    double spacing_mm;
    struct fit_systematic systematic; /* before what sampling adds */
};

static void forget_target(struct fit_picture *picture)
{
    fit_pixels_destroy(picture->pixels);
    fit_operator_destroy(picture->op);
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        free(picture->blurs[c]);
        picture->blurs[c] = NULL;
    }
    free(picture->data);
    picture->pixels = NULL;
    picture->op = NULL;
    picture->data = NULL;
}

void fit_picture_destroy(struct fit_picture *picture)
{
    if (!picture)
        return;
    forget_target(picture);
    render_capture_destroy(picture->capture);
    io_image_destroy(picture->direct);
    render_destroy(picture->renderer);
    free(picture);
}

static bool check_size(const struct io_image *image, const char *what, const struct io_camera *camera,
                       const dipole_place *place, dipole_status *status)
{
    return (image->width_px == camera->width_px && image->height_px == camera->height_px) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, place,
                       "the %s is %dx%d pixels, expected the %dx%d of the scene's camera", what,
                       image->width_px, image->height_px, camera->width_px, camera->height_px);
}

bool fit_picture_create(const struct fit_picture_request *request, struct fit_picture **picture_out,
                        dipole_status *status)
{
    const struct io_camera *const camera = &request->scene->camera;
    const dipole_place place = { .source = request->photo_path };
    *picture_out = NULL;
    if (!check_size(request->photo->image, "picture", camera, &place, status) ||
        (request->mask && !check_size(request->mask, "mask", camera, &place, status)))
        return false;
    struct fit_picture *const picture = calloc(1, sizeof *picture);
    if (!picture)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a picture");
    picture->request = *request;
    const struct render_options options = { .technique = RENDER_TECHNIQUE_LAMBERT };
    if (!render_create(request->scene, RENDER_CONTEXT_DEFAULT, &picture->renderer, status) ||
        !render_draw(picture->renderer, &options, &picture->direct, NULL, status)) {
        fit_picture_destroy(picture);
        return false;
    }
    *picture_out = picture;
    return true;
}

/* ---- light ------------------------------------------------------------------------------------------- */

static bool capture_light(struct fit_picture *picture, double spacing_mm, dipole_status *status)
{
    render_capture_destroy(picture->capture);
    picture->capture = NULL;
    if (!render_capture_create(picture->renderer, spacing_mm, &picture->capture, status))
        return false;
    const dipole_place place = { .source = picture->request.scene->path };
    return picture->capture->samples.count > 0 ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                       "no light enters an object of the scene, expected some to fit");
}

static double diagonal_mm(const struct io_scene *scene)
{
    double squares = 0;
    for (int a = 0; a < 3; a++)
        squares += pow(scene->max_mm[a] - scene->min_mm[a], 2);
    return sqrt(squares);
}

/* The spacing at which about limit samples cover what the capture's cover now. */
static double spacing_for(const struct fit_picture *picture, double limit, double spacing_mm)
{
    return spacing_mm * sqrt((double)picture->capture->samples.count / limit);
}

/* Draw only to count, until the spacing makes about as many samples as the first round should have: coarse
 * drawings follow the shape's depth, not its area. */
static bool find_first_spacing(struct fit_picture *picture, dipole_status *status)
{
    double spacing_mm = diagonal_mm(picture->request.scene) / probe_across;
    bool is_found = false;
    for (int probe = 0; !is_found && probe < PROBE_LIMIT; probe++) {
        if (!capture_light(picture, spacing_mm, status))
            return false;
        const double wanted_mm = spacing_for(picture, first_samples, spacing_mm);
        is_found = wanted_mm > 0.7 * spacing_mm && wanted_mm < 1.4 * spacing_mm;
        spacing_mm = wanted_mm;
    }
    picture->spacing_mm = spacing_mm;
    return true;
}

/* ---- the target -------------------------------------------------------------------------------------- */

/* About what the picture is, in the capture's units: its sum over the sum by direct light, which has about
 * as much light in it. */
static double guess_gain(const struct fit_picture *picture)
{
    const struct io_image *const image = picture->request.photo->image;
    double seen = 0, expected = 0;
    if (!picture->request.is_gain_free)
        return 1;
    for (size_t i = 0; i < (size_t)image->width_px * (size_t)image->height_px; i++) {
        if (!(picture->capture->coverage[i] >= 1))
            continue;
        for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++) {
            const double value = (double)image->pixels[i * (size_t)image->channel_count + c];
            seen += isfinite(value) ? value : 0;
            expected += (double)picture->direct->pixels[4 * i + c];
        }
    }
    return seen > 0 && expected > 0 ? seen / expected : 1;
}

static bool choose_pixels(struct fit_picture *picture, dipole_status *status)
{
    const size_t limit = picture->request.pixel_limit > 0 ? picture->request.pixel_limit : FIT_PIXEL_LIMIT;
    const struct fit_pixel_request request = {
        .capture = picture->capture,
        .photo = picture->request.photo,
        .mask = picture->request.mask,
        .direct = picture->direct,
        .gain = guess_gain(picture),
        .limit = limit,
    };
    const dipole_place place = { .source = picture->request.photo_path };
    return fit_pixels_create(&request, &place, &picture->pixels, status);
}

/* What samples are averaged over, or what a picture by render says that it was, if that is more. */
static double blur_of(const struct fit_picture *picture, int channel)
{
    return fmax(blur_share * picture->spacing_mm, picture->request.photo->blur_mm[channel]);
}

/* The blur of a channel: its own, or that of the first channel that is blurred alike. */
static const struct fit_blur *blur_for(const struct fit_picture *picture, int channel)
{
    int first = 0;
    while (blur_of(picture, first) != blur_of(picture, channel))
        first++;
    return picture->blurs[first];
}

static bool build_blurs(struct fit_picture *picture, dipole_status *status)
{
    const struct fit_operator *const op = picture->op;
    bool done = true;
    for (int c = 0; done && c < FIT_CHANNEL_COUNT; c++)
        done = blur_for(picture, c) ||
               fit_blur_create(op->node_r_mm, op->node_count, blur_of(picture, c),
                               blur_share * picture->spacing_mm, &picture->blurs[c], status);
    return done;
}

static bool build_operator(struct fit_picture *picture, const struct fit_progress *progress,
                           dipole_status *status)
{
    const double blur_mm = blur_share * picture->spacing_mm;
    const struct fit_geometry geometry = {
        .positions_mm = picture->pixels->positions_mm,
        .objects = picture->request.scene->object_count > 1 ? picture->pixels->objects : NULL,
        .pixel_count = picture->pixels->count,
        .samples = picture->capture->samples.samples,
        .sample_count = picture->capture->samples.count,
        .cut_mm = picture->request.photo->cut_mm,
        .finest_mm = 1.5 * blur_mm, /* what is blurred has no detail below */
        .nodes_per_octave = picture->request.nodes_per_octave,
    };
    return fit_operator_create(&geometry, progress, &picture->op, status) && build_blurs(picture, status);
}

/* A relative error with a floor, until residuals tell more: T39. */
static const double floor_share = 0.1;

static void set_sigmas(struct fit_target *target)
{
    for (size_t i = 0; i < target->datum_count; i++) {
        struct fit_datum *const datum = &target->data[i];
        datum->sigma = fmax(datum->value, 0) + floor_share * target->value_scale[datum->channel];
    }
}

static bool fill_data(struct fit_picture *picture, struct fit_target *target, dipole_status *status)
{
    const struct fit_pixels *const pixels = picture->pixels;
    const struct render_capture *const capture = picture->capture;
    const struct io_image *const image = picture->request.photo->image;
    picture->data = malloc(FIT_CHANNEL_COUNT * pixels->count * sizeof *picture->data);
    if (!picture->data)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the data of a picture");
    size_t count = 0;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        for (size_t j = 0; j < pixels->count; j++) {
            const size_t pixel = pixels->at[j];
            if (!fit_pixel_has_value(picture->request.photo, pixel, c) || !(picture->op->colour[c] > 0))
                continue;
            const double exit_per_sr = (double)capture->exit_per_sr[pixel];
            picture->data[count++] = (struct fit_datum){
                .row = fit_operator_row(picture->op, c, j),
                .count = picture->op->node_count,
                .factor = exit_per_sr * picture->op->colour[c],
                .constant = (double)capture->specular[pixel * FIT_CHANNEL_COUNT + (size_t)c],
                .ambient_share = exit_per_sr,
                .value = (double)image->pixels[pixel * (size_t)image->channel_count + (size_t)c],
                .robust = 1,
                .channel = c,
                .tile = pixels->tiles[j],
                .place = pixel,
            };
        }
    }
    target->data = picture->data;
    target->datum_count = count;
    return true;
}

/* The mean distance of chosen pixels from their neighbours, where these show the same object. */
static double pixel_size_mm(const struct fit_picture *picture)
{
    const struct render_capture *const capture = picture->capture;
    double sum = 0, count = 0;
    for (size_t j = 0; j < picture->pixels->count; j++) {
        const size_t at = picture->pixels->at[j], next = at + 1;
        if (next % (size_t)capture->width_px == 0 || capture->object[next] != capture->object[at])
            continue;
        double square = 0;
        for (size_t a = 0; a < 3; a++)
            square +=
                pow((double)(capture->position_mm[3 * next + a] - capture->position_mm[3 * at + a]), 2);
        sum += sqrt(square);
        count += 1;
    }
    return sum / fmax(count, 1);
}

/* A channel whose picture is black, or that has a handful of values, tells nothing. */
static void drop_dark_channels(struct fit_target *target)
{
    double sums[FIT_CHANNEL_COUNT] = { 0 }, counts[FIT_CHANNEL_COUNT] = { 0 };
    for (size_t i = 0; i < target->datum_count; i++) {
        sums[target->data[i].channel] += target->data[i].value;
        counts[target->data[i].channel] += 1;
    }
    size_t kept = 0;
    for (size_t i = 0; i < target->datum_count; i++) {
        const int c = target->data[i].channel;
        if (sums[c] > 0 && counts[c] >= 20)
            target->data[kept++] = target->data[i];
    }
    target->datum_count = kept;
}

bool fit_picture_prepare(struct fit_picture *picture, const struct fit_progress *progress,
                         struct fit_target *target_out, dipole_status *status)
{
    forget_target(picture);
    if (progress && progress->show)
        progress->show(progress->context, "drawing", 0);
    if ((!(picture->spacing_mm > 0) && !find_first_spacing(picture, status)) ||
        !capture_light(picture, picture->spacing_mm, status) || !choose_pixels(picture, status) ||
        !build_operator(picture, progress, status))
        return false;
    picture->systematic = picture->request.photo->systematic;
    *target_out = (struct fit_target){
        .node_count = picture->blurs[0]->node_count,
        .node_r_mm = picture->blurs[0]->node_r_mm,
        .blur = { blur_for(picture, 0)->matrix, blur_for(picture, 1)->matrix,
                  blur_for(picture, 2)->matrix },
        .row_node_count = picture->op->node_count,
        .tile_count = picture->pixels->tile_count,
        .is_gain_free = picture->request.is_gain_free,
        .is_ambient_free = picture->request.is_ambient_free,
        .is_black_free = picture->request.is_black_free,
        .is_coloured_by_camera = true,
        .systematic = picture->systematic,
        /* light samples put patches of light together, which errs twice as much as pixels do */
        .pixel_mm = hypot(pixel_size_mm(picture), sqrt(2) * picture->request.photo->spacing_mm),
        .finest_mm = finest_share * picture->spacing_mm,
        .largest_mm = picture->op->node_r_mm[picture->op->node_count - 1],
    };
    const char *const slash = strrchr(picture->request.photo_path, '/');
    snprintf(target_out->name, sizeof target_out->name, "%s",
             slash ? slash + 1 : picture->request.photo_path);
    if (!fill_data(picture, target_out, status))
        return false;
    drop_dark_channels(target_out);
    fit_target_measure_scales(target_out);
    set_sigmas(target_out);
    return true;
}

/* ---- closer samples ---------------------------------------------------------------------------------- */

bool fit_picture_is_fine(struct fit_picture *picture, dipole_stack *const stacks[FIT_CHANNEL_COUNT],
                         struct fit_target *target, char *note, size_t note_size)
{
    target->systematic = picture->systematic;
    const double blur_mm = blur_share * picture->spacing_mm;
    double error = 0, wanted_mm = picture->spacing_mm;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        if (!stacks[c])
            continue;
        error = fmax(error, render_footprint_error(stacks[c], blur_mm, 0));
        while (render_footprint_error(stacks[c], blur_share * wanted_mm, 0) > blur_error_aim &&
               wanted_mm > 1e-3 * picture->spacing_mm)
            wanted_mm *= 0.9;
    }
    target->systematic.tile = hypot(picture->systematic.tile, error * bound_to_deviation);
    const double least_mm = spacing_for(picture, sample_limit, picture->spacing_mm);
    if (!(wanted_mm < 0.95 * picture->spacing_mm))
        return true;
    if (least_mm > 0.9 * picture->spacing_mm) {
        snprintf(note, note_size,
                 "the coefficients found ask for light samples %.3g mm apart, more than %.0f of them; with "
                 "%.3g mm the edges of shadows err by up to %.2g %%",
                 wanted_mm, sample_limit, picture->spacing_mm, 100 * error);
        return true;
    }
    picture->spacing_mm = fmax(wanted_mm, least_mm);
    return false;
}

void fit_picture_mark_outliers(struct fit_picture *picture, const struct fit_target *target)
{
    struct fit_pixels *const pixels = picture->pixels;
    for (size_t i = 0; i < target->datum_count; i++) {
        const struct fit_datum *const datum = &target->data[i];
        if (datum->robust > 0 || pixels->uses[datum->place] == FIT_USE_OUTLIER)
            continue;
        pixels->use_counts[pixels->uses[datum->place]]--;
        pixels->use_counts[FIT_USE_OUTLIER]++;
        pixels->uses[datum->place] = FIT_USE_OUTLIER;
    }
}

const struct fit_pixels *fit_picture_pixels(const struct fit_picture *picture)
{
    return picture->pixels;
}

const struct render_capture *fit_picture_capture(const struct fit_picture *picture)
{
    return picture->capture;
}
