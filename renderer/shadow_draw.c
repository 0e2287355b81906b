#include "renderer/shadow_draw.h"

#include "renderer/area_light.h"
#include "renderer/crossings.h"
#include "renderer/shadow_resolve.h"
#include "renderer/shadow_taps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Surfaces in a list: at first, and at most; beyond, the map is drawn strip by strip. */
enum { FIRST_ITEMS = 1 << 18, MOST_ITEMS = 1 << 23, HEADER_SIZE = 8 };

struct blocker {
    GLuint vertex_array, vertex_buffer, index_buffer;
};

struct render_shadower {
    const struct io_scene *scene;
    struct blocker *blockers;
    GLuint list_program, list_buffer, ranges;
    size_t item_limit;
    int ranges_px;
    double nearest_mm; /* of the view that was drawn last: what blocks is no nearer; 0: nothing does */
    struct render_buffer_texture nodes, taps;
    int tap_count; /* that were made; 0: none, or those of a request */
};

/* ---- blockers ------------------------------------------------------------------------------------ */

static void take_blocker(const struct io_blocker *source, struct blocker *blocker)
{
    const struct io_mesh *const mesh = source->mesh;
    glCreateBuffers(1, &blocker->vertex_buffer);
    glNamedBufferStorage(blocker->vertex_buffer, (GLsizeiptr)(3 * mesh->vertex_count * sizeof(float)),
                         mesh->positions, source->motion ? GL_DYNAMIC_STORAGE_BIT : 0);
    glCreateVertexArrays(1, &blocker->vertex_array);
    glVertexArrayVertexBuffer(blocker->vertex_array, 0, blocker->vertex_buffer, 0, 3 * sizeof(float));
    glVertexArrayAttribFormat(blocker->vertex_array, 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(blocker->vertex_array, 0, 0);
    glEnableVertexArrayAttrib(blocker->vertex_array, 0);
    if (source->particle_mm > 0) { /* a square for each */
        glVertexArrayBindingDivisor(blocker->vertex_array, 0, 1);
        return;
    }
    glCreateBuffers(1, &blocker->index_buffer);
    glNamedBufferStorage(blocker->index_buffer, (GLsizeiptr)(3 * mesh->triangle_count * sizeof(uint32_t)),
                         mesh->indices, 0);
    glVertexArrayElementBuffer(blocker->vertex_array, blocker->index_buffer);
}

bool render_shadower_create(const struct io_scene *scene, struct render_shadower **shadower_out,
                            dipole_status *status)
{
    *shadower_out = NULL;
    struct render_shadower *const shadower = calloc(1, sizeof *shadower);
    struct blocker *const blockers = calloc(scene->blocker_count + 1, sizeof *blockers);
    if (!shadower || !blockers) {
        free(shadower);
        free(blockers);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu blockers",
                           scene->blocker_count);
    }
    shadower->scene = scene;
    shadower->blockers = blockers;
    for (size_t i = 0; i < scene->blocker_count; i++)
        take_blocker(&scene->blockers[i], &blockers[i]);
    *shadower_out = shadower;
    return true;
}

void render_shadower_destroy(struct render_shadower *shadower)
{
    if (!shadower)
        return;
    for (size_t i = 0; i < shadower->scene->blocker_count; i++) {
        glDeleteVertexArrays(1, &shadower->blockers[i].vertex_array);
        glDeleteBuffers(1, &shadower->blockers[i].vertex_buffer);
        glDeleteBuffers(1, &shadower->blockers[i].index_buffer);
    }
    glDeleteProgram(shadower->list_program);
    glDeleteBuffers(1, &shadower->list_buffer);
    glDeleteTextures(1, &shadower->ranges);
    render_buffer_texture_destroy(&shadower->nodes);
    render_buffer_texture_destroy(&shadower->taps);
    free(shadower->blockers);
    free(shadower);
}

bool render_shadower_has_program(const struct render_shadower *shadower)
{
    return shadower->list_program != 0;
}

static void draw_blocker(const struct render_frame *frame, const struct render_shadower *shadower,
                         GLuint program, size_t index)
{
    const struct io_blocker *const source = &shadower->scene->blockers[index];
    render_set_float(program, "particle_mm", source->particle_mm);
    glBindVertexArray(shadower->blockers[index].vertex_array);
    if (source->particle_mm > 0)
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)source->mesh->vertex_count);
    else
        glDrawElements(GL_TRIANGLES, (GLsizei)(3 * source->mesh->triangle_count), GL_UNSIGNED_INT, NULL);
    render_count_draw(frame);
}

