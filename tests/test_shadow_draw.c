/* Shadows of blockers and of lights with a size by OpenGL, against rays to many points of the light. */
#include "blockers.h"
#include "check.h"
#include "scenes.h"

#include "renderer/area_light.h"
#include "renderer/execute.h"
#include "renderer/reference.h"
#include "renderer/reference_pixel.h"
#include "renderer/renderer.h"

#include <limits.h>

#define PI_2 1.57079632679489661923

enum { WIDTH = 120, HEIGHT = 90, PIXELS = WIDTH * HEIGHT, BLOCKERS = 4 };

/* A slab of marble, seen from above at a slant, with room for blockers. */
struct shadow_scene {
    struct test_scene test;
    struct io_blocker blockers[BLOCKERS];
};

static void begin(struct shadow_scene *scene)
{
    const struct io_material material = marble();
    scene_init(&scene->test, 0);
    assert_true(scene_add(&scene->test, IO_PRIMITIVE_SLAB, 8, 20, 0, &material));
    scene->test.objects[0].has_specular = true;
    struct io_camera *const camera = &scene->test.scene.camera;
    memcpy(camera->eye_mm, (double[3]){ 2, 40, 30 }, sizeof camera->eye_mm);
    camera->fov_y_rad = 0.6;
    camera->width_px = WIDTH;
    camera->height_px = HEIGHT;
    scene->test.scene.blockers = scene->blockers;
}

static void end(struct shadow_scene *scene)
{
    for (size_t i = 0; i < scene->test.scene.blocker_count; i++)
        io_mesh_destroy(scene->blockers[i].mesh);
    scene_end(&scene->test);
}

/* Made opaque by opacity, of all channels. */
static struct io_blocker *add_blocker(struct shadow_scene *scene, enum io_primitive primitive,
                                      double scale_mm, double x_mm, double y_mm, double opacity)
{
    struct io_blocker *const blocker = &scene->blockers[scene->test.scene.blocker_count++];
    *blocker = blocker_of(primitive, 64, scale_mm, y_mm);
    for (size_t i = 0; i < blocker->mesh->vertex_count; i++)
        blocker->mesh->positions[3 * i] += (float)x_mm;
    blocker->mesh->min[0] += (float)x_mm;
    blocker->mesh->max[0] += (float)x_mm;
    for (int c = 0; c < 3; c++)
        blocker->opacity[c] = opacity;
    return blocker;
}

static void add_particles(struct shadow_scene *scene, int count, double radius_mm, double opacity)
{
    struct io_blocker *const blocker = &scene->blockers[scene->test.scene.blocker_count++];
    *blocker = (struct io_blocker){ .particle_mm = radius_mm, .opacity = { opacity, opacity, opacity } };
    assert_true(io_mesh_create_particles(count, 1, &blocker->mesh, NULL));
    for (size_t i = 0; i < 3 * blocker->mesh->vertex_count; i++)
        blocker->mesh->positions[i] = 5 * blocker->mesh->positions[i] + (i % 3 == 1 ? 9.0f : 0.0f);
    for (int k = 0; k < 3; k++) {
        blocker->mesh->min[k] = 5 * blocker->mesh->min[k] + (k == 1 ? 9.0f : 0.0f);
        blocker->mesh->max[k] = 5 * blocker->mesh->max[k] + (k == 1 ? 9.0f : 0.0f);
    }
}

/* The frame's textures once it is drawn. */
struct drawn {
    float *shadow, *position_mm, *normal;
    double time_ms;
};

static float *read_texture(struct renderer *renderer, const char *name)
{
    float *const pixels = malloc(4 * PIXELS * sizeof *pixels);
    assert_non_null(pixels);
    assert_true(render_executor_read(renderer->executor, name, pixels, NULL));
    return pixels;
}

