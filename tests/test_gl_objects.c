/* What a picture costs: textures, buffers, programs, vertex arrays and draw calls, counted in OpenGL itself
 * and compared with the plan. What is not called for costs nothing. */
#include "check.h"
#include "scenes.h"

#include "io/scene_motion.h"
#include "renderer/renderer.h"

enum { NAME_LIMIT = 4096 };

static const enum render_technique techniques[] = { RENDER_TECHNIQUE_AUTO, RENDER_TECHNIQUE_SPLAT,
                                                    RENDER_TECHNIQUE_LAMBERT, RENDER_TECHNIQUE_TSM,
                                                    RENDER_TECHNIQUE_GATHER };

/* Objects that effects keep by themselves, beside what stands in the table of textures. */
static const struct kept {
    const char *effect;
    size_t texture_count, buffer_count, vertex_array_count, program_count;
    bool is_per_medium;
} kept_by_effects[] = {
    /* the one object at rest */
    { .effect = "deform", .buffer_count = 2, .vertex_array_count = 1, .program_count = 1 },
    { .effect = "surface", .texture_count = 1, .buffer_count = 1 },    /* the objects' gloss           */
    { .effect = "object_ids", .texture_count = 1, .buffer_count = 1 }, /* the media                     */
    { .effect = "light_samples", .vertex_array_count = 1 },            /* of the splats                 */
    { .effect = "splat", .texture_count = 2, .buffer_count = 3 },      /* samples, profiles; and splats */
    { .effect = "overlap", .texture_count = 2, .buffer_count = 3 },    /* the same                      */
    /* samples, profiles and lists; tiles; levels of pixels */
    { .effect = "gather_gl", .texture_count = 4, .buffer_count = 4, .vertex_array_count = 1 },
    { .effect = "avsm",
      .texture_count = 2,
      .buffer_count = 2,
      .program_count = 1 },                                             /* ranges, nodes, the list */
    { .effect = "soft_shadow", .texture_count = 1, .buffer_count = 1 }, /* taps */
    { .effect = "environment_lambert", .texture_count = 1, .buffer_count = 1 }, /* irradiance */
    { .effect = "environment_peel", .texture_count = 1 }, /* the layer before         */
    { .effect = "tsm_table", .texture_count = 4, .buffer_count = 2, .is_per_medium = true },
    { .effect = "tsm_exact", .texture_count = 2, .buffer_count = 2, .is_per_medium = true },
    { .effect = "tsm_peel", .texture_count = 1 },   /* layers                        */
    { .effect = "tsm_vertex", .texture_count = 1 }, /* vertices                      */
};

struct counts {
    size_t textures, buffers, programs, shaders, vertex_arrays, framebuffers;
};

static struct counts count_objects(void)
{
    struct counts counts = { 0 };
    for (GLuint name = 1; name <= NAME_LIMIT; name++) {
        counts.textures += glIsTexture(name) == GL_TRUE;
        counts.buffers += glIsBuffer(name) == GL_TRUE;
        counts.programs += glIsProgram(name) == GL_TRUE;
        counts.shaders += glIsShader(name) == GL_TRUE;
        counts.vertex_arrays += glIsVertexArray(name) == GL_TRUE;
        counts.framebuffers += glIsFramebuffer(name) == GL_TRUE;
    }
    return counts;
}

static bool is_first_use(const struct render_plan *plan, size_t index)
{
    for (size_t i = 0; i < index; i++) {
        if (plan->passes[i].pass == plan->passes[index].pass)
            return false;
    }
    return true;
}

/* Whether that texture is one more than those of earlier passes, and the renderer's to make. */
static bool is_new_texture(const struct render_plan *plan, size_t index, const char *name)
{
    const char *writes[RENDER_PASS_TARGETS + 1];
    if (render_texture_find(name)->format == RENDER_OTHER)
        return false;
    for (size_t i = 0; i < index; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        render_plan_list_writes(plan, pass, writes);
        for (size_t w = 0; writes[w]; w++) {
            if (strcmp(writes[w], name) == 0)
                return false;
        }
        if (pass->depth_written && strcmp(pass->depth_written, name) == 0)
            return false;
    }
    return true;
}

