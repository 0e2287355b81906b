#include "renderer/shadow_resolve.h"

#include "lutgen/parallel.h"
#include "renderer/crossings.h"
#include "renderer/transmittance.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows that one round of the loop makes curves of. */
enum { PART_ROWS = 8 };

/* Storage for the blockers of one texel. */
struct scratch {
    struct render_crossing *crossings;
    struct render_segment *segments;
    struct render_node_event *events;
    struct render_node *nodes;
    double *areas;
    size_t capacity;
};

/* Nodes of one part's texels, until they are put together. */
struct part {
    float *nodes;
    size_t count, capacity; /* in nodes */
    bool is_done;
};

struct resolver {
    struct render_shadow_curves *curves;
    struct render_shadow_item *items; /* texel by texel */
    uint32_t *ends;                   /* of each texel of the rows */
    int first_row, end_row;
    struct part *parts;
};

static int component_count(const struct render_shadow_curves *curves)
{
    return curves->has_colour ? 4 : 2;
}

bool render_shadow_curves_begin(struct render_shadow_curves *curves, dipole_status *status)
{
    const size_t texels = (size_t)curves->size_px * (size_t)curves->size_px;
    curves->nodes = NULL;
    curves->node_count = curves->node_capacity = 0;
    curves->ranges = calloc(texels, 4 * sizeof *curves->ranges);
    return curves->ranges || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                                         "no memory for shadows of %d texels a side", curves->size_px);
}

void render_shadow_curves_destroy(struct render_shadow_curves *curves)
{
    free(curves->ranges);
    free(curves->nodes);
    curves->ranges = curves->nodes = NULL;
}

/* ---- one texel ----------------------------------------------------------------------------------- */

static void free_scratch(struct scratch *scratch)
{
    free(scratch->crossings);
    free(scratch->segments);
    free(scratch->events);
    free(scratch->nodes);
    free(scratch->areas);
    *scratch = (struct scratch){ .capacity = 0 };
}

static bool need_scratch(struct scratch *scratch, size_t count)
{
    if (count <= scratch->capacity)
        return true;
    free_scratch(scratch);
    scratch->crossings = malloc(count * sizeof *scratch->crossings);
    scratch->segments = malloc(count * sizeof *scratch->segments);
    scratch->events = malloc(3 * count * sizeof *scratch->events);
    scratch->nodes = malloc(3 * count * sizeof *scratch->nodes);
    scratch->areas = malloc(3 * count * sizeof *scratch->areas);
    scratch->capacity = count;
    return scratch->crossings && scratch->segments && scratch->events && scratch->nodes && scratch->areas;
}

/* Room for count more. */
static bool need_nodes(const struct resolver *resolver, struct part *part, size_t count)
{
    if (part->count + count <= part->capacity)
        return true;
    const size_t capacity = 2 * part->capacity + count + 1024;
    float *const grown =
        realloc(part->nodes, capacity * (size_t)component_count(resolver->curves) * sizeof *grown);
    if (!grown)
        return false;
    part->nodes = grown;
    part->capacity = capacity;
    return true;
}

static void put_node(const struct resolver *resolver, struct part *part, double z_mm,
                     const double values[3])
{
    const int components = component_count(resolver->curves);
    float *const node = part->nodes + (size_t)components * part->count++;
    node[0] = (float)z_mm;
    for (int c = 0; c < components - 1; c++)
        node[c + 1] = (float)values[c];
}

static double mm_per_depth(const struct render_shadow_curves *curves, int x, int y)
{
    const double across = ((x + 0.5) / curves->size_px * 2 - 1) * curves->half_width;
    const double up = ((y + 0.5) / curves->size_px * 2 - 1) * curves->half_width;
    return curves->is_parallel ? 1 : sqrt(1 + across * across + up * up);
}

static bool resolve_texel(const struct resolver *resolver, struct part *part, struct scratch *scratch,
                          int x, int y, const struct render_shadow_item *items, size_t count)
{
    const struct render_shadow_curves *const curves = resolver->curves;
    if (!need_scratch(scratch, count))
        return false;
    assert(scratch->crossings && scratch->nodes);
    for (size_t i = 0; i < count; i++) {
        float depth_mm;
        memcpy(&depth_mm, &items[i].depth, sizeof depth_mm);
        scratch->crossings[i] =
            (struct render_crossing){ .depth_mm = fabsf(depth_mm),
                                      .blocker = items[i].where % RENDER_SHADOW_ITEM_BLOCKERS,
                                      .is_entry = depth_mm < 0 };
    }
    const double least_mm = curves->is_parallel ? INFINITY : 0;
    const size_t segment_count =
        render_crossings_pair(curves->blockers, scratch->crossings, count, least_mm,
                              mm_per_depth(curves, x, y), scratch->segments);
    const size_t exact_count =
        render_transmittance_build(scratch->segments, segment_count, scratch->events, scratch->nodes);
    if (exact_count == 0)
        return true;
    double mean_mm[IO_CHANNEL_COUNT] = { 0 };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        render_transmittance_blocked(scratch->nodes, exact_count, INFINITY, c, &mean_mm[c]);
    const size_t node_count = render_transmittance_compress(scratch->nodes, exact_count,
                                                            (size_t)curves->node_limit, scratch->areas);
    if (!need_nodes(resolver, part, node_count + 1))
        return false;
    float *const range = curves->ranges + 4 * ((size_t)y * (size_t)curves->size_px + (size_t)x);
    range[0] = (float)scratch->nodes[0].z_mm;
    range[1] = (float)scratch->nodes[node_count - 1].z_mm;
    range[2] = (float)part->count; /* within the part, until all are put together */
    range[3] = (float)node_count;
    for (size_t i = 0; i < node_count; i++)
        put_node(resolver, part, scratch->nodes[i].z_mm, scratch->nodes[i].left);
    put_node(resolver, part, 0, mean_mm);
    return true;
}

