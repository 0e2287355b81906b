#include "renderer/execute.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    SAMPLES_PER_PIXEL = 4,
    PROGRAM_LIMIT = 32,
    TEXTURE_LIMIT = 24,
    DEFINES_SIZE = 256,
    /* Units of the buffers; textures that a pass reads take those from 0. */
    UNIT_SAMPLES = 14,
    UNIT_TABLE = 15,
};

struct program {
    const struct render_pass *pass;
    char defines[DEFINES_SIZE];
    GLuint handle;
};

struct texture {
    const struct render_texture *kind;
    GLuint handle;
    int width_px, height_px;
    bool is_used;    /* by the plan that runs           */
    bool is_written; /* by a pass of the plan that runs */
};

/* A buffer that shaders read as a texture. */
struct buffer_texture {
    GLuint buffer, texture;
};

/* One object's arrays. */
struct mesh {
    GLuint vertex_array, buffers[3];
    GLsizei index_count;
    double roughness; /* 0: no gloss */
};

struct render_executor {
    struct render_gl_errors *errors;
    struct mesh *meshes;
    size_t mesh_count;
    GLuint empty_vertex_array, splat_vertex_array, splat_buffer;
    struct program programs[PROGRAM_LIMIT];
    size_t program_count;
    struct texture textures[TEXTURE_LIMIT];
    size_t texture_count;
    struct buffer_texture sample_buffer, table_buffer;
    struct render_light_samples samples[RENDER_BAND_LIMIT]; /* of each band */
    size_t splat_count;
};

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* ---- buffers ------------------------------------------------------------------------------------ */

static void mesh_create(struct mesh *mesh, const struct io_object *object)
{
    const struct io_mesh *const source = object->mesh;
    const void *const data[3] = { source->positions, source->normals, source->indices };
    const size_t sizes[3] = { source->vertex_count * 3 * sizeof(float),
                              source->vertex_count * 3 * sizeof(float),
                              source->triangle_count * 3 * sizeof(uint32_t) };
    glCreateVertexArrays(1, &mesh->vertex_array);
    glCreateBuffers(3, mesh->buffers);
    for (int i = 0; i < 3; i++)
        glNamedBufferStorage(mesh->buffers[i], (GLsizeiptr)sizes[i], data[i], 0);
    for (GLuint i = 0; i < 2; i++) { /* locations 0: position_mm, 1: normal */
        glVertexArrayVertexBuffer(mesh->vertex_array, i, mesh->buffers[i], 0, 3 * sizeof(float));
        glVertexArrayAttribFormat(mesh->vertex_array, i, 3, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(mesh->vertex_array, i, i);
        glEnableVertexArrayAttrib(mesh->vertex_array, i);
    }
    glVertexArrayElementBuffer(mesh->vertex_array, mesh->buffers[2]);
    mesh->index_count = (GLsizei)(source->triangle_count * 3);
    mesh->roughness = object->has_specular ? object->roughness : 0;
}

static void splat_array_create(struct render_executor *executor)
{
    const GLuint array_count = 1;
    glCreateVertexArrays((GLsizei)array_count, &executor->splat_vertex_array);
    const GLuint array = executor->splat_vertex_array;
    glVertexArrayAttribFormat(array, 0, 4, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, rectangle));
    glVertexArrayAttribFormat(array, 1, 1, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, depth));
    glVertexArrayAttribIFormat(array, 2, 2, GL_UNSIGNED_INT, offsetof(struct render_splat, first));
    glVertexArrayAttribFormat(array, 3, 4, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, centre_mm));
    glVertexArrayBindingDivisor(array, 0, 1);
    for (GLuint i = 0; i < 4; i++) {
        glVertexArrayAttribBinding(array, i, 0);
        glEnableVertexArrayAttrib(array, i);
    }
}

static void buffer_texture_destroy(struct buffer_texture *buffer)
{
    glDeleteTextures(1, &buffer->texture);
    glDeleteBuffers(1, &buffer->buffer);
    *buffer = (struct buffer_texture){ 0 };
}

