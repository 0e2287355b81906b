#include "io/scene_internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIDE_LIMIT_PX = 16384, CAMERA_LIMIT = 64, NAME_SIZE = 64 };

static bool get_size(const struct io_json *at, struct io_camera *camera, dipole_status *status)
{
    const struct io_json size = io_json_member(at, "size");
    double numbers[2] = { 800, 600 };
    if (!io_json_get_numbers(at, "size", 2, 1, SIDE_LIMIT_PX, numbers, status))
        return false;
    for (size_t i = 0; i < 2; i++) {
        const struct io_json element = io_json_element(&size, i);
        if (numbers[i] != floor(numbers[i]))
            return io_json_fail(&element, DIPOLE_BAD_VALUE, status, "is %g, expected a whole number",
                                numbers[i]);
    }
    camera->width_px = (int)numbers[0];
    camera->height_px = (int)numbers[1];
    return true;
}

/* The eye sees something, and knows which way up is. */
static bool check_view(const struct io_json *at, const struct io_camera *camera, dipole_status *status)
{
    const struct io_json target = io_json_member(at, "target"), up = io_json_member(at, "up");
    double view[3], side[3], upward[3];
    for (int axis = 0; axis < 3; axis++) {
        view[axis] = camera->target_mm[axis] - camera->eye_mm[axis];
        upward[axis] = camera->up[axis];
    }
    if (!io_scene_normalize(view))
        return io_json_fail(&target, DIPOLE_BAD_VALUE, status, "is where eye is, expected another point");
    if (!io_scene_normalize(upward))
        return io_json_fail(&up, DIPOLE_BAD_VALUE, status, "is [0, 0, 0], expected a direction");
    for (int axis = 0; axis < 3; axis++)
        side[axis] =
            view[(axis + 1) % 3] * upward[(axis + 2) % 3] - view[(axis + 2) % 3] * upward[(axis + 1) % 3];
    return io_scene_length(side) > 1e-6 ||
           io_json_fail(&up, DIPOLE_BAD_VALUE, status,
                        "is parallel to the view, expected another direction");
}

static bool read_camera(const struct io_json *at, double unit_mm, struct io_camera *camera,
                        char name[NAME_SIZE], dipole_status *status)
{
    static const char *const known[] = {
        "eye", "target", "up", "fov_y_deg", "height", "size", "name", NULL
    };
    const struct io_json fov = io_json_member(at, "fov_y_deg");
    const struct io_json height = io_json_member(at, "height");
    double fov_y_deg = 35;
    name[0] = '\0';
    *camera = (struct io_camera){ .up = { 0, 1, 0 } };
    if (!io_json_check_object(at, known, 2, status) ||
        !io_scene_get_coordinates(at, "eye", camera->eye_mm, status) ||
        !io_scene_get_coordinates(at, "target", camera->target_mm, status) ||
        !io_scene_get_coordinates(at, "up", camera->up, status) ||
        !io_json_get_number(at, "fov_y_deg", 1, 170, &fov_y_deg, status) ||
        !io_json_get_number(at, "height", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX, &camera->height_mm,
                            status) ||
        !get_size(at, camera, status) || !io_json_get_text(at, "name", name, NAME_SIZE, status))
        return false;
    if (fov.value && height.value)
        return io_json_fail(&height, DIPOLE_BAD_VALUE, status,
                            "stands beside fov_y_deg, expected either that (perspective) or height "
                            "(orthographic)");
    camera->is_orthographic = height.value != NULL;
    camera->fov_y_rad = camera->is_orthographic ? 0 : fov_y_deg * IO_SCENE_RAD_PER_DEG;
    if (!check_view(at, camera, status))
        return false;
    io_scene_scale_to_mm(camera->eye_mm, unit_mm);
    io_scene_scale_to_mm(camera->target_mm, unit_mm);
    camera->height_mm *= unit_mm;
    return true;
}

/* A camera among others is chosen by its name. */
static bool check_name(const struct io_json *at, size_t index, char names[][NAME_SIZE],
                       dipole_status *status)
{
    const struct io_json name = io_json_member(at, "name");
    if (names[index][0] == '\0')
        return io_json_fail(&name, DIPOLE_BAD_VALUE, status, "is %s, expected the camera's name",
                            name.value ? "empty" : "missing");
    for (size_t i = 0; i < index; i++) {
        if (strcmp(names[i], names[index]) == 0)
            return io_json_fail(&name, DIPOLE_BAD_VALUE, status,
                                "is \"%s\" as in cameras[%zu], expected another", names[index], i);
    }
    return true;
}

static bool fail_at_choice(const struct io_json *cameras, const char *name, char names[][NAME_SIZE],
                           size_t count, dipole_status *status)
{
    char known[sizeof status->message] = "";
    for (size_t i = 0, length = 0; i < count && length < sizeof known; i++)
        length +=
            (size_t)snprintf(known + length, sizeof known - length, "%s%s", i > 0 ? ", " : "", names[i]);
    return io_json_fail(cameras, DIPOLE_NOT_FOUND, status, "has none named \"%.60s\", expected one of %s",
                        name, known);
}

static bool read_many(const struct io_json *at, const char *name, double unit_mm, struct io_camera *camera,
                      dipole_status *status)
{
    char names[CAMERA_LIMIT][NAME_SIZE];
    size_t count;
    bool is_found = false;
    if (!io_json_check_array(at, 1, CAMERA_LIMIT, &count, status))
        return false;
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(at, i);
        struct io_camera found;
        if (!read_camera(&element, unit_mm, &found, names[i], status) ||
            !check_name(&element, i, names, status))
            return false;
        if (name ? strcmp(name, names[i]) == 0 : i == 0) {
            *camera = found;
            is_found = true;
        }
    }
    return is_found || fail_at_choice(at, name, names, count, status);
}

bool io_scene_read_cameras(const struct io_json *root, const char *name, double unit_mm,
                           struct io_camera *camera, dipole_status *status)
{
    const struct io_json one = io_json_member(root, "camera"), many = io_json_member(root, "cameras");
    char own_name[NAME_SIZE];
    if (one.value && many.value)
        return io_json_fail(&many, DIPOLE_BAD_VALUE, status,
                            "stands beside camera, expected one of the two");
    if (!one.value && !many.value)
        return io_json_fail(&one, DIPOLE_BAD_VALUE, status, "is missing, expected it, or cameras");
    if (many.value)
        return read_many(&many, name, unit_mm, camera, status);
    if (!read_camera(&one, unit_mm, camera, own_name, status))
        return false;
    if (!name || strcmp(name, own_name) == 0)
        return true;
    return own_name[0] == '\0'
               ? io_json_fail(&one, DIPOLE_NOT_FOUND, status, "has no name, but \"%.60s\" is asked for",
                              name)
               : io_json_fail(&one, DIPOLE_NOT_FOUND, status, "is named \"%s\", but \"%.60s\" is asked for",
                              own_name, name);
}
