/* renderer/pose.c: vertices that the shader poses against io/deform.c, and when a solid keeps its sides. */
#include "check.h"

#include "renderer/pose.h"
#include "renderer/renderer.h"

#include <stdlib.h>
#include <string.h>

static const char PATH[] = "pose.json";

#define CUBE "{\"material\": \"marble\", \"primitive\": \"cube\", \"detail\": 5}"

/* A torus between two cubes that stand still, in the fourth frame of ten. */
static struct io_scene *read_scene(const char *motion)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    FILE *const file = fopen(PATH, "w");
    assert_non_null(file);
    fprintf(file,
            "{\"camera\": {\"eye\": [0, 0, 40], \"target\": [0, 0, 0]}, \"lights\": [{\"kind\": "
            "\"directional\", \"direction\": [0, 0, -1]}], \"frames\": {\"count\": 10}, \"objects\": [" CUBE
            ", {\"material\": \"marble\", \"primitive\": \"torus\", \"detail\": 48, \"transform\": "
            "{\"scale\": 9, \"rotate_deg\": [20, 30, 0]}, %s}, " CUBE "]}",
            motion);
    assert_int_equal(fclose(file), 0);
    if (!io_scene_read(PATH, NULL, &scene, &status))
        fail_msg("%d:%d: %s", status.line, status.column, status.message);
    io_scene_set_frame(scene, 4);
    return scene;
}

static const char *const motions[] = {
    "\"deform\": [{\"kind\": \"twist\", \"axis\": [1, 0.3, 0], \"angle_deg\": [0, 200]}]",
    "\"deform\": [{\"kind\": \"bend\", \"axis\": [1, 0, 0], \"toward\": [0, 1, 0], \"angle_deg\": 100}]",
    "\"deform\": [{\"kind\": \"wave\", \"amplitude\": 1.5, \"wavelength\": 8, \"phase_deg\": 50}]",
    "\"motion\": {\"turn_deg\": 200, \"axis\": [1, 1, 0], \"translate\": [3, 0, -4]}",
    ("\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 90]}, {\"kind\": \"wave\", \"amplitude\": 1, "
     "\"wavelength\": 9}], \"motion\": {\"turn_deg\": 200}"),
};
enum { MOTIONS = sizeof motions / sizeof *motions };

static float *read_buffer(const struct render_geometry *geometry, int array, size_t vertex_count)
{
    float *const values = malloc(RENDER_VERTEX_FLOATS * vertex_count * sizeof *values);
    assert_non_null(values);
    glGetNamedBufferSubData(geometry->vertices[array].buffer, 0,
                            (GLsizeiptr)(RENDER_VERTEX_FLOATS * vertex_count * sizeof *values), values);
    for (size_t v = 1; v < vertex_count; v++)
        memmove(values + 3 * v, values + RENDER_VERTEX_FLOATS * v, 3 * sizeof *values);
    return values;
}

/* Oracle: io/deform.c in double, rounded to float. 10 mm are known to 1e-6 mm; each of some ten float steps
 * of a deformation adds as much, and sines of a GPU may be off by 2^-11 of their last digits. Neighbours in
 * the buffer are not touched, and back at rest all bytes are as before. */
