#include "renderer/splats.h"

#include <math.h>
#include <stdlib.h>

/* A group may be so wide, as part of r_max: a rectangle grows by as much for all its samples. */
#define GROUP_RADIUS 0.15

/* Positions in the picture are floats. */
#define REACH_SLACK 1e-4

struct box {
    double min[3], max[3];
};

static void box_add(struct box *box, const float position_mm[3])
{
    for (int k = 0; k < 3; k++) {
        box->min[k] = fmin(box->min[k], (double)position_mm[k]);
        box->max[k] = fmax(box->max[k], (double)position_mm[k]);
    }
}

static double box_radius_mm(const struct box *box)
{
    double diagonal2 = 0;
    for (int k = 0; k < 3; k++)
        diagonal2 += (box->max[k] - box->min[k]) * (box->max[k] - box->min[k]);
    return 0.5 * sqrt(diagonal2);
}

/* One past the last sample of the group that begins at first; its box in *box. */
static size_t group_end(const struct render_light_samples *samples, size_t first, double radius_limit_mm,
                        size_t sample_limit, struct box *box)
{
    *box = (struct box){ { INFINITY, INFINITY, INFINITY }, { -INFINITY, -INFINITY, -INFINITY } };
    size_t end = first;
    while (end < samples->count && end - first < sample_limit) {
        struct box grown = *box;
        box_add(&grown, samples->samples[end].position_mm);
        if (end > first && (samples->samples[end].object != samples->samples[first].object ||
                            box_radius_mm(&grown) > radius_limit_mm))
            break;
        *box = grown;
        end++;
    }
    return end;
}

static bool reserve(struct render_splats *splats, size_t more, dipole_status *status)
{
    if (splats->capacity - splats->count >= more)
        return true;
    const size_t capacity = splats->count + more + splats->capacity / 2;
    struct render_splat *const grown = realloc(splats->splats, capacity * sizeof *grown);
    if (!grown)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu splats", capacity);
    splats->splats = grown;
    splats->capacity = capacity;
    return true;
}

bool render_splats_append(struct render_splats *out, const struct render_light_samples *samples,
                          size_t first_sample, const struct render_projection *camera, double r_max_mm,
                          const struct render_splat_profile *profile, size_t sample_limit,
                          dipole_status *status)
{
    struct box box;
    size_t group_count = 0;
    for (size_t first = 0; first < samples->count; group_count++)
        first = group_end(samples, first, GROUP_RADIUS * r_max_mm, sample_limit, &box);
    if (!reserve(out, group_count, status))
        return false;
    for (size_t first = 0, end; first < samples->count; first = end) {
        end = group_end(samples, first, GROUP_RADIUS * r_max_mm, sample_limit, &box);
        double centre_mm[3], in_view_mm[3], rectangle[4];
        for (int k = 0; k < 3; k++)
            centre_mm[k] = 0.5 * (box.min[k] + box.max[k]);
        const double reach_mm = (r_max_mm + box_radius_mm(&box)) * (1 + REACH_SLACK);
        if (!render_projection_bound_sphere(camera, centre_mm, reach_mm, rectangle))
            continue;
        render_projection_to_view(camera, centre_mm, in_view_mm);
        struct render_splat *const splat = &out->splats[out->count++];
        *splat = (struct render_splat){ .first = (uint32_t)(first_sample + first),
                                        .count = (uint32_t)(end - first),
                                        .object = samples->samples[first].object,
                                        .profile = *profile };
        for (int k = 0; k < 4; k++)
            splat->rectangle[k] = (float)rectangle[k];
        for (int k = 0; k < 3; k++)
            splat->centre_mm[k] = (float)centre_mm[k];
        splat->reach2_mm2 = (float)(reach_mm * reach_mm);
        splat->depth = (float)render_projection_linear_depth(camera, in_view_mm[2] - reach_mm);
    }
    return true;
}

void render_splats_destroy(struct render_splats *splats)
{
    free(splats->splats);
    *splats = (struct render_splats){ 0 };
}
