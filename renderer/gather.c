#include "renderer/gather_places.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { LIST = 256 };

/* ---- media -------------------------------------------------------------------------------------- */

/* Largest slope of what a half plane of light gives, 2 int_0^oo f dr, f a band and all beyond it. */
static void edge_slope(const struct render_split *split, int band, double rgb[IO_CHANNEL_COUNT])
{
    enum { STEPS = 96 };
    const double r_max_mm = split->bands[split->band_count - 1].r_outer_mm;
    const double least_mm = 1e-3 * fmin(split->bands[band].r_outer_mm, r_max_mm),
                 step = log(r_max_mm / least_mm) / STEPS;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb[c] = 0;
    for (int i = -1; i < STEPS; i++) { /* the first from 0 */
        const double r_mm = i < 0 ? least_mm : least_mm * exp((i + 0.5) * step);
        double value[IO_CHANNEL_COUNT];
        render_split_from_per_mm2(split, band, r_mm, value);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            rgb[c] += 2 * value[c] * (i < 0 ? least_mm : r_mm * step);
    }
}

/* No less than the largest third derivative of the same, 2 int_0^oo max(|f''|, |f'|/r) dr: of f(|x - s|) no
 * second derivative along the surface is larger. */
static void edge_third(const struct render_split *split, int band, double rgb[IO_CHANNEL_COUNT])
{
    enum { STEPS = 192 };
    const double r_max_mm = split->bands[split->band_count - 1].r_outer_mm;
    const double least_mm = 0.02 * fmin(split->bands[band].r_outer_mm, r_max_mm),
                 step = log(r_max_mm / least_mm) / STEPS;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb[c] = 0;
    for (int i = -1; i < STEPS; i++) { /* the first from 0 */
        const double r_mm = i < 0 ? least_mm : least_mm * exp((i + 0.5) * step), h_mm = 0.05 * r_mm;
        double before[IO_CHANNEL_COUNT], here[IO_CHANNEL_COUNT], after[IO_CHANNEL_COUNT];
        render_split_from_per_mm2(split, band, r_mm - h_mm, before);
        render_split_from_per_mm2(split, band, r_mm, here);
        render_split_from_per_mm2(split, band, r_mm + h_mm, after);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double bend = fabs(after[c] - 2 * here[c] + before[c]) / (h_mm * h_mm);
            const double turn = fabs(after[c] - before[c]) / (2 * h_mm * r_mm);
            rgb[c] += 2 * fmax(bend, turn) * (i < 0 ? least_mm : r_mm * step);
        }
    }
}

/* Channels of which less lies beyond a cap are too dark to be seen. */
#define VISIBLE_SHARE 1e-4

/* Largest |f'|/f, |f''|/f and |f'''|/f of a band and all beyond it, over distances and channels. */
static void own_changes(const struct render_split *split, int band, struct render_gather_medium *medium)
{
    enum { STEPS = 96 };
    const double r_max_mm = split->bands[split->band_count - 1].r_outer_mm, step = 0.02, wide = 0.06;
    const double least_mm = 0.05 * fmin(split->bands[band].cap_mm, r_max_mm);
    for (int i = 0; band > 0 && i < STEPS; i++) {
        const double r_mm = least_mm * pow(r_max_mm / (1.1 * least_mm), (double)i / (STEPS - 1)),
                     h_mm = step * r_mm;
        double before[IO_CHANNEL_COUNT], here[IO_CHANNEL_COUNT], after[IO_CHANNEL_COUNT];
        double around[4][IO_CHANNEL_COUNT];
        render_split_from_per_mm2(split, band, r_mm - h_mm, before);
        render_split_from_per_mm2(split, band, r_mm, here);
        render_split_from_per_mm2(split, band, r_mm + h_mm, after);
        for (int k = 0; k < 4; k++)
            render_split_from_per_mm2(split, band, r_mm * (1 + wide * (k < 2 ? k - 2 : k - 1)), around[k]);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double beyond = 4 * r_mm * r_mm * here[c];
            if (!(beyond > VISIBLE_SHARE * split->source.medium->diffuse_reflectance[c]))
                continue;
            const double slope = fabs(after[c] - before[c]) / (2 * h_mm * here[c]);
            const double bend = fabs(after[c] - 2 * here[c] + before[c]) / (h_mm * h_mm * here[c]);
            medium->own_slope_per_mm[band] = fmax(medium->own_slope_per_mm[band], slope);
            const double third = fabs(around[3][c] - 2 * around[2][c] + 2 * around[1][c] - around[0][c]) /
                                 (2 * pow(wide * r_mm, 3) * here[c]);
            medium->own_bend_per_mm2[band] = fmax(medium->own_bend_per_mm2[band], bend);
            medium->own_third_per_mm3[band] = fmax(medium->own_third_per_mm3[band], third);
        }
    }
}