static struct drawn draw_shadows(const struct shadow_scene *scene,
                                 const struct render_shadow_options *options)
{
    struct renderer *renderer;
    dipole_status status;
    struct drawn drawn;
    if (!render_create(&scene->test.scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    const struct render_request request = { .scene = renderer->scene,
                                            .media = renderer->media,
                                            .technique = RENDER_TECHNIQUE_LAMBERT,
                                            .shadows = *options,
                                            .epsilon = 0.01 };
    struct render_plan *plan;
    double time_ms[RENDER_EFFECT_LIMIT];
    if (!render_run(renderer, &request, &plan, time_ms, &status))
        fail_msg("%s", status.message);
    drawn.shadow = read_texture(renderer, "shadow");
    drawn.position_mm = read_texture(renderer, "position_mm");
    drawn.normal = read_texture(renderer, "normal");
    render_plan_destroy(plan);
    render_destroy(renderer);
    for (int i = 0; i < 4 * PIXELS; i++)
        assert_true(drawn.shadow[i] >= 0 && drawn.shadow[i] <= 1.0001f);
    return drawn;
}

static void end_drawn(struct drawn *drawn)
{
    free(drawn->shadow);
    free(drawn->position_mm);
    free(drawn->normal);
}

/* How far shadow factors are from those of rays, over pixels that show an object. */
struct deviation {
    double rmse, bias, worst;
    int wrong_count, count; /* wrong by more than 0.1 */
};

static struct deviation compare(const struct shadow_scene *scene, const struct drawn *drawn,
                                int place_count)
{
    struct deviation deviation = { .rmse = 0 };
    struct render_tracer *tracer;
    assert_true(render_tracer_create(&scene->test.scene, &tracer, NULL));
    for (int i = 0; i < PIXELS; i++) {
        const float *const p = drawn->position_mm + 4 * i, *const n = drawn->normal + 4 * i;
        if (!(p[3] > 0) || (i % 3 != i / WIDTH % 3)) /* a third of them */
            continue;
        struct render_surface_point point = { .object = (size_t)p[3] - 1 };
        double left[3];
        for (int k = 0; k < 3; k++) {
            point.position_mm[k] = (double)p[k];
            point.facet_normal[k] = point.normal[k] = (double)n[k];
        }
        render_light_left(tracer, &scene->test.lights[0], &point, place_count, left);
        for (int c = 0; c < 3; c++) {
            const double error = (double)drawn->shadow[4 * i + c] - left[c];
            deviation.rmse += error * error;
            deviation.bias += error;
            deviation.worst = fmax(deviation.worst, fabs(error));
            deviation.wrong_count += fabs(error) > 0.1;
        }
        deviation.count += 3;
    }
    render_tracer_destroy(tracer);
    deviation.rmse = sqrt(deviation.rmse / deviation.count);
    deviation.bias /= deviation.count;
    return deviation;
}

static struct deviation deviation_of(const struct shadow_scene *scene,
                                     const struct render_shadow_options *options)
{
    struct drawn drawn = draw_shadows(scene, options);
    const struct deviation deviation = compare(scene, &drawn, 512);
    end_drawn(&drawn);
    return deviation;
}

static const struct render_shadow_options usual = { 0 };

/* ---- hard shadows -------------------------------------------------------------------------------- */

/* Oracle: rays. A solid, a sheet, particles and what is opaque, of parallel light and of a point: wrong are
 * pixels at edges alone, which are three texels wide. */
static void hard_shadows_are_where_rays_say(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
        begin(&scene);
        add_blocker(&scene, IO_PRIMITIVE_SPHERE, 3, -6, 8, 0.4);
        add_blocker(&scene, IO_PRIMITIVE_TORUS, 3, 5, 5, 0.5)->is_sheet = true;
        add_blocker(&scene, IO_PRIMITIVE_CUBE, 1.5, 0, 4, i % 2 ? 1 : 0.7);
        if (i / 2)
            scene_add_directional(&scene.test, 0.3, -1, -0.2, 1);
        else
            scene_add_point(&scene.test, -5, 30, 8, 1);
        const struct deviation found = deviation_of(&scene, &usual);
        print_message("  case %d: rmse %.4f, mean %+.5f, %.2f %% of pixels off by over 0.1\n", i,
                      found.rmse, found.bias, 100.0 * found.wrong_count / found.count);
        assert_true(found.rmse < 0.03 && fabs(found.bias) < 0.002 &&
                    found.wrong_count < 0.02 * found.count);
        end(&scene);
    }
}

/* Oracle: chords of a ball in closed form. Extinction, per channel. */
static void extinction_follows_the_way(void **state)
{
    (void)state;
    struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
    begin(&scene);
    struct io_blocker *const ball = add_blocker(&scene, IO_PRIMITIVE_SPHERE, 5, 0, 9, 0);
    ball->has_extinction = true;
    for (int c = 0; c < 3; c++)
        ball->extinction_per_mm[c] = 0.05 * (c + 1);
    scene_add_directional(&scene.test, 0, -1, 0, 1);
    struct drawn drawn = draw_shadows(&scene, &usual);
    int count = 0;
    for (int i = 0; i < PIXELS; i++) {
        const double x = (double)drawn.position_mm[4 * i], z = (double)drawn.position_mm[4 * i + 2],
                     away = sqrt(x * x + z * z);
        if (!(drawn.position_mm[4 * i + 3] > 0) || away > 4.5 || drawn.position_mm[4 * i + 1] < -0.01f)
            continue;
        for (int c = 0; c < 3; c++) /* 64 facets around the ball; three texels of the map */
            assert_true(fabs((double)drawn.shadow[4 * i + c] -
                             exp(-0.05 * (c + 1) * 2 * sqrt(25 - away * away))) < 0.01);
        count++;
    }
    assert_true(count > 300);
    end_drawn(&drawn);
    end(&scene);
}

/* ---- penumbras ----------------------------------------------------------------------------------- */

enum soft_case { OPAQUE_CUBE, CLEAR_BALL, COLOURED_PANE, DUST, MIXED, SOFT_CASES };
static const char *const soft_names[] = { "opaque cube", "ball of opacity 0.3", "coloured pane",
                                          "particles", "opaque ball in particles" };

static void begin_soft(struct shadow_scene *scene, enum soft_case kind, bool is_parallel)
{
    *scene = (struct shadow_scene){ .blockers = { { .mesh = NULL } } };
    begin(scene);
    if (kind == OPAQUE_CUBE)
        add_blocker(scene, IO_PRIMITIVE_CUBE, 2, 0, 8, 1);
    if (kind == CLEAR_BALL)
        add_blocker(scene, IO_PRIMITIVE_SPHERE, 4, 0, 8, 0.3);
    if (kind == COLOURED_PANE) {
        struct io_blocker *const pane = add_blocker(scene, IO_PRIMITIVE_CUBE, 4, 0, 9, 0);
        for (int c = 0; c < 3; c++)
            pane->opacity[c] = 0.45 * c;
    }
    if (kind == DUST || kind == MIXED)
        add_particles(scene, 500, 0.35, 0.5);
    if (kind == MIXED)
        add_blocker(scene, IO_PRIMITIVE_SPHERE, 2, 0, 9, 1);
    if (is_parallel) {
        scene_add_directional(&scene->test, 0.3, -1, -0.2, 1);
        scene->test.lights[0].size_rad = 0.2;
    } else {
        scene_add_point(&scene->test, -5, 40, 8, 1);
        scene->test.lights[0].size_mm = 8;
    }
}

/* Oracle: 512 points of the light, with every blocker by itself. The bounds are about 1.3 times what was
 * measured. */
static void penumbras_are_near_those_of_rays(void **state)
{
    (void)state;
    static const double bounds[SOFT_CASES] = { 0.04, 0.02, 0.04, 0.06, 0.06 };
    for (int kind = 0; kind < SOFT_CASES; kind++) {
        for (int is_parallel = 0; is_parallel < 2; is_parallel++) {
            struct shadow_scene scene;
            begin_soft(&scene, (enum soft_case)kind, is_parallel);
            const struct deviation found = deviation_of(&scene, &usual);
            print_message("  %s, %s light: rmse %.4f, mean %+.4f, worst %.2f\n", soft_names[kind],
                          is_parallel ? "parallel" : "point", found.rmse, found.bias, found.worst);
            assert_true(found.rmse < bounds[kind] && fabs(found.bias) < 0.01);
            end(&scene);
        }
    }
}

/* Red of a picture by Lambert, which all faces of the cube about a light add to. */
static void draw_lambert(const struct shadow_scene *scene, struct drawn *drawn)
{
    struct renderer *renderer = NULL;
    struct io_image *image = NULL;
    dipole_status status;
    if (!render_create(&scene->test.scene, RENDER_CONTEXT_DEFAULT, &renderer, &status) ||
        !render_draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, &image,
                     NULL, &status))
        fail_msg("%s", status.message);
    drawn->shadow = read_texture(renderer, "position_mm"); /* as large */
    memcpy(drawn->shadow, image->pixels, 4 * PIXELS * sizeof(float));
    drawn->position_mm = read_texture(renderer, "position_mm");
    drawn->normal = read_texture(renderer, "normal");
    io_image_destroy(image);
    render_destroy(renderer);
}

