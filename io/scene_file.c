#include "io/scene_file.h"

#include "io/file.h"
#include "io/json.h"
#include "io/mesh_internal.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIGHT_LIMIT = 64, OBJECT_LIMIT = 1024, SIDE_LIMIT_PX = 16384, DEFAULT_DETAIL = 128 };

/* Ranges of what a scene may say: wide enough for anything, narrow enough that nothing overflows. */
static const double LENGTH_MIN = 1e-6,
                    LENGTH_MAX = 1e6; /* lengths and factors; coordinates to either side */
static const double POWER_MAX = 1e12;
static const double REACH_MAX_MM = 1e9; /* of a mesh, once it is in the world */

static const double RAD_PER_DEG = 3.14159265358979323846 / 180;

/* ---- vectors ------------------------------------------------------------------------------------- */

static double length_of(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

/* False for a vector that is too short to have a direction. */
static bool normalize(double v[3])
{
    const double length = length_of(v);
    if (!(length > 1e-12))
        return false;
    for (int axis = 0; axis < 3; axis++)
        v[axis] /= length;
    return true;
}

static bool get_coordinates(const struct io_json *object, const char *key, double out[3],
                            dipole_status *status)
{
    return io_json_get_numbers(object, key, 3, -LENGTH_MAX, LENGTH_MAX, out, status);
}

/* [r, g, b], or one number for grey. */
static bool get_rgb(const struct io_json *object, const char *key, double out[3], dipole_status *status)
{
    if (!json_is_number(io_json_member(object, key).value))
        return io_json_get_numbers(object, key, 3, 0, POWER_MAX, out, status);
    if (!io_json_get_number(object, key, 0, POWER_MAX, out, status))
        return false;
    out[1] = out[2] = out[0];
    return true;
}

static void scale_to_mm(double v[3], double unit_mm)
{
    for (int axis = 0; axis < 3; axis++)
        v[axis] *= unit_mm;
}

/* ---- camera -------------------------------------------------------------------------------------- */

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
    if (!normalize(view))
        return io_json_fail(&target, DIPOLE_BAD_VALUE, status, "is where eye is, expected another point");
    if (!normalize(upward))
        return io_json_fail(&up, DIPOLE_BAD_VALUE, status, "is [0, 0, 0], expected a direction");
    for (int axis = 0; axis < 3; axis++)
        side[axis] =
            view[(axis + 1) % 3] * upward[(axis + 2) % 3] - view[(axis + 2) % 3] * upward[(axis + 1) % 3];
    return length_of(side) > 1e-6 || io_json_fail(&up, DIPOLE_BAD_VALUE, status,
                                                  "is parallel to the view, expected another direction");
}

static bool read_camera(const struct io_json *at, double unit_mm, struct io_camera *camera,
                        dipole_status *status)
{
    static const char *const known[] = { "eye", "target", "up", "fov_y_deg", "height", "size", NULL };
    const struct io_json fov = io_json_member(at, "fov_y_deg");
    const struct io_json height = io_json_member(at, "height");
    double fov_y_deg = 35;
    *camera = (struct io_camera){ .up = { 0, 1, 0 } };
    if (!io_json_check_object(at, known, 2, status) ||
        !get_coordinates(at, "eye", camera->eye_mm, status) ||
        !get_coordinates(at, "target", camera->target_mm, status) ||
        !get_coordinates(at, "up", camera->up, status) ||
        !io_json_get_number(at, "fov_y_deg", 1, 170, &fov_y_deg, status) ||
        !io_json_get_number(at, "height", LENGTH_MIN, LENGTH_MAX, &camera->height_mm, status) ||
        !get_size(at, camera, status))
        return false;
    if (fov.value && height.value)
        return io_json_fail(&height, DIPOLE_BAD_VALUE, status,
                            "stands beside fov_y_deg, expected either that (perspective) or height "
                            "(orthographic)");
    camera->is_orthographic = height.value != NULL;
    camera->fov_y_rad = camera->is_orthographic ? 0 : fov_y_deg * RAD_PER_DEG;
    if (!check_view(at, camera, status))
        return false;
    scale_to_mm(camera->eye_mm, unit_mm);
    scale_to_mm(camera->target_mm, unit_mm);
    camera->height_mm *= unit_mm;
    return true;
}

