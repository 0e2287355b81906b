#include "renderer/light_picture.h"

#include "lutgen/parallel.h"
#include "renderer/light_clip.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    STEPS =
        256, /* places of corners in a texel, along x and y: as in OpenGL, edges then meet without gaps */
    BLOCK_SIZE = 4096, /* of vertices or triangles, placed by one thread at a time */
    GUARD = 4          /* triangles that reach so many times farther than the picture are clipped */
};

/* On which side of a perspective view a vertex is. What is on one side with all corners is not seen. */
enum {
    SIDE_NEAR = 1,
    SIDE_LEFT = 2,
    SIDE_RIGHT = 4,
    SIDE_LOW = 8,
    SIDE_HIGH = 16,
    SIDE_FAR_OUT = 32 /* has no place: its triangle is clipped, or on one side */
};

/* A vertex in the picture: steps from its lower left corner, and what is less the nearer it is and linear
 * in the picture: mm along the light; perspective: -far / depth. */
struct corner {
    int32_t x, y;
    float order;
    uint32_t sides;
};

/* Texels whose middles a triangle may cover, from the first to the last; none: high < low. */
struct box {
    int16_t left, right, low, high;
};
static const struct box no_box = { .low = 0, .high = -1 }, to_be_clipped = { .low = 0, .high = -2 };

/* A triangle that is left of a clipped one. */
struct piece {
    struct corner corners[3];
    float position_mm[3][3], normal[3][3], rest_mm[3][3];
    uint32_t mesh;
    struct box box;
};

/* A triangle of a mesh; of the number of meshes: a piece. */
struct entry {
    uint32_t mesh, triangle;
};

/* What a texel shows: which entry of the tile, from 1, and weights of its second and third corner, linear
 * in the picture. It is kept where the texel itself comes to be. */
struct seen {
    float b, c, order;
    uint32_t entry;
};
_Static_assert(sizeof(struct seen) == 4 * sizeof(float), "as large as a texel");

struct render_light_tiles {
    struct render_light_picture picture;
    int tile_px, shift_px;
    size_t column_count, tile_count;
    struct corner *corners;                /* of all meshes */
    struct box *boxes;                     /* of all triangles */
    size_t *first_corner, *first_triangle; /* of each mesh, and one past the last */
    size_t mesh;                           /* that is being placed */
    struct piece *pieces;
    size_t piece_count, piece_capacity;
    size_t *first_entry, *placed; /* of each tile, and one past the last */
    struct entry *entries;
};

/* ---- corners ------------------------------------------------------------------------------------ */

static void to_view(const struct render_projection *view, const struct io_mesh *mesh, size_t vertex,
                    double place_mm[3])
{
    const float *const at = &mesh->positions[3 * vertex];
    const double position_mm[3] = { (double)at[0], (double)at[1], (double)at[2] };
    render_projection_to_view(view, position_mm, place_mm);
}

/* In steps from the lower left corner, of what may be at most reach from the middle. */
static int32_t steps_at(double at, double reach, int size_px)
{
    return (int32_t)lrint(0.5 * size_px * STEPS * (at / reach + 1));
}

static struct corner parallel_corner(const struct render_projection *view, int size_px,
                                     const double place_mm[3])
{
    const double x = fmin(fmax(place_mm[0], -view->half_width), view->half_width),
                 y = fmin(fmax(place_mm[1], -view->half_height), view->half_height);
    return (struct corner){ .x = steps_at(x, view->half_width, size_px),
                            .y = steps_at(y, view->half_height, size_px),
                            .order = (float)place_mm[2] };
}

/* In front of the near plane and no farther beside the picture than GUARD allows. */
static struct corner perspective_corner(const struct render_projection *view, int size_px,
                                        const double place_mm[3])
{
    return (struct corner){ .x = steps_at(place_mm[0], view->half_width * place_mm[2], size_px),
                            .y = steps_at(place_mm[1], view->half_height * place_mm[2], size_px),
                            .order = (float)(-view->far_mm / place_mm[2]) };
}