/* Make a blocker thin, as high as its middle. */
static void flatten(struct io_blocker *blocker)
{
    struct io_mesh *const mesh = blocker->mesh;
    const float middle = 0.5f * (mesh->min[1] + mesh->max[1]);
    for (size_t v = 0; v < mesh->vertex_count; v++)
        mesh->positions[3 * v + 1] = middle + 0.02f * (mesh->positions[3 * v + 1] - middle);
    mesh->min[1] = middle + 0.02f * (mesh->min[1] - middle);
    mesh->max[1] = middle + 0.02f * (mesh->max[1] - middle);
}

/* Oracle: rays. A wide light amid blockers: where the faces of the cube about it meet, at x or z = 12 on
 * the slab, shadows are as right as elsewhere. */
static void penumbras_cross_faces(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
        struct drawn drawn, open;
        begin(&scene);
        scene.test.objects[0].has_specular = false;
        scene_add_point(&scene.test, 0, 12, 0, 1);
        draw_lambert(&scene, &open);
        flatten(add_blocker(&scene, IO_PRIMITIVE_SPHERE, 2.5, 6.5, 5, i == 1 ? 0.6 : 1));
        flatten(add_blocker(&scene, IO_PRIMITIVE_CUBE, 1.5, -6, 6.5, 1));
        scene.test.lights[0].size_mm = i == 2 ? 8 : 3;
        draw_lambert(&scene, &drawn);
        for (int k = 0; k < PIXELS; k++) {
            const float *const p = drawn.position_mm + 4 * k;
            for (int c = 0; c < 3; c++)
                drawn.shadow[4 * k + c] /= open.shadow[4 * k + c] > 0 ? open.shadow[4 * k + c] : 1;
            if (p[1] < -0.01f || drawn.normal[4 * k + 1] < 0.9f)
                drawn.position_mm[4 * k + 3] = 0;
        }
        const struct deviation all = compare(&scene, &drawn, 512);
        for (int k = 0; k < PIXELS; k++) {
            const float *const p = drawn.position_mm + 4 * k;
            if (fabsf(fmaxf(fabsf(p[0]), fabsf(p[2])) - 12) > 1.5f)
                drawn.position_mm[4 * k + 3] = 0;
        }
        const struct deviation edge = compare(&scene, &drawn, 512);
        print_message(
            "  case %d: rmse %.4f, mean %+.4f, worst %.2f; at edges of faces %.4f, %+.4f, %.2f of %d\n", i,
            all.rmse, all.bias, all.worst, edge.rmse, edge.bias, edge.worst, edge.count);
        const double bound = i == 2 ? 0.04 : 0.016; /* before, 0.05 and 0.025 at the edges */
        assert_true(edge.count > 300 && all.rmse < bound && edge.rmse < bound && fabs(edge.bias) < 0.006);
        end_drawn(&drawn);
        end_drawn(&open);
        end(&scene);
    }
}

