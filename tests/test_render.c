/* renderer/render.h: pictures against sums and integrals that were not drawn. */
#include "check.h"
#include "drawing.h"
#include "sphere_oracle.h"

#include "renderer/gl.h"
#include "renderer/render.h"
#include "renderer/renderer.h"

/* ---- what the tests share ----------------------------------------------------------------------- */

/* A lit scene of one object; true with a back light. */
static void init_lit(struct test_scene *test, enum io_primitive primitive, double scale_mm, bool is_back,
                     const struct io_material *material)
{
    scene_init(test, 5 * scale_mm);
    test->scene.camera.width_px = 160;
    test->scene.camera.height_px = 120;
    assert_true(scene_add(test, primitive, 192, scale_mm, 0, material));
    if (is_back)
        scene_add_directional(test, 0.3, -0.5, 1, 3);
    else
        scene_add_directional(test, -1, -1, -1, 3);
}

/* ---- sums --------------------------------------------------------------------------------------- */

/* Radiance of pixel i as the capture predicts it, channel c. */
static double summed_radiance(const struct render_capture *captured, size_t i, int c,
                              const dipole_coefficients *k, double r_max_mm)
{
    const float *const here = captured->position_mm + 3 * i;
    double radiosity = 0;
    for (size_t s = 0; s < captured->samples.count; s++) {
        const struct render_light_sample *const sample = &captured->samples.samples[s];
        double r2 = 0;
        for (int a = 0; a < 3; a++) {
            const double d = (double)here[a] - (double)sample->position_mm[a];
            r2 += d * d;
        }
        const double r_mm = sqrt(r2);
        if (r_mm <= r_max_mm)
            radiosity += (double)sample->flux_w[c] * dipole_rd_per_mm2(k, r_mm);
    }
    return (double)captured->exit_per_sr[i] * radiosity + (double)captured->specular[3 * i + (size_t)c];
}

/* The error of a picture against the sum over all pairs of pixels and light samples. */
static struct deviation deviation_from_sum(enum io_primitive primitive, double scale_mm, bool is_back,
                                           bool is_truncated)
{
    struct test_scene test;
    const struct io_material material = is_back ? marble() : skin1();
    init_lit(&test, primitive, scale_mm, is_back, &material);
    test.objects[0].has_specular = true;
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT };
    struct render_report report;
    struct io_image *const image = draw(renderer, &options, &report);
    struct render_capture *const captured = capture(renderer, report.spacing_mm);
    assert_int_equal(captured->samples.count, report.sample_count);
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < (size_t)image->width_px * (size_t)image->height_px; i += 11) {
        if (captured->coverage[i] < 1)
            continue;
        for (int c = 0; c < 3; c++) {
            dipole_coefficients k;
            assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k, NULL));
            const double r_max_mm = is_truncated ? report.r_max_mm : INFINITY;
            deviation_add(&deviation, (double)image->pixels[4 * i + (size_t)c],
                          summed_radiance(captured, i, c, &k, r_max_mm));
        }
    }
    print_message("  primitive %d: %zu samples in %d bands, relative RMSE %.2e, worst %.2e of the peak\n",
                  primitive, report.sample_count, report.band_count, relative_rmse(&deviation),
                  deviation.worst / deviation.peak);
    render_capture_destroy(captured);
    io_image_destroy(image);
    render_destroy(renderer);
    scene_end(&test);
    return deviation;
}

/* Oracle: the sum over the same samples in double, cut off at the same r_max; what is left is the table
 * (0.1 %), the bands (0.02 %) and float. */
static void splats_equal_the_sum_over_all_pairs(void **state)
{
    (void)state;
    for (int is_back = 0; is_back < 2; is_back++) {
        const struct deviation sphere = deviation_from_sum(IO_PRIMITIVE_SPHERE, 6, is_back, true);
        const struct deviation knot = deviation_from_sum(IO_PRIMITIVE_KNOT, 6, is_back, true);
        assert_true(relative_rmse(&sphere) < 0.002);
        assert_true(relative_rmse(&knot) < 0.002);
    }
}

