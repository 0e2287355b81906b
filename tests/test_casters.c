/* renderer/passage.c, casters.c, passes/light_layers.c, passes/tsm_shadow.c: objects that let light
 * through, and the penumbras of objects on themselves. */
#include "blockers.h"
#include "drawing.h"
#include "plans.h"

#include "renderer/casters.h"
#include "renderer/execute.h"
#include "renderer/passage.h"
#include "renderer/reference.h"
#include "renderer/reference_pixel.h"
#include "renderer/renderer.h"

enum { WIDTH = 100, HEIGHT = 75, PIXELS = WIDTH * HEIGHT };

static struct io_material jade(void)
{
    static const double sigma_a[3] = { 0.35, 0.02, 0.25 }, sigma_s_prime[3] = { 0.8, 0.9, 1.0 };
    struct io_material material = { .name = "jade" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] = (dipole_medium){ .sigma_a_per_mm = sigma_a[c],
                                    .sigma_s_prime_per_mm = sigma_s_prime[c],
                                    .eta = 1.6 };
    io_material_set_media(&material, media);
    return material;
}

static struct io_material grey_of(double sigma_a, double sigma_s_prime, double eta)
{
    struct io_material material = { .name = "grey" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] =
            (dipole_medium){ .sigma_a_per_mm = sigma_a, .sigma_s_prime_per_mm = sigma_s_prime, .eta = eta };
    io_material_set_media(&material, media);
    return material;
}

/* ---- what crosses a body ------------------------------------------------------------------------- */

/* Oracle: the beam model's slab (T23), of random media and lengths. Nodes a fifth apart: 0.3 % between
 * them. */
static void passage_is_that_of_a_slab(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    struct io_passage passage;
    for (int i = 0; i < 25; i++) {
        const struct io_material material =
            grey_of(log_uniform(&rng, 1e-4, 10), log_uniform(&rng, 1e-2, 10), log_uniform(&rng, 1, 2));
        const dipole_medium *const medium = &material.layers[0][0].medium;
        const double path_mm = 1 / (medium->sigma_a_per_mm + medium->sigma_s_prime_per_mm);
        assert_true(render_passage_fill(&material, &passage, NULL));
        double before = 1;
        for (double length_mm = 1e-3 * path_mm; length_mm < 100 * path_mm; length_mm *= 1.37) {
            const dipole_layer layer = { .medium = *medium, .thickness_mm = length_mm };
            dipole_stack *stack;
            assert_true(dipole_stack_create(&layer, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL));
            const double expected = (1 - dipole_fresnel_reflectance(medium->eta, 1)) *
                                    (dipole_stack_total(stack, DIPOLE_FACE_FAR) +
                                     dipole_stack_unscattered(stack, DIPOLE_FACE_FAR));
            const double found = render_passage_left(&passage, length_mm, 1);
            dipole_stack_destroy(stack);
            if (fabs(found - expected) > 3e-3 * expected + 1e-7)
                fail_msg("case %d at %g paths: %g, expected %g", i, length_mm / path_mm, found, expected);
            assert_true(found <= before && found >= 0);
            before = found;
        }
    }
}

/* Oracle: limits. Nothing in the way but two faces; no scattering; and what nothing crosses. */
static void passage_reaches_its_limits(void **state)
{
    (void)state;
    struct io_passage passage;
    const struct io_material clear = grey_of(0.1, 0, 1.5), dense = grey_of(100, 100, 1);
    assert_true(render_passage_fill(&clear, &passage, NULL));
    const double face = dipole_fresnel_reflectance(1.5, 1);
    assert_close(render_passage_left(&passage, 0, 0), (1 - face) * (1 - face) / (1 - face * face), 1e-3,
                 "two faces");
    assert_close(render_passage_left(&passage, 20, 0), (1 - face) * (1 - face) * exp(-2), 2e-3,
                 "Beer's law");
    assert_true(render_passage_fill(&dense, &passage, NULL));
    assert_true(render_passage_left(&passage, 10, 2) < 1e-30);
    assert_true(render_passage_left(&passage, 1e30, 2) == 0);
}

