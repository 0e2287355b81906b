#include "check.h"

#include "io/json.h"
#include "io/scene_file.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define MATERIAL                                                                                           \
    "{\"name\": \"m\", \"eta\": 1.3, \"sigma_a_per_mm\": [0, 1, 2], \"sigma_s_prime_per_mm\": [1, 2, 3]}"
#define CAMERA "\"eye\": [0, 0, 10], \"target\": [0, 0, 0]"
#define LIGHT "{\"kind\": \"directional\", \"direction\": [0, 0, -2], \"irradiance\": 3}"
#define OBJECT "\"primitive\": \"sphere\", \"detail\": 8, \"material\": " MATERIAL

static const char PATH[] = "scene.json";

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* A scene of three lines in its object: camera (line 2), lights (3), objects (4), and more on line 5. NULL
 * is what stands above. */
struct parts {
    const char *camera, *lights, *object, *more;
};

static void write_scene(const char *path, const struct parts *parts)
{
    char text[4096];
    snprintf(text, sizeof text, "{\n\"camera\": {%s},\n\"lights\": [%s],\n\"objects\": [{%s}]%s%s\n}\n",
             parts->camera ? parts->camera : CAMERA, parts->lights ? parts->lights : LIGHT,
             parts->object ? parts->object : OBJECT, parts->more ? ",\n" : "",
             parts->more ? parts->more : "");
    write_text(path, text);
}

static struct io_scene *read_path(const char *path, const struct io_scene_options *options)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    if (!io_scene_read(path, options, &scene, &status))
        fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
    return scene;
}

static struct io_scene *read_parts(struct parts parts)
{
    write_scene(PATH, &parts);
    return read_path(PATH, NULL);
}

/* expected is "line:column: message", as a tool prints it behind the file's name. */
static void assert_refused(const char *path, const struct io_scene_options *options, const char *expected)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    char found[1024];
    assert_false(io_scene_read(path, options, &scene, &status));
    assert_null(scene);
    assert_string_equal(status.source, path);
    snprintf(found, sizeof found, "%d:%d: %s", status.line, status.column, status.message);
    assert_string_equal(found, expected);
}

static void assert_parts_refused(struct parts parts, const char *expected)
{
    write_scene(PATH, &parts);
    assert_refused(PATH, NULL, expected);
}

/* ---- what comes out ------------------------------------------------------------------------------ */

/* Oracle: the defaults that docs/formats.md states. */
static void defaults_are_as_documented(void **state)
{
    (void)state;
    struct io_scene *scene = read_parts((struct parts){ 0 });
    assert_string_equal(scene->path, PATH);
    assert_int_equal(scene->camera.width_px, 800);
    assert_int_equal(scene->camera.height_px, 600);
    assert_false(scene->camera.is_orthographic);
    assert_close(scene->camera.fov_y_rad, 35 * 3.14159265358979323846 / 180, 1e-15, "fov");
    assert_true(scene->camera.up[0] == 0 && scene->camera.up[1] == 1 && scene->camera.up[2] == 0);
    assert_true(scene->exposure_ev == 0);
    assert_true(scene->background[0] == 0 && scene->background[1] == 0 && scene->background[2] == 0);
    assert_int_equal(scene->light_count, 1);
    assert_int_equal(scene->lights[0].kind, IO_LIGHT_DIRECTIONAL);
    assert_true(scene->lights[0].direction[2] == -1); /* a unit vector */
    for (int c = 0; c < 3; c++)
        assert_true(scene->lights[0].rgb[c] == 3); /* a number is grey */
    assert_int_equal(scene->object_count, 1);
    assert_string_equal(scene->objects[0].name, "sphere");
    assert_string_equal(scene->objects[0].material.name, "m");
    assert_true(scene->objects[0].material.layers[2][0].medium.sigma_a_per_mm == 2);
    assert_true(scene->objects[0].roughness == 0.3);
    assert_true(scene->objects[0].has_specular);
    assert_int_equal(scene->objects[0].casts, IO_CASTS_AUTO);
    for (int axis = 0; axis < 3; axis++) {
        assert_close(scene->min_mm[axis], -1, 1e-6, "min %d", axis);
        assert_close(scene->max_mm[axis], 1, 1e-6, "max %d", axis);
    }
    io_scene_destroy(scene);
}

/* Oracle: the file. Every key arrives, and unit_mm scales every length. */
static void every_key_arrives(void **state)
{
    (void)state;
    struct io_scene *scene = read_parts((struct parts){
        .camera = "\"eye\": [1, 2, 3], \"target\": [4, 5, 6], \"up\": [0, 0, 1], \"height\": 7, \"size\": "
                  "[64, 48]",
        .lights = "{\"kind\": \"point\", \"position\": [1, 2, 3], \"intensity\": [4, 5, 6]}, " LIGHT,
        .object = "\"name\": \"it\", \"roughness\": 0.5, \"specular\": false, \"casts\": \"translucent\", "
                  "\"transform\": {\"translate\": [1, 2, 3]}, " OBJECT,
        .more = "\"unit_mm\": 10, \"exposure_ev\": -1.5, \"background\": [0.1, 0.2, 0.3]",
    });
    assert_true(scene->camera.is_orthographic);
    assert_true(scene->camera.height_mm == 70);
    assert_int_equal(scene->camera.width_px, 64);
    assert_int_equal(scene->camera.height_px, 48);
    assert_true(scene->exposure_ev == -1.5);
    assert_int_equal(scene->light_count, 2);
    assert_int_equal(scene->lights[0].kind, IO_LIGHT_POINT);
    for (int k = 0; k < 3; k++) {
        assert_true(scene->camera.eye_mm[k] == 10 * (k + 1));
        assert_true(scene->camera.target_mm[k] == 10 * (k + 4));
        assert_true(scene->camera.up[k] == (k == 2));
        assert_close(scene->background[k], 0.1 * (k + 1), 1e-15, "background");
        assert_true(scene->lights[0].position_mm[k] == 10 * (k + 1));
        assert_true(scene->lights[0].rgb[k] == k + 4);
        assert_close(scene->min_mm[k], 10.0 * (k + 1 - 1), 1e-6, "min %d", k);
        assert_close(scene->max_mm[k], 10.0 * (k + 1 + 1), 1e-6, "max %d", k);
    }
    assert_string_equal(scene->objects[0].name, "it");
    assert_true(scene->objects[0].roughness == 0.5);
    assert_false(scene->objects[0].has_specular);
    assert_int_equal(scene->objects[0].casts, IO_CASTS_TRANSLUCENT);
    io_scene_destroy(scene);

    const struct io_scene_options options = { .width_px = 20, .height_px = 10 };
    scene = read_path(PATH, &options);
    assert_int_equal(scene->camera.width_px, 20);
    assert_int_equal(scene->camera.height_px, 10);
    io_scene_destroy(scene);
}

