/* Pictures of scenes in memory, and how far they are from what was expected. */
#ifndef DRAWING_H
#define DRAWING_H

#include "check.h"
#include "scenes.h"

#include "renderer/render.h"

static const double PI = 3.14159265358979323846;

static inline struct renderer *renderer_of(const struct test_scene *test, enum render_context_kind kind)
{
    struct renderer *renderer;
    dipole_status status;
    if (!render_create(&test->scene, kind, &renderer, &status))
        fail_msg("%s", status.message);
    return renderer;
}

static inline struct io_image *draw(struct renderer *renderer, const struct render_options *options,
                                    struct render_report *report)
{
    struct io_image *image;
    dipole_status status;
    if (!render_draw(renderer, options, &image, report, &status))
        fail_msg("%s", status.message);
    return image;
}

static inline struct render_capture *capture(struct renderer *renderer, double spacing_mm)
{
    struct render_capture *captured;
    dipole_status status;
    if (!render_capture_create(renderer, spacing_mm, &captured, &status))
        fail_msg("%s", status.message);
    return captured;
}

/* Sums of squares of a picture's values and of their errors, over the exact pixels. */
struct deviation {
    double error2, value2, worst, peak;
    size_t count;
};

static inline void deviation_add(struct deviation *deviation, double found, double expected)
{
    deviation->error2 += (found - expected) * (found - expected);
    deviation->value2 += expected * expected;
    deviation->worst = fmax(deviation->worst, fabs(found - expected));
    deviation->peak = fmax(deviation->peak, fabs(expected));
    deviation->count++;
}

static inline double relative_rmse(const struct deviation *deviation)
{
    assert_true(deviation->count > 300);
    return sqrt(deviation->error2 / deviation->value2);
}

#endif
