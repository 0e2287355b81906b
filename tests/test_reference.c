/* renderer/reference.h: closed forms, another quadrature, the splats, and rays that must or must not pass.
 */
#include "check.h"
#include "run_tool.h"
#include "scenes.h"
#include "sphere_oracle.h"

#include "renderer/reference.h"
#include "renderer/reference_pixel.h"

#include <jansson.h>

static const double PI = 3.14159265358979323846;

/* ---- what the tests share ----------------------------------------------------------------------- */

static struct io_image *draw(const struct test_scene *test, const struct render_options *options,
                             struct render_report *report)
{
    struct io_image *image;
    dipole_status status;
    if (!render_reference_draw(&test->scene, options, &image, report, &status))
        fail_msg("%s", status.message);
    return image;
}

/* The picture by OpenGL; alpha is 0 where a pixel does not show a single surface (is_masked). */
static struct io_image *draw_splats(const struct test_scene *test, const struct render_options *options,
                                    bool is_masked)
{
    struct renderer *renderer;
    struct io_image *image = NULL;
    struct render_capture *captured = NULL;
    dipole_status status;
    if (!render_create(&test->scene, RENDER_CONTEXT_DEFAULT, &renderer, &status) ||
        !render_draw(renderer, options, &image, NULL, &status) ||
        !render_capture_create(renderer, 1, &captured, &status))
        fail_msg("%s", status.message);
    for (int i = 0; i < image->width_px * image->height_px && is_masked; i++)
        image->pixels[4 * i + 3] = captured->coverage[i] < 1 ? 0.0F : 1.0F;
    render_capture_destroy(captured);
    render_destroy(renderer);
    return image;
}

/* A medium that spreads light so little that a slab a few mm wide is infinite. */
static struct io_material murky(void)
{
    struct io_material material = { .name = "murky" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] =
            (dipole_medium){ .sigma_a_per_mm = 0.3 + 0.1 * c, .sigma_s_prime_per_mm = 1, .eta = 1.3 };
    io_material_set_media(&material, media);
    return material;
}

static void init_sphere(struct test_scene *test, const struct io_material *material, double radius_mm)
{
    scene_init(test, 10 * radius_mm);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 192, radius_mm, 0, material));
    scene_add_directional(test, -1, -1, -1, 3);
    test->scene.camera.is_orthographic = true;
    test->scene.camera.height_mm = 2.2 * radius_mm;
    test->scene.camera.width_px = 40;
    test->scene.camera.height_px = 30;
}

/* Relative RMSE of b against a over the pixels that a covers wholly, with their neighbours. */
static double difference(const struct io_image *a, const struct io_image *b)
{
    double error2 = 0, value2 = 0;
    assert_int_equal(a->width_px, b->width_px);
    for (int y = 1; y + 1 < a->height_px; y++) {
        for (int x = 1; x + 1 < a->width_px; x++) {
            bool is_inside = true;
            for (int i = 0; i < 9; i++) {
                const int at = 4 * ((y + i / 3 - 1) * a->width_px + x + i % 3 - 1) + 3;
                is_inside = is_inside && a->pixels[at] >= 1 && b->pixels[at] >= 1;
            }
            for (int c = 0; c < 3 && is_inside; c++) {
                const int at = 4 * (y * a->width_px + x) + c;
                const double expected = (double)a->pixels[at], error = (double)b->pixels[at] - expected;
                error2 += error * error;
                value2 += expected * expected;
            }
        }
    }
    assert_true(value2 > 0);
    return sqrt(error2 / value2);
}

/* ---- the surface as a line ---------------------------------------------------------------------- */

/* Oracle: parts of a line of length 1. Cells have equal areas, so a sphere's part of them is its part of
 * the area, and the mean of the normals of a closed surface is 0; they are compact. */
