/* renderer/gloss.c and renderer/plan_gloss.c: the most that gloss can be, and pictures without it. */
#include "drawing.h"
#include "plans.h"

#include "renderer/gloss.h"

/* A normal near the half vector, z, or anywhere. */
static void random_normal(struct rng *rng, double normal[3])
{
    const double reach = log_uniform(rng, 1e-3, 10);
    normal[0] = reach * uniform(rng, -1, 1);
    normal[1] = reach * uniform(rng, -1, 1);
    normal[2] = 1;
    const double length = sqrt(render_dot(normal, normal));
    for (int k = 0; k < 3; k++)
        normal[k] /= length;
}

/* Oracle: the definition, over random normals and angles: none mirrors more than 1 % above the bound, and
 * one comes near it. */
static void no_normal_mirrors_more(void **state)
{
    (void)state;
    struct rng rng = { .seed = 20261127 };
    for (int i = 0; i < 200; i++) {
        const double eta = uniform(&rng, 1.01, 2), roughness = log_uniform(&rng, 0.05, 1);
        const double least_rad = uniform(&rng, 0, PI), most_rad = uniform(&rng, least_rad, PI);
        const double bound = render_gloss_most_per_sr(eta, roughness, least_rad, most_rad);
        double most = 0;
        for (int k = 0; k < 4000; k++) {
            const double apart_rad = k % 2 ? most_rad : uniform(&rng, least_rad, most_rad);
            const double to_light[3] = { sin(0.5 * apart_rad), 0, cos(0.5 * apart_rad) };
            const double to_eye[3] = { -to_light[0], 0, to_light[2] };
            double normal[3];
            random_normal(&rng, normal);
            if (render_dot(normal, to_light) <= 0 || render_dot(normal, to_eye) <= 0)
                continue;
            const double mirrored = dipole_fresnel_reflectance(eta, to_light[2]) *
                                    render_ggx_per_sr(roughness, normal[2], render_dot(normal, to_light),
                                                      render_dot(normal, to_eye));
            most = fmax(most, mirrored);
        }
        if (!(most <= 1.01 * bound && most >= 0.5 * bound))
            fail_msg("eta %g, roughness %g, %g to %g rad: %g found, at most %g", eta, roughness, least_rad,
                     most_rad, most, bound);
    }
    assert_true(render_gloss_most_per_sr(1, 0.3, 0, PI) == 0);
}

enum { WIDTH_PX = 120, HEIGHT_PX = 90 };

/* A rough ball and a rough cube, and their medium's brightest channel. */
static double init_rough(struct test_scene *test, double roughness, double eta)
{
    struct io_material material = marble();
    double brightest = 0;
    for (int c = 0; c < 3; c++)
        material.layers[c][0].medium.eta = eta;
    scene_init(test, 60);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 32, 8, -9, &material));
    assert_true(scene_add(test, IO_PRIMITIVE_CUBE, 8, 7, 9, &material));
    scene_add_directional(test, -1, -1, -2, 3);
    scene_add_point(test, 10, 25, 20, 4000);
    test->scene.camera.width_px = WIDTH_PX;
    test->scene.camera.height_px = HEIGHT_PX;
    for (int i = 0; i < 2; i++) {
        test->objects[i].has_specular = true;
        test->objects[i].roughness = roughness;
    }
    for (int c = 0; c < 3; c++) {
        dipole_coefficients k;
        assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k, NULL));
        brightest = fmax(brightest, dipole_diffuse_reflectance(&k));
    }
    return brightest;
}

static void assert_same_picture(struct renderer *a, struct renderer *b, double epsilon, int size)
{
    const struct render_options drawing = { .epsilon = epsilon };
    struct io_image *const images[2] = { draw(a, &drawing, NULL), draw(b, &drawing, NULL) };
    assert_memory_equal(images[0]->pixels, images[1]->pixels, (size_t)size * sizeof(float));
    io_image_destroy(images[0]);
    io_image_destroy(images[1]);
}

/* Oracle: gloss by itself, captured. Where it is left out, it is at no pixel more than the plan says of
 * what both lights together make a flat surface send out, that is no more than half of epsilon, and the
 * picture is that of the same scene without gloss. */