static void vertices_are_posed_as_the_library_does(void **state)
{
    (void)state;
    for (size_t m = 0; m < MOTIONS; m++) {
        struct io_scene *const scene = read_scene(motions[m]);
        struct renderer *renderer;
        struct render_geometry geometry;
        dipole_status status;
        if (!render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, &status) ||
            !render_geometry_create(scene, &geometry, &status))
            fail_msg("%s", status.message);
        const struct io_object *const object = &scene->objects[1];
        const size_t first = scene->objects[0].mesh->vertex_count, count = object->mesh->vertex_count,
                     all = 2 * first + count;
        struct render_posed posed = { .first_vertex = first, .vertex_count = count };
        GLuint program;
        float *before[RENDER_VERTEX_ARRAYS];
        for (int a = 0; a < RENDER_VERTEX_ARRAYS; a++)
            before[a] = read_buffer(&geometry, a, all);
        assert_true(render_pose_program_create(&program, NULL));
        for (int again = 0; again < 2; again++) /* from rest each time */
            render_pose_write(program, object, &geometry, &posed);
        double moved_mm = 0;
        for (int a = 0; a < RENDER_VERTEX_ARRAYS; a++) {
            float *const now = read_buffer(&geometry, a, all);
            const float *const expected =
                a == RENDER_VERTEX_POSITION ? object->mesh->positions : object->mesh->normals;
            const double tolerance = a == RENDER_VERTEX_POSITION ? 2e-5 : 4e-6;
            for (size_t i = 0; i < 3 * count; i++) {
                const double error = fabs((double)now[3 * first + i] - (double)expected[i]);
                if (!(error < tolerance))
                    fail_msg("motion %zu, array %d, %zu: %g, expected %g", m, a, i,
                             (double)now[3 * first + i], (double)expected[i]);
                moved_mm = fmax(moved_mm, fabs((double)expected[i] - (double)before[a][3 * first + i]));
            }
            assert_memory_equal(now, before[a], 3 * first * sizeof *now);
            assert_memory_equal(now + 3 * (first + count), before[a] + 3 * (first + count),
                                3 * first * sizeof *now);
            free(now);
        }
        assert_true(moved_mm > 0.1);
        render_pose_undo(&geometry, &posed);
        for (int a = 0; a < RENDER_VERTEX_ARRAYS; a++) {
            float *const now = read_buffer(&geometry, a, all);
            assert_memory_equal(now, before[a], 3 * all * sizeof *now);
            free(now);
            free(before[a]);
        }
        assert_true(render_gl_check(&renderer->errors, "the test", NULL));
        glDeleteProgram(program);
        render_pose_end(&posed);
        render_geometry_destroy(&geometry);
        render_destroy(renderer);
        io_scene_destroy(scene);
    }
}

/* Of the Jacobian of a pose, by differences. */
static double determinant_at(const struct io_pose *pose, const double at_mm[3])
{
    const double step_mm = 1e-4;
    double columns[3][3];
    for (int c = 0; c < 3; c++) {
        double ends_mm[2][3], normal[3] = { 1, 0, 0 };
        for (int end = 0; end < 2; end++) {
            memcpy(ends_mm[end], at_mm, sizeof ends_mm[end]);
            ends_mm[end][c] += end ? step_mm : -step_mm;
            io_pose_apply(pose, ends_mm[end], normal);
        }
        for (int k = 0; k < 3; k++)
            columns[c][k] = (ends_mm[1][k] - ends_mm[0][k]) / (2 * step_mm);
    }
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        sum += columns[0][k] * (columns[1][l] * columns[2][m] - columns[1][m] * columns[2][l]);
    }
    return sum;
}

/* Oracle: the Jacobian's determinant, everywhere in the box > 0 where sides are kept. A bend is told to the
 * last per cent of its curvature. */
static void solids_keep_their_sides_short_of_a_bends_centre(void **state)
{
    (void)state;
    struct io_mesh *mesh;
    struct rng rng = { .seed = 3 };
    size_t kept_count = 0, lost_count = 0;
    assert_true(io_mesh_create_primitive(IO_PRIMITIVE_CUBE, 4, &mesh, NULL));
    for (int i = 0; i < 400; i++) {
        struct io_object object = { .mesh = mesh, .rest = mesh };
        struct io_deform *const deform = &object.pose.deforms[0];
        object.pose.deform_count = 1;
        deform->kind = (enum io_deform_kind)(i % 3);
        deform->axis[i % 2] = 1; /* x or y */
        deform->toward[2] = i % 5 ? 1 : -1;
        deform->rate_rad_per_mm = uniform(&rng, -4, 4);
        deform->amplitude_mm = uniform(&rng, 0, 1);
        for (int k = 0; k < 3; k++)
            deform->origin_mm[k] = uniform(&rng, -0.2, 0.2);
        double least = INFINITY;
        for (int corner = 0; corner < 8; corner++) { /* linear in the place: least at a corner */
            double at_mm[3];
            for (int k = 0; k < 3; k++)
                at_mm[k] = (double)(corner >> k & 1 ? mesh->max[k] : mesh->min[k]);
            least = fmin(least, determinant_at(&object.pose, at_mm));
        }
        if (fabs(least) < 0.01)
            continue;
        assert_int_equal(render_pose_keeps_sides(&object), least > 0);
        kept_count += least > 0;
        lost_count += least < 0;
        if (deform->kind == IO_DEFORM_BEND) { /* what is bent second lies nobody knows where */
            object.pose.deforms[1] = *deform;
            object.pose.deforms[0].kind = IO_DEFORM_TWIST;
            object.pose.deform_count = 2;
            assert_false(render_pose_keeps_sides(&object));
        }
    }
    assert_true(kept_count > 100 && lost_count > 20);
    io_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_are_posed_as_the_library_does),
        cmocka_unit_test(solids_keep_their_sides_short_of_a_bends_centre),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