static double volume_of(const struct io_mesh *mesh)
{
    double volume = 0;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i += 3) {
        const float *p = mesh->positions + 3 * (size_t)mesh->indices[i],
                    *q = mesh->positions + 3 * (size_t)mesh->indices[i + 1],
                    *r = mesh->positions + 3 * (size_t)mesh->indices[i + 2];
        for (int x = 0; x < 3; x++) {
            const int y = (x + 1) % 3, z = (x + 2) % 3;
            volume += (double)p[x] * ((double)q[y] * (double)r[z] - (double)q[z] * (double)r[y]) / 6;
        }
    }
    return volume;
}

/* Oracle: analytic geometry. A sphere under scale (a, b, c) is an ellipsoid: its volume is that of the
 * sphere times |abc| and positive even when mirrored, its normal at p is along (x/a^2, y/b^2, z/c^2). */
static void scale_moves_normals_and_winding(void **state)
{
    (void)state;
    struct io_scene *plain = read_parts((struct parts){ 0 });
    struct io_scene *scaled =
        read_parts((struct parts){ .object = "\"transform\": {\"scale\": [2, -3, 0.5]}, " OBJECT });
    const struct io_mesh *mesh = scaled->objects[0].mesh;
    assert_close(volume_of(mesh), 3 * volume_of(plain->objects[0].mesh), 1e-6, "volume");
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        const float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        const double x = (double)p[0] / 4, y = (double)p[1] / 9, z = (double)p[2] / 0.25;
        const double length = sqrt(x * x + y * y + z * z);
        assert_true(fabs((double)n[0] - x / length) < 1e-6);
        assert_true(fabs((double)n[1] - y / length) < 1e-6);
        assert_true(fabs((double)n[2] - z / length) < 1e-6);
    }
    io_scene_destroy(plain);
    io_scene_destroy(scaled);
}

/* Oracle: by hand. The axis x turned a quarter about y is -z; a slab's top (0, 1, 0) turned a quarter about
 * x is z, and then a quarter about z stays z. */
static void rotations_go_x_then_y_then_z(void **state)
{
    (void)state;
    static const struct {
        const char *rotate_deg;
        double normal[3]; /* of the slab's top */
    } cases[] = {
        { "[90, 0, 0]", { 0, 0, 1 } },  { "[0, 0, 90]", { -1, 0, 0 } },  { "[90, 90, 0]", { 1, 0, 0 } },
        { "[90, 0, 90]", { 0, 0, 1 } }, { "[90, 90, 90]", { 0, 1, 0 } },
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        char object[512];
        snprintf(object, sizeof object,
                 "\"primitive\": \"slab\", \"detail\": 4, \"transform\": {\"rotate_deg\": %s}, "
                 "\"material\": " MATERIAL,
                 cases[k].rotate_deg);
        struct io_scene *scene = read_parts((struct parts){ .object = object });
        /* the slab lies below its top: its middle is half a unit against the normal */
        for (int axis = 0; axis < 3; axis++)
            assert_true(fabs((scene->min_mm[axis] + scene->max_mm[axis]) / 2 + cases[k].normal[axis] / 2) <
                        1e-6);
        assert_close(volume_of(scene->objects[0].mesh), 4, 1e-6, "%s", cases[k].rotate_deg);
        io_scene_destroy(scene);
    }
}

/* Oracle: the definition. The mesh stands on y = 0, centred, as high as asked, before the other steps. */
static void fit_height_comes_before_the_rest(void **state)
{
    (void)state;
    write_text("odd.obj", "v 5 5 5\nv 7 5 5\nv 5 9 5\nv 5 5 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    struct io_scene *scene = read_parts((struct parts){
        .object = "\"mesh\": \"odd.obj\", \"transform\": {\"fit_height\": 2, \"translate\": [0, "
                  "10, 0]}, \"material\": " MATERIAL,
        .more = "\"unit_mm\": 10" });
    const double min[3] = { -5, 100, -7.5 }, max[3] = { 5, 120, 7.5 };
    for (int axis = 0; axis < 3; axis++) {
        assert_close(scene->min_mm[axis], min[axis], 1e-6, "min %d", axis);
        assert_close(scene->max_mm[axis], max[axis], 1e-6, "max %d", axis);
    }
    assert_string_equal(scene->objects[0].name, "odd.obj");
    io_scene_destroy(scene);
}

/* Oracle: material_file.c. A bundled name, a path beside the scene and an object in place give one
 * material. */
static void materials_come_in_three_ways(void **state)
{
    (void)state;
    write_text("m.json", MATERIAL);
    struct io_scene *scene = read_parts(
        (struct parts){ .object = "\"primitive\": \"cube\", \"detail\": 4, \"material\": \"m.json\"}, "
                                  "{\"primitive\": \"cube\", \"detail\": 4, \"material\": \"marble\"}, "
                                  "{\"primitive\": \"cube\", \"detail\": 4, "
                                  "\"material\": \"narasimhan2006/espresso\"}, {" OBJECT });
    assert_int_equal(scene->object_count, 4);
    assert_string_equal(scene->objects[0].material.name, "m");
    assert_string_equal(scene->objects[1].material.name, "Marble");
    assert_true(scene->objects[1].material.layers[0][0].medium.sigma_s_prime_per_mm == 2.19);
    assert_true(strlen(scene->objects[2].material.name) > 0);
    assert_string_equal(scene->objects[3].material.name, "m");
    io_scene_destroy(scene);
}