static void what_is_left_out_is_not_seen(void **state)
{
    (void)state;
    int left_out_count = 0, drawn_count = 0;
    for (int i = 0; i < 12; i++) {
        const double epsilon = 0.3 * pow(0.5, i % 6), roughness = i < 6 ? 1 : 0.6, eta = i % 2 ? 1.3 : 1.15;
        struct test_scene test, dull;
        const double brightest = init_rough(&test, roughness, eta);
        const struct render_request request = { .scene = &test.scene, .epsilon = epsilon };
        struct render_plan *const plan = plan_for(&request);
        if (decision_of(plan, "specular")->is_active) {
            assert_true(plan->gloss_most > 0.5 * epsilon && plan->gloss_error == 0);
            drawn_count++;
        } else {
            struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
            struct render_capture *const captured = capture(renderer, 1);
            const double sent = (3 + 4000 / (20.0 * 20)) * brightest / PI; /* 20 mm from the lamp or more */
            double worst = 0;
            for (int k = 0; k < 3 * WIDTH_PX * HEIGHT_PX; k++)
                worst = fmax(worst, (double)captured->specular[k]);
            print_message("  epsilon %.3f: %.2e of %.2e\n", epsilon, worst / sent, plan->gloss_most);
            assert_true(worst > 0 && worst <= plan->gloss_most * sent);
            assert_true(plan->gloss_most <= 0.5 * epsilon && plan->gloss_error == plan->gloss_most);
            assert_true(plan->error_predicted <= epsilon);
            init_rough(&dull, roughness, eta);
            dull.objects[0].has_specular = dull.objects[1].has_specular = false;
            struct renderer *const other = renderer_of(&dull, RENDER_CONTEXT_DEFAULT);
            assert_same_picture(renderer, other, epsilon, 4 * WIDTH_PX * HEIGHT_PX);
            render_capture_destroy(captured);
            render_destroy(other);
            render_destroy(renderer);
            scene_end(&dull);
            left_out_count++;
        }
        render_plan_destroy(plan);
        scene_end(&test);
    }
    assert_true(left_out_count >= 3 && drawn_count >= 3);
}

/* Oracle: Fresnel's equations. Without a step of the index nothing is mirrored, whatever is asked; where
 * nothing scatters, or a picture is captured, gloss is all that there is; and it can be asked for. */
static void gloss_is_drawn_where_it_counts(void **state)
{
    (void)state;
    struct test_scene test;
    init_rough(&test, 0.3, 1);
    struct render_request request = { .scene = &test.scene, .epsilon = 0.003, .keeps_negligible = true };
    struct render_plan *plan = plan_for(&request);
    assert_true(plan->is_glossy && plan->gloss_most == 0);
    assert_false(decision_of(plan, "specular")->is_active);
    assert_string_equal(decision_of(plan, "specular")->reason,
                        "gloss adds at most 0 of what a lit surface sends out");
    render_plan_destroy(plan);
    scene_end(&test);
    init_rough(&test, 1, 1.15);
    request = (struct render_request){ .scene = &test.scene, .epsilon = 0.3 };
    plan = plan_for(&request);
    assert_false(decision_of(plan, "specular")->is_active);
    render_plan_destroy(plan);
    request.keeps_negligible = true;
    plan = plan_for(&request);
    assert_true(decision_of(plan, "specular")->is_active && plan->gloss_error == 0);
    render_plan_destroy(plan);
    request.keeps_negligible = false;
    request.is_captured = true;
    plan = plan_for(&request);
    assert_true(decision_of(plan, "specular")->is_active);
    render_plan_destroy(plan);
    request.is_captured = false;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 2; i++)
            test.objects[i].material.layers[c][0].medium.sigma_s_prime_per_mm = 0;
    }
    plan = plan_for(&request);
    assert_true(decision_of(plan, "specular")->is_active);
    render_plan_destroy(plan);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_normal_mirrors_more),
        cmocka_unit_test(what_is_left_out_is_not_seen),
        cmocka_unit_test(gloss_is_drawn_where_it_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