static void buffer_texture_fill(struct buffer_texture *buffer, GLenum format, const void *data, size_t size)
{
    buffer_texture_destroy(buffer);
    glCreateBuffers(1, &buffer->buffer);
    glNamedBufferStorage(buffer->buffer, (GLsizeiptr)size, data, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &buffer->texture);
    glTextureBuffer(buffer->texture, format, buffer->buffer);
}

bool render_executor_create(const struct io_scene *scene, struct render_gl_errors *errors,
                            struct render_executor **executor_out, dipole_status *status)
{
    *executor_out = NULL;
    struct render_executor *const executor = calloc(1, sizeof *executor);
    struct mesh *const meshes = calloc(scene->object_count, sizeof *meshes);
    if (!executor || !meshes) {
        free(executor);
        free(meshes);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu objects",
                           scene->object_count);
    }
    executor->errors = errors;
    executor->meshes = meshes;
    executor->mesh_count = scene->object_count;
    for (size_t i = 0; i < scene->object_count; i++)
        mesh_create(&meshes[i], &scene->objects[i]);
    glCreateVertexArrays(1, &executor->empty_vertex_array);
    splat_array_create(executor);
    if (!render_gl_check(errors, "upload of the meshes", status)) {
        render_executor_destroy(executor);
        return false;
    }
    *executor_out = executor;
    return true;
}

void render_executor_destroy(struct render_executor *executor)
{
    if (!executor)
        return;
    for (size_t i = 0; i < executor->mesh_count; i++) {
        glDeleteVertexArrays(1, &executor->meshes[i].vertex_array);
        glDeleteBuffers(3, executor->meshes[i].buffers);
    }
    for (size_t i = 0; i < executor->program_count; i++)
        glDeleteProgram(executor->programs[i].handle);
    for (size_t i = 0; i < executor->texture_count; i++)
        glDeleteTextures(1, &executor->textures[i].handle);
    buffer_texture_destroy(&executor->sample_buffer);
    buffer_texture_destroy(&executor->table_buffer);
    glDeleteBuffers(1, &executor->splat_buffer);
    glDeleteVertexArrays(1, &executor->splat_vertex_array);
    glDeleteVertexArrays(1, &executor->empty_vertex_array);
    for (int b = 0; b < RENDER_BAND_LIMIT; b++)
        render_light_samples_destroy(&executor->samples[b]);
    free(executor->meshes);
    free(executor);
}

/* ---- programs ----------------------------------------------------------------------------------- */

/* "#define HAS_RADIOSITY\n" and the like, for each optional texture that the plan writes. */
static void list_defines(const struct render_plan *plan, const struct render_pass *pass,
                         char defines[DEFINES_SIZE])
{
    int used = 0;
    defines[0] = '\0';
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads_if_written[r]; r++) {
        if (!render_plan_writes(plan, pass->reads_if_written[r]))
            continue;
        char name[48];
        size_t i = 0;
        for (; pass->reads_if_written[r][i] && i + 1 < sizeof name; i++) {
            const char c = pass->reads_if_written[r][i];
            name[i] = c >= 'a' && c <= 'z' ? (char)(c - 'a' + 'A') : c;
        }
        name[i] = '\0';
        if (used < DEFINES_SIZE)
            used += snprintf(defines + used, DEFINES_SIZE - (size_t)used, "#define HAS_%s\n", name);
    }
}

