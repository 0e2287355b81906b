#include "io/scene_file.h"

#include "io/file.h"
#include "io/scene_motion.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { OBJECT_LIMIT = 1024, DEFAULT_DETAIL = 128 };

static const double POWER_MAX = 1e12;

/* ---- vectors ------------------------------------------------------------------------------------- */

double io_scene_length(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

bool io_scene_normalize(double v[3])
{
    const double length = io_scene_length(v);
    if (!(length > 1e-12))
        return false;
    for (int axis = 0; axis < 3; axis++)
        v[axis] /= length;
    return true;
}

bool io_scene_get_coordinates(const struct io_json *object, const char *key, double out[3],
                              dipole_status *status)
{
    return io_json_get_numbers(object, key, 3, -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX, out, status);
}

/* [r, g, b], or one number for grey. */
bool io_scene_get_rgb(const struct io_json *object, const char *key, double out[3], dipole_status *status)
{
    if (!json_is_number(io_json_member(object, key).value))
        return io_json_get_numbers(object, key, 3, 0, POWER_MAX, out, status);
    if (!io_json_get_number(object, key, 0, POWER_MAX, out, status))
        return false;
    out[1] = out[2] = out[0];
    return true;
}

void io_scene_scale_to_mm(double v[3], double unit_mm)
{
    for (int axis = 0; axis < 3; axis++)
        v[axis] *= unit_mm;
}

/* ---- lights -------------------------------------------------------------------------------------- */

/* How bright a light is; a file that is only fitted to need not know. */
static bool read_brightness(const struct io_json *at, const char *key, struct io_light *light,
                            dipole_status *status)
{
    light->is_stated = io_json_member(at, key).value != NULL;
    for (int c = 0; c < 3; c++)
        light->rgb[c] = 1;
    return !light->is_stated || io_scene_get_rgb(at, key, light->rgb, status);
}

static bool read_spot(const struct io_json *at, struct io_light *light, dipole_status *status)
{
    double cone_deg = 0;
    light->is_spot = true;
    light->cone_blend = 0.15;
    if (!io_json_get_number(at, "cone_deg", 0.1, 175, &cone_deg, status) ||
        !io_json_get_number(at, "cone_blend", 0, 1, &light->cone_blend, status) ||
        !io_scene_get_coordinates(at, "direction", light->direction, status))
        return false;
    light->cone_rad = cone_deg * IO_SCENE_RAD_PER_DEG;
    return true;
}

static bool read_point_light(const struct io_json *at, double unit_mm, bool is_spot, struct io_light *light,
                             dipole_status *status)
{
    static const char *const point_keys[] = { "kind", "position", "intensity", "size", NULL };
    static const char *const spot_keys[] = { "kind",      "position", "direction",  "cone_deg",
                                             "intensity", "size",     "cone_blend", NULL };
    if (!io_json_check_object(at, is_spot ? spot_keys : point_keys, is_spot ? 4 : 2, status) ||
        !io_scene_get_coordinates(at, "position", light->position_mm, status) ||
        !io_json_get_number(at, "size", 0, IO_SCENE_LENGTH_MAX, &light->size_mm, status) ||
        !read_brightness(at, "intensity", light, status) || (is_spot && !read_spot(at, light, status)))
        return false;
    light->size_mm *= unit_mm;
    io_scene_scale_to_mm(light->position_mm, unit_mm);
    return true;
}

bool io_scene_read_light(const struct io_json *at, double unit_mm, struct io_light *light,
                         dipole_status *status)
{
    enum { DIRECTIONAL, POINT, SPOT };
    static const char *const kinds[] = { "directional", "point", "spot", NULL };
    static const char *const directional_keys[] = { "kind", "direction", "irradiance", "size_deg", NULL };
    int kind = DIRECTIONAL;
    double size_deg = 0;
    if (json_is_object(at->value) && !io_json_get_choice(at, "kind", kinds, &kind, status))
        return false;
    *light = (struct io_light){ .kind = kind == DIRECTIONAL ? IO_LIGHT_DIRECTIONAL : IO_LIGHT_POINT };
    if (kind == DIRECTIONAL) {
        if (!io_json_check_object(at, directional_keys, 2, status) ||
            !io_scene_get_coordinates(at, "direction", light->direction, status) ||
            !io_json_get_number(at, "size_deg", 0, 90, &size_deg, status) ||
            !read_brightness(at, "irradiance", light, status))
            return false;
        light->size_rad = size_deg * IO_SCENE_RAD_PER_DEG;
    } else if (!read_point_light(at, unit_mm, kind == SPOT, light, status)) {
        return false;
    }
    const struct io_json direction = io_json_member(at, "direction");
    return kind == POINT || io_scene_normalize(light->direction) ||
           io_json_fail(&direction, DIPOLE_BAD_VALUE, status, "is [0, 0, 0], expected a direction");
}

/* ---- objects ------------------------------------------------------------------------------------- */

/* Find the file that a scene refers to; at: where it says so. */
static bool resolve_name(const struct io_json *at, const char *name, const struct io_scene_options *options,
                         char out[PATH_MAX], dipole_status *status)
{
    const dipole_place place = io_json_place(at);
    dipole_status found;
    if (io_path_resolve(&place, name, options->allowed_paths, options->allowed_path_count, out, PATH_MAX,
                        &found))
        return true;
    if (found.line > 0)
        return io_json_fail(at, found.code, status, "%s", found.message);
    if (status)
        *status = found; /* it is about a folder of the command line */
    return false;
}

static bool resolve(const struct io_json *at, const struct io_scene_options *options, char out[PATH_MAX],
                    dipole_status *status)
{
    return resolve_name(at, json_string_value(at->value), options, out, status);
}

bool io_scene_read_mesh(const struct io_json *at, const char *name, const struct io_scene_options *options,
                        struct io_mesh **mesh, dipole_status *status)
{
    char path[PATH_MAX];
    dipole_status found;
    return resolve_name(at, name, options, path, status) &&
           (io_mesh_read(path, mesh, &found) ||
            io_json_fail(at, found.code, status, "\"%.120s\" %s", name, found.message));
}

static bool read_mesh(const struct io_json *at, const struct io_scene_options *options,
                      struct io_mesh **mesh, dipole_status *status)
{
    if (!json_is_string(at->value))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "is not a string, expected the path of a mesh file");
    return io_scene_read_mesh(at, json_string_value(at->value), options, mesh, status);
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

bool io_scene_read_shape(const struct io_json *object, const struct io_scene_options *options,
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
        return io_json_fail(&file, DIPOLE_BAD_VALUE, status,
                            "is missing, expected it, primitive or mesh_sequence");
    return file.value ? read_mesh(&file, options, mesh, status) : create_primitive(object, mesh, status);
}

/* One mesh, or the first of a sequence, placed in the world; then what becomes of it frame by frame. */
static bool read_shapes(const struct io_json *at, const struct io_scene_options *options,
                        const struct io_scene *scene, double unit_mm, struct io_object *object,
                        dipole_status *status)
{
    const struct io_json transform_at = io_json_member(at, "transform"),
                         sequence = io_json_member(at, "mesh_sequence");
    struct io_scene_transform transform;
    if (!io_scene_read_transform(&transform_at, &transform, status))
        return false;
    if (!sequence.value && (!io_scene_read_shape(at, options, &object->mesh, status) ||
                            !io_scene_fit_mesh(at, object->mesh, &transform, status) ||
                            !io_scene_place_mesh(at, &transform, unit_mm, object->mesh, status)))
        return false;
    const struct io_motion_reading reading = { .at = at,
                                               .options = options,
                                               .transform = &transform,
                                               .unit_mm = unit_mm,
                                               .frame_count = scene->frames.count };
    return io_scene_read_motion(&reading, &object->mesh, &object->motion, status);
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

bool io_scene_read_material(const struct io_json *at, const struct io_scene_options *options,
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

static bool read_object(const struct io_json *at, const struct io_scene_options *options,
                        const struct io_scene *scene, double unit_mm, struct io_object *object,
                        dipole_status *status)
{
    static const char *const known[] = { "material",  "mesh",      "primitive", "detail",        "name",
                                         "transform", "roughness", "specular",  "mesh_sequence", "deform",
                                         "motion",    "casts",     NULL };
    static const char *const casts_names[] = { "auto", "opaque", "translucent", NULL };
    int casts = IO_CASTS_AUTO;
    const struct io_json material = io_json_member(at, "material");
    *object = (struct io_object){ .roughness = IO_SCENE_ROUGHNESS, .has_specular = true };
    if (!io_json_check_object(at, known, 1, status))
        return false;
    /* An object without a name goes by its shape. */
    const json_t *mesh = json_object_get(at->value, "mesh"),
                 *primitive = json_object_get(at->value, "primitive");
    const char *shape = json_string_value(mesh ? mesh : primitive);
    snprintf(object->name, sizeof object->name, "%s", shape ? shape : "");
    if (!io_json_get_choice(at, "casts", casts_names, &casts, status))
        return false;
    object->casts = (enum io_casts)casts;
    return io_json_get_text(at, "name", object->name, sizeof object->name, status) &&
           io_json_get_number(at, "roughness", 0.05, 1, &object->roughness, status) &&
           io_json_get_bool(at, "specular", &object->has_specular, status) &&
           io_scene_read_material(&material, options, &object->material, status) &&
           read_shapes(at, options, scene, unit_mm, object, status);
}

/* ---- scenes -------------------------------------------------------------------------------------- */

/* at: the path of a picture; it is looked for, not read. */
static bool find_picture(const struct io_json *at, const struct io_scene_options *options,
                         struct io_environment *environment, dipole_status *status)
{
    const char *const text = json_string_value(at->value);
    const char *const dot = text ? strrchr(text, '.') : NULL;
    struct stat found;
    if (!text)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "is not a string, expected the path of a picture");
    if (!dot || (strcmp(dot, ".exr") != 0 && strcmp(dot, ".hdr") != 0))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "is \"%.100s\", expected a path that ends in .exr or .hdr", text);
    if (!resolve(at, options, environment->path, status))
        return false;
    return (stat(environment->path, &found) == 0 && S_ISREG(found.st_mode)) ||
           io_json_fail(at, DIPOLE_BAD_VALUE, status, "is \"%.100s\", which is no file", text);
}

static bool read_environment(const struct io_json *at, const struct io_scene_options *options,
                             struct io_scene *scene, dipole_status *status)
{
    static const char *const known[] = { "image", "scale", "rotate_deg", NULL };
    const struct io_json image = io_json_member(at, "image");
    double rotate_deg = 0;
    if (!at->value)
        return true;
    scene->environment = (struct io_environment){ .rgb = { 1, 1, 1 } };
    if (!io_json_check_object(at, known, 1, status) ||
        !io_scene_get_rgb(at, "scale", scene->environment.rgb, status) ||
        !io_json_get_number(at, "rotate_deg", -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX, &rotate_deg,
                            status) ||
        !find_picture(&image, options, &scene->environment, status))
        return false;
    scene->environment.rotate_rad = rotate_deg * IO_SCENE_RAD_PER_DEG;
    scene->has_environment = true;
    return true;
}

static bool read_lights(const struct io_json *at, double unit_mm, struct io_scene *scene,
                        dipole_status *status)
{
    size_t count;
    if (!io_json_check_array(at, scene->has_environment ? 0 : 1, IO_SCENE_LIGHT_LIMIT, &count, status))
        return false;
    scene->lights = count > 0 ? calloc(count, sizeof *scene->lights) : NULL;
    if (count > 0 && !scene->lights)
        return io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    for (; scene->light_count < count; scene->light_count++) {
        const struct io_json light = io_json_element(at, scene->light_count);
        if (!io_scene_read_light(&light, unit_mm, &scene->lights[scene->light_count], status))
            return false;
    }
    return true;
}

/* Counted first: its mesh is ours, also where reading fails. */
static bool read_element(const struct io_json *at, const struct io_scene_options *options, double unit_mm,
                         struct io_scene *scene, size_t *triangle_count, dipole_status *status)
{
    if (io_scene_is_blocker(at)) {
        struct io_blocker *const blocker = &scene->blockers[scene->blocker_count++];
        if (!io_scene_read_blocker(at, options, unit_mm, scene->frames.count, blocker, status))
            return false;
        *triangle_count += (blocker->motion ? blocker->motion->meshes[0] : blocker->mesh)->triangle_count;
        return true;
    }
    struct io_object *const object = &scene->objects[scene->object_count++];
    if (!read_object(at, options, scene, unit_mm, object, status))
        return false;
    *triangle_count += io_scene_triangle_count(object);
    return true;
}

static bool read_objects(const struct io_json *at, const struct io_scene_options *options, double unit_mm,
                         struct io_scene *scene, dipole_status *status)
{
    size_t count, triangle_count = 0;
    if (!io_json_check_array(at, 1, OBJECT_LIMIT, &count, status))
        return false;
    scene->objects = calloc(count, sizeof *scene->objects);
    scene->blockers = calloc(count, sizeof *scene->blockers);
    if (!scene->objects || !scene->blockers)
        return io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(at, i);
        if (!read_element(&element, options, unit_mm, scene, &triangle_count, status))
            return false;
        if (triangle_count > IO_MESH_TRIANGLE_LIMIT)
            return io_json_fail(&element, DIPOLE_BAD_VALUE, status,
                                "brings the scene to %zu triangles, expected at most %u", triangle_count,
                                IO_MESH_TRIANGLE_LIMIT);
    }
    if (scene->object_count == 0)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "are all without material, expected one that is seen");
    io_scene_pose_objects(scene, 0);
    return true;
}

