/* io/scene_motion.c, scene_sequence.c: objects that change from frame to frame, as files say. */
#include "check.h"

#include "io/scene_file.h"

#include <stdlib.h>
#include <string.h>

#define MATERIAL                                                                                           \
    "{\"name\": \"m\", \"eta\": 1.3, \"sigma_a_per_mm\": [0, 1, 2], \"sigma_s_prime_per_mm\": [1, 2, 3]}"

static const char PATH[] = "motion.json";
static const double PI = 3.14159265358979323846;

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* The object stands on line 4. */
static void write_scene(const char *frames, const char *object)
{
    char text[4096];
    snprintf(text, sizeof text,
             "{\"camera\": {\"eye\": [0, 0, 10], \"target\": [0, 0, 0]},\n\"lights\": [{\"kind\": "
             "\"directional\", \"direction\": [0, 0, -1]}],\n%s\"objects\": [\n{\"material\": " MATERIAL
             ",\n%s}]}\n",
             frames, object);
    write_text(PATH, text);
}

static struct io_scene *read_scene(const char *frames, const char *object)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    write_scene(frames, object);
    if (!io_scene_read(PATH, NULL, &scene, &status))
        fail_msg("%d:%d: %s", status.line, status.column, status.message);
    return scene;
}

static void assert_refused(const char *object, const char *expected)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    char found[1024];
    write_scene("\"frames\": {\"count\": 10}, ", object);
    assert_false(io_scene_read(PATH, NULL, &scene, &status));
    assert_null(scene);
    snprintf(found, sizeof found, "%d:%d: %s", status.line, status.column, status.message);
    assert_string_equal(found, expected);
}