/* ---- lights -------------------------------------------------------------------------------------- */

static bool read_light(const struct io_json *at, double unit_mm, struct io_light *light,
                       dipole_status *status)
{
    static const char *const kinds[] = {
        [IO_LIGHT_DIRECTIONAL] = "directional", [IO_LIGHT_POINT] = "point", NULL
    };
    static const char *const directional_keys[] = { "kind", "direction", "irradiance", NULL };
    static const char *const point_keys[] = { "kind", "position", "intensity", NULL };
    int kind = IO_LIGHT_DIRECTIONAL;
    if (json_is_object(at->value) && !io_json_get_choice(at, "kind", kinds, &kind, status))
        return false;
    *light = (struct io_light){ .kind = (enum io_light_kind)kind };
    if (kind == IO_LIGHT_POINT) {
        if (!io_json_check_object(at, point_keys, 3, status) ||
            !get_coordinates(at, "position", light->position_mm, status) ||
            !get_rgb(at, "intensity", light->rgb, status))
            return false;
        scale_to_mm(light->position_mm, unit_mm);
        return true;
    }
    if (!io_json_check_object(at, directional_keys, 3, status) ||
        !get_coordinates(at, "direction", light->direction, status) ||
        !get_rgb(at, "irradiance", light->rgb, status))
        return false;
    const struct io_json direction = io_json_member(at, "direction");
    return normalize(light->direction) ||
           io_json_fail(&direction, DIPOLE_BAD_VALUE, status, "is [0, 0, 0], expected a direction");
}

/* ---- transforms ---------------------------------------------------------------------------------- */

struct transform {
    double fit_height; /* 0: as large as the mesh is */
    double scale[3];
    double rotation[3][3];
    double translate[3];
};

/* [x, y, z], or one number for all. A negative factor mirrors; 0 would flatten. */
static bool get_scale(const struct io_json *at, double out[3], dipole_status *status)
{
    const struct io_json scale = io_json_member(at, "scale");
    const bool is_array = json_is_array(scale.value);
    if (is_array ? !get_coordinates(at, "scale", out, status)
                 : !io_json_get_number(at, "scale", -LENGTH_MAX, LENGTH_MAX, out, status))
        return false;
    for (size_t axis = 0; axis < 3; axis++) {
        const struct io_json element = io_json_element(&scale, axis);
        if (!is_array)
            out[axis] = out[0];
        if (!(fabs(out[axis]) >= LENGTH_MIN))
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
        s[axis] = sin(deg[axis] * RAD_PER_DEG);
        c[axis] = cos(deg[axis] * RAD_PER_DEG);
    }
    const double rows[3][3] = {
        { c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0] },
        { s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0] },
        { -s[1], c[1] * s[0], c[1] * c[0] },
    };
    memcpy(out, rows, sizeof rows);
}

static bool read_transform(const struct io_json *at, struct transform *transform, dipole_status *status)
{
    static const char *const known[] = { "fit_height", "scale", "rotate_deg", "translate", NULL };
    double rotate_deg[3] = { 0, 0, 0 };
    *transform = (struct transform){ .scale = { 1, 1, 1 } };
    if (at->value &&
        (!io_json_check_object(at, known, 0, status) ||
         !io_json_get_number(at, "fit_height", LENGTH_MIN, LENGTH_MAX, &transform->fit_height, status) ||
         !get_scale(at, transform->scale, status) ||
         !get_coordinates(at, "rotate_deg", rotate_deg, status) ||
         !get_coordinates(at, "translate", transform->translate, status)))
        return false;
    set_rotation(transform->rotation, rotate_deg);
    return true;
}

/* Rotate v into three floats. */
static void rotate(const struct transform *transform, const double v[3], double out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = transform->rotation[row][0] * v[0] + transform->rotation[row][1] * v[1] +
                   transform->rotation[row][2] * v[2];
}

