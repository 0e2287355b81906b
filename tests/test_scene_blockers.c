/* io/scene_blockers.c, and lights with a size. */
#include "check.h"
#include "io/scene_file.h"

#include <string.h>

#define HEAD "{\n\"camera\": {\"eye\": [0, 0, 10], \"target\": [0, 0, 0]}, \"unit_mm\": 2,\n"
#define LIGHT "{\"kind\": \"directional\", \"direction\": [0, -1, 0]}"
#define SEEN "{\"primitive\": \"cube\", \"detail\": 4, \"material\": \"marble\"}"

static void write_scene(const char *lights, const char *objects)
{
    FILE *const file = fopen("scene.json", "w");
    assert_non_null(file);
    fprintf(file, HEAD "\"lights\": [%s],\n\"objects\": [%s]\n%s}\n", lights, objects,
            strstr(objects, "\"motion\": {") ? ", \"frames\": {\"count\": 10}" : "");
    assert_int_equal(fclose(file), 0);
}

static struct io_scene *read_scene(const char *lights, const char *objects)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    write_scene(lights, objects);
    if (!io_scene_read("scene.json", NULL, &scene, &status))
        fail_msg("%d:%d: %s", status.line, status.column, status.message);
    return scene;
}

static void assert_rgb(const double found[3], double r, double g, double b)
{
    assert_true(found[0] == r && found[1] == g && found[2] == b);
}

/* Oracle: what the file says, in mm. */
static void every_key_arrives(void **state)
{
    (void)state;
    struct io_scene *const scene =
        read_scene("{\"kind\": \"directional\", \"direction\": [0, -1, 0], \"size_deg\": 90},"
                   "{\"kind\": \"point\", \"position\": [1, 2, 3], \"size\": 4},"
                   "{\"kind\": \"spot\", \"position\": [1, 2, 3], \"direction\": [0, 0, 2], \"cone_deg\": "
                   "90, \"size\": 1}",
                   "{\"name\": \"pane\", \"primitive\": \"slab\", \"detail\": 4, \"opacity\": [0, 0.5, 1], "
                   "\"sheet\": true}," SEEN ","
                   "{\"primitive\": \"sphere\", \"detail\": 4, \"extinction_per_mm\": 3},"
                   "{\"primitive\": \"sphere\", \"detail\": 4, \"extinction_of\": \"marble\"},"
                   "{\"particles\": {\"count\": 7, \"radius\": 0.1}, \"opacity\": 0.3, \"transform\": "
                   "{\"scale\": [2, 2, 2]}},"
                   "{\"fibres\": {\"count\": 3, \"radius\": 0.01, \"segments\": 5}, \"opacity\": 1}");
    assert_int_equal(scene->object_count, 1);
    assert_int_equal(scene->blocker_count, 5);
    assert_close(scene->lights[0].size_rad, 3.14159265358979323846 / 2, 1e-15, "size of a sky");
    assert_true(scene->lights[1].size_mm == 8 && !scene->lights[1].is_spot);
    assert_true(scene->lights[2].size_mm == 2 && scene->lights[2].is_spot &&
                scene->lights[2].cone_blend == 0.15);
    assert_close(scene->lights[2].cone_rad, 3.14159265358979323846 / 2, 1e-15, "cone");
    assert_rgb(scene->lights[2].direction, 0, 0, 1);
    const struct io_blocker *const b = scene->blockers;
    assert_string_equal(b[0].name, "pane");
    assert_rgb(b[0].opacity, 0, 0.5, 1);
    assert_true(b[0].is_sheet && !b[0].has_extinction && b[0].mesh->max[0] == 2);
    assert_rgb(b[1].extinction_per_mm, 3, 3, 3);
    assert_true(b[1].has_extinction && !b[1].is_sheet);
    assert_rgb(b[2].extinction_per_mm, 0.0021 + 2.19, 0.0041 + 2.62, 0.0071 + 3.00);
    assert_int_equal(b[3].mesh->vertex_count, 7);
    assert_int_equal(b[3].mesh->triangle_count, 0);
    assert_close(b[3].particle_mm, 0.4, 1e-15, "radius: 0.1, scaled by 2, of 2 mm");
    assert_int_equal(b[4].mesh->triangle_count, 3 * 32);
    assert_true(scene->max_mm[0] == 2); /* of what is seen */
    io_scene_destroy(scene);
}

