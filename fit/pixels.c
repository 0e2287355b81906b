#include "fit/pixels.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TILES_ACROSS = 16 };

/* So many pixels with one and the same highest value are no coincidence: their value is the sensor's end.
 * If they are most of the picture it is a picture of something even. */
enum { PLATEAU_MIN = 10 };
static const double plateau_share = 5e-4, plateau_most = 0.5;

/* Codes up to this hold more rounding than light. */
static const double darkest_code = 1.5;

/* Direct light that changes by this part from a pixel to its neighbours has an edge there, if it is not all
 * but dark. */
static const double edge_change = 0.5, edge_least = 0.02;

struct source {
    const struct fit_pixel_request *request;
    size_t width, height, count;
    double clip[FIT_CHANNEL_COUNT]; /* values from here on are clipped */
    double brightest_direct;
};

static const float *radiance_at(const struct fit_photo *photo, size_t pixel)
{
    return photo->image->pixels + pixel * (size_t)photo->image->channel_count;
}

bool fit_pixel_has_value(const struct fit_photo *photo, size_t pixel, int channel)
{
    const double value = (double)radiance_at(photo, pixel)[channel];
    return photo->bits > 0 ? value > fit_photo_value(photo, darkest_code) : isfinite(value);
}

/* ---- what becomes of a pixel ------------------------------------------------------------------------- */

/* Where a channel is clipped: at its highest code; or, of numbers, at the highest value if many share it.
 */
static double clip_of(const struct source *source, size_t channel)
{
    const struct fit_photo *const photo = source->request->photo;
    if (photo->bits > 0)
        return fmin(fit_photo_value(photo, ldexp(1, photo->bits) - 1.5), photo->linear_limit);
    float highest = 0;
    size_t sharing = 0, covered = 0;
    for (size_t i = 0; i < source->count; i++) {
        const float value = radiance_at(photo, i)[channel];
        covered += source->request->capture->coverage[i] >= 1;
        if (!(value >= highest) || isinf(value) || !(source->request->capture->coverage[i] >= 1))
            continue;
        sharing = value > highest ? 1 : sharing + 1;
        highest = value;
    }
    const bool is_plateau = sharing >= PLATEAU_MIN && (double)sharing > plateau_share * (double)covered &&
                            (double)sharing < plateau_most * (double)covered;
    return is_plateau && highest > 0 ? (double)highest : INFINITY;
}

/* Half of the way to white or more, in some colour. */
static bool is_bright_in(const struct io_image *mask, size_t pixel)
{
    const float *const value = mask->pixels + pixel * (size_t)mask->channel_count;
    const int colour_count = mask->channel_count < 3 ? 1 : 3;
    bool is_bright = false;
    for (int c = 0; c < colour_count; c++)
        is_bright = is_bright || value[c] >= 0.5f;
    return is_bright;
}

static enum fit_use use_by_itself(const struct source *source, size_t pixel)
{
    const struct fit_pixel_request *const request = source->request;
    const struct render_capture *const capture = request->capture;
    if (!(capture->coverage[pixel] >= 1) || !(capture->exit_per_sr[pixel] > 0))
        return FIT_USE_NOT_COVERED;
    if (request->mask && !is_bright_in(request->mask, pixel))
        return FIT_USE_MASKED;
    const float *const radiance = radiance_at(request->photo, pixel);
    bool is_clipped = false, is_specular = false, has_value = false;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        const double specular = (double)capture->specular[pixel * FIT_CHANNEL_COUNT + (size_t)c];
        if (!isfinite(radiance[c]) || !isfinite(specular))
            return FIT_USE_NOT_FINITE;
        is_clipped = is_clipped || (double)radiance[c] >= source->clip[c];
        is_specular = is_specular || request->gain * specular > 0.5 * (double)radiance[c];
        has_value = has_value || fit_pixel_has_value(request->photo, pixel, c);
    }
    return is_clipped    ? FIT_USE_CLIPPED
           : is_specular ? FIT_USE_SPECULAR
           : !has_value  ? FIT_USE_DARK
                         : FIT_USE_OK;
}

/* Radiosity by direct light, or what is as good: the brightest channel without mirrored light. */
static double direct_at(const struct source *source, size_t pixel)
{
    const struct fit_pixel_request *const request = source->request;
    const float *const radiance = request->direct->pixels + pixel * (size_t)request->direct->channel_count;
    double brightest = 0;
    for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++)
        brightest = fmax(brightest,
                         (double)(radiance[c] - request->capture->specular[pixel * FIT_CHANNEL_COUNT + c]));
    return brightest / (double)request->capture->exit_per_sr[pixel];
}