/* ---- which objects ------------------------------------------------------------------------------- */

static void shape(struct io_mesh *mesh, double width, double height, double y_mm)
{
    const double scale[3] = { width, height, width };
    for (int k = 0; k < 3; k++) {
        const float by = (float)scale[k], to = k == 1 ? (float)y_mm : 0;
        for (size_t v = 0; v < mesh->vertex_count; v++)
            mesh->positions[3 * v + (size_t)k] = mesh->positions[3 * v + (size_t)k] * by + to;
        mesh->min[k] = mesh->min[k] * by + to;
        mesh->max[k] = mesh->max[k] * by + to;
    }
}

/* A slab of marble, and over it a body of a material: a sphere flattened to so much of its radius. */
static void begin(struct test_scene *test, const struct io_material *material, double radius_mm,
                  double flatness, double y_mm)
{
    const struct io_material below = marble();
    scene_init(test, 0);
    assert_true(scene_add(test, IO_PRIMITIVE_SLAB, 8, 20, 0, &below));
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 64, radius_mm, 0, material));
    shape(test->objects[1].mesh, 1, flatness, y_mm);
    test->scene.max_mm[1] = fmax(test->scene.max_mm[1], y_mm + radius_mm);
    struct io_camera *const camera = &test->scene.camera;
    memcpy(camera->eye_mm, (double[3]){ 2, 40, 30 }, sizeof camera->eye_mm);
    camera->fov_y_rad = 0.6;
    camera->width_px = WIDTH;
    camera->height_px = HEIGHT;
}

struct case_of_caster {
    const char *what;
    double radius_mm, flatness, y_mm;
    double from_y; /* where parallel light comes from */
    enum io_casts casts;
    double epsilon;
    bool is_open, is_marble, lets_through;
};

/* Oracle: docs/shadows.md. */
static void objects_let_light_through_where_they_should(void **state)
{
    (void)state;
    static const struct case_of_caster cases[] = {
        { "leaf", 6, 0.08, 4, 1, IO_CASTS_AUTO, 0.01, false, false, true },
        { "ball", 6, 1, 7, 1, IO_CASTS_AUTO, 0.01, false, false, false },
        { "ball that is asked to", 6, 1, 7, 1, IO_CASTS_TRANSLUCENT, 0.01, false, false, true },
        { "leaf that is asked not to", 6, 0.08, 4, 1, IO_CASTS_OPAQUE, 0.01, false, false, false },
        { "leaf far away", 6, 0.2, 60, 1, IO_CASTS_AUTO, 0.01, false, true, false },
        { "leaf far away that is asked to", 6, 0.2, 60, 1, IO_CASTS_TRANSLUCENT, 0.01, false, true, true },
        { "very thin leaf far away", 6, 0.004, 60, 1, IO_CASTS_AUTO, 0.01, false, false, true },
        { "leaf behind the slab", 6, 0.08, 4, -1, IO_CASTS_AUTO, 0.01, false, false, false },
        { "leaf with a hole", 6, 0.08, 4, 1, IO_CASTS_TRANSLUCENT, 0.01, true, false, false },
        { "thick leaf, all but opaque", 60, 0.1, 9, 1, IO_CASTS_AUTO, 0.3, false, false, false },
        { "the same for a small epsilon", 60, 0.1, 9, 1, IO_CASTS_AUTO, 0.0001, false, false, true },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct test_scene test;
        struct render_media *media;
        struct render_casters casters;
        const struct io_material material = cases[i].is_marble ? marble() : jade();
        begin(&test, &material, cases[i].radius_mm, cases[i].flatness, cases[i].y_mm);
        test.objects[0].casts = IO_CASTS_OPAQUE;
        test.objects[1].casts = cases[i].casts;
        test.objects[1].mesh->triangle_count -= cases[i].is_open;
        scene_add_directional(&test, 0.2, -cases[i].from_y, 0.1, 1);
        assert_true(render_media_create(&test.scene, &media, NULL));
        assert_true(render_casters_init(&test.scene, media, cases[i].epsilon, &casters, NULL));
        if (casters.lets_through[1] != cases[i].lets_through || casters.lets_through[0])
            fail_msg("%s: %s", cases[i].what, casters.opaque_reason);
        assert_int_equal(casters.count, cases[i].lets_through);
        render_casters_end(&casters);
        render_media_destroy(media);
        scene_end(&test);
    }
}

