#include "renderer/transmittance.h"

#include "renderer/blocker.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* In the order in which they happen at one depth: so a sheet between two solids is a step between their
 * ramps. */
enum event_kind { EVENT_END = 0, EVENT_STEP, EVENT_BEGIN };

/* ---- building ------------------------------------------------------------------------------------ */

static int compare_events(const void *a, const void *b)
{
    const struct render_node_event *const x = a, *const y = b;
    if (x->z_mm != y->z_mm)
        return x->z_mm < y->z_mm ? -1 : 1;
    return x->kind - y->kind;
}

/* Few as a rule, and nearly sorted. */
static void sort_events(struct render_node_event *events, size_t count)
{
    enum { FEW = 24 };
    if (count > FEW) {
        qsort(events, count, sizeof *events, compare_events);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        const struct render_node_event event = events[i];
        size_t at = i;
        for (; at > 0 && compare_events(&events[at - 1], &event) > 0; at--)
            events[at] = events[at - 1];
        events[at] = event;
    }
}

/* What lets nothing through does so where it begins. */
static size_t add_events(const struct render_segment *segment, struct render_node_event *events)
{
    const double length_mm = segment->ze_mm - segment->z0_mm;
    struct render_node_event step = { .z_mm = segment->z0_mm, .kind = EVENT_STEP };
    struct render_node_event begin = { .z_mm = segment->z0_mm, .kind = EVENT_BEGIN };
    struct render_node_event end = { .z_mm = segment->ze_mm, .kind = EVENT_END };
    bool has_step = false, has_ramp = false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double depth = -log1p(-segment->alpha[c]), rate = depth / length_mm;
        if (!(segment->alpha[c] > 0))
            continue;
        if (isfinite(rate)) {
            begin.depth[c] = rate;
            end.depth[c] = -rate;
            has_ramp = true;
        } else {
            step.depth[c] = depth;
            has_step = true;
        }
    }
    size_t count = 0;
    if (has_step)
        events[count++] = step;
    if (has_ramp) {
        events[count++] = begin;
        events[count++] = end;
    }
    return count;
}

/* Where the walk along the ray is. */
struct walk {
    double depth[IO_CHANNEL_COUNT], rate[IO_CHANNEL_COUNT];
    size_t inside_count;
};

static void take_event(const struct render_node_event *event, struct walk *walk)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (event->kind == EVENT_STEP)
            walk->depth[c] += event->depth[c];
        else
            walk->rate[c] = fmax(walk->rate[c] + event->depth[c], 0);
    }
    if (event->kind == EVENT_BEGIN)
        walk->inside_count++;
    else if (event->kind == EVENT_END && --walk->inside_count == 0)
        memset(walk->rate, 0, sizeof walk->rate); /* what rounding left of it */
}

static bool are_same(const struct render_node *a, const struct render_node *b)
{
    return a->z_mm == b->z_mm && a->left[0] == b->left[0] && a->left[1] == b->left[1] &&
           a->left[2] == b->left[2];
}

static void add_node(struct render_node *nodes, size_t *count, double z_mm, const struct walk *walk)
{
    struct render_node node = { .z_mm = z_mm };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        node.left[c] = exp(-walk->depth[c]);
    if (*count == 0 || !are_same(&nodes[*count - 1], &node))
        nodes[(*count)++] = node;
}

size_t render_transmittance_build(const struct render_segment *segments, size_t count,
                                  struct render_node_event *events, struct render_node *nodes)
{
    size_t event_count = 0, node_count = 0;
    for (size_t i = 0; i < count; i++)
        event_count += add_events(&segments[i], events + event_count);
    sort_events(events, event_count);
    struct walk walk = { .inside_count = 0 };
    for (size_t first = 0, end; first < event_count; first = end) {
        const double z_mm = events[first].z_mm;
        const double way_mm = first > 0 ? z_mm - events[first - 1].z_mm : 0;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            walk.depth[c] += walk.rate[c] * way_mm;
        add_node(nodes, &node_count, z_mm, &walk);
        for (end = first; end < event_count && events[end].z_mm == z_mm; end++)
            take_event(&events[end], &walk);
        add_node(nodes, &node_count, z_mm, &walk);
    }
    return node_count;
}

/* ---- the curve ----------------------------------------------------------------------------------- */

