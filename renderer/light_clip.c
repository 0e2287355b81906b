#include "renderer/light_clip.h"

#include <string.h>

enum { PLANES = 5 };

/* How far a place is inside of a plane; scales differ from plane to plane. */
static double inside_of(const struct render_projection *view, double guard, int plane,
                        const double at_mm[3])
{
    const double depth_mm = at_mm[2];
    switch (plane) {
    case 0:
        return depth_mm - view->near_mm;
    case 1:
        return guard * view->half_width * depth_mm - at_mm[0];
    case 2:
        return guard * view->half_width * depth_mm + at_mm[0];
    case 3:
        return guard * view->half_height * depth_mm - at_mm[1];
    default:
        return guard * view->half_height * depth_mm + at_mm[1];
    }
}

/* From the inside to the outside, whichever way the edge is walked, so that both of its triangles agree. */
static struct render_clip_corner cut(const struct render_clip_corner *inside, double inside_by,
                                     const struct render_clip_corner *outside, double outside_by)
{
    struct render_clip_corner between;
    const double part = inside_by / (inside_by - outside_by);
    for (int k = 0; k < 3; k++) {
        between.in_view_mm[k] =
            inside->in_view_mm[k] + part * (outside->in_view_mm[k] - inside->in_view_mm[k]);
        between.weights[k] = inside->weights[k] + part * (outside->weights[k] - inside->weights[k]);
    }
    return between;
}

/* By one plane (Sutherland and Hodgman 1974). */
static size_t clip(const struct render_projection *view, double guard, int plane,
                   const struct render_clip_corner *corners, size_t count, struct render_clip_corner *out)
{
    size_t left = 0;
    for (size_t i = 0; i < count; i++) {
        const struct render_clip_corner *const here = &corners[i], *const next = &corners[(i + 1) % count];
        const double here_by = inside_of(view, guard, plane, here->in_view_mm),
                     next_by = inside_of(view, guard, plane, next->in_view_mm);
        if (here_by >= 0)
            out[left++] = *here;
        if (here_by >= 0 && next_by < 0)
            out[left++] = cut(here, here_by, next, next_by);
        else if (here_by < 0 && next_by >= 0)
            out[left++] = cut(next, next_by, here, here_by);
    }
    return left;
}

size_t render_clip_triangle(const struct render_projection *view, double guard,
                            const double corners_mm[3][3],
                            struct render_clip_corner out[RENDER_CLIP_CORNERS])
{
    struct render_clip_corner before[RENDER_CLIP_CORNERS];
    size_t count = 3;
    for (int i = 0; i < 3; i++) {
        out[i] = (struct render_clip_corner){ .weights = { i == 0, i == 1, i == 2 } };
        memcpy(out[i].in_view_mm, corners_mm[i], sizeof out[i].in_view_mm);
    }
    for (int plane = 0; plane < PLANES && count > 0; plane++) {
        memcpy(before, out, count * sizeof *before);
        count = clip(view, guard, plane, before, count, out);
    }
    return count;
}