/* Oracle: docs/formats.md. */
static void wrong_blockers_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *lights, *objects, *expected;
    } cases[] = {
        { LIGHT, "{\"primitive\": \"cube\", \"opacity\": 1}",
          "4:12: objects are all without material, expected one that is seen" },
        { LIGHT, SEEN ", {\"primitive\": \"cube\", \"opacity\": 1.5}",
          "4:104: objects[1].opacity is 1.5, expected 0 to 1" },
        { LIGHT, SEEN ", {\"primitive\": \"cube\", \"opacity\": [0, 1]}",
          "4:104: objects[1].opacity has 2 elements, expected an array of 3 numbers" },
        { LIGHT, SEEN ", {\"primitive\": \"cube\", \"opacity\": 1, \"extinction_per_mm\": 1}",
          "4:104: objects[1].opacity stands beside another, expected one of opacity, extinction_per_mm and "
          "extinction_of" },
        { LIGHT, SEEN ", {\"particles\": {\"count\": 1, \"radius\": 1}}",
          "4:71: objects[1] has no opacity, expected opacity, extinction_per_mm or extinction_of" },
        { LIGHT, SEEN ", {\"opacity\": 1}",
          "4:71: objects[1].mesh is missing, expected it, primitive, particles or fibres" },
        { LIGHT, SEEN ", {\"opacity\": 1, \"particles\": {\"count\": 0, \"radius\": 1}}",
          "4:109: objects[1].particles.count is 0, expected 1 to 4e+06" },
        { LIGHT,
          SEEN ", {\"opacity\": 1, \"primitive\": \"cube\", \"particles\": {\"count\": 1, \"radius\": 1}}",
          "4:120: objects[1].particles stands beside another shape, expected one of mesh, primitive, "
          "particles and fibres" },
        { LIGHT, SEEN ", {\"extinction_per_mm\": 1, \"primitive\": \"cube\", \"sheet\": true}",
          "4:126: objects[1].sheet is of solids with an extinction alone, expected opacity for thin "
          "blockers" },
        { LIGHT,
          SEEN ", {\"opacity\": 1, \"fibres\": {\"count\": 1000000, \"radius\": 1, \"segments\": 100}}",
          "4:96: objects[1].fibres asks for too much: 602000000 triangles are more than the 20000000 that "
          "a mesh may have" },
        { LIGHT, SEEN ", {\"opacity\": 1, \"roughness\": 3}",
          "4:86: unknown key \"roughness\" in objects[1], expected opacity, extinction_per_mm, "
          "extinction_of, mesh, primitive, detail, particles, fibres, transform, sheet, name, deform, "
          "motion" },
        { LIGHT, SEEN ", {\"opacity\": 1, \"primitive\": \"cube\", \"motion\": 3}",
          "4:117: objects[1].motion is a number, expected an object" },
        { LIGHT, SEEN ", {\"opacity\": 1, \"particles\": {\"count\": 1, \"radius\": 1}, \"deform\": []}",
          "4:136: objects[1].deform has 0 elements, expected 1 to 4" },
        { "{\"kind\": \"directional\", \"direction\": [0, -1, 0], \"size_deg\": 91}", SEEN,
          "3:73: lights[0].size_deg is 91, expected 0 to 90" },
        { "{\"kind\": \"point\", \"position\": [0, -1, 0], \"size\": -1}", SEEN,
          "3:62: lights[0].size is -1, expected 0 to 1e+06" },
        { "{\"kind\": \"spot\", \"position\": [0, -1, 0], \"direction\": [0, 0, 0], \"cone_deg\": 9}", SEEN,
          "3:66: lights[0].direction is [0, 0, 0], expected a direction" },
        { "{\"kind\": \"spot\", \"position\": [0, -1, 0], \"direction\": [0, 0, 1], \"cone_deg\": 180}",
          SEEN, "3:89: lights[0].cone_deg is 180, expected 0.1 to 175" },
    };
    int wrong_count = 0;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct io_scene *scene;
        dipole_status status = { 0 };
        char found[512];
        write_scene(cases[i].lights, cases[i].objects);
        assert_false(io_scene_read("scene.json", NULL, &scene, &status));
        assert_null(scene);
        snprintf(found, sizeof found, "%d:%d: %s", status.line, status.column, status.message);
        if (strcmp(found, cases[i].expected) != 0) {
            print_error("found    %s\nexpected %s\n", found, cases[i].expected);
            wrong_count++;
        }
    }
    assert_int_equal(wrong_count, 0);
}