/* Oracle: the reader. Scenes that are shipped are read; those of the bunny when that is installed. */
static void bundled_scenes_are_read(void **state)
{
    (void)state;
    static const char *const allowed[] = { "/usr/share/glmark2/models" };
    const bool has_bunny = access("/usr/share/glmark2/models/bunny.obj", R_OK) == 0;
    const struct io_scene_options options = { .allowed_paths = allowed, .allowed_path_count = has_bunny };
    int count = 0;
    DIR *folder = opendir(SOURCE_FOLDER "/scenes");
    assert_non_null(folder);
    for (const struct dirent *entry; (entry = readdir(folder));) {
        char path[1024];
        const char *dot = strrchr(entry->d_name, '.');
        if (!dot || strcmp(dot, ".json") != 0 || strstr(entry->d_name, "schema") ||
            (!has_bunny && strstr(entry->d_name, "bunny")))
            continue;
        snprintf(path, sizeof path, "%s/scenes/%s", SOURCE_FOLDER, entry->d_name);
        io_scene_destroy(read_path(path, &options));
        count++;
    }
    closedir(folder);
    assert_true(count >= 4);
}

/* ---- cameras, environment, frames ---------------------------------------------------------------- */

/* A scene with cameras on line 2. */
static void write_cameras(const char *cameras)
{
    char text[16384];
    snprintf(text, sizeof text,
             "{\n\"cameras\": %s,\n\"lights\": [" LIGHT "],\n\"objects\": [{" OBJECT "}]\n}\n", cameras);
    write_text(PATH, text);
}

/* Oracle: the file. The one that is named is taken, without a name the first. */
static void a_camera_is_chosen_by_name(void **state)
{
    (void)state;
    write_cameras("[{\"name\": \"front\", \"eye\": [0, 0, 10], \"target\": [0, 0, 1]},"
                  " {\"name\": \"side\", \"eye\": [20, 0, 0], \"target\": [0, 0, 0], \"height\": 4}]");
    struct io_scene *scene = read_path(PATH, NULL);
    assert_true(scene->camera.eye_mm[2] == 10 && !scene->camera.is_orthographic);
    io_scene_destroy(scene);
    scene = read_path(PATH, &(struct io_scene_options){ .camera_name = "front" });
    assert_true(scene->camera.eye_mm[2] == 10);
    io_scene_destroy(scene);
    scene = read_path(PATH, &(struct io_scene_options){ .camera_name = "side", .width_px = 7 });
    assert_true(scene->camera.eye_mm[0] == 20 && scene->camera.is_orthographic);
    assert_int_equal(scene->camera.width_px, 7);
    assert_int_equal(scene->camera.height_px, 600);
    io_scene_destroy(scene);
    assert_refused(PATH, &(struct io_scene_options){ .camera_name = "top" },
                   "2:12: cameras has none named \"top\", expected one of front, side");
    assert_refused(PATH, &(struct io_scene_options){ .camera_name = "" },
                   "2:12: cameras has none named \"\", expected one of front, side");

    /* a camera alone may have a name */
    write_scene(PATH, &(struct parts){ .camera = "\"name\": \"front\", " CAMERA });
    io_scene_destroy(read_path(PATH, NULL));
    io_scene_destroy(read_path(PATH, &(struct io_scene_options){ .camera_name = "front" }));
    assert_refused(PATH, &(struct io_scene_options){ .camera_name = "top" },
                   "2:11: camera is named \"front\", but \"top\" is asked for");
    write_scene(PATH, &(struct parts){ 0 });
    assert_refused(PATH, &(struct io_scene_options){ .camera_name = "top" },
                   "2:11: camera has no name, but \"top\" is asked for");
}

/* Oracle: the messages, word by word. A camera that is not chosen must be right too. */
static void wrong_cameras_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *cameras, *expected;
    } cases[] = {
        { "{}", "2:12: cameras is an object, expected an array" },
        { "[]", "2:12: cameras has 0 elements, expected 1 to 64" },
        { "[3]", "2:13: cameras[0] is a number, expected an object" },
        { "[{" CAMERA "}]", "2:13: cameras[0].name is missing, expected the camera's name" },
        { "[{" CAMERA ", \"name\": \"\"}]", "2:62: cameras[0].name is empty, expected the camera's name" },
        { "[{" CAMERA ", \"name\": 3}]", "2:62: cameras[0].name is a number, expected a string" },
        { "[{\"name\": \"0123456789012345678901234567890123456789012345678901234567890123\", " CAMERA "}]",
          "2:22: cameras[0].name has 64 bytes, expected at most 63" },
        { "[{\"name\": \"a\", " CAMERA "}, {\"name\": \"b\", " CAMERA "}, {\"name\": \"a\", " CAMERA "}]",
          "2:132: cameras[2].name is \"a\" as in cameras[0], expected another" },
        { "[{\"name\": \"a\", " CAMERA "}, {\"name\": \"b\", \"eye\": [0, 0, 1]}]",
          "2:68: cameras[1].target is missing, it is required here" },
        { "[{\"name\": \"a\", " CAMERA ", \"fov\": 3}]",
          "2:67: unknown key \"fov\" in cameras[0], expected eye, target, up, fov_y_deg, height, size, "
          "name" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_cameras(cases[i].cameras);
        assert_refused(PATH, NULL, cases[i].expected);
    }
    assert_parts_refused((struct parts){ .more = "\"cameras\": [{\"name\": \"a\", " CAMERA "}]" },
                         "5:12: cameras stands beside camera, expected one of the two");
    char many[8192] = "[";
    for (int i = 0; i < 65; i++)
        snprintf(many + strlen(many), sizeof many - strlen(many), "%s{\"name\": \"%d\", " CAMERA "}",
                 i > 0 ? ", " : "", i);
    strcat(many, "]");
    write_cameras(many);
    assert_refused(PATH, NULL, "2:12: cameras has 65 elements, expected 1 to 64");
}

