/* renderer/plan.c, projection.c, splats.c: everything that is decided before OpenGL is called. */
#include "plans.h"
#include "scenes.h"

#include "io/scene_motion.h"
#include "renderer/light_samples.h"
#include "renderer/splats.h"

static struct render_request request_for(const struct test_scene *test)
{
    return (struct render_request){ .scene = &test->scene, .epsilon = 0.01 };
}

/* A marble sphere of radius 8 mm under one directional light. */
static void init_sphere(struct test_scene *test)
{
    const struct io_material material = marble();
    scene_init(test, 40);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 32, 8, 0, &material));
    scene_add_directional(test, -1, -1, -1, 3);
}

static bool is_active(const struct render_plan *plan, const char *name)
{
    for (size_t e = 0; render_effects[e]; e++) {
        if (strcmp(render_effects[e]->name, name) == 0)
            return plan->decisions[e].is_active;
    }
    fail_msg("no effect %s", name);
    return false;
}

/* ---- effects and passes ------------------------------------------------------------------------- */

/* Oracle: the list itself. Each effect is called for by one of these requests and, but for the surface,
 * not by another, and says why. */
static void every_effect_is_called_for_by_some_scene_only(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    const struct io_material other = skin1();
    enum {
        REQUESTS = 20,
        FIRST_AROUND = 11,
        MOVING = 15,
        BY_OPENGL = 16,
        SHADOWED = 17,
        SHADOWED_MAPS = 18,
        SHADED_BY_ITSELF = 19 /* for want of a triangle it may not be convex */
    };
    struct render_request requests[REQUESTS];
    for (int i = 0; i < REQUESTS; i++)
        requests[i] = request_for(&test);
    /* a coloured pane stands before a light with a size */
    struct io_blocker pane = { .mesh = test.objects[0].mesh, .opacity = { 0.1, 0.2, 0.3 } };
    test.scene.blockers = &pane;
    requests[0].technique = RENDER_TECHNIQUE_SPLAT;
    requests[1].technique = RENDER_TECHNIQUE_LAMBERT;
    requests[2].is_captured = true;
    requests[3].is_tone_mapped = true;
    bool was_active[RENDER_EFFECT_LIMIT] = { false }, was_inactive[RENDER_EFFECT_LIMIT] = { false };
    requests[6].area = RENDER_AREA_OVERLAP;
    /* the last: its object is deformed and moves over two frames */
    struct io_motion motion = { .track_count = 1, .key_count = 1, .stretch = 1 };
    for (int i = 7; i < 11; i++)
        requests[i].technique = RENDER_TECHNIQUE_TSM;
    requests[8].tsm = (struct render_tsm_options){ .response = RENDER_TSM_EXACT, .layer_count = 4 };
    requests[9].tsm.response = RENDER_TSM_TEXELS;
    requests[10].tsm.gather = RENDER_TSM_VERTEX;
    requests[12].environment_samples = RENDER_ENVIRONMENT_PEEL3;
    requests[12].ambient_visibility = 4;
    requests[13].technique = RENDER_TECHNIQUE_LAMBERT;
    requests[14].technique = RENDER_TECHNIQUE_SPLAT;
    requests[BY_OPENGL].gather = RENDER_GATHER_GL;
    requests[SHADOWED_MAPS].technique = RENDER_TECHNIQUE_TSM;
    test.scene.environment.rgb[0] = 1;
    strcpy(test.scene.environment.path, SOURCE_FOLDER "/scenes/probes/studio.exr");
    for (int i = 0; i < REQUESTS; i++) {
        test.scene.has_environment = i >= FIRST_AROUND && i < MOVING;
        test.objects[0].has_specular = i == 3 || i == SHADOWED;
        test.scene.blocker_count = i >= SHADOWED;
        test.lights[0].size_rad = i >= SHADOWED ? 0.1 : 0;
        test.objects[0].mesh->triangle_count -= i == SHADED_BY_ITSELF;
        if (i == 5)
            assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 2, 5, &other));
        test.scene.light_count = i == 4 ? 0 : 1;
        test.objects[0].motion = NULL;
        if (i == MOVING) {
            test.scene.frames.count = 2;
            test.objects[0].motion = &motion;
            test.objects[0].pose.deform_count = 1;
            test.objects[0].pose.is_moved = true;
        }
        struct render_plan *const plan = plan_for(&requests[i]);
        for (size_t e = 0; render_effects[e]; e++) {
            const struct render_decision *const decision = &plan->decisions[e];
            assert_true(strlen(decision->reason) > 5);
            assert_true(decision->is_active ? decision->cost_ms > 0 : decision->cost_ms == 0);
            assert_true(decision->is_active ? decision->error >= 0 : decision->error == 0);
            was_active[e] |= plan->decisions[e].is_active;
            was_inactive[e] |= !plan->decisions[e].is_active;
        }
        render_plan_destroy(plan);
    }
    for (size_t e = 0; render_effects[e]; e++) {
        assert_true(was_active[e]);
        assert_true(was_inactive[e] || strcmp(render_effects[e]->name, "surface") == 0);
    }
    scene_end(&test);
}