/* Oracle: limits. As the light becomes a point, shadows become hard ones; as opacity goes, so does the
 * shadow; and what is all but opaque has the shadow of what is opaque, by other code. */
static void limits_are_reached(void **state)
{
    (void)state;
    struct shadow_scene scene;
    struct drawn drawn[2];
    begin_soft(&scene, MIXED, false);
    for (int i = 0; i < 2; i++) {
        scene.test.lights[0].size_mm = i == 0 ? 0 : 1e-6;
        drawn[i] = draw_shadows(&scene, &usual);
    }
    double difference2 = 0;
    for (int i = 0; i < 4 * PIXELS; i++)
        difference2 += pow((double)(drawn[0].shadow[i] - drawn[1].shadow[i]), 2);
    assert_true(sqrt(difference2 / PIXELS) < 0.12); /* three texels are filtered by taps that are turned */
    end_drawn(&drawn[0]);
    end_drawn(&drawn[1]);
    end(&scene);

    begin_soft(&scene, CLEAR_BALL, false);
    for (int c = 0; c < 3; c++)
        scene.blockers[0].opacity[c] = 0;
    drawn[0] = draw_shadows(&scene, &usual);
    for (int c = 0; c < 3; c++)
        scene.blockers[0].opacity[c] = 1e-7;
    drawn[1] = draw_shadows(&scene, &usual);
    for (int i = 0; i < PIXELS; i++) {
        if (drawn[0].position_mm[4 * i + 3] > 0 && drawn[0].normal[4 * i + 1] > 0.9f)
            assert_true(drawn[0].shadow[4 * i] == 1 && fabs((double)drawn[1].shadow[4 * i] - 1) < 1e-6);
    }
    end_drawn(&drawn[0]);
    end_drawn(&drawn[1]);
    for (int i = 0; i < 2; i++) {
        for (int c = 0; c < 3; c++)
            scene.blockers[0].opacity[c] = i == 0 ? 1 : 1 - 1e-9;
        drawn[i] = draw_shadows(&scene, &usual);
    }
    difference2 = 0;
    for (int i = 0; i < 4 * PIXELS; i++)
        difference2 += pow((double)(drawn[0].shadow[i] - drawn[1].shadow[i]), 2);
    assert_true(sqrt(difference2 / PIXELS) < 0.02);
    end_drawn(&drawn[0]);
    end_drawn(&drawn[1]);
    end(&scene);
}