/* Oracle: the file, and the defaults that docs/formats.md states. */
static void an_environment_is_found(void **state)
{
    (void)state;
    char expected[4096];
    write_text("sky.exr", "");
    write_text("sky.hdr", "");
    assert_non_null(realpath("sky.exr", expected));
    struct io_scene *scene = read_parts((struct parts){ 0 });
    assert_false(scene->has_environment);
    io_scene_destroy(scene);
    scene = read_parts((struct parts){ .more = "\"environment\": {\"image\": \"sky.exr\"}" });
    assert_true(scene->has_environment);
    assert_int_equal(scene->light_count, 1);
    assert_string_equal(scene->environment.path, expected);
    for (int c = 0; c < 3; c++)
        assert_true(scene->environment.rgb[c] == 1);
    assert_true(scene->environment.rotate_rad == 0);
    io_scene_destroy(scene);
    /* it is light enough */
    scene = read_parts(
        (struct parts){ .lights = "",
                        .more = "\"environment\": {\"image\": \"./sky.hdr\", \"scale\": [1, 2, 3], "
                                "\"rotate_deg\": -90}" });
    assert_int_equal(scene->light_count, 0);
    for (int c = 0; c < 3; c++)
        assert_true(scene->environment.rgb[c] == c + 1);
    assert_close(scene->environment.rotate_rad, -3.14159265358979323846 / 2, 1e-15, "angle");
    io_scene_set_frame(scene, 0);
    io_scene_destroy(scene);
    scene =
        read_parts((struct parts){ .more = "\"environment\": {\"image\": \"sky.exr\", \"scale\": 0.5}" });
    for (int c = 0; c < 3; c++)
        assert_true(scene->environment.rgb[c] == 0.5);
    io_scene_destroy(scene);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* The cameras and lights of two states of one scene are at most so far apart. */
static void assert_same_view(const struct io_camera *camera, const struct io_light *lights,
                             const struct io_scene *scene, double tolerance_mm)
{
    assert_true(distance(camera->eye_mm, scene->camera.eye_mm) <= tolerance_mm);
    assert_true(distance(camera->target_mm, scene->camera.target_mm) == 0);
    assert_true(distance(camera->up, scene->camera.up) == 0);
    assert_int_equal(camera->width_px, scene->camera.width_px);
    for (size_t i = 0; i < scene->light_count; i++) {
        assert_int_equal(lights[i].kind, scene->lights[i].kind);
        assert_true(distance(lights[i].rgb, scene->lights[i].rgb) == 0);
        assert_true(distance(lights[i].position_mm, scene->lights[i].position_mm) <= tolerance_mm);
        assert_true(distance(lights[i].direction, scene->lights[i].direction) <= fmin(tolerance_mm, 1e-9));
    }
}

/* Oracle: by hand, quarter turns. */
static void frames_turn_camera_and_lights(void **state)
{
    (void)state;
    struct io_scene *scene = read_parts((struct parts){
        .camera = "\"eye\": [1, 2, 13], \"target\": [1, 2, 3]",
        .lights = "{\"kind\": \"point\", \"position\": [5, 6, 3], \"intensity\": 1}, " LIGHT,
        .more = "\"unit_mm\": 10, \"frames\": {\"count\": 4, \"camera_turn_deg\": 360, "
                "\"lights_turn_deg\": -720}" });
    assert_int_equal(scene->frames.count, 4);
    /* from +z to +x, to -z, to -x: counter-clockwise seen from above */
    const double eyes[4][3] = { { 10, 20, 130 }, { 110, 20, 30 }, { 10, 20, -70 }, { -90, 20, 30 } };
    const double positions[2][3] = { { 50, 60, 30 }, { -30, 60, 30 } };
    for (int frame = 0; frame < 4; frame++) {
        io_scene_set_frame(scene, frame);
        assert_true(distance(scene->camera.eye_mm, eyes[frame]) < 1e-12);
        assert_true(distance(scene->lights[0].position_mm, positions[frame % 2]) < 1e-12);
        assert_true(distance(scene->lights[0].direction, (double[3]){ 0, 0, 0 }) == 0);
        const double direction[3] = { 0, 0, frame % 2 ? 1 : -1 };
        assert_true(distance(scene->lights[1].direction, direction) < 1e-15);
        assert_true(distance(scene->lights[1].position_mm, (double[3]){ 0, 0, 0 }) == 0);
    }
    io_scene_destroy(scene);

    /* without turns, and without frames, nothing moves */
    scene = read_parts((struct parts){ .more = "\"frames\": {\"count\": 100000}" });
    const struct io_camera camera = scene->camera;
    const struct io_light light = scene->lights[0];
    io_scene_set_frame(scene, 99999);
    assert_same_view(&camera, &light, scene, 0);
    io_scene_destroy(scene);
    scene = read_parts((struct parts){ 0 });
    assert_int_equal(scene->frames.count, 1);
    io_scene_set_frame(scene, 0);
    assert_same_view(&camera, &light, scene, 0);
    io_scene_destroy(scene);

    /* --size counts in all frames */
    write_scene(PATH, &(struct parts){ .more = "\"frames\": {\"count\": 2}" });
    scene = read_path(PATH, &(struct io_scene_options){ .width_px = 5, .height_px = 4 });
    io_scene_set_frame(scene, 1);
    assert_int_equal(scene->camera.width_px, 5);
    assert_int_equal(scene->camera.height_px, 4);
    io_scene_destroy(scene);
}

/* A scene of 3 lights, its numbers by chance, of that many frames. */
static struct io_scene *read_random_frames(struct rng *rng, int count, double turn_deg)
{
    double v[15];
    char camera[512], lights[1024], more[256];
    for (int i = 0; i < 15; i++)
        v[i] = (uniform(rng, -1, 1) < 0 ? -1 : 1) * log_uniform(rng, 1e-3, 1e3);
    snprintf(
        camera, sizeof camera,
        "\"eye\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"up\": [%.17g, %.17g, %.17g]",
        v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]);
    snprintf(lights, sizeof lights,
             "{\"kind\": \"point\", \"position\": [%.17g, %.17g, %.17g], \"intensity\": 1}, " LIGHT
             ", {\"kind\": \"directional\", \"direction\": [%.17g, %.17g, %.17g], \"irradiance\": 1}",
             v[9], v[10], v[11], v[12], v[13], v[14]);
    snprintf(more, sizeof more,
             "\"frames\": {\"count\": %d, \"camera_turn_deg\": %.17g, \"lights_turn_deg\": %.17g}", count,
             turn_deg, -turn_deg);
    return read_parts((struct parts){ .camera = camera, .lights = lights, .more = more });
}

