/* renderer/media.c, footprint.c, passes/object_ids.c: scenes of several objects and media, of every model.
 */
#include "drawing.h"

#include "renderer/footprint.h"
#include "renderer/plan.h"

static const struct {
    dipole_model model;
    bool is_layered;
} models[] = {
    { DIPOLE_MODEL_DIPOLE, false }, { DIPOLE_MODEL_BETTER_DIPOLE, false }, { DIPOLE_MODEL_BEAM, false },
    { DIPOLE_MODEL_MODES, false },  { DIPOLE_MODEL_MULTIPOLE, true },      { DIPOLE_MODEL_BEAM, true },
};

static void move(struct test_scene *test, size_t object, double x_mm, double y_mm, double z_mm)
{
    struct io_mesh *const mesh = test->objects[object].mesh;
    const double step_mm[3] = { x_mm, y_mm, z_mm };
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        mesh->positions[i] = (float)((double)mesh->positions[i] + step_mm[i % 3]);
    for (int k = 0; k < 3; k++) {
        mesh->min[k] = (float)((double)mesh->min[k] + step_mm[k]);
        mesh->max[k] = (float)((double)mesh->max[k] + step_mm[k]);
        test->scene.min_mm[k] = fmin(test->scene.min_mm[k], (double)mesh->min[k]);
        test->scene.max_mm[k] = fmax(test->scene.max_mm[k], (double)mesh->max[k]);
    }
}

/* Oracle: conservation. At the middle of a slab wider than light spreads, what leaves is the total of what
 * enters, in every model and in layers. */
static void energy_is_conserved_in_every_model(void **state)
{
    (void)state;
    const double epsilon = 0.01, irradiance = 2;
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        const struct io_material material = grey(models[m].model, models[m].is_layered);
        dipole_stack *stack;
        assert_true(dipole_stack_create(material.layers[0], material.layer_count, material.model,
                                        DIPOLE_FROM_ABOVE, &stack, NULL));
        const double reach_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 0.2 * epsilon);
        struct test_scene test;
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 1.1 * reach_mm, 0, &material));
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
        const double entering = irradiance * (1 - dipole_fresnel_reflectance(1.4, 1));
        double worst = 0;
        for (int i = 0; i < 16; i++) {
            const double found = (double)image->pixels[4 * i] / exit_per_sr(1.4) / entering;
            worst = fmax(worst, fabs(found / dipole_stack_total(stack, DIPOLE_FACE_LIT) - 1));
        }
        print_message("  %-14s %zu layer%s %7zu samples %.3f mm apart, %.2f %% off, predicted %.2f %%\n",
                      material.name, material.layer_count, material.layer_count == 1 ? " " : "s",
                      report.sample_count, report.spacing_mm, 100 * worst, 100 * report.error_predicted);
        assert_true(worst <= epsilon);
        assert_true(report.error_predicted <= epsilon);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
        dipole_stack_destroy(stack);
    }
}

/* Radiosity x_mm inside a half-plane that is lit, over that of a whole plane: ring by ring, of which an arc
 * lies in the light. */
static double edge_response(const dipole_stack *stack, double x_mm)
{
    enum { RINGS = 4000 };
    const double end_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-5);
    double lit = 0, before = 0;
    for (int i = 1; i <= RINGS; i++) { /* narrow ones near the middle */
        const double r_mm = end_mm * pow((double)i / RINGS, 3);
        const double middle_mm = end_mm * pow((i - 0.5) / RINGS, 3);
        const double within = dipole_stack_within(stack, DIPOLE_FACE_LIT, r_mm);
        const double part = fmin(fmax(x_mm / middle_mm, -1), 1);
        lit += (within - before) * (1 - acos(part) / PI);
        before = within;
    }
    return lit / before;
}

/* Oracle: the edge response, from the powers within discs. A shadow's edge on a slab is where a blurred
 * profile errs most: by no more than is predicted, and what half a texel of the light's view moves the edge
 * by: four to 0.7 of the spacing, at 45 degrees. */