static uint32_t sides_of(const struct render_projection *view, const double place_mm[3])
{
    const double x_mm = place_mm[0], y_mm = place_mm[1], reach_x_mm = view->half_width * place_mm[2],
                 reach_y_mm = view->half_height * place_mm[2];
    uint32_t sides = 0;
    sides |= x_mm < -reach_x_mm ? SIDE_LEFT : 0;
    sides |= x_mm > reach_x_mm ? SIDE_RIGHT : 0;
    sides |= y_mm < -reach_y_mm ? SIDE_LOW : 0;
    sides |= y_mm > reach_y_mm ? SIDE_HIGH : 0;
    if (place_mm[2] < view->near_mm)
        sides |= SIDE_NEAR | SIDE_FAR_OUT;
    else if (fabs(x_mm) > GUARD * reach_x_mm || fabs(y_mm) > GUARD * reach_y_mm)
        sides |= SIDE_FAR_OUT;
    return sides;
}

static void place_corners(void *context, int block)
{
    const struct render_light_tiles *const tiles = context;
    const struct render_light_picture *const picture = &tiles->picture;
    const struct render_projection *const view = picture->projection;
    const struct io_mesh *const mesh = picture->meshes[tiles->mesh].mesh;
    struct corner *const corners = tiles->corners + tiles->first_corner[tiles->mesh];
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t v = first; v < mesh->vertex_count && v < first + BLOCK_SIZE; v++) {
        double place_mm[3];
        to_view(view, mesh, v, place_mm);
        if (view->is_orthographic) {
            corners[v] = parallel_corner(view, picture->size_px, place_mm);
            continue;
        }
        const uint32_t sides = sides_of(view, place_mm);
        corners[v] = sides & SIDE_FAR_OUT ? (struct corner){ .x = 0 }
                                          : perspective_corner(view, picture->size_px, place_mm);
        corners[v].sides = sides;
    }
}

/* ---- triangles ---------------------------------------------------------------------------------- */

static int32_t least(int32_t a, int32_t b, int32_t c)
{
    const int32_t of_two = a < b ? a : b;
    return of_two < c ? of_two : c;
}

static int32_t most(int32_t a, int32_t b, int32_t c)
{
    return -least(-a, -b, -c);
}

/* The first texel of the picture whose middle is not before a place, and the last that is not after it. */
static int32_t texel_from(int32_t place, int size_px)
{
    const int32_t texel = (place + STEPS / 2 - 1) / STEPS;
    return texel < 0 ? 0 : texel < size_px ? texel : size_px;
}

static int32_t texel_to(int32_t place, int size_px)
{
    const int32_t texel = (place + STEPS / 2) / STEPS - 1;
    return texel < 0 ? -1 : texel < size_px ? texel : size_px - 1;
}

/* Twice the area, in steps^2; > 0: counter-clockwise, seen from the front. */
static int64_t area_of(const struct corner *a, const struct corner *b, const struct corner *c)
{
    return (int64_t)(b->x - a->x) * (c->y - a->y) - (int64_t)(c->x - a->x) * (b->y - a->y);
}

static struct box box_of(const struct corner *a, const struct corner *b, const struct corner *c,
                         int size_px, bool has_hidden_inside)
{
    const int64_t area = area_of(a, b, c);
    const struct box box = { .left = (int16_t)texel_from(least(a->x, b->x, c->x), size_px),
                             .right = (int16_t)texel_to(most(a->x, b->x, c->x), size_px),
                             .low = (int16_t)texel_from(least(a->y, b->y, c->y), size_px),
                             .high = (int16_t)texel_to(most(a->y, b->y, c->y), size_px) };
    return area == 0 || (area < 0 && has_hidden_inside) || box.left > box.right ? no_box : box;
}

static void place_triangles(void *context, int block)
{
    const struct render_light_tiles *const tiles = context;
    const struct render_light_mesh *const of = &tiles->picture.meshes[tiles->mesh];
    const struct corner *const corners = tiles->corners + tiles->first_corner[tiles->mesh];
    struct box *const boxes = tiles->boxes + tiles->first_triangle[tiles->mesh];
    const size_t first = (size_t)block * BLOCK_SIZE;
    for (size_t t = first; t < of->mesh->triangle_count && t < first + BLOCK_SIZE; t++) {
        const uint32_t *const index = &of->mesh->indices[3 * t];
        const struct corner *const a = &corners[index[0]], *const b = &corners[index[1]],
                                   *const c = &corners[index[2]];
        if ((a->sides & b->sides & c->sides & ~(uint32_t)SIDE_FAR_OUT) != 0)
            boxes[t] = no_box;
        else if (((a->sides | b->sides | c->sides) & SIDE_FAR_OUT) != 0)
            boxes[t] = to_be_clipped;
        else
            boxes[t] = box_of(a, b, c, tiles->picture.size_px, of->has_hidden_inside);
    }
}