/* Oracle: docs/shadows.md. An opaque object calls for nothing; one that lets light through for maps of what
 * it leaves, in colour. A capture, whose medium is not known, takes it for opaque. */
static void plans_call_for_maps_of_what_is_left(void **state)
{
    (void)state;
    static const char *const names[] = { "shadow_map", "avsm", "avsm_colour", "tsm_shadow", "tsm_avsm" };
    static const struct {
        enum render_technique technique;
        bool is_leaf, is_captured;
        const char *active;
    } cases[] = {
        { RENDER_TECHNIQUE_GATHER, true, false, "xxx--" },
        { RENDER_TECHNIQUE_GATHER, false, false, "-----" },
        { RENDER_TECHNIQUE_TSM, true, false, "--xxx" },
        { RENDER_TECHNIQUE_TSM, false, false, "-----" },
        { RENDER_TECHNIQUE_SPLAT, true, true, "-----" },
    };
    const struct io_material material = jade();
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct test_scene test;
        char active[6] = "";
        begin(&test, &material, 6, cases[i].is_leaf ? 0.08 : 1, 7);
        scene_add_directional(&test, 0.2, -1, 0.1, 1);
        struct render_plan *const plan =
            plan_for(&(struct render_request){ .scene = &test.scene,
                                               .technique = cases[i].technique,
                                               .is_captured = cases[i].is_captured,
                                               .epsilon = 0.01 });
        for (size_t e = 0; e < 5; e++)
            strcat(active, decision_of(plan, names[e])->is_active ? "x" : "-");
        assert_string_equal(active, cases[i].active);
        if (!cases[i].is_leaf)
            assert_non_null(strstr(decision_of(plan, "avsm")->reason, "is not thin"));
        assert_int_equal(plan->shadows.object_count, strchr(active, 'x') != NULL);
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* ---- shadows ------------------------------------------------------------------------------------- */

static float *read_texture(struct renderer *renderer, const char *name)
{
    float *const pixels = malloc(4 * PIXELS * sizeof *pixels);
    assert_non_null(pixels);
    assert_true(render_executor_read(renderer->executor, name, pixels, NULL));
    return pixels;
}

struct errors {
    double rmse, bias, least, rmse_of_itself;
};

/* Shadow factors of pixels, against rays to 256 points of the light and through the objects. */
static struct errors errors_of(const struct test_scene *test)
{
    struct errors errors = { .least = 1 };
    struct renderer *const renderer = renderer_of(test, RENDER_CONTEXT_DEFAULT);
    struct render_plan *plan;
    struct render_tracer *tracer;
    double time_ms[RENDER_EFFECT_LIMIT];
    assert_true(render_run(renderer,
                           &(struct render_request){ .scene = renderer->scene,
                                                     .media = renderer->media,
                                                     .technique = RENDER_TECHNIQUE_LAMBERT,
                                                     .epsilon = 0.01 },
                           &plan, time_ms, NULL));
    assert_int_equal(plan->shadows.object_count, 1);
    assert_true(render_tracer_create_with(renderer->scene, &plan->shadows.casters, &tracer, NULL));
    float *const shadow = read_texture(renderer, "shadow"),
                 *const position_mm = read_texture(renderer, "position_mm"),
                 *const normal = read_texture(renderer, "normal");
    int count = 0, count_of_itself = 0;
    for (int i = 0; i < PIXELS; i++) {
        const float *const p = position_mm + 4 * i, *const n = normal + 4 * i;
        double left[3];
        if (!(p[3] > 0))
            continue;
        struct render_surface_point point = { .object = (size_t)p[3] - 1 };
        for (int k = 0; k < 3; k++) {
            point.position_mm[k] = (double)p[k];
            point.facet_normal[k] = point.normal[k] = (double)n[k];
        }
        render_light_left(tracer, &test->lights[0], &point, 256, left);
        for (int c = 0; c < 3; c++) {
            const double error = (double)shadow[4 * i + c] - left[c];
            assert_true(shadow[4 * i + c] >= 0 && shadow[4 * i + c] < 1.0001f);
            *(point.object == 0 ? &errors.rmse : &errors.rmse_of_itself) += error * error;
            errors.bias += point.object == 0 ? error : 0;
            errors.least = fmin(errors.least, point.object == 0 ? left[c] : 1);
        }
        count += 3 * (point.object == 0);
        count_of_itself += 3 * (point.object == 1);
    }
    errors.rmse = sqrt(errors.rmse / count);
    errors.rmse_of_itself = sqrt(errors.rmse_of_itself / fmax(count_of_itself, 1));
    errors.bias /= count;
    free(shadow);
    free(position_mm);
    free(normal);
    render_tracer_destroy(tracer);
    render_plan_destroy(plan);
    render_destroy(renderer);
    return errors;
}

/* Oracle: rays. Of jade; all but clear, and all but opaque; and of what touches the receiver. On the object
 * itself interpolated normals say otherwise than facets where the light sets: a factor of next to no light.
 */
static void shadows_of_objects_are_near_those_of_rays(void **state)
{
    (void)state;
    const struct {
        const char *what;
        struct io_material material;
        double y_mm, bound;
    } cases[] = {
        { "leaf", jade(), 5, 0.002 },
        { "all but clear", grey_of(1e-5, 1e-3, 1.0), 5, 0.0005 },
        { "all but opaque", grey_of(3, 3, 1.3), 5, 0.004 },
        { "touching", jade(), 0.48, 0.004 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        for (int is_parallel = 0; is_parallel < 2; is_parallel++) {
            struct test_scene test;
            begin(&test, &cases[i].material, 6, 0.08, cases[i].y_mm);
            test.objects[1].casts = IO_CASTS_TRANSLUCENT;
            if (is_parallel)
                scene_add_directional(&test, 0.3, -1, -0.2, 1);
            else
                scene_add_point(&test, -3, 60, 2, 1);
            test.lights[0].size_mm = is_parallel ? 0 : 3;
            test.lights[0].size_rad = is_parallel ? 0.15 : 0;
            const struct errors found = errors_of(&test);
            print_message("  %s, %s light: rmse %.4f, mean %+.4f, least factor %.3f; of itself %.4f\n",
                          cases[i].what, is_parallel ? "parallel" : "point", found.rmse, found.bias,
                          found.least, found.rmse_of_itself);
            assert_true(found.rmse < cases[i].bound && fabs(found.bias) < 0.001 &&
                        found.rmse_of_itself < 0.06);
            scene_end(&test);
        }
    }
}

/* ---- light that enters --------------------------------------------------------------------------- */

static struct deviation against(const struct io_image *found, const struct io_image *expected)
{
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < (size_t)found->width_px * (size_t)found->height_px; i++) {
        for (size_t c = 0; c < 3 && expected->pixels[4 * i + 3] >= 1 && found->pixels[4 * i + 3] >= 1; c++)
            deviation_add(&deviation, (double)found->pixels[4 * i + c],
                          (double)expected->pixels[4 * i + c]);
    }
    return deviation;
}

/* A medium whose light spreads over some pixels, and is soon summed. */
static struct io_material wide(void)
{
    return grey_of(0.1, 1, 1.3);
}

/* Oracle: the reference's picture. A torus that hides a wide light from itself: light enters where its own
 * rim hides the middle of the light. The error was 0.045 without the second surface. */
static void light_enters_in_an_objects_penumbra_on_itself(void **state)
{
    (void)state;
    struct test_scene test;
    struct io_image *expected;
    dipole_status status;
    const struct io_material material = wide();
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_TORUS, 64, 12, 0, &material));
    test.objects[0].has_specular = false;
    memcpy(test.scene.camera.eye_mm, (double[3]){ 0, 40, 30 }, sizeof test.scene.camera.eye_mm);
    scene_add_directional(&test, 1, -0.45, 0.1, 1);
    test.lights[0].size_rad = 0.3;
    if (!render_reference_draw(&test.scene, &(struct render_options){ .epsilon = 0.1 }, &expected, NULL,
                               &status))
        fail_msg("%s", status.message);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const found = draw(renderer, &(struct render_options){ .epsilon = 0.01 }, NULL);
    const struct deviation deviation = against(found, expected);
    print_message("  relative rmse %.4f\n", relative_rmse(&deviation));
    assert_true(relative_rmse(&deviation) < 0.02);
    io_image_destroy(found);
    io_image_destroy(expected);
    render_destroy(renderer);
    scene_end(&test);
}