static void a_blurred_shadow_is_as_exact_as_asked(void **state)
{
    (void)state;
    const struct io_material material = grey(DIPOLE_MODEL_BEAM, false);
    dipole_stack *stack;
    assert_true(
        dipole_stack_create(material.layers[0], 1, material.model, DIPOLE_FROM_ABOVE, &stack, NULL));
    const double epsilons[] = { 0.05, 0.01 };
    for (int e = 0; e < 2; e++) {
        struct test_scene test;
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 16, 0, &material));
        assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 4, 16, 0, &material));
        move(&test, 1, -70, 38, 0); /* its shadow ends at x = 0: x + y of its farthest edge */
        scene_add_directional(&test, 1, -1, 0, 2);
        test.scene.camera = (struct io_camera){ .eye_mm = { 0, 20, 0 },
                                                .up = { 0, 0, 1 },
                                                .is_orthographic = true,
                                                .height_mm = 4,
                                                .width_px = 256,
                                                .height_px = 4 };
        test.scene.camera.height_mm = 4.0 * 4 / 256;
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT,
                                                .epsilon = epsilons[e] };
        struct render_report report;
        struct io_image *const image = draw(renderer, &options, &report);
        const double cosine = sqrt(0.5);
        const double entering = 2 * cosine * (1 - dipole_fresnel_reflectance(1.4, cosine));
        const double full = entering * dipole_stack_total(stack, DIPOLE_FACE_LIT) * exit_per_sr(1.4);
        double worst = 0;
        for (int i = 0; i < 256; i++) {
            /* up is +z and the view goes down: right is -x */
            const double x_mm = -4.0 * ((i + 0.5) / 256 - 0.5);
            const double found = (double)image->pixels[4 * (256 + i)] / full;
            worst = fmax(worst, fabs(found - edge_response(stack, x_mm)));
        }
        print_message("  epsilon %g: %zu samples %.3f mm apart, worst %.2f %% of the lit side, predicted "
                      "%.2f %% (blur %.2f %%)\n",
                      epsilons[e], report.sample_count, report.spacing_mm, 100 * worst,
                      100 * report.error_predicted, 100 * report.blur_error);
        assert_true(report.blur_error > 0);
        const double half_texel_mm = sqrt(0.5) * 0.7 / 4 * report.spacing_mm;
        assert_true(report.error_predicted <= epsilons[e]);
        assert_true(worst <= report.error_predicted + edge_response(stack, half_texel_mm) - 0.5);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
    dipole_stack_destroy(stack);
}

/* Oracle: light stays in its object. A ball touches another one and stands in its shadow: no pixel of it is
 * lit, whether it is of the same medium or of another. */
static void touching_balls_do_not_leak(void **state)
{
    (void)state;
    const struct io_material media[2] = { marble(), skin1() };
    for (int i = 0; i < 2; i++) {
        struct test_scene test;
        scene_init(&test, 60);
        test.scene.camera.fov_y_rad = 0.35;
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 5, -5, &media[0]));
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 4.5, 4.5, &media[i]));
        scene_add_directional(&test, 1, 0, 0, 3);
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct render_report report;
        struct io_image *const image =
            draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT }, &report);
        double lit = 0;
        for (int y = 0; y < image->height_px; y++) {
            for (int x = 0; x < image->width_px; x++) {
                const float *const pixel = image->pixels + 4 * (y * image->width_px + x);
                if (x < image->width_px / 2 - 1)
                    lit += (double)pixel[0];
                else if (x > image->width_px / 2)
                    assert_close((double)pixel[0], 0, 0, "medium %d, pixel %d, %d", i, x, y);
            }
        }
        assert_true(lit > 1);
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
}

static struct io_image *draw_pair(const struct io_material *left, const struct io_material *right,
                                  double apart_mm, bool *has_ids)
{
    struct test_scene test;
    scene_init(&test, 60);
    test.scene.camera.fov_y_rad = 0.2;
    if (left)
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 3, -0.5 * apart_mm, left));
    if (right)
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 64, 3, 0.5 * apart_mm, right));
    scene_add_directional(&test, 0.3, -0.5, -1, 3);
    struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
    struct render_report report;
    struct io_image *const image =
        draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT, .epsilon = 0.005 },
             &report);
    for (size_t e = 0; e < report.effect_count; e++) {
        if (strcmp(report.effects[e].name, "object_ids") == 0)
            *has_ids = report.effects[e].is_active;
    }
    render_destroy(renderer);
    scene_end(&test);
    return image;
}

/* Oracle: superposition. Balls that do not shade each other look as each does alone; they are told apart
 * only where they could be taken for each other. */
