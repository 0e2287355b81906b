#include "renderer/gather_places.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>

typedef struct render_gather_places_of_frame places_of_frame;

/* ---- levels ------------------------------------------------------------------------------------- */

/* How far nodes lie from a place: the length of their mean step, and the mean square and cube of steps. */
struct spread {
    double off_mm, square_mm2, cube_mm3;
};

/* Slopes at nodes take samples for spread the same all around, by which they are off by no more than this
 * part. */
#define SLOPE_ERROR 0.03

/* What interpolation may be off by, by derivatives up to the second, or with slopes the third. theory.md
 * T43 */
static double interpolation_error(const struct render_gather_request *request, double slope, double bend,
                                  double third, const struct spread *spread)
{
    if (!request->has_slopes)
        return slope * spread->off_mm + 0.5 * bend * spread->square_mm2;
    return 0.5 * bend * (spread->off_mm * spread->off_mm + SLOPE_ERROR * spread->square_mm2) +
           third * (spread->cube_mm3 / 12 + 0.25 * spread->off_mm * spread->square_mm2);
}

/* Over what may be spent, of what is lit and of what is there; beyond 1 a band cannot be interpolated. */
static double part_of_limit(const struct render_gather_request *request,
                            const struct render_gather_object *object, int band,
                            const struct spread *spread)
{
    const struct render_gather_medium *const medium = object->medium;
    const double lit = interpolation_error(request, medium->slope_per_mm[band], medium->bend_per_mm2[band],
                                           medium->third_per_mm3[band], spread);
    const double own =
        interpolation_error(request, medium->own_slope_per_mm[band], medium->own_bend_per_mm2[band],
                            medium->own_third_per_mm3[band], spread);
    return fmax(lit / request->epsilon, own / request->own_epsilon);
}

/* Bilinear interpolation over nodes g apart: sum of weights x squared distance is at most g^2/2, and half
 * of what may be spent is left for places that do not lie where they are interpolated. */
static int level_of_band(const struct render_gather_request *request,
                         const struct render_gather_object *object, int band)
{
    int level = 0;
    while (band > 0 && level + 1 < RENDER_GATHER_LEVELS) {
        const double apart_mm = ldexp(object->pixel_mm, level + 1);
        const struct spread worst = { .square_mm2 = 0.5 * apart_mm * apart_mm,
                                      .cube_mm3 = sqrt(0.125) * apart_mm * apart_mm * apart_mm };
        if (part_of_limit(request, object, band, &worst) > 0.5)
            break;
        level++;
    }
    return level;
}

/* Whether anything is to be done at a level: bands of its own; with slopes, what is coarser, too: so that
 * it is refined at no more nodes than it must. */
static bool has_nodes(const struct render_gather_request *request,
                      const struct render_gather_schedule *schedule, int level)
{
    return level == 0 || schedule->first[level + 1] > schedule->first[level] ||
           (request->has_slopes && schedule->coarser[level] >= 0);
}

static void schedule_bands(const struct render_gather_request *request,
                           const struct render_gather_object *object,
                           struct render_gather_schedule *schedule)
{
    const int count = object->medium->band_count;
    int band = 0;
    for (int l = 0; l < RENDER_GATHER_LEVELS; l++) {
        while (band < count && level_of_band(request, object, band) < l)
            band++;
        schedule->first[l] = band;
    }
    schedule->first[RENDER_GATHER_LEVELS] = count;
    for (int l = RENDER_GATHER_LEVELS - 1, coarser = -1; l >= 0; l--) {
        schedule->coarser[l] = coarser;
        if (has_nodes(request, schedule, l))
            coarser = l;
    }
}

/* The object at a pixel; -1: none. */
static int object_at(const places_of_frame *places, int32_t pixel)
{
    const struct render_gather_request *const request = places->request;
    const float number = pixel < 0 ? 0 : render_gather_place(request, pixel)[3];
    if (!(number > 0))
        return -1;
    const int object = request->object_count == 1 ? 0 : (int)number - 1;
    return request->objects[object].medium ? object : -1;
}

static int32_t node_pixel(const struct render_gather_nodes *level, int x, int y)
{
    if (x < 0 || y < 0 || x >= level->width || y >= level->height)
        return -1;
    const int32_t node = y * level->width + x;
    return level->pixels ? level->pixels[node] : node;
}