static void cells_are_equal_and_compact(void **state)
{
    (void)state;
    enum { CELLS = 1024, POINTS = 64 };
    struct test_scene test;
    const struct io_material material = murky();
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 1, 0, &material) &&
                scene_add(&test, IO_PRIMITIVE_SLAB, 8, 2, 5, &material));
    struct render_surface *surface;
    assert_true(render_surface_create(&test.scene, &surface, NULL));
    const double area_mm2 = render_surface_area_mm2(surface);
    /* sphere of 64 segments: within 0.3 % of the smooth one; slab of 4 x 4 x 2 mm */
    assert_close(area_mm2, 4 * PI + 2 * 16 + 4 * 4 * 2, 0.002, "area");
    double on_sphere = 0, normals[3] = { 0 };
    int wide_count = 0;
    for (int cell = 0; cell < CELLS; cell++) {
        double min[3] = { 1e9, 1e9, 1e9 }, max[3] = { -1e9, -1e9, -1e9 }, diagonal2 = 0;
        for (int i = 0; i < POINTS; i++) {
            struct render_surface_point point;
            render_surface_at(surface, (cell + (i + 0.5) / POINTS) / CELLS, &point);
            on_sphere += point.object == 0;
            for (int k = 0; k < 3; k++) {
                normals[k] += point.facet_normal[k];
                min[k] = fmin(min[k], point.position_mm[k]);
                max[k] = fmax(max[k], point.position_mm[k]);
            }
        }
        for (int k = 0; k < 3; k++)
            diagonal2 += (max[k] - min[k]) * (max[k] - min[k]);
        wide_count += sqrt(diagonal2) > 4 * sqrt(area_mm2 / CELLS);
    }
    assert_close(on_sphere / (CELLS * POINTS), 1 - (2 * 16 + 4 * 4 * 2) / area_mm2, 0.001,
                 "the sphere's part");
    for (int k = 0; k < 3; k++)
        assert_true(fabs(normals[k]) < 0.001 * CELLS * POINTS);
    assert_true(wide_count < CELLS / 10);
    render_surface_destroy(surface);
    scene_end(&test);
}

/* ---- rays --------------------------------------------------------------------------------------- */

static bool is_lit(const struct render_tracer *tracer, const struct io_light *light,
                   const struct render_surface_point *point)
{
    double to_light[3], falloff, left[3];
    return render_light_reaches(tracer, light, point, to_light, &falloff, left);
}

static struct io_light random_light(struct rng *rng)
{
    struct io_light light = { .kind = IO_LIGHT_DIRECTIONAL };
    double length2 = 0;
    for (int k = 0; k < 3; k++) {
        light.direction[k] = uniform(rng, -1, 1);
        length2 += light.direction[k] * light.direction[k];
    }
    for (int k = 0; k < 3; k++)
        light.direction[k] /= sqrt(length2);
    return light;
}

/* Oracle: two cubes that touch are one box. Its outside is lit wherever it faces the light, and no light
 * comes through where they touch. Also far from the origin, where floats are coarse. */
static void no_light_comes_through_a_contact(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    for (int far = 0; far < 2; far++) {
        const double shift_mm = far ? 1000 : 0;
        struct test_scene test;
        const struct io_material material = murky();
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 8, 1, shift_mm, &material) &&
                    scene_add(&test, IO_PRIMITIVE_CUBE, 4, 1, shift_mm + 2, &material));
        struct render_surface *surface;
        struct render_tracer *tracer;
        assert_true(render_surface_create(&test.scene, &surface, NULL));
        assert_true(render_tracer_create(&test.scene, &tracer, NULL));
        for (int i = 0; i < 50000; i++) {
            const struct io_light light = random_light(&rng);
            struct render_surface_point point;
            render_surface_at(surface, uniform(&rng, 0, 1), &point);
            const bool is_contact =
                fabs(point.position_mm[0] - shift_mm - 1) < 1e-4 && fabs(point.facet_normal[0]) > 0.5;
            const bool is_facing = render_dot(point.facet_normal, light.direction) < 0;
            assert_int_equal(is_lit(tracer, &light, &point), is_facing && !is_contact);
        }
        render_tracer_destroy(tracer);
        render_surface_destroy(surface);
        scene_end(&test);
    }
}

/* Oracle: a convex object does not shade itself, up to a few facets that rounding turned inwards. */
static void a_convex_object_does_not_shade_itself(void **state)
{
    (void)state;
    struct rng rng = { .seed = 6 };
    struct test_scene test;
    const struct io_material material = murky();
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 256, 10, 100, &material));
    struct render_surface *surface;
    struct render_tracer *tracer;
    assert_true(render_surface_create(&test.scene, &surface, NULL));
    assert_true(render_tracer_create(&test.scene, &tracer, NULL));
    int dark_count = 0;
    for (int i = 0; i < 100000; i++) {
        const struct io_light light = random_light(&rng);
        struct render_surface_point point;
        render_surface_at(surface, uniform(&rng, 0, 1), &point);
        if (render_dot(point.facet_normal, light.direction) < 0)
            dark_count += !is_lit(tracer, &light, &point);
    }
    assert_true(dark_count <= 5);
    render_tracer_destroy(tracer);
    render_surface_destroy(surface);
    scene_end(&test);
}