/* Oracle: all nodes. The more nodes, the nearer to them; 4, 8 and 16 of some 40 in a texel. */
static void more_nodes_are_nearer(void **state)
{
    (void)state;
    static const int limits[] = { 2, 4, 8, 16 };
    struct shadow_scene scene;
    begin_soft(&scene, DUST, false);
    /* a receiver amid the particles: behind all of them the number of nodes does not matter */
    const struct io_material material = marble();
    assert_true(scene_add(&scene.test, IO_PRIMITIVE_SPHERE, 64, 4, 0, &material));
    struct io_mesh *const ball = scene.test.objects[1].mesh;
    for (size_t v = 0; v < ball->vertex_count; v++)
        ball->positions[3 * v + 1] += 8;
    ball->min[1] += 8;
    ball->max[1] += 8;
    scene.test.scene.max_mm[1] = 12;
    scene.test.objects[1].has_specular = true;
    scene.test.lights[0].size_mm = 0;
    struct drawn exact = draw_shadows(&scene, &(struct render_shadow_options){ .node_limit = INT_MAX });
    double before = INFINITY;
    for (int l = 0; l < 4; l++) {
        struct drawn drawn =
            draw_shadows(&scene, &(struct render_shadow_options){ .node_limit = limits[l] });
        double difference2 = 0;
        for (int i = 0; i < 4 * PIXELS; i++)
            difference2 += pow((double)(drawn.shadow[i] - exact.shadow[i]), 2);
        const double rmse = sqrt(difference2 / (3 * PIXELS));
        print_message("  %d nodes: rmse %.5f\n", limits[l], rmse);
        assert_true(rmse < before);
        before = rmse;
        end_drawn(&drawn);
    }
    assert_true(before < 1e-3);
    end_drawn(&exact);
    end(&scene);
}

/* ---- hard cases ---------------------------------------------------------------------------------- */

/* Oracle: draw_shadows checks that all is within 0 and 1. What each does to the slab's middle is by hand.
 */
static void hard_cases_give_numbers(void **state)
{
    (void)state;
    for (int i = 0; i < 9; i++) {
        struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
        begin(&scene);
        scene_add_point(&scene.test, 0, 80, 0, 1); /* so far away that one view holds all */
        scene.test.lights[0].size_mm = 2;
        switch (i) {
        case 0: /* the light within a blocker */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 5, 0, 80, 0.5);
            break;
        case 1: /* a blocker that touches the receiver */
            add_blocker(&scene, IO_PRIMITIVE_CUBE, 3, 0, 3, 0.5);
            break;
        case 2: /* behind it */
            add_blocker(&scene, IO_PRIMITIVE_CUBE, 3, 0, -30, 1);
            break;
        case 3: /* behind the light */
            add_blocker(&scene, IO_PRIMITIVE_CUBE, 3, 0, 90, 0.7);
            break;
        case 4: /* a light as large as everything */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 2, 0, 5, 0.9);
            scene.test.lights[0].size_mm = 1000;
            break;
        case 5: /* of parallel light as large as the sky */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 2, 0, 5, 0.9);
            scene.test.lights[0] =
                (struct io_light){ .direction = { 0, -1, 0 }, .size_rad = PI_2, .rgb = { 1, 1, 1 } };
            break;
        case 6: /* the light on the receiver */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 2, 0, 5, 0.9);
            scene.test.lights[0].position_mm[1] = 0;
            break;
        case 7: /* the receiver within a blocker */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 10, 0, 0, 0.5);
            break;
        case 8: /* a light as large as everything, amid all */
            add_blocker(&scene, IO_PRIMITIVE_SPHERE, 2, 3, 9, 0.9);
            scene.test.lights[0].position_mm[1] = 10;
            scene.test.lights[0].size_mm = 1000;
            break;
        }
        struct drawn drawn = draw_shadows(&scene, &usual);
        const float middle = drawn.shadow[4 * (HEIGHT / 2 * WIDTH + WIDTH / 2)];
        print_message("  case %d: %.3f in the middle\n", i, (double)middle);
        static const double expected[9] = { 0.5, -1, 1, 1, -1, -1, -1, -1, -1 };
        if (expected[i] >= 0)
            assert_true(fabs((double)middle - expected[i]) < 0.01);
        end_drawn(&drawn);
        end(&scene);
    }
}