/* Oracle: an upper bound on the same without the cut, by the truncation share of epsilon. */
static void splats_are_near_the_sum_without_a_cut(void **state)
{
    (void)state;
    const struct deviation sphere = deviation_from_sum(IO_PRIMITIVE_SPHERE, 12, false, false);
    assert_true(relative_rmse(&sphere) < 0.005);
}

/* ---- integrals ---------------------------------------------------------------------------------- */

/* Oracle: the surface integral over the sphere, by a quadrature that knows neither light view nor mesh. */
static void splats_approach_the_surface_integral(void **state)
{
    (void)state;
    for (int is_back = 0; is_back < 2; is_back++) {
        const double radius_mm = 6;
        const struct io_material material = marble();
        struct test_scene test;
        init_lit(&test, IO_PRIMITIVE_SPHERE, radius_mm, is_back, &material);
        dipole_coefficients k[3];
        for (int c = 0; c < 3; c++)
            assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k[c], NULL));
        const double *const direction = test.lights[0].direction;
        const double toward_light[3] = { -direction[0], -direction[1], -direction[2] };
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_report report;
        struct io_image *const image =
            draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT }, &report);
        struct render_capture *const captured = capture(renderer, report.spacing_mm);
        struct deviation deviation = { 0 };
        for (size_t i = 0; i < (size_t)image->width_px * (size_t)image->height_px; i += 29) {
            double radiosity[3];
            if (captured->coverage[i] < 1)
                continue;
            const float *const p = captured->position_mm + 3 * i;
            const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
            sphere_radiosity(position_mm, radius_mm, toward_light, test.lights[0].rgb[0], k, radiosity);
            for (int c = 0; c < 3; c++)
                deviation_add(&deviation, (double)image->pixels[4 * i + (size_t)c],
                              (double)captured->exit_per_sr[i] * radiosity[c]);
        }
        print_message("  %s: relative RMSE %.2e, worst %.2e of the peak\n", is_back ? "back" : "front",
                      relative_rmse(&deviation), deviation.worst / deviation.peak);
        assert_true(relative_rmse(&deviation) < 0.02);
        render_capture_destroy(captured);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* Oracle: conservation of energy. On a slab wider than the light spreads, what leaves at its middle is the
 * closed-form diffuse reflectance of what enters there. */
static void energy_is_conserved(void **state)
{
    (void)state;
    static const char *const names[] = { "apple",   "chicken1", "chicken2",   "cream",
                                         "ketchup", "marble",   "potato",     "skimmilk",
                                         "skin1",   "skin2",    "spectralon", "wholemilk" };
    const double epsilon = 0.005, irradiance = 2;
    for (size_t m = 0; m < sizeof names / sizeof *names; m++) {
        char path[512];
        struct io_material material;
        dipole_status status;
        snprintf(path, sizeof path, "%s/materials/%s.json", SOURCE_FOLDER, names[m]);
        if (!io_material_read(path, &material, &status))
            fail_msg("%s", status.message);
        double reach_mm = 0, reflectance[3];
        for (int c = 0; c < 3; c++) {
            dipole_coefficients k;
            assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k, NULL));
            reach_mm = fmax(reach_mm, dipole_r_max_mm(&k, epsilon / 2));
            reflectance[c] = dipole_diffuse_reflectance(&k);
        }
        struct test_scene test;
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 1.05 * reach_mm, 0, &material));
        scene_add_directional(&test, 0, -1, 0, irradiance);
        test.scene.camera = (struct io_camera){ .eye_mm = { 0, reach_mm, 0 },
                                                .up = { 0, 0, 1 },
                                                .is_orthographic = true,
                                                .height_mm = 0.01 * reach_mm,
                                                .width_px = 4,
                                                .height_px = 4 };
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = epsilon };
        struct render_report report;
        struct io_image *const image = draw(renderer, &options, &report);
        const double eta = material.layers[0][0].medium.eta;
        const double leaving = 1 - dipole_fresnel_reflectance(eta, 1);
        double worst = 0;
        for (int i = 0; i < 16 * 4; i++) {
            if (i % 4 == 3)
                continue;
            const double radiosity = (double)image->pixels[i] * PI * dipole_fdt_outside(eta) / leaving;
            const double found = radiosity / (irradiance * leaving);
            worst = fmax(worst, fabs(found / reflectance[i % 4] - 1));
        }
        print_message("  %-10s %8zu samples in %d bands, %.2f %% off\n", names[m], report.sample_count,
                      report.band_count, 100 * worst);
        assert_true(worst < 0.01);
        assert_true(report.error_predicted < 0.01);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* Power that enters a slab of half-width half_mm at y = 0 from a point light, by the midpoint rule. */
