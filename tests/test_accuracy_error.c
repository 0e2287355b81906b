/* accuracy/error.c and interior.c: how far a picture is from the reference, and where that is asked. */
#include "check.h"
#include "scenes.h"

#include "accuracy/error.h"
#include "accuracy/interior.h"

#include <stdlib.h>

enum { WIDTH = 10, HEIGHT = 6, PIXELS = WIDTH * HEIGHT };

static struct io_image *picture_of(float value)
{
    struct io_image *image;
    assert_true(io_image_create(WIDTH, HEIGHT, 4, &image, NULL));
    for (size_t i = 0; i < PIXELS; i++) {
        for (size_t c = 0; c < 3; c++)
            image->pixels[4 * i + c] = value;
        image->pixels[4 * i + 3] = 1;
    }
    return image;
}

/* ---- errors ------------------------------------------------------------------------------------- */

/* Oracle: the definitions, by hand. One interior pixel of 50 is off by half, one edge by all. */
static void errors_are_as_defined(void **state)
{
    (void)state;
    unsigned char kinds[PIXELS] = { 0 };
    struct io_image *const reference = picture_of(0.5f), *const picture = picture_of(0.5f);
    for (int i = 0; i < PIXELS; i++)
        kinds[i] = i < 50 ? ACCURACY_INTERIOR : i < 54 ? ACCURACY_EDGE : ACCURACY_EMPTY;
    for (size_t c = 0; c < 3; c++) {
        picture->pixels[4 * 7 + c] = 0.25f;
        picture->pixels[4 * 51 + c] = 1.0f;
        picture->pixels[4 * 58 + c] = 100.0f; /* empty: not looked at */
    }
    struct accuracy_error error;
    assert_true(accuracy_error_measure(reference, picture, kinds, &error, NULL));
    assert_int_equal(error.pixel_count, 50);
    assert_close(error.rmse, sqrt(0.0625 / (50 * 0.25)), 1e-12, "rmse");
    assert_close(error.rmse_all, sqrt((0.0625 + 0.25) / (54 * 0.25)), 1e-12, "with edges");
    assert_close(error.max, 0.5, 1e-12, "max");
    assert_close(error.weber_99, 0.5, 1e-12, "weber"); /* 3 of 150 values, 2 in a hundred, are off */
    picture->pixels[4 * 7] = picture->pixels[4 * 7 + 1] = 0.5f;
    assert_true(accuracy_error_measure(reference, picture, kinds, &error, NULL));
    assert_close(error.weber_99, 0, 0, "weber of one in 150");
    io_image_destroy(reference);
    io_image_destroy(picture);
}

static void pictures_that_cannot_be_compared_are_refused(void **state)
{
    (void)state;
    const unsigned char none[PIXELS] = { 0 };
    struct accuracy_error error;
    dipole_status status;
    struct io_image *const reference = picture_of(0.5f);
    assert_false(accuracy_error_measure(reference, reference, none, &error, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    struct io_image *small, *difference;
    assert_true(io_image_create(WIDTH - 1, HEIGHT, 4, &small, NULL));
    assert_false(accuracy_error_measure(reference, small, none, &error, &status));
    assert_string_equal(status.message, "a picture of 9x6 beside a reference of 10x6");
    assert_false(accuracy_difference_create(reference, small, 0.1, &difference, &status));
    io_image_destroy(small);
    io_image_destroy(reference);
}

/* Oracle: the colours that error.h promises. */
static void differences_are_red_where_too_bright(void **state)
{
    (void)state;
    struct io_image *const reference = picture_of(0.5f), *const picture = picture_of(0.5f), *difference;
    for (size_t c = 0; c < 3; c++) {
        picture->pixels[c] = 0.6f;     /* beyond the limit, 0.1 of 0.5 */
        picture->pixels[4 + c] = 0.4f; /* the same, too dark */
        picture->pixels[8 + c] = 0.525f;
    }
    static const float expected[4][3] = { { 1, 0, 0 }, { 0, 0, 1 }, { 1, 0.5f, 0.5f }, { 1, 1, 1 } };
    assert_true(accuracy_difference_create(reference, picture, 0.1, &difference, NULL));
    for (size_t i = 0; i < 4; i++) {
        for (size_t c = 0; c < 3; c++)
            assert_close(difference->pixels[3 * i + c], expected[i][c], 1e-5, "colour");
    }
    io_image_destroy(reference);
    io_image_destroy(picture);
    io_image_destroy(difference);
}

/* A sphere of marble about (0, 0, z_mm). */
static void add_sphere(struct test_scene *test, double radius_mm, double z_mm)
{
    const struct io_material material = marble();
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 128, radius_mm, 0, &material));
    struct io_mesh *const mesh = test->objects[test->scene.object_count - 1].mesh;
    for (size_t v = 0; v < mesh->vertex_count; v++)
        mesh->positions[3 * v + 2] += (float)z_mm;
    mesh->min[2] += (float)z_mm;
    mesh->max[2] += (float)z_mm;
    test->scene.max_mm[2] = fmax(test->scene.max_mm[2], z_mm + radius_mm);
}

