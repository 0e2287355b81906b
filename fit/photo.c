#include "fit/photo.h"

#include <math.h>
#include <string.h>

/* What a picture of render says about its errors are bounds. Taken as even distributions they have a
 * standard deviation of bound / sqrt(3), and 95 % intervals still reach the bounds. */
static const double bound_to_deviation = 0.5773502691896258;

/* What no stated bound covers. Single precision: pictures drawn to 1e-3 and better still differ from the
 * operator by 1e-4 to 2e-4. And far light samples put together on curved surfaces: spheres, knots and the
 * dark side of back-lit shapes have up to 4e-4 of their mean too much everywhere. */
static const double precision_error = 2e-4, far_light_error = 4e-4;

/* Of a picture that says nothing about itself: a camera's exposure and flat field. */
static const struct fit_systematic unstated = { .scale = 0.01, .tile = 0.005, .misfit_factor = 6 };

static double number_of(const struct io_image *image, const char *name, double fallback)
{
    const struct io_attribute *const attribute = io_image_find(image, name);
    const bool is_number = attribute && attribute->kind == IO_ATTRIBUTE_NUMBER &&
                           attribute->numbers[0] > 0 && isfinite(attribute->numbers[0]);
    return is_number ? attribute->numbers[0] : fallback;
}

/* Whether the picture says how its profile was blurred, which then can be done alike. */
static bool read_blur(struct fit_photo *photo)
{
    const struct io_attribute *const blur = io_image_find(photo->image, "dipole:blur_mm");
    if (!blur || blur->kind != IO_ATTRIBUTE_NUMBERS)
        return false;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        photo->blur_mm[c] = blur->numbers[c] > 0 && isfinite(blur->numbers[c]) ? blur->numbers[c] : 0;
    return true;
}

static void read_model(struct fit_photo *photo)
{
    const struct io_attribute *const model = io_image_find(photo->image, "dipole:model");
    for (int m = 0; model && model->kind == IO_ATTRIBUTE_TEXT && io_model_names[m]; m++) {
        if (strcmp(model->text, io_model_names[m]) == 0) {
            photo->model = (dipole_model)m;
            photo->has_model = true;
        }
    }
}

/*
 * A picture by splats is cut off at r_max, as if the medium absorbed more; the operator does the same. Its
 * own light samples make a ripple that shows in the residuals. What is left is the error of the table, of
 * the blur and of far samples put together, which scales the picture. With epsilon alone everything may be
 * in the scale.
 */
static void read_errors(struct fit_photo *photo)
{
    const struct io_image *const image = photo->image;
    const double epsilon = number_of(image, "dipole:epsilon", 0);
    photo->cut_mm = INFINITY;
    photo->systematic = unstated;
    photo->is_rendered = epsilon > 0;
    if (!photo->is_rendered)
        return;
    read_model(photo);
    photo->cut_mm = number_of(image, "dipole:r_max_mm", INFINITY);
    const bool is_blur_known = read_blur(photo);
    photo->spacing_mm = number_of(image, "dipole:spacing_mm", 0);
    const bool is_splatted = photo->spacing_mm > 0;
    const double bound = is_splatted ? number_of(image, "dipole:table_error", epsilon) +
                                           number_of(image, "dipole:banding_error", 0) +
                                           (is_blur_known ? 0 : number_of(image, "dipole:blur_error", 0))
                                     : number_of(image, "dipole:error_estimated", epsilon);
    const double deviation = hypot(bound * bound_to_deviation, precision_error);
    photo->systematic = (struct fit_systematic){
        .scale = deviation, .tile = deviation, .offset = far_light_error, .misfit_factor = 2
    };
}

double fit_photo_value(const struct fit_photo *photo, double code)
{
    const double unit = code / (ldexp(1, photo->bits) - 1);
    return (photo->is_srgb ? io_linear_from_srgb(unit) : unit) / photo->exposure;
}

static bool to_three_channels(struct io_image **image, dipole_status *status)
{
    struct io_image *const grey = *image;
    struct io_image *rgb = NULL;
    if (grey->channel_count >= FIT_CHANNEL_COUNT)
        return true;
    if (!io_image_create(grey->width_px, grey->height_px, FIT_CHANNEL_COUNT, &rgb, status))
        return false;
    const size_t count = (size_t)grey->width_px * (size_t)grey->height_px;
    for (size_t i = 0; i < count; i++) {
        for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++)
            rgb->pixels[i * FIT_CHANNEL_COUNT + c] = grey->pixels[i];
    }
    io_image_destroy(grey);
    *image = rgb;
    return true;
}