/* Oracle: a scene of which nothing is called for but its outline. */
static void a_dark_scene_needs_no_light_passes(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    memset(test.lights[0].rgb, 0, sizeof test.lights[0].rgb);
    const struct render_request request = request_for(&test);
    struct render_plan *const plan = plan_for(&request);
    assert_int_equal(plan->view_count, 0);
    assert_int_equal(plan->pass_count, 5); /* of the surface four, composite */
    assert_false(is_active(plan, "splat"));
    render_plan_destroy(plan);
    scene_end(&test);
}

/* Oracle: the rule that makes a plan: what is read must have been written; both names are told. */
static void a_texture_read_before_it_is_written_fails_the_plan(void **state)
{
    (void)state;
    static const struct render_pass needy[] = {
        { .name = "needy", .reads = { "radiosity" }, .writes = { "radiance" } }
    };
    static const struct render_pass giving[] = { { .name = "giving", .writes = { "radiosity" } } };
    static const struct render_effect first = { .name = "first", .passes = needy, .pass_count = 1 };
    static const struct render_effect second = { .name = "second", .passes = giving, .pass_count = 1 };
    const struct render_effect *const wrong[] = { &first, &second, NULL };
    const struct render_effect *const right[] = { &second, &first, NULL };
    for (int is_right = 0; is_right < 2; is_right++) {
        struct render_plan *const plan = calloc(1, sizeof *plan);
        assert_non_null(plan);
        plan->decisions[0].is_active = plan->decisions[1].is_active = true;
        dipole_status status = { 0 };
        assert_int_equal(render_plan_add_passes(plan, is_right ? right : wrong, &status), is_right);
        if (!is_right)
            assert_string_equal(
                status.message,
                "pass \"needy\" reads texture \"radiosity\" before any pass has written it");
        render_plan_destroy(plan);
    }
}

/* Whether some pass writes a texture whose name begins so. */
static bool writes_any(const struct render_plan *plan, const char *prefix)
{
    for (size_t i = 0; i < plan->pass_count; i++) {
        for (size_t w = 0; w < RENDER_PASS_WRITES && plan->passes[i].pass->writes[w]; w++) {
            if (strncmp(plan->passes[i].pass->writes[w], prefix, strlen(prefix)) == 0)
                return true;
        }
    }
    return false;
}

/* Oracle: by hand. Only the technique makes maps, one for each light and visible object that scatters, six
 * where the light is near; each is fitted to its object, in powers of two. What is not asked for is not
 * made. */
static void maps_are_of_lights_and_objects(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = skin1();
    init_sphere(&test);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 2, 11, &material));
    assert_true(test.scene.object_count == 2);
    scene_add_point(&test, 9, 3, 0, 10);
    struct render_request request = request_for(&test);
    struct render_plan *plan = plan_for(&request);
    assert_int_equal(plan->map_count, 0);
    assert_false(writes_any(plan, "tsm_"));
    render_plan_destroy(plan);

    request.technique = RENDER_TECHNIQUE_TSM;
    plan = plan_for(&request);
    assert_int_equal(plan->map_count, 1 + 1 + 6 + 1);
    assert_false(is_active(plan, "light_samples") || is_active(plan, "splat"));
    assert_false(writes_any(plan, "light_") || writes_any(plan, "tsm_layers") ||
                 writes_any(plan, "tsm_sources") || writes_any(plan, "tsm_vert"));
    assert_true(isinf(plan->error_predicted) && plan->table_error > 0);
    for (size_t i = 0; i < plan->map_count; i++) {
        const struct render_plan_view *const map = &plan->maps[i];
        assert_int_equal(map->object, i == 1 || i > 7);
        assert_int_equal(map->light, i > 1);
        assert_true((map->size_px & (map->size_px - 1)) == 0 && map->size_px <= 2048);
        if (i < 2) {
            assert_close(map->projection.half_width, i == 0 ? 8 : 2, 0.05, "map %zu", i);
            const double inner_mm = plan->of_medium[plan->objects[map->object].medium].inner_mm;
            assert_true(2 * map->projection.half_width / map->size_px <= inner_mm / 14);
        }
    }
    render_plan_destroy(plan);
    test.scene.camera.fov_y_rad = 0.1; /* the small one is out of sight */
    plan = plan_for(&request);
    assert_int_equal(plan->map_count, 1 + 6);
    render_plan_destroy(plan);
    scene_end(&test);
}