/* Move a mesh from its own coordinates to the world's; normals by the inverse transpose. */
static void apply(const struct transform *transform, double unit_mm, struct io_mesh *mesh)
{
    double origin[3] = { 0, 0, 0 }, fit = 1;
    if (transform->fit_height > 0) {
        fit = transform->fit_height / ((double)mesh->max[1] - (double)mesh->min[1]);
        for (int axis = 0; axis < 3; axis++)
            origin[axis] =
                axis == 1 ? (double)mesh->min[1] : ((double)mesh->min[axis] + (double)mesh->max[axis]) / 2;
    }
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        double position[3], normal[3], turned[3];
        for (int axis = 0; axis < 3; axis++) {
            position[axis] = ((double)p[axis] - origin[axis]) * fit * transform->scale[axis];
            normal[axis] = (double)n[axis] / transform->scale[axis];
        }
        rotate(transform, position, turned);
        for (int axis = 0; axis < 3; axis++)
            p[axis] = (float)((turned[axis] + transform->translate[axis]) * unit_mm);
        rotate(transform, normal, turned);
        normalize(turned);
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

static bool place_mesh(const struct io_json *at, const struct transform *transform, double unit_mm,
                       struct io_mesh *mesh, dipole_status *status)
{
    const struct io_json at_transform = io_json_member(at, "transform");
    const struct io_json fit_height = io_json_member(&at_transform, "fit_height");
    const double extent = fmax(
        (double)mesh->max[0] - (double)mesh->min[0],
        fmax((double)mesh->max[1] - (double)mesh->min[1], (double)mesh->max[2] - (double)mesh->min[2]));
    if (transform->fit_height > 0 && !((double)mesh->max[1] - (double)mesh->min[1] > 1e-6 * extent))
        return io_json_fail(&fit_height, DIPOLE_BAD_VALUE, status,
                            "is given, but the mesh has no height, expected scale instead");
    apply(transform, unit_mm, mesh);
    for (int axis = 0; axis < 3; axis++) {
        const double reach_mm = fmax(fabs((double)mesh->min[axis]), fabs((double)mesh->max[axis]));
        if (!(reach_mm <= REACH_MAX_MM))
            return io_json_fail(at, DIPOLE_BAD_VALUE, status, "reaches to %g mm, expected at most %g mm",
                                reach_mm, REACH_MAX_MM);
    }
    return true;
}

/* ---- objects ------------------------------------------------------------------------------------- */

/* Find the file that a scene refers to. */
static bool resolve(const struct io_json *at, const struct io_scene_options *options, char out[PATH_MAX],
                    dipole_status *status)
{
    const dipole_place place = io_json_place(at);
    dipole_status found;
    if (io_path_resolve(&place, json_string_value(at->value), options->allowed_paths,
                        options->allowed_path_count, out, PATH_MAX, &found))
        return true;
    if (found.line > 0)
        return io_json_fail(at, found.code, status, "%s", found.message);
    if (status)
        *status = found; /* it is about a folder of the command line */
    return false;
}

static bool read_mesh(const struct io_json *at, const struct io_scene_options *options,
                      struct io_mesh **mesh, dipole_status *status)
{
    char path[PATH_MAX];
    dipole_status found;
    if (!json_is_string(at->value))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "is not a string, expected the path of a mesh file");
    if (!resolve(at, options, path, status))
        return false;
    return io_mesh_read(path, mesh, &found) || io_json_fail(at, found.code, status, "\"%.120s\" %s",
                                                            json_string_value(at->value), found.message);
}

