#include "renderer/light_distance.h"

#include "renderer/crossings.h"
#include "renderer/projection.h"

#include <math.h>

static double segment_distance2(const double a[3], const double b[3], const double position[3])
{
    double along[3], from[3];
    for (int k = 0; k < 3; k++) {
        along[k] = b[k] - a[k];
        from[k] = position[k] - a[k];
    }
    const double length2 = render_dot(along, along);
    const double part = length2 > 0 ? fmin(fmax(render_dot(from, along) / length2, 0), 1) : 0;
    for (int k = 0; k < 3; k++)
        from[k] -= part * along[k];
    return render_dot(from, from);
}

/* Whether the point's foot on the plane lies within the triangle: on the same side of all edges. */
static bool is_over(const double corners[3][3], const double normal[3], const double position[3])
{
    for (int i = 0; i < 3; i++) {
        const double *const a = corners[i], *const b = corners[(i + 1) % 3];
        double inward = 0;
        for (int k = 0; k < 3; k++) {
            const int x = (k + 1) % 3, y = (k + 2) % 3;
            inward += (position[k] - a[k]) * (normal[x] * (b[y] - a[y]) - normal[y] * (b[x] - a[x]));
        }
        if (!(inward >= 0))
            return false;
    }
    return true;
}

double render_triangle_distance_mm(const double corners_mm[3][3], const double position_mm[3])
{
    double normal[3], least2 = INFINITY, height = 0;
    for (int k = 0; k < 3; k++) {
        const int x = (k + 1) % 3, y = (k + 2) % 3;
        normal[k] = (corners_mm[1][x] - corners_mm[0][x]) * (corners_mm[2][y] - corners_mm[0][y]) -
                    (corners_mm[1][y] - corners_mm[0][y]) * (corners_mm[2][x] - corners_mm[0][x]);
    }
    const double length = sqrt(render_dot(normal, normal));
    if (length > 0 && is_over(corners_mm, normal, position_mm)) {
        for (int k = 0; k < 3; k++)
            height += normal[k] / length * (position_mm[k] - corners_mm[0][k]);
        return fabs(height);
    }
    for (int i = 0; i < 3; i++)
        least2 = fmin(least2, segment_distance2(corners_mm[i], corners_mm[(i + 1) % 3], position_mm));
    return sqrt(least2);
}

static void corner_of(const struct io_mesh *mesh, size_t vertex, double out_mm[3])
{
    for (size_t k = 0; k < 3; k++)
        out_mm[k] = (double)mesh->positions[3 * vertex + k];
}

/* No surface of the mesh is nearer than its box. */
static double box_distance_mm(const struct io_mesh *mesh, const double position_mm[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double outside =
            fmax((double)mesh->min[k] - position_mm[k], position_mm[k] - (double)mesh->max[k]);
        sum += outside > 0 ? outside * outside : 0;
    }
    return sqrt(sum);
}

static double mesh_distance_mm(const struct io_mesh *mesh, const double position_mm[3], double least_mm)
{
    if (box_distance_mm(mesh, position_mm) >= least_mm)
        return least_mm;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        double corners_mm[3][3];
        for (size_t i = 0; i < 3; i++)
            corner_of(mesh, mesh->indices[3 * t + i], corners_mm[i]);
        least_mm = fmin(least_mm, render_triangle_distance_mm((const double(*)[3])corners_mm, position_mm));
    }
    return least_mm;
}

static double particles_distance_mm(const struct io_blocker *particles, const double position_mm[3],
                                    double least_mm)
{
    for (size_t v = 0; v < particles->mesh->vertex_count; v++) {
        double away_mm[3];
        corner_of(particles->mesh, v, away_mm);
        for (int k = 0; k < 3; k++)
            away_mm[k] -= position_mm[k];
        least_mm = fmin(least_mm, fmax(sqrt(render_dot(away_mm, away_mm)) - particles->particle_mm, 0));
    }
    return least_mm;
}

double render_light_distance_mm(const struct io_scene *scene, const double position_mm[3])
{
    double least_mm = INFINITY;
    for (size_t i = 0; i < scene->object_count; i++)
        least_mm = mesh_distance_mm(scene->objects[i].mesh, position_mm, least_mm);
    for (size_t i = 0; i < scene->blocker_count; i++) {
        const struct io_blocker *const blocker = &scene->blockers[i];
        if (!render_blocker_is_there(blocker))
            continue;
        least_mm = blocker->particle_mm > 0 ? particles_distance_mm(blocker, position_mm, least_mm)
                                            : mesh_distance_mm(blocker->mesh, position_mm, least_mm);
    }
    return least_mm;
}