/* ---- pieces ------------------------------------------------------------------------------------- */

static struct piece *add_piece(struct render_light_tiles *tiles)
{
    if (tiles->piece_count == tiles->piece_capacity) {
        const size_t capacity = 2 * tiles->piece_capacity + 64;
        struct piece *const grown = realloc(tiles->pieces, capacity * sizeof *grown);
        if (!grown)
            return NULL;
        tiles->pieces = grown;
        tiles->piece_capacity = capacity;
    }
    return &tiles->pieces[tiles->piece_count++];
}

static void interpolate(const float *values, const uint32_t index[3], const double weights[3], float out[3])
{
    for (size_t k = 0; k < 3; k++) {
        double sum = 0;
        for (int i = 0; i < 3; i++)
            sum += weights[i] * (double)values[3 * (size_t)index[i] + k];
        out[k] = (float)sum;
    }
}

/* As a fan of triangles about one of the corners that are left. */
static bool add_pieces(struct render_light_tiles *tiles, size_t mesh, size_t triangle)
{
    const struct render_light_picture *const picture = &tiles->picture;
    const struct render_light_mesh *const of = &picture->meshes[mesh];
    const uint32_t *const index = &of->mesh->indices[3 * triangle];
    struct render_clip_corner clipped[RENDER_CLIP_CORNERS];
    double places_mm[3][3];
    for (int i = 0; i < 3; i++)
        to_view(picture->projection, of->mesh, index[i], places_mm[i]);
    const size_t count = render_clip_triangle(picture->projection, GUARD, places_mm, clipped);
    for (size_t i = 2; i < count; i++) {
        const size_t fan[3] = { 0, i - 1, i };
        struct piece *const piece = add_piece(tiles);
        if (!piece)
            return false;
        piece->mesh = (uint32_t)mesh;
        for (int k = 0; k < 3; k++) {
            const struct render_clip_corner *const at = &clipped[fan[k]];
            piece->corners[k] = perspective_corner(picture->projection, picture->size_px, at->in_view_mm);
            interpolate(of->mesh->positions, index, at->weights, piece->position_mm[k]);
            interpolate(of->mesh->normals, index, at->weights, piece->normal[k]);
            if (of->rest_mm)
                interpolate(of->rest_mm, index, at->weights, piece->rest_mm[k]);
        }
        piece->box = box_of(&piece->corners[0], &piece->corners[1], &piece->corners[2], picture->size_px,
                            of->has_hidden_inside);
    }
    return true;
}

static bool clip_triangles(struct render_light_tiles *tiles)
{
    const struct render_light_picture *const picture = &tiles->picture;
    bool done = true;
    for (size_t m = 0; !picture->projection->is_orthographic && m < picture->mesh_count; m++) {
        const struct box *const boxes = tiles->boxes + tiles->first_triangle[m];
        for (size_t t = 0; done && t < picture->meshes[m].mesh->triangle_count; t++) {
            if (boxes[t].high == to_be_clipped.high)
                done = add_pieces(tiles, m, t);
        }
    }
    return done;
}

/* ---- tiles -------------------------------------------------------------------------------------- */

static size_t triangle_count(const struct render_light_tiles *tiles, size_t mesh)
{
    return mesh < tiles->picture.mesh_count ? tiles->picture.meshes[mesh].mesh->triangle_count
                                            : tiles->piece_count;
}

static const struct box *box_at(const struct render_light_tiles *tiles, size_t mesh, size_t triangle)
{
    return mesh < tiles->picture.mesh_count ? &tiles->boxes[tiles->first_triangle[mesh] + triangle]
                                            : &tiles->pieces[triangle].box;
}