/* Oracle: by hand. Passes per view stand together, view after view; the others once, around them. */
static void passes_per_view_are_repeated_together(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    scene_add_directional(&test, 1, 0, 0, 1);
    test.objects[0].has_specular = true;
    const struct render_request request = request_for(&test);
    struct render_plan *const plan = plan_for(&request);
    static const char *const names[] = { "surface_meshes",  "surface",       "position_depth",
                                         "surface_resolve", "light_picture", "light_samples",
                                         "specular",        "light_picture", "light_samples",
                                         "specular",        "gather",        "composite" };
    assert_int_equal(plan->pass_count, sizeof names / sizeof *names);
    for (size_t i = 0; i < plan->pass_count; i++) {
        assert_string_equal(plan->passes[i].pass->name, names[i]);
        assert_int_equal(plan->passes[i].view, i >= 7 && i < 10);
    }
    render_plan_destroy(plan);
    scene_end(&test);
}

/* Oracle: every texture that a pass names is in the table. */
static void every_texture_has_a_row(void **state)
{
    (void)state;
    for (size_t e = 0; render_effects[e]; e++) {
        for (size_t p = 0; p < render_effects[e]->pass_count; p++) {
            const struct render_pass *const pass = &render_effects[e]->passes[p];
            for (int r = 0; r < RENDER_PASS_READS; r++) {
                assert_true(!pass->reads[r] || render_texture_find(pass->reads[r]));
                assert_true(!pass->reads_if_written[r] || render_texture_find(pass->reads_if_written[r]));
            }
            for (int w = 0; w < RENDER_PASS_WRITES; w++)
                assert_true(!pass->writes[w] || render_texture_find(pass->writes[w]));
            assert_true(!pass->depth_written || render_texture_find(pass->depth_written));
            assert_true(!pass->depth_tested || render_texture_find(pass->depth_tested));
        }
    }
    assert_null(render_texture_find("nonsense"));
}

/* ---- accuracy ----------------------------------------------------------------------------------- */

/* T11 of patches h_mm apart; and T82 of such up to h_mm wide, whose profile was averaged over a Gaussian.
 */
static double waves_of_points(const dipole_coefficients *k, double h_mm)
{
    return 4 * dipole_spectrum(k, 2 * acos(-1) / h_mm) / dipole_spectrum(k, 0);
}

static double waves_of_patches(const dipole_coefficients *k, double h_mm, double spread_mm)
{
    double worst = 0;
    for (double width_mm = h_mm; width_mm > 0.4 * h_mm; width_mm *= 0.99) {
        const double f_per_mm = 2 * acos(-1) / width_mm,
                     beyond_mm2 = width_mm * width_mm / 12 - spread_mm * spread_mm;
        const double seen =
            exp(-0.5 * pow(spread_mm * f_per_mm, 2)) * fabs(1 - 0.5 * beyond_mm2 * f_per_mm * f_per_mm);
        worst = fmax(worst, seen * waves_of_points(k, width_mm));
    }
    return worst;
}

/* Oracle: the closed forms of libdipole, which the plan must meet channel by channel. */
static void the_error_budget_is_kept(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = skin1();
    scene_init(&test, 400);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 32, 80, 0, &material));
    test.scene.camera.width_px = 3200; /* so fine that a blur would be seen */
    test.scene.camera.height_px = 2400;
    scene_add_directional(&test, -1, -1, -1, 3);
    const double epsilons[] = { 0.1, 0.01, 0.001, 1e-4 };
    for (int i = 0; i < 4; i++) {
        struct render_request request = request_for(&test);
        request.epsilon = epsilons[i];
        struct render_plan *const plan = plan_for(&request);
        double tail = 0, points = 0, patches = 0;
        for (int c = 0; c < 3; c++) {
            dipole_coefficients k;
            assert_true(dipole_coefficients_init(&material.layers[c][0].medium, &k, NULL));
            tail = fmax(tail, dipole_tail_fraction(&k, plan->r_max_mm));
            points = fmax(points, waves_of_points(&k, plan->spacing_mm));
            patches = fmax(patches, waves_of_patches(&k, plan->spacing_mm, 0.212 * plan->spacing_mm));
        }
        assert_close(tail, 0.02 * epsilons[i], 1e-6, "tail at epsilon %g", epsilons[i]);
        assert_true(points <= fmax(0.58 * epsilons[i], 0.01) * (1 + 1e-6));
        assert_true(patches <= 0.58 * epsilons[i] * 1.02); /* between widths that are looked at */
        if (plan->note_count == 0)
            assert_true(plan->error_predicted <= epsilons[i] * (1 + 1e-6));
        assert_close(
            plan->error_predicted,
            plan->truncation_error + plan->table_error +
                sqrt(pow(plan->aliasing_error, 2) + pow(plan->blur_error, 2) + pow(plan->banding_error, 2)),
            1e-12, "sum at epsilon %g", epsilons[i]);
        render_plan_destroy(plan);
    }
    scene_end(&test);
}