static double slab_flux_w(double half_mm, const double light_mm[3], double intensity, double eta)
{
    enum { STEPS = 1200 };
    const double step_mm = 2 * half_mm / STEPS;
    double flux_w = 0;
    for (int i = 0; i < STEPS; i++) {
        for (int j = 0; j < STEPS; j++) {
            const double x = -half_mm + (i + 0.5) * step_mm - light_mm[0];
            const double z = -half_mm + (j + 0.5) * step_mm - light_mm[2];
            const double d2 = x * x + z * z + light_mm[1] * light_mm[1];
            const double cosine = light_mm[1] / sqrt(d2);
            flux_w += intensity * cosine / d2 * (1 - dipole_fresnel_reflectance(eta, cosine));
        }
    }
    return flux_w * step_mm * step_mm;
}

/* Oracle: the integral of irradiance times transmittance over the lit face. A light near the slab looks
 * in six directions, a far one in one; no seam may be counted twice or left out. */
static void all_flux_of_a_point_light_is_sampled(void **state)
{
    (void)state;
    const struct {
        double position_mm[3];
        size_t view_count;
    } rows[] = { { { 1, 3, -2 }, 6 }, { { 4, 60, 10 }, 1 }, { { 9, 1.5, 9 }, 6 } };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct test_scene test;
        const struct io_material material = marble();
        scene_init(&test, 40);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 10, 0, &material));
        const double *const p = rows[r].position_mm;
        scene_add_point(&test, p[0], p[1], p[2], 100);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_capture *const captured = capture(renderer, 0.3);
        double flux_w = 0;
        for (size_t i = 0; i < captured->samples.count; i++)
            flux_w += (double)captured->samples.samples[i].flux_w[1];
        /* A texel of the rim more or less: half a texel of 1024 on each side. */
        assert_close(flux_w, slab_flux_w(10, p, 100, 1.5), 3e-3, "light %zu", r);
        const struct render_options options = { .technique = RENDER_TECHNIQUE_LAMBERT };
        struct render_report report;
        struct io_image *const image = draw(renderer, &options, &report);
        assert_int_equal(report.view_count, rows[r].view_count);
        io_image_destroy(image);
        render_capture_destroy(captured);
        render_destroy(renderer);
        scene_end(&test);
    }
}

/* ---- wide pixels --------------------------------------------------------------------------------- */

/* Oracle: Lambert's closed form on a ball whose pixels are 2.4 mm wide, over what light spreads by in a
 * medium of which all but a thousandth leaves within 1 mm: whatever draws it looks for light on the
 * surface, not where the middle of a pixel's points lies, up to 0.02 mm below, at most of the way that half
 * of the light goes. */
