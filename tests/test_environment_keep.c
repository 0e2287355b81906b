/* renderer/environment_keep.c: which samples are kept between frames, and which are not. Beside it the same
 * with pictures: environment_draw.c. */
#include "check.h"

#include "renderer/environment_draw.h"
#include "renderer/environment_keep.h"
#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

#include <string.h>

/* ---- the list ----------------------------------------------------------------------------------- */

static const struct render_keep_key usual = { .light = 3, .spacing_mm = 0.5, .object = 1 };

static void put(struct render_keep *keep, size_t object, const struct render_keep_key *key, size_t count)
{
    struct render_light_samples *const samples = render_keep_begin(keep, object);
    assert_int_equal(samples->count, 0);
    for (size_t i = 0; i < count; i++)
        assert_true(render_light_samples_add(samples, &(struct render_light_sample){ .object = 1 }, NULL));
    render_keep_end(keep, object, key);
}

/* Oracle: by hand. Samples are found again with the key that they were put under and with no other, not
 * before they are all there, and not of another object. */
static void samples_are_found_by_their_key(void **state)
{
    (void)state;
    const struct render_keep_key others[] = {
        { .light = 4, .spacing_mm = 0.5, .object = 1 },
        { .light = 3, .spacing_mm = 0.6, .object = 1 },
        { .light = 3, .spacing_mm = 0.5, .object = 0 },
        { .light = 3, .spacing_mm = 0.5, .object = 1, .way = RENDER_ENVIRONMENT_PEEL },
        { .light = 3, .spacing_mm = 0.5, .object = 1, .ray_count = 16 },
    };
    struct io_object objects[2] = { { .mesh = (struct io_mesh *)objects }, { .mesh = NULL } };
    const struct io_scene scene = { .objects = objects, .object_count = 2 };
    struct render_keep *keep;
    assert_true(render_keep_create(2, &keep, NULL));
    render_keep_watch(keep, &scene);
    assert_null(render_keep_find(keep, 0, &usual));
    put(keep, 0, &usual, 5);
    assert_int_equal(render_keep_find(keep, 0, &usual)->count, 5);
    assert_null(render_keep_find(keep, 1, &usual));
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_null(render_keep_find(keep, 0, &others[i]));
    (void)render_keep_begin(keep, 0); /* and then it fails */
    assert_null(render_keep_find(keep, 0, &usual));
    put(keep, 0, &usual, 0);
    assert_int_equal(render_keep_find(keep, 0, &usual)->count, 0);
    assert_int_equal(render_keep_count(keep), 2);
    render_keep_destroy(keep);
}

/* Oracle: by hand. What changes an object's shape, anything of its pose or the mesh that it rests as, makes
 * its samples wrong and no other's; with rays those of all. The same pose again is no change; the pose
 * before is one. */
static void another_pose_is_another_shape(void **state)
{
    (void)state;
    static struct io_object objects[2];
    const struct io_mesh *const meshes = (const struct io_mesh *)objects;
    const struct io_scene scene = { .objects = objects, .object_count = 2 };
    const struct io_pose rest = { .deform_count = 1, .is_moved = true, .rotation = { { 1 } } };
    struct io_pose poses[9];
    struct render_keep *keep;
    for (int i = 0; i < 9; i++)
        poses[i] = rest;
    poses[0].deform_count = 0;
    poses[1].is_moved = false;
    poses[2].rotation[2][1] = 0.1;
    poses[3].shift_mm[0] = 1;
    poses[4].deforms[0].kind = IO_DEFORM_WAVE;
    poses[5].deforms[0].rate_rad_per_mm = 0.2;
    poses[6].deforms[0].amplitude_mm = 1;
    poses[7].deforms[0].phase_rad = 1;
    poses[8].deforms[0].axis[1] = 1;
    for (int with_rays = 0; with_rays < 2; with_rays++) {
        struct render_keep_key key = usual;
        key.ray_count = with_rays;
        assert_true(render_keep_create(2, &keep, NULL));
        for (int i = 0; i < 10; i++) {
            objects[0].rest = meshes;
            objects[0].pose = rest;
            render_keep_watch(keep, &scene);
            put(keep, 0, &key, 1);
            put(keep, 1, &key, 1);
            render_keep_watch(keep, &scene);
            const uint64_t changes = render_keep_changes(keep);
            assert_non_null(render_keep_find(keep, 0, &key));
            if (i < 9)
                objects[0].pose = poses[i];
            else
                objects[0].rest = meshes + 1;
            render_keep_watch(keep, &scene);
            assert_int_equal(render_keep_changes(keep), changes + 1);
            assert_null(render_keep_find(keep, 0, &key));
            assert_int_equal(render_keep_find(keep, 1, &key) == NULL, with_rays);
        }
        render_keep_destroy(keep);
    }
}

/* ---- pictures ----------------------------------------------------------------------------------- */

static const char PATH[] = SOURCE_FOLDER "/scenes/.test_environment_keep.json";

enum { WIDTH = 48, HEIGHT = 36 };

