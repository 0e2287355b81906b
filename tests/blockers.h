/* Blockers of light for the tests of the renderer. */
#ifndef BLOCKERS_H
#define BLOCKERS_H

#include "check.h"
#include "io/scatter.h"
#include "io/scene_file.h"

/* A primitive, scaled about the origin and raised; it blocks nothing yet. The caller ends its mesh. */
static inline struct io_blocker blocker_of(enum io_primitive primitive, int detail, double scale_mm,
                                           double y_mm)
{
    struct io_blocker blocker = { .mesh = NULL };
    assert_true(io_mesh_create_primitive(primitive, detail, &blocker.mesh, NULL));
    struct io_mesh *const mesh = blocker.mesh;
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        mesh->positions[i] = (float)((double)mesh->positions[i] * scale_mm + (i % 3 == 1 ? y_mm : 0));
    for (int k = 0; k < 3; k++) {
        mesh->min[k] = (float)((double)mesh->min[k] * scale_mm + (k == 1 ? y_mm : 0));
        mesh->max[k] = (float)((double)mesh->max[k] * scale_mm + (k == 1 ? y_mm : 0));
    }
    return blocker;
}

#endif