static void light_is_looked_for_on_the_surface(void **state)
{
    (void)state;
    const enum render_technique techniques[] = { RENDER_TECHNIQUE_LAMBERT, RENDER_TECHNIQUE_GATHER,
                                                 RENDER_TECHNIQUE_SPLAT };
    const dipole_medium narrow = { .sigma_a_per_mm = 1.2, .sigma_s_prime_per_mm = 20, .eta = 1.3 };
    const double radius_mm = 40, height_mm = 100;
    struct io_material material = { .name = "narrow" };
    struct test_scene test;
    dipole_coefficients k;
    assert_true(dipole_coefficients_init(&narrow, &k, NULL));
    io_material_set_media(&material, (const dipole_medium[]){ narrow, narrow, narrow });
    scene_init(&test, 200);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, radius_mm, 0, &material));
    scene_add_directional(&test, 0, 0, -1, 3);
    test.scene.camera.is_orthographic = true;
    test.scene.camera.height_mm = height_mm;
    test.scene.camera.width_px = 56;
    test.scene.camera.height_px = 42;
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    for (int t = 0; t < 3; t++) {
        const struct render_options drawing = { .technique = techniques[t], .epsilon = 0.1 };
        struct io_image *const image = draw(renderer, &drawing, NULL);
        struct deviation deviation = { 0 };
        for (int i = 0; i < 56 * 42; i++) {
            const double x_mm = (i % 56 - 27.5) * height_mm / 42, y_mm = (i / 56 - 20.5) * height_mm / 42;
            const double off = hypot(x_mm, y_mm) / radius_mm, cosine = sqrt(fmax(1 - off * off, 0));
            const double through = 1 - dipole_fresnel_reflectance(1.3, cosine);
            if (off < 0.8)
                deviation_add(&deviation, (double)image->pixels[4 * i],
                              3 * cosine * through * dipole_diffuse_reflectance(&k) * through /
                                  (PI * dipole_fdt_outside(1.3)));
        }
        print_message("  %s: relative RMSE %.4f, worst %.4f of the brightest\n",
                      render_technique_names[techniques[t]], relative_rmse(&deviation),
                      deviation.worst / deviation.peak);
        assert_true(relative_rmse(&deviation) <= 0.03);
        assert_true(deviation.worst <= 0.1 * deviation.peak);
        io_image_destroy(image);
    }
    render_destroy(renderer);
    scene_end(&test);
}

/* ---- lambert, specular, composite --------------------------------------------------------------- */

/* A slab seen and lit from straight above. */
static void init_slab(struct test_scene *test, double half_mm)
{
    const struct io_material material = marble();
    scene_init(test, 0);
    assert_true(scene_add(test, IO_PRIMITIVE_SLAB, 8, half_mm, 0, &material));
    test->scene.camera = (struct io_camera){ .eye_mm = { 0, 2 * half_mm, 0 },
                                             .up = { 0, 0, 1 },
                                             .is_orthographic = true,
                                             .height_mm = half_mm,
                                             .width_px = 16,
                                             .height_px = 16 };
}

/* Oracle: the closed form on a flat face, for light at an angle: R F_t(in) E cos F_t(out) / (pi T). */
static void lambert_is_the_closed_form_on_a_flat_face(void **state)
{
    (void)state;
    struct test_scene test;
    init_slab(&test, 10);
    scene_add_directional(&test, 0.5, -1, 0.3, 2);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const image =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, NULL);
    const double cosine = 1 / sqrt(1 + 0.25 + 0.09);
    for (int i = 0; i < 16 * 16 * 4; i++) {
        dipole_coefficients k;
        if (i % 4 == 3) {
            assert_close((double)image->pixels[i], 1, 0, "coverage");
            continue;
        }
        assert_true(dipole_coefficients_init(&test.objects[0].material.layers[i % 4][0].medium, &k, NULL));
        const double radiosity =
            dipole_diffuse_reflectance(&k) * 2 * cosine * (1 - dipole_fresnel_reflectance(1.5, cosine));
        const double exit = (1 - dipole_fresnel_reflectance(1.5, 1)) / (PI * dipole_fdt_outside(1.5));
        assert_close((double)image->pixels[i], radiosity * exit, 1e-5, "value %d", i);
    }
    io_image_destroy(image);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: GGX at the mirror angle: D = 1 / (pi a^2), height-correlated Smith, by the formula; and
 * nothing of it in the shadow of a cube. */