/* What shadows leave of a picture: the picture over that of the first object alone under the bare light.
 * Ends both. */
static float *part_left(struct io_image *shaded, struct io_image *bare)
{
    float *const part = calloc(3 * PIXELS, sizeof *part);
    assert_non_null(part);
    for (size_t i = 0; i < PIXELS; i++) {
        for (size_t c = 0; c < 3 && bare->pixels[4 * i + 3] >= 1; c++)
            part[3 * i + c] = shaded->pixels[4 * i + c] / bare->pixels[4 * i + c];
    }
    io_image_destroy(shaded);
    io_image_destroy(bare);
    return part;
}

static float *part_by(struct test_scene *test, const struct io_light *bare,
                      const struct render_options *options)
{
    const struct io_scene kept = test->scene;
    const struct io_light light = test->lights[0];
    struct renderer *renderer = renderer_of(test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const shaded = draw(renderer, options, NULL);
    render_destroy(renderer);
    test->scene.object_count = 1;
    test->scene.blocker_count = 0;
    test->lights[0] = *bare;
    renderer = renderer_of(test, RENDER_CONTEXT_DEFAULT);
    float *const part = part_left(shaded, draw(renderer, options, NULL));
    render_destroy(renderer);
    test->scene = kept;
    test->lights[0] = light;
    return part;
}

/* Oracle: gathering. Of a slab's light translucent shadow maps leave the same part in penumbras, in colour,
 * through objects, within a spot's cone: what errs in their sums is in both pictures. Off by more than a
 * tenth are pixels that show what stands before the slab. */
static void maps_see_the_same_light_enter(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct test_scene test;
        const struct io_material material = jade();
        struct io_blocker pane = blocker_of(IO_PRIMITIVE_CUBE, 4, 4, 9);
        begin(&test, &material, 6, 0.08, 5);
        test.objects[0].material = wide();
        test.objects[0].has_specular = test.objects[1].has_specular = false;
        for (int c = 0; c < 3; c++)
            pane.opacity[c] = 0.45 * c;
        test.scene.blockers = &pane;
        test.scene.blocker_count = i == 1;
        test.scene.object_count = i == 0 ? 2 : 1;
        scene_add_point(&test, -5, 50, 8, 2000);
        const struct io_light bare = test.lights[0];
        test.lights[0].size_mm = i < 2 ? 8 : 0;
        test.lights[0].is_spot = i == 2;
        test.lights[0].direction[1] = -1;
        test.lights[0].cone_rad = 0.4;
        test.lights[0].cone_blend = 0.3;
        float *const expected =
            part_by(&test, &bare, &(struct render_options){ .technique = RENDER_TECHNIQUE_GATHER });
        float *const found =
            part_by(&test, &bare, &(struct render_options){ .technique = RENDER_TECHNIQUE_TSM });
        double error2 = 0, least = 1;
        int count = 0, wrong_count = 0;
        for (int p = 0; p < 3 * PIXELS; p++) {
            const double error = (double)(found[p] - expected[p]);
            if (expected[p] == 0)
                continue;
            least = fmin(least, (double)expected[p]);
            wrong_count += fabs(error) > 0.1;
            error2 += fabs(error) > 0.1 ? 0 : error * error;
            count++;
        }
        print_message("  case %d: rmse %.4f of parts down to %.2f, %.2f %% off by over 0.1\n", i,
                      sqrt(error2 / count), least, 100.0 * wrong_count / count);
        assert_true(count > PIXELS && sqrt(error2 / count) < 0.02 && least < 0.5);
        assert_true(wrong_count < (i == 0 ? 0.1 : 0.005) * count);
        free(expected);
        free(found);
        io_mesh_destroy(pane.mesh);
        test.scene.object_count = 2;
        scene_end(&test);
    }
}

