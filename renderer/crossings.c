#include "renderer/crossings.h"

#include "renderer/blocker.h"
#include "renderer/passage.h"

#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    const struct render_crossing *const x = a, *const y = b;
    if (x->blocker != y->blocker)
        return x->blocker < y->blocker ? -1 : 1;
    if (x->depth_mm != y->depth_mm)
        return x->depth_mm < y->depth_mm ? -1 : 1;
    return (int)y->is_entry - (int)x->is_entry;
}

static void sort(struct render_crossing *crossings, size_t count)
{
    enum { FEW = 32 };
    if (count > FEW) {
        qsort(crossings, count, sizeof *crossings, compare);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        const struct render_crossing crossing = crossings[i];
        size_t at = i;
        for (; at > 0 && compare(&crossings[at - 1], &crossing) > 0; at--)
            crossings[at] = crossings[at - 1];
        crossings[at] = crossing;
    }
}

static struct render_segment segment_of(const struct io_blocker *blocker, double z0_mm, double ze_mm,
                                        double mm_per_depth)
{
    struct render_segment segment = { .z0_mm = z0_mm, .ze_mm = ze_mm };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        segment.alpha[c] =
            blocker->passage ? 1 - render_passage_left(blocker->passage, (ze_mm - z0_mm) * mm_per_depth, c)
            : blocker->has_extinction
                ? render_blocker_alpha(blocker->extinction_per_mm[c], (ze_mm - z0_mm) * mm_per_depth)
                : blocker->opacity[c];
    return segment;
}

/* How often the solid is left more often than it is entered: so often does it hold the light. */
static size_t inside_at_first(const struct render_crossing *crossings, size_t count)
{
    size_t entries = 0;
    for (size_t i = 0; i < count; i++)
        entries += crossings[i].is_entry;
    return count > 2 * entries ? count - 2 * entries : 0;
}

/* The ways through one solid, whose crossings these are. At a silhouette rounding may put the exit before
 * its entry: that way has no length. */
static size_t pair_solid(const struct io_blocker *blocker, const struct render_crossing *crossings,
                         size_t count, double least_mm, double mm_per_depth,
                         struct render_segment *segments)
{
    size_t segment_count = 0, inside = inside_at_first(crossings, count), early_exits = 0;
    double entry_mm = least_mm;
    for (size_t i = 0; i < count; i++) {
        const double depth_mm = (double)crossings[i].depth_mm;
        if (crossings[i].is_entry && early_exits > 0) {
            early_exits--;
            segments[segment_count++] = segment_of(blocker, depth_mm, depth_mm, mm_per_depth);
        } else if (crossings[i].is_entry) {
            entry_mm = inside == 0 ? depth_mm : entry_mm;
            inside++;
        } else if (inside > 1) {
            inside--;
        } else if (inside == 1) {
            inside = 0;
            segments[segment_count++] =
                segment_of(blocker, entry_mm < depth_mm ? entry_mm : depth_mm, depth_mm, mm_per_depth);
        } else {
            early_exits++;
        }
    }
    if (inside > 0)
        segments[segment_count++] = segment_of(blocker, entry_mm, entry_mm, mm_per_depth);
    return segment_count;
}

size_t render_crossings_pair(const struct io_blocker *blockers, struct render_crossing *crossings,
                             size_t count, double least_mm, double mm_per_depth,
                             struct render_segment *segments)
{
    size_t segment_count = 0;
    sort(crossings, count);
    for (size_t first = 0, end; first < count; first = end) {
        const struct io_blocker *const blocker = &blockers[crossings[first].blocker];
        for (end = first; end < count && crossings[end].blocker == crossings[first].blocker; end++) {
            const double depth_mm = (double)crossings[end].depth_mm;
            if (blocker->is_sheet || blocker->particle_mm > 0)
                segments[segment_count++] = segment_of(blocker, depth_mm, depth_mm, mm_per_depth);
        }
        if (!blocker->is_sheet && !(blocker->particle_mm > 0))
            segment_count += pair_solid(blocker, crossings + first, end - first, least_mm, mm_per_depth,
                                        segments + segment_count);
    }
    return segment_count;
}

bool render_blocker_is_opaque(const struct io_blocker *blocker)
{
    const double *const opacity = blocker->opacity;
    return !blocker->passage && !blocker->has_extinction && opacity[0] >= 1 && opacity[1] >= 1 &&
           opacity[2] >= 1;
}

static bool is_coloured_passage(const struct io_passage *passage)
{
    for (int c = 1; c < IO_CHANNEL_COUNT; c++) {
        if (passage->counts[c] != passage->counts[0])
            return true;
        for (int i = 0; i < passage->counts[0]; i++) {
            if (passage->depth[c][i] != passage->depth[0][i])
                return true;
        }
    }
    return false;
}

bool render_blocker_is_coloured(const struct io_blocker *blocker)
{
    if (blocker->passage)
        return is_coloured_passage(blocker->passage);
    const double *const value = blocker->has_extinction ? blocker->extinction_per_mm : blocker->opacity;
    return value[0] != value[1] || value[1] != value[2];
}

bool render_blocker_is_there(const struct io_blocker *blocker)
{
    const double *const value = blocker->has_extinction ? blocker->extinction_per_mm : blocker->opacity;
    return blocker->passage || value[0] > 0 || value[1] > 0 || value[2] > 0;
}