static void specular_is_ggx_and_has_shadows(void **state)
{
    (void)state;
    struct test_scene test;
    init_slab(&test, 10);
    const struct io_material material = marble();
    test.objects[0].has_specular = true;
    scene_add_directional(&test, 0, -1, 0, 2);
    struct renderer *renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_capture *captured = capture(renderer, 1);
    const double alpha = test.objects[0].roughness;
    const double expected = 2 * dipole_fresnel_reflectance(1.5, 1) / (PI * alpha * alpha) / 4;
    for (int i = 0; i < 16 * 16 * 3; i++)
        assert_close((double)captured->specular[i], expected, 1e-4, "value %d", i);
    render_capture_destroy(captured);
    render_destroy(renderer);
    /* A cube at x = 6..8 and y = -1..1, lit from the left at 45 degrees: the slab's middle stays lit, and
     * x = 9 lies in its shadow. */
    assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 4, 1, 7, &material));
    test.lights[0].direction[0] = test.lights[0].direction[1] = -sqrt(0.5);
    test.lights[0].direction[0] *= -1;
    test.scene.camera.height_mm = 20;
    test.scene.camera.width_px = test.scene.camera.height_px = 80;
    test.objects[0].roughness = 0.9;
    renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    captured = capture(renderer, 1);
    int lit_count = 0, dark_count = 0;
    for (int i = 0; i < 80 * 80; i++) {
        const float *const p = captured->position_mm + 3 * i;
        const double x_mm = (double)p[0], z_mm = (double)p[2];
        if (captured->coverage[i] < 1 || fabs(z_mm) > 0.8 || fabs((double)p[1]) > 1e-3)
            continue;
        const bool is_dark = x_mm > 8.3 && x_mm < 8.7, is_lit = x_mm < 5.7 || x_mm > 9.3;
        assert_true(!is_dark || captured->specular[3 * i] == 0);
        assert_true(!is_lit || captured->specular[3 * i] > 0);
        dark_count += is_dark;
        lit_count += is_lit;
    }
    assert_true(dark_count > 5 && lit_count > 100);
    render_capture_destroy(captured);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the area of a disc; and edges are neither all nor nothing. */
static void coverage_is_the_area_of_the_silhouette(void **state)
{
    (void)state;
    struct test_scene test;
    init_lit(&test, IO_PRIMITIVE_SPHERE, 5, false, &(struct io_material){ .name = "" });
    test.objects[0].material = marble();
    test.scene.camera.is_orthographic = true;
    test.scene.camera.height_mm = 12;
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct io_image *const image =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, NULL);
    double area_px = 0;
    size_t edge_count = 0;
    for (size_t i = 0; i < 160 * 120; i++) {
        const float alpha = image->pixels[4 * i + 3];
        area_px += (double)alpha;
        edge_count += alpha > 0 && alpha < 1;
        assert_true(alpha > 0 || image->pixels[4 * i] == 0);
    }
    assert_close(area_px, PI * 50 * 50, 2e-3, "area");
    assert_true(edge_count > 120);
    io_image_destroy(image);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: light adds. Two lights at once give the sum of their pictures, up to the bands' merging. */
static void lights_add_up(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = skin1();
    init_lit(&test, IO_PRIMITIVE_TORUS, 8, false, &material);
    test.scene.camera.width_px = 80;
    test.scene.camera.height_px = 60;
    scene_add_point(&test, 10, 12, 6, 400);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    const struct io_light both[2] = { test.lights[0], test.lights[1] };
    const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT };
    struct io_image *images[3];
    for (int i = 0; i < 3; i++) {
        memcpy(test.lights, both, sizeof both);
        if (i < 2)
            memset(test.lights[i].rgb, 0, sizeof test.lights[i].rgb);
        images[i] = draw(renderer, &options, NULL);
    }
    struct deviation deviation = { 0 };
    for (size_t i = 0; i < 80 * 60 * 4; i++) {
        if (i % 4 < 3)
            deviation_add(&deviation, (double)images[2]->pixels[i],
                          (double)images[0]->pixels[i] + (double)images[1]->pixels[i]);
    }
    assert_true(relative_rmse(&deviation) < 1e-3);
    for (int i = 0; i < 3; i++)
        io_image_destroy(images[i]);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the formula of theory.md T20: below the knee unchanged, above it under 1 and in order; background
 * where nothing is. */