static void objects_beside_each_other_look_as_alone(void **state)
{
    (void)state;
    const struct io_material media[2] = { skin1(), grey(DIPOLE_MODEL_BEAM, true) };
    for (int i = 0; i < 2; i++) {
        bool has_ids = false;
        struct io_image *const both = draw_pair(&media[0], &media[i], 6.4, &has_ids);
        assert_true(has_ids);
        struct io_image *const left = draw_pair(&media[0], NULL, 6.4, &has_ids);
        assert_false(has_ids);
        struct io_image *const right = draw_pair(NULL, &media[i], 6.4, &has_ids);
        struct deviation deviation = { 0 };
        for (int p = 0; p < 4 * both->width_px * both->height_px; p++) {
            if (p % 4 != 3)
                deviation_add(&deviation, (double)both->pixels[p],
                              (double)left->pixels[p] + (double)right->pixels[p]);
        }
        /* both were sampled anew: twice what is asked of each */
        assert_true(relative_rmse(&deviation) < 0.01);
        io_image_destroy(both);
        io_image_destroy(left);
        io_image_destroy(right);
    }
}

/* Oracle: the definition. One medium far apart needs no ids; near, or another medium, does. */
static void objects_are_told_apart_where_it_matters(void **state)
{
    (void)state;
    const struct io_material medium = skin1(), other = marble();
    for (int i = 0; i < 3; i++) {
        struct test_scene test;
        scene_init(&test, 400);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 20, -50, &medium));
        assert_true(
            scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 20, i == 1 ? -8 : 50, i == 2 ? &other : &medium));
        scene_add_directional(&test, 0, 0, -1, 3);
        struct render_plan *plan;
        assert_true(render_plan_create(&(struct render_request){ .scene = &test.scene,
                                                                 .epsilon = 0.05,
                                                                 .technique = RENDER_TECHNIQUE_SPLAT,
                                                                 .has_gpu = true },
                                       &plan, NULL));
        assert_int_equal(plan->has_object_ids, i > 0);
        assert_int_equal(render_plan_writes(plan, "light_object"), i > 0);
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* Oracle: the profile itself far out, where a blur changes nothing; and energy: the blurred profile has the
 * same total. */
static void a_blurred_profile_keeps_its_energy(void **state)
{
    (void)state;
    const double PI2 = 2 * PI;
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        const struct io_material material = grey(models[m].model, models[m].is_layered);
        dipole_stack *stack;
        assert_true(dipole_stack_create(material.layers[0], material.layer_count, material.model,
                                        DIPOLE_FROM_ABOVE, &stack, NULL));
        struct render_footprint *footprint;
        assert_true(render_footprint_create(stack, &(struct render_footprint_kernel){ .blur_mm = 0.05 },
                                            &footprint, NULL));
        enum { STEPS = 4000 };
        const double step_mm = footprint->reach_mm / STEPS;
        double sum = 0;
        for (int i = 0; i < STEPS; i++) {
            const double r_mm = (i + 0.5) * step_mm;
            sum += PI2 * r_mm * step_mm * render_footprint_sample(footprint, r_mm);
        }
        assert_close(sum, dipole_stack_within(stack, DIPOLE_FACE_LIT, footprint->reach_mm), 1e-4, "%s",
                     material.name);
        double expected;
        const double far_mm = 0.95 * footprint->reach_mm;
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &far_mm, 1, &expected);
        assert_close(render_footprint_sample(footprint, far_mm), expected, 1e-4, "%s", material.name);
        free(footprint);
        dipole_stack_destroy(stack);
    }
}

/* The profile averaged over what a patch spreads; NULL: not averaged. */
static double spread_per_mm2(const dipole_stack *stack, const struct render_footprint *footprint,
                             double r_mm)
{
    const double stride = RENDER_FOOTPRINT_STRIDE, three_mm[3] = { r_mm / stride, r_mm, r_mm * stride };
    double profile[3];
    if (footprint && r_mm <= footprint->reach_mm)
        return render_footprint_sample(footprint, r_mm);
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, three_mm, 3, profile);
    return footprint ? render_footprint_far_per_mm2(footprint, r_mm, profile) : profile[1];
}

/* Radiosity at x_mm of a plane that is lit with 1 W/mm^2 where x > 0, light put together in the middle of
 * what is lit of cells cell_mm wide, the lines between which are u and v of a cell away from the edge. */
static double radiosity_by_cells(const dipole_stack *stack, const struct render_footprint *footprint,
                                 double x_mm, double cell_mm, double u, double v)
{
    const double reach_mm = 14;
    double sum = 0;
    for (double from_mm = (u - 1) * cell_mm; from_mm < x_mm + reach_mm; from_mm += cell_mm) {
        const double lit_mm = fmax(from_mm, 0), width_mm = from_mm + cell_mm - lit_mm;
        for (double y_mm = (v - ceil(reach_mm / cell_mm)) * cell_mm; y_mm < reach_mm; y_mm += cell_mm)
            sum += width_mm * cell_mm *
                   spread_per_mm2(stack, footprint, hypot(lit_mm + 0.5 * width_mm - x_mm, y_mm));
    }
    return sum;
}

