/* Energy: no more light leaves than enters, and light from all sides shows no side. */
#include "check.h"
#include "scenes.h"

#include "renderer/renderer.h"

static const double PI = 3.14159265358979323846, RADIUS_MM = 6;

/* ---- materials ---------------------------------------------------------------------------------- */

static struct io_material half_space(const char *name, dipole_model model, double free_path_mm,
                                     double albedo, double eta)
{
    struct io_material material = { .name = "" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++) /* green and blue scatter less far */
        media[c] = (dipole_medium){ .sigma_a_per_mm = (1 - albedo) / free_path_mm * (1 + c),
                                    .sigma_s_prime_per_mm = albedo / free_path_mm * (1 + c),
                                    .eta = eta };
    io_material_set_media(&material, media);
    material.model = model;
    snprintf(material.name, sizeof material.name, "%s", name);
    return material;
}

/* A thin layer that absorbs blue over a base that scatters far. */
static struct io_material layered(dipole_model model)
{
    struct io_material material = { .name = "layered", .model = model, .layer_count = 2 };
    for (int c = 0; c < 3; c++) {
        material.layers[c][0] =
            (dipole_layer){ { .sigma_a_per_mm = 0.02 + 0.2 * c, .sigma_s_prime_per_mm = 4, .eta = 1.4 },
                            0.3 };
        material.layers[c][1] =
            (dipole_layer){ { .sigma_a_per_mm = 0.01, .sigma_s_prime_per_mm = 1.5, .eta = 1.4 }, INFINITY };
    }
    return material;
}

enum { MATERIAL_COUNT = 8 };

static struct io_material material_of(int index)
{
    switch (index) {
    case 0:
        return half_space("dipole, absorbs almost nothing", DIPOLE_MODEL_DIPOLE, 1.5, 0.99999, 1.5);
    case 1:
        return half_space("dipole, dark", DIPOLE_MODEL_DIPOLE, 1.5, 0.3, 1.3);
    case 2:
        return half_space("better dipole, equal indices", DIPOLE_MODEL_BETTER_DIPOLE, 1.5, 0.98, 1);
    case 3:
        return half_space("beam, absorbs almost nothing", DIPOLE_MODEL_BEAM, 1.5, 0.99999, 1.5);
    case 4:
        return half_space("beam, dark", DIPOLE_MODEL_BEAM, 1.5, 0.5, 1.4);
    case 5:
        return half_space("modes", DIPOLE_MODEL_MODES, 1.5, 0.97, 1.4);
    case 6:
        return layered(DIPOLE_MODEL_BEAM);
    default:
        return marble();
    }
}

/* ---- pictures ----------------------------------------------------------------------------------- */

static struct io_image *draw(struct renderer *renderer, enum render_technique technique, double epsilon)
{
    const struct render_options options = { .technique = technique, .epsilon = epsilon };
    struct io_image *image;
    dipole_status status;
    if (!render_draw(renderer, &options, &image, NULL, &status))
        fail_msg("%s", status.message);
    return image;
}