/* Oracle: geometry. A cube at x = 6..8 on a slab, lit from the left at 45 degrees, from afar and by a point
 * light in that direction: x = 8..9 lies in its shadow, the rest of the slab's top is lit. */
static void shadows_fall_where_they_should(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = murky();
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 10, 0, &material) &&
                scene_add(&test, IO_PRIMITIVE_CUBE, 4, 1, 7, &material));
    scene_add_directional(&test, 1, -1, 0, 1);
    scene_add_point(&test, 8.5 - 1e4, 1e4, 0, 1);
    struct render_tracer *tracer;
    assert_true(render_tracer_create(&test.scene, &tracer, NULL));
    for (double x_mm = -9.9; x_mm < 9.9; x_mm += 0.0173) {
        struct render_surface_point point;
        const double above_mm[3] = { x_mm, 5, 0.3 }, down[3] = { 0, -2, 0 };
        assert_true(render_tracer_find(tracer, above_mm, down, &point));
        const bool is_slab = point.object == 0;
        assert_int_equal(is_slab, x_mm < 6 || x_mm > 8);
        assert_true(fabs(point.position_mm[1] - (is_slab ? 0 : 1)) < 1e-12);
        if (fabs(x_mm - 8) < 0.02 || fabs(x_mm - 9) < 0.02 || fabs(x_mm - 6) < 0.02)
            continue;
        for (int i = 0; i < 2; i++)
            assert_int_equal(is_lit(tracer, &test.lights[i], &point), x_mm < 8 || x_mm > 9);
    }
    render_tracer_destroy(tracer);
    scene_end(&test);
}

/* ---- pictures ----------------------------------------------------------------------------------- */

enum { SLAB_PX = 16, SLAB_SEEN_MM = 3 };

/* The middle of a wide slab, seen from above, as radiosity over what enters, channel by channel. */
static void slab_ratio(const struct io_material *material, double half_mm, double ratio[3])
{
    struct test_scene test;
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, half_mm, 0, material));
    scene_add_directional(&test, 0, -1, 0, 2);
    test.scene.camera = (struct io_camera){ .eye_mm = { 0, half_mm, 0 },
                                            .up = { 0, 0, 1 },
                                            .is_orthographic = true,
                                            .height_mm = 2 * SLAB_SEEN_MM,
                                            .width_px = SLAB_PX,
                                            .height_px = SLAB_PX };
    struct render_report report;
    struct io_image *const image = draw(&test, &(struct render_options){ .epsilon = 0.06 }, &report);
    assert_int_equal(report.note_count, 0);
    const double eta = material->layers[0][0].medium.eta;
    const double leaving = 1 - dipole_fresnel_reflectance(eta, 1);
    for (int c = 0; c < 3; c++) {
        double radiance = 0;
        for (size_t i = 0; i < SLAB_PX * SLAB_PX; i++)
            radiance += (double)image->pixels[4 * i + (size_t)c] / (SLAB_PX * SLAB_PX);
        const double radiosity = radiance * PI * dipole_fdt_outside(eta) / leaving;
        ratio[c] = radiosity / (2 * leaving);
    }
    io_image_destroy(image);
    scene_end(&test);
}

/* A layer of one and a half mean free paths on a base that absorbs more. */
static struct io_material layered(dipole_model model)
{
    struct io_material material = murky();
    material.model = model;
    material.layer_count = 2;
    for (int c = 0; c < 3; c++) {
        material.layers[c][1] = material.layers[c][0];
        material.layers[c][1].medium.sigma_a_per_mm = 1;
        material.layers[c][0].thickness_mm = 1.5;
    }
    return material;
}

/* Oracle: conservation of energy. What leaves at the middle of a wide slab is what the medium sends back of
 * all that enters, in closed form; the slab's end, r_max(1e-4), and the estimated error, 4e-4, leave less
 * than 1e-3. All models, half-spaces and layers. */