/* The pixel in the middle of a block, or the nearest to it of those that stand for its quarters. */
static int32_t choose_pixel(const places_of_frame *places, int l, int x, int y)
{
    const int width_px = places->request->width_px, height_px = places->request->height_px;
    const int middle_x = (2 * x + 1) << (l - 1), middle_y = (2 * y + 1) << (l - 1);
    if (middle_x < width_px && middle_y < height_px &&
        object_at(places, middle_y * width_px + middle_x) >= 0)
        return middle_y * width_px + middle_x;
    int32_t nearest = -1;
    int least = INT32_MAX;
    for (int quarter = 0; quarter < 4; quarter++) {
        const int32_t pixel =
            node_pixel(&places->levels[l - 1], 2 * x + (quarter & 1), 2 * y + (quarter >> 1));
        if (object_at(places, pixel) < 0)
            continue;
        const int dx = pixel % width_px - middle_x, dy = pixel / width_px - middle_y;
        if (dx * dx + dy * dy < least) {
            least = dx * dx + dy * dy;
            nearest = pixel;
        }
    }
    return nearest;
}

static void choose_row(void *context, int y)
{
    const places_of_frame *const places = context;
    const struct render_gather_nodes *const level = &places->levels[places->level];
    for (int x = 0; x < level->width; x++)
        level->pixels[y * level->width + x] = choose_pixel(places, places->level, x, y);
}

bool render_gather_places_init(const struct render_gather_request *request, places_of_frame *places,
                               dipole_status *status)
{
    *places = (places_of_frame){ .request = request, .level_count = 1 };
    places->schedules = calloc(request->object_count + 1, sizeof *places->schedules);
    if (!places->schedules)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather for %zu objects",
                           request->object_count);
    for (size_t i = 0; i < request->object_count; i++) {
        struct render_gather_schedule *const schedule = &places->schedules[i];
        if (!request->objects[i].medium)
            continue;
        schedule_bands(request, &request->objects[i], schedule);
        for (int l = places->level_count; l < RENDER_GATHER_LEVELS; l++) {
            if (schedule->first[l + 1] > schedule->first[l])
                places->level_count = l + 1;
        }
    }
    places->levels[0] = (struct render_gather_nodes){ request->width_px, request->height_px, NULL };
    for (int l = 1; l < places->level_count; l++) {
        struct render_gather_nodes *const level = &places->levels[l];
        level->width = (places->levels[l - 1].width + 1) / 2;
        level->height = (places->levels[l - 1].height + 1) / 2;
        const size_t count = (size_t)level->width * (size_t)level->height;
        level->pixels = calloc(count, sizeof *level->pixels);
        if (!level->pixels)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather at %zu places",
                               count);
        places->level = l;
        lut_parallel_for(level->height, request->thread_count, choose_row, places);
    }
    return true;
}

void render_gather_places_end(places_of_frame *places)
{
    for (int l = 1; l < places->level_count; l++)
        free(places->levels[l].pixels);
    free(places->schedules);
}

/* ---- interpolation ------------------------------------------------------------------------------ */

/* Nodes of level l about a pixel, their weights, and how they lie; false: there are none. */
static bool blend(const places_of_frame *places, int l, int32_t pixel, int object,
                  struct render_gather_blend *blend, struct spread *spread)
{
    const struct render_gather_nodes *const level = &places->levels[l];
    const int width_px = places->request->width_px, side = 1 << l, half = side / 2;
    const int column = pixel % width_px + side - half, row = pixel / width_px + side - half;
    const int x = column / side - 1, y = row / side - 1; /* the node before, from -1 on */
    const float part_x = (float)(column % side) / (float)side, part_y = (float)(row % side) / (float)side;
    const float *const here = render_gather_place(places->request, pixel);
    float weight_sum = 0, off_mm[3] = { 0, 0, 0 }, square = 0, cube = 0;
    for (int corner = 0; corner < 4; corner++) {
        const int i = corner & 1, j = corner >> 1;
        const float weight = (i ? part_x : 1 - part_x) * (j ? part_y : 1 - part_y);
        const int32_t node = node_pixel(level, x + i, y + j);
        blend->nodes[corner] = 0;
        blend->weights[corner] = 0;
        if (!(weight > 0) || object_at(places, node) != object)
            continue;
        const float *const there = render_gather_place(places->request, node);
        blend->nodes[corner] = (y + j) * level->width + x + i;
        blend->weights[corner] = weight;
        weight_sum += weight;
        float distance2 = 0;
        for (int k = 0; k < 3; k++) {
            const float step = there[k] - here[k];
            off_mm[k] += weight * step;
            distance2 += step * step;
        }
        square += weight * distance2;
        cube += weight * distance2 * sqrtf(distance2);
    }
    if (!(weight_sum > 0))
        return false;
    float off2 = 0;
    for (int k = 0; k < 3; k++)
        off2 += off_mm[k] * off_mm[k];
    for (int corner = 0; corner < 4; corner++)
        blend->weights[corner] /= weight_sum;
    *spread = (struct spread){ .off_mm = (double)(sqrtf(off2) / weight_sum),
                               .square_mm2 = (double)(square / weight_sum),
                               .cube_mm3 = (double)(cube / weight_sum) };
    return true;
}