/* The part of v across a unit axis, and its length; *along_out is the other part's. */
static double across(const double v[3], const double axis[3], double out[3], double *along_out)
{
    *along_out = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
    for (int x = 0; x < 3; x++)
        out[x] = v[x] - *along_out * axis[x];
    return distance(out, (double[3]){ 0, 0, 0 });
}

/*
 * Oracle: the definition of a turn about an axis through a centre. What is along the axis stays, what is
 * across it keeps its length and turns by the angle, whose cosine and sine are products of before and
 * after.
 */
static void assert_turned(const double before[3], const double after[3], const double centre[3],
                          const double axis[3], double turn_deg, double tolerance_mm)
{
    const double angle_rad = turn_deg * 3.14159265358979323846 / 180;
    const double u[3] = { before[0] - centre[0], before[1] - centre[1], before[2] - centre[2] },
                 v[3] = { after[0] - centre[0], after[1] - centre[1], after[2] - centre[2] };
    double p[3], q[3], u_along, v_along, cosine = 0, sine = 0;
    const double radius_mm = across(u, axis, p, &u_along);
    assert_true(fabs(across(v, axis, q, &v_along) - radius_mm) < tolerance_mm);
    assert_true(fabs(v_along - u_along) < tolerance_mm);
    for (int x = 0; x < 3; x++) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        cosine += p[x] * q[x] / radius_mm;
        sine += axis[x] * (p[y] * q[z] - p[z] * q[y]) / radius_mm;
    }
    assert_true(fabs(cosine - cos(angle_rad) * radius_mm) < tolerance_mm);
    assert_true(fabs(sine - sin(angle_rad) * radius_mm) < tolerance_mm);
}

/* Oracle: the above on random scenes; and frame 0 is the file to the last bit, whatever was set before. */
static void turning_keeps_what_it_must(void **state)
{
    (void)state;
    static const double y[3] = { 0, 1, 0 }, origin[3] = { 0, 0, 0 };
    struct rng rng = { .seed = 7 };
    for (int i = 0; i < 200; i++) {
        const int count = 1 + (int)uniform(&rng, 0, 50);
        const double turn_deg = uniform(&rng, -1000, 1000);
        struct io_scene *scene = read_random_frames(&rng, count, turn_deg);
        const struct io_camera camera = scene->camera;
        struct io_light lights[3];
        memcpy(lights, scene->lights, sizeof lights);
        const double up_length = distance(camera.up, origin), *const target = camera.target_mm;
        const double up[3] = { camera.up[0] / up_length, camera.up[1] / up_length,
                               camera.up[2] / up_length };
        /* the rounding of a few sums of numbers of that size, and of an angle of up to 1000 degrees */
        const double tolerance_mm = 1e-13 * (distance(camera.eye_mm, target) + distance(target, origin) +
                                             distance(lights[0].position_mm, target));
        for (int frame = 0; frame < count; frame++) {
            const double angle_deg = turn_deg * frame / count;
            io_scene_set_frame(scene, frame);
            assert_turned(camera.eye_mm, scene->camera.eye_mm, target, up, angle_deg, tolerance_mm);
            assert_turned(lights[0].position_mm, scene->lights[0].position_mm, target, y, -angle_deg,
                          tolerance_mm);
            assert_turned(lights[2].direction, scene->lights[2].direction, origin, y, -angle_deg, 1e-13);
        }
        io_scene_set_frame(scene, 0);
        assert_same_view(&camera, lights, scene, 0);
        io_scene_destroy(scene);
    }
}

/* Oracle: a whole turn is none. The frame half way through two turns is the file to the last bit; one just
 * beside it, within what it is beside. */
static void whole_turns_are_none(void **state)
{
    (void)state;
    struct rng rng = { .seed = 8 };
    for (int i = 1; i < 100; i++) {
        for (int k = 0; k < 2; k++) {
            const double beside = k * 1e-10;
            struct io_scene *scene = read_random_frames(&rng, 2 * i, 720 * (1 + beside));
            const struct io_camera camera = scene->camera;
            struct io_light lights[3];
            memcpy(lights, scene->lights, sizeof lights);
            io_scene_set_frame(scene, i);
            /* all lie within 4000 mm of the target; 2 pi times that, and the rounding */
            assert_same_view(&camera, lights, scene, k * (4000 * 6.3 * beside + 1e-11));
            io_scene_destroy(scene);
        }
    }
}

/* ---- scenes that are refused --------------------------------------------------------------------- */

/* Oracle: the messages, word by word. */
static void file_that_is_no_scene_is_refused(void **state)
{
    (void)state;
    assert_refused("absent.json", NULL, "0:0: cannot be read: No such file or directory");
    write_text(PATH, "{\n\"camera\": {\"eye\": [0, 0, 10] \"target\"");
    assert_refused(PATH, NULL, "2:37: JSON syntax: '}' expected near '\"target\"'");
    write_text(PATH, "");
    assert_refused(PATH, NULL, "1:1: JSON syntax: '[' or '{' expected near end of file");
    write_text(PATH, "[]");
    assert_refused(PATH, NULL, "1:1: the whole is an array, expected an object");
    write_text(PATH, "{}");
    assert_refused(PATH, NULL, "1:1: lights is missing, it is required here");
    write_text(PATH, "{\"lights\": [" LIGHT "], \"objects\": []}");
    assert_refused(PATH, NULL, "1:1: camera is missing, expected it, or cameras");
}

