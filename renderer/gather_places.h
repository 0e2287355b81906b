/*
 * Where bands are summed: levels of pixels 2^level apart, and what may be interpolated between them.
 * theory.md T43.
 */
#ifndef RENDERER_GATHER_PLACES_H
#define RENDERER_GATHER_PLACES_H

#include "renderer/gather.h"

enum { RENDER_GATHER_TILE = 8, RENDER_GATHER_TILE_NODES = RENDER_GATHER_TILE * RENDER_GATHER_TILE };

/* Every 2^level-th pixel. */
struct render_gather_nodes {
    int width, height;
    int32_t *pixels; /* of each node the pixel it stands at; -1: none. NULL: node and pixel are the same */
};

/* Which level an object's bands are summed at: bands first[l] .. first[l + 1] - 1 at level l. */
struct render_gather_schedule {
    int first[RENDER_GATHER_LEVELS + 1];
    int coarser[RENDER_GATHER_LEVELS]; /* the next level that has bands; -1: none */
};

struct render_gather_places_of_frame {
    const struct render_gather_request *request;
    struct render_gather_schedule *schedules; /* of each object */
    struct render_gather_nodes levels[RENDER_GATHER_LEVELS];
    int level_count;
    int level; /* being made */
};

/* Fails with DIPOLE_OUT_OF_MEMORY; end it in any case. The request must outlive it. */
DIPOLE_CHECKED bool render_gather_places_init(const struct render_gather_request *request,
                                              struct render_gather_places_of_frame *places,
                                              dipole_status *status);
void render_gather_places_end(struct render_gather_places_of_frame *places);

/* Nodes of one object in a tile of a level, those that lie together one after the other. A node takes what
 * is coarser from blend's nodes of level coarser, unless it is refined: then it sums those bands itself. */
struct render_gather_tile {
    int object, count, refined_count, half_refined_count;
    int first, end, last; /* bands: first .. end - 1 of the level, to last - 1 where it is refined */
    int coarser;          /* -1: there is nothing coarser */
    int32_t nodes[RENDER_GATHER_TILE_NODES], pixels[RENDER_GATHER_TILE_NODES];
    bool is_refined[RENDER_GATHER_TILE_NODES];
    /* With slopes alone: not refined, but it sums end .. half_end - 1 itself, the bands of level coarser,
     * and takes from its nodes what they have taken. */
    bool is_half_refined[RENDER_GATHER_TILE_NODES];
    int half_end;
    struct render_gather_blend {
        int32_t nodes[4];
        float weights[4];
    } blends[RENDER_GATHER_TILE_NODES];
};

/* The tile's nodes of the lowest object that is not below least and has something to do at the level;
 * false: there are none. */
bool render_gather_tile_init(const struct render_gather_places_of_frame *places, int level, int tile_x,
                             int tile_y, int least, struct render_gather_tile *tile);

/* x y z in mm, number of the object from 1. */
static inline const float *render_gather_place(const struct render_gather_request *request, int32_t pixel)
{
    return request->position_mm + 4 * (size_t)pixel;
}

static inline void render_gather_box_add(struct render_gather_box *box, const float place_mm[3],
                                         bool is_first)
{
    for (int k = 0; k < 3; k++) {
        box->min_mm[k] = is_first || place_mm[k] < box->min_mm[k] ? place_mm[k] : box->min_mm[k];
        box->max_mm[k] = is_first || place_mm[k] > box->max_mm[k] ? place_mm[k] : box->max_mm[k];
    }
}

#endif