static bool program_for(struct render_executor *executor, const struct render_plan *plan,
                        const struct render_pass *pass, GLuint *program_out, dipole_status *status)
{
    char defines[DEFINES_SIZE];
    list_defines(plan, pass, defines);
    for (size_t i = 0; i < executor->program_count; i++) {
        const struct program *const known = &executor->programs[i];
        if (known->pass == pass && strcmp(known->defines, defines) == 0) {
            *program_out = known->handle;
            return true;
        }
    }
    if (executor->program_count == PROGRAM_LIMIT)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "more than %d shader programs",
                           PROGRAM_LIMIT);
    char vertex_name[64], fragment_name[64];
    snprintf(vertex_name, sizeof vertex_name, "%s.vert",
             pass->draw == RENDER_DRAW_FULLSCREEN ? "fullscreen" : pass->name);
    snprintf(fragment_name, sizeof fragment_name, "%s.frag", pass->name);
    const struct render_shader *const vertex = render_shader_find(vertex_name);
    const struct render_shader *const fragment = render_shader_find(fragment_name);
    if (!vertex || !fragment)
        return dipole_fail(status, DIPOLE_NOT_FOUND, NULL, "no shader %s",
                           vertex ? fragment_name : vertex_name);
    struct program *const program = &executor->programs[executor->program_count];
    if (!render_program_create(vertex, fragment, defines, &program->handle, status))
        return false;
    glObjectLabel(GL_PROGRAM, program->handle, -1, pass->name);
    program->pass = pass;
    memcpy(program->defines, defines, sizeof defines);
    executor->program_count++;
    *program_out = program->handle;
    return true;
}

/* ---- textures ----------------------------------------------------------------------------------- */

static struct texture *texture_find(const struct render_executor *executor, const char *name)
{
    for (size_t i = 0; i < executor->texture_count; i++) {
        if (strcmp(executor->textures[i].kind->name, name) == 0)
            return (struct texture *)&executor->textures[i];
    }
    return NULL;
}

static void texture_size(const struct render_plan *plan, const struct render_texture *kind, int *width_px,
                         int *height_px)
{
    *width_px = plan->width_px;
    *height_px = plan->height_px;
    if (kind->size == RENDER_SIZE_LIGHT_VIEW) {
        int largest = 1;
        for (size_t v = 0; v < plan->view_count; v++)
            largest = plan->views[v].size_px > largest ? plan->views[v].size_px : largest;
        *width_px = *height_px = largest;
    }
}