static const char *dearest_of(const struct render_plan *plan)
{
    size_t dearest = 0;
    for (size_t e = 1; e < plan->effect_count; e++)
        dearest = plan->decisions[e].cost_ms > plan->decisions[dearest].cost_ms ? e : dearest;
    return render_effects[dearest]->name;
}

/* Oracle: the definition. The error that a budget buys is the least of those a tenth of a decade apart that
 * are within it; where none is, the plan says so and names what is dearest. */
static void a_budget_buys_the_least_error_within_it(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    test.scene.camera.width_px = 800;
    test.scene.camera.height_px = 600;
    static const double budgets_ms[] = { 1, 160, 180, 200, 1e6 };
    double epsilon_before = RENDER_EPSILON_MAX;
    for (int i = 0; i < 5; i++) {
        struct render_request request = request_for(&test);
        request.budget_ms = budgets_ms[i];
        assert_true(render_plan_spend_budget(&request, NULL));
        struct render_plan *plan = plan_for(&request);
        const double cost_ms = render_plan_cost_ms(plan);
        print_message("  %g ms: epsilon %.3g, predicted %.3g ms\n", budgets_ms[i], plan->epsilon, cost_ms);
        assert_true(plan->epsilon == request.epsilon && plan->epsilon <= epsilon_before);
        assert_true(plan->budget_ms == budgets_ms[i]);
        if (cost_ms > budgets_ms[i]) {
            assert_true(i == 0 && plan->epsilon == RENDER_EPSILON_MAX);
            assert_non_null(strstr(plan->notes[0], "a budget of 1 ms cannot be kept"));
            assert_non_null(strstr(plan->notes[0], dearest_of(plan)));
        } else {
            assert_int_equal(plan->note_count, 1);
        }
        assert_non_null(strstr(plan->notes[plan->note_count - 1], "accuracy --calibrate"));
        epsilon_before = plan->epsilon;
        render_plan_destroy(plan);
        if (request.epsilon > RENDER_BUDGET_EPSILON_MIN && i > 0) {
            request.epsilon /= 1.26;
            request.budget_ms = 0;
            plan = plan_for(&request);
            assert_true(render_plan_cost_ms(plan) > budgets_ms[i]);
            render_plan_destroy(plan);
        }
    }
    assert_true(epsilon_before == RENDER_BUDGET_EPSILON_MIN);
    struct render_request request = request_for(&test);
    const double epsilon = request.epsilon;
    assert_true(render_plan_spend_budget(&request, NULL));
    assert_true(request.epsilon == epsilon); /* without one nothing is searched for */
    scene_end(&test);
}

/* Oracle: the definition. Where scattering stays within a pixel, neither gathering nor splats are called
 * for; nor is gathering for an error that single precision and cubics cannot keep. */
static void auto_takes_lambert_when_scattering_is_under_a_pixel(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    struct render_request request = request_for(&test);
    struct render_plan *near_plan = plan_for(&request);
    assert_int_equal(near_plan->technique, RENDER_TECHNIQUE_GATHER);
    request.epsilon = 0.001;
    struct render_plan *fine_plan = plan_for(&request);
    assert_int_equal(fine_plan->technique, RENDER_TECHNIQUE_SPLAT);
    render_plan_destroy(fine_plan);
    request.epsilon = RENDER_EPSILON_DEFAULT;
    test.scene.camera.eye_mm[2] = 40000;
    struct render_plan *far_plan = plan_for(&request);
    assert_true(far_plan->r_max_px < 1);
    assert_int_equal(far_plan->technique, RENDER_TECHNIQUE_LAMBERT);
    request.keeps_negligible = true;
    struct render_plan *kept_plan = plan_for(&request);
    assert_int_equal(kept_plan->technique, RENDER_TECHNIQUE_GATHER);
    render_plan_destroy(kept_plan);
    request.keeps_negligible = false;
    request.technique = RENDER_TECHNIQUE_SPLAT;
    struct render_plan *asked_plan = plan_for(&request);
    assert_int_equal(asked_plan->technique, RENDER_TECHNIQUE_SPLAT);
    render_plan_destroy(near_plan);
    render_plan_destroy(far_plan);
    render_plan_destroy(asked_plan);
    scene_end(&test);
}