/* Oracle: the messages, word by word, with the place that a hand count gives. */
static void wrong_values_are_refused(void **state)
{
    (void)state;
    static const struct {
        struct parts parts;
        const char *expected;
    } cases[] = {
        /* the whole */
        { { .more = "\"light\": []" },
          "5:1: unknown key \"light\", expected lights, objects, camera, cameras, unit_mm, background, "
          "exposure_ev, environment, frames" },
        { { .more = "\"unit_mm\": 0" }, "5:12: unit_mm is 0, expected 1e-06 to 1e+06" },
        { { .more = "\"unit_mm\": -1" }, "5:12: unit_mm is -1, expected 1e-06 to 1e+06" },
        { { .more = "\"unit_mm\": NaN" }, "5:14: JSON syntax: invalid token near 'NaN'" },
        { { .more = "\"unit_mm\": 1e999" }, "5:16: JSON syntax: real number overflow near '1e999'" },
        { { .more = "\"unit_mm\": \"mm\"" }, "5:12: unit_mm is a string, expected a number" },
        { { .more = "\"background\": [0, -1, 0]" }, "5:19: background[1] is -1, expected 0 to 1e+12" },
        { { .more = "\"exposure_ev\": 1e4" }, "5:16: exposure_ev is 10000, expected -100 to 100" },
        /* camera */
        { { .camera = "\"eye\": [0, 0, 1]" }, "2:11: camera.target is missing, it is required here" },
        { { .camera = "\"eye\": [0, 0, 1], \"target\": [0, 0, 1]" },
          "2:40: camera.target is where eye is, expected another point" },
        { { .camera = CAMERA ", \"up\": [0, 0, 0]" },
          "2:58: camera.up is [0, 0, 0], expected a direction" },
        { { .camera = CAMERA ", \"up\": [0, 0, 5]" },
          "2:58: camera.up is parallel to the view, expected another direction" },
        { { .camera = CAMERA ", \"fov_y_deg\": 0" }, "2:65: camera.fov_y_deg is 0, expected 1 to 170" },
        { { .camera = CAMERA ", \"fov_y_deg\": 180" }, "2:65: camera.fov_y_deg is 180, expected 1 to 170" },
        { { .camera = CAMERA ", \"height\": 0" }, "2:62: camera.height is 0, expected 1e-06 to 1e+06" },
        { { .camera = CAMERA ", \"height\": 1, \"fov_y_deg\": 20" },
          "2:62: camera.height stands beside fov_y_deg, expected either that (perspective) or height "
          "(orthographic)" },
        { { .camera = CAMERA ", \"size\": [800, 0]" }, "2:66: camera.size[1] is 0, expected 1 to 16384" },
        { { .camera = CAMERA ", \"size\": [800, 16385]" },
          "2:66: camera.size[1] is 16385, expected 1 to 16384" },
        { { .camera = CAMERA ", \"size\": [800, 1.5]" },
          "2:66: camera.size[1] is 1.5, expected a whole number" },
        { { .camera = CAMERA ", \"size\": [800]" },
          "2:60: camera.size has 1 element, expected an array of 2 numbers" },
        { { .camera = CAMERA ", \"fov\": 20" },
          "2:52: unknown key \"fov\" in camera, expected eye, target, up, fov_y_deg, height, size, name" },
        /* lights */
        { { .lights = "" }, "3:11: lights has 0 elements, expected 1 to 64" },
        { { .lights = "3" }, "3:12: lights[0] is a number, expected an object" },
        { { .lights = "{\"direction\": [0, 0, 1], \"irradiance\": 3}" },
          "3:12: lights[0].kind is missing, it is required here" },
        { { .lights = "{\"kind\": \"area\"}" },
          "3:21: lights[0].kind is \"area\", expected \"directional\" or \"point\" or "
          "\"spot\"" },
        { { .lights = "{\"kind\": \"directional\", \"direction\": [0, 0, 0], \"irradiance\": 3}" },
          "3:49: lights[0].direction is [0, 0, 0], expected a direction" },
        { { .lights = "{\"kind\": \"directional\", \"direction\": [0, 0, 1], \"irradiance\": -3}" },
          "3:74: lights[0].irradiance is -3, expected 0 to 1e+12" },
        { { .lights = "{\"kind\": \"directional\", \"direction\": [0, 0, 1], \"intensity\": 3}" },
          "3:60: unknown key \"intensity\" in lights[0], expected kind, direction, "
          "irradiance, size_deg" },
        { { .lights = "{\"kind\": \"point\", \"position\": [0, 0, 1], \"intensity\": [1, 2]}" },
          "3:66: lights[0].intensity has 2 elements, expected an array of 3 numbers" },
        { { .lights = LIGHT ", {\"kind\": \"point\", \"intensity\": 1}" },
          "3:79: lights[1].position is missing, it is required here" },
        /* environment */
        { { .more = "\"environment\": 3" }, "5:16: environment is a number, expected an object" },
        { { .more = "\"environment\": {}" }, "5:16: environment.image is missing, it is required here" },
        { { .more = "\"environment\": {\"image\": 3}" },
          "5:26: environment.image is not a string, expected the path of a picture" },
        { { .more = "\"environment\": {\"image\": \"sky.png\"}" },
          "5:26: environment.image is \"sky.png\", expected a path that ends in .exr or .hdr" },
        { { .more = "\"environment\": {\"image\": \"sky\"}" },
          "5:26: environment.image is \"sky\", expected a path that ends in .exr or .hdr" },
        { { .more = "\"environment\": {\"image\": \"absent.hdr\"}" },
          "5:26: environment.image path \"absent.hdr\" cannot be read: No such file or directory" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"scale\": -1}" },
          "5:46: environment.scale is -1, expected 0 to 1e+12" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"scale\": [1, 2]}" },
          "5:46: environment.scale has 2 elements, expected an array of 3 numbers" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"scale\": \"1\"}" },
          "5:46: environment.scale is a string, expected an array of 3 numbers" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"rotate_deg\": [0, 1, 0]}" },
          "5:51: environment.rotate_deg is an array, expected a number" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"rotate_deg\": 1e7}" },
          "5:51: environment.rotate_deg is 1e+07, expected -1e+06 to 1e+06" },
        { { .more = "\"environment\": {\"image\": \"sky.exr\", \"turn\": 1}" },
          "5:37: unknown key \"turn\" in environment, expected image, scale, rotate_deg" },
        /* frames */
        { { .more = "\"frames\": 3" }, "5:11: frames is a number, expected an object" },
        { { .more = "\"frames\": {\"camera_turn_deg\": 3}" },
          "5:11: frames.count is missing, it is required here" },
        { { .more = "\"frames\": {\"count\": 0}" }, "5:21: frames.count is 0, expected 1 to 100000" },
        { { .more = "\"frames\": {\"count\": 100001}" },
          "5:21: frames.count is 100001, expected 1 to 100000" },
        { { .more = "\"frames\": {\"count\": 2.5}" },
          "5:21: frames.count is 2.5, expected a whole number" },
        { { .more = "\"frames\": {\"count\": 2, \"camera_turn_deg\": \"3\"}" },
          "5:43: frames.camera_turn_deg is a string, expected a number" },
        { { .more = "\"frames\": {\"count\": 2, \"lights_turn_deg\": -1e7}" },
          "5:43: frames.lights_turn_deg is -1e+07, expected -1e+06 to 1e+06" },
        { { .more = "\"frames\": {\"count\": 2, \"turn\": 3}" },
          "5:24: unknown key \"turn\" in frames, expected count, camera_turn_deg, lights_turn_deg" },
        /* objects */
        { { .object = "" }, "4:13: objects[0].material is missing, it is required here" },
        { { .object = "\"material\": " MATERIAL },
          "4:13: objects[0].mesh is missing, expected it, primitive or mesh_sequence" },
        { { .object = "\"mesh\": \"a.obj\", " OBJECT },
          "4:44: objects[0].primitive stands beside mesh, expected one of the two" },
        { { .object = "\"mesh\": \"a.obj\", \"detail\": 8, \"material\": " MATERIAL },
          "4:41: objects[0].detail stands beside mesh, expected beside primitive" },
        { { .object = "\"mesh\": 3, \"material\": " MATERIAL },
          "4:22: objects[0].mesh is not a string, expected the path of a mesh file" },
        { { .object = "\"primitive\": \"teapot\", \"material\": " MATERIAL },
          "4:27: objects[0].primitive is \"teapot\", expected \"sphere\" or \"cube\" or \"slab\" or "
          "\"torus\" or \"knot\" or \"bowl\" or \"terrain\" or \"lantern\"" },
        { { .object = "\"primitive\": \"cube\", \"detail\": 3, \"material\": " MATERIAL },
          "4:45: objects[0].detail is 3, expected 4 to 4096" },
        { { .object = "\"primitive\": \"cube\", \"detail\": 4096, \"material\": " MATERIAL },
          "4:45: objects[0].detail is 4096: 201326592 triangles are more than the 20000000 that a mesh may "
          "have" },
        { { .object = "\"roughness\": 0, " OBJECT },
          "4:27: objects[0].roughness is 0, expected 0.05 to 1" },
        { { .object = "\"specular\": 1, " OBJECT },
          "4:26: objects[0].specular is a number, expected true or false" },
        { { .object = "\"colour\": 1, " OBJECT },
          "4:14: unknown key \"colour\" in objects[0], expected material, mesh, primitive, detail, name, "
          "transform, roughness, specular, mesh_sequence, deform, motion, casts" },
        { { .object = "\"casts\": \"shade\", " OBJECT },
          "4:23: objects[0].casts is \"shade\", expected \"auto\" or \"opaque\" or \"translucent\"" },
        { { .object = "\"transform\": {\"scale\": 0}, " OBJECT },
          "4:37: objects[0].transform.scale is 0, expected 1e-06 to 1e+06, or the same below 0 to mirror" },
        { { .object = "\"transform\": {\"scale\": [1, 0, 1]}, " OBJECT },
          "4:41: objects[0].transform.scale[1] is 0, expected 1e-06 to 1e+06, or the same below 0 to "
          "mirror" },
        { { .object = "\"transform\": {\"scale\": 1e6, \"fit_height\": 1e6}, " OBJECT },
          "4:13: objects[0] reaches to 5e+11 mm, expected at most 1e+09 mm" },
        { { .object = "\"transform\": {\"fit_height\": -1}, " OBJECT },
          "4:42: objects[0].transform.fit_height is -1, expected 1e-06 to 1e+06" },
        { { .object = "\"transform\": {\"rotate\": [1, 2, 3]}, " OBJECT },
          "4:28: unknown key \"rotate\" in objects[0].transform, expected fit_height, scale, rotate_deg, "
          "translate" },
        { { .object = "\"transform\": 3, " OBJECT },
          "4:27: objects[0].transform is a number, expected an object" },
        /* materials */
        { { .object = "\"primitive\": \"cube\", \"material\": \"mrble\"" },
          "4:47: objects[0].material is \"mrble\", which is no bundled material, expected one such as "
          "\"marble\", a path that ends in .json, or an object" },
        { { .object = "\"primitive\": \"cube\", \"material\": \"absent.json\"" },
          "4:47: objects[0].material path \"absent.json\" cannot be read: No such file or directory" },
        { { .object = "\"primitive\": \"cube\", \"material\": 3" },
          "4:47: objects[0].material is a number, expected an object" },
        { { .object =
                "\"primitive\": \"cube\", \"material\": {\"name\": \"m\", \"eta\": 0, \"sigma_a_per_mm\": "
                "[0, 1, 2], \"sigma_s_prime_per_mm\": [1, 2, 3]}" },
          "4:68: objects[0].material.eta is 0, expected > 0 (0.1 to 10)" },
    };
    write_text("sky.exr", "");
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_parts_refused(cases[i].parts, cases[i].expected);
}