static void energy_is_conserved(void **state)
{
    (void)state;
    for (dipole_model model = DIPOLE_MODEL_DIPOLE; model <= DIPOLE_MODEL_MODES; model++) {
        for (int has_layers = 0; has_layers < 2; has_layers++) {
            if (has_layers > 0 && model < DIPOLE_MODEL_MULTIPOLE)
                continue;
            struct io_material material = has_layers > 0 ? layered(model) : murky();
            material.model = model;
            double totals[3], ratio[3], half_mm = 0;
            for (int c = 0; c < 3; c++) {
                dipole_stack *stack;
                assert_true(dipole_stack_create(material.layers[c], material.layer_count, model,
                                                DIPOLE_FROM_ABOVE, &stack, NULL));
                totals[c] = dipole_stack_total(stack, DIPOLE_FACE_LIT);
                half_mm = fmax(half_mm, dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-4));
                dipole_stack_destroy(stack);
            }
            slab_ratio(&material, half_mm + SLAB_SEEN_MM, ratio);
            for (int c = 0; c < 3; c++)
                assert_close(ratio[c], totals[c], 1e-3, "model %d, layers %d, channel %d", (int)model,
                             has_layers, c);
        }
    }
}

/* Oracle: light leaves by the object that it entered. Two spheres of different media touch; one stands in
 * the other's shadow and stays exactly black. */
static void no_light_leaks_into_another_medium(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material lit = layered(DIPOLE_MODEL_BEAM), dark = marble();
    scene_init(&test, 30);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 2, -2, &lit) &&
                scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 1.8, 1.8, &dark));
    scene_add_directional(&test, 1, 0, 0, 3);
    struct io_image *const image = draw(&test, &(struct render_options){ .epsilon = 0.1 }, NULL);
    int lit_count = 0, dark_count = 0;
    for (int i = 0; i < image->width_px * image->height_px; i++) {
        const float *const rgba = image->pixels + 4 * (size_t)i;
        const int x = i % image->width_px;
        if (!(rgba[3] >= 1) || abs(2 * x - image->width_px) < 4)
            continue;
        const bool is_lit_one = 2 * x < image->width_px;
        for (int c = 0; c < 3; c++)
            assert_true(is_lit_one ? rgba[c] > 0 : rgba[c] == 0);
        lit_count += is_lit_one;
        dark_count += !is_lit_one;
    }
    assert_true(lit_count > 20 && dark_count > 20);
    io_image_destroy(image);
    scene_end(&test);
}

/* Oracle: each object alone. Two spheres side by side, of different models, coefficients and indices;
 * neither shades the other. Both pictures err by a tenth of epsilon. */
static void each_object_has_its_own_medium(void **state)
{
    (void)state;
    struct io_material materials[] = { layered(DIPOLE_MODEL_MODES), marble() };
    materials[1].model = DIPOLE_MODEL_BETTER_DIPOLE;
    const struct render_options options = { .epsilon = 0.02 };
    struct io_image *images[3];
    for (int which = 0; which < 3; which++) {
        struct test_scene test;
        scene_init(&test, 30);
        for (int i = 0; i < 2; i++) {
            if (which == i || which == 2)
                assert_true(
                    scene_add(&test, IO_PRIMITIVE_SPHERE, 96, 2, i == 0 ? -2.5 : 2.5, &materials[i]));
        }
        for (size_t i = 0; i < test.scene.object_count; i++)
            test.objects[i].has_specular = true;
        scene_add_directional(&test, 0, -0.6, -0.8, 3);
        images[which] = draw(&test, &options, NULL);
        scene_end(&test);
    }
    for (int i = 0; i < 2; i++) {
        const double error = difference(images[i], images[2]);
        print_message("  object %d: relative RMSE %.2g\n", i, error);
        assert_true(error < 0.006);
    }
    for (int which = 0; which < 3; which++)
        io_image_destroy(images[which]);
}

/* Oracle: symmetry. A sphere looks alike from all sides when its light turns with the eye; its mesh, with
 * poles, does not turn, and each picture errs by a tenth of epsilon. */
