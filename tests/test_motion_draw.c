/* Objects in motion, drawn: the pose pass against io/deform.c, light, order of frames, ways of sampling.
 */
#include "check.h"

#include "renderer/plan.h"
#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

#include <stdlib.h>
#include <string.h>

static const char PATH[] = "motion.json";

enum { WIDTH = 160, HEIGHT = 120, PIXELS = WIDTH * HEIGHT };

/* A scene of ten frames whose one object, or first of two, is as told. */
static struct io_scene *read_scene(const char *object, const char *others)
{
    struct io_scene *scene;
    dipole_status status = { 0 };
    FILE *const file = fopen(PATH, "w");
    assert_non_null(file);
    fprintf(
        file,
        "{\"camera\": {\"eye\": [5, 15, 40], \"target\": [0, 0, 0], \"fov_y_deg\": 40, \"size\": [%d, "
        "%d]},\n\"lights\": [{\"kind\": \"directional\", \"direction\": [-1, -2, -3], \"irradiance\": 3}, "
        "{\"kind\": \"point\", \"position\": [20, 5, 10], \"intensity\": 900}],\n\"frames\": {\"count\": "
        "10},\n\"objects\": [{\"material\": {\"name\": \"m\", \"eta\": 1.3, \"sigma_a_per_mm\": [0.1, 0.2, "
        "0.3], \"sigma_s_prime_per_mm\": [2, 2, 2]}, %s}%s]}\n",
        WIDTH, HEIGHT, object, others);
    assert_int_equal(fclose(file), 0);
    if (!io_scene_read(PATH, NULL, &scene, &status))
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

static struct render_plan *run_request(struct renderer *renderer, const struct render_request *request)
{
    struct render_plan *plan;
    double time_ms[RENDER_EFFECT_LIMIT];
    dipole_status status;
    if (!render_run(renderer, request, &plan, time_ms, &status))
        fail_msg("%s", status.message);
    return plan;
}

static struct render_plan *run(struct renderer *renderer, enum render_technique technique,
                               enum render_coherence coherence)
{
    return run_request(renderer, &(struct render_request){ .scene = renderer->scene,
                                                           .media = renderer->media,
                                                           .technique = technique,
                                                           .coherence = coherence,
                                                           .epsilon = 0.05 });
}

static const struct render_decision *decision(const struct render_plan *plan, const char *name)
{
    for (size_t e = 0; render_effects[e]; e++) {
        if (strcmp(render_effects[e]->name, name) == 0)
            return &plan->decisions[e];
    }
    fail_msg("no effect %s", name);
    return NULL;
}

static float *read_texture(struct renderer *renderer, const char *name)
{
    float *const pixels = malloc(4 * PIXELS * sizeof *pixels);
    assert_non_null(pixels);
    assert_true(render_executor_read(renderer->executor, name, pixels, NULL));
    return pixels;
}

#define TORUS "\"primitive\": \"torus\", \"detail\": 96, \"transform\": {\"scale\": 9}, "

static const char *const motions[] = {
    TORUS "\"deform\": [{\"kind\": \"twist\", \"axis\": [1, 0.3, 0], \"angle_deg\": [0, 200]}]",
    TORUS "\"deform\": [{\"kind\": \"bend\", \"axis\": [1, 0, 0], \"toward\": [0, 1, 0], \"angle_deg\": "
          "[0, 160]}]",
    TORUS
    "\"deform\": [{\"kind\": \"wave\", \"axis\": [1, 0, 0], \"toward\": [0, 1, 0], \"amplitude\": 1.5, "
    "\"wavelength\": 8, \"cycles\": 1, \"phase_deg\": 50}]",
    TORUS "\"motion\": {\"turn_deg\": 200, \"axis\": [1, 1, 0], \"translate\": [3, 0, -4]}",
    TORUS
    "\"deform\": [{\"kind\": \"bend\", \"axis\": [1, 0, 0], \"toward\": [0, 1, 0], \"angle_deg\": 60}, "
    "{\"kind\": \"twist\", \"angle_deg\": [0, 90]}, {\"kind\": \"wave\", \"amplitude\": 1, \"wavelength\": "
    "9}], \"motion\": {\"turn_deg\": 200}",
};

/* The same scene as it stands, its meshes posed by io/deform.c and nothing left for the shaders to do. */
static void freeze(struct io_scene *scene)
{
    for (size_t i = 0; i < scene->object_count; i++) {
        scene->objects[i].rest = scene->objects[i].mesh;
        scene->objects[i].pose = (struct io_pose){ .deform_count = 0 };
    }
}

/* Pixels whose values are farther apart than the tolerance, or that one picture covers alone: at edges,
 * those of a part before another too, float rounding may move one by a pixel. */
static size_t count_different(const float *a, const float *b, double tolerance, size_t *count)
{
    size_t different = 0;
    for (size_t i = 0; i < PIXELS; i++) {
        const bool is_in_a = a[4 * i + 3] > 0, is_in_b = b[4 * i + 3] > 0;
        double distance2 = is_in_a == is_in_b ? 0 : INFINITY;
        for (size_t k = 0; k < 3 && is_in_a && is_in_b; k++)
            distance2 += pow((double)a[4 * i + k] - (double)b[4 * i + k], 2);
        *count += is_in_a;
        different += distance2 > tolerance * tolerance;
    }
    return different;
}

/* Oracle: io/deform.c in double, which poses the meshes of the second picture. Float positions of 10 mm
 * round by 1e-6; what a vertex moves by is multiplied by the slope of the surface against the view. */
static void shaders_deform_as_the_library_does(void **state)
{
    (void)state;
    for (size_t m = 0; m < sizeof motions / sizeof *motions; m++) {
        struct io_scene *const scene = read_scene(motions[m], "");
        io_scene_set_frame(scene, 4);
        float *positions[2], *normals[2];
        for (int is_frozen = 0; is_frozen < 2; is_frozen++) {
            if (is_frozen)
                freeze(scene);
            struct renderer *const renderer = renderer_for(scene);
            render_plan_destroy(run(renderer, RENDER_TECHNIQUE_LAMBERT, RENDER_COHERENCE_NONE));
            positions[is_frozen] = read_texture(renderer, "position_mm");
            normals[is_frozen] = read_texture(renderer, "normal");
            for (size_t i = 0; i < PIXELS; i++) /* roughness, which may be 0, tells no coverage */
                normals[is_frozen][4 * i + 3] = positions[is_frozen][4 * i + 3];
            render_destroy(renderer);
        }
        size_t count = 0;
        assert_true(count_different(positions[0], positions[1], 2e-4, &count) < 12);
        assert_true(count_different(normals[0], normals[1], 2e-4, &count) < 12);
        assert_true(count > 2000);
        for (int i = 0; i < 2; i++) {
            free(positions[i]);
            free(normals[i]);
        }
        io_scene_destroy(scene);
    }
}

static double sample_flux_w(const struct renderer *renderer)
{
    const struct render_light_samples *const samples =
        render_splatter_samples(render_executor_splatter(renderer->executor), 0);
    double sum = 0;
    for (size_t i = 0; i < samples->count; i++)
        sum += (double)samples->samples[i].flux_w[0];
    return sum;
}

static double picture_sum(struct renderer *renderer, const char *texture)
{
    float *const pixels = read_texture(renderer, texture);
    double sum = 0;
    for (size_t i = 0; i < PIXELS; i++)
        sum += (double)pixels[4 * i];
    free(pixels);
    return sum;
}

/* Oracle: conservation. However it is sampled, the same light enters, as the same mesh at rest gets; and by
 * as much of epsilon, 5 %, the pictures agree in all. */
static void all_ways_of_sampling_keep_the_energy(void **state)
{
    (void)state;
    static const enum render_coherence kinds[] = { RENDER_COHERENCE_NONE, RENDER_COHERENCE_TWO_PASS,
                                                   RENDER_COHERENCE_SURFACE, RENDER_COHERENCE_AUTO };
    for (size_t m = 0; m < sizeof motions / sizeof *motions; m++) {
        struct io_scene *const scene = read_scene(motions[m], "");
        io_scene_set_frame(scene, 4);
        struct renderer *const renderer = renderer_for(scene);
        double flux_w[6], sums[6];
        for (int k = 0; k < 5; k++) { /* the last: gathered, and by default */
            render_plan_destroy(run(renderer, k < 4 ? RENDER_TECHNIQUE_SPLAT : RENDER_TECHNIQUE_GATHER,
                                    kinds[k < 4 ? k : 3]));
            flux_w[k] = sample_flux_w(renderer);
            sums[k] = picture_sum(renderer, "radiosity");
        }
        render_destroy(renderer);
        freeze(scene);
        struct renderer *const frozen = renderer_for(scene);
        render_plan_destroy(run(frozen, RENDER_TECHNIQUE_SPLAT, RENDER_COHERENCE_NONE));
        flux_w[5] = sample_flux_w(frozen);
        sums[5] = picture_sum(frozen, "radiosity");
        render_destroy(frozen);
        for (int k = 1; k < 6; k++) { /* a texel at an edge may go either way: 1 of some 1e5 */
            assert_close(flux_w[k], flux_w[0], k == 5 ? 1e-4 : 1e-6, "motion %zu, way %d", m, k);
            assert_close(sums[k], sums[0], 0.01, "motion %zu, way %d", m, k);
        }
        assert_true(sums[3] == sums[2]); /* the default is the surface */
        io_scene_destroy(scene);
    }
}

/* Oracle: each other. What lights see is drawn in memory where OpenGL is software, and by OpenGL elsewhere:
 * the same light enters, and gloss has the same shadows. */
static void views_in_memory_are_those_of_opengl(void **state)
{
    (void)state;
    static const enum render_coherence kinds[] = { RENDER_COHERENCE_NONE, RENDER_COHERENCE_TWO_PASS,
                                                   RENDER_COHERENCE_SURFACE };
    static const char *const textures[] = { "radiosity", "specular" };
    for (size_t m = 0; m < sizeof motions / sizeof *motions; m++) {
        struct io_scene *const scene = read_scene(motions[m], "");
        io_scene_set_frame(scene, 4);
        scene->objects[0].has_specular = true;
        scene->objects[0].roughness = 0.4;
        struct renderer *const renderer = renderer_for(scene);
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
            float *pictures[2][2];
            for (int has_gpu = 0; has_gpu < 2; has_gpu++) {
                const struct render_request request = { .scene = scene,
                                                        .media = renderer->media,
                                                        .technique = RENDER_TECHNIQUE_GATHER,
                                                        .gather = RENDER_GATHER_C,
                                                        .coherence = kinds[k],
                                                        .epsilon = 0.05 };
                renderer->has_gpu = has_gpu;
                struct render_plan *const plan = run_request(renderer, &request);
                assert_int_equal(decision(plan, "light_view")->is_active, has_gpu);
                assert_int_equal(decision(plan, "light_picture")->is_active, !has_gpu);
                render_plan_destroy(plan);
                for (int t = 0; t < 2; t++)
                    pictures[has_gpu][t] = read_texture(renderer, textures[t]);
            }
            for (int t = 0; t < 2; t++) {
                double error2 = 0, value2 = 0;
                for (size_t i = 0; i < 4 * PIXELS; i++) {
                    const double a = (double)pictures[0][t][i], b = (double)pictures[1][t][i];
                    error2 += (a - b) * (a - b);
                    value2 += b * b;
                }
                assert_true(value2 > 0 && error2 < 0.003 * 0.003 * value2);
                free(pictures[0][t]);
                free(pictures[1][t]);
            }
        }
        render_destroy(renderer);
        io_scene_destroy(scene);
    }
}