/* Oracle: the messages, word by word. */
static void wrong_mesh_is_refused(void **state)
{
    (void)state;
    write_text("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    write_text("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                          "end_header\n0 0 0\n1 0 0\n");
    write_text("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n");
    write_text("far.obj", "v 0 0 0\nv 1e38 0 0\nv 0 1e38 0\nf 1 2 3\n");
    assert_parts_refused(
        (struct parts){ .object = "\"mesh\": \"absent.obj\", \"material\": " MATERIAL },
        "4:22: objects[0].mesh path \"absent.obj\" cannot be read: No such file or directory");
    assert_parts_refused((struct parts){ .object = "\"mesh\": \".\", \"material\": " MATERIAL },
                         "4:22: objects[0].mesh path \".\" leads out of this file's folder, expected one "
                         "inside, or --allow-path FOLDER");
    assert_parts_refused((struct parts){ .object = "\"mesh\": \"points.obj\", \"material\": " MATERIAL },
                         "4:22: objects[0].mesh \"points.obj\" has no triangles, expected at least one");
    assert_parts_refused(
        (struct parts){ .object = "\"mesh\": \"cut.ply\", \"material\": " MATERIAL },
        "4:22: objects[0].mesh \"cut.ply\" is cut short: it ends before the data that it announces");
    assert_parts_refused((struct parts){ .object =
                                             "\"mesh\": \"flat.obj\", \"transform\": {\"fit_height\": 1}, "
                                             "\"material\": " MATERIAL },
                         "4:62: objects[0].transform.fit_height is given, but the mesh has no height, "
                         "expected scale instead");
    assert_parts_refused((struct parts){ .object = "\"mesh\": \"far.obj\", \"material\": " MATERIAL },
                         "4:13: objects[0] reaches to 1e+38 mm, expected at most 1e+09 mm");
}