/* Largest error about the edge, mean of edges and cells that lie in any way, as part of the total. */
static double edge_error(const dipole_stack *stack, const struct render_footprint *footprint,
                         double cell_mm)
{
    enum { PHASES = 4, PLACES = 7 };
    double largest = 0;
    for (int place = 0; place < PLACES; place++) {
        const double x_mm = 0.5 * (place - PLACES / 2);
        double mean = 0;
        for (int i = 0; i < PHASES * PHASES; i++)
            mean += radiosity_by_cells(stack, footprint, x_mm, cell_mm, (i % PHASES + 0.5) / PHASES,
                                       (0.5 + i / PHASES) / PHASES) /
                    (PHASES * PHASES);
        largest = fmax(largest, fabs(mean - radiosity_by_cells(stack, NULL, x_mm, 0.05, 0.5, 0.5)));
    }
    return largest / dipole_stack_total(stack, DIPOLE_FACE_LIT);
}

/* Oracle: the integral, by cells 0.05 mm wide. What is put together errs by the second power of the cells'
 * width; what is spread again by less, though the profile's core is narrower than the cells. T79. */
static void what_is_put_together_is_spread_again(void **state)
{
    (void)state;
    const dipole_layer layer = { { .sigma_a_per_mm = 0.2, .sigma_s_prime_per_mm = 1, .eta = 1.3 },
                                 INFINITY };
    static const double cells_mm[] = { 0.8, 0.4 }; /* 1 and 1/2 of a mean free path */
    dipole_stack *stack;
    assert_true(dipole_stack_create(&layer, 1, DIPOLE_MODEL_DIPOLE, DIPOLE_FROM_ABOVE, &stack, NULL));
    double errors[2], spread_errors[2];
    for (int i = 0; i < 2; i++) {
        const struct render_footprint_kernel kernel = { .spread_mm = cells_mm[i] / sqrt(12) };
        struct render_footprint *footprint;
        assert_true(render_footprint_create(stack, &kernel, &footprint, NULL));
        errors[i] = edge_error(stack, NULL, cells_mm[i]);
        spread_errors[i] = edge_error(stack, footprint, cells_mm[i]);
        free(footprint);
    }
    print_message("put together %.2g, %.2g; spread again %.2g, %.2g\n", errors[0], errors[1],
                  spread_errors[0], spread_errors[1]);
    assert_in_range((size_t)(100 * errors[0] / errors[1]), 300, 500);
    assert_true(spread_errors[0] < 0.6 * errors[0] && spread_errors[1] < 0.45 * errors[1]);
    dipole_stack_destroy(stack);
}

/* Oracle: areas by flux. On a flat face that is lit as far as light spreads, counting gives the same. */
static void overlaps_count_the_area_of_a_flat_face(void **state)
{
    (void)state;
    struct io_material material = grey(DIPOLE_MODEL_DIPOLE, false);
    double pixels[2];
    for (int i = 0; i < 2; i++) {
        struct test_scene test;
        scene_init(&test, 0);
        assert_true(scene_add(&test, IO_PRIMITIVE_SLAB, 8, 10, 0, &material));
        scene_add_directional(&test, 0.2, -1, 0.1, 2);
        test.scene.camera = (struct io_camera){ .eye_mm = { 0, 10, 0 },
                                                .up = { 0, 0, 1 },
                                                .is_orthographic = true,
                                                .height_mm = 0.1,
                                                .width_px = 4,
                                                .height_px = 4 };
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        struct io_image *const image =
            draw(renderer,
                 &(struct render_options){ .technique = RENDER_TECHNIQUE_SPLAT,
                                           .area = i == 0 ? RENDER_AREA_FLUX : RENDER_AREA_OVERLAP },
                 NULL);
        pixels[i] = (double)image->pixels[0];
        io_image_destroy(image);
        render_destroy(renderer);
        scene_end(&test);
    }
    assert_close(pixels[1], pixels[0], 0.02, "overlap against flux");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_conserved_in_every_model),
        cmocka_unit_test(a_blurred_shadow_is_as_exact_as_asked),
        cmocka_unit_test(a_blurred_profile_keeps_its_energy),
        cmocka_unit_test(what_is_put_together_is_spread_again),
        cmocka_unit_test(touching_balls_do_not_leak),
        cmocka_unit_test(objects_beside_each_other_look_as_alone),
        cmocka_unit_test(objects_are_told_apart_where_it_matters),
        cmocka_unit_test(overlaps_count_the_area_of_a_flat_face),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