/* Oracle: bytes. A frame is the same picture, whatever frames were drawn before; objects in one scene:
 * a sequence of two solids and an open mesh, deformations, a motion that is at rest in frame 0. */
static void frames_do_not_depend_on_those_before(void **state)
{
    (void)state;
    FILE *file;
    static const char *const fronts[] = { "f 2 3 4\n", "v 2 2 2\nf 2 3 5\nf 3 4 5\nf 4 2 5\n", "" };
    for (int i = 0; i < 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "step_%d.obj", i);
        file = fopen(name, "w");
        assert_non_null(file);
        fprintf(file, "v 0 0 0\nv %d 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\n%s", 3 + i,
                fronts[i]);
        assert_int_equal(fclose(file), 0);
    }
    static const enum render_technique techniques[] = { RENDER_TECHNIQUE_SPLAT, RENDER_TECHNIQUE_GATHER,
                                                        RENDER_TECHNIQUE_TSM };
    for (int t = 0; t < 3; t++) {
        struct io_scene *const scene = read_scene(
            motions[4],
            ", {\"mesh_sequence\": {\"pattern\": \"step_%d.obj\", \"first\": 0, \"count\": 3}, "
            "\"transform\": {\"translate\": [9, 5, 0]}, \"material\": {\"name\": \"n\", \"eta\": 1.3, "
            "\"sigma_a_per_mm\": [0.3, 0.2, 0.1], \"sigma_s_prime_per_mm\": [3, 3, 3]}}, "
            "{\"primitive\": \"cube\", \"detail\": 6, \"transform\": {\"translate\": [-9, 6, 0], "
            "\"scale\": 3}, "
            "\"motion\": {\"turn_deg\": 90}, \"material\": {\"name\": \"n\", \"eta\": 1.3, "
            "\"sigma_a_per_mm\": [0.3, 0.2, 0.1], \"sigma_s_prime_per_mm\": [3, 3, 3]}}");
        struct renderer *renderer = renderer_for(scene);
        const struct render_options options = { .technique = techniques[t],
                                                .epsilon = 0.1,
                                                .tsm = { .gather = RENDER_TSM_VERTEX, .layer_count = 2 } };
        struct io_image *alone[3], *later = NULL;
        dipole_status status;
        const int frames[3] = { 0, 5, 7 };
        for (int i = 0; i < 3; i++) {
            io_scene_set_frame(scene, frames[i]);
            struct renderer *const fresh = renderer_for(scene);
            if (!render_draw(fresh, &options, &alone[i], NULL, &status))
                fail_msg("%s", status.message);
            render_destroy(fresh);
        }
        assert_memory_not_equal(alone[0]->pixels, alone[1]->pixels, 4 * PIXELS * sizeof(float));
        for (int i = 0; i < 7; i++) {
            const int which = i * 2 % 3;
            io_scene_set_frame(scene, i % 10); /* others between */
            if (!render_draw(renderer, &options, &later, NULL, &status))
                fail_msg("%s", status.message);
            io_image_destroy(later);
            io_scene_set_frame(scene, frames[which]);
            if (!render_draw(renderer, &options, &later, NULL, &status))
                fail_msg("%s", status.message);
            assert_memory_equal(later->pixels, alone[which]->pixels, 4 * PIXELS * sizeof(float));
            io_image_destroy(later);
        }
        for (int i = 0; i < 3; i++)
            io_image_destroy(alone[i]);
        render_destroy(renderer);
        io_scene_destroy(scene);
    }
}