/* Oracle: the definition. Samples 0.1 mm apart want more texels than the least, shadows that pixels 2 mm
 * wide show do not. */
static void views_for_shadows_are_as_fine_as_the_picture(void **state)
{
    (void)state;
    const dipole_medium narrow = { .sigma_a_per_mm = 1.2, .sigma_s_prime_per_mm = 20, .eta = 1.3 };
    struct io_material material = { .name = "narrow" };
    struct test_scene test;
    io_material_set_media(&material, (const dipole_medium[]){ narrow, narrow, narrow });
    scene_init(&test, 200);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 32, 40, 0, &material));
    scene_add_directional(&test, 0, 0, -1, 3);
    struct render_request request = request_for(&test);
    request.technique = RENDER_TECHNIQUE_LAMBERT;
    struct render_plan *const lambert_plan = plan_for(&request);
    request.technique = RENDER_TECHNIQUE_GATHER;
    struct render_plan *const gather_plan = plan_for(&request);
    assert_true(lambert_plan->views[0].size_px < 1024);
    assert_true(gather_plan->views[0].size_px > 2048);
    render_plan_destroy(lambert_plan);
    render_plan_destroy(gather_plan);
    scene_end(&test);
}

/* Oracle: T45. Cells no wider than 0.7 of the spacing, as many texels to each as make 768 in all or four,
 * no more; parallel light and a point light that is far away alike. They are drawn in memory where OpenGL
 * is software, as a whole where shaders read them. */
static void texels_of_views_follow_need(void **state)
{
    (void)state;
    for (int i = 0; i < 60; i++) {
        struct test_scene test;
        init_sphere(&test);
        test.scene.light_count = (size_t)(i % 2 == 0);
        if (test.scene.light_count == 0)
            scene_add_point(&test, 3e3, 5e3, 4e3, 1e6);
        struct render_request request = request_for(&test);
        request.technique = RENDER_TECHNIQUE_GATHER;
        request.spacing_mm = 0.05 * exp2(i / 10.0);
        struct render_plan *plan = plan_for(&request);
        const struct render_projection *const view = &plan->views[0].projection;
        const double wide_mm = 2 * view->half_width * (view->is_orthographic ? 1 : view->far_mm),
                     cells = wide_mm / (0.7 * plan->spacing_mm);
        const int size_px = plan->views[0].size_px;
        assert_true(size_px >= 4 * cells && size_px >= 768);
        assert_true(size_px <= fmax(4 * (cells + 1), 768 + cells + 1));
        assert_true(plan->views[0].block_px <= RENDER_LIGHT_BLOCK_LIMIT);
        assert_true(plan->has_light_pictures && !decision_of(plan, "light_view")->is_active &&
                    !decision_of(plan, "light_picture")->is_active);
        render_plan_destroy(plan);
        test.objects[0].has_specular = true;
        plan = plan_for(&request);
        assert_true(!decision_of(plan, "light_view")->is_active &&
                    decision_of(plan, "light_picture")->is_active);
        render_plan_destroy(plan);
        request.has_gpu = true;
        plan = plan_for(&request);
        assert_true(decision_of(plan, "light_view")->is_active &&
                    !decision_of(plan, "light_picture")->is_active);
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* Oracle: the list of what reads it. Nothing scatters: what lights see is drawn for gloss alone. */
static void nothing_is_drawn_for_a_black_medium(void **state)
{
    (void)state;
    struct io_material black = skin1();
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        black.layers[c][0].medium.sigma_s_prime_per_mm = 0;
    for (int technique = 0; technique < 2; technique++) {
        struct test_scene test;
        scene_init(&test, 400);
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 32, 80, 0, &black));
        scene_add_directional(&test, -1, -1, -1, 3);
        struct render_request request = request_for(&test);
        request.technique = technique == 0 ? RENDER_TECHNIQUE_LAMBERT : RENDER_TECHNIQUE_GATHER;
        for (int is_glossy = 0; is_glossy < 2; is_glossy++) {
            test.objects[0].has_specular = is_glossy;
            struct render_plan *const plan = plan_for(&request);
            assert_int_equal(decision_of(plan, "light_picture")->is_active, is_glossy);
            assert_false(decision_of(plan, "light_view")->is_active);
            render_plan_destroy(plan);
        }
        scene_end(&test);
    }
}