static struct counts expected_counts(const struct render_plan *plan, size_t object_count)
{
    /* indices of each object; vertices and triangles of all, which are textures, too */
    struct counts counts = { .buffers = object_count + 3,
                             .textures = 3,
                             .vertex_arrays = object_count + 1 };
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        const char *writes[RENDER_PASS_TARGETS + 1];
        render_plan_list_writes(plan, pass, writes);
        counts.programs += pass->draw != RENDER_DRAW_NOTHING && is_first_use(plan, i);
        for (size_t w = 0; writes[w]; w++)
            counts.textures += is_new_texture(plan, i, writes[w]);
        counts.textures += pass->depth_written && is_new_texture(plan, i, pass->depth_written);
    }
    for (size_t e = 0; render_effects[e]; e++) {
        for (size_t i = 0; i < sizeof kept_by_effects / sizeof *kept_by_effects; i++) {
            const struct kept *const kept = &kept_by_effects[i];
            if (!plan->decisions[e].is_active || strcmp(kept->effect, render_effects[e]->name) != 0)
                continue;
            const size_t times = kept->is_per_medium ? plan->media->count : 1;
            counts.textures += times * kept->texture_count;
            counts.buffers += times * kept->buffer_count;
            counts.vertex_arrays += kept->vertex_array_count;
            counts.programs += kept->program_count;
        }
    }
    return counts;
}

/* least: where views that no sample comes from draw nothing. */
static size_t expected_draws(const struct render_plan *plan, size_t effect, size_t object_count,
                             size_t *least)
{
    size_t count = 0, maybe_count = 0;
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        const bool is_pose = strcmp(pass->name, "pose_deformed") == 0; /* which draws into buffers */
        if (plan->passes[i].effect != effect || (pass->draw == RENDER_DRAW_NOTHING && !is_pose))
            continue;
        count += pass->draw == RENDER_DRAW_SCENE ? object_count : 1; /* all splats at once */
        maybe_count += pass->draw == RENDER_DRAW_BY_RUN && pass->is_per_view;
    }
    *least = count - maybe_count;
    return count;
}

/* No program or texture bears the name. */
static void assert_absent(GLenum kind, const char *name)
{
    for (GLuint i = 1; i <= NAME_LIMIT; i++) {
        char label[64] = "";
        if ((kind == GL_PROGRAM ? glIsProgram(i) : glIsTexture(i)) == GL_TRUE)
            glGetObjectLabel(kind, i, sizeof label, NULL, label);
        if (strcmp(label, name) == 0)
            fail_msg("there is a %s %s", kind == GL_PROGRAM ? "program" : "texture", name);
    }
}

/* Effects may share a pass's name, and with it the shader. */
static bool has_pass(const struct render_plan *plan, const char *name)
{
    for (size_t i = 0; i < plan->pass_count; i++) {
        if (strcmp(plan->passes[i].pass->name, name) == 0)
            return true;
    }
    return false;
}

static void check_inactive(const struct render_executor *executor, const struct render_plan *plan, size_t e)
{
    assert_int_equal(render_executor_draw_count(executor, e), 0);
    for (size_t p = 0; p < render_effects[e]->pass_count; p++) {
        const struct render_pass *const pass = &render_effects[e]->passes[p];
        const char *writes[RENDER_PASS_TARGETS + 1];
        if (!has_pass(plan, pass->name))
            assert_absent(GL_PROGRAM, pass->name);
        render_plan_list_writes(plan, pass, writes);
        for (size_t w = 0; writes[w]; w++) {
            if (!render_plan_writes(plan, writes[w])) {
                assert_int_equal(render_executor_texture(executor, writes[w]), 0);
                assert_absent(GL_TEXTURE, writes[w]);
            }
        }
    }
}