/* Oracle: the rule. What a scene refers to lies in its folder, or in one that the user allowed. */
static void path_out_of_the_folder_is_refused(void **state)
{
    (void)state;
    char here[2048], absolute[2100], object[2200], expected[4096];
    assert_non_null(getcwd(here, sizeof here));
    snprintf(absolute, sizeof absolute, "%s/outside.obj", here);
    mkdir("inside", 0777);
    unlink("inside/link.obj");
    assert_int_equal(symlink("../outside.obj", "inside/link.obj"), 0);
    write_text("outside.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_text("inside/m.json", MATERIAL);

    const char *const references[] = { "../outside.obj", "link.obj", absolute };
    const char *const allowed[] = { "." };
    const struct io_scene_options options = { .allowed_paths = allowed, .allowed_path_count = 1 };
    for (size_t i = 0; i < sizeof references / sizeof references[0]; i++) {
        snprintf(object, sizeof object, "\"mesh\": \"%s\", \"material\": \"m.json\"", references[i]);
        write_scene("inside/scene.json", &(struct parts){ .object = object });
        snprintf(
            expected, sizeof expected,
            "4:22: objects[0].mesh path \"%s\" leads out of this file's folder, expected one inside, or "
            "--allow-path FOLDER",
            references[i]);
        assert_refused("inside/scene.json", NULL, expected);
        io_scene_destroy(read_path("inside/scene.json", &options));
    }
    /* a picture's and a material's path are held to the same */
    write_text("outside.hdr", "");
    write_scene("inside/scene.json",
                &(struct parts){ .more = "\"environment\": {\"image\": \"../outside.hdr\"}" });
    assert_refused("inside/scene.json", NULL,
                   "5:26: environment.image path \"../outside.hdr\" leads out of this file's folder, "
                   "expected one inside, or --allow-path FOLDER");
    io_scene_destroy(read_path("inside/scene.json", &options));
    mkdir("inside/folder.exr", 0777);
    write_scene("inside/scene.json",
                &(struct parts){ .more = "\"environment\": {\"image\": \"folder.exr\"}" });
    assert_refused("inside/scene.json", NULL,
                   "5:26: environment.image is \"folder.exr\", which is no file");
    write_text("outside.json", MATERIAL);
    write_scene("inside/scene.json",
                &(struct parts){ .object = "\"primitive\": \"cube\", \"material\": \"../outside.json\"" });
    assert_refused("inside/scene.json", NULL,
                   "4:47: objects[0].material path \"../outside.json\" leads out of this file's folder, "
                   "expected one inside, or --allow-path FOLDER");
}

/* Oracle: the limits that docs/formats.md states. */
static void numbers_of_things_are_limited(void **state)
{
    (void)state;
    char *text = malloc(1 << 20);
    assert_non_null(text);
    strcpy(text, LIGHT);
    for (int i = 1; i < 65; i++)
        strcat(text, ", " LIGHT);
    char *whole = malloc(1 << 20);
    assert_non_null(whole);
    snprintf(whole, 1 << 20, "{\n\"camera\": {%s},\n\"lights\": [%s],\n\"objects\": [{%s}]\n}\n", CAMERA,
             text, OBJECT);
    write_text(PATH, whole);
    assert_refused(PATH, NULL, "3:11: lights has 65 elements, expected 1 to 64");
    strcpy(text, "{" OBJECT "}");
    for (int i = 1; i < 1025; i++)
        strcat(text, ", {" OBJECT "}");
    snprintf(whole, 1 << 20, "{\n\"camera\": {%s},\n\"lights\": [%s],\n\"objects\": [%s]\n}\n", CAMERA,
             LIGHT, text);
    write_text(PATH, whole);
    assert_refused(PATH, NULL, "4:12: objects has 1025 elements, expected 1 to 1024");
    free(text);
    free(whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_as_documented),
        cmocka_unit_test(every_key_arrives),
        cmocka_unit_test(scale_moves_normals_and_winding),
        cmocka_unit_test(rotations_go_x_then_y_then_z),
        cmocka_unit_test(fit_height_comes_before_the_rest),
        cmocka_unit_test(materials_come_in_three_ways),
        cmocka_unit_test(bundled_scenes_are_read),
        cmocka_unit_test(a_camera_is_chosen_by_name),
        cmocka_unit_test(wrong_cameras_are_refused),
        cmocka_unit_test(an_environment_is_found),
        cmocka_unit_test(frames_turn_camera_and_lights),
        cmocka_unit_test(turning_keeps_what_it_must),
        cmocka_unit_test(whole_turns_are_none),
        cmocka_unit_test(file_that_is_no_scene_is_refused),
        cmocka_unit_test(wrong_values_are_refused),
        cmocka_unit_test(wrong_mesh_is_refused),
        cmocka_unit_test(path_out_of_the_folder_is_refused),
        cmocka_unit_test(numbers_of_things_are_limited),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