static void tone_mapping_keeps_to_the_screen(void **state)
{
    (void)state;
    struct test_scene test;
    init_lit(&test, IO_PRIMITIVE_SPHERE, 5, false, &(struct io_material){ .name = "" });
    test.objects[0].material = skin1();
    test.scene.background[0] = 0.25;
    test.scene.exposure_ev = 3;
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_options options = { .technique = RENDER_TECHNIQUE_LAMBERT };
    struct io_image *const linear = draw(renderer, &options, NULL);
    options.is_tone_mapped = true;
    struct io_image *const mapped = draw(renderer, &options, NULL);
    size_t bent_count = 0, kept_count = 0;
    for (size_t i = 0; i < 160 * 120; i++) {
        const float *const in = linear->pixels + 4 * i, *const out = mapped->pixels + 4 * i;
        const double rgb[3] = { 8 * ((double)in[0] + (1 - (double)in[3]) * 0.25), 8 * (double)in[1],
                                8 * (double)in[2] };
        const double largest = fmax(fmax(rgb[0], rgb[1]), rgb[2]);
        for (int c = 0; c < 3; c++) {
            assert_true(out[c] >= 0 && out[c] <= 1);
            if (largest < 0.59)
                assert_true(fabs((double)out[c] - rgb[c]) < 1e-5);
        }
        if (largest > 0.61) {
            const double bent = 1 - 0.4 * exp(-(largest - 0.6) / 0.4);
            assert_close(fmax(fmax((double)out[0], (double)out[1]), (double)out[2]), bent, 1e-4,
                         "pixel %zu", i);
        }
        bent_count += largest > 0.61;
        kept_count += largest < 0.59 && largest > 0;
    }
    assert_true(bent_count > 100 && kept_count > 100);
    io_image_destroy(linear);
    io_image_destroy(mapped);
    render_destroy(renderer);
    scene_end(&test);
}

/* ---- the machinery ------------------------------------------------------------------------------ */

/* Oracle: the same numbers again. */
static void the_same_scene_gives_the_same_bytes(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    init_lit(&test, IO_PRIMITIVE_KNOT, 6, false, &material);
    test.objects[0].has_specular = true;
    struct io_image *images[2];
    for (int i = 0; i < 2; i++) {
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        images[i] = draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT }, NULL);
        render_destroy(renderer);
    }
    assert_memory_equal(images[0]->pixels, images[1]->pixels, 160 * 120 * 4 * sizeof(float));
    io_image_destroy(images[0]);
    io_image_destroy(images[1]);
    scene_end(&test);
}

/* Oracle: the list of effects. What is not called for has no program and no texture. */
static void what_is_not_called_for_costs_nothing(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    init_lit(&test, IO_PRIMITIVE_SPHERE, 5, false, &material);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_report report;
    io_image_destroy(
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, &report));
    /* surface, position_depth, surface_resolve, lambert, composite; light_view where OpenGL is hardware */
    assert_int_equal(render_executor_program_count(renderer->executor), renderer->has_gpu ? 6 : 5);
    static const char *const absent[] = { "specular", "display", "capture", "light_samples" };
    for (size_t i = 0; i < sizeof absent / sizeof *absent; i++)
        assert_int_equal(render_executor_texture(renderer->executor, absent[i]), 0);
    assert_true(render_executor_texture(renderer->executor, "radiosity") != 0);
    assert_int_equal(report.sample_count, 0);
    for (size_t e = 0; e < report.effect_count; e++)
        assert_true(report.effects[e].is_active || report.effects[e].time_ms == 0);
    test.scene.light_count = 0;
    io_image_destroy(
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT }, &report));
    assert_int_equal(render_executor_texture(renderer->executor, "radiosity"), 0);
    render_destroy(renderer);
    scene_end(&test);
}

/* Draw a fragment shader over width_px x 1 pixels and read what it wrote. */
static void draw_strip(const struct render_shader *fragment, GLuint buffer_texture, int width_px,
                       float *rgba, void (*bind)(GLuint program))
{
    GLuint program, texture, framebuffer, vertex_array;
    dipole_status status;
    if (!render_program_create(render_shader_find("fullscreen.vert"), fragment, NULL, &program, &status))
        fail_msg("%s", status.message);
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, GL_RGBA32F, width_px, 1);
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
    glCreateVertexArrays(1, &vertex_array);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glViewport(0, 0, width_px, 1);
    glUseProgram(program);
    glBindTextureUnit(0, buffer_texture);
    bind(program);
    glBindVertexArray(vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glGetTextureImage(texture, 0, GL_RGBA, GL_FLOAT, width_px * 16, rgba);
    glDeleteVertexArrays(1, &vertex_array);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(1, &texture);
    glDeleteProgram(program);
}