/* Draw once with a new renderer and compare; which effects were active is added to *seen. */
static void check_request(const struct test_scene *test, struct render_request request,
                          bool seen[2][RENDER_EFFECT_LIMIT])
{
    struct renderer *renderer;
    struct render_plan *plan;
    double time_ms[RENDER_EFFECT_LIMIT];
    dipole_status status;
    if (!render_create(&test->scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    request.scene = &test->scene;
    request.media = renderer->media;
    request.epsilon = 0.05;
    if (!render_run(renderer, &request, &plan, time_ms, &status))
        fail_msg("%s", status.message);
    const size_t object_count = test->scene.object_count;
    const struct counts found = count_objects();
    struct counts expected = expected_counts(plan, object_count);
    for (size_t i = 0; plan->shadows.of_view && i < test->scene.blocker_count;
         i++) { /* particles have no triangles */
        expected.buffers += test->scene.blockers[i].particle_mm > 0 ? 1 : 2;
        expected.vertex_arrays++;
    }
    /* what is so far away that no pixel shows it has neither lists nor levels to be gathered by */
    const size_t spared = plan->gather == RENDER_GATHER_GL ? 2 : 0;
    assert_in_range(found.textures, expected.textures - spared, expected.textures);
    assert_in_range(found.buffers, expected.buffers - spared, expected.buffers);
    assert_int_equal(found.programs, expected.programs);
    assert_int_equal(found.programs, render_executor_program_count(renderer->executor));
    assert_int_equal(found.vertex_arrays, expected.vertex_arrays);
    assert_int_equal(found.shaders, 0);
    assert_int_equal(found.framebuffers, expected.framebuffers);
    for (size_t e = 0; render_effects[e]; e++) {
        seen[plan->decisions[e].is_active][e] = true;
        size_t least;
        const size_t draw_count = render_executor_draw_count(renderer->executor, e);
        const size_t most = expected_draws(plan, e, object_count, &least);
        /* a translucent shadow map draws its own object, in as many layers and parts as are asked for;
         * peeling until nothing is left; gathering, each level of pixels */
        const char *const name = render_effects[e]->name;
        if (strcmp(name, "gather_gl") == 0)
            assert_true(draw_count == 0 || most > 0);
        else if (strcmp(name, "avsm") == 0 || strcmp(name, "tsm_avsm") == 0) /* draw what is seen nowhere */
            assert_int_equal(draw_count > 0, plan->decisions[e].is_active);
        else if (strncmp(name, "tsm_", 4) == 0 || strcmp(name, "environment_peel") == 0 ||
                 strcmp(name, "shadow_map") == 0)
            assert_int_equal(draw_count > 0, most > 0);
        else
            assert_true(draw_count >= least && draw_count <= most);
        if (!plan->decisions[e].is_active) {
            check_inactive(renderer->executor, plan, e);
            assert_true(time_ms[e] == 0);
        }
    }
    render_plan_destroy(plan);
    render_destroy(renderer);
}

/* Scenes that call for different effects. */
enum {
    SCENE_DARK,
    SCENE_LIT,
    SCENE_GLOSSY,
    SCENE_BLACK,
    SCENE_TWO,
    SCENE_NEAR_LIGHT,
    SCENE_FAR,
    SCENE_MOVING,
    SCENE_COUNT
};

static void init_scene(struct test_scene *test, int kind)
{
    struct io_material material = marble();
    const struct io_material other = skin1();
    for (int c = 0; c < 3 && kind == SCENE_BLACK; c++) {
        material.layers[c][0].medium.sigma_s_prime_per_mm = 0;
        material.layers[c][0].medium.sigma_a_per_mm = 1;
    }
    scene_init(test, kind == SCENE_FAR ? 50000 : 40);
    assert_true(scene_add(test, IO_PRIMITIVE_SPHERE, 16, 8, 0, &material));
    test->objects[0].has_specular = kind == SCENE_GLOSSY || kind == SCENE_BLACK;
    if (kind == SCENE_MOVING) {
        static struct io_motion motion = { .track_count = 1, .key_count = 1, .stretch = 1 };
        test->scene.frames.count = 2;
        test->objects[0].motion = &motion;
        test->objects[0].pose = (struct io_pose){
            .deforms = { { .axis = { 0, 1, 0 }, .rate_rad_per_mm = 0.1 } },
            .deform_count = 1,
            .is_moved = true,
            .rotation = { { 0, 0, 1 }, { 0, 1, 0 }, { -1, 0, 0 } },
        };
    }
    if (kind == SCENE_TWO)
        assert_true(scene_add(test, IO_PRIMITIVE_CUBE, 4, 3, 10, &other));
    if (kind == SCENE_NEAR_LIGHT)
        scene_add_point(test, 0, 0, 9, 100);
    else if (kind != SCENE_DARK)
        scene_add_directional(test, -1, -1, -1, 3);
}

/* Oracle: the plan, and OpenGL's own knowledge of which names are in use. Each effect is seen both active
 * and, but for the surface, not. */
static void objects_and_draws_are_those_of_the_plan(void **state)
{
    (void)state;
    static const struct render_tsm_options maps[] = { { .layer_count = 2 },
                                                      { .response = RENDER_TSM_EXACT },
                                                      { .response = RENDER_TSM_TEXELS },
                                                      { .gather = RENDER_TSM_VERTEX } };
    bool seen[2][RENDER_EFFECT_LIMIT] = { { false } };
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        struct test_scene test;
        init_scene(&test, kind);
        for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++) {
            check_request(&test, (struct render_request){ .technique = techniques[t] }, seen);
            check_request(
                &test, (struct render_request){ .technique = techniques[t], .is_tone_mapped = true }, seen);
        }
        check_request(
            &test,
            (struct render_request){ .technique = RENDER_TECHNIQUE_GATHER, .gather = RENDER_GATHER_GL },
            seen);
        check_request(&test, (struct render_request){ .is_captured = true, .spacing_mm = 1 }, seen);
        check_request(
            &test,
            (struct render_request){ .technique = RENDER_TECHNIQUE_SPLAT, .area = RENDER_AREA_OVERLAP },
            seen);
        scene_end(&test);
    }
    for (size_t i = 0; i < sizeof maps / sizeof *maps; i++) {
        struct test_scene test;
        init_scene(&test, SCENE_LIT);
        check_request(&test, (struct render_request){ .technique = RENDER_TECHNIQUE_TSM, .tsm = maps[i] },
                      seen);
        scene_end(&test);
    }
    const struct render_request around[] = {
        { .technique = RENDER_TECHNIQUE_SPLAT, .ambient_visibility = 2 },
        { .technique = RENDER_TECHNIQUE_SPLAT, .environment_samples = RENDER_ENVIRONMENT_PEEL3 },
        { .technique = RENDER_TECHNIQUE_LAMBERT }
    };
    for (size_t i = 0; i < sizeof around / sizeof *around; i++) {
        struct test_scene test;
        init_scene(&test, SCENE_TWO);
        test.scene.has_environment = true;
        test.scene.environment.rgb[0] = 1;
        strcpy(test.scene.environment.path, SOURCE_FOLDER "/scenes/probes/studio.exr");
        check_request(&test, around[i], seen);
        scene_end(&test);
    }
    struct test_scene by_opengl;
    init_scene(&by_opengl, SCENE_LIT);
    check_request(
        &by_opengl,
        (struct render_request){ .technique = RENDER_TECHNIQUE_GATHER, .gather = RENDER_GATHER_GL }, seen);
    scene_end(&by_opengl);
    struct test_scene shadowed;
    init_scene(&shadowed, SCENE_GLOSSY);
    struct io_blocker blockers[] = {
        { .mesh = shadowed.objects[0].mesh, .opacity = { 0.1, 0.2, 0.3 } },
        { .mesh = shadowed.objects[0].mesh, .opacity = { 1, 1, 1 } },
        { .mesh = shadowed.objects[0].mesh, .opacity = { 1, 0, 1 }, .particle_mm = 1 }
    };
    shadowed.scene.blockers = blockers;
    static const enum render_technique by[] = { RENDER_TECHNIQUE_SPLAT, RENDER_TECHNIQUE_SPLAT,
                                                RENDER_TECHNIQUE_LAMBERT, RENDER_TECHNIQUE_TSM,
                                                RENDER_TECHNIQUE_GATHER };
    for (size_t i = 0; i < 5; i++) {
        shadowed.scene.blocker_count = i < 3 ? i + 1 : 1;
        shadowed.lights[0].size_rad = i == 1 || i > 2 ? 0.1 : 0;
        shadowed.objects[0].mesh->triangle_count -= i == 4; /* now it may not be convex */
        check_request(&shadowed, (struct render_request){ .technique = by[i] }, seen);
    }
    scene_end(&shadowed);
    for (size_t e = 0; render_effects[e]; e++) {
        assert_true(seen[true][e]);
        assert_true(seen[false][e] || strcmp(render_effects[e]->name, "surface") == 0);
    }
}