/* Oracle: the positions. A turned object's samples are those at rest, turned: what a light that turns with
 * it sees is the same. Samples follow the texels' rounding: the middles of cubes 0.3 mm wide by some 0.02
 * mm. */
static void samples_stay_on_the_surface(void **state)
{
    (void)state;
    struct io_scene *const scene = read_scene(TORUS "\"motion\": {\"turn_deg\": 100}", "");
    struct renderer *const renderer = renderer_for(scene);
    struct render_light_sample *before = NULL;
    size_t before_count = 0, found = 0;
    for (int frame = 3; frame < 5; frame++) {
        io_scene_set_frame(scene, frame);
        render_plan_destroy(run(renderer, RENDER_TECHNIQUE_SPLAT, RENDER_COHERENCE_SURFACE));
        const struct io_pose *const pose = &scene->objects[0].pose;
        struct render_light_samples *const samples =
            render_splatter_samples(render_executor_splatter(renderer->executor), 0);
        for (size_t i = 0; i < samples->count; i++) { /* back to rest */
            double rest[3];
            for (int k = 0; k < 3; k++) {
                rest[k] = 0;
                for (int j = 0; j < 3; j++)
                    rest[k] += pose->rotation[j][k] *
                               ((double)samples->samples[i].position_mm[j] - pose->shift_mm[j]);
            }
            for (int k = 0; k < 3; k++)
                samples->samples[i].position_mm[k] = (float)rest[k];
        }
        for (size_t i = 0; frame == 4 && i < samples->count; i += 7) {
            for (size_t j = 0; j < before_count; j++) {
                double distance2 = 0;
                for (int k = 0; k < 3; k++)
                    distance2 += pow(
                        (double)samples->samples[i].position_mm[k] - (double)before[j].position_mm[k], 2);
                if (distance2 < 0.03 * 0.03) {
                    found += 7;
                    break;
                }
            }
        }
        if (frame == 4) /* but for what went into the shadow or out of it, and cubes cut by its edge */
            assert_true((double)found > 0.75 * (double)samples->count);
        before_count = samples->count;
        before = realloc(before, before_count * sizeof *before);
        assert_non_null(before);
        memcpy(before, samples->samples, before_count * sizeof *before);
    }
    free(before);
    render_destroy(renderer);
    io_scene_destroy(scene);
}