static bool create_primitive(const struct io_json *object, struct io_mesh **mesh, dipole_status *status)
{
    const char *names[IO_PRIMITIVE_COUNT + 1] = { NULL };
    const struct io_json at_detail = io_json_member(object, "detail");
    int primitive = 0, detail = DEFAULT_DETAIL;
    dipole_status found;
    memcpy(names, io_primitive_names, sizeof io_primitive_names);
    if (!io_json_get_choice(object, "primitive", names, &primitive, status) ||
        !io_json_get_integer(object, "detail", 4, 4096, &detail, status))
        return false;
    return io_mesh_create_primitive((enum io_primitive)primitive, detail, mesh, &found) ||
           io_json_fail(&at_detail, found.code, status, "is %d: %s", detail, found.message);
}

static bool read_shape(const struct io_json *object, const struct io_scene_options *options,
                       struct io_mesh **mesh, dipole_status *status)
{
    const struct io_json file = io_json_member(object, "mesh"),
                         primitive = io_json_member(object, "primitive"),
                         detail = io_json_member(object, "detail");
    if (file.value && primitive.value)
        return io_json_fail(&primitive, DIPOLE_BAD_VALUE, status,
                            "stands beside mesh, expected one of the two");
    if (file.value && detail.value)
        return io_json_fail(&detail, DIPOLE_BAD_VALUE, status,
                            "stands beside mesh, expected beside primitive");
    if (!file.value && !primitive.value)
        return io_json_fail(&file, DIPOLE_BAD_VALUE, status, "is missing, expected it, or primitive");
    return file.value ? read_mesh(&file, options, mesh, status) : create_primitive(object, mesh, status);
}

static bool read_bundled_material(const struct io_json *at, struct io_material *material,
                                  dipole_status *status)
{
    char path[PATH_MAX];
    const char *name = json_string_value(at->value);
    if (!io_material_bundled_path(name, path, sizeof path, NULL))
        return io_json_fail(
            at, DIPOLE_NOT_FOUND, status,
            "is \"%.60s\", which is no bundled material, expected one such as \"marble\", a path "
            "that ends in .json, or an object",
            name);
    return io_material_read(path, material, status);
}

static bool read_material(const struct io_json *at, const struct io_scene_options *options,
                          struct io_material *material, dipole_status *status)
{
    char path[PATH_MAX];
    const char *text = json_string_value(at->value);
    if (!text)
        return io_material_parse(at, material, status);
    if (io_material_is_bundled_name(text))
        return read_bundled_material(at, material, status);
    return resolve(at, options, path, status) && io_material_read(path, material, status);
}

static bool read_object(const struct io_json *at, const struct io_scene_options *options, double unit_mm,
                        struct io_object *object, dipole_status *status)
{
    static const char *const known[] = { "material",  "mesh",      "primitive", "detail", "name",
                                         "transform", "roughness", "specular",  NULL };
    const struct io_json material = io_json_member(at, "material"),
                         transform_at = io_json_member(at, "transform");
    struct transform transform;
    *object = (struct io_object){ .roughness = 0.3, .has_specular = true };
    if (!io_json_check_object(at, known, 1, status))
        return false;
    /* An object without a name goes by its shape. */
    const json_t *mesh = json_object_get(at->value, "mesh"),
                 *primitive = json_object_get(at->value, "primitive");
    const char *shape = json_string_value(mesh ? mesh : primitive);
    snprintf(object->name, sizeof object->name, "%s", shape ? shape : "");
    return io_json_get_text(at, "name", object->name, sizeof object->name, status) &&
           io_json_get_number(at, "roughness", 0.05, 1, &object->roughness, status) &&
           io_json_get_bool(at, "specular", &object->has_specular, status) &&
           read_transform(&transform_at, &transform, status) &&
           read_material(&material, options, &object->material, status) &&
           read_shape(at, options, &object->mesh, status) &&
           place_mesh(at, &transform, unit_mm, object->mesh, status);
}

/* ---- scenes -------------------------------------------------------------------------------------- */

static bool read_lights(const struct io_json *at, double unit_mm, struct io_scene *scene,
                        dipole_status *status)
{
    size_t count;
    if (!io_json_check_array(at, 1, LIGHT_LIMIT, &count, status))
        return false;
    scene->lights = calloc(count, sizeof *scene->lights);
    if (!scene->lights)
        return io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    for (; scene->light_count < count; scene->light_count++) {
        const struct io_json light = io_json_element(at, scene->light_count);
        if (!read_light(&light, unit_mm, &scene->lights[scene->light_count], status))
            return false;
    }
    return true;
}