/* Those that are deformed or move lie elsewhere in each frame. */
static void pose_blockers(const struct render_shadower *shadower)
{
    for (size_t i = 0; i < shadower->scene->blocker_count; i++) {
        const struct io_blocker *const source = &shadower->scene->blockers[i];
        if (source->motion)
            glNamedBufferSubData(shadower->blockers[i].vertex_buffer, 0,
                                 (GLsizeiptr)(3 * source->mesh->vertex_count * sizeof(float)),
                                 source->mesh->positions);
    }
}

/* ---- uniforms ------------------------------------------------------------------------------------ */

static const struct render_plan_shadow *shadow_of(const struct render_frame *frame)
{
    const struct render_plan *const plan = frame->plan;
    for (size_t i = 0; i < plan->map_count; i++) {
        if (frame->view == &plan->maps[i])
            return &plan->shadows.of_map[i];
    }
    return &plan->shadows.of_view[frame->view - plan->views];
}

static void set_map(const struct render_frame *frame, GLuint program)
{
    const struct render_plan_shadow *const shadow = shadow_of(frame);
    render_set_light(program, &frame->request->scene->lights[frame->view->light]);
    render_set_matrix(program, "view_projection", &shadow->projection);
    render_set_vec3(program, "shadow_eye_mm", shadow->projection.eye_mm);
    render_set_vec3(program, "shadow_forward", shadow->projection.forward);
    render_set_int(program, "shadow_size_px", shadow->size_px);
}

void render_shadow_bind_map(const struct render_frame *frame)
{
    set_map(frame, frame->program);
}

void render_shadow_bind_nearest(const struct render_frame *frame)
{
    const struct render_projection *const projection = &shadow_of(frame)->projection;
    render_set_float(frame->program, "shadow_half_width",
                     projection->is_orthographic ? 0 : projection->half_width);
}

/* Pixels of a view that is width_px wide, for turns that are fixed to the surface. */
static void set_turn(const struct render_frame *frame, const struct render_projection *seen,
                     double width_px)
{
    const double pixel = 2 * seen->half_width / width_px;
    render_set_int(frame->program, "shadow_turn_kind", (int)frame->request->shadows.turn);
    render_set_float(frame->program, "shadow_pixel_mm", seen->is_orthographic ? pixel : 0);
    render_set_vec4(frame->program, "shadow_pixel_eye_mm", seen->eye_mm[0], seen->eye_mm[1],
                    seen->eye_mm[2], seen->is_orthographic ? 0 : pixel);
}

void render_set_shadow(const struct render_frame *frame, const struct render_projection *seen,
                       double width_px)
{
    if (!frame->plan->shadows.of_view)
        return;
    const struct render_plan_shadow *const shadow = shadow_of(frame);
    const struct io_light *const light = &frame->request->scene->lights[frame->view->light];
    const GLuint program = frame->program;
    double inner = -2, outer = -2;
    set_turn(frame, seen, width_px);
    render_set_vec3(program, "shadow_eye_mm", shadow->projection.eye_mm);
    render_set_vec3(program, "shadow_right", shadow->projection.right);
    render_set_vec3(program, "shadow_up", shadow->projection.up);
    render_set_vec3(program, "shadow_forward", shadow->projection.forward);
    render_set_int(program, "shadow_size_px", shadow->size_px);
    render_set_float(program, "shadow_half_width", shadow->projection.half_width);
    render_set_float(program, "shadow_light_size", shadow->light_size);
    render_set_float(program, "shadow_nearest_blocker_mm",
                     render_executor_shadower(frame->executor)->nearest_mm);
    render_set_int(program, "shadow_tap_count", frame->plan->shadows.tap_count);
    if (light->is_spot)
        render_light_spot_cosines(light, &inner, &outer);
    render_set_vec4(program, "light_cone", light->direction[0], light->direction[1], light->direction[2],
                    outer);
    render_set_float(program, "light_cone_inner", inner);
}

bool render_shadow_find_nearest(const struct render_frame *frame, dipole_status *status)
{
    const int side_px = (shadow_of(frame)->size_px + RENDER_SHADOW_BLOCK - 1) / RENDER_SHADOW_BLOCK;
    const size_t count = (size_t)side_px * (size_t)side_px;
    struct render_shadower *shadower;
    if (!render_executor_need_shadower(frame, &shadower, status))
        return false;
    float *const blocks = malloc(count * sizeof *blocks);
    if (!blocks)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu depths of blockers",
                           count);
    glGetTextureImage(render_executor_texture(frame->executor, "shadow_nearest"), 0, GL_RED, GL_FLOAT,
                      (GLsizei)(count * sizeof *blocks), blocks);
    double nearest_mm = INFINITY;
    for (size_t i = 0; i < count; i++)
        nearest_mm = blocks[i] > 0 ? fmin(nearest_mm, (double)blocks[i]) : nearest_mm;
    shadower->nearest_mm = isfinite(nearest_mm) ? nearest_mm : 0;
    free(blocks);
    return true;
}

