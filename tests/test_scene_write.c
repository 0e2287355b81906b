/* io/scene_write.c, scene_lights.c: a scene that is written reads back as it stood. */
#include "check.h"

#include "io/scene_file.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char rich[] =
    "{ \"unit_mm\": 10,\n"
    "  \"cameras\": [{ \"name\": \"front\", \"eye\": [0, 0.1, 9.7], \"target\": [0, 0, 0] },\n"
    "                { \"name\": \"side\", \"eye\": [9, 0, 0], \"target\": [0.3, 0, 0], \"height\": 3 }],\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [1, 2, -3] },\n"
    "             { \"kind\": \"point\", \"position\": [0.1, 5, 0.7], \"intensity\": [1, 2, 3] }],\n"
    "  \"background\": [0.1, 0.2, 0.3],\n"
    "  \"frames\": { \"count\": 7, \"lights_turn_deg\": 30 },\n"
    "  \"objects\": [{ \"name\": \"a\", \"primitive\": \"sphere\", \"detail\": 8, \"material\": \"marble\" "
    "},\n"
    "              { \"mesh\": \"part/one.obj\", \"material\": \"own.json\", \"roughness\": 0.11,\n"
    "                \"transform\": { \"scale\": 2 } },\n"
    "              { \"primitive\": \"torus\", \"detail\": 8, \"material\": { \"name\": \"x\", \"eta\": "
    "1.4,\n"
    "                \"model\": \"beam\", \"layers\": [\n"
    "                { \"thickness_mm\": 0.7, \"sigma_a_per_mm\": [0, 1, 2], \"sigma_s_prime_per_mm\": [1, "
    "2, 3] },\n"
    "                { \"thickness_mm\": \"infinite\", \"sigma_a_per_mm\": [1, 1, 2],\n"
    "                  \"sigma_s_prime_per_mm\": [4, 2, 3] }] } }] }\n";

static void write_text(const char *path, const char *text)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static char *read_text(const char *path)
{
    FILE *const file = fopen(path, "r");
    char *const text = calloc(1, 1 << 16);
    assert_non_null(file);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 16) - 1, file) > 0);
    fclose(file);
    return text;
}

static void write_files(void)
{
    mkdir("part", 0777);
    mkdir("elsewhere", 0777);
    write_text("scene.json", rich);
    write_text("part/one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_text("own.json", "{ \"name\": \"own\", \"eta\": 1.3, \"sigma_a_per_mm\": [0.1, 0.2, 0.3],\n"
                           "  \"sigma_s_prime_per_mm\": [1, 2, 3], \"extras\": { \"a\": 1 } }\n");
}

static struct io_scene *read_scene(const char *path, const struct io_scene_options *options)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    if (!io_scene_read(path, options, &scene, &status))
        fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
    return scene;
}

static void write_scene(const struct io_scene *scene, const struct io_scene_options *options,
                        const char *path)
{
    dipole_status status = { 0 };
    if (!io_scene_write(scene, options, path, &status))
        fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
}

static void assert_vectors(const double found[3], const double expected[3])
{
    for (int k = 0; k < 3; k++) /* a division by the unit, and a multiplication: two roundings */
        assert_close(found[k], expected[k], 1e-15, "%g", expected[k]);
}

static void assert_materials(const struct io_material *found, const struct io_material *expected)
{
    assert_string_equal(found->name, expected->name);
    assert_int_equal(found->model, expected->model);
    assert_int_equal(found->layer_count, expected->layer_count);
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < expected->layer_count; i++) {
            const dipole_layer *const a = &found->layers[c][i], *const b = &expected->layers[c][i];
            assert_true(a->thickness_mm == b->thickness_mm);
            assert_true(a->medium.sigma_a_per_mm == b->medium.sigma_a_per_mm);
            assert_true(a->medium.sigma_s_prime_per_mm == b->medium.sigma_s_prime_per_mm);
            assert_true(a->medium.eta == b->medium.eta);
            assert_int_equal(a->medium.fdr_kind, b->medium.fdr_kind);
        }
    }
}

