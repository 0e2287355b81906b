/*
 * What light comes through: the scene's blockers, and objects whose material lets some of it through, which
 * block other surfaces as solids do. Pure C. theory.md T69, T70.
 */
#ifndef RENDERER_CASTERS_H
#define RENDERER_CASTERS_H

#include "renderer/media.h"

struct render_casters {
    struct io_blocker *casters; /* blockers in the scene's order, then objects; meshes are the scene's */
    size_t count, blocker_count;
    size_t *objects;        /* of each object among them: its number in the scene  */
    bool *lets_through;     /* of each object of the scene: it is among them       */
    double most_left;       /* of a channel, that an object among them leaves      */
    char opaque_reason[96]; /* why an object is not; "": there is none that could be */
};

/*
 * The casters of a scene. An object is one if it is closed and without layers, leaves more than epsilon at
 * its mean thickness, and "casts" asks for it; by "auto" if it is thin, shades another object, is near to
 * one, and so nearer to what lets light straight through than to what lets none (T70). Fails with
 * DIPOLE_OUT_OF_MEMORY. Scene and media must outlive them; end them with render_casters_end, also after
 * failure.
 */
DIPOLE_CHECKED bool render_casters_init(const struct io_scene *scene, const struct render_media *media,
                                        double epsilon, struct render_casters *casters,
                                        dipole_status *status);
void render_casters_end(struct render_casters *casters);

#endif