/* Oracle: 4096 texels over 2000 mm are too coarse for marble: the plan says so, blurs and predicts more. */
static void a_light_view_that_is_too_coarse_is_told(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = marble();
    scene_init(&test, 5000);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 1000, 0, &material));
    test.scene.camera.fov_y_rad = 0.005; /* a blur would be seen */
    scene_add_directional(&test, 0, 0, -1, 3);
    struct render_request request = request_for(&test);
    request.technique = RENDER_TECHNIQUE_SPLAT;
    struct render_plan *const plan = plan_for(&request);
    assert_int_equal(plan->views[0].size_px, 4096);
    assert_int_equal(plan->note_count, 1);
    assert_non_null(strstr(plan->notes[0],
                           "light samples of material \"marble\" are 0.49 mm apart, 0.341 mm "
                           "were asked"));
    assert_true(plan->aliasing_error <= plan->aliasing_epsilon * (1 + 1e-6));
    assert_true(plan->of_medium[0].blur_mm[2] > 0 && plan->blur_error > 0);
    render_plan_destroy(plan);
    scene_end(&test);
}

/* Oracle: a table's own numbers. A coarse one is used and told; one of another medium is refused. */
static void the_callers_table_counts(void **state)
{
    (void)state;
    struct test_scene test;
    const struct io_material material = skin1();
    scene_init(&test, 400);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 16, 80, 0, &material));
    scene_add_directional(&test, 0, 0, -1, 3);
    struct render_request request = request_for(&test);
    struct lut_splat *coarse = NULL, *other = NULL;
    const struct io_material another = marble();
    assert_true(lut_splat_bake(
        &(struct lut_request){ .materials = &material, .material_count = 1, .epsilon = 0.05 }, &coarse,
        NULL));
    assert_true(
        lut_splat_bake(&(struct lut_request){ .materials = &another, .material_count = 1, .epsilon = 0.05 },
                       &other, NULL));
    const struct render_table coarse_table = { coarse, 0 }, other_table = { other, 0 };
    request.tables = &coarse_table;
    struct render_plan *plan = plan_for(&request);
    assert_int_equal(plan->note_count, 1);
    assert_non_null(strstr(plan->notes[0], "the table of material \"skin1\" was baked with epsilon 0.05"));
    assert_true(plan->r_max_mm <= coarse->rows[0].axis.r_max_mm);
    assert_true(plan->error_predicted > 0.01);
    render_plan_destroy(plan);
    request.tables = &other_table;
    dipole_status status;
    assert_false(render_plan_create(&request, &plan, &status));
    assert_null(plan);
    assert_non_null(strstr(
        status.message, "the table is of another medium than material \"skin1\": its sigma_a_per_mm in R "
                        "is 0.0021, the scene's 0.032 (material_hash "));
    lut_splat_destroy(coarse);
    lut_splat_destroy(other);
    scene_end(&test);
}

/* ---- views -------------------------------------------------------------------------------------- */

/* Clip coordinates over w. */
static void project(const struct render_projection *projection, const double position_mm[3], double ndc[3])
{
    float m[16];
    render_projection_matrix(projection, m);
    double clip[4];
    for (int row = 0; row < 4; row++) {
        clip[row] = (double)m[12 + row];
        for (int k = 0; k < 3; k++)
            clip[row] += (double)m[4 * k + row] * position_mm[k];
    }
    for (int k = 0; k < 3; k++)
        ndc[k] = clip[k] / clip[3];
}

