/* What moves, and how light samples are kept from flickering because of it. */
#include "renderer/plan_internal.h"

#include <math.h>

/* Sides of the cubes that samples are gathered in, as part of the spacing, at the most: surfaces cut cubes
 * at all angles; so narrow they err no more than the light's grid does (measured, docs/motion.md). */
#define CELL_SHARE 0.6

const char *const render_coherence_names[] = { "auto", "none", "two-pass", "surface", NULL };

static bool lights_move(const struct io_scene *scene)
{
    return scene->light_count > 0 &&
           remainder(scene->frames.lights_turn_deg, 360 * scene->frames.count) != 0;
}

/* Whether light samples could change from frame to frame. */
static bool samples_move(const struct io_scene *scene)
{
    bool do_move = lights_move(scene);
    for (size_t i = 0; i < scene->object_count; i++)
        do_move |= scene->objects[i].motion != NULL;
    return scene->frames.count > 1 && do_move;
}

void render_plan_look_at_motion(const struct render_request *request, struct render_plan *plan)
{
    const struct io_scene *const scene = request->scene;
    plan->coherence = RENDER_COHERENCE_NONE;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_object *const object = &scene->objects[i];
        const bool is_sequence = io_object_motion_kinds(object).is_sequence;
        if (object->pose.deform_count > 0)
            plan->deformed_vertex_count += object->mesh->vertex_count;
        if (object->pose.is_moved || is_sequence)
            plan->moved_vertex_count += object->mesh->vertex_count;
    }
    if (request->is_captured || !samples_move(scene))
        return;
    plan->coherence =
        request->coherence == RENDER_COHERENCE_AUTO ? RENDER_COHERENCE_SURFACE : request->coherence;
}

void render_plan_choose_cells(const struct render_request *request, struct render_plan *plan)
{
    if (!render_plan_sums_samples(plan) || plan->lit_count == 0 || !plan->has_scattering || plan->has_grid)
        plan->coherence = RENDER_COHERENCE_NONE;
    if (plan->coherence != RENDER_COHERENCE_SURFACE)
        return;
    const bool is_gathered = plan->technique == RENDER_TECHNIQUE_GATHER;
    const double share = is_gathered ? fmin(plan->finest_spacings, CELL_SHARE) : CELL_SHARE;
    if (is_gathered) /* merged in the same cubes */
        plan->finest_spacings = share;
    for (size_t i = 0; i < request->scene->object_count; i++)
        plan->objects[i].cell_mm =
            share * plan->objects[i].spacing_mm / io_object_stretch(&request->scene->objects[i]);
    if (request->scene->object_count > 1 && !plan->has_object_ids) {
        plan->has_object_ids = true;
        plan->ids_reason = "samples stay on the surfaces of several objects";
    }
}

int render_plan_code_level(const struct render_plan *plan, size_t object)
{
    const struct render_plan_object *const planned = &plan->objects[object];
    const double stretched_mm =
        plan->finest_spacings * planned->spacing_mm; /* a cube, where it is widest */
    const double wanted_mm = plan->of_medium[planned->medium].bands[0].spacing_mm;
    return stretched_mm > 0 ? (int)floor(log2(wanted_mm / stretched_mm) + 0.1) : 0;
}