/* Oracle: 0.9995^10000 of 5,000 boxes of two sheets, one over the other. The list does not hold them all at
 * once. */
static void ten_thousand_layers_are_all_counted(void **state)
{
    (void)state;
    enum { LAYERS = 5000 };
    struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
    begin(&scene);
    scene_add_directional(&scene.test, 0, -1, 0, 1);
    struct io_blocker *const pile = add_blocker(&scene, IO_PRIMITIVE_CUBE, 1, 0, 5, 5e-4);
    io_mesh_destroy(pile->mesh);
    assert_true(
        io_mesh_create_fibres(LAYERS, 1, 0.5, 1, &pile->mesh, NULL)); /* two squares for each will do */
    struct io_mesh *const mesh = pile->mesh;
    for (size_t f = 0; f < LAYERS; f++) { /* of its 8 triangles four make two squares, the others nothing */
        for (size_t s = 0; s < 2; s++) {
            const float y = 3 + 1e-3f * (float)(2 * f + s);
            for (size_t v = 0; v < 3; v++) {
                float *const p = mesh->positions + 3 * (6 * f + 3 * s + v);
                p[0] = v == 1 ? 24.0f : -8.0f;
                p[1] = y;
                p[2] = v == 2 ? 24.0f : -8.0f;
            }
        }
        uint32_t *const index = mesh->indices + 24 * f;
        for (size_t k = 0; k < 24; k++)
            index[k] = (uint32_t)(6 * f + (k < 3 ? k : k < 6 ? k : 0));
    }
    memcpy(mesh->min, (float[3]){ -8, 3, -8 }, sizeof mesh->min);
    memcpy(mesh->max, (float[3]){ 24, 13, 24 }, sizeof mesh->max);
    pile->is_sheet = true;
    struct drawn drawn = draw_shadows(&scene, &(struct render_shadow_options){ .side_px = 32 });
    int count = 0;
    for (int i = 0; i < PIXELS; i++) {
        const float x = drawn.position_mm[4 * i], z = drawn.position_mm[4 * i + 2];
        if (!(drawn.position_mm[4 * i + 3] > 0) || x < -4 || z < -4 || x + z > 6)
            continue;
        assert_close((double)drawn.shadow[4 * i], pow(1 - 5e-4, 2 * LAYERS), 1e-3, "at %g, %g", (double)x,
                     (double)z);
        count++;
    }
    assert_true(count > 10);
    end_drawn(&drawn);
    end(&scene);
}

/* A wall that turns, a ball that waves and dust that drifts; JSON with other quotes. */
static const char moving_scene[] =
    "{'camera': {'eye': [2, 40, 30], 'target': [0, 0, 0], 'fov_y_deg': 35, 'size': [120, 90]},\n"
    "'lights': [{'kind': 'point', 'position': [-5, 40, 8], 'size': 4}], 'frames': {'count': 10}, "
    "'objects': [\n"
    "{'primitive': 'slab', 'detail': 8, 'transform': {'scale': 20}, 'material': {'name': 'm', 'eta': 1.5,\n"
    "'sigma_a_per_mm': [0, 0, 0], 'sigma_s_prime_per_mm': [2, 2, 2]}},\n"
    "{'opacity': 1, 'primitive': 'cube', 'detail': 4, 'transform': {'scale': [3, 1, 1], 'translate': [0, "
    "4, 5]},\n"
    "'motion': {'turn_deg': 180, 'translate': [5, 0, 0]}},\n"
    "{'opacity': [0.2, 0.5, 0.9], 'primitive': 'sphere', 'detail': 64, 'transform': {'scale': 3,\n"
    "'translate': [0, 9, 0]}, 'deform': [{'kind': 'wave', 'amplitude': 2, 'wavelength': 6, 'cycles': "
    "1}]},\n"
    "{'opacity': 0.5, 'particles': {'count': 100, 'radius': 0.06}, 'transform': {'scale': 5,\n"
    "'translate': [-9, 6, 0]}, 'motion': {'translate': [18, 0, 0]}}]}\n";

static void write_moving(void)
{
    FILE *const file = fopen("scene.json", "w");
    assert_non_null(file);
    for (const char *c = moving_scene; *c; c++)
        fputc(*c == '\'' ? '"' : *c, file);
    assert_int_equal(fclose(file), 0);
}

