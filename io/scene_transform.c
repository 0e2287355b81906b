#include "io/scene_internal.h"

#include "io/mesh_internal.h"

#include <math.h>
#include <string.h>

/* [x, y, z], or one number for all. A negative factor mirrors; 0 would flatten. */
static bool get_scale(const struct io_json *at, double out[3], dipole_status *status)
{
    const struct io_json scale = io_json_member(at, "scale");
    const bool is_array = json_is_array(scale.value);
    if (is_array ? !io_scene_get_coordinates(at, "scale", out, status)
                 : !io_json_get_number(at, "scale", -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX, out, status))
        return false;
    for (size_t axis = 0; axis < 3; axis++) {
        const struct io_json element = io_json_element(&scale, axis);
        if (!is_array)
            out[axis] = out[0];
        if (!(fabs(out[axis]) >= IO_SCENE_LENGTH_MIN))
            return io_json_fail(is_array ? &element : &scale, DIPOLE_BAD_VALUE, status,
                                "is %g, expected 1e-06 to 1e+06, or the same below 0 to mirror", out[axis]);
    }
    return true;
}

/* Turn about x, then y, then z, counter-clockwise seen against the axis. */
static void set_rotation(double out[3][3], const double deg[3])
{
    double s[3], c[3];
    for (int axis = 0; axis < 3; axis++) {
        s[axis] = sin(deg[axis] * IO_SCENE_RAD_PER_DEG);
        c[axis] = cos(deg[axis] * IO_SCENE_RAD_PER_DEG);
    }
    const double rows[3][3] = {
        { c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0] },
        { s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0] },
        { -s[1], c[1] * s[0], c[1] * c[0] },
    };
    memcpy(out, rows, sizeof rows);
}

bool io_scene_read_transform(const struct io_json *at, struct io_scene_transform *transform,
                             dipole_status *status)
{
    static const char *const known[] = { "fit_height", "scale", "rotate_deg", "translate", NULL };
    double rotate_deg[3] = { 0, 0, 0 };
    *transform = (struct io_scene_transform){ .scale = { 1, 1, 1 } };
    if (at->value && (!io_json_check_object(at, known, 0, status) ||
                      !io_json_get_number(at, "fit_height", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX,
                                          &transform->fit_height, status) ||
                      !get_scale(at, transform->scale, status) ||
                      !io_scene_get_coordinates(at, "rotate_deg", rotate_deg, status) ||
                      !io_scene_get_coordinates(at, "translate", transform->translate, status)))
        return false;
    set_rotation(transform->rotation, rotate_deg);
    return true;
}

/* Rotate v into three floats. */
static void rotate(const struct io_scene_transform *transform, const double v[3], double out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = transform->rotation[row][0] * v[0] + transform->rotation[row][1] * v[1] +
                   transform->rotation[row][2] * v[2];
}

/* Move a mesh from its own coordinates to the world's; normals by the inverse transpose. */
static void apply(const struct io_scene_transform *transform, double unit_mm, struct io_mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        double position[3], normal[3], turned[3];
        for (int axis = 0; axis < 3; axis++) {
            position[axis] =
                ((double)p[axis] - transform->origin[axis]) * transform->fit * transform->scale[axis];
            normal[axis] = (double)n[axis] / transform->scale[axis];
        }
        rotate(transform, position, turned);
        for (int axis = 0; axis < 3; axis++)
            p[axis] = (float)((turned[axis] + transform->translate[axis]) * unit_mm);
        rotate(transform, normal, turned);
        io_scene_normalize(turned);
        for (int axis = 0; axis < 3; axis++)
            n[axis] = (float)turned[axis];
    }
    const bool is_mirrored = transform->scale[0] * transform->scale[1] * transform->scale[2] < 0;
    for (size_t i = 0; i < mesh->triangle_count && is_mirrored; i++) {
        const uint32_t corner = mesh->indices[3 * i + 1];
        mesh->indices[3 * i + 1] = mesh->indices[3 * i + 2];
        mesh->indices[3 * i + 2] = corner;
    }
    io_mesh_update_bounds(mesh);
}

bool io_scene_fit_mesh(const struct io_json *at, const struct io_mesh *mesh,
                       struct io_scene_transform *transform, dipole_status *status)
{
    const struct io_json at_transform = io_json_member(at, "transform");
    const struct io_json fit_height = io_json_member(&at_transform, "fit_height");
    const double height = (double)mesh->max[1] - (double)mesh->min[1];
    const double extent = fmax((double)mesh->max[0] - (double)mesh->min[0],
                               fmax(height, (double)mesh->max[2] - (double)mesh->min[2]));
    transform->fit = 1;
    if (!(transform->fit_height > 0))
        return true;
    if (!(height > 1e-6 * extent))
        return io_json_fail(&fit_height, DIPOLE_BAD_VALUE, status,
                            "is given, but the mesh has no height, expected scale instead");
    transform->fit = transform->fit_height / height;
    for (int axis = 0; axis < 3; axis++)
        transform->origin[axis] =
            axis == 1 ? (double)mesh->min[1] : ((double)mesh->min[axis] + (double)mesh->max[axis]) / 2;
    return true;
}

bool io_scene_place_mesh(const struct io_json *at, const struct io_scene_transform *transform,
                         double unit_mm, struct io_mesh *mesh, dipole_status *status)
{
    apply(transform, unit_mm, mesh);
    for (int axis = 0; axis < 3; axis++) {
        const double reach_mm = fmax(fabs((double)mesh->min[axis]), fabs((double)mesh->max[axis]));
        if (!(reach_mm <= IO_SCENE_REACH_MAX_MM))
            return io_json_fail(at, DIPOLE_BAD_VALUE, status, "reaches to %g mm, expected at most %g mm",
                                reach_mm, IO_SCENE_REACH_MAX_MM);
    }
    return true;
}
