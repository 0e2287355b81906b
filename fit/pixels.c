#include "fit/pixels.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { TILES_ACROSS = 16 };

/* What became of a pixel. */
enum use { USE_OK = 0, USE_NOT_COVERED, USE_NOT_FINITE, USE_SPECULAR, USE_COUNT };

struct source {
    const struct render_capture *capture;
    const struct io_image *picture;
};

static const float *radiance_at(const struct source *source, size_t pixel)
{
    return source->picture->pixels + pixel * (size_t)source->picture->channel_count;
}

static enum use use_of(const struct source *source, size_t pixel)
{
    const struct render_capture *capture = source->capture;
    if (!(capture->coverage[pixel] >= 1.0f) || !(capture->exit_per_sr[pixel] > 0.0f))
        return USE_NOT_COVERED;
    const float *radiance = radiance_at(source, pixel);
    for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++) {
        const float specular = capture->specular[pixel * FIT_CHANNEL_COUNT + c];
        if (!isfinite(radiance[c]) || !isfinite(specular))
            return USE_NOT_FINITE;
        if (specular > 0.5f * radiance[c])
            return USE_SPECULAR;
    }
    return USE_OK;
}

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

static size_t choose(const struct source *source, struct cells *cells)
{
    const size_t width = (size_t)source->capture->width_px, height = (size_t)source->capture->height_px;
    size_t chosen_count = 0;
    for (size_t y = 0; y < height; y++) {
        for (size_t x = 0; x < width; x++) {
            const size_t pixel = y * width + x;
            if (use_of(source, pixel) != USE_OK)
                continue;
            uint32_t *chosen = &cells->chosen[cell_of(cells, x, y)];
            chosen_count += *chosen == 0;
            if (*chosen == 0 || scatter_bits((uint32_t)pixel) < scatter_bits(*chosen - 1))
                *chosen = (uint32_t)pixel + 1;
        }
    }
    return chosen_count;
}

static void copy_chosen(const struct source *source, const struct cells *cells, struct fit_pixels *pixels)
{
    const size_t width = (size_t)source->capture->width_px;
    size_t lo[2] = { SIZE_MAX, SIZE_MAX }, hi[2] = { 0, 0 };
    for (size_t i = 0; i < cells->count; i++) {
        if (cells->chosen[i] == 0)
            continue;
        const size_t at[2] = { (cells->chosen[i] - 1) % width, (cells->chosen[i] - 1) / width };
        for (int a = 0; a < 2; a++) {
            lo[a] = at[a] < lo[a] ? at[a] : lo[a];
            hi[a] = at[a] > hi[a] ? at[a] : hi[a];
        }
    }
    const size_t extent = hi[0] - lo[0] > hi[1] - lo[1] ? hi[0] - lo[0] : hi[1] - lo[1];
    size_t j = 0;
    for (size_t i = 0; i < cells->count; i++) {
        if (cells->chosen[i] == 0)
            continue;
        const size_t pixel = cells->chosen[i] - 1;
        const size_t tile_x = (pixel % width - lo[0]) * TILES_ACROSS / (extent + 1);
        const size_t tile_y = (pixel / width - lo[1]) * TILES_ACROSS / (extent + 1);
        pixels->tiles[j] = (int)(tile_y * TILES_ACROSS + tile_x);
        for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++) {
            const float diffuse =
                radiance_at(source, pixel)[c] - source->capture->specular[pixel * FIT_CHANNEL_COUNT + c];
            pixels->radiosity_w_per_mm2[j * FIT_CHANNEL_COUNT + c] =
                diffuse / source->capture->exit_per_sr[pixel];
            pixels->positions_mm[3 * j + c] = source->capture->position_mm[3 * pixel + c];
        }
        j++;
    }
    assert(j == pixels->count);
}

static struct fit_pixels *pixels_allocate(size_t count)
{
    const size_t float_count = count * (3 + FIT_CHANNEL_COUNT);
    struct fit_pixels *pixels = malloc(sizeof *pixels + float_count * sizeof(float) + count * sizeof(int));
    if (!pixels)
        return NULL;
    *pixels = (struct fit_pixels){ .count = count, .tile_count = TILES_ACROSS * TILES_ACROSS };
    pixels->positions_mm = (float *)(void *)(pixels + 1);
    pixels->radiosity_w_per_mm2 = pixels->positions_mm + 3 * count;
    pixels->tiles = (int *)(void *)(pixels->radiosity_w_per_mm2 + FIT_CHANNEL_COUNT * count);
    return pixels;
}

bool fit_pixels_create(const struct render_capture *capture, const struct io_image *picture, size_t limit,
                       const dipole_place *place, struct fit_pixels **pixels_out, dipole_status *status)
{
    *pixels_out = NULL;
    assert(picture->width_px == capture->width_px && picture->height_px == capture->height_px);
    assert(picture->channel_count >= FIT_CHANNEL_COUNT);
    const struct source source = { .capture = capture, .picture = picture };
    const size_t pixel_count = (size_t)capture->width_px * (size_t)capture->height_px;
    size_t use_counts[USE_COUNT] = { 0 };
    for (size_t pixel = 0; pixel < pixel_count; pixel++)
        use_counts[use_of(&source, pixel)]++;
    if (use_counts[USE_OK] < FIT_PIXEL_MIN)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, place,
            "the picture has %zu pixels to fit, expected %d or more: of %zu, %zu are not wholly "
            "covered by an object, %zu are not finite, %zu are mostly specular or black",
            use_counts[USE_OK], FIT_PIXEL_MIN, pixel_count, use_counts[USE_NOT_COVERED],
            use_counts[USE_NOT_FINITE], use_counts[USE_SPECULAR]);

    struct cells cells = { .side_px = fmax(1.0, sqrt((double)use_counts[USE_OK] / (double)limit)) };
    cells.across = (size_t)((double)(capture->width_px - 1) / cells.side_px) + 1;
    cells.count = cells.across * ((size_t)((double)(capture->height_px - 1) / cells.side_px) + 1);
    cells.chosen = calloc(cells.count, sizeof *cells.chosen);
    struct fit_pixels *pixels = cells.chosen ? pixels_allocate(choose(&source, &cells)) : NULL;
    if (pixels) {
        pixels->usable_count = use_counts[USE_OK];
        copy_chosen(&source, &cells, pixels);
    }
    free(cells.chosen);
    if (!pixels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the pixels of the picture");
    *pixels_out = pixels;
    return true;
}

void fit_pixels_destroy(struct fit_pixels *pixels)
{
    free(pixels);
}