struct neighbourhood {
    double darkest, brightest; /* by direct light */
    bool has_clipped;
};

static struct neighbourhood look_around(const struct source *source, const unsigned char *uses, size_t x,
                                        size_t y)
{
    struct neighbourhood found = { .darkest = INFINITY };
    for (size_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < source->height; j++) {
        for (size_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < source->width; i++) {
            const size_t pixel = j * source->width + i;
            found.has_clipped = found.has_clipped || uses[pixel] == FIT_USE_CLIPPED;
            if (!source->request->direct || !(source->request->capture->coverage[pixel] >= 1))
                continue;
            const double direct = direct_at(source, pixel);
            found.darkest = fmin(found.darkest, direct);
            found.brightest = fmax(found.brightest, direct);
        }
    }
    return found;
}

static void say_uses(struct source *source, unsigned char *uses)
{
    for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++)
        source->clip[c] = clip_of(source, c);
    for (size_t i = 0; i < source->count; i++) {
        uses[i] = (unsigned char)use_by_itself(source, i);
        if (source->request->direct && uses[i] == FIT_USE_OK)
            source->brightest_direct = fmax(source->brightest_direct, direct_at(source, i));
    }
    for (size_t y = 0; y < source->height; y++) {
        for (size_t x = 0; x < source->width; x++) {
            unsigned char *const use = &uses[y * source->width + x];
            if (*use != FIT_USE_OK)
                continue;
            const struct neighbourhood near = look_around(source, uses, x, y);
            const bool is_edge = near.brightest > edge_least * source->brightest_direct &&
                                 near.brightest - near.darkest > edge_change * near.brightest;
            if (is_edge)
                *use = FIT_USE_SHADOW_EDGE;
            else if (near.has_clipped)
                *use = FIT_USE_COUNT; /* becomes clipped below, so that it does not spread */
        }
    }
    for (size_t i = 0; i < source->count; i++) {
        if (uses[i] == FIT_USE_COUNT)
            uses[i] = FIT_USE_CLIPPED;
    }
}

/* ---- the choice -------------------------------------------------------------------------------------- */

/* Spread without pattern: the murmur3 finaliser, a permutation of 32 bits. */
static uint32_t scatter_bits(uint32_t bits)
{
    bits = (bits ^ (bits >> 16)) * 0x85ebca6bu;
    bits = (bits ^ (bits >> 13)) * 0xc2b2ae35u;
    return bits ^ (bits >> 16);
}

/* The picture in square cells, one pixel to be chosen from each. */
struct cells {
    double side_px;
    size_t across, count;
    uint32_t *chosen; /* pixel + 1; 0: none yet */
};

static size_t cell_of(const struct cells *cells, size_t x, size_t y)
{
    return (size_t)((double)y / cells->side_px) * cells->across + (size_t)((double)x / cells->side_px);
}

static size_t choose(const struct source *source, const unsigned char *uses, struct cells *cells)
{
    size_t chosen_count = 0;
    for (size_t y = 0; y < source->height; y++) {
        for (size_t x = 0; x < source->width; x++) {
            const size_t pixel = y * source->width + x;
            if (uses[pixel] != FIT_USE_OK)
                continue;
            uint32_t *const chosen = &cells->chosen[cell_of(cells, x, y)];
            chosen_count += *chosen == 0;
            if (*chosen == 0 || scatter_bits((uint32_t)pixel) < scatter_bits(*chosen - 1))
                *chosen = (uint32_t)pixel + 1;
        }
    }
    return chosen_count;
}