bool render_gather_medium_init(const struct render_band_source *source, const struct render_band *bands,
                               int band_count, struct render_gather_medium *medium, dipole_status *status)
{
    struct render_split split;
    *medium = (struct render_gather_medium){ .band_count = band_count };
    const bool done = render_split_init(source, bands, band_count, &split, status);
    for (int b = 0; done && b < band_count; b++) {
        double slope[IO_CHANNEL_COUNT], peak[IO_CHANNEL_COUNT], third[IO_CHANNEL_COUNT];
        render_gather_kernel_init(&split, b, &medium->kernels[b]);
        medium->reach_mm[b] = (float)bands[b].r_outer_mm;
        edge_slope(&split, b, slope);
        edge_third(&split, b, third);
        own_changes(&split, b, medium);
        render_split_from_per_mm2(&split, b, 0, peak);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double total = source->medium->diffuse_reflectance[c];
            if (!(total > 0))
                continue;
            medium->slope_per_mm[b] = fmax(medium->slope_per_mm[b], slope[c] / total);
            medium->bend_per_mm2[b] = fmax(medium->bend_per_mm2[b], 2 * fabs(peak[c]) / total);
            medium->third_per_mm3[b] = fmax(medium->third_per_mm3[b], third[c] / total);
        }
    }
    render_split_end(&split);
    return done;
}

/* Rd has bends near 0, which a sample that stands for all within a cube misses at places next to it. */
double render_gather_finest_spacings(double error)
{
    return fmin(0.7, 350 * error);
}

double render_gather_cap_spacings(double error)
{
    return 2 * fmax(sqrt(RENDER_GATHER_MERGING_ERROR_MAX / error), 1);
}

/* ---- sums --------------------------------------------------------------------------------------- */

/* What is summed at a place. */
struct node_sum {
    float rgb[4], slopes[3][4]; /* of R G B 0, per mm along x y z */
};

/* At a node of a level above the first: of all bands from the level's first on, and of those that coarser
 * levels have. */
struct node {
    struct node_sum all, rest;
};

/* The same while a tile is summed: its own bands, and coarser ones. */
struct tile_sums {
    struct node_sum own[RENDER_GATHER_TILE_NODES], rest[RENDER_GATHER_TILE_NODES];
};

struct gather {
    const struct render_gather_request *request;
    const struct render_gather_loops *loops;
    struct render_gather_places_of_frame places;
    float *radiosity;                         /* R G B 0 of each pixel */
    struct node *nodes[RENDER_GATHER_LEVELS]; /* NULL at the first level */
    size_t group_limit;                       /* of any sources       */
    int level;                                /* that is being summed */
    atomic_size_t place_count, refined_count, evaluation_count;
    atomic_bool is_out_of_memory;
};

struct scratch {
    uint32_t *groups;
    const struct render_gather_source *list[LIST];
    struct render_gather_counts counts; /* of a row of tiles */
};

/* One band at up to eight places. */
static void sum_places(struct gather *gather, const struct render_gather_tile *tile, int band,
                       const int members[], int count, size_t group_count, struct scratch *scratch,
                       struct node_sum *sums)
{
    const struct render_gather_object *const object = &gather->request->objects[tile->object];
    const struct render_gather_kernel *const kernel = &object->medium->kernels[band];
    const struct render_gather_level *const source = &object->sources->levels[band];
    struct render_gather_places places = { .sums = { { 0 } } };
    struct render_gather_box box;
    for (int i = 0; i < RENDER_GATHER_LANES; i++) {
        const float *const place =
            render_gather_place(gather->request, tile->pixels[members[i < count ? i : 0]]);
        render_gather_box_add(&box, place, i == 0);
        for (int k = 0; k < 3; k++)
            places.position_mm[k][i] = place[k];
    }
    const bool has_slopes = gather->level > 0 && gather->request->has_slopes;
    size_t evaluated = 0;
    for (size_t g = 0, listed = 0; g < group_count; listed = 0) {
        g += gather->loops->list(source->groups, scratch->groups + g, group_count - g, &box,
                                 kernel->reach2_mm2, scratch->list, &listed, LIST);
        (has_slopes ? gather->loops->sum_with_slopes : gather->loops->sum)(kernel, scratch->list, listed,
                                                                           &places);
        evaluated += listed;
    }
    scratch->counts.evaluation_count += evaluated * (size_t)count;
    for (int i = 0; i < count; i++) {
        struct node_sum *const node = &sums[members[i]];
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            node->rgb[c] += places.sums[c][i];
            for (int k = 0; gather->level > 0 && k < 3; k++)
                node->slopes[k][c] += places.slopes[c][k][i];
        }
    }
}