static void a_sphere_looks_alike_from_all_sides(void **state)
{
    (void)state;
    const double turns[][3][3] = { /* right, up, toward the eye */
                                   { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
                                   { { 0, 1, 0 }, { 0, 0, 1 }, { 1, 0, 0 } },
                                   { { 0.6, 0.8, 0 }, { 0, 0, -1 }, { -0.8, 0.6, 0 } }
    };
    const struct io_material material = layered(DIPOLE_MODEL_BEAM);
    struct io_image *first = NULL;
    for (size_t n = 0; n < sizeof turns / sizeof *turns; n++) {
        struct test_scene test;
        init_sphere(&test, &material, 3);
        for (int k = 0; k < 3; k++) {
            test.scene.camera.eye_mm[k] = 30 * turns[n][2][k];
            test.scene.camera.up[k] = turns[n][1][k];
            test.lights[0].direction[k] = -(turns[n][0][k] + turns[n][1][k] + turns[n][2][k]) / sqrt(3);
        }
        struct io_image *const image = draw(&test, &(struct render_options){ .epsilon = 0.02 }, NULL);
        scene_end(&test);
        if (first) {
            const double error = difference(first, image);
            print_message("  relative RMSE %.2g\n", error);
            assert_true(error < 0.006);
            io_image_destroy(image);
        } else {
            first = image;
        }
    }
    io_image_destroy(first);
}

/* Oracle: a quadrature over the sphere that knows neither mesh nor rays, at the middle of pixels; 0.1 %
 * each of quadrature, estimate and what pixels of a fifth of a mean free path blur. */
static void a_sphere_equals_another_quadrature(void **state)
{
    (void)state;
    const double radius_mm = 3;
    struct test_scene test;
    const struct io_material material = skin1();
    init_sphere(&test, &material, radius_mm);
    struct render_report report;
    struct io_image *const image = draw(&test, &(struct render_options){ .epsilon = 0.01 }, &report);
    struct io_image *const expected = draw(&test, &(struct render_options){ .sample_limit = 1 }, NULL);
    dipole_coefficients k[3];
    for (int c = 0; c < 3; c++)
        assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k[c], NULL));
    const double toward_light[3] = { sqrt(1 / 3.0), sqrt(1 / 3.0), sqrt(1 / 3.0) };
    const double pixel_mm = test.scene.camera.height_mm / 30;
    for (int i = 0; i < 40 * 30; i++) {
        double p[3] = { (i % 40 + 0.5 - 20) * pixel_mm, (15 - i / 40 - 0.5) * pixel_mm, 0 }, radiosity[3];
        const double z2 = radius_mm * radius_mm - p[0] * p[0] - p[1] * p[1];
        if (z2 < 0.36 * radius_mm * radius_mm) {
            expected->pixels[4 * i + 3] = 0; /* seen at a slant: not compared */
            continue;
        }
        p[2] = sqrt(z2);
        sphere_radiosity(p, radius_mm, toward_light, 3, k, radiosity);
        const double exit =
            (1 - dipole_fresnel_reflectance(1.3, p[2] / radius_mm)) / (PI * dipole_fdt_outside(1.3));
        for (int c = 0; c < 3; c++)
            expected->pixels[4 * i + c] = (float)(radiosity[c] * exit);
    }
    const double error = difference(expected, image);
    print_message("  %zu samples, estimated %.2g, found %.2g\n", report.sample_count,
                  report.error_predicted, error);
    assert_true(error < 0.003);
    io_image_destroy(expected);
    io_image_destroy(image);
    scene_end(&test);
}

/* Oracle: a picture that is several times as exact. The error is no more than estimated, and falls at least
 * as fast as the root of the number of samples. */
static void errors_fall_and_are_estimated(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = skin1();
    init_sphere(&test, &material, 3);
    scene_add_point(&test, 4, -5, 4, 20);
    struct render_report report;
    struct io_image *const exact = draw(&test, &(struct render_options){ .epsilon = 0.006 }, &report);
    assert_true(report.error_predicted <= 0.0006 && report.doubling_count >= 4);
    const struct render_doubling *const first = &report.doublings[1];
    const struct render_doubling *const last = &report.doublings[report.doubling_count - 1];
    assert_true(last->error / first->error <=
                pow((double)last->sample_count / (double)first->sample_count, -0.5));
    for (size_t limit = 1 << 17; limit <= 1 << 18; limit *= 2) {
        struct render_report rough;
        struct io_image *const image =
            draw(&test, &(struct render_options){ .epsilon = 1e-5, .sample_limit = limit }, &rough);
        const double error = difference(exact, image);
        print_message("  %zu samples: estimated %.2g, found %.2g\n", limit, rough.error_predicted, error);
        assert_int_equal(rough.sample_count, limit);
        assert_int_equal(rough.note_count, 1);
        assert_true(error < rough.error_predicted + report.error_predicted);
        io_image_destroy(image);
    }
    io_image_destroy(exact);
    scene_end(&test);
}