/* To every tile that it may show in: is counted, or placed. */
static void share_out_triangle(struct render_light_tiles *tiles, struct entry entry, bool is_placing)
{
    const struct box *const box = box_at(tiles, entry.mesh, entry.triangle);
    if (box->high < box->low)
        return;
    const int size_px = tiles->tile_px, shift_px = tiles->shift_px;
    for (int row = (box->low + shift_px) / size_px; row <= (box->high + shift_px) / size_px; row++) {
        for (int column = (box->left + shift_px) / size_px; column <= (box->right + shift_px) / size_px;
             column++) {
            const size_t tile = (size_t)row * tiles->column_count + (size_t)column;
            if (is_placing)
                tiles->entries[tiles->placed[tile]++] = entry;
            else
                tiles->first_entry[tile + 1]++;
        }
    }
}

/* In the order of the meshes; pieces behind them. */
static bool share_out(struct render_light_tiles *tiles)
{
    for (int is_placing = 0; is_placing < 2; is_placing++) {
        for (size_t m = 0; m <= tiles->picture.mesh_count; m++) {
            for (size_t t = 0; t < triangle_count(tiles, m); t++)
                share_out_triangle(tiles, (struct entry){ .mesh = (uint32_t)m, .triangle = (uint32_t)t },
                                   is_placing);
        }
        for (size_t tile = 0; !is_placing && tile < tiles->tile_count; tile++) {
            tiles->first_entry[tile + 1] += tiles->first_entry[tile];
            tiles->placed[tile] = tiles->first_entry[tile];
        }
        if (!is_placing)
            tiles->entries = calloc(tiles->first_entry[tiles->tile_count] + 1, sizeof *tiles->entries);
        if (!tiles->entries)
            return false;
    }
    return true;
}

/* ---- texels ------------------------------------------------------------------------------------- */

/* Twice the area of an edge and a texel's middle, in steps^2: how it changes from texel to texel. */
struct edge {
    int64_t here, by_x, by_y;
};

/* From a to b, at the middle of texel (x, y). Middles that lie on an edge belong to the triangle on one
 * side of it.
 */
static struct edge edge_of(const struct corner *a, const struct corner *b, int32_t x, int32_t y)
{
    const int64_t dx = b->x - a->x, dy = b->y - a->y;
    const bool is_owner = dy < 0 || (dy == 0 && dx < 0);
    const int64_t from_x = (int64_t)x * STEPS + STEPS / 2 - a->x,
                  from_y = (int64_t)y * STEPS + STEPS / 2 - a->y;
    return (struct edge){ .here = dx * from_y - dy * from_x - (is_owner ? 0 : 1),
                          .by_x = -dy * STEPS,
                          .by_y = dx * STEPS };
}

struct triangle {
    const struct corner *corners[3];
    const float *position_mm[3], *normal[3], *rest_mm[3]; /* rest: NULL where not asked for */
    size_t mesh;
};

static struct triangle triangle_of(const struct render_light_tiles *tiles, const struct entry *entry)
{
    const struct render_light_picture *const picture = &tiles->picture;
    struct triangle triangle = { .mesh = entry->mesh };
    if (entry->mesh == picture->mesh_count) {
        const struct piece *const piece = &tiles->pieces[entry->triangle];
        triangle.mesh = piece->mesh;
        for (int i = 0; i < 3; i++) {
            triangle.corners[i] = &piece->corners[i];
            triangle.position_mm[i] = piece->position_mm[i];
            triangle.normal[i] = piece->normal[i];
            triangle.rest_mm[i] = picture->meshes[piece->mesh].rest_mm ? piece->rest_mm[i] : NULL;
        }
        return triangle;
    }
    const struct io_mesh *const mesh = picture->meshes[entry->mesh].mesh;
    const float *const rest_mm = picture->meshes[entry->mesh].rest_mm;
    const uint32_t *const index = &mesh->indices[3 * (size_t)entry->triangle];
    for (int i = 0; i < 3; i++) {
        triangle.rest_mm[i] = rest_mm ? &rest_mm[3 * (size_t)index[i]] : NULL;
        triangle.corners[i] = &tiles->corners[tiles->first_corner[entry->mesh] + index[i]];
        triangle.position_mm[i] = &mesh->positions[3 * (size_t)index[i]];
        triangle.normal[i] = &mesh->normals[3 * (size_t)index[i]];
    }
    return triangle;
}