/* What blockers leave as they stand in a frame. */
static struct drawn draw_frame(struct io_scene *scene, struct renderer *renderer, int frame)
{
    struct drawn drawn;
    struct render_plan *plan;
    dipole_status status;
    const struct render_request request = {
        .scene = scene, .media = renderer->media, .technique = RENDER_TECHNIQUE_LAMBERT, .epsilon = 0.01
    };
    io_scene_set_frame(scene, frame);
    if (!render_run(renderer, &request, &plan, (double[RENDER_EFFECT_LIMIT]){ 0 }, &status))
        fail_msg("%s", status.message);
    drawn.shadow = read_texture(renderer, "shadow");
    drawn.position_mm = read_texture(renderer, "position_mm");
    drawn.normal = read_texture(renderer, "normal");
    render_plan_destroy(plan);
    return drawn;
}

/* Oracle: a renderer that has drawn no other frame, bit for bit; and rays, which know of no renderer. */
static void blockers_move(void **state)
{
    (void)state;
    static const int frames[] = { 0, 5, 2, 0 };
    write_moving();
    struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
    struct io_scene *moving, *fresh;
    struct renderer *renderer, *other;
    assert_true(io_scene_read("scene.json", NULL, &moving, NULL));
    assert_true(render_create(moving, RENDER_CONTEXT_DEFAULT, &renderer, NULL));
    for (size_t f = 0; f < sizeof frames / sizeof *frames; f++) {
        struct drawn drawn = draw_frame(moving, renderer, frames[f]);
        assert_true(io_scene_read("scene.json", NULL, &fresh, NULL));
        io_scene_set_frame(fresh, frames[f]);
        assert_true(render_create(fresh, RENDER_CONTEXT_DEFAULT, &other, NULL));
        struct drawn expected = draw_frame(fresh, other, frames[f]);
        assert_memory_equal(drawn.shadow, expected.shadow, 4 * PIXELS * sizeof(float));
        scene.test.scene = *fresh;
        scene.test.lights[0] = fresh->lights[0];
        const struct deviation found = compare(&scene, &drawn, 256);
        print_message("  frame %d: rmse %.4f, mean %+.4f\n", frames[f], found.rmse, found.bias);
        assert_true(found.rmse < 0.04 && fabs(found.bias) < 0.01); /* as of blockers at rest */
        end_drawn(&expected);
        end_drawn(&drawn);
        render_destroy(other);
        io_scene_destroy(fresh);
    }
    render_destroy(renderer);
    io_scene_destroy(moving);
}

/* Oracle: the reference's picture. Light that soft coloured shadows leave enters, and spreads: by gathering
 * and by splats. */
static void what_is_left_enters_and_spreads(void **state)
{
    (void)state;
    struct shadow_scene scene;
    struct io_image *expected;
    dipole_status status;
    begin_soft(&scene, COLOURED_PANE, true);
    scene.test.objects[0].has_specular = false;
    /* a medium whose light spreads over some pixels, and is soon summed */
    const double sigma_a = 0.1, sigma_s_prime = 1;
    for (int c = 0; c < 3; c++)
        scene.test.objects[0].material.layers[c][0].medium =
            (dipole_medium){ .sigma_a_per_mm = sigma_a, .sigma_s_prime_per_mm = sigma_s_prime, .eta = 1.3 };
    if (!render_reference_draw(&scene.test.scene, &(struct render_options){ .epsilon = 0.1 }, &expected,
                               NULL, &status))
        fail_msg("%s", status.message);
    struct renderer *renderer;
    assert_true(render_create(&scene.test.scene, RENDER_CONTEXT_DEFAULT, &renderer, &status));
    for (int t = 0; t < 2; t++) {
        struct io_image *found;
        const struct render_options options = { .technique = t == 0 ? RENDER_TECHNIQUE_GATHER
                                                                    : RENDER_TECHNIQUE_SPLAT };
        if (!render_draw(renderer, &options, &found, NULL, &status))
            fail_msg("%s", status.message);
        double error2[3] = { 0 }, value2[3] = { 0 };
        for (int i = 0; i < 4 * PIXELS; i++) {
            const double value = (double)expected->pixels[i], error = (double)found->pixels[i] - value;
            if (i % 4 == 3 || expected->pixels[i / 4 * 4 + 3] < 1 || found->pixels[i / 4 * 4 + 3] < 1)
                continue;
            error2[i % 4] += error * error;
            value2[i % 4] += value * value;
        }
        for (int c = 0; c < 3; c++) {
            const double relative = sqrt(error2[c] / value2[c]);
            print_message("  technique %d, channel %d: relative rmse %.4f\n", t, c, relative);
            assert_true(relative < 0.025); /* of the reference 0.01, of shadows some 0.01 */
        }
        io_image_destroy(found);
    }
    render_destroy(renderer);
    io_image_destroy(expected);
    end(&scene);
}