/* Make a texture that the plan writes, or take the one there is when its size still fits. */
static bool texture_want(struct render_executor *executor, const struct render_plan *plan, const char *name,
                         dipole_status *status)
{
    struct texture *texture = texture_find(executor, name);
    if (!texture) {
        if (executor->texture_count == TEXTURE_LIMIT)
            return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "more than %d textures", TEXTURE_LIMIT);
        texture = &executor->textures[executor->texture_count++];
        *texture = (struct texture){ .kind = render_texture_find(name) }; /* the row may be an old one's */
    }
    const struct render_texture *const kind = texture->kind;
    int width_px, height_px;
    texture_size(plan, kind, &width_px, &height_px);
    texture->is_used = true;
    if (kind->format == RENDER_ON_CPU ||
        (texture->handle && texture->width_px == width_px && texture->height_px == height_px))
        return true;
    glDeleteTextures(1, &texture->handle);
    const GLenum format = kind->format == RENDER_DEPTH32F ? GL_DEPTH_COMPONENT32F : GL_RGBA32F;
    if (kind->is_multisampled) {
        glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &texture->handle);
        glTextureStorage2DMultisample(texture->handle, SAMPLES_PER_PIXEL, format, width_px, height_px,
                                      GL_TRUE);
    } else {
        glCreateTextures(GL_TEXTURE_2D, 1, &texture->handle);
        glTextureStorage2D(texture->handle, 1, format, width_px, height_px);
        glTextureParameteri(texture->handle, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(texture->handle, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    glObjectLabel(GL_TEXTURE, texture->handle, -1, name);
    texture->width_px = width_px;
    texture->height_px = height_px;
    return render_gl_check(executor->errors, name, status);
}

static bool prepare_textures(struct render_executor *executor, const struct render_plan *plan,
                             dipole_status *status)
{
    for (size_t i = 0; i < executor->texture_count; i++)
        executor->textures[i].is_used = executor->textures[i].is_written = false;
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        for (size_t w = 0; w < RENDER_PASS_WRITES && pass->writes[w]; w++) {
            if (!texture_want(executor, plan, pass->writes[w], status))
                return false;
        }
        if (pass->depth_written && !texture_want(executor, plan, pass->depth_written, status))
            return false;
    }
    size_t kept = 0;
    for (size_t i = 0; i < executor->texture_count; i++) {
        if (executor->textures[i].is_used)
            executor->textures[kept++] = executor->textures[i];
        else
            glDeleteTextures(1, &executor->textures[i].handle);
    }
    executor->texture_count = kept;
    return true;
}

GLuint render_executor_texture(const struct render_executor *executor, const char *texture)
{
    const struct texture *const found = texture_find(executor, texture);
    return found ? found->handle : 0;
}

/* ---- light samples ------------------------------------------------------------------------------ */

bool render_executor_sample_light_view(const struct render_frame *frame, dipole_status *status)
{
    const struct render_plan_view *const view = frame->view;
    const size_t texel_count = (size_t)view->size_px * (size_t)view->size_px;
    const struct io_light *const light = &frame->request->scene->lights[view->light];
    float *const texels = malloc(texel_count * 4 * sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory for a light's view of %d texels a side", view->size_px);
    glGetTextureSubImage(render_executor_texture(frame->executor, "light_view"), 0, 0, 0, 0, view->size_px,
                         view->size_px, 1, GL_RGBA, GL_FLOAT, (GLsizei)(texel_count * 4 * sizeof *texels),
                         texels);
    struct render_light_view reduced = { .texels = texels,
                                         .size_px = view->size_px,
                                         .levels = view->levels };
    memcpy(reduced.forward, view->projection.forward, sizeof reduced.forward);
    memcpy(reduced.rgb, light->rgb, sizeof reduced.rgb);
    const bool done = render_light_samples_append(&frame->executor->samples[0], &reduced,
                                                  frame->plan->spacing_mm, status);
    free(texels);
    return done;
}

static bool draw_band(const struct render_frame *frame, int band, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    const struct render_light_samples *const samples = &executor->samples[band];
    const double reach_mm = frame->plan->bands[band].r_outer_mm;
    struct render_splats splats;
    if (!render_splats_create(samples, &frame->plan->camera, reach_mm, &splats, status))
        return false;
    executor->splat_count += splats.count;
    if (splats.count > 0) {
        buffer_texture_fill(&executor->sample_buffer, GL_RGBA32F, samples->samples,
                            samples->count * sizeof *samples->samples);
        glBindTextureUnit(UNIT_SAMPLES, executor->sample_buffer.texture);
        render_set_int(frame->program, "light_samples", UNIT_SAMPLES);
        render_set_float(frame->program, "reach2_mm2", reach_mm * reach_mm);
        glDeleteBuffers(1, &executor->splat_buffer);
        glCreateBuffers(1, &executor->splat_buffer);
        glNamedBufferStorage(executor->splat_buffer, (GLsizeiptr)(splats.count * sizeof *splats.splats),
                             splats.splats, 0);
        glVertexArrayVertexBuffer(executor->splat_vertex_array, 0, executor->splat_buffer, 0,
                                  sizeof *splats.splats);
        glBindVertexArray(executor->splat_vertex_array);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)splats.count);
    }
    render_splats_destroy(&splats);
    return true;
}

static bool draw_splats(const struct render_frame *frame, const struct lut_splat *table,
                        dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    const struct lut_axis axis = render_bands_axis(table);
    const int node_count = axis.node_count;
    const double end = axis.r_max_mm / axis.scale_mm;
    float *const nodes = render_bands_bake(table, plan->bands, plan->band_count);
    if (!nodes)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d bands of %d nodes",
                           plan->band_count, node_count);
    buffer_texture_fill(&frame->executor->table_buffer, GL_RGBA32F, nodes,
                        (size_t)plan->band_count * (size_t)node_count * 4 * sizeof *nodes);
    free(nodes);
    glBindTextureUnit(UNIT_TABLE, frame->executor->table_buffer.texture);
    render_set_int(frame->program, "profile_table", UNIT_TABLE);
    render_set_int(frame->program, "profile_last_node", node_count - 1);
    render_set_float(frame->program, "profile_inverse_scale2", 1 / (axis.scale_mm * axis.scale_mm));
    render_set_float(frame->program, "profile_nodes_per_log2", (node_count - 1) / log2(1 + end * end));
    bool done = true;
    for (int b = 0; done && b < plan->band_count; b++) {
        struct render_light_samples *const samples = frame->executor->samples;
        if (b > 0 &&
            !render_light_samples_merge(&samples[b - 1], plan->bands[b].spacing_mm, &samples[b], status))
            return false;
        render_set_int(frame->program, "profile_first_node", b * node_count);
        done = draw_band(frame, b, status);
    }
    return done;
}