/* A twisting torus over ten frames beside a ball that stands still, under the studio. */
static struct io_scene *read_scene(void)
{
    const char material[] = "{\"name\": \"m\", \"eta\": 1.3, \"sigma_a_per_mm\": [0.1, 0.2, 0.3], "
                            "\"sigma_s_prime_per_mm\": [2, 2, 2]}";
    struct io_scene *scene;
    dipole_status status = { 0 };
    FILE *const file = fopen(PATH, "w");
    assert_non_null(file);
    fprintf(file,
            "{\"camera\": {\"eye\": [5, 15, 60], \"target\": [0, 0, 0], \"fov_y_deg\": 40, \"size\": [%d, "
            "%d]}, \"lights\": [], \"environment\": {\"image\": \"probes/studio.exr\"}, \"frames\": "
            "{\"count\": 10}, \"objects\": [{\"material\": %s, \"primitive\": \"torus\", \"detail\": 48, "
            "\"transform\": {\"scale\": 9, \"translate\": [10, 0, 0]}, \"deform\": [{\"kind\": \"twist\", "
            "\"axis\": [1, 0.3, 0], \"angle_deg\": [0, 200]}]}, {\"material\": %s, \"primitive\": "
            "\"sphere\", \"detail\": 48, \"transform\": {\"scale\": 6, \"translate\": [-10, 0, 0]}}]}\n",
            WIDTH, HEIGHT, material, material);
    assert_int_equal(fclose(file), 0);
    const bool done = io_scene_read(PATH, NULL, &scene, &status);
    remove(PATH);
    if (!done)
        fail_msg("%d:%d: %s", status.line, status.column, status.message);
    return scene;
}

static struct renderer *renderer_for(const struct io_scene *scene)
{
    struct renderer *renderer;
    dipole_status status;
    if (!render_create(scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    return renderer;
}

static struct io_image *draw(struct renderer *renderer, const struct render_options *options)
{
    struct io_image *image;
    dipole_status status;
    if (!render_draw(renderer, options, &image, NULL, &status))
        fail_msg("%s", status.message);
    return image;
}

/* The same picture to the last bit from a renderer that has kept nothing. */
static void expect_as_anew(const struct io_scene *scene, const struct render_options *options,
                           struct io_image *kept)
{
    struct renderer *const fresh = renderer_for(scene);
    struct io_image *const anew = draw(fresh, options);
    assert_memory_equal(kept->pixels, anew->pixels, 4 * sizeof(float) * WIDTH * HEIGHT);
    io_image_destroy(kept);
    io_image_destroy(anew);
    render_destroy(fresh);
}

/* Oracle: counts by hand, and a renderer that has kept nothing. A camera that moves has no object sampled
 * again; a frame that deforms one of two has one, and with rays both, since one may hide the other; the map
 * turned or scaled, or another epsilon, both. Pictures are the same to the last bit as without anything
 * kept. */
static void a_camera_keeps_what_a_deformation_does_not(void **state)
{
    (void)state;
    for (int way = 0; way < 3; way++) {
        struct render_options options = {
            .epsilon = 0.05,
            .technique = RENDER_TECHNIQUE_GATHER,
            .environment_samples = way == 1 ? RENDER_ENVIRONMENT_PEEL3 : RENDER_ENVIRONMENT_SURFACE,
            .ambient_visibility = way == 2 ? 16 : 0,
        };
        const size_t by_deforming = way == 2 ? 2 : 1;
        struct io_scene *const scene = read_scene();
        struct renderer *const renderer = renderer_for(scene);
        size_t expected = 2;
        io_image_destroy(draw(renderer, &options));
        const struct render_sky *const sky = render_executor_sky(renderer->executor);
        assert_int_equal(render_sky_sampled_count(sky), expected);

        scene->camera.eye_mm[0] += 12; /* both stay in sight */
        expect_as_anew(scene, &options, draw(renderer, &options));
        assert_int_equal(render_sky_sampled_count(sky), expected);

        io_scene_set_frame(scene, 4);
        expect_as_anew(scene, &options, draw(renderer, &options));
        expected += by_deforming;
        assert_int_equal(render_sky_sampled_count(sky), expected);
        io_image_destroy(draw(renderer, &options)); /* the same frame */
        assert_int_equal(render_sky_sampled_count(sky), expected);

        scene->environment.rotate_rad += 1;
        expect_as_anew(scene, &options, draw(renderer, &options));
        scene->environment.rgb[2] = 0.25;
        expect_as_anew(scene, &options, draw(renderer, &options));
        expected += 4;
        assert_int_equal(render_sky_sampled_count(sky), expected);

        options.epsilon = 0.03; /* less: tables of the profile are baked anew, too */
        expect_as_anew(scene, &options, draw(renderer, &options));
        assert_int_equal(render_sky_sampled_count(sky), expected + 2);
        render_destroy(renderer);
        io_scene_destroy(scene);
    }
}

/* Oracle: a renderer that has kept nothing. Going from pixels' own irradiance to samples and back, in and
 * out of frames, draws the same as anew. */
static void tables_follow_the_technique(void **state)
{
    (void)state;
    struct io_scene *const scene = read_scene();
    struct renderer *const renderer = renderer_for(scene);
    for (int i = 0; i < 6; i++) {
        const struct render_options options = { .epsilon = i < 3 ? 0.05 : 0.02,
                                                .technique = i % 2 ? RENDER_TECHNIQUE_SPLAT
                                                                   : RENDER_TECHNIQUE_LAMBERT };
        expect_as_anew(scene, &options, draw(renderer, &options));
    }
    render_destroy(renderer);
    io_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_are_found_by_their_key),
        cmocka_unit_test(another_pose_is_another_shape),
        cmocka_unit_test(a_camera_keeps_what_a_deformation_does_not),
        cmocka_unit_test(tables_follow_the_technique),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
