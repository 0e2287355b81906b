#include "renderer/gather_records.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct recorder {
    const struct render_gather_places_of_frame *places;
    const struct render_gather_loops *loops;
    const uint32_t *first_groups;
    size_t group_limit;
    int level, first_row;
    struct render_gather_records *rows; /* one for each row of tiles */
    bool *is_out_of_memory;             /* the same */
};

/* Room for one tile and so many words more. */
static bool reserve(struct render_gather_records *records, size_t word_count)
{
    if (records->tile_count == records->tile_capacity) {
        const size_t capacity = 2 * records->tile_capacity + 64;
        struct render_gather_record *const grown = realloc(records->tiles, capacity * sizeof *grown);
        if (!grown)
            return false;
        records->tiles = grown;
        records->tile_capacity = capacity;
    }
    if (records->word_capacity - records->word_count < word_count) {
        const size_t capacity = 2 * records->word_capacity + word_count;
        uint32_t *const grown = realloc(records->words, capacity * sizeof *grown);
        if (!grown)
            return false;
        records->words = grown;
        records->word_capacity = capacity;
    }
    return true;
}

static uint32_t mask_of(const struct render_gather_blend *blend)
{
    uint32_t mask = 0;
    for (int corner = 0; corner < 4; corner++)
        mask |= blend->weights[corner] > 0 ? 1u << corner : 0;
    return mask;
}

static void write_nodes(const struct render_gather_tile *tile, int width, uint32_t *words)
{
    memset(words, 0, RENDER_GATHER_TILE_NODES * sizeof *words);
    for (int i = 0; i < tile->count; i++) {
        const int x = tile->nodes[i] % width % RENDER_GATHER_TILE,
                  y = tile->nodes[i] / width % RENDER_GATHER_TILE;
        const bool is_blended = tile->coarser >= 0 && !tile->is_refined[i];
        const uint32_t mask = is_blended ? mask_of(&tile->blends[i]) : 0;
        words[RENDER_GATHER_TILE * y + x] =
            (uint32_t)tile->pixels[i] | mask << RENDER_GATHER_MASK_SHIFT | RENDER_GATHER_NODE_BIT;
    }
}

/* What the nodes that sum the band lie in. */
static struct render_gather_box box_of(const struct recorder *recorder,
                                       const struct render_gather_tile *tile, int band)
{
    struct render_gather_box box = { { 0 }, { 0 } };
    bool is_first = true;
    for (int i = 0; i < tile->count; i++) {
        if (band >= tile->end && !tile->is_refined[i])
            continue;
        render_gather_box_add(&box, render_gather_place(recorder->places->request, tile->pixels[i]),
                              is_first);
        is_first = false;
    }
    return box;
}

static bool record_band(const struct recorder *recorder, const struct render_gather_tile *tile, int band,
                        uint32_t *groups, struct render_gather_records *records)
{
    const size_t object = (size_t)tile->object;
    const struct render_gather_object *const gathered = &recorder->places->request->objects[object];
    const struct render_gather_level *const level = &gathered->sources->levels[band];
    const uint32_t first_group = recorder->first_groups[render_gather_band_number(object, band)];
    const struct render_gather_box box = box_of(recorder, tile, band);
    const size_t group_count =
        render_gather_find(level, &box, gathered->medium->reach_mm[band], groups, recorder->group_limit);
    if (!reserve(records, group_count + 1))
        return false;
    uint32_t *const words = records->words + records->word_count + 1, count = 0;
    for (size_t g = 0; g < group_count; g++) {
        const unsigned near = recorder->loops->near(&level->groups[groups[g]], &box,
                                                    gathered->medium->kernels[band].reach2_mm2);
        words[count] = (first_group + groups[g]) << RENDER_GATHER_GROUP_SHIFT | near;
        count += near != 0;
    }
    words[-1] = count;
    records->word_count += count + 1;
    return true;
}