struct render_light_samples *render_executor_samples(struct render_executor *executor)
{
    return &executor->samples[0];
}

size_t render_executor_splat_count(const struct render_executor *executor)
{
    return executor->splat_count;
}

size_t render_executor_program_count(const struct render_executor *executor)
{
    return executor->program_count;
}

/* ---- passes ------------------------------------------------------------------------------------- */

static void bind_textures(const struct render_frame *frame, const struct render_pass *pass)
{
    int unit = 0;
    for (size_t list = 0; list < 2; list++) {
        const char *const *const names = list ? pass->reads_if_written : pass->reads;
        for (size_t r = 0; r < RENDER_PASS_READS && names[r]; r++) {
            const GLuint texture = render_executor_texture(frame->executor, names[r]);
            if (!texture)
                continue;
            glBindTextureUnit((GLuint)unit, texture);
            render_set_int(frame->program, names[r], unit++);
        }
    }
}

/* Where no surface is, a light sees one infinitely far away: nothing there casts a shadow. */
static void far_point(const struct render_plan_view *view, float value[4])
{
    for (int k = 0; k < 3; k++)
        value[k] = (float)(view->projection.eye_mm[k] +
                           1e6 * view->projection.far_mm * view->projection.forward[k]);
    value[3] = 0;
}

static bool attach_targets(const struct render_frame *frame, const struct render_pass *pass,
                           GLuint framebuffer, dipole_status *status)
{
    GLenum buffers[RENDER_PASS_WRITES];
    GLsizei buffer_count = 0;
    for (size_t w = 0; w < RENDER_PASS_WRITES && pass->writes[w]; w++) {
        struct texture *const target = texture_find(frame->executor, pass->writes[w]);
        const GLenum attachment = GL_COLOR_ATTACHMENT0 + (GLenum)w;
        glNamedFramebufferTexture(framebuffer, attachment, target->handle, 0);
        buffers[buffer_count++] = attachment;
    }
    const char *const depth_name = pass->depth_written ? pass->depth_written : pass->depth_tested;
    if (depth_name)
        glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT,
                                  render_executor_texture(frame->executor, depth_name), 0);
    glNamedFramebufferDrawBuffers(framebuffer, buffer_count, buffers);
    if (glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "pass \"%s\": incomplete framebuffer",
                           pass->name);
    for (size_t w = 0; w < RENDER_PASS_WRITES && pass->writes[w]; w++) {
        struct texture *const target = texture_find(frame->executor, pass->writes[w]);
        float value[4] = { 0, 0, 0, 0 };
        if (target->kind->size == RENDER_SIZE_LIGHT_VIEW)
            far_point(frame->view, value);
        if (!pass->is_added || !target->is_written)
            glClearNamedFramebufferfv(framebuffer, GL_COLOR, (GLint)w, value);
        target->is_written = true;
    }
    if (pass->depth_written) {
        const float farthest = 1;
        glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
    }
    return true;
}