/* Oracle: the splat renderer, which shares neither samples nor rays nor profile; a directional and a point
 * light, a convex object and one that shades itself. */
static void splats_are_near_the_reference(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct test_scene test;
        const struct io_material material = i == 0 ? skin1() : murky();
        init_sphere(&test, &material, 4);
        if (i == 1) {
            scene_end(&test);
            scene_init(&test, 30);
            assert_true(scene_add(&test, IO_PRIMITIVE_KNOT, 256, 5, 0, &material));
            test.scene.camera.is_orthographic = true;
            test.scene.camera.height_mm = 11;
            scene_add_directional(&test, 1, -1, -1, 3);
            scene_add_point(&test, 12, 4, 9, 200);
        }
        test.scene.camera.width_px = 64;
        test.scene.camera.height_px = 48;
        struct io_image *const splats = draw_splats(
            &test, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.005 }, true);
        struct io_image *const exact = draw(&test, &(struct render_options){ .epsilon = 0.02 }, NULL);
        const double error = difference(exact, splats);
        print_message("  %s: relative RMSE %.2e\n", i == 0 ? "sphere" : "knot", error);
        assert_true(error < 0.01);
        io_image_destroy(splats);
        io_image_destroy(exact);
        scene_end(&test);
    }
}

/* Oracle: the same picture by another number of threads. */
static void threads_do_not_change_a_byte(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = murky();
    init_sphere(&test, &material, 3);
    test.objects[0].has_specular = true;
    struct io_image *first = NULL;
    for (int threads = 1; threads <= 5; threads += threads == 1 ? 1 : 3) {
        struct io_image *const image =
            draw(&test, &(struct render_options){ .epsilon = 0.1, .thread_count = threads }, NULL);
        if (first) {
            assert_memory_equal(image->pixels, first->pixels, 40 * 30 * 4 * sizeof *image->pixels);
            io_image_destroy(image);
        } else {
            first = image;
        }
    }
    io_image_destroy(first);
    scene_end(&test);
}

/* Oracle: GGX at the mirror angle, by the formula, on top of a picture without gloss. */
static void gloss_is_added(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = murky();
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 4, 0, &material));
    scene_add_directional(&test, 0, -1, 0, 2);
    test.scene.camera = (struct io_camera){ .eye_mm = { 0, 4, 0 },
                                            .up = { 0, 0, 1 },
                                            .is_orthographic = true,
                                            .height_mm = 0.1,
                                            .width_px = 3,
                                            .height_px = 3 };
    const struct render_options options = { .epsilon = 0.1 };
    struct io_image *const matt = draw(&test, &options, NULL);
    test.objects[0].has_specular = true;
    struct io_image *const glossy = draw(&test, &options, NULL);
    const double alpha = test.objects[0].roughness;
    const double mirrored = 2 * dipole_fresnel_reflectance(1.3, 1) / (PI * alpha * alpha) / 4;
    for (int i = 0; i < 3 * 3 * 4; i++)
        assert_close((double)glossy->pixels[i], (double)matt->pixels[i] + (i % 4 < 3 ? mirrored : 0), 1e-5,
                     "value %d", i);
    io_image_destroy(matt);
    io_image_destroy(glossy);
    scene_end(&test);
}

/* Oracle: the GLSL of the tone map, over a background on both sides of the knee. Nothing shines, so nothing
 * is summed or traced, and the report says so. */
static void darkness_is_tone_mapped_as_by_opengl(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = murky();
    init_sphere(&test, &material, 3);
    test.scene.light_count = 0;
    const double background[3] = { 0.2, 0.9, 3 };
    memcpy(test.scene.background, background, sizeof background);
    struct render_options options = { .is_tone_mapped = true };
    struct render_report report;
    struct io_image *const image = draw(&test, &options, &report);
    options.technique = RENDER_TECHNIQUE_SPLAT;
    struct io_image *const other = draw_splats(&test, &options, false);
    for (int i = 0; i < 10 * 4; i++)
        assert_true(fabs((double)image->pixels[i] - (double)other->pixels[i]) < 1e-6);
    assert_int_equal(report.sample_count, 0);
    for (size_t e = 0; e < report.effect_count; e++) {
        const char *const name = report.effects[e].name;
        assert_int_equal(report.effects[e].is_active,
                         strcmp(name, "surface") == 0 || strcmp(name, "tone_map") == 0);
        assert_true(report.effects[e].reason[0] != '\0');
    }
    io_image_destroy(image);
    io_image_destroy(other);
    scene_end(&test);
}