enum { STRIP_PX = 512 };

static void bind_nothing(GLuint program)
{
    (void)program;
}

/* Oracle: libdipole's Fresnel reflectance, over both kinds of interface; float keeps 1e-5 of 1. */
static void fresnel_in_glsl_is_that_of_the_library(void **state)
{
    (void)state;
    static const struct render_shader shader = {
        "fresnel_strip.frag",
        "#include \"common/fresnel.glsl\"\n"
        "layout(location = 0) out vec4 value;\n"
        "void main() {\n"
        "  float cosine = gl_FragCoord.x / 512.0;\n"
        "  value = vec4(fresnel_reflectance(1.5, cosine), fresnel_reflectance(1.0, cosine),\n"
        "               fresnel_reflectance(0.7, cosine), fresnel_reflectance(2.4, cosine));\n"
        "}\n"
    };
    const double etas[4] = { 1.5, 1, 0.7, 2.4 };
    struct test_scene test;
    const struct io_material material = marble();
    init_lit(&test, IO_PRIMITIVE_CUBE, 5, false, &material);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    assert_true(render_make_current(renderer, NULL));
    static float rgba[4 * STRIP_PX];
    draw_strip(&shader, 0, STRIP_PX, rgba, bind_nothing);
    for (int i = 0; i < 4 * STRIP_PX; i++) {
        const int pixel = i / 4;
        const double cosine = (pixel + 0.5) / STRIP_PX;
        const double expected = dipole_fresnel_reflectance(etas[i % 4], cosine);
        assert_true(fabs((double)rgba[i] - expected) < 1e-5);
    }
    render_destroy(renderer);
    scene_end(&test);
}

static struct lut_axis strip_axis;

static void bind_table(GLuint program)
{
    const struct lut_axis *const axis = &strip_axis;
    const double end = axis->r_max_mm / axis->scale_mm;
    const double row[3] = { 0, 1 / (axis->scale_mm * axis->scale_mm),
                            (axis->node_count - 1) / log2(1 + end * end) };
    render_set_int(program, "profile_table", 0);
    render_set_int(program, "profile_last_node", axis->node_count - 1);
    render_set_vec3(program, "profile", row);
    render_set_float(program, "r_max_mm", axis->r_max_mm);
}

/* Oracle: the table as lutgen samples it on the CPU. */
static void profile_in_glsl_is_that_of_the_table(void **state)
{
    (void)state;
    static const struct render_shader shader = {
        "profile_strip.frag", "#include \"common/profile.glsl\"\n"
                              "layout(location = 0) out vec4 value;\n"
                              "uniform float r_max_mm;\n"
                              "uniform vec3 profile;\n"
                              "void main() {\n"
                              "  float r_mm = r_max_mm * gl_FragCoord.x / 512.0;\n"
                              "  value = vec4(profile_per_mm2(r_mm * r_mm, profile), r_mm);\n"
                              "}\n"
    };
    struct test_scene test;
    const struct io_material material = skin1();
    init_lit(&test, IO_PRIMITIVE_CUBE, 5, false, &material);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    assert_true(render_make_current(renderer, NULL));
    struct lut_splat *table;
    assert_true(lut_splat_bake(
        &(struct lut_request){ .materials = &material, .material_count = 1, .epsilon = 0.001 }, &table,
        NULL));
    const struct render_band_source source = { .table = table };
    strip_axis = render_bands_axis(&source);
    static float nodes[3 * 8193];
    assert_true(strip_axis.node_count <= 8193);
    for (int i = 0; i < strip_axis.node_count; i++) {
        double rgb[3];
        lut_splat_sample(table, 0, fmin(lut_axis_r_mm(&strip_axis, i), strip_axis.r_max_mm), rgb);
        for (int c = 0; c < 3; c++)
            nodes[3 * i + c] = (float)rgb[c];
    }
    GLuint buffer, texture;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, strip_axis.node_count * 12, nodes, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture);
    glTextureBuffer(texture, GL_RGB32F, buffer);
    static float rgba[4 * STRIP_PX];
    draw_strip(&shader, texture, STRIP_PX, rgba, bind_table);
    glDeleteTextures(1, &texture);
    glDeleteBuffers(1, &buffer);
    for (int i = 0; i < STRIP_PX; i++) {
        double expected[3];
        lut_splat_sample(table, 0, (double)rgba[4 * i + 3], expected);
        for (int c = 0; c < 3; c++)
            /* the shader's log2 is good to some 1e-6, which is 0.01 of 8192 nodes; out there the profile
             * falls by 3 % from node to node */
            assert_close((double)rgba[4 * i + c], expected[c], 5e-4, "texel %d, channel %d", i, c);
    }
    lut_splat_destroy(table);
    render_destroy(renderer);
    scene_end(&test);
}

