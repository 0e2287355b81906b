/* What is left of a triangle in front of a view's near plane and not far beside its picture. */
#ifndef RENDERER_LIGHT_CLIP_H
#define RENDERER_LIGHT_CLIP_H

#include "renderer/projection.h"

#include <stddef.h>

/* Three, and one for each plane; but rounding may dent the outline, and each plane may add half as many. */
enum { RENDER_CLIP_CORNERS = 20 };

struct render_clip_corner {
    double in_view_mm[3]; /* right, up, forward of the eye */
    double weights[3];    /* of the triangle's corners; they add up to 1 */
};

/*
 * Clip a triangle, its corners in the view, by the near plane of a perspective view and by planes through
 * the eye guard times as far to the side as the picture reaches; guard >= 1. Returns how many corners are
 * left, in the order of the triangle's; fewer than 3: nothing. Triangles that share an edge share
 * the places where it is cut, to the last bit.
 */
size_t render_clip_triangle(const struct render_projection *view, double guard,
                            const double corners_mm[3][3],
                            struct render_clip_corner out[RENDER_CLIP_CORNERS]);

#endif