/* What node n of a tile can take from the coarser level. */
static void choose_bands(const places_of_frame *places, struct render_gather_tile *tile, int n)
{
    const struct render_gather_request *const request = places->request;
    const struct render_gather_object *const object = &request->objects[tile->object];
    struct spread spread;
    tile->is_refined[n] = tile->is_half_refined[n] = false;
    if (tile->coarser < 0)
        return;
    if (!blend(places, tile->coarser, tile->pixels[n], tile->object, &tile->blends[n], &spread))
        tile->is_refined[n] = true;
    else if (part_of_limit(request, object, tile->end, &spread) > 1) {
        tile->is_half_refined[n] = request->has_slopes && tile->half_end < tile->last &&
                                   part_of_limit(request, object, tile->half_end, &spread) <= 1;
        tile->is_refined[n] = !tile->is_half_refined[n];
    }
    tile->refined_count += tile->is_refined[n];
    tile->half_refined_count += tile->is_half_refined[n];
}

/* ---- tiles -------------------------------------------------------------------------------------- */

/* Nodes in blocks of four by two, which the loops take at a time. */
static int node_in_tile(int index, bool is_y)
{
    const int block = index / RENDER_GATHER_LANES, in_block = index % RENDER_GATHER_LANES;
    return is_y ? block / 2 * 2 + in_block / 4 : block % 2 * 4 + in_block % 4;
}

bool render_gather_tile_init(const places_of_frame *places, int level, int tile_x, int tile_y, int least,
                             struct render_gather_tile *tile)
{
    const struct render_gather_nodes *const nodes = &places->levels[level];
    const int left = tile_x * RENDER_GATHER_TILE, low = tile_y * RENDER_GATHER_TILE;
    int objects[RENDER_GATHER_TILE_NODES];
    int32_t pixels[RENDER_GATHER_TILE_NODES];
    tile->object = INT32_MAX;
    tile->count = tile->refined_count = tile->half_refined_count = 0;
    for (int i = 0; i < RENDER_GATHER_TILE_NODES; i++) {
        pixels[i] = node_pixel(nodes, left + node_in_tile(i, false), low + node_in_tile(i, true));
        objects[i] = object_at(places, pixels[i]);
        if (objects[i] >= least && objects[i] < tile->object &&
            has_nodes(places->request, &places->schedules[objects[i]], level))
            tile->object = objects[i];
    }
    if (tile->object == INT32_MAX)
        return false;
    const struct render_gather_schedule *const schedule = &places->schedules[tile->object];
    tile->first = schedule->first[level];
    tile->end = schedule->first[level + 1];
    tile->last = places->request->objects[tile->object].medium->band_count;
    tile->coarser = schedule->coarser[level];
    tile->half_end = tile->coarser < 0 ? tile->end : schedule->first[tile->coarser + 1];
    for (int i = 0; i < RENDER_GATHER_TILE_NODES; i++) {
        if (objects[i] != tile->object)
            continue;
        const int n = tile->count++;
        tile->pixels[n] = pixels[i];
        tile->nodes[n] = (low + node_in_tile(i, true)) * nodes->width + left + node_in_tile(i, false);
        choose_bands(places, tile, n);
    }
    return true;
}