static bool fill_scene(const struct io_json *root, const struct io_scene_options *options,
                       struct io_scene *scene, dipole_status *status)
{
    static const char *const known[] = { "lights",     "objects",     "camera",      "cameras", "unit_mm",
                                         "background", "exposure_ev", "environment", "frames",  NULL };
    const struct io_json environment = io_json_member(root, "environment"),
                         lights = io_json_member(root, "lights"), frames = io_json_member(root, "frames"),
                         objects = io_json_member(root, "objects");
    double unit_mm = 1;
    if (!io_json_check_object(root, known, 2, status) ||
        !io_json_get_number(root, "unit_mm", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX, &unit_mm, status) ||
        !io_scene_get_rgb(root, "background", scene->background, status) ||
        !io_json_get_number(root, "exposure_ev", -100, 100, &scene->exposure_ev, status) ||
        !io_scene_read_cameras(root, options->camera_name, unit_mm, &scene->camera, status))
        return false;
    if (options->width_px > 0)
        scene->camera.width_px = options->width_px;
    if (options->height_px > 0)
        scene->camera.height_px = options->height_px;
    return read_environment(&environment, options, scene, status) &&
           read_lights(&lights, unit_mm, scene, status) && io_scene_read_frames(&frames, scene, status) &&
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
    *scene_out = scene;
    return true;
}

void io_scene_destroy(struct io_scene *scene)
{
    if (!scene)
        return;
    for (size_t i = 0; i < scene->object_count; i++)
        io_scene_end_shape(scene->objects[i].mesh, scene->objects[i].motion);
    for (size_t i = 0; i < scene->blocker_count; i++)
        io_scene_end_shape(scene->blockers[i].mesh, scene->blockers[i].motion);
    free(scene->objects);
    free(scene->blockers);
    free(scene->lights);
    free(scene->frames.lights);
    free(scene);
}