static void assert_scenes(const struct io_scene *found, const struct io_scene *expected)
{
    const struct io_camera *const a = &found->camera, *const b = &expected->camera;
    assert_vectors(a->eye_mm, b->eye_mm);
    assert_vectors(a->target_mm, b->target_mm);
    assert_vectors(a->up, b->up);
    assert_close(a->height_mm, b->height_mm, 1e-15, "height");
    assert_true(a->fov_y_rad == b->fov_y_rad);
    assert_int_equal(a->width_px, b->width_px);
    assert_int_equal(a->height_px, b->height_px);
    assert_true(found->exposure_ev == expected->exposure_ev);
    assert_vectors(found->background, expected->background);
    assert_int_equal(found->frames.count, expected->frames.count);
    assert_int_equal(found->light_count, expected->light_count);
    for (size_t i = 0; i < expected->light_count; i++) {
        assert_int_equal(found->lights[i].kind, expected->lights[i].kind);
        assert_int_equal(found->lights[i].is_stated, expected->lights[i].is_stated);
        assert_vectors(found->lights[i].direction, expected->lights[i].direction);
        assert_vectors(found->lights[i].position_mm, expected->lights[i].position_mm);
        assert_vectors(found->lights[i].rgb, expected->lights[i].rgb);
    }
    assert_int_equal(found->object_count, expected->object_count);
    for (size_t i = 0; i < expected->object_count; i++) {
        assert_string_equal(found->objects[i].name, expected->objects[i].name);
        assert_true(found->objects[i].roughness == expected->objects[i].roughness);
        assert_int_equal(found->objects[i].has_specular, expected->objects[i].has_specular);
        assert_materials(&found->objects[i].material, &expected->objects[i].material);
    }
}

/* Oracle: JSON itself. Nothing was changed, so the document is the one that was read. */
static void an_untouched_scene_is_the_same_document(void **state)
{
    (void)state;
    write_files();
    struct io_scene *const scene = read_scene("scene.json", NULL);
    write_scene(scene, NULL, "written.json");
    char *const before = read_text("scene.json"), *const after = read_text("written.json");
    json_t *const a = json_loads(before, 0, NULL), *const b = json_loads(after, 0, NULL);
    assert_true(json_equal(a, b));
    json_decref(a);
    json_decref(b);
    free(before);
    free(after);
    io_scene_destroy(scene);
}

static void change_everything(struct io_scene *scene)
{
    struct rng rng = { .seed = 5 };
    for (int k = 0; k < 3; k++) {
        scene->camera.eye_mm[k] = log_uniform(&rng, 1, 100);
        scene->camera.target_mm[k] = -log_uniform(&rng, 1, 100);
        scene->lights[1].position_mm[k] = log_uniform(&rng, 1, 100);
        scene->lights[0].rgb[k] = log_uniform(&rng, 0.1, 10);
    }
    scene->camera.height_mm *= 1.234;
    scene->camera.width_px = 321;
    scene->lights[0].is_stated = true;
    scene->exposure_ev = -1.3;
    for (size_t i = 0; i < scene->object_count; i++) {
        struct io_object *const object = &scene->objects[i];
        object->roughness = 0.2 + 0.1 * (double)i;
        object->has_specular = i == 1;
        object->material.layers[1][0].medium.sigma_a_per_mm = log_uniform(&rng, 0.01, 10);
        object->material.layers[2][0].medium.sigma_s_prime_per_mm = log_uniform(&rng, 0.01, 10);
    }
}

/* Oracle: the scene in memory, every number to the last bit, lengths but for the unit's rounding. */
static void what_was_changed_reads_back(void **state)
{
    (void)state;
    static const char *const cameras[] = { NULL, "front", "side" };
    write_files();
    for (size_t i = 0; i < 3; i++) {
        const struct io_scene_options options = { .camera_name = cameras[i] };
        const struct io_light light = {
            .kind = IO_LIGHT_POINT, .position_mm = { 3, 0.1, -7 }, .rgb = { 0, 0.3, 1e5 }, .is_stated = true
        };
        struct io_scene *const scene = read_scene("scene.json", &options);
        change_everything(scene);
        assert_true(io_scene_add_light(scene, &light, NULL));
        write_scene(scene, &options, "written.json");
        struct io_scene *const found = read_scene("written.json", &options);
        assert_scenes(found, scene);
        io_scene_destroy(found);
        io_scene_destroy(scene);
    }
}