/* What is in the tile whose lower left texel is (left_px, low_px). */
static void draw_triangle(const struct render_light_tiles *tiles, const struct entry *entry,
                          uint32_t number, int left_px, int low_px, struct seen *seen)
{
    const struct triangle triangle = triangle_of(tiles, entry);
    const struct corner *const a = triangle.corners[0];
    const struct corner *b = triangle.corners[1], *c = triangle.corners[2];
    const struct box *const box = box_at(tiles, entry->mesh, entry->triangle);
    const bool is_behind = area_of(a, b, c) < 0;
    if (is_behind) {
        const struct corner *const swap = b;
        b = c;
        c = swap;
    }
    const int beyond = tiles->tile_px - 1;
    const int left = box->left > left_px ? box->left : left_px,
              right = box->right < left_px + beyond ? box->right : left_px + beyond,
              first = box->low > low_px ? box->low : low_px,
              last = box->high < low_px + beyond ? box->high : low_px + beyond;
    struct edge of_a = edge_of(b, c, left, first), of_b = edge_of(c, a, left, first),
                of_c = edge_of(a, b, left, first);
    const float scale = 1 / (float)area_of(a, b, c);
    const float by_b = b->order - a->order, by_c = c->order - a->order;
    for (int y = first; y <= last; y++) {
        struct seen *const row = seen + (size_t)(y - low_px) * (size_t)tiles->tile_px;
        int64_t at_a = of_a.here, at_b = of_b.here, at_c = of_c.here;
        for (int x = left - left_px; x <= right - left_px; x++) {
            if ((at_a | at_b | at_c) >= 0) {
                const float part_b = scale * (float)at_b, part_c = scale * (float)at_c;
                const float order = a->order + part_b * by_b + part_c * by_c;
                if (row[x].entry == 0 || order < row[x].order)
                    row[x] = (struct seen){ .entry = number,
                                            .b = is_behind ? part_c : part_b,
                                            .c = is_behind ? part_b : part_c,
                                            .order = order };
            }
            at_a += of_a.by_x;
            at_b += of_b.by_x;
            at_c += of_c.by_x;
        }
        of_a.here += of_a.by_y;
        of_b.here += of_b.by_y;
        of_c.here += of_c.by_y;
    }
}

/* What is interpolated over a triangle: position, normal and place at rest of its first corner, and steps
 * to the others. */
struct surface {
    float position_mm[3][3], normal[3][3], rest_mm[3][3];
    float order_b, order_c; /* perspective: what turns weights in the picture into those on the surface */
    float eta, size;        /* of a texel; 0: seen from behind */
    float object;
};

static void find_surface(const struct render_light_tiles *tiles, const struct entry *entry,
                         struct surface *surface)
{
    const struct render_light_picture *const picture = &tiles->picture;
    const struct triangle triangle = triangle_of(tiles, entry);
    for (int k = 0; k < 3; k++) {
        for (int i = 2; i >= 0; i--) {
            surface->position_mm[i][k] =
                triangle.position_mm[i][k] - (i > 0 ? triangle.position_mm[0][k] : 0);
            surface->normal[i][k] = triangle.normal[i][k] - (i > 0 ? triangle.normal[0][k] : 0);
            if (triangle.rest_mm[0])
                surface->rest_mm[i][k] = triangle.rest_mm[i][k] - (i > 0 ? triangle.rest_mm[0][k] : 0);
        }
    }
    const bool is_front = area_of(triangle.corners[0], triangle.corners[1], triangle.corners[2]) > 0;
    surface->order_b = triangle.corners[1]->order;
    surface->order_c = triangle.corners[2]->order;
    surface->eta = (float)picture->meshes[triangle.mesh].eta;
    surface->size = is_front ? (float)picture->texel_area : 0;
    surface->object = (float)(triangle.mesh + 1);
}

/* The way to the light from a position p: from + by p; perspective: in units of the view's far_mm. */
struct light {
    float from[3], by, forward[3];
    bool is_parallel;
};

