/* A scene is written by changing the document that it was read from: what nobody touched stays as it was.
 */
#include "io/file.h"
#include "io/scene_internal.h"

#include <libgen.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The document as it was read, and the copy that is changed. */
struct edit {
    const struct io_scene *scene;
    const struct io_scene_options *options;
    struct io_json root;
    json_t *copy;
    double unit_mm;
};

/* ---- values -------------------------------------------------------------------------------------- */

static bool is_same(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static json_t *vector_of(const double v[3], double unit)
{
    return json_pack("[fff]", v[0] / unit, v[1] / unit, v[2] / unit);
}

/* value may be NULL, because it could not be made. */
static bool set(json_t *object, const char *key, json_t *value, dipole_status *status)
{
    return json_object_set_new(object, key, value) == 0 ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %s of a scene", key);
}

static bool set_vector(json_t *object, const char *key, const double before[3], const double now[3],
                       double unit, dipole_status *status)
{
    return is_same(before, now) || set(object, key, vector_of(now, unit), status);
}

static bool set_number(json_t *object, const char *key, double before, double now, dipole_status *status)
{
    return before == now || set(object, key, json_real(now), status);
}

/* ---- camera -------------------------------------------------------------------------------------- */

/* The camera that was read, among those of the copy. */
static json_t *find_camera(const struct edit *edit)
{
    json_t *const cameras = json_object_get(edit->copy, "cameras");
    if (!cameras)
        return json_object_get(edit->copy, "camera");
    for (size_t i = 0; edit->options->camera_name && i < json_array_size(cameras); i++) {
        json_t *const camera = json_array_get(cameras, i);
        if (strcmp(json_string_value(json_object_get(camera, "name")), edit->options->camera_name) == 0)
            return camera;
    }
    return json_array_get(cameras, 0);
}

static bool change_camera(const struct edit *edit, dipole_status *status)
{
    struct io_camera before;
    const struct io_camera *const now = &edit->scene->camera;
    if (!io_scene_read_cameras(&edit->root, edit->options->camera_name, edit->unit_mm, &before, status))
        return false;
    json_t *const camera = find_camera(edit); /* each has a name: that was just checked */
    const bool has_same_size = before.width_px == now->width_px && before.height_px == now->height_px;
    return set_vector(camera, "eye", before.eye_mm, now->eye_mm, edit->unit_mm, status) &&
           set_vector(camera, "target", before.target_mm, now->target_mm, edit->unit_mm, status) &&
           set_vector(camera, "up", before.up, now->up, 1, status) &&
           (!now->is_orthographic || set_number(camera, "height", before.height_mm / edit->unit_mm,
                                                now->height_mm / edit->unit_mm, status)) &&
           (has_same_size || set(camera, "size", json_pack("[ii]", now->width_px, now->height_px), status));
}

/* ---- lights -------------------------------------------------------------------------------------- */

static bool is_same_light(const struct io_light *a, const struct io_light *b)
{
    return a->kind == b->kind && is_same(a->direction, b->direction) &&
           is_same(a->position_mm, b->position_mm) && is_same(a->rgb, b->rgb) &&
           a->is_stated == b->is_stated && a->size_mm == b->size_mm && a->size_rad == b->size_rad &&
           a->is_spot == b->is_spot && a->cone_rad == b->cone_rad && a->cone_blend == b->cone_blend;
}

static json_t *number_or_null(double value)
{
    return value > 0 ? json_real(value) : NULL;
}

static json_t *light_to_json(const struct io_light *light, double unit_mm)
{
    json_t *const rgb = light->is_stated ? vector_of(light->rgb, 1) : NULL;
    if (light->kind == IO_LIGHT_DIRECTIONAL)
        return json_pack("{s:s, s:o, s:o*, s:o*}", "kind", "directional", "direction",
                         vector_of(light->direction, 1), "irradiance", rgb, "size_deg",
                         number_or_null(light->size_rad / IO_SCENE_RAD_PER_DEG));
    json_t *const size = number_or_null(light->size_mm / unit_mm);
    if (!light->is_spot)
        return json_pack("{s:s, s:o, s:o*, s:o*}", "kind", "point", "position",
                         vector_of(light->position_mm, unit_mm), "intensity", rgb, "size", size);
    return json_pack("{s:s, s:o, s:o, s:f, s:f, s:o*, s:o*}", "kind", "spot", "position",
                     vector_of(light->position_mm, unit_mm), "direction", vector_of(light->direction, 1),
                     "cone_deg", light->cone_rad / IO_SCENE_RAD_PER_DEG, "cone_blend", light->cone_blend,
                     "intensity", rgb, "size", size);
}

/* A light that was not touched stays as it was written, wherever it stands by now. */
static bool change_lights(const struct edit *edit, dipole_status *status)
{
    const struct io_json at = io_json_member(&edit->root, "lights");
    size_t count_before = 0;
    struct io_light before[IO_SCENE_LIGHT_LIMIT];
    if (!io_json_check_array(&at, 0, IO_SCENE_LIGHT_LIMIT, &count_before, status))
        return false;
    json_t *const lights = json_array();
    bool done = lights || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a scene's lights");
    for (size_t i = 0; done && i < count_before; i++) {
        const struct io_json element = io_json_element(&at, i);
        done = io_scene_read_light(&element, edit->unit_mm, &before[i], status);
    }
    for (size_t i = 0; done && i < edit->scene->light_count; i++) {
        const struct io_light *const light = &edit->scene->lights[i];
        size_t k = 0;
        while (k < count_before && !is_same_light(light, &before[k]))
            k++;
        json_t *const json = k < count_before ? json_deep_copy(json_array_get(at.value, k))
                                              : light_to_json(light, edit->unit_mm);
        done = json_array_append_new(lights, json) == 0 ||
               dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a scene's lights");
    }
    if (done)
        return set(edit->copy, "lights", lights, status);
    json_decref(lights);
    return false;
}

static bool change_environment(const struct edit *edit, dipole_status *status)
{
    const struct io_json at = io_json_member(&edit->root, "environment");
    const struct io_environment *const now = &edit->scene->environment;
    json_t *const environment = json_object_get(edit->copy, "environment");
    double rgb[3] = { 1, 1, 1 }, rotate_deg = 0;
    if (!at.value)
        return true;
    if (!io_scene_get_rgb(&at, "scale", rgb, status) ||
        !io_json_get_number(&at, "rotate_deg", -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX, &rotate_deg,
                            status))
        return false;
    const double now_deg = now->rotate_rad / IO_SCENE_RAD_PER_DEG;
    return set_vector(environment, "scale", rgb, now->rgb, 1, status) &&
           (rotate_deg * IO_SCENE_RAD_PER_DEG == now->rotate_rad ||
            set(environment, "rotate_deg", json_real(now_deg), status));
}

/* ---- objects ------------------------------------------------------------------------------------- */

static bool is_same_layer(const dipole_layer *a, const dipole_layer *b)
{
    return a->thickness_mm == b->thickness_mm && a->medium.sigma_a_per_mm == b->medium.sigma_a_per_mm &&
           a->medium.sigma_s_prime_per_mm == b->medium.sigma_s_prime_per_mm &&
           a->medium.eta == b->medium.eta && a->medium.fdr_kind == b->medium.fdr_kind;
}

static bool is_same_material(const struct io_material *a, const struct io_material *b)
{
    bool is_same_so_far =
        strcmp(a->name, b->name) == 0 && a->model == b->model && a->layer_count == b->layer_count;
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        for (size_t i = 0; is_same_so_far && i < a->layer_count; i++)
            is_same_so_far = is_same_layer(&a->layers[c][i], &b->layers[c][i]);
    }
    return is_same_so_far;
}