/* Oracle: the first frame. Where camera, lights and object turn alike every frame is the same picture, if
 * what is merged at rest is what gathering sums: but for texels of the light's view and pixels at
 * silhouettes that round otherwise, and what their levels interpolate. Cubes that stand still in space
 * merge others. */
static void gathering_goes_with_the_surface(void **state)
{
    (void)state;
    struct io_scene *const scene =
        read_scene(TORUS "\"motion\": {\"turn_deg\": -200}, \"specular\": false", "");
    scene->frames.camera_turn_deg = scene->frames.lights_turn_deg = -200;
    struct renderer *const renderer = renderer_for(scene);
    double changes[2] = { 0, 0 };
    for (int kind = 0; kind < 2; kind++) {
        float *before = NULL;
        for (int frame = 3; frame < 5; frame++) {
            io_scene_set_frame(scene, frame);
            render_plan_destroy(run(renderer, RENDER_TECHNIQUE_GATHER,
                                    kind ? RENDER_COHERENCE_SURFACE : RENDER_COHERENCE_NONE));
            float *const now = read_texture(renderer, "radiosity");
            double sum = 0, change = 0;
            for (size_t i = 0; before && i < 4 * PIXELS; i++) {
                sum += (double)now[i];
                change += fabs((double)now[i] - (double)before[i]);
            }
            changes[kind] = before ? change / sum : 0;
            free(before);
            before = now;
        }
        free(before);
    }
    assert_true(changes[1] < 5e-4);
    assert_true(changes[0] > 5 * changes[1]);
    print_message("  from frame to frame: %.2e in cubes of space, %.2e in those of the surface\n",
                  changes[0], changes[1]);
    render_destroy(renderer);
    io_scene_destroy(scene);
}