/* Oracle: the reference's picture. Light enters the slab in the penumbra of another object, also where that
 * hides the middle of the light. */
static void light_enters_in_penumbras_of_objects(void **state)
{
    (void)state;
    struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
    struct io_image *expected = NULL, *found = NULL;
    struct renderer *renderer = NULL;
    dipole_status status;
    begin(&scene);
    scene.test.objects[0].has_specular = false;
    for (int c = 0; c < 3; c++)
        scene.test.objects[0].material.layers[c][0].medium =
            (dipole_medium){ .sigma_a_per_mm = 0.1, .sigma_s_prime_per_mm = 1, .eta = 1.3 };
    assert_true(scene_add(&scene.test, IO_PRIMITIVE_SPHERE, 64, 3, 0, &scene.test.objects[0].material));
    struct io_mesh *const ball = scene.test.objects[1].mesh;
    for (size_t v = 0; v < ball->vertex_count; v++)
        ball->positions[3 * v + 1] += 9;
    ball->min[1] += 9;
    ball->max[1] += 9;
    scene.test.scene.max_mm[1] = 12;
    scene_add_point(&scene.test, 10, 70, 5, 1);
    scene.test.lights[0].size_mm = 14;
    if (!render_reference_draw(&scene.test.scene, &(struct render_options){ .epsilon = 0.1 }, &expected,
                               NULL, &status) ||
        !render_create(&scene.test.scene, RENDER_CONTEXT_DEFAULT, &renderer, &status) ||
        !render_draw(renderer, &(struct render_options){ .epsilon = 0 }, &found, NULL, &status))
        fail_msg("%s", status.message);
    double error2 = 0, value2 = 0;
    float *const position_mm = read_texture(renderer, "position_mm");
    for (int i = 0; i < PIXELS; i++) {
        if (expected->pixels[4 * i + 3] < 1 || found->pixels[4 * i + 3] < 1 ||
            position_mm[4 * i + 1] > 0.01f)
            continue;
        error2 += pow((double)(found->pixels[4 * i] - expected->pixels[4 * i]), 2);
        value2 += pow((double)expected->pixels[4 * i], 2);
    }
    print_message("  relative rmse of the slab %.4f\n", sqrt(error2 / value2));
    assert_true(sqrt(error2 / value2) <
                0.018); /* of the reference 0.01; 0.021 where the ball hides the slab */
    free(position_mm);
    io_image_destroy(found);
    io_image_destroy(expected);
    render_destroy(renderer);
    end(&scene);
}

/* Oracle: the cone. */
static void spots_light_their_cone(void **state)
{
    (void)state;
    struct shadow_scene scene = { .blockers = { { .mesh = NULL } } };
    begin(&scene);
    scene_add_point(&scene.test, 0, 80, 0, 1);
    struct io_light *const spot = &scene.test.lights[0];
    spot->is_spot = true;
    spot->direction[1] = -1;
    spot->cone_rad = 0.2;
    spot->cone_blend = 0.3;
    struct drawn drawn = draw_shadows(&scene, &usual);
    for (int i = 0; i < PIXELS; i++) {
        const float *const p = drawn.position_mm + 4 * i;
        if (!(p[3] > 0) || drawn.normal[4 * i + 1] < 0.9f)
            continue;
        double direction[3] = { (double)p[0], (double)p[1] - 80, (double)p[2] };
        const double length =
            sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
        for (int k = 0; k < 3; k++)
            direction[k] /= length;
        assert_true(fabs((double)drawn.shadow[4 * i] - render_light_spot_part(spot, direction)) <
                    2e-3); /* float; 5 per 0.01 rad */
    }
    end_drawn(&drawn);
    end(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hard_shadows_are_where_rays_say),
        cmocka_unit_test(extinction_follows_the_way),
        cmocka_unit_test(penumbras_are_near_those_of_rays),
        cmocka_unit_test(penumbras_cross_faces),
        cmocka_unit_test(limits_are_reached),
        cmocka_unit_test(more_nodes_are_nearer),
        cmocka_unit_test(hard_cases_give_numbers),
        cmocka_unit_test(ten_thousand_layers_are_all_counted),
        cmocka_unit_test(spots_light_their_cone),
        cmocka_unit_test(blockers_move),
        cmocka_unit_test(what_is_left_enters_and_spreads),
        cmocka_unit_test(light_enters_in_penumbras_of_objects),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