static struct light light_of(const struct render_projection *view)
{
    struct light light = { .is_parallel = view->is_orthographic };
    light.by = view->is_orthographic ? 0 : (float)(-1 / view->far_mm);
    for (int k = 0; k < 3; k++) {
        light.forward[k] = (float)view->forward[k];
        light.from[k] = (float)(view->is_orthographic ? -view->forward[k] : view->eye_mm[k] / view->far_mm);
    }
    return light;
}

/* Texels of which all but the share of power is known. */
enum { RUN_SIZE = 64 };
struct run {
    float along[RUN_SIZE], length2[RUN_SIZE]; /* of the normal: times the way to the light, and squared */
    float way2[RUN_SIZE], axis[RUN_SIZE]; /* of the way to the light: squared, and along the view's axis */
    float eta[RUN_SIZE], size[RUN_SIZE];
    float *texels[RUN_SIZE];
    size_t count;
};

/* Weights of a triangle's second and third corner, on the surface. */
static void weights_of(const struct surface *surface, const struct seen *seen, const struct light *light,
                       float *b, float *c)
{
    const float scale = 1 / seen->order;
    *b = light->is_parallel ? seen->b : seen->b * surface->order_b * scale;
    *c = light->is_parallel ? seen->c : seen->c * surface->order_c * scale;
}

static void find_position(const struct surface *surface, float b, float c, const struct light *light,
                          float texel[4], struct run *run)
{
    float length2 = 0, along = 0, way2 = 0, axis = 0;
    for (int k = 0; k < 3; k++) {
        const float normal = surface->normal[0][k] + b * surface->normal[1][k] + c * surface->normal[2][k];
        texel[k] =
            surface->position_mm[0][k] + b * surface->position_mm[1][k] + c * surface->position_mm[2][k];
        const float to_light = light->from[k] + light->by * texel[k];
        length2 += normal * normal;
        along += normal * to_light;
        way2 += to_light * to_light;
        axis -= to_light * light->forward[k];
    }
    run->along[run->count] = along;
    run->length2[run->count] = length2;
    run->way2[run->count] = way2;
    run->axis[run->count] = axis;
    run->eta[run->count] = surface->eta;
    run->size[run->count] = surface->size;
    run->texels[run->count++] = texel;
}

/* 1 less the reflectance of a smooth surface (common/fresnel.glsl), times the size; without branches, so
 * that several are computed at a time. */
static void find_shares(struct run *run)
{
    float shares[RUN_SIZE];
    for (size_t i = 0; i < run->count; i++) {
        const float eta = run->eta[i];
        const float unit = run->along[i] / sqrtf(run->length2[i] * run->way2[i]);
        const float axis = run->axis[i] > 0 ? run->axis[i] : 0; /* else rounded to behind the light */
        const float to_axis = axis / sqrtf(run->way2[i]);
        const float size = run->size[i] * to_axis * to_axis * to_axis; /* perspective: its solid angle */
        const float held = run->length2[i] > 1e-30f ? unit : 1; /* 1 where the corners' normals cancel */
        const float above = held > 0 ? held : 0, cosine = above < 1 ? above : 1;
        const float cosine2_refracted = 1 - (1 - cosine * cosine) / (eta * eta);
        const float refracted = sqrtf(cosine2_refracted > 0 ? cosine2_refracted : 0);
        const float s = (cosine - eta * refracted) / (cosine + eta * refracted);
        const float p = (eta * cosine - refracted) / (eta * cosine + refracted);
        const float share = size * (1 - 0.5f * (s * s + p * p));
        shares[i] = cosine2_refracted > 0 ? share : 0;
    }
    for (size_t i = 0; i < run->count; i++)
        run->texels[i][3] = shares[i];
    run->count = 0;
}

/* Small triangles show in several rows of a tile: so many are remembered. */
enum { KNOWN_SURFACES = 64 };

static void find_rest(const struct surface *surface, float b, float c, float rest_mm[4])
{
    for (int k = 0; k < 3; k++)
        rest_mm[k] = surface->rest_mm[0][k] + b * surface->rest_mm[1][k] + c * surface->rest_mm[2][k];
    rest_mm[3] = 1;
}