static void copy_chosen(const struct source *source, const struct cells *cells, struct fit_pixels *pixels)
{
    const struct render_capture *const capture = source->request->capture;
    size_t lo[2] = { SIZE_MAX, SIZE_MAX }, hi[2] = { 0, 0 }, j = 0;
    for (size_t i = 0; i < cells->count; i++) {
        if (cells->chosen[i] == 0)
            continue;
        const size_t at[2] = { (cells->chosen[i] - 1) % source->width,
                               (cells->chosen[i] - 1) / source->width };
        for (int a = 0; a < 2; a++) {
            lo[a] = at[a] < lo[a] ? at[a] : lo[a];
            hi[a] = at[a] > hi[a] ? at[a] : hi[a];
        }
        pixels->at[j++] = cells->chosen[i] - 1;
    }
    assert(j == pixels->count);
    const size_t extent = hi[0] - lo[0] > hi[1] - lo[1] ? hi[0] - lo[0] : hi[1] - lo[1];
    for (j = 0; j < pixels->count; j++) {
        const size_t pixel = pixels->at[j];
        const size_t tile_x = (pixel % source->width - lo[0]) * TILES_ACROSS / (extent + 1);
        const size_t tile_y = (pixel / source->width - lo[1]) * TILES_ACROSS / (extent + 1);
        pixels->tiles[j] = (int)(tile_y * TILES_ACROSS + tile_x);
        pixels->objects[j] = (int)capture->object[pixel] - 1;
        memcpy(pixels->positions_mm + 3 * j, capture->position_mm + 3 * pixel,
               3 * sizeof *pixels->positions_mm);
    }
}

static struct fit_pixels *pixels_allocate(size_t count)
{
    const size_t size = count * (3 * sizeof(float) + 2 * sizeof(int) + sizeof(uint32_t));
    struct fit_pixels *const pixels = malloc(sizeof *pixels + size);
    if (!pixels)
        return NULL;
    *pixels = (struct fit_pixels){ .count = count, .tile_count = TILES_ACROSS * TILES_ACROSS };
    pixels->positions_mm = (float *)(void *)(pixels + 1);
    pixels->tiles = (int *)(void *)(pixels->positions_mm + 3 * count);
    pixels->objects = pixels->tiles + count;
    pixels->at = (uint32_t *)(void *)(pixels->objects + count);
    return pixels;
}

static bool fail_for_too_few(const size_t counts[FIT_USE_COUNT], size_t total, const dipole_place *place,
                             dipole_status *status)
{
    char others[128] = "";
    size_t length = 0;
    for (int use = FIT_USE_OK + 1; use < FIT_USE_COUNT; use++) {
        if (counts[use] == 0 || length >= sizeof others)
            continue;
        length += (size_t)snprintf(others + length, sizeof others - length, "%s%zu %s", length ? ", " : "",
                                   counts[use], fit_use_names[use]);
    }
    return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                       "the picture has %zu pixels to fit, expected %d or more; of %zu: %s",
                       counts[FIT_USE_OK], FIT_PIXEL_MIN, total, others);
}

bool fit_pixels_create(const struct fit_pixel_request *request, const dipole_place *place,
                       struct fit_pixels **pixels_out, dipole_status *status)
{
    const struct render_capture *const capture = request->capture;
    *pixels_out = NULL;
    assert(request->photo->image->width_px == capture->width_px);
    assert(request->photo->image->height_px == capture->height_px);
    struct source source = { .request = request,
                             .width = (size_t)capture->width_px,
                             .height = (size_t)capture->height_px };
    source.count = source.width * source.height;
    unsigned char *const uses = calloc(source.count, 1);
    if (!uses)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the pixels of the picture");
    say_uses(&source, uses);
    size_t counts[FIT_USE_COUNT] = { 0 };
    for (size_t i = 0; i < source.count; i++)
        counts[uses[i]]++;
    if (counts[FIT_USE_OK] < FIT_PIXEL_MIN) {
        free(uses);
        return fail_for_too_few(counts, source.count, place, status);
    }
    struct cells cells = { .side_px = fmax(1, sqrt((double)counts[FIT_USE_OK] / (double)request->limit)) };
    cells.across = (size_t)((double)(source.width - 1) / cells.side_px) + 1;
    cells.count = cells.across * ((size_t)((double)(source.height - 1) / cells.side_px) + 1);
    cells.chosen = calloc(cells.count, sizeof *cells.chosen);
    struct fit_pixels *const pixels = cells.chosen ? pixels_allocate(choose(&source, uses, &cells)) : NULL;
    if (pixels) {
        copy_chosen(&source, &cells, pixels);
        pixels->width_px = capture->width_px;
        pixels->height_px = capture->height_px;
        pixels->uses = uses;
        memcpy(pixels->use_counts, counts, sizeof counts);
    }
    free(cells.chosen);
    if (!pixels) {
        free(uses);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the pixels of the picture");
    }
    *pixels_out = pixels;
    return true;
}

void fit_pixels_destroy(struct fit_pixels *pixels)
{
    if (pixels)
        free(pixels->uses);
    free(pixels);
}
