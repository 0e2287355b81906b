/* Samples of the light from all around, kept while nothing that decides them changes: the camera may move.
 * Pure C: no OpenGL here. */
#ifndef RENDERER_ENVIRONMENT_KEEP_H
#define RENDERER_ENVIRONMENT_KEEP_H

#include "io/scene_file.h"
#include "renderer/light_samples.h"
#include "renderer/render.h"

/* All that decides the samples of an object beside its shape. */
struct render_keep_key {
    uint64_t light; /* number of the table of irradiance: another for each that is made */
    double spacing_mm;
    enum render_environment_samples way;
    float object;  /* that samples are marked with                                     */
    int ray_count; /* of what hides the environment; 0: nothing does                   */
    const struct render_environment *environment; /* with rays alone, else NULL        */
};

struct render_keep;

/* Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_keep_create(size_t object_count, struct render_keep **keep_out,
                                       dipole_status *status);
void render_keep_destroy(struct render_keep *keep);

/* Take up the poses of a frame: what differs from the call before has changed. */
void render_keep_watch(struct render_keep *keep, const struct io_scene *scene);

/* Changes so far, of any object's shape. */
uint64_t render_keep_changes(const struct render_keep *keep);

/* Samples that were kept of an object and are still right; NULL: none. */
const struct render_light_samples *render_keep_find(const struct render_keep *keep, size_t object,
                                                    const struct render_keep_key *key);

/* An empty list for new samples, which count from render_keep_end on. */
struct render_light_samples *render_keep_begin(struct render_keep *keep, size_t object);
void render_keep_end(struct render_keep *keep, size_t object, const struct render_keep_key *key);

/* How often an object was sampled since the beginning. */
size_t render_keep_count(const struct render_keep *keep);

#endif
