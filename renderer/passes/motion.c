/* Objects in the pose of the frame, once, before anything is drawn: a vertex shader writes their vertices
 * to the buffers that all other passes read, and these know nothing of it (pose.h). Meshes of a sequence
 * take each other's place before the first pass. */
#include "renderer/cost.h"
#include "renderer/effects.h"
#include "renderer/execute.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct render_decision decide_deform(const struct render_request *request,
                                            const struct render_plan *plan)
{
    size_t object_count = 0, vertex_count = 0;
    bool is_ever = false;
    (void)plan;
    for (size_t i = 0; i < request->scene->object_count; i++) {
        const struct io_object *const object = &request->scene->objects[i];
        is_ever |= io_object_motion_kinds(object).is_deformed;
        object_count += object->pose.deform_count > 0;
        vertex_count += object->pose.deform_count > 0 ? object->mesh->vertex_count : 0;
    }
    if (!is_ever)
        return render_not_called_for("no object is deformed");
    if (object_count == 0)
        return render_not_called_for("in this frame every deformation is by 0");
    return render_called_for("%zu of %zu objects, %zu vertices, written by one pass for all others",
                             object_count, request->scene->object_count, vertex_count);
}

static struct render_decision decide_motion(const struct render_request *request,
                                            const struct render_plan *plan)
{
    size_t moved_count = 0, sequence_count = 0, ever_count = 0;
    (void)plan;
    for (size_t i = 0; i < request->scene->object_count; i++) {
        const struct io_object *const object = &request->scene->objects[i];
        const struct io_motion_kinds kinds = io_object_motion_kinds(object);
        moved_count += object->pose.is_moved;
        sequence_count += kinds.is_sequence;
        ever_count += kinds.is_moved || kinds.is_sequence;
    }
    if (ever_count == 0)
        return render_not_called_for("no object moves or changes its mesh");
    if (moved_count + sequence_count == 0)
        return render_not_called_for("in this frame all objects are where they began");
    return render_called_for("%zu object%s moved by a matrix, %zu with a mesh of this frame", moved_count,
                             moved_count == 1 ? "" : "s", sequence_count);
}

/* What the processor poses for bounds and areas, once a frame is set, is not in it. */
static double deform_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_DEFORMED_VERTEX, (double)plan->deformed_vertex_count);
}

static double motion_ms(const struct render_plan *plan)
{
    return render_cost_ms(RENDER_COST_MOVED_VERTEX, (double)plan->moved_vertex_count);
}

static bool pose_deformed(const struct render_frame *frame, dipole_status *status)
{
    return render_executor_pose(frame, true, status);
}

static bool pose_moved(const struct render_frame *frame, dipole_status *status)
{
    return render_executor_pose(frame, false, status);
}

/* Of an object that is deformed and moves, both are done by the first. */
static const struct render_pass deform_passes[] = {
    { .name = "pose_deformed",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "posed_vertices" },
      .run = pose_deformed },
};

static const struct render_pass motion_passes[] = {
    { .name = "pose_moved",
      .draw = RENDER_DRAW_NOTHING,
      .writes = { "posed_vertices" },
      .run = pose_moved },
};

const struct render_effect render_effect_deform = {
    .name = "deform",
    .source = "global deformations, Barr 1984",
    .decide = decide_deform,
    .cost_ms = deform_ms,
    .passes = deform_passes,
    .pass_count = COUNT(deform_passes),
};

const struct render_effect render_effect_motion = {
    .name = "motion",
    .source = "rigid motion, and sequences of meshes",
    .decide = decide_motion,
    .cost_ms = motion_ms,
    .passes = motion_passes,
    .pass_count = COUNT(motion_passes),
};