/* Oracle: the compiler. Every fragment shader compiles and links, whatever is or is not written before
 * it; an error in an included file is told with that file's name and line. */
static void every_shader_compiles_and_errors_are_placed(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    init_lit(&test, IO_PRIMITIVE_CUBE, 5, false, &material);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    assert_true(render_make_current(renderer, NULL));
    static const char *const defines[] = {
        NULL, "#define HAS_RADIOSITY\n", "#define HAS_RADIOSITY\n#define HAS_SPECULAR\n",
        "#define HAS_RADIOSITY\n#define HAS_OBJECT_MEDIA\n#define HAS_LIGHT_OBJECT\n"
    };
    size_t fragment_count = 0;
    for (const struct render_shader *shader = render_shaders; shader->name; shader++) {
        const char *const suffix = strstr(shader->name, ".frag");
        if (!suffix)
            continue;
        fragment_count++;
        char name[64];
        snprintf(name, sizeof name, "%.*s.vert", (int)(suffix - shader->name), shader->name);
        const struct render_shader *const own = render_shader_find(name);
        for (size_t d = 0; d < sizeof defines / sizeof *defines; d++) {
            GLuint program;
            dipole_status status;
            if (!render_program_create(own ? own : render_shader_find("fullscreen.vert"), shader,
                                       defines[d], &program, &status))
                fail_msg("%s", status.message);
            glDeleteProgram(program);
        }
    }
    assert_true(fragment_count >= 9);
    static const struct render_shader broken = { "broken.frag", "#include \"common/fresnel.glsl\"\n"
                                                                "out vec4 value;\n"
                                                                "void main() { value = nonsense; }\n" };
    static const struct render_shader lost = { "lost.frag", "\n#include \"common/absent.glsl\"\n" };
    GLuint program;
    dipole_status status;
    assert_false(
        render_program_create(render_shader_find("fullscreen.vert"), &broken, NULL, &program, &status));
    assert_int_equal(strncmp(status.message, "broken.frag:3(", 14), 0);
    assert_false(
        render_program_create(render_shader_find("fullscreen.vert"), &lost, NULL, &program, &status));
    assert_string_equal(status.message, "lost.frag:2: no shader file \"common/absent.glsl\"");
    render_destroy(renderer);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splats_equal_the_sum_over_all_pairs),
        cmocka_unit_test(splats_are_near_the_sum_without_a_cut),
        cmocka_unit_test(splats_approach_the_surface_integral),
        cmocka_unit_test(energy_is_conserved),
        cmocka_unit_test(all_flux_of_a_point_light_is_sampled),
        cmocka_unit_test(light_is_looked_for_on_the_surface),
        cmocka_unit_test(lambert_is_the_closed_form_on_a_flat_face),
        cmocka_unit_test(specular_is_ggx_and_has_shadows),
        cmocka_unit_test(coverage_is_the_area_of_the_silhouette),
        cmocka_unit_test(lights_add_up),
        cmocka_unit_test(tone_mapping_keeps_to_the_screen),
        cmocka_unit_test(the_same_scene_gives_the_same_bytes),
        cmocka_unit_test(what_is_not_called_for_costs_nothing),
        cmocka_unit_test(fresnel_in_glsl_is_that_of_the_library),
        cmocka_unit_test(profile_in_glsl_is_that_of_the_table),
        cmocka_unit_test(every_shader_compiles_and_errors_are_placed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