/* index: in the file. */
static bool change_object(const struct edit *edit, const struct io_json *at, size_t index,
                          size_t object_index, dipole_status *status)
{
    const struct io_object *const now = &edit->scene->objects[object_index];
    const struct io_json material = io_json_member(at, "material");
    json_t *const object = json_array_get(json_object_get(edit->copy, "objects"), index);
    struct io_material before;
    double roughness = IO_SCENE_ROUGHNESS;
    bool has_specular = true;
    if (!io_scene_read_material(&material, edit->options, &before, status) ||
        !io_json_get_number(at, "roughness", 0, 1, &roughness, status) ||
        !io_json_get_bool(at, "specular", &has_specular, status))
        return false;
    return (is_same_material(&before, &now->material) ||
            set(object, "material", io_material_to_json(&now->material, NULL), status)) &&
           set_number(object, "roughness", roughness, now->roughness, status) &&
           (has_specular == now->has_specular ||
            set(object, "specular", json_boolean(now->has_specular), status));
}

/* Blockers stand among the objects, and are never changed. */
static bool change_objects(const struct edit *edit, dipole_status *status)
{
    const struct io_json at = io_json_member(&edit->root, "objects");
    size_t count, object = 0;
    if (!io_json_check_array(&at, 0, SIZE_MAX, &count, status))
        return false;
    const size_t expected = edit->scene->object_count + edit->scene->blocker_count;
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(&at, i);
        object += !io_scene_is_blocker(&element);
    }
    if (count != expected || object != edit->scene->object_count)
        return io_json_fail(&at, DIPOLE_BAD_VALUE, status,
                            "has %zu objects by now, expected the %zu that were read", count, expected);
    object = 0;
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(&at, i);
        if (!io_scene_is_blocker(&element) && !change_object(edit, &element, i, object++, status))
            return false;
    }
    return true;
}