/* ---- all of them --------------------------------------------------------------------------------- */

static void resolve_part(void *context, int index)
{
    struct resolver *const resolver = context;
    struct part *const part = &resolver->parts[index];
    const int size_px = resolver->curves->size_px, first = resolver->first_row + index * PART_ROWS;
    struct scratch scratch = { .capacity = 0 };
    part->is_done = true;
    for (int y = first; y < first + PART_ROWS && y < resolver->end_row; y++) {
        for (int x = 0; x < size_px && part->is_done; x++) {
            const size_t texel = (size_t)(y - resolver->first_row) * (size_t)size_px + (size_t)x;
            const size_t begin = texel > 0 ? resolver->ends[texel - 1] : 0, end = resolver->ends[texel];
            if (end > begin)
                part->is_done =
                    resolve_texel(resolver, part, &scratch, x, y, resolver->items + begin, end - begin);
        }
    }
    free_scratch(&scratch);
}

/* By texel; ends of each texel's items are counted, then their places found. */
static void sort_items(struct resolver *resolver, const struct render_shadow_item *items, size_t count,
                       size_t texel_count)
{
    const uint32_t first_texel = (uint32_t)resolver->first_row * (uint32_t)resolver->curves->size_px;
    for (size_t i = 0; i < count; i++)
        resolver->ends[items[i].where / RENDER_SHADOW_ITEM_BLOCKERS - first_texel]++;
    for (size_t t = 1; t < texel_count; t++)
        resolver->ends[t] += resolver->ends[t - 1];
    for (size_t i = count; i-- > 0;)
        resolver->items[--resolver->ends[items[i].where / RENDER_SHADOW_ITEM_BLOCKERS - first_texel]] =
            items[i];
    /* each end has become a beginning: that of the next texel is the end */
    memmove(resolver->ends, resolver->ends + 1, (texel_count - 1) * sizeof *resolver->ends);
    resolver->ends[texel_count - 1] = (uint32_t)count;
}

static bool put_together(struct resolver *resolver, int part_count, dipole_status *status)
{
    struct render_shadow_curves *const curves = resolver->curves;
    const size_t components = (size_t)component_count(curves);
    size_t total = curves->node_count;
    for (int i = 0; i < part_count; i++)
        total += resolver->parts[i].count;
    if (total > RENDER_SHADOW_NODE_TOTAL)
        return dipole_fail(
            status, DIPOLE_NOT_SUPPORTED, NULL,
            "blockers have %zu nodes in a light's view, expected at most %zu; ask for fewer in a texel",
            total, RENDER_SHADOW_NODE_TOTAL);
    float *const grown = total > 0 ? realloc(curves->nodes, total * components * sizeof *grown) : NULL;
    if (total > 0 && !grown)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu nodes of shadows", total);
    curves->nodes = grown;
    for (int i = 0; i < part_count; i++) {
        const struct part *const part = &resolver->parts[i];
        const int first = resolver->first_row + i * PART_ROWS;
        for (int y = first; y < first + PART_ROWS && y < resolver->end_row; y++) {
            float *const row = curves->ranges + 4 * (size_t)y * (size_t)curves->size_px;
            for (size_t x = 0; x < (size_t)curves->size_px; x++)
                row[4 * x + 2] += (float)curves->node_count;
        }
        assert(curves->nodes || part->count == 0);
        if (part->count > 0)
            memcpy(curves->nodes + components * curves->node_count, part->nodes,
                   part->count * components * sizeof *part->nodes);
        curves->node_count += part->count;
    }
    return true;
}

bool render_shadow_curves_add(struct render_shadow_curves *curves, const struct render_shadow_item *items,
                              size_t count, int first, int end, dipole_status *status)
{
    const size_t texel_count = (size_t)(end - first) * (size_t)curves->size_px;
    const int part_count = (end - first + PART_ROWS - 1) / PART_ROWS;
    struct resolver resolver = { .curves = curves, .first_row = first, .end_row = end };
    if (count == 0)
        return true;
    resolver.items = malloc(count * sizeof *resolver.items);
    resolver.ends = calloc(texel_count, sizeof *resolver.ends);
    resolver.parts = calloc((size_t)part_count, sizeof *resolver.parts);
    bool done = resolver.items && resolver.ends && resolver.parts;
    if (done) {
        sort_items(&resolver, items, count, texel_count);
        lut_parallel_for(part_count, 0, resolve_part, &resolver);
        for (int i = 0; i < part_count; i++)
            done &= resolver.parts[i].is_done;
    }
    if (done)
        done = put_together(&resolver, part_count, status);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu surfaces of blockers", count);
    for (int i = 0; resolver.parts && i < part_count; i++)
        free(resolver.parts[i].nodes);
    free(resolver.items);
    free(resolver.ends);
    free(resolver.parts);
    return done;
}