/* As render_light_tiles_draw; rest_mm: as render_light_texels has it. */
static bool draw_tile(const struct render_light_tiles *tiles, int x, int y, float *texels, float *objects,
                      float *rest_mm)
{
    const size_t tile = (size_t)((y + tiles->shift_px) / tiles->tile_px) * tiles->column_count +
                        (size_t)((x + tiles->shift_px) / tiles->tile_px);
    const size_t count = (size_t)tiles->tile_px * (size_t)tiles->tile_px;
    const struct entry *const entries = tiles->entries + tiles->first_entry[tile];
    const size_t entry_count = tiles->first_entry[tile + 1] - tiles->first_entry[tile];
    if (entry_count == 0)
        return false;
    struct seen *const seen = (struct seen *)(void *)texels;
    memset(seen, 0, count * sizeof *seen);
    for (size_t e = 0; e < entry_count; e++)
        draw_triangle(tiles, &entries[e], (uint32_t)e + 1, x, y, seen);
    const struct light light = light_of(tiles->picture.projection);
    struct surface surfaces[KNOWN_SURFACES];
    uint32_t known[KNOWN_SURFACES] = { 0 }; /* whose they are */
    struct run run;
    run.count = 0;
    for (size_t i = 0; i < count; i++) {
        const struct seen here = seen[i];
        if (objects)
            objects[i] = 0;
        if (rest_mm)
            memset(rest_mm + 4 * i, 0, 4 * sizeof *rest_mm);
        if (here.entry == 0) /* the texel is 0 already */
            continue;
        const uint32_t slot = here.entry % KNOWN_SURFACES;
        const struct surface *const surface = &surfaces[slot];
        if (known[slot] != here.entry) {
            find_surface(tiles, &entries[here.entry - 1], &surfaces[slot]);
            known[slot] = here.entry;
        }
        float b, c;
        weights_of(surface, &here, &light, &b, &c);
        find_position(surface, b, c, &light, texels + 4 * i, &run);
        if (run.count == RUN_SIZE)
            find_shares(&run);
        if (objects)
            objects[i] = surface->object;
        if (rest_mm)
            find_rest(surface, b, c, rest_mm + 4 * i);
    }
    find_shares(&run);
    return true;
}

bool render_light_tiles_draw(const void *context, int x, int y, float *texels, float *objects)
{
    return draw_tile(context, x, y, texels, objects, NULL);
}

/* ---- tiles of a picture -------------------------------------------------------------------------- */

static bool allocate(struct render_light_tiles *tiles)
{
    const struct render_light_picture *const picture = &tiles->picture;
    tiles->column_count = (size_t)((picture->size_px + tiles->shift_px - 1) / tiles->tile_px) + 1;
    tiles->tile_count = tiles->column_count * tiles->column_count;
    tiles->first_corner = calloc(picture->mesh_count + 1, sizeof *tiles->first_corner);
    tiles->first_triangle = calloc(picture->mesh_count + 1, sizeof *tiles->first_triangle);
    tiles->first_entry = calloc(tiles->tile_count + 1, sizeof *tiles->first_entry);
    tiles->placed = calloc(tiles->tile_count + 1, sizeof *tiles->placed);
    if (!tiles->first_corner || !tiles->first_triangle || !tiles->first_entry || !tiles->placed)
        return false;
    for (size_t m = 0; m < picture->mesh_count; m++) {
        const struct io_mesh *const mesh = picture->meshes[m].mesh;
        tiles->first_corner[m + 1] = tiles->first_corner[m] + mesh->vertex_count;
        tiles->first_triangle[m + 1] = tiles->first_triangle[m] + mesh->triangle_count;
    }
    tiles->corners = calloc(tiles->first_corner[picture->mesh_count] + 1, sizeof *tiles->corners);
    tiles->boxes = calloc(tiles->first_triangle[picture->mesh_count] + 1, sizeof *tiles->boxes);
    return tiles->corners && tiles->boxes;
}

static int blocks_of(size_t count)
{
    return (int)((count + BLOCK_SIZE - 1) / BLOCK_SIZE);
}

static void place_meshes(struct render_light_tiles *tiles)
{
    const int thread_count = tiles->picture.thread_count;
    for (tiles->mesh = 0; tiles->mesh < tiles->picture.mesh_count; tiles->mesh++) {
        const struct io_mesh *const mesh = tiles->picture.meshes[tiles->mesh].mesh;
        lut_parallel_for(blocks_of(mesh->vertex_count), thread_count, place_corners, tiles);
        lut_parallel_for(blocks_of(mesh->triangle_count), thread_count, place_triangles, tiles);
    }
}