/* Oracle: what the document says: paths and names stay where nothing has changed. */
static void what_was_not_changed_stays_as_it_was_written(void **state)
{
    (void)state;
    write_files();
    struct io_scene *const scene = read_scene("scene.json", NULL);
    scene->objects[0].material.layers[0][0].medium.sigma_a_per_mm = 0.5;
    io_scene_remove_light(scene, 0);
    write_scene(scene, NULL, "written.json");
    char *const text = read_text("written.json");
    json_t *const root = json_loads(text, 0, NULL);
    json_t *const objects = json_object_get(root, "objects");
    assert_true(json_is_object(json_object_get(json_array_get(objects, 0), "material")));
    assert_string_equal(json_string_value(json_object_get(json_array_get(objects, 1), "material")),
                        "own.json");
    assert_string_equal(json_string_value(json_object_get(json_array_get(objects, 1), "mesh")),
                        "part/one.obj");
    json_t *const lights = json_object_get(root, "lights");
    assert_int_equal(json_array_size(lights), 1);
    assert_true(
        json_is_integer(json_array_get(json_object_get(json_array_get(lights, 0), "intensity"), 0)));
    json_decref(root);
    free(text);
    io_scene_destroy(scene);
}

static void assert_refused(const struct io_scene *scene, const char *path, const char *expected)
{
    dipole_status status = { 0 };
    assert_false(io_scene_write(scene, NULL, path, &status));
    if (!strstr(status.message, expected))
        fail_msg("%s", status.message);
}

/* Oracle: docs/formats.md, paths are relative to the file; nothing is written where it cannot be read. */
static void a_scene_is_not_written_where_it_would_not_read(void **state)
{
    (void)state;
    write_files();
    remove("elsewhere/scene.json");
    struct io_scene *const scene = read_scene("scene.json", NULL);
    assert_refused(scene, "elsewhere/scene.json", "refers to \"part/one.obj\" beside it");
    assert_int_not_equal(access("elsewhere/scene.json", F_OK), 0);
    assert_refused(scene, "nowhere/scene.json", "");
    write_text("scene.json", "[]");
    assert_refused(scene, "written.json", "expected a scene");
    write_text("scene.json",
               "{ \"camera\": { \"eye\": [1, 2, 3], \"target\": [0, 0, 0] }, \"lights\": [],\n"
               "  \"objects\": [] }");
    assert_refused(scene, "written.json", "objects has 0 objects by now, expected the 3 that were read");
    remove("scene.json");
    assert_refused(scene, "written.json", "");
    io_scene_destroy(scene);
}

/* Oracle: a list in the test. Frames know as many lights, so that setting one keeps within them. */
static void lights_come_and_go(void **state)
{
    (void)state;
    write_files();
    struct io_scene *const scene = read_scene("scene.json", NULL);
    for (size_t i = 2; i < IO_SCENE_LIGHT_LIMIT; i++) {
        const struct io_light light = { .kind = IO_LIGHT_POINT, .rgb = { (double)i, 1, 1 } };
        assert_true(io_scene_add_light(scene, &light, NULL));
    }
    dipole_status status = { 0 };
    assert_false(io_scene_add_light(scene, &scene->lights[0], &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    for (size_t i = 0; i < 30; i++)
        io_scene_remove_light(scene, i); /* every second one */
    assert_int_equal(scene->light_count, IO_SCENE_LIGHT_LIMIT - 30);
    io_scene_set_frame(scene, 3);
    io_scene_set_frame(scene, 0);
    for (size_t i = 1; i < 30; i++)
        assert_true(scene->lights[i].rgb[0] == (double)(2 * i + 1));
    while (scene->light_count > 0)
        io_scene_remove_light(scene, scene->light_count - 1);
    io_scene_set_frame(scene, 1);
    io_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_untouched_scene_is_the_same_document),
        cmocka_unit_test(what_was_changed_reads_back),
        cmocka_unit_test(what_was_not_changed_stays_as_it_was_written),
        cmocka_unit_test(a_scene_is_not_written_where_it_would_not_read),
        cmocka_unit_test(lights_come_and_go),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