/* ---- opaque surfaces ----------------------------------------------------------------------------- */

bool render_shadow_draw_map(const struct render_frame *frame, dipole_status *status)
{
    struct render_shadower *shadower;
    if (!render_executor_need_shadower(frame, &shadower, status))
        return false;
    if (frame->view == frame->plan->views || frame->view == frame->plan->maps)
        pose_blockers(shadower);
    render_set_float(frame->program, "particle_mm", 0);
    for (size_t i = 0; i < frame->request->scene->object_count; i++) {
        if (!frame->plan->shadows.casters.lets_through[i])
            render_draw_object(frame, i);
    }
    for (size_t i = 0; i < shadower->scene->blocker_count; i++) {
        if (render_blocker_is_opaque(&shadower->scene->blockers[i]))
            draw_blocker(frame, shadower, frame->program, i);
    }
    return true;
}

/* ---- others -------------------------------------------------------------------------------------- */

static bool need_list(struct render_shadower *shadower, size_t item_limit, dipole_status *status)
{
    if (!shadower->list_program &&
        !render_program_create(render_shader_find("avsm_list.vert"), render_shader_find("avsm_list.frag"),
                               "", &shadower->list_program, status))
        return false;
    if (item_limit <= shadower->item_limit)
        return true;
    glDeleteBuffers(1, &shadower->list_buffer);
    glCreateBuffers(1, &shadower->list_buffer);
    glNamedBufferStorage(shadower->list_buffer,
                         (GLsizeiptr)(HEADER_SIZE + item_limit * sizeof(struct render_shadow_item)), NULL,
                         GL_DYNAMIC_STORAGE_BIT | GL_MAP_READ_BIT);
    shadower->item_limit = item_limit;
    return true;
}

/* Draw rows first to end - 1 into the list; returns how many surfaces there are, which may be more than it
 * holds. */
static size_t draw_list(const struct render_frame *frame, struct render_shadower *shadower, int first,
                        int end)
{
    const int size_px = shadow_of(frame)->size_px;
    const GLuint program = shadower->list_program, nothing[2] = { 0, 0 };
    GLuint count = 0;
    glNamedBufferSubData(shadower->list_buffer, 0, sizeof nothing, nothing);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, shadower->list_buffer);
    glProgramUniform1ui(program, glGetUniformLocation(program, "item_limit"), (GLuint)shadower->item_limit);
    glScissor(0, first, size_px, end - first);
    for (size_t i = 0; i < shadower->scene->blocker_count; i++) {
        const struct io_blocker *const blocker = &shadower->scene->blockers[i];
        if (!render_blocker_is_there(blocker) || render_blocker_is_opaque(blocker))
            continue;
        render_set_int(program, "blocker", (int)i);
        draw_blocker(frame, shadower, program, i);
    }
    const struct render_casters *const casters = &frame->plan->shadows.casters;
    struct render_frame listed = *frame;
    listed.program = program;
    render_set_float(program, "particle_mm", 0);
    for (size_t i = casters->blocker_count; i < casters->count; i++) {
        render_set_int(program, "blocker", (int)i);
        render_draw_object(&listed, casters->objects[i - casters->blocker_count]);
    }
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    glGetNamedBufferSubData(shadower->list_buffer, 0, sizeof count, &count);
    return count;
}

/* What does not fit into the largest list is drawn in two halves. */
static bool add_rows(const struct render_frame *frame, struct render_shadower *shadower,
                     struct render_shadow_curves *curves, int first, int end, dipole_status *status)
{
    size_t count = draw_list(frame, shadower, first, end);
    if (count > shadower->item_limit && shadower->item_limit < MOST_ITEMS) {
        const size_t wanted = count + count / 4;
        if (!need_list(shadower, wanted < MOST_ITEMS ? wanted : MOST_ITEMS, status))
            return false;
        count = draw_list(frame, shadower, first, end);
    }
    if (count > shadower->item_limit && end - first > 1) {
        const int middle = (first + end) / 2;
        return add_rows(frame, shadower, curves, first, middle, status) &&
               add_rows(frame, shadower, curves, middle, end, status);
    }
    if (count > shadower->item_limit)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "blockers have %zu surfaces in one row of a light's view, expected at most %zu",
                           count, shadower->item_limit);
    if (count == 0)
        return true;
    const char *const list = glMapNamedBufferRange(
        shadower->list_buffer, 0, (GLsizeiptr)(HEADER_SIZE + count * sizeof(struct render_shadow_item)),
        GL_MAP_READ_BIT);
    if (!list)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu surfaces of blockers",
                           count);
    const bool done =
        render_shadow_curves_add(curves, (const void *)(list + HEADER_SIZE), count, first, end, status);
    glUnmapNamedBuffer(shadower->list_buffer);
    return done;
}