/* Oracle: a light must see the whole scene: every vertex lies in the view, or in exactly one cube face. */
static void every_vertex_is_in_a_lights_view(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 60; i++) {
        struct test_scene test;
        const struct io_material material = marble();
        scene_init(&test, 60);
        assert_true(scene_add(&test, IO_PRIMITIVE_TORUS, 24, 5, uniform(&rng, -5, 5), &material));
        const double x = uniform(&rng, -1, 1), y = uniform(&rng, -1, 1), z = uniform(&rng, -1, 1);
        const double distance_mm = i % 3 == 1 ? 4 : 40;
        if (i % 3 == 0)
            scene_add_directional(&test, x, y, z, 1);
        else
            scene_add_point(&test, distance_mm * x, distance_mm * y, distance_mm * z, 1);
        const struct render_request request = request_for(&test);
        struct render_plan *const plan = plan_for(&request);
        assert_true(plan->view_count == 1 || plan->view_count == 6);
        assert_true(i % 3 != 1 || plan->view_count == 6 || distance_mm > 3);
        const struct io_mesh *const mesh = test.objects[0].mesh;
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            int seen = 0;
            for (size_t view = 0; view < plan->view_count; view++) {
                double position_mm[3], in_view_mm[3], ndc[3];
                for (size_t k = 0; k < 3; k++)
                    position_mm[k] = (double)mesh->positions[3 * v + k];
                render_projection_to_view(&plan->views[view].projection, position_mm, in_view_mm);
                project(&plan->views[view].projection, position_mm, ndc);
                seen += in_view_mm[2] > 0 && fabs(ndc[0]) <= 1 && fabs(ndc[1]) <= 1 && fabs(ndc[2]) <= 1;
            }
            assert_int_equal(seen, 1);
        }
        render_plan_destroy(plan);
        scene_end(&test);
    }
}

/* Oracle: points of the ball itself, thousands of them: all of those before the eye fall in the rectangle,
 * and those on its rim come near every side that is not the picture's. */
static void the_rectangle_of_a_ball_holds_it_tightly(void **state)
{
    (void)state;
    struct rng rng = { .seed = 8 };
    for (int i = 0; i < 300; i++) {
        struct render_projection camera = { .is_orthographic = i % 4 == 0, .near_mm = 0.01, .far_mm = 100 };
        const double forward[3] = { 0.6, 0, -0.8 }, up[3] = { 0, 1, 0 };
        render_projection_aim(&camera, forward, up);
        camera.half_height = camera.is_orthographic ? 20 : 0.6;
        camera.half_width = 1.3 * camera.half_height;
        double centre_mm[3], rectangle[4], low[2] = { 2, 2 }, high[2] = { -2, -2 };
        for (int k = 0; k < 3; k++)
            centre_mm[k] = uniform(&rng, -15, 15);
        const double radius_mm = log_uniform(&rng, 0.1, 10);
        const bool is_seen = render_projection_bound_sphere(&camera, centre_mm, radius_mm, rectangle);
        for (int j = 0; j < 4000; j++) {
            const double z = uniform(&rng, -1, 1), angle = uniform(&rng, 0, 2 * acos(-1));
            const double position_mm[3] = { centre_mm[0] + radius_mm * sqrt(1 - z * z) * cos(angle),
                                            centre_mm[1] + radius_mm * sqrt(1 - z * z) * sin(angle),
                                            centre_mm[2] + radius_mm * z };
            double in_view_mm[3];
            render_projection_to_view(&camera, position_mm, in_view_mm);
            if (in_view_mm[2] < camera.near_mm)
                continue;
            const double w = camera.is_orthographic ? 1 : in_view_mm[2];
            const double at[2] = { in_view_mm[0] / w / camera.half_width,
                                   in_view_mm[1] / w / camera.half_height };
            if (fabs(at[0]) > 1 || fabs(at[1]) > 1)
                continue;
            assert_true(is_seen);
            for (int k = 0; k < 2; k++) {
                assert_true(at[k] >= rectangle[k] - 1e-9 && at[k] <= rectangle[k + 2] + 1e-9);
                low[k] = fmin(low[k], at[k]);
                high[k] = fmax(high[k], at[k]);
            }
        }
        double centre_in_view_mm[3];
        render_projection_to_view(&camera, centre_mm, centre_in_view_mm);
        bool is_inside = is_seen && centre_in_view_mm[2] > 2 * radius_mm;
        for (int k = 0; k < 4; k++)
            is_inside = is_inside && fabs(rectangle[k]) < 1;
        for (int k = 0; is_inside && k < 2; k++) {
            const double size = rectangle[k + 2] - rectangle[k];
            assert_true(low[k] - rectangle[k] < 0.03 * size && rectangle[k + 2] - high[k] < 0.03 * size);
        }
    }
}

/* Oracle: the samples, one by one: each is in exactly one splat, and the splat's rectangle and depth hold
 * all that the sample reaches. */