/* A tetrahedron so large; the triangles of that of side 2 stand in another order. */
static void write_mesh(const char *path, int size)
{
    char text[256];
    snprintf(text, sizeof text, "v 0 0 0\nv %d 0 0\nv 0 %d 0\nv 0 0 %d\n%s", size, size, size,
             size == 2 ? "f 2 3 4\nf 1 4 3\nf 1 2 4\nf 1 3 2\n" : "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    write_text(path, text);
}

#define TEN "\"frames\": {\"count\": 10}, "
#define CUBE "\"primitive\": \"cube\", \"detail\": 8, "
#define ALL_DEFORMS                                                                                        \
    "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 90], \"path\": \"there_and_back\"}, "           \
    "{\"kind\": \"bend\", \"axis\": [1, 0, 0], \"toward\": [0, 1, 0], \"angle_deg\": [10, 40], "           \
    "\"path\": \"there_and_back\"}, {\"kind\": \"wave\", \"amplitude\": 0.2, \"wavelength\": 1.5, "        \
    "\"cycles\": 2, \"phase_deg\": 30}], \"motion\": {\"turn_deg\": 720, \"axis\": [1, 1, 0]}"

static float *copy_positions(const struct io_mesh *mesh)
{
    float *const copy = malloc(3 * mesh->vertex_count * sizeof *copy);
    assert_non_null(copy);
    memcpy(copy, mesh->positions, 3 * mesh->vertex_count * sizeof *copy);
    return copy;
}

/* Oracle: bytes. A frame is the same whatever was set before, and a loop ends where it began. */
static void frames_do_not_depend_on_order_and_loops_close(void **state)
{
    (void)state;
    struct io_scene *const scene = read_scene(TEN, CUBE ALL_DEFORMS);
    const struct io_mesh *const mesh = scene->objects[0].mesh;
    const size_t size = 3 * mesh->vertex_count * sizeof *mesh->positions;
    float *frames[11];
    for (int f = 0; f <= 10; f++) {
        io_scene_set_frame(scene, f);
        frames[f] = copy_positions(scene->objects[0].mesh);
        assert_true(f == 0 || f == 10 || memcmp(frames[0], frames[f], size) != 0);
    }
    assert_memory_equal(frames[0], frames[10], size);
    for (int i = 0; i < 40; i++) {
        const int f = i * 7 % 11;
        io_scene_set_frame(scene, f);
        assert_memory_equal(scene->objects[0].mesh->positions, frames[f], size);
    }
    for (int f = 0; f <= 10; f++)
        free(frames[f]);
    io_scene_destroy(scene);
}

/* Oracle: bytes. Amounts of 0 leave the mesh as it was without them; so does the first frame of a motion.
 */
static void amounts_of_zero_leave_the_mesh(void **state)
{
    (void)state;
    struct io_scene *const still = read_scene(TEN, CUBE "\"roughness\": 0.3");
    struct io_scene *const zero = read_scene(
        TEN, CUBE "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 90]}, {\"kind\": \"bend\", "
                  "\"angle_deg\": 0}], \"motion\": {\"turn_deg\": 90, \"translate\": [1, 2, 3]}");
    const struct io_mesh *const a = still->objects[0].mesh, *const b = zero->objects[0].mesh;
    assert_null(still->objects[0].motion);
    assert_int_equal(a->vertex_count, b->vertex_count);
    assert_memory_equal(a->positions, b->positions, 3 * a->vertex_count * sizeof *a->positions);
    assert_memory_equal(a->normals, b->normals, 3 * a->vertex_count * sizeof *a->normals);
    assert_memory_equal(a->indices, b->indices, 3 * a->triangle_count * sizeof *a->indices);
    assert_memory_equal(still->min_mm, zero->min_mm, sizeof still->min_mm);
    io_scene_destroy(still);
    io_scene_destroy(zero);
}

/* Oracle: by hand, in a unit of 10 mm: half of a half turn about z through (1, 0, 0) and of a step. */
static void motion_turns_about_a_point_and_steps(void **state)
{
    (void)state;
    struct io_scene *const scene =
        read_scene("\"unit_mm\": 10, \"frames\": {\"count\": 10}, ",
                   CUBE "\"motion\": {\"axis\": [0, 0, 2], \"point\": [1, 0, 0], \"turn_deg\": 180, "
                        "\"translate\": [0, 0, 4]}");
    io_scene_set_frame(scene, 5); /* x, y becomes 1 - y, x - 1 */
    assert_true(fabs((double)scene->objects[0].mesh->min[0] - 0) < 1e-5);
    assert_true(fabs((double)scene->objects[0].mesh->max[0] - 20) < 1e-5);
    assert_true(fabs((double)scene->objects[0].mesh->min[1] + 20) < 1e-5);
    assert_true(fabs((double)scene->objects[0].mesh->max[1] - 0) < 1e-5);
    assert_true(fabs((double)scene->objects[0].mesh->min[2] - 10) < 1e-5);
    assert_true(fabs(scene->max_mm[2] - 30) < 1e-5);
    io_scene_destroy(scene);
}

static double middle_x(struct io_scene *scene, int frame)
{
    io_scene_set_frame(scene, frame);
    return 0.5 * (scene->min_mm[0] + scene->max_mm[0]);
}

/* Oracle: keys are met; linear between them; Catmull-Rom by its textbook weights half way between keys that
 * are equally far apart: (-p0 + 9 p1 + 9 p2 - p3)/16. Outside it stands still. */
static void keys_are_interpolated(void **state)
{
    (void)state;
    const char *const keys =
        CUBE "\"motion\": {\"keys\": [{\"frame\": 1, \"translate\": [3, 0, 0]}, {\"frame\": "
             "3, \"translate\": [7, 0, 0]}, {\"frame\": 5, \"translate\": [-2, 0, 0]}, "
             "{\"frame\": 7}]%s}";
    const double at[4] = { 3, 7, -2, 0 };
    for (int is_smooth = 0; is_smooth < 2; is_smooth++) {
        char text[512];
        snprintf(text, sizeof text, keys, is_smooth ? ", \"interpolate\": \"catmull_rom\"" : "");
        struct io_scene *const scene = read_scene(TEN, text);
        for (int k = 0; k < 4; k++)
            assert_true(fabs(middle_x(scene, 1 + 2 * k) - at[k]) < 1e-6);
        assert_true(fabs(middle_x(scene, 0) - 3) < 1e-6);
        assert_true(fabs(middle_x(scene, 9)) < 1e-6);
        const double expected =
            is_smooth ? (-at[0] + 9 * at[1] + 9 * at[2] - at[3]) / 16 : (at[1] + at[2]) / 2;
        assert_true(fabs(middle_x(scene, 4) - expected) < 1e-6);
        io_scene_destroy(scene);
    }
}

/* Oracle: io/deform.c, told by hand what the file says: half of the way there, in mm; and its lengths. */
static void deformations_are_as_the_file_says(void **state)
{
    (void)state;
    struct io_scene *const scene = read_scene(
        "\"unit_mm\": 10, \"frames\": {\"count\": 10}, ", CUBE
        "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 60]}, {\"kind\": \"wave\", \"amplitude\": "
        "[0.1, 0.3], \"path\": \"there_and_back\", \"wavelength\": 2, \"axis\": [1, 0, 0], \"toward\": "
        "[1, 1, 0], \"origin\": [0.5, 0, 0], \"cycles\": 1, \"phase_deg\": 90}]");
    io_scene_set_frame(scene, 5);
    const struct io_pose *const pose = &scene->objects[0].pose;
    assert_int_equal(pose->deform_count, 2);
    assert_false(pose->is_moved);
    assert_close(pose->deforms[0].rate_rad_per_mm, PI / 6 / 20, 1e-14, "twist: 30 degrees over 20 mm");
    const struct io_deform *const wave = &pose->deforms[1];
    assert_close(wave->rate_rad_per_mm, 2 * PI / 20, 1e-14, "wave");
    assert_close(wave->amplitude_mm, 3, 1e-14, "wave");
    assert_close(wave->phase_rad, -PI / 2, 1e-14, "90 + 180 degrees");
    assert_close(wave->origin_mm[0], 5, 1e-14, "origin");
    assert_true(wave->toward[0] == 0 && wave->toward[1] == 1);
    for (size_t v = 0; v < scene->objects[0].rest->vertex_count; v++) {
        double p[3], n[3];
        for (size_t k = 0; k < 3; k++) {
            p[k] = (double)scene->objects[0].rest->positions[3 * v + k];
            n[k] = (double)scene->objects[0].rest->normals[3 * v + k];
        }
        io_pose_apply(pose, p, n);
        for (size_t k = 0; k < 3; k++) {
            assert_true((float)p[k] == scene->objects[0].mesh->positions[3 * v + k]);
            assert_true((float)n[k] == scene->objects[0].mesh->normals[3 * v + k]);
        }
    }
    assert_true(io_object_stretch(&scene->objects[0]) > 1 && io_object_stretch(&scene->objects[0]) < 2);
    io_scene_destroy(scene);
}

/* Oracle: tetrahedra of sides 1, 2, 3, by name and by number; fit_height is worked out from the first. */
static void sequences_give_each_frame_its_mesh(void **state)
{
    (void)state;
    write_mesh("walk_08.obj", 1);
    write_mesh("walk_09.obj", 2);
    write_mesh("walk_10.obj", 3);
    static const char *const ways[] = {
        "\"transform\": {\"fit_height\": 10}, \"mesh_sequence\": {\"pattern\": \"walk_%02d.obj\", "
        "\"first\": 8, "
        "\"count\": 3}",
        "\"transform\": {\"fit_height\": 10}, \"mesh_sequence\": [\"walk_08.obj\", \"walk_09.obj\", "
        "\"walk_10.obj\"], \"motion\": {\"turn_deg\": 360}",
    };
    for (int way = 0; way < 2; way++) {
        struct io_scene *const scene = read_scene(TEN, ways[way]);
        assert_true(io_object_motion_kinds(&scene->objects[0]).is_sequence);
        for (int i = 0; i < 25; i++) {
            const int frame = i * 3 % 10;
            io_scene_set_frame(scene, frame);
            assert_close(scene->max_mm[1] - scene->min_mm[1], 10 * (1 + frame % 3), 1e-6, "frame %d",
                         frame);
            const struct io_mesh *const mesh = scene->objects[0].mesh;
            assert_int_equal(mesh->triangle_count, 4);
            assert_memory_equal(mesh->indices, scene->objects[0].rest->indices, 12 * sizeof *mesh->indices);
        }
        io_scene_destroy(scene);
    }
}

/* Oracle: the messages, word by word. */
static void wrong_motions_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *object, *expected;
    } cases[] = {
        { CUBE "\"deform\": 3", "5:45: objects[0].deform is a number, expected an array" },
        { CUBE "\"deform\": []", "5:45: objects[0].deform has 0 elements, expected 1 to 4" },
        { CUBE "\"deform\": [{}]",
          "5:46: objects[0].deform[0].kind is missing, expected twist, bend or wave" },
        { CUBE "\"deform\": [{\"kind\": \"twist\"}]",
          "5:46: objects[0].deform[0].angle_deg is missing, it is required here" },
        { CUBE "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": 40000}]",
          "5:77: objects[0].deform[0].angle_deg is 40000, expected -36000 to 36000" },
        { CUBE "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": 4, \"toward\": [1, 0, 0]}]",
          "5:80: unknown key \"toward\" in objects[0].deform[0], expected kind, angle_deg, length, axis, "
          "origin, "
          "path" },
        { CUBE "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": 4, \"axis\": [0, 0, 0]}]",
          "5:88: objects[0].deform[0].axis is [0, 0, 0], expected a direction" },
        { CUBE "\"deform\": [{\"kind\": \"bend\", \"angle_deg\": 200}]",
          "5:76: objects[0].deform[0].angle_deg is 200 over 2 mm, which bends the mesh, 1 mm thick to the "
          "inside, "
          "into itself, expected less than 114.6" },
        { CUBE "\"deform\": [{\"kind\": \"bend\", \"angle_deg\": 20, \"toward\": [0, 3, 0]}]",
          "5:90: objects[0].deform[0].toward is parallel to axis, expected another direction" },
        { CUBE "\"deform\": [{\"kind\": \"wave\", \"amplitude\": 1}]",
          "5:46: objects[0].deform[0].wavelength is missing, it is required here" },
        { CUBE "\"motion\": {\"turn\": 3}", "5:46: unknown key \"turn\" in objects[0].motion, expected "
                                            "turn_deg, translate, axis, point, path" },
        { CUBE "\"motion\": {\"keys\": [{\"frame\": 0}]}",
          "5:54: objects[0].motion.keys has 1 element, expected 2 to 1000" },
        { CUBE "\"motion\": {\"keys\": [{\"frame\": 4}, {\"frame\": 4}]}",
          "5:79: objects[0].motion.keys[1].frame is 4, expected more than that of the key before, 4" },
        { CUBE "\"motion\": {\"keys\": [{\"frame\": 4}, {\"frame\": 5}], \"turn_deg\": 3}",
          "5:84: unknown key \"turn_deg\" in objects[0].motion, expected keys, axis, point, interpolate" },
        { CUBE "\"mesh_sequence\": [\"walk_08.obj\"]",
          "5:52: objects[0].mesh_sequence stands beside primitive, expected one of the two" },
        { "\"mesh_sequence\": [\"walk_08.obj\", \"none.obj\"]",
          "5:34: objects[0].mesh_sequence[1] path \"none.obj\" cannot be read: No such file or directory" },
        { "\"mesh_sequence\": [\"walk_08.obj\", 3]",
          "5:34: objects[0].mesh_sequence[1] is not a string, expected the path of a mesh file" },
        { "\"mesh_sequence\": {\"pattern\": \"walk_%s.obj\", \"count\": 3}",
          "5:30: objects[0].mesh_sequence.pattern is \"walk_%s.obj\", expected a path with one %d, or %04d "
          "for "
          "leading zeros" },
        { "\"mesh_sequence\": {\"pattern\": \"walk_%02d%d.obj\", \"count\": 3}",
          "5:30: objects[0].mesh_sequence.pattern is \"walk_%02d%d.obj\", expected a path with one %d, or "
          "%04d "
          "for leading zeros" },
        { "\"mesh_sequence\": {\"pattern\": \"walk_%02d.obj\", \"first\": 8, \"count\": 1001}",
          "5:68: objects[0].mesh_sequence.count is 1001, expected 1 to 1000" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_refused(cases[i].object, cases[i].expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_do_not_depend_on_order_and_loops_close),
        cmocka_unit_test(amounts_of_zero_leave_the_mesh),
        cmocka_unit_test(motion_turns_about_a_point_and_steps),
        cmocka_unit_test(keys_are_interpolated),
        cmocka_unit_test(deformations_are_as_the_file_says),
        cmocka_unit_test(sequences_give_each_frame_its_mesh),
        cmocka_unit_test(wrong_motions_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