/* Oracle: the first picture. Drawing the same again makes nothing new, also where an object changes its
 * mesh and moves in every other picture; drawing less gives textures back. */
static void drawing_again_leaks_nothing(void **state)
{
    (void)state;
    struct test_scene test;
    struct renderer *renderer;
    dipole_status status;
    init_scene(&test, SCENE_TWO);
    struct io_mesh *const own = test.objects[0].mesh;
    test.objects[0].has_specular = true;
    if (!render_create(&test.scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    struct counts first[2] = { { 0 } };
    for (int i = 0; i < 6; i++) {
        test.objects[0].pose =
            (struct io_pose){ .is_moved = i % 2, .rotation = { { 0, 0, 1 }, { 0, 1, 0 }, { -1, 0, 0 } } };
        test.objects[0].mesh = i % 2 ? own : test.objects[1].mesh;
        const struct render_options options = { .technique = i % 2 ? RENDER_TECHNIQUE_LAMBERT
                                                                   : RENDER_TECHNIQUE_SPLAT,
                                                .epsilon = 0.05,
                                                .is_tone_mapped = i % 2 };
        struct io_image *image;
        if (!render_draw(renderer, &options, &image, NULL, &status))
            fail_msg("%s", status.message);
        io_image_destroy(image);
        const struct counts counts = count_objects();
        if (i < 2)
            first[i] = counts;
        assert_int_equal(counts.textures, first[i % 2].textures);
        assert_int_equal(counts.buffers, first[i % 2].buffers);
        assert_int_equal(counts.vertex_arrays, first[i % 2].vertex_arrays);
        assert_int_equal(counts.framebuffers, 0);
        assert_true(i < 2 || counts.programs == first[1].programs);
    }
    test.objects[0].mesh = own;
    render_destroy(renderer);
    scene_end(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(objects_and_draws_are_those_of_the_plan),
        cmocka_unit_test(drawing_again_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