static struct renderer *renderer_of(const struct test_scene *test)
{
    struct renderer *renderer;
    dipole_status status;
    if (!render_create(&test->scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    return renderer;
}

/* Points spread evenly over the sphere. */
static void spread_direction(int index, int count, double out[3])
{
    const double z = 1 - (2 * index + 1.0) / count, turn_rad = index * PI * (3 - sqrt(5));
    out[0] = sqrt(1 - z * z) * cos(turn_rad);
    out[1] = z;
    out[2] = sqrt(1 - z * z) * sin(turn_rad);
}

/* Look at the origin from that direction, orthographically. */
static void look_from(struct io_scene *scene, const double direction[3], double width_mm, int size_px)
{
    scene->camera = (struct io_camera){ .is_orthographic = true,
                                        .up = { 0.1, 1, 0.2 },
                                        .height_mm = width_mm,
                                        .width_px = size_px,
                                        .height_px = size_px };
    for (int k = 0; k < 3; k++)
        scene->camera.eye_mm[k] = 10 * width_mm * direction[k];
}

/* ---- no more leaves than enters ----------------------------------------------------------------- */

enum { VIEW_COUNT = 16, VIEW_PX = 24 };

/* Power that leaves toward infinity: pictures from all around, integrated over their area and over all
 * directions. */
static void leaving_w(struct test_scene *test, struct renderer *renderer, enum render_technique technique,
                      double width_mm, double power_w[3])
{
    memset(power_w, 0, 3 * sizeof *power_w);
    const double pixel_mm = width_mm / VIEW_PX;
    for (int v = 0; v < VIEW_COUNT; v++) {
        double direction[3];
        spread_direction(v, VIEW_COUNT, direction);
        look_from(&test->scene, direction, width_mm, VIEW_PX);
        struct io_image *const image = draw(renderer, technique, 0.1);
        for (size_t i = 0; i < VIEW_PX * VIEW_PX; i++) {
            for (size_t c = 0; c < 3; c++)
                power_w[c] += (double)image->pixels[4 * i + c] * pixel_mm * pixel_mm * 4 * PI / VIEW_COUNT;
        }
        io_image_destroy(image);
    }
}

static void entering_w(struct renderer *renderer, double spacing_mm, double power_w[3])
{
    struct render_capture *captured;
    dipole_status status;
    if (!render_capture_create(renderer, spacing_mm, &captured, &status))
        fail_msg("%s", status.message);
    memset(power_w, 0, 3 * sizeof *power_w);
    for (size_t i = 0; i < captured->samples.count; i++) {
        for (size_t c = 0; c < 3; c++)
            power_w[c] += (double)captured->samples.samples[i].flux_w[c];
    }
    render_capture_destroy(captured);
}

static const enum render_technique techniques[] = { RENDER_TECHNIQUE_SPLAT, RENDER_TECHNIQUE_LAMBERT };

/* A scene of one object under a light from afar and one that is near. */
static void init_lit(struct test_scene *test, enum io_primitive primitive,
                     const struct io_material *material)
{
    scene_init(test, 40);
    assert_true(scene_add(test, primitive, 64, RADIUS_MM, 0, material));
    scene_add_directional(test, -1, -1.5, -0.7, 3);
    scene_add_point(test, 12, 3, -9, 200);
}

/*
 * Oracle: conservation of energy. And on a sphere the closed form: a ring of it at chord r is as large as
 * one of a plane, so that of what enters anywhere, the profile's part within the diameter leaves; 2 % for
 * 24 pixels a side and 16 directions.
 */
static void no_more_light_leaves_than_enters(void **state)
{
    (void)state;
    static const struct {
        enum io_primitive primitive;
        int material;
    } scenes[] = {
        { IO_PRIMITIVE_SPHERE, 0 }, { IO_PRIMITIVE_SPHERE, 1 }, { IO_PRIMITIVE_SPHERE, 2 },
        { IO_PRIMITIVE_SPHERE, 3 }, { IO_PRIMITIVE_SPHERE, 5 }, { IO_PRIMITIVE_SPHERE, 6 },
        { IO_PRIMITIVE_CUBE, 0 },   { IO_PRIMITIVE_CUBE, 3 },   { IO_PRIMITIVE_SLAB, 6 },
        { IO_PRIMITIVE_SLAB, 7 },   { IO_PRIMITIVE_KNOT, 3 },   { IO_PRIMITIVE_BOWL, 0 },
    };
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        const struct io_material material = material_of(scenes[s].material);
        struct test_scene test;
        double in_w[3], out_w[3];
        init_lit(&test, scenes[s].primitive, &material);
        struct renderer *const renderer = renderer_of(&test);
        const struct render_medium *const medium = &renderer->media->media[0];
        entering_w(renderer, 0.3, in_w);
        for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++) {
            leaving_w(&test, renderer, techniques[t], 3.4 * RADIUS_MM, out_w);
            print_message("  primitive %d, %-30s, %-7s: %.3f %.3f %.3f of the light leaves\n",
                          scenes[s].primitive, material.name, render_technique_names[techniques[t]],
                          out_w[0] / in_w[0], out_w[1] / in_w[1], out_w[2] / in_w[2]);
            for (int c = 0; c < 3; c++) {
                const bool is_splat = techniques[t] == RENDER_TECHNIQUE_SPLAT;
                const double leaving =
                    is_splat ? dipole_stack_within(medium->stacks[c], DIPOLE_FACE_LIT, 2 * RADIUS_MM)
                             : medium->diffuse_reflectance[c];
                assert_true(out_w[c] <= in_w[c]);
                if (scenes[s].primitive == IO_PRIMITIVE_SPHERE)
                    assert_close(out_w[c] / in_w[c], leaving, 0.02, "%s, channel %d", material.name, c);
            }
        }
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* ---- light from all sides ----------------------------------------------------------------------- */

enum { AROUND_COUNT = 60, SIDE_COUNT = 3, SIDE_PX = 32 };

static void light_all_around(struct io_light lights[AROUND_COUNT])
{
    for (int i = 0; i < AROUND_COUNT; i++) {
        lights[i] = (struct io_light){ .kind = IO_LIGHT_DIRECTIONAL };
        spread_direction(i, AROUND_COUNT, lights[i].direction);
        for (int k = 0; k < 3; k++)
            lights[i].rgb[k] = 10.0 / AROUND_COUNT;
    }
}

/* How much what enters through a face differs from face to face, as a part of it, by root mean square. */
static double unevenness(const struct io_light lights[AROUND_COUNT], double eta)
{
    enum { FACES = 500 };
    double sum = 0, sum2 = 0;
    for (int f = 0; f < FACES; f++) {
        double normal[3], entering = 0;
        spread_direction(f, FACES, normal);
        for (int i = 0; i < AROUND_COUNT; i++) {
            const double *const d = lights[i].direction;
            const double cosine = -(normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]);
            if (cosine > 0)
                entering += lights[i].rgb[0] * cosine * (1 - dipole_fresnel_reflectance(eta, cosine));
        }
        sum += entering;
        sum2 += entering * entering;
    }
    return sqrt(FACES * sum2 / (sum * sum) - 1);
}

static double relative_rmse(const struct io_image *a, const struct io_image *b)
{
    double error2 = 0, value2 = 0;
    for (size_t i = 0; i < 4 * SIDE_PX * SIDE_PX; i++) {
        const double x = (double)a->pixels[i], y = (double)b->pixels[i];
        error2 += i % 4 < 3 ? (x - y) * (x - y) : 0;
        value2 += i % 4 < 3 ? y * y : 0;
    }
    return sqrt(error2 / value2);
}

/* Oracle: symmetry. Pictures from sides that have nothing in common with the lights' directions are alike
 * within 1 %. What limits it: 60 lights do not shine quite evenly, which scattering evens out and Lambert
 * shows, twice in the difference of two pictures; then pixels at the silhouette. */
static void light_from_all_sides_shows_no_side(void **state)
{
    (void)state;
    static const int materials[] = { 0, 1, 4, 6 };
    static struct io_light lights[AROUND_COUNT];
    light_all_around(lights);
    for (size_t m = 0; m < sizeof materials / sizeof *materials; m++) {
        const struct io_material material = material_of(materials[m]);
        struct test_scene test;
        scene_init(&test, 40);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 96, RADIUS_MM, 0, &material));
        test.scene.lights = lights;
        test.scene.light_count = AROUND_COUNT;
        struct renderer *const renderer = renderer_of(&test);
        const size_t technique_count = m == 0 ? sizeof techniques / sizeof *techniques : 1;
        for (size_t t = 0; t < technique_count; t++) {
            struct io_image *first = NULL;
            double worst = 0;
            for (int side = 0; side < SIDE_COUNT; side++) {
                double direction[3];
                spread_direction(side, SIDE_COUNT + 1, direction);
                look_from(&test.scene, direction, 2.2 * RADIUS_MM, SIDE_PX);
                struct io_image *const image = draw(renderer, techniques[t], 0.05);
                if (first) {
                    worst = fmax(worst, relative_rmse(image, first));
                    io_image_destroy(image);
                } else {
                    first = image;
                }
            }
            const double uneven = unevenness(lights, renderer->media->media[0].eta);
            print_message("  %-30s, %-7s: relative RMSE %.2e, of the light %.2e\n", material.name,
                          render_technique_names[techniques[t]], worst, uneven);
            assert_true(worst < 0.01 + (techniques[t] == RENDER_TECHNIQUE_LAMBERT ? 2 * uneven : 0));
            io_image_destroy(first);
        }
        render_destroy(renderer);
        scene_end(&test);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_more_light_leaves_than_enters),
        cmocka_unit_test(light_from_all_sides_shows_no_side),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