static void upload(const struct render_frame *frame, struct render_shadower *shadower,
                   const struct render_shadow_curves *curves)
{
    static const float none[4] = { 0, 0, 0, 0 };
    const int size_px = curves->size_px;
    const size_t node_size = (curves->has_colour ? 4 : 2) * sizeof(float);
    if (shadower->ranges_px != size_px) {
        glDeleteTextures(1, &shadower->ranges);
        glCreateTextures(GL_TEXTURE_2D, 1, &shadower->ranges);
        glTextureStorage2D(shadower->ranges, 1, GL_RGBA32F, size_px, size_px);
        glTextureParameteri(shadower->ranges, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(shadower->ranges, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        shadower->ranges_px = size_px;
    }
    glTextureSubImage2D(shadower->ranges, 0, 0, 0, size_px, size_px, GL_RGBA, GL_FLOAT, curves->ranges);
    render_buffer_texture_fill(&shadower->nodes, curves->has_colour ? GL_RGBA32F : GL_RG32F,
                               curves->node_count > 0 ? curves->nodes : none,
                               curves->node_count > 0 ? curves->node_count * node_size : sizeof none);
    render_executor_hand_on(frame->executor, "avsm_ranges", shadower->ranges);
    render_executor_hand_on(frame->executor, "avsm_nodes", shadower->nodes.texture);
}

static bool fill_curves(const struct render_frame *frame, struct render_shadower *shadower,
                        struct render_shadow_curves *curves, dipole_status *status)
{
    const int size_px = curves->size_px;
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferParameteri(framebuffer, GL_FRAMEBUFFER_DEFAULT_WIDTH, size_px);
    glNamedFramebufferParameteri(framebuffer, GL_FRAMEBUFFER_DEFAULT_HEIGHT, size_px);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, size_px, size_px);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_CLAMP); /* what is behind all surfaces closes what is in front of them */
    glEnable(GL_SCISSOR_TEST);
    glUseProgram(shadower->list_program);
    set_map(frame, shadower->list_program);
    const bool done = add_rows(frame, shadower, curves, 0, size_px, status);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &framebuffer);
    return done;
}

bool render_shadow_make_curves(const struct render_frame *frame, dipole_status *status)
{
    const struct render_plan_shadow *const shadow = shadow_of(frame);
    struct render_shadower *shadower;
    if (!render_executor_need_shadower(frame, &shadower, status) ||
        !need_list(shadower, FIRST_ITEMS, status))
        return false;
    struct render_shadow_curves curves = { .blockers = frame->plan->shadows.casters.casters,
                                           .size_px = shadow->size_px,
                                           .node_limit = frame->plan->shadows.node_limit,
                                           .has_colour = frame->plan->shadows.coloured_count > 0,
                                           .half_width = shadow->projection.half_width,
                                           .is_parallel = shadow->projection.is_orthographic };
    const bool done =
        render_shadow_curves_begin(&curves, status) && fill_curves(frame, shadower, &curves, status);
    if (done)
        upload(frame, shadower, &curves);
    render_shadow_curves_destroy(&curves);
    return done;
}

/* Nodes have three channels where this is written; there is nothing to keep. */
bool render_shadow_mark_colour(const struct render_frame *frame, dipole_status *status)
{
    (void)frame;
    (void)status;
    return true;
}

/* ---- taps ---------------------------------------------------------------------------------------- */

static bool upload_taps(struct render_shadower *shadower, const double (*given)[2], int count,
                        dipole_status *status)
{
    double(*const places)[2] = malloc((size_t)count * sizeof *places);
    float(*const taps)[2] = malloc((size_t)count * sizeof *taps);
    bool done = places && taps;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d taps", count);
    if (done && given)
        memcpy(places, given, (size_t)count * sizeof *places);
    else if (done)
        done = render_shadow_taps(count, places, status);
    for (int i = 0; done && i < count; i++) {
        for (int k = 0; k < 2; k++)
            taps[i][k] = (float)places[i][k];
    }
    if (done) {
        render_buffer_texture_fill(&shadower->taps, GL_RG32F, taps, (size_t)count * sizeof *taps);
        shadower->tap_count = given ? 0 : count;
    }
    free(places);
    free(taps);
    return done;
}

bool render_shadow_fill_taps(const struct render_frame *frame, dipole_status *status)
{
    const double(*const given)[2] = frame->request->shadows.taps;
    const int count = frame->plan->shadows.tap_count;
    struct render_shadower *shadower;
    if (!render_executor_need_shadower(frame, &shadower, status) ||
        ((given || shadower->tap_count != count) && !upload_taps(shadower, given, count, status)))
        return false;
    render_executor_hand_on(frame->executor, "shadow_taps", shadower->taps.texture);
    return true;
}