/* ---- files that a scene refers to ---------------------------------------------------------------- */

/* The path if it is a relative one, else NULL. */
static const char *relative(const json_t *value)
{
    const char *const text = json_string_value(value);
    return text && text[0] != '/' ? text : NULL;
}

/* Some relative path in the scene; NULL: there is none. */
static const char *find_relative(json_t *root)
{
    json_t *const objects = json_object_get(root, "objects");
    const char *found = relative(json_object_get(json_object_get(root, "environment"), "image"));
    for (size_t i = 0; !found && i < json_array_size(objects); i++) {
        const json_t *const object = json_array_get(objects, i);
        const char *const named = relative(json_object_get(object, "material"));
        const char *const material = named ? named : relative(json_object_get(object, "extinction_of"));
        found = relative(json_object_get(object, "mesh"));
        if (!found && material && !io_material_is_bundled_name(material))
            found = material;
    }
    return found;
}

static bool find_folder(const char *path, char out[PATH_MAX])
{
    char text[PATH_MAX];
    snprintf(text, sizeof text, "%s", path);
    return realpath(dirname(text), out) != NULL;
}

static bool check_folder(const struct edit *edit, const char *path, dipole_status *status)
{
    const dipole_place place = { .source = path };
    char from[PATH_MAX], to[PATH_MAX];
    const char *const reference = find_relative(edit->copy);
    if (!reference || !find_folder(path, to)) /* a folder that is not there is told of by writing */
        return true;
    return (find_folder(edit->scene->path, from) && strcmp(from, to) == 0) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                       "the scene refers to \"%.60s\" beside it, expected a name in the folder %.80s",
                       reference, from);
}

/* ---- the file ------------------------------------------------------------------------------------ */

static bool write_copy(const struct edit *edit, const char *path, dipole_status *status)
{
    char *const text = io_json_format(edit->copy);
    const bool done = text
                          ? io_file_write(path, text, strlen(text), status)
                          : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a scene's text");
    free(text);
    return done;
}

static bool change_and_write(struct edit *edit, const char *path, dipole_status *status)
{
    double exposure_ev = 0;
    return io_json_get_number(&edit->root, "unit_mm", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX,
                              &edit->unit_mm, status) &&
           io_json_get_number(&edit->root, "exposure_ev", -100, 100, &exposure_ev, status) &&
           set_number(edit->copy, "exposure_ev", exposure_ev, edit->scene->exposure_ev, status) &&
           change_camera(edit, status) && change_lights(edit, status) && change_environment(edit, status) &&
           change_objects(edit, status) && check_folder(edit, path, status) &&
           write_copy(edit, path, status);
}

bool io_scene_write(const struct io_scene *scene, const struct io_scene_options *options, const char *path,
                    dipole_status *status)
{
    static const struct io_scene_options no_options = { 0 };
    struct io_json_document *document = NULL;
    if (!io_json_read(scene->path, &document, status))
        return false;
    struct edit edit = { .scene = scene,
                         .options = options ? options : &no_options,
                         .root = io_json_root(document),
                         .unit_mm = 1 };
    edit.copy = json_deep_copy(edit.root.value);
    const bool done =
        (edit.copy || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a copy of a scene")) &&
        (json_is_object(edit.copy) ||
         io_json_fail(&edit.root, DIPOLE_BAD_VALUE, status, "is not an object, expected a scene")) &&
        change_and_write(&edit, path, status);
    json_decref(edit.copy);
    io_json_destroy(document);
    return done;
}