/* ---- the program -------------------------------------------------------------------------------- */

static const char scene_json[] =
    "{ \"camera\": { \"eye\": [0, 0, 30], \"target\": [0, 0, 0], \"fov_y_deg\": 25, \"size\": [32, 24] },\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"sphere\", \"detail\": 64, \"transform\": { \"scale\": 5 },\n"
    "                \"material\": \"skin1\", \"roughness\": 0.4 }] }\n";

/* Oracle: the contract of --json. A window cannot be had without a display, and none is asked for. */
static void the_program_needs_no_opengl(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    write_text("scene.json", scene_json);
    run_tool(&run, "render", "scene.json", "-o", "a.exr", "--context", "window", "-t", "splat");
    assert_int_equal(run.exit_code, 1);
    run_tool(&run, "render", "scene.json", "-o", "a.exr", "-t", "reference", "--epsilon", "0.1", "--json");
    assert_done(&run);
    json_t *const result = json_loads(run.out, 0, NULL);
    const char *technique, *image;
    double epsilon, total_ms;
    json_int_t peak_rss_bytes;
    json_t *effects, *error_predicted;
    assert_int_equal(json_unpack(result, "{s:s, s:f, s:o, s:n, s:o, s:f, s:I, s:s !}", "technique",
                                 &technique, "epsilon", &epsilon, "error_predicted", &error_predicted,
                                 "predicted_ms", "effects", &effects, "total_ms", &total_ms,
                                 "peak_rss_bytes", &peak_rss_bytes, "image", &image),
                     0);
    assert_string_equal(technique, "reference");
    assert_int_equal(json_array_size(effects), 6);
    const char *name, *reason;
    int is_active;
    double time_ms, error;
    assert_int_equal(json_unpack(json_array_get(effects, 3), "{s:s, s:b, s:s, s:n, s:F, s:F !}", "name",
                                 &name, "active", &is_active, "reason", &reason, "predicted_ms", "ms",
                                 &time_ms, "error", &error),
                     0);
    assert_string_equal(name, "surface_integral");
    assert_true(is_active && strstr(reason, "estimated error"));
    json_decref(result);
    run_tool(&run, "render", "scene.json", "-o", "b.exr", "-t", "reference", "--epsilon", "0.1",
             "--explain");
    assert_done(&run);
    assert_non_null(strstr(run.out, "estimated error\n"));
    assert_int_equal(system("cmp -s a.exr b.exr"), 0);
    assert_int_equal(count_entries("."), 3);
    free(run.out);
}

/* Oracle: exact messages, and no picture. */
static void the_program_refuses_what_has_no_meaning(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("scene.json", scene_json);
    run_tool(&run, "render", "scene.json", "-o", "a.exr", "-t", "reference", "--luts", ".");
    assert_failed(&run, 2, "render: --technique reference cannot be used with --luts\n");
    run_tool(&run, "render", "scene.json", "-o", "a.exr", "-t", "reference", "--view");
    assert_failed(&run, 2, "render: --technique reference cannot be used with --view\n");
    run_tool(&run, "render", "scene.json", "-o", "a.exr", "-t", "reference", "--context", "window");
    assert_failed(&run, 2, "render: --technique reference cannot be used with --context\n");
    assert_int_equal(count_entries("."), 1);
    free(run.out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_are_equal_and_compact),
        cmocka_unit_test(no_light_comes_through_a_contact),
        cmocka_unit_test(a_convex_object_does_not_shade_itself),
        cmocka_unit_test(shadows_fall_where_they_should),
        cmocka_unit_test(energy_is_conserved),
        cmocka_unit_test(no_light_leaks_into_another_medium),
        cmocka_unit_test(each_object_has_its_own_medium),
        cmocka_unit_test(a_sphere_looks_alike_from_all_sides),
        cmocka_unit_test(a_sphere_equals_another_quadrature),
        cmocka_unit_test(errors_fall_and_are_estimated),
        cmocka_unit_test(splats_are_near_the_reference),
        cmocka_unit_test(threads_do_not_change_a_byte),
        cmocka_unit_test(gloss_is_added),
        cmocka_unit_test(darkness_is_tone_mapped_as_by_opengl),
        tool_test(the_program_needs_no_opengl),
        tool_test(the_program_refuses_what_has_no_meaning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