/* Oracle: what the scene says. Only where something moves is there the one program that does it, which says
 * so. */
static void only_what_moves_pays(void **state)
{
    (void)state;
    static const struct {
        const char *object;
        int frame;
        bool is_deformed, is_moved, is_coherent;
    } cases[] = {
        { TORUS "\"roughness\": 0.3", 4, false, false, false },
        { TORUS "\"motion\": {\"turn_deg\": 90}", 0, false, false, true },
        { TORUS "\"motion\": {\"turn_deg\": 90}", 4, false, true, true },
        { TORUS "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 90]}]", 0, false, false, true },
        { TORUS "\"deform\": [{\"kind\": \"twist\", \"angle_deg\": [0, 90]}]", 4, true, false, true },
    };
    size_t still_count = 0;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct io_scene *const scene = read_scene(cases[i].object, "");
        struct renderer *const renderer = renderer_for(scene);
        io_scene_set_frame(scene, cases[i].frame);
        struct render_plan *const plan = run(renderer, RENDER_TECHNIQUE_AUTO, RENDER_COHERENCE_AUTO);
        assert_int_equal(plan->technique, RENDER_TECHNIQUE_GATHER);
        assert_int_equal(decision(plan, "deform")->is_active, cases[i].is_deformed);
        assert_int_equal(decision(plan, "motion")->is_active, cases[i].is_moved);
        assert_int_equal(decision(plan, "coherence")->is_active, cases[i].is_coherent);
        if (i == 0)
            still_count = render_executor_program_count(renderer->executor);
        assert_int_equal(render_executor_program_count(renderer->executor),
                         still_count + (cases[i].is_deformed || cases[i].is_moved));
        render_plan_destroy(plan);
        render_destroy(renderer);
        io_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shaders_deform_as_the_library_does),
        cmocka_unit_test(all_ways_of_sampling_keep_the_energy),
        cmocka_unit_test(views_in_memory_are_those_of_opengl),
        cmocka_unit_test(frames_do_not_depend_on_those_before),
        cmocka_unit_test(samples_stay_on_the_surface),
        cmocka_unit_test(gathering_goes_with_the_surface),
        cmocka_unit_test(only_what_moves_pays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