static bool record_tile(const struct recorder *recorder, const struct render_gather_tile *tile, int tile_x,
                        int tile_y, uint32_t *groups, struct render_gather_records *records)
{
    if (!reserve(records, RENDER_GATHER_TILE_NODES))
        return false;
    const int listed = tile->refined_count > 0 ? tile->last : tile->end;
    records->tiles[records->tile_count++] = (struct render_gather_record){
        .x = tile_x,
        .y = tile_y,
        .first_word = (uint32_t)records->word_count,
        .coarser = tile->coarser,
        .first_kernel = (int32_t)render_gather_band_number((size_t)tile->object, tile->first),
        .band_count = tile->end - tile->first,
        .refined_band_count = tile->last - tile->first,
        .object = tile->object,
    };
    write_nodes(tile, recorder->places->levels[recorder->level].width,
                records->words + records->word_count);
    records->word_count += RENDER_GATHER_TILE_NODES;
    for (int band = tile->first; band < listed; band++) {
        if (!record_band(recorder, tile, band, groups, records))
            return false;
    }
    return true;
}

static void record_row(void *context, int index)
{
    const struct recorder *const recorder = context;
    const int tile_y = recorder->first_row + index, width = recorder->places->levels[recorder->level].width;
    uint32_t *const groups = calloc(recorder->group_limit + 1, sizeof *groups);
    bool done = groups != NULL;
    for (int tile_x = 0; done && tile_x * RENDER_GATHER_TILE < width; tile_x++) {
        struct render_gather_tile tile;
        for (int least = 0; done && render_gather_tile_init(recorder->places, recorder->level, tile_x,
                                                            tile_y, least, &tile);
             least = tile.object + 1)
            done = record_tile(recorder, &tile, tile_x, tile_y, groups, &recorder->rows[index]);
    }
    recorder->is_out_of_memory[index] = !done;
    free(groups);
}

static bool append(const struct render_gather_records *row, struct render_gather_records *records)
{
    for (size_t t = 0; t < row->tile_count; t++) {
        if (!reserve(records, t == 0 ? row->word_count : 0))
            return false;
        records->tiles[records->tile_count] = row->tiles[t];
        records->tiles[records->tile_count++].first_word += (uint32_t)records->word_count;
    }
    if (row->word_count > 0)
        memcpy(records->words + records->word_count, row->words, row->word_count * sizeof *row->words);
    records->word_count += row->word_count;
    return true;
}

bool render_gather_record(const struct render_gather_places_of_frame *places, int level, int first_row,
                          int end_row, const uint32_t *first_groups, struct render_gather_records *records,
                          dipole_status *status)
{
    assert(first_row < end_row);
    const size_t row_count = (size_t)(end_row - first_row);
    struct recorder recorder = { .places = places,
                                 .loops = render_gather_loops_best(),
                                 .first_groups = first_groups,
                                 .group_limit = render_gather_group_limit(places->request),
                                 .level = level,
                                 .first_row = first_row,
                                 .rows = calloc(row_count, sizeof *recorder.rows),
                                 .is_out_of_memory = calloc(row_count, sizeof(bool)) };
    records->tile_count = records->word_count = 0;
    bool done = recorder.rows && recorder.is_out_of_memory;
    if (done)
        lut_parallel_for((int)row_count, places->request->thread_count, record_row, &recorder);
    for (size_t row = 0; done && row < row_count; row++)
        done = !recorder.is_out_of_memory[row] && append(&recorder.rows[row], records);
    for (size_t row = 0; recorder.rows && row < row_count; row++)
        render_gather_records_end(&recorder.rows[row]);
    free(recorder.rows);
    free(recorder.is_out_of_memory);
    return done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                               "no memory to list the light samples near %zu rows of pixels",
                               row_count * RENDER_GATHER_TILE);
}

void render_gather_records_end(struct render_gather_records *records)
{
    free(records->tiles);
    free(records->words);
    *records = (struct render_gather_records){ 0 };
}