static void grow_box(struct io_scene *scene, const struct io_mesh *mesh)
{
    for (int axis = 0; axis < 3; axis++) {
        scene->min_mm[axis] = fmin(scene->min_mm[axis], (double)mesh->min[axis]);
        scene->max_mm[axis] = fmax(scene->max_mm[axis], (double)mesh->max[axis]);
    }
}

static bool read_objects(const struct io_json *at, const struct io_scene_options *options, double unit_mm,
                         struct io_scene *scene, dipole_status *status)
{
    size_t count, triangle_count = 0;
    if (!io_json_check_array(at, 1, OBJECT_LIMIT, &count, status))
        return false;
    scene->objects = calloc(count, sizeof *scene->objects);
    if (!scene->objects)
        return io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    for (int axis = 0; axis < 3; axis++) {
        scene->min_mm[axis] = INFINITY;
        scene->max_mm[axis] = -INFINITY;
    }
    while (scene->object_count < count) {
        const struct io_json element = io_json_element(at, scene->object_count);
        struct io_object *object =
            &scene->objects[scene->object_count++]; /* counted first: its mesh is ours */
        if (!read_object(&element, options, unit_mm, object, status))
            return false;
        triangle_count += object->mesh->triangle_count;
        if (triangle_count > IO_MESH_TRIANGLE_LIMIT)
            return io_json_fail(&element, DIPOLE_BAD_VALUE, status,
                                "brings the scene to %zu triangles, expected at most %u", triangle_count,
                                IO_MESH_TRIANGLE_LIMIT);
        grow_box(scene, object->mesh);
    }
    return true;
}

static bool fill_scene(const struct io_json *root, const struct io_scene_options *options,
                       struct io_scene *scene, dipole_status *status)
{
    static const char *const known[] = { "camera",     "lights",      "objects", "unit_mm",
                                         "background", "exposure_ev", NULL };
    const struct io_json camera = io_json_member(root, "camera"), lights = io_json_member(root, "lights"),
                         objects = io_json_member(root, "objects");
    double unit_mm = 1;
    return io_json_check_object(root, known, 3, status) &&
           io_json_get_number(root, "unit_mm", LENGTH_MIN, LENGTH_MAX, &unit_mm, status) &&
           get_rgb(root, "background", scene->background, status) &&
           io_json_get_number(root, "exposure_ev", -100, 100, &scene->exposure_ev, status) &&
           read_camera(&camera, unit_mm, &scene->camera, status) &&
           read_lights(&lights, unit_mm, scene, status) &&
           read_objects(&objects, options, unit_mm, scene, status);
}

bool io_scene_read(const char *path, const struct io_scene_options *options, struct io_scene **scene_out,
                   dipole_status *status)
{
    static const struct io_scene_options no_options = { 0 };
    const dipole_place place = { .source = path };
    struct io_json_document *document = NULL;
    *scene_out = NULL;
    options = options ? options : &no_options;
    struct io_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for a scene");
    bool done = io_json_read(path, &document, status);
    if (done) {
        const struct io_json root = io_json_root(document);
        snprintf(scene->path, sizeof scene->path, "%s", path); /* it was opened, so it fits */
        done = fill_scene(&root, options, scene, status);
    }
    io_json_destroy(document);
    if (!done) {
        io_scene_destroy(scene);
        return false;
    }
    if (options->width_px > 0)
        scene->camera.width_px = options->width_px;
    if (options->height_px > 0)
        scene->camera.height_px = options->height_px;
    *scene_out = scene;
    return true;
}

void io_scene_destroy(struct io_scene *scene)
{
    if (!scene)
        return;
    for (size_t i = 0; i < scene->object_count; i++)
        io_mesh_destroy(scene->objects[i].mesh);
    free(scene->objects);
    free(scene->lights);
    free(scene);
}