static void splats_hold_what_their_samples_reach(void **state)
{
    (void)state;
    enum { COUNT = 500 };
    struct rng rng = { .seed = 4 };
    static struct render_light_sample rows[COUNT];
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < 3; k++)
            rows[i].position_mm[k] = (float)uniform(&rng, -5, 5);
    }
    const struct render_light_samples samples = { .samples = rows, .count = COUNT };
    const struct io_camera camera = {
        .eye_mm = { 0, 0, 30 }, .up = { 0, 1, 0 }, .fov_y_rad = 1, .width_px = 80, .height_px = 60
    };
    const struct render_ball ball = { .radius_mm = 10 };
    struct render_projection projection;
    render_projection_of_camera(&camera, &ball, &projection);
    struct render_splats splats = { 0 };
    const double r_max_mm = 2;
    const struct render_splat_profile profile = { .first_node = 7 };
    assert_true(render_splats_append(&splats, &samples, 0, &projection, r_max_mm, &profile,
                                     RENDER_SPLAT_SAMPLES, NULL));
    size_t next = 0;
    for (size_t s = 0; s < splats.count; s++) {
        const struct render_splat *const splat = &splats.splats[s];
        assert_int_equal(splat->first, next);
        next += splat->count;
        for (size_t i = splat->first; i < next; i++) {
            double position_mm[3], in_view_mm[3], rectangle[4];
            for (int k = 0; k < 3; k++)
                position_mm[k] = (double)rows[i].position_mm[k];
            assert_true(render_projection_bound_sphere(&projection, position_mm, r_max_mm, rectangle));
            render_projection_to_view(&projection, position_mm, in_view_mm);
            assert_true((double)splat->rectangle[0] <= rectangle[0] + 1e-6);
            assert_true((double)splat->rectangle[1] <= rectangle[1] + 1e-6);
            assert_true((double)splat->rectangle[2] >= rectangle[2] - 1e-6);
            assert_true((double)splat->rectangle[3] >= rectangle[3] - 1e-6);
            assert_true((double)splat->depth <=
                        render_projection_linear_depth(&projection, in_view_mm[2] - r_max_mm));
        }
    }
    assert_int_equal(next, COUNT);
    render_splats_destroy(&splats);
}

/* ---- bad requests ------------------------------------------------------------------------------- */

/* Oracle: the messages. */
static void options_of_maps_that_contradict_are_told(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    struct render_request request = request_for(&test);
    request.technique = RENDER_TECHNIQUE_TSM;
    request.tsm.layer_count = 3;
    fails_with(&request, "3 layers, expected an even number up to 16");
    request.tsm = (struct render_tsm_options){ .response = RENDER_TSM_TEXELS, .part = RENDER_TSM_LOCAL };
    fails_with(&request,
               "response \"texels\" sums all texels at each fragment: it has no parts, no vertices "
               "and no layers");
    scene_end(&test);
}

/* Oracle: the messages, which must name the limits. */
static void bad_requests_are_told(void **state)
{
    (void)state;
    struct test_scene test;
    init_sphere(&test);
    struct render_request request = request_for(&test);
    request.epsilon = 2;
    fails_with(&request, "epsilon is 2, expected 1e-05 to 0.5");
    request.epsilon = NAN;
    fails_with(&request, "epsilon is nan, expected 1e-05 to 0.5");
    request.epsilon = 0.01;
    test.scene.camera.width_px = 16384;
    test.scene.camera.height_px = 16384;
    fails_with(&request,
               "the picture is 16384x16384, expected sides of 1 to 16384 and at most 16777216 pixels");
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_effect_is_called_for_by_some_scene_only),
        cmocka_unit_test(a_dark_scene_needs_no_light_passes),
        cmocka_unit_test(a_texture_read_before_it_is_written_fails_the_plan),
        cmocka_unit_test(maps_are_of_lights_and_objects),
        cmocka_unit_test(passes_per_view_are_repeated_together),
        cmocka_unit_test(every_texture_has_a_row),
        cmocka_unit_test(the_error_budget_is_kept),
        cmocka_unit_test(a_budget_buys_the_least_error_within_it),
        cmocka_unit_test(auto_takes_lambert_when_scattering_is_under_a_pixel),
        cmocka_unit_test(views_for_shadows_are_as_fine_as_the_picture),
        cmocka_unit_test(texels_of_views_follow_need),
        cmocka_unit_test(nothing_is_drawn_for_a_black_medium),
        cmocka_unit_test(a_light_view_that_is_too_coarse_is_told),
        cmocka_unit_test(the_callers_table_counts),
        cmocka_unit_test(every_vertex_is_in_a_lights_view),
        cmocka_unit_test(the_rectangle_of_a_ball_holds_it_tightly),
        cmocka_unit_test(splats_hold_what_their_samples_reach),
        cmocka_unit_test(options_of_maps_that_contradict_are_told),
        cmocka_unit_test(bad_requests_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