/* Oracle: rays. A light within a ball that lets light through, seen in six views: Lambert's picture of the
 * slab over that without the ball. */
static void light_comes_out_of_an_object(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = jade();
    struct render_tracer *tracer;
    struct render_casters casters;
    begin(&test, &material, 5, 0.9, 24);
    test.objects[0].has_specular = test.objects[1].has_specular = false;
    test.objects[1].casts = IO_CASTS_TRANSLUCENT;
    scene_add_point(&test, -1, 24, 1, 1);
    const struct io_light bare = test.lights[0];
    test.lights[0].size_mm = 0.05; /* of a larger one faces of the cube see too little: docs/shadows.md */
    float *const part =
        part_by(&test, &bare, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT });
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    io_image_destroy(
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, NULL));
    float *const position_mm = read_texture(renderer, "position_mm");
    assert_true(render_casters_init(&test.scene, renderer->media, 0.01, &casters, NULL));
    assert_true(render_tracer_create_with(&test.scene, &casters, &tracer, NULL));
    double error2 = 0, mean = 0;
    int count = 0;
    for (int i = 0; i < PIXELS; i++) {
        const float *const p = position_mm + 4 * i;
        if (p[3] != 1 || p[1] < -0.01f || part[3 * i] == 0)
            continue;
        const struct render_surface_point point = { .position_mm = { (double)p[0], (double)p[1],
                                                                     (double)p[2] },
                                                    .normal = { 0, 1, 0 },
                                                    .facet_normal = { 0, 1, 0 } };
        double left[3];
        render_light_left(tracer, &test.lights[0], &point, 256, left);
        for (int c = 0; c < 3; c++) {
            error2 += pow((double)part[3 * i + c] - left[c], 2);
            mean += left[c];
            count++;
        }
    }
    print_message("  rmse %.4f of factors of %.3f\n", sqrt(error2 / count), mean / count);
    assert_true(count > PIXELS && sqrt(error2 / count) < 0.02);
    free(part);
    free(position_mm);
    render_tracer_destroy(tracer);
    render_casters_end(&casters);
    render_destroy(renderer);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(passage_is_that_of_a_slab),
        cmocka_unit_test(passage_reaches_its_limits),
        cmocka_unit_test(objects_let_light_through_where_they_should),
        cmocka_unit_test(plans_call_for_maps_of_what_is_left),
        cmocka_unit_test(shadows_of_objects_are_near_those_of_rays),
        cmocka_unit_test(light_enters_in_an_objects_penumbra_on_itself),
        cmocka_unit_test(maps_see_the_same_light_enter),
        cmocka_unit_test(light_comes_out_of_an_object),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