bool render_light_tiles_create(const struct render_light_picture *picture, int tile_px, int shift_px,
                               struct render_light_tiles **tiles_out, dipole_status *status)
{
    assert(picture->size_px <= INT16_MAX && tile_px > 0 && shift_px >= 0 && shift_px < tile_px);
    struct render_light_tiles *const tiles = calloc(1, sizeof *tiles);
    *tiles_out = NULL;
    bool done = tiles != NULL;
    if (done) {
        tiles->picture = *picture;
        tiles->tile_px = tile_px;
        tiles->shift_px = shift_px;
        done = allocate(tiles);
    }
    if (done) {
        place_meshes(tiles);
        done = clip_triangles(tiles) && share_out(tiles);
    }
    if (!done) {
        render_light_tiles_destroy(tiles);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory to draw what a light sees in %d texels a side", picture->size_px);
    }
    *tiles_out = tiles;
    return true;
}

void render_light_tiles_destroy(struct render_light_tiles *tiles)
{
    if (!tiles)
        return;
    free(tiles->corners);
    free(tiles->boxes);
    free(tiles->first_corner);
    free(tiles->first_triangle);
    free(tiles->first_entry);
    free(tiles->placed);
    free(tiles->entries);
    free(tiles->pieces);
    free(tiles);
}

/* ---- a whole picture ---------------------------------------------------------------------------- */

/* Texels a side of a tile, of which one thread draws one at a time on its stack. */
enum { WHOLE_TILE = 32, WHOLE_TILE_TEXELS = WHOLE_TILE * WHOLE_TILE };

struct whole {
    const struct render_light_tiles *tiles;
    const struct render_light_texels *out;
};

/* What of a tile is in the picture, of so many numbers to a texel. out NULL: nothing. */
static void copy_tile(int size_px, int x, int y, size_t components, const float *tile, float *out)
{
    const int width = x + WHOLE_TILE < size_px ? WHOLE_TILE : size_px - x,
              height = y + WHOLE_TILE < size_px ? WHOLE_TILE : size_px - y;
    for (int row = 0; out && row < height; row++)
        memcpy(out + components * ((size_t)(y + row) * (size_t)size_px + (size_t)x),
               tile + components * WHOLE_TILE * (size_t)row, (size_t)width * components * sizeof *out);
}

static void draw_part(void *context, int index)
{
    const struct whole *const whole = context;
    const struct render_light_texels *const out = whole->out;
    const int size_px = whole->tiles->picture.size_px, column_count = (int)whole->tiles->column_count;
    const int x = WHOLE_TILE * (index % column_count), y = WHOLE_TILE * (index / column_count);
    float texels[4 * WHOLE_TILE_TEXELS], objects[WHOLE_TILE_TEXELS] = { 0 }, rest_mm[4 * WHOLE_TILE_TEXELS];
    if (x >= size_px || y >= size_px)
        return;
    if (!draw_tile(whole->tiles, x, y, texels, objects, out->rest_mm ? rest_mm : NULL))
        memset(rest_mm, 0, sizeof rest_mm);
    for (size_t i = 0; i < WHOLE_TILE_TEXELS; i++) {
        if (objects[i] == 0)
            memcpy(texels + 4 * i, out->empty, sizeof out->empty);
    }
    copy_tile(size_px, x, y, 4, texels, out->texels);
    copy_tile(size_px, x, y, 1, objects, out->objects);
    copy_tile(size_px, x, y, 4, rest_mm, out->rest_mm);
}

bool render_light_picture_draw(const struct render_light_picture *picture,
                               const struct render_light_texels *out, dipole_status *status)
{
    struct render_light_tiles *tiles;
    if (!render_light_tiles_create(picture, WHOLE_TILE, 0, &tiles, status))
        return false;
    struct whole whole = { .tiles = tiles, .out = out };
    lut_parallel_for((int)tiles->tile_count, picture->thread_count, draw_part, &whole);
    render_light_tiles_destroy(tiles);
    return true;
}