static void set_state(const struct render_frame *frame, const struct render_pass *pass)
{
    const struct render_texture *const target = render_texture_find(pass->writes[0]);
    const bool is_light_view = target->size == RENDER_SIZE_LIGHT_VIEW;
    glViewport(0, 0, is_light_view ? frame->view->size_px : frame->plan->width_px,
               is_light_view ? frame->view->size_px : frame->plan->height_px);
    (pass->is_added ? glEnable : glDisable)(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    (pass->depth_written || pass->depth_tested ? glEnable : glDisable)(GL_DEPTH_TEST);
    glDepthMask(pass->depth_written ? GL_TRUE : GL_FALSE);
    glDepthFunc(pass->draw == RENDER_DRAW_FULLSCREEN ? GL_ALWAYS : GL_LESS);
    glDisable(GL_CULL_FACE);
}

static void draw_scene(const struct render_frame *frame)
{
    for (size_t i = 0; i < frame->executor->mesh_count; i++) {
        const struct mesh *const mesh = &frame->executor->meshes[i];
        render_set_float(frame->program, "roughness", mesh->roughness);
        glBindVertexArray(mesh->vertex_array);
        glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    }
}

static bool run_pass(struct render_frame *frame, const struct render_pass *pass,
                     const struct lut_splat *table, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (pass->draw == RENDER_DRAW_NOTHING)
        return pass->run(frame, status) && render_gl_check(executor->errors, pass->name, status);
    if (!program_for(executor, frame->plan, pass, &frame->program, status))
        return false;
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    set_state(frame, pass); /* before the targets are cleared: what is masked is not */
    bool done = attach_targets(frame, pass, framebuffer, status);
    if (done) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glUseProgram(frame->program);
        bind_textures(frame, pass);
        if (pass->bind)
            pass->bind(frame);
        if (pass->draw == RENDER_DRAW_SCENE) {
            draw_scene(frame);
        } else if (pass->draw == RENDER_DRAW_SPLATS) {
            done = draw_splats(frame, table, status);
        } else {
            glBindVertexArray(executor->empty_vertex_array);
            glDrawArrays(GL_TRIANGLES, 0, 3);
        }
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
    }
    glDeleteFramebuffers(1, &framebuffer);
    glFinish(); /* timer queries are wrong by orders of magnitude on software renderers */
    return done && render_gl_check(executor->errors, pass->name, status);
}

bool render_executor_run(struct render_executor *executor, const struct render_request *request,
                         const struct render_plan *plan, const struct lut_splat *table,
                         double time_ms[RENDER_EFFECT_LIMIT], dipole_status *status)
{
    memset(time_ms, 0, RENDER_EFFECT_LIMIT * sizeof *time_ms);
    for (int b = 0; b < RENDER_BAND_LIMIT; b++)
        executor->samples[b].count = 0;
    executor->splat_count = 0;
    if (!prepare_textures(executor, plan, status))
        return false;
    bool done = true;
    for (size_t i = 0; done && i < plan->pass_count; i++) {
        const struct render_plan_pass *const row = &plan->passes[i];
        struct render_frame frame = { .executor = executor, .request = request, .plan = plan };
        if (row->pass->is_per_view)
            frame.view = &plan->views[row->view];
        const double start_ms = now_ms();
        done = run_pass(&frame, row->pass, table, status);
        time_ms[row->effect] += now_ms() - start_ms;
    }
    return done;
}

bool render_executor_read(struct render_executor *executor, const char *texture, float *pixels,
                          dipole_status *status)
{
    const struct texture *const source = texture_find(executor, texture);
    const size_t row = (size_t)source->width_px * 4;
    float *const swap = malloc(row * sizeof *swap);
    if (!swap)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a row of %d pixels",
                           source->width_px);
    glGetTextureSubImage(source->handle, 0, 0, 0, 0, source->width_px, source->height_px, 1, GL_RGBA,
                         GL_FLOAT, (GLsizei)(row * (size_t)source->height_px * sizeof *pixels), pixels);
    for (int top = 0, bottom = source->height_px - 1; top < bottom; top++, bottom--) {
        float *const a = pixels + row * (size_t)top, *const b = pixels + row * (size_t)bottom;
        memcpy(swap, a, row * sizeof *swap);
        memcpy(a, b, row * sizeof *swap);
        memcpy(b, swap, row * sizeof *swap);
    }
    free(swap);
    return render_gl_check(executor->errors, "reading the picture back", status);
}