/* Oracle: what was written reads back the same; untouched blockers stay where they stand among the objects.
 */
static void blockers_and_sizes_are_written(void **state)
{
    (void)state;
    struct io_scene *const scene = read_scene(
        "{\"kind\": \"spot\", \"position\": [1, 2, 3], \"direction\": [0, 0, 2], \"cone_deg\": 40}",
        "{\"primitive\": \"cube\", \"detail\": 4, \"opacity\": 0.5}," SEEN);
    scene->lights[0].size_mm = 6;
    scene->objects[0].roughness = 0.7;
    const struct io_light sun = { .kind = IO_LIGHT_DIRECTIONAL,
                                  .direction = { 0, 0, -1 },
                                  .size_rad = 0.25 };
    assert_true(io_scene_add_light(scene, &sun, NULL));
    assert_true(io_scene_write(scene, &(struct io_scene_options){ .width_px = 0 }, "written.json", NULL));
    struct io_scene *again;
    assert_true(io_scene_read("written.json", NULL, &again, NULL));
    assert_true(again->lights[0].size_mm == 6 && again->lights[0].is_spot);
    assert_close(again->lights[0].cone_rad, scene->lights[0].cone_rad, 1e-15, "cone");
    assert_close(again->lights[1].size_rad, 0.25, 1e-15, "size of the new light");
    assert_true(again->objects[0].roughness == 0.7 && again->blocker_count == 1);
    assert_rgb(again->blockers[0].opacity, 0.5, 0.5, 0.5);
    io_scene_destroy(again);
    io_scene_destroy(scene);
}

/* Oracle: an object of the same shape with the same keys (test_scene_motion.c), in the order of frames and
 * back; what is moved alone is moved by hand. */
static void blockers_move_as_objects_do(void **state)
{
    (void)state;
#define MOVES                                                                                              \
    "\"primitive\": \"torus\", \"detail\": 8, \"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, "      \
    "90]}], "                                                                                              \
    "\"motion\": {\"keys\": [{\"frame\": 0}, {\"frame\": 8, \"turn_deg\": 90, \"translate\": [1, 2, "      \
    "3]}], "                                                                                               \
    "\"axis\": [1, 0, 0]}"
    struct io_scene *const scene =
        read_scene(LIGHT, "{\"material\": \"marble\", " MOVES "}, {\"opacity\": 0.5, " MOVES "},"
                          "{\"opacity\": 1, \"particles\": {\"count\": 5, \"radius\": 0.1}, \"motion\": "
                          "{\"translate\": [10, 0, 0]}}");
    const struct io_blocker *const moved = &scene->blockers[0], *const dust = &scene->blockers[1];
    float first_mm[15];
    memcpy(first_mm, dust->mesh->positions, sizeof first_mm);
    static const int frames[] = { 0, 3, 9, 0 };
    for (size_t f = 0; f < sizeof frames / sizeof *frames; f++) {
        io_scene_set_frame(scene, frames[f]);
        const struct io_mesh *const expected = scene->objects[0].mesh, *const found = moved->mesh;
        assert_int_equal(found->vertex_count, expected->vertex_count);
        assert_memory_equal(found->positions, expected->positions,
                            3 * expected->vertex_count * sizeof(float));
        assert_memory_equal(found->max, expected->max, sizeof found->max);
        for (int i = 0; i < 15; i++) /* 10 units of 2 mm over 10 frames */
            assert_float_equal(dust->mesh->positions[i],
                               first_mm[i] + (i % 3 == 0 ? 2.0f * (float)frames[f] : 0), 1e-5);
    }
    io_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_arrives),
        cmocka_unit_test(wrong_blockers_are_refused),
        cmocka_unit_test(blockers_and_sizes_are_written),
        cmocka_unit_test(blockers_move_as_objects_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