static bool is_exr(const char *path)
{
    const char *const dot = strrchr(path, '.');
    return dot && (strcmp(dot, ".exr") == 0 || strcmp(dot, ".EXR") == 0);
}

bool fit_photo_read(const char *path, bool is_linear, double exposure, struct fit_photo *out,
                    dipole_status *status)
{
    struct io_photo_info info = { 0 };
    dipole_status refused;
    *out = (struct fit_photo){ .exposure = 1 };
    bool done = is_exr(path) && io_exr_read(path, &out->image, &refused);
    if (!done && is_exr(path) && refused.code != DIPOLE_NOT_SUPPORTED) {
        if (status)
            *status = refused;
        return false;
    }
    done = done ||
           io_photo_read(path, is_linear ? IO_PHOTO_LINEAR : IO_PHOTO_SRGB, &info, &out->image, status);
    if (!done)
        return false;
    out->bits = info.bits;
    out->is_srgb = info.is_srgb;
    read_errors(out);
    if (!to_three_channels(&out->image, status)) {
        fit_photo_destroy(out);
        return false;
    }
    out->linear_limit = number_of(out->image, "dipole:linear_limit", INFINITY) / exposure;
    if (info.bits == 0)
        return true;
    out->exposure = exposure;
    const size_t value_count =
        (size_t)out->image->width_px * (size_t)out->image->height_px * (size_t)out->image->channel_count;
    for (size_t i = 0; i < value_count; i++)
        out->image->pixels[i] = (float)((double)out->image->pixels[i] / exposure);
    return true;
}

void fit_photo_destroy(struct fit_photo *photo)
{
    io_image_destroy(photo->image);
    photo->image = NULL;
}

/* ---- larger pictures --------------------------------------------------------------------------------- */

/* How a square of pixels becomes one. A value from clip on, or not finite, is not meaned away. */
struct reduction {
    const struct io_image *from;
    int factor;
    bool is_least; /* else the mean */
    double clip;
};

static double reduce_square(const struct reduction *reduction, int x, int y, int channel)
{
    const struct io_image *const from = reduction->from;
    double sum = 0, least = INFINITY, largest = -INFINITY;
    bool is_spoilt = false;
    for (int j = y * reduction->factor; j < (y + 1) * reduction->factor; j++) {
        for (int i = x * reduction->factor; i < (x + 1) * reduction->factor; i++) {
            const size_t pixel = (size_t)j * (size_t)from->width_px + (size_t)i;
            const double value =
                (double)from->pixels[pixel * (size_t)from->channel_count + (size_t)channel];
            if (!isfinite(value))
                return value;
            is_spoilt = is_spoilt || value >= reduction->clip;
            sum += value;
            least = fmin(least, value);
            largest = fmax(largest, value);
        }
    }
    return reduction->is_least ? least
           : is_spoilt         ? largest
                               : sum / ((double)reduction->factor * reduction->factor);
}

static bool reduce_image(struct io_image **image, bool is_least, double clip, int width_px, int height_px,
                         dipole_status *status)
{
    struct io_image *const from = *image, *to = NULL;
    const int factor = from->width_px / width_px;
    const struct reduction reduction = {
        .from = from, .factor = factor, .is_least = is_least, .clip = clip
    };
    if (factor < 2 || from->width_px != factor * width_px || from->height_px != factor * height_px)
        return true;
    if (!io_image_create(width_px, height_px, from->channel_count, &to, status))
        return false;
    for (int y = 0; y < height_px; y++) {
        for (int x = 0; x < width_px; x++) {
            for (int c = 0; c < to->channel_count; c++)
                to->pixels[((size_t)y * (size_t)width_px + (size_t)x) * (size_t)to->channel_count +
                           (size_t)c] = (float)reduce_square(&reduction, x, y, c);
        }
    }
    io_image_destroy(from);
    *image = to;
    return true;
}

bool fit_photo_reduce(struct fit_photo *photo, int width_px, int height_px, dipole_status *status)
{
    const double highest = photo->bits > 0 ? fit_photo_value(photo, ldexp(1, photo->bits) - 1.5) : INFINITY;
    return reduce_image(&photo->image, false, fmin(highest, photo->linear_limit), width_px, height_px,
                        status);
}

bool fit_mask_reduce(struct io_image **mask, int width_px, int height_px, dipole_status *status)
{
    return reduce_image(mask, true, INFINITY, width_px, height_px, status);
}