/* ---- interior pixels ---------------------------------------------------------------------------- */

static size_t count_of(const unsigned char *kinds, size_t count, unsigned char kind)
{
    size_t found = 0;
    for (size_t i = 0; i < count; i++)
        found += kinds[i] == kind;
    return found;
}

/* Oracle: a sphere's outline is a circle of known radius; edges are a ring of some pixels about it. */
static void a_sphere_has_edges_along_its_outline_alone(void **state)
{
    (void)state;
    struct test_scene test;
    unsigned char *kinds;
    scene_init(&test, 30);
    add_sphere(&test, 5, 0);
    const struct io_camera *const camera = &test.scene.camera;
    assert_true(accuracy_interior_create(&test.scene, &kinds, NULL));
    const double radius_px = 0.5 * camera->height_px * tan(asin(5.0 / 30)) / tan(camera->fov_y_rad / 2);
    for (int y = 0; y < camera->height_px; y++) {
        for (int x = 0; x < camera->width_px; x++) {
            const double away_px =
                hypot(x + 0.5 - 0.5 * camera->width_px, y + 0.5 - 0.5 * camera->height_px);
            const unsigned char kind = kinds[y * camera->width_px + x];
            if (away_px > radius_px + 1)
                assert_int_equal(kind, ACCURACY_EMPTY);
            else if (away_px < radius_px - 4)
                assert_int_equal(kind, ACCURACY_INTERIOR);
            else if (fabs(away_px - radius_px) < 0.4)
                assert_int_equal(kind, ACCURACY_EDGE);
        }
    }
    free(kinds);
    scene_end(&test);
}

/* Oracle: a small sphere before a large one: its outline, all within the other's, is of edges. */
static void what_stands_before_another_has_edges(void **state)
{
    (void)state;
    struct test_scene test;
    unsigned char *alone, *both;
    scene_init(&test, 30);
    add_sphere(&test, 5, 0);
    assert_true(accuracy_interior_create(&test.scene, &alone, NULL));
    add_sphere(&test, 1, 7);
    assert_true(accuracy_interior_create(&test.scene, &both, NULL));
    const size_t pixels = (size_t)test.scene.camera.width_px * (size_t)test.scene.camera.height_px;
    assert_int_equal(count_of(alone, pixels, ACCURACY_EMPTY), count_of(both, pixels, ACCURACY_EMPTY));
    const double radius_px = 0.5 * 45 * tan(asin(1.0 / 23)) / tan(0.25);
    const double more =
        (double)count_of(both, pixels, ACCURACY_EDGE) - (double)count_of(alone, pixels, ACCURACY_EDGE);
    assert_true(more > 2 * 3.14 * radius_px * 1.5);
    assert_true(more < 2 * 3.14 * radius_px * 5);
    free(alone);
    free(both);
    scene_end(&test);
}

/* Oracle: a cube seen from above an edge: the crease runs across the picture's middle. */
static void creases_are_edges(void **state)
{
    (void)state;
    struct test_scene test;
    unsigned char *kinds;
    const struct io_material material = marble();
    scene_init(&test, 30);
    test.scene.camera.eye_mm[1] = 30; /* both faces at 45 degrees */
    assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 8, 5, 0, &material));
    assert_true(accuracy_interior_create(&test.scene, &kinds, NULL));
    const int width_px = test.scene.camera.width_px;
    size_t row_edges[45] = { 0 };
    for (int y = 0; y < 45; y++) {
        for (int x = width_px / 2 - 5; x < width_px / 2 + 5; x++)
            row_edges[y] += kinds[y * width_px + x] == ACCURACY_EDGE;
    }
    size_t rows = 0, inner = 0;
    for (int y = 0; y < 45; y++) {
        rows += row_edges[y] == 10;
        inner += row_edges[y] == 0 && kinds[y * width_px + width_px / 2] == ACCURACY_INTERIOR;
    }
    assert_true(rows >= 6 && rows <= 12); /* two outlines and the crease, two to four rows each */
    assert_true(inner > 10);
    free(kinds);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_as_defined),
        cmocka_unit_test(pictures_that_cannot_be_compared_are_refused),
        cmocka_unit_test(differences_are_red_where_too_bright),
        cmocka_unit_test(a_sphere_has_edges_along_its_outline_alone),
        cmocka_unit_test(what_stands_before_another_has_edges),
        cmocka_unit_test(creases_are_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