/* One band at all nodes of a tile, or at those that are refined. */
static void sum_band(struct gather *gather, const struct render_gather_tile *tile, int band,
                     struct scratch *scratch, struct tile_sums *sums)
{
    const struct render_gather_object *const object = &gather->request->objects[tile->object];
    struct render_gather_box box;
    int members[RENDER_GATHER_TILE_NODES], count = 0;
    for (int i = 0; i < tile->count; i++) {
        const bool is_half = tile->is_half_refined[i] && band < tile->half_end;
        if (band >= tile->end && !tile->is_refined[i] && !is_half)
            continue;
        render_gather_box_add(&box, render_gather_place(gather->request, tile->pixels[i]), count == 0);
        members[count++] = i;
    }
    if (count == 0)
        return;
    const size_t group_count =
        render_gather_find(&object->sources->levels[band], &box, object->medium->reach_mm[band],
                           scratch->groups, gather->group_limit);
    for (int i = 0; i < count; i += RENDER_GATHER_LANES)
        sum_places(gather, tile, band, members + i,
                   count - i < RENDER_GATHER_LANES ? count - i : RENDER_GATHER_LANES, group_count, scratch,
                   band < tile->end ? sums->own : sums->rest);
}

/* The mean of nodes; with slopes, each with half of what its slope adds on the way to the place, which
 * makes up for what second derivatives would be off by; and half of what the mean slope adds from where
 * they lie on average.
 */
static void interpolate(const struct gather *gather, const struct render_gather_tile *tile, int index,
                        struct node_sum *sum)
{
    const struct render_gather_blend *const blend = &tile->blends[index];
    const struct render_gather_nodes *const level = &gather->places.levels[tile->coarser];
    const float *const here = render_gather_place(gather->request, tile->pixels[index]);
    float steps_mm[4][3], off_mm[3] = { 0, 0, 0 };
    for (int corner = 0; corner < 4; corner++) {
        const bool is_used = blend->weights[corner] > 0;
        const int32_t pixel = is_used ? level->pixels[blend->nodes[corner]] : tile->pixels[index];
        const float *const there = render_gather_place(gather->request, pixel);
        for (int k = 0; k < 3; k++) {
            steps_mm[corner][k] = here[k] - there[k];
            off_mm[k] += blend->weights[corner] * steps_mm[corner][k];
        }
    }
    for (int corner = 0; corner < 4; corner++) {
        const float weight = blend->weights[corner];
        if (!(weight > 0))
            continue;
        const struct node *const of_node = &gather->nodes[tile->coarser][blend->nodes[corner]];
        const struct node_sum *const node = tile->is_half_refined[index] ? &of_node->rest : &of_node->all;
        float way_mm[3];
        for (int k = 0; k < 3; k++)
            way_mm[k] = 0.5f * weight * (steps_mm[corner][k] + off_mm[k]);
        for (int c = 0; c < 4; c++)
            sum->rgb[c] += weight * node->rgb[c] + node->slopes[0][c] * way_mm[0] +
                           node->slopes[1][c] * way_mm[1] + node->slopes[2][c] * way_mm[2];
        for (int k = 0; gather->level > 0 && k < 3; k++) {
            for (int c = 0; c < 4; c++)
                sum->slopes[k][c] += weight * node->slopes[k][c];
        }
    }
}

static void add(const struct node_sum *a, const struct node_sum *b, struct node_sum *sum)
{
    for (int k = 0; k < 4; k++)
        sum->rgb[k] = a->rgb[k] + b->rgb[k];
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 4; c++)
            sum->slopes[k][c] = a->slopes[k][c] + b->slopes[k][c];
    }
}

static void store(const struct gather *gather, const struct render_gather_tile *tile,
                  const struct tile_sums *sums)
{
    for (int i = 0; i < tile->count; i++) {
        const struct node_sum *const own = &sums->own[i], *const rest = &sums->rest[i];
        if (gather->level > 0) {
            struct node *const node = &gather->nodes[gather->level][tile->nodes[i]];
            add(own, rest, &node->all);
            node->rest = *rest;
        } else {
            float *const radiosity = gather->radiosity + 4 * (size_t)tile->nodes[i];
            for (int k = 0; k < 4; k++)
                radiosity[k] = own->rgb[k] + rest->rgb[k];
        }
    }
}

