#include "renderer/environment_keep.h"

#include <stdlib.h>

struct kept {
    const struct io_mesh *rest; /* NULL until it was first watched        */
    struct io_pose pose;
    uint64_t shape; /* counts the poses that it was seen in   */
    struct render_light_samples samples;
    struct render_keep_key key;
    bool is_known;                 /* samples are of these:      */
    uint64_t known_shape, changes; /* of it; of all, which may hide it */
};

struct render_keep {
    size_t object_count, sampled_count;
    uint64_t changes;
    struct kept *objects;
};

bool render_keep_create(size_t object_count, struct render_keep **keep_out, dipole_status *status)
{
    struct render_keep *const keep = calloc(1, sizeof *keep);
    if (keep) {
        keep->object_count = object_count;
        keep->objects = calloc(object_count + 1, sizeof *keep->objects);
    }
    *keep_out = keep;
    if (keep && keep->objects)
        return true;
    render_keep_destroy(keep);
    *keep_out = NULL;
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to keep the light of %zu objects",
                       object_count);
}

void render_keep_destroy(struct render_keep *keep)
{
    if (!keep)
        return;
    for (size_t i = 0; keep->objects && i < keep->object_count; i++)
        render_light_samples_destroy(&keep->objects[i].samples);
    free(keep->objects);
    free(keep);
}

/* ---- poses -------------------------------------------------------------------------------------- */

static bool numbers_are_same(const double *a, const double *b, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (a[i] != b[i])
            return false;
    }
    return true;
}

static bool deforms_are_same(const struct io_deform *a, const struct io_deform *b)
{
    return a->kind == b->kind && numbers_are_same(a->origin_mm, b->origin_mm, 3) &&
           numbers_are_same(a->axis, b->axis, 3) && numbers_are_same(a->toward, b->toward, 3) &&
           a->rate_rad_per_mm == b->rate_rad_per_mm && a->amplitude_mm == b->amplitude_mm &&
           a->phase_rad == b->phase_rad;
}

static bool poses_are_same(const struct io_pose *a, const struct io_pose *b)
{
    if (a->deform_count != b->deform_count || a->is_moved != b->is_moved)
        return false;
    for (size_t i = 0; i < a->deform_count; i++) {
        if (!deforms_are_same(&a->deforms[i], &b->deforms[i]))
            return false;
    }
    if (!a->is_moved)
        return true;
    for (int i = 0; i < 3; i++) {
        if (!numbers_are_same(a->rotation[i], b->rotation[i], 3))
            return false;
    }
    return numbers_are_same(a->shift_mm, b->shift_mm, 3);
}

void render_keep_watch(struct render_keep *keep, const struct io_scene *scene)
{
    for (size_t i = 0; i < keep->object_count; i++) {
        struct kept *const kept = &keep->objects[i];
        const struct io_object *const object = &scene->objects[i];
        if (kept->rest == io_object_rest(object) && poses_are_same(&kept->pose, &object->pose))
            continue;
        kept->rest = io_object_rest(object);
        kept->pose = object->pose;
        kept->shape++;
        keep->changes++;
    }
}

uint64_t render_keep_changes(const struct render_keep *keep)
{
    return keep->changes;
}

/* ---- samples ------------------------------------------------------------------------------------ */

static bool keys_are_same(const struct render_keep_key *a, const struct render_keep_key *b)
{
    return a->light == b->light && a->spacing_mm == b->spacing_mm && a->way == b->way &&
           a->object == b->object && a->ray_count == b->ray_count && a->environment == b->environment;
}

const struct render_light_samples *render_keep_find(const struct render_keep *keep, size_t object,
                                                    const struct render_keep_key *key)
{
    const struct kept *const kept = &keep->objects[object];
    const bool is_right = kept->is_known && kept->known_shape == kept->shape &&
                          (key->ray_count == 0 || kept->changes == keep->changes) &&
                          keys_are_same(&kept->key, key);
    return is_right ? &kept->samples : NULL;
}

struct render_light_samples *render_keep_begin(struct render_keep *keep, size_t object)
{
    struct kept *const kept = &keep->objects[object];
    kept->is_known = false;
    kept->samples.count = 0;
    return &kept->samples;
}

void render_keep_end(struct render_keep *keep, size_t object, const struct render_keep_key *key)
{
    struct kept *const kept = &keep->objects[object];
    kept->is_known = true;
    kept->key = *key;
    kept->known_shape = kept->shape;
    kept->changes = keep->changes;
    keep->sampled_count++;
}

size_t render_keep_count(const struct render_keep *keep)
{
    return keep->sampled_count;
}