/* The part of what comes to a that does not come to b. */
static double alpha_between(const struct render_node *a, const struct render_node *b, int channel)
{
    return a->left[channel] > 0 ? (a->left[channel] - b->left[channel]) / a->left[channel] : 0;
}

static double piece_area_mm(const struct render_node *a, const struct render_node *b, int channel)
{
    return (b->z_mm - a->z_mm) * a->left[channel] * render_blocker_mean_left(alpha_between(a, b, channel));
}

double render_transmittance_area_mm(const struct render_node *nodes, size_t count, int channel)
{
    double area_mm = 0;
    for (size_t i = 1; i < count; i++)
        area_mm += piece_area_mm(&nodes[i - 1], &nodes[i], channel);
    return area_mm;
}

double render_transmittance_at(const struct render_node *nodes, size_t count, double z_mm, int channel)
{
    size_t after = 0;
    while (after < count && nodes[after].z_mm <= z_mm)
        after++;
    if (after == 0)
        return 1;
    const struct render_node *const a = &nodes[after - 1];
    if (after == count)
        return a->left[channel];
    const struct render_node *const b = &nodes[after];
    const double part = (z_mm - a->z_mm) / (b->z_mm - a->z_mm);
    const double ratio = a->left[channel] > 0 ? b->left[channel] / a->left[channel] : 1;
    /* 1 - alpha has lost its digits where little is left */
    const double kept =
        ratio < 0.5 ? pow(ratio, part) : 1 - (1 - ratio) * render_blocker_part(1 - ratio, part);
    return fmax(a->left[channel] * kept, b->left[channel]);
}

double render_transmittance_blocked(const struct render_node *nodes, size_t count, double z_mm, int channel,
                                    double *mean_mm)
{
    double blocked = 0, moment_mm = 0;
    for (size_t i = 1; i < count && nodes[i - 1].z_mm < z_mm; i++) {
        const struct render_node *const a = &nodes[i - 1], *const b = &nodes[i];
        const double end_mm = fmin(b->z_mm, z_mm);
        const double left =
            end_mm < b->z_mm ? render_transmittance_at(nodes, count, z_mm, channel) : b->left[channel];
        const double stays = a->left[channel] - left;
        if (!(stays > 0))
            continue;
        blocked += stays;
        moment_mm += stays * render_blocker_half_mm(a->z_mm, end_mm, stays / a->left[channel]);
    }
    if (blocked > 0)
        *mean_mm = moment_mm / blocked;
    return blocked;
}

/* ---- fewer nodes --------------------------------------------------------------------------------- */

/* By how much the area changes, over all channels, when the node between two others goes. */
static double change_mm(const struct render_node *before, const struct render_node *node,
                        const struct render_node *after)
{
    double change = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        change += fabs(piece_area_mm(before, node, c) + piece_area_mm(node, after, c) -
                       piece_area_mm(before, after, c));
    return change;
}

/* One of few nodes after the other, each the least of all. */
static size_t compress_few(struct render_node *nodes, size_t count, size_t limit, double *areas)
{
    for (size_t i = 1; count > limit && i + 1 < count; i++)
        areas[i] = change_mm(&nodes[i - 1], &nodes[i], &nodes[i + 1]);
    while (count > limit) {
        size_t least = 1;
        for (size_t i = 2; i + 1 < count; i++)
            least = areas[i] < areas[least] ? i : least;
        memmove(nodes + least, nodes + least + 1, (count - least - 1) * sizeof *nodes);
        memmove(areas + least, areas + least + 1, (count - least - 1) * sizeof *areas);
        count--;
        for (size_t i = least > 1 ? least - 1 : 1; i <= least && i + 1 < count; i++)
            areas[i] = change_mm(&nodes[i - 1], &nodes[i], &nodes[i + 1]);
    }
    return count;
}

/* Of very many nodes each run loses half of its own, least first: the search for the least of all would
 * take the square of their number. */
enum { RUN = 256 };

size_t render_transmittance_compress(struct render_node *nodes, size_t count, size_t limit, double *areas)
{
    while (count > limit && count > RUN && limit < RUN / 2) {
        size_t kept = 0;
        for (size_t first = 0; first < count; first += RUN) {
            const size_t run = count - first < RUN ? count - first : RUN;
            const size_t left = compress_few(nodes + first, run, RUN / 2, areas);
            memmove(nodes + kept, nodes + first, left * sizeof *nodes);
            kept += left;
        }
        count = kept;
    }
    return compress_few(nodes, count, limit, areas);
}