/* All that is to be done at a tile's nodes: what coarser levels have summed is taken from there. */
static void sum_tile(struct gather *gather, const struct render_gather_tile *tile, struct scratch *scratch)
{
    struct tile_sums sums;
    memset(sums.own, 0, (size_t)tile->count * sizeof *sums.own);
    memset(sums.rest, 0, (size_t)tile->count * sizeof *sums.rest);
    for (int i = 0; i < tile->count; i++) {
        if (tile->coarser >= 0 && !tile->is_refined[i])
            interpolate(gather, tile, i, &sums.rest[i]);
    }
    const int half_end = tile->half_refined_count > 0 ? tile->half_end : tile->end;
    for (int band = tile->first; band < (tile->refined_count > 0 ? tile->last : half_end); band++)
        sum_band(gather, tile, band, scratch, &sums);
    store(gather, tile, &sums);
    scratch->counts.place_count += (size_t)tile->count;
    scratch->counts.refined_count += (size_t)tile->refined_count;
}

static void sum_row(void *context, int tile_y)
{
    struct gather *const gather = context;
    const int width = gather->places.levels[gather->level].width;
    struct scratch scratch = { .groups = malloc((gather->group_limit + 1) * sizeof *scratch.groups) };
    if (!scratch.groups) {
        atomic_store(&gather->is_out_of_memory, true);
        return;
    }
    for (int tile_x = 0; tile_x * RENDER_GATHER_TILE < width; tile_x++) {
        struct render_gather_tile tile;
        for (int least = 0;
             render_gather_tile_init(&gather->places, gather->level, tile_x, tile_y, least, &tile);
             least = tile.object + 1)
            sum_tile(gather, &tile, &scratch);
    }
    free(scratch.groups);
    atomic_fetch_add(&gather->place_count, scratch.counts.place_count);
    atomic_fetch_add(&gather->refined_count, scratch.counts.refined_count);
    atomic_fetch_add(&gather->evaluation_count, scratch.counts.evaluation_count);
}

size_t render_gather_group_limit(const struct render_gather_request *request)
{
    size_t limit = 0;
    for (size_t i = 0; i < request->object_count; i++) {
        const struct render_gather_sources *const sources = request->objects[i].sources;
        for (int b = 0; sources && b < sources->band_count; b++)
            limit = sources->levels[b].group_count > limit ? sources->levels[b].group_count : limit;
    }
    return limit;
}

static bool create_nodes(struct gather *gather, dipole_status *status)
{
    for (int l = 1; l < gather->places.level_count; l++) {
        const struct render_gather_nodes *const level = &gather->places.levels[l];
        const size_t count = (size_t)level->width * (size_t)level->height;
        gather->nodes[l] = calloc(count, sizeof *gather->nodes[l]);
        if (!gather->nodes[l])
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather at %zu places",
                               count);
    }
    return true;
}

bool render_gather_run(const struct render_gather_request *request, float *radiosity_w_per_mm2,
                       struct render_gather_counts *counts_out, dipole_status *status)
{
    struct gather gather = { .request = request,
                             .loops = render_gather_loops_best(),
                             .group_limit = render_gather_group_limit(request) };
    gather.radiosity = radiosity_w_per_mm2;
    bool done = render_gather_places_init(request, &gather.places, status) && create_nodes(&gather, status);
    for (int l = gather.places.level_count - 1; done && l >= 0; l--) {
        gather.level = l;
        lut_parallel_for((gather.places.levels[l].height + RENDER_GATHER_TILE - 1) / RENDER_GATHER_TILE,
                         request->thread_count, sum_row, &gather);
        if (atomic_load(&gather.is_out_of_memory))
            done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                               "no memory to gather %zu groups of light samples", gather.group_limit);
    }
    if (done && counts_out)
        *counts_out =
            (struct render_gather_counts){ .place_count = atomic_load(&gather.place_count),
                                           .refined_count = atomic_load(&gather.refined_count),
                                           .evaluation_count = atomic_load(&gather.evaluation_count) };
    for (int l = 1; l < RENDER_GATHER_LEVELS; l++)
        free(gather.nodes[l]);
    render_gather_places_end(&gather.places);
    return done;
}
